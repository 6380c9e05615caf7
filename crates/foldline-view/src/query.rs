//! Query of a request: integers and hexadecimal digits only, so nothing is decoded.

/// The part of an address after `?`.
pub(crate) struct Query<'q>(&'q str);

impl<'q> Query<'q> {
    pub(crate) fn new(query: &'q str) -> Query<'q> {
        Query(query)
    }

    /// Returns the value of a key that occurs exactly once.
    pub(crate) fn text(&self, key: &str) -> Option<&'q str> {
        let mut found = self.0.split('&').filter_map(|pair| pair.split_once('=')).filter(|(own, _)| *own == key);
        let (_, value) = found.next()?;
        found.next().is_none().then_some(value)
    }

    /// Returns an integer; `None` if it is missing or does not fit.
    pub(crate) fn integer(&self, key: &str) -> Option<i64> {
        integer(self.text(key)?)
    }

    /// Returns a list of at most `most` indices below `limit`, separated by commas; empty if the key is missing.
    pub(crate) fn indices(&self, key: &str, limit: usize, most: usize) -> Option<Vec<usize>> {
        let Some(text) = self.text(key).filter(|text| !text.is_empty()) else { return Some(Vec::new()) };
        let index = |text| integer(text).and_then(|index| usize::try_from(index).ok()).filter(|index| *index < limit);
        let found: Option<Vec<usize>> = text.split(',').take(most + 1).map(index).collect();
        found.filter(|found| found.len() <= most)
    }
}

/// Decimal digits with an optional minus sign; unlike `parse`, no plus sign.
fn integer(text: &str) -> Option<i64> {
    text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'-').then(|| text.parse().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::Query;

    #[test]
    fn integers_that_do_not_fit_are_refused() {
        let query = Query::new("a=12&b=-3&c=99999999999999999999999&d=+1&e=1e3&f=&a2=1&g=1&g=2");
        assert_eq!(query.integer("a"), Some(12));
        assert_eq!(query.integer("b"), Some(-3));
        for key in ["c", "d", "e", "f", "g", "h"] {
            assert_eq!(query.integer(key), None, "{key}");
        }
    }

    #[test]
    fn lists_are_bounded_in_length_and_value() {
        let query = Query::new("a=0,3,1&b=0,9&c=0,0,0,0&d=1,,2&e=");
        assert_eq!(query.indices("a", 4, 3), Some(vec![0, 3, 1]));
        assert_eq!(query.indices("b", 4, 3), None);
        assert_eq!(query.indices("c", 4, 3), None);
        assert_eq!(query.indices("d", 4, 3), None);
        assert_eq!(query.indices("e", 4, 3), Some(vec![]));
    }
}

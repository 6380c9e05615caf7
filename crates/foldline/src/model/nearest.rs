//! "Did you mean …?"

/// Returns the candidate closest to `word` by edit distance, if close enough to be a likely misspelling. Ties go to the
/// one closest in length, so that swapped letters rank before missing ones. Otherwise the only candidate of which the
/// word is an abbreviation: `params` for `parameters`.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    // A single letter resembles every other.
    let allowed = if length < 2 { 0 } else { (length / 3).max(1) };
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let close = candidates
        .iter()
        .copied()
        .filter(|candidate| candidate.chars().count().abs_diff(length) <= allowed)
        .map(|candidate| (distance(&folded(word), &folded(candidate)), candidate))
        .filter(|(d, _)| *d <= allowed)
        .min_by_key(|(d, candidate)| (*d, candidate.chars().count().abs_diff(length)))
        .map(|(_, candidate)| candidate);
    close.or_else(|| {
        let begin = folded(word);
        let begin = begin.strip_suffix('s').unwrap_or(&begin);
        let mut whole = candidates.into_iter().filter(|own| begin.len() >= SHORTEST && folded(own).starts_with(begin));
        whole.next().filter(|_| whole.next().is_none())
    })
}

/// Minimum number of letters of an abbreviation.
const SHORTEST: usize = 3;
/// Maximum number of candidates listed if none is close.
const LISTED: usize = 24;
/// Longer words are not compared letter by letter.
const LONGEST: usize = 64;

/// Hint that names the nearest candidate, or lists the candidates if none is close. Different letters that look alike
/// are given with their code points.
pub fn suggest(word: &str, candidates: &[&str]) -> String {
    let Some(candidate) = nearest(word, candidates.iter().copied()) else {
        return match candidates.get(..LISTED) {
            _ if candidates.is_empty() => "none is defined".to_string(),
            None => format!("one of: {}", candidates.join(", ")),
            Some(first) => format!("one of: {}, and {} more", first.join(", "), candidates.len() - LISTED),
        };
    };
    let letters = word.chars().zip(candidate.chars()).find(|(a, b)| a != b);
    match letters.filter(|(a, b)| !a.is_ascii() && a.is_alphabetic() && b.is_alphabetic()) {
        Some((a, b)) => format!("did you mean `{candidate}`? `{a}` is U+{:04X}, `{b}` is U+{:04X}", a as u32, b as u32),
        None => format!("did you mean `{candidate}`?"),
    }
}

/// Lower case, with the micro sign of keyboards as the Greek letter (the signs for ohm and ångström already have the
/// letters as their lower case).
fn folded(word: &str) -> String {
    word.to_lowercase().replace('\u{b5}', "\u{3bc}")
}

/// Number of insertions, deletions, replacements and swaps of neighbours that turn one word into the other.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows = vec![vec![0; b.len() + 1]; a.len() + 1];
    for i in 0..=a.len() {
        for j in 0..=b.len() {
            rows[i][j] = if i == 0 || j == 0 {
                i + j
            } else {
                let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
                let mut best = replaced.min(rows[i - 1][j] + 1).min(rows[i][j - 1] + 1);
                if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                    best = best.min(rows[i - 2][j - 2] + 1);
                }
                best
            };
        }
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn misspellings_are_recognised_and_other_words_are_not() {
        assert_eq!(nearest("Omgea", ["kappa", "Omega"]), Some("Omega"));
        assert_eq!(nearest("omega", ["kappa", "Omega"]), Some("Omega"));
        assert_eq!(nearest("tahn", ["tan", "tanh"]), Some("tanh"));
        assert_eq!(nearest("torque", ["kappa", "Omega"]), None);
    }

    #[test]
    fn an_abbreviation_of_one_candidate_is_recognised() {
        assert_eq!(nearest("params", ["range", "parameters", "forcing"]), Some("parameters"));
        assert_eq!(nearest("eqs", ["equations", "forcing"]), None);
        assert_eq!(nearest("par", ["parameters", "parts"]), None);
        assert_eq!(nearest("p", ["parameters", "forcing"]), None);
    }

    #[test]
    fn letters_that_look_alike_are_distinguished() {
        assert_eq!(
            suggest("\u{b5}", &["\u{3bc}", "x"]),
            "did you mean `\u{3bc}`? `\u{b5}` is U+00B5, `\u{3bc}` is U+03BC"
        );
        assert!(suggest("\u{b5}", &["x", "\u{3bc}"]).starts_with("did you mean `\u{3bc}`?"));
        assert_eq!(suggest("X", &["y", "x"]), "did you mean `x`?");
        assert_eq!(suggest("y", &["x"]), "one of: x");
    }

    #[test]
    fn long_words_and_long_lists_make_short_hints() {
        let names: Vec<String> = (0..1000).map(|i| format!("parameter_{i}")).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert!(suggest("torque", &names).ends_with("parameter_23, and 976 more"));
        assert!(suggest(&"x".repeat(1_000_000), &names).len() < 500);
    }
}

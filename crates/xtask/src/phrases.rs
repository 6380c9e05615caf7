//! Phrases that are not used in this project, and their replacements.

use crate::tree::Text;

/// Paths whose wording has not been revised yet. `cargo xtask words --all` lists hits there, but they do not fail the
/// check.
const UNREVISED: &[&str] = &["benches/results/"];

/// Phrases in lower case, each with its replacement.
const PHRASES: &[(&str, &str)] = &[
    ("a model of one's own", "your own model"),
    ("all it takes", "all you need"),
    ("anew", "again; recomputed; a new …"),
    ("are looked at", "are examined; are checked"),
    ("are wanted", "are requested"),
    ("as it is meant", "at its exact value"),
    ("asks of you", "needs"),
    ("believed", "accepted"),
    ("branches crowd", "other branches are close"),
    ("brought to other", "carried to other"),
    ("by and by", "gradually; later"),
    ("by whatever", "by any"),
    ("census", "sampling of initial conditions"),
    ("censuses", "samplings of initial conditions"),
    ("comes to a stand", "stalls"),
    ("doors to", "import and export; interfaces to"),
    ("eights", "f64x8"),
    ("for who", "for users who"),
    ("gets through", "succeeds"),
    ("goes on from", "continues from"),
    ("homecoming", "closure"),
    ("in turn", "alternately; one after the other"),
    ("in twice the precision", "in twice the working precision"),
    ("is looked at", "is examined; is checked"),
    ("is no other", "is the same; is not another"),
    ("is told so", "is reported"),
    ("is wanted", "is requested"),
    ("it is said", "it is reported; a message says"),
    ("knows nothing of", "does not know; has no built-in …"),
    ("legs of a homotopy", "runs of a homotopy"),
    ("living line", "live progress line"),
    ("lookout", "parameter scan"),
    ("mended", "fixed"),
    ("mends", "fixes"),
    ("next to no", "very little; almost no"),
    ("next to nothing", "almost nothing"),
    ("no one means", "irrelevant"),
    ("nobody", "no one; or name who"),
    ("of whatever", "of any"),
    ("point held", "point continued"),
    ("put right", "corrected"),
    ("reckoned", "estimated"),
    ("roomier", "finer"),
    ("seen to", "checked"),
    ("so many times", "the given number of times"),
    ("spoilt", "corrupted; damaged"),
    ("straddle", "interpolation at a singular point"),
    ("that are none", "that are not"),
    ("that is none", "that is not one"),
    ("that is said", "that is reported; a message says so"),
    ("the route told", "reports the path"),
    ("to the instant", "as an event"),
    ("walked", "followed; continued"),
    ("was typed", "was given on the command line"),
    ("went astray", "diverged"),
    ("were typed", "were given on the command line"),
    ("what comes out", "the result"),
    ("what was left", "the remainder"),
    ("who comes from", "users of …; if you come from …"),
    ("who reads", "the reader"),
    ("who writes", "the writer; a thread that writes"),
];

/// Openings of doc comments that are not used, each with its replacement.
const BEGINNINGS: &[(&str, &str)] = &[
    ("What ", "a noun phrase that names the thing"),
    ("Whether ", "\"True if …\" or \"Returns true if …\""),
    ("How many ", "\"Number of …\""),
    ("How ", "a noun phrase that names the thing"),
    ("The same", "a noun phrase; there is nothing above it on a documentation page"),
    ("Likewise", "a noun phrase or \"Returns …\""),
    ("Where ", "a noun phrase such as \"Position of …\", or \"Returns …\""),
];

/// Phrase that was found. The message gives position, phrase and replacement; `fails` is true in revised files.
pub struct Hit {
    pub message: String,
    pub fails: bool,
}

/// Finds phrases in prose: text outside code in Markdown, doc comments in Rust, docstrings and comments in Python, all
/// text in other files.
pub fn hits(texts: &[Text]) -> Vec<Hit> {
    let mut all = Vec::new();
    for text in texts.iter().filter(|text| !text.is(&["ipynb"])) {
        let fails = !text.lies_in(UNREVISED);
        let (prose, offsets) = prose(text);
        let mut found = Vec::new();
        for (phrase, instead) in PHRASES {
            for at in occurrences(&prose, phrase) {
                let message = format!("{}: \"{phrase}\": write \"{instead}\"", text.place(offsets[at]));
                found.push((offsets[at], message));
            }
        }
        if text.is(&["rs"]) {
            beginnings(text, |offset, message| found.push((offset, message)));
        }
        found.sort();
        all.extend(found.into_iter().map(|(_, message)| Hit { message, fails }));
    }
    all
}

/// Calls `tell` with offset and message for each doc comment with an opening that is not used.
fn beginnings(text: &Text, mut tell: impl FnMut(usize, String)) {
    let mut offset = 0;
    let mut inside = false;
    for line in text.text.split_inclusive('\n') {
        let comment = line.trim_start().strip_prefix("/// ");
        if let Some(comment) = comment.filter(|_| !inside)
            && let Some((begin, instead)) = BEGINNINGS.iter().find(|(begin, _)| comment.starts_with(begin))
        {
            tell(offset, format!("{}: \"{} …\": write {instead}", text.place(offset), begin.trim_end()));
        }
        inside = line.trim_start().starts_with("///");
        offset += line.len();
    }
}

/// Returns the byte offsets at which a phrase occurs as whole words.
fn occurrences<'t>(prose: &'t str, phrase: &'t str) -> impl Iterator<Item = usize> + 't {
    let joined = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    prose.match_indices(phrase).map(|(at, _)| at).filter(move |&at| {
        !joined(prose[..at].chars().next_back()) && !joined(prose[at + phrase.len()..].chars().next())
    })
}

/// Returns the prose of a file in lower case, with single spaces, and the offset in the file of each of its bytes.
fn prose(text: &Text) -> (String, Vec<usize>) {
    let (rust, python) = (text.is(&["rs"]), text.is(&["py"]));
    let (mut prose, mut offsets) = (String::new(), Vec::new());
    let (mut offset, mut fenced, mut quoted) = (0, false, false);
    for line in text.text.split_inclusive('\n') {
        let start = line.trim_start();
        let body = if rust {
            start.strip_prefix("///").or_else(|| start.strip_prefix("//!"))
        } else if python {
            let begins = quoted || start.starts_with("\"\"\"") || start.starts_with('#');
            quoted ^= start.matches("\"\"\"").count() % 2 == 1;
            begins.then_some(start)
        } else {
            Some(line)
        };
        let fence = body.is_some_and(|body| body.trim_start().starts_with("```"));
        fenced ^= fence;
        // A control character replaces code and paragraph breaks, so that no phrase spans them.
        let body = body.filter(|body| !fence && !fenced && !body.trim().is_empty()).unwrap_or("\u{1}");
        let begin = offset + (line.len() - body.len().min(line.len()));
        let mut code = false;
        for (at, c) in body.char_indices() {
            code ^= c == '`';
            let c = if code { '`' } else { c };
            let space = c.is_whitespace();
            if space && prose.ends_with(' ') {
                continue;
            }
            for lower in if space { ' ' } else { c }.to_lowercase() {
                prose.push(lower);
                offsets.resize(prose.len(), begin + at.min(line.len() - 1));
            }
        }
        if !prose.ends_with(' ') {
            prose.push(' ');
            offsets.push(offset);
        }
        offset += line.len();
    }
    (prose, offsets)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str, text: &str) -> Vec<String> {
        let texts = [Text { name: name.to_string(), text: text.to_string() }];
        hits(&texts).into_iter().map(|hit| hit.message).collect()
    }

    #[test]
    fn a_phrase_is_found_across_a_line_break_and_reported_where_it_begins() {
        let found = found("a.md", "First.\n\nIt grows by\nand by, é.\n");
        assert_eq!(found, ["a.md:3: \"by and by\": write \"gradually; later\""]);
    }

    #[test]
    fn phrases_in_code_and_in_parts_of_words_are_ignored() {
        assert_eq!(found("a.md", "`nobody`\n\n```text\nnobody\n```\nnobodys, mendedness\n"), [""; 0]);
        assert_eq!(found("a.rs", "let nobody = 1; // nobody\n"), [""; 0]);
        assert_eq!(found("a.py", "nobody = 1\n"), [""; 0]);
    }

    #[test]
    fn doc_comments_are_read_across_their_markers() {
        let rust = found("a.rs", "/// Whether it grows by\n/// and by.\nfn f() {}\n");
        assert_eq!(rust.len(), 2, "{rust:?}");
        assert!(rust.iter().all(|message| message.starts_with("a.rs:1: ")), "{rust:?}");
        assert_eq!(found("a.py", "def f():\n    \"\"\"Returns what nobody\n    wants.\"\"\"\n").len(), 1);
    }

    #[test]
    fn only_revised_files_fail() {
        let fails = |name: &str| {
            let texts = [Text { name: name.to_string(), text: "nobody\n".to_string() }];
            hits(&texts)[0].fails
        };
        assert!(fails("README.md") && fails("docs/book/cli.md") && fails("SECURITY.md"));
        assert!(!fails("benches/results/outside.md"));
    }
}

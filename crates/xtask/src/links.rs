//! Links, anchors and paths in Markdown files.

use crate::release::address;
use crate::root;
use crate::tree::Text;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Returns a message for each link into this repository, relative or by its address, whose file or anchor does not exist, and for each mentioned path of this
/// repository that does not exist.
pub fn broken(texts: &[Text]) -> Vec<String> {
    let pages: Vec<&Text> = texts.iter().filter(|text| text.is(&["md"])).collect();
    let own = ["blob", "raw"].map(|kind| format!("{}/{kind}/main/", address()));
    let anchors: HashMap<&str, HashSet<String>> =
        pages.iter().map(|page| (page.name.as_str(), anchors(&page.text))).collect();
    let mut found = Vec::new();
    for page in &pages {
        for (offset, target) in targets(&page.text) {
            // A page that is shown elsewhere links to files of this repository by its address.
            let file = own.iter().find_map(|start| target.strip_prefix(start));
            let fault = match file {
                Some(file) => fault("", file, &anchors),
                None => fault(&page.name, target, &anchors),
            };
            if let Some(reason) = fault {
                found.push(format!("{}: link to {target}: {reason}", page.place(offset)));
            }
        }
    }
    for text in texts {
        let folders: &[&str] = match () {
            () if text.is(&["md"]) => &["docs/", "crates/", "studies/", "models/", "python/"],
            () if text.is(&["rs", "py"]) && !text.name.starts_with("crates/xtask/") => &["docs/"],
            () => &[],
        };
        for (offset, path) in folders.iter().flat_map(|folder| mentions(&text.text, folder)) {
            if !exists(path) && !beside(&text.name, path) {
                found.push(format!("{}: {path} does not exist", text.place(offset)));
            }
        }
    }
    found
}

/// Returns the reason why a target cannot be reached from a page, if any.
fn fault(page: &str, target: &str, anchors: &HashMap<&str, HashSet<String>>) -> Option<&'static str> {
    let outside = ["http://", "https://", "mailto:"].iter().any(|scheme| target.starts_with(scheme));
    if outside {
        return None;
    }
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let file = if path.is_empty() { page.to_string() } else { joined(page, path) };
    if !path.is_empty() && !root().join(&file).exists() {
        return Some("there is no such file");
    }
    let known = anchors.get(file.as_str()).is_none_or(|anchors| anchor.is_empty() || anchors.contains(anchor));
    (!known).then_some("the page has no such heading")
}

/// Converts a path relative to the folder of a page to a path from the root.
fn joined(page: &str, path: &str) -> String {
    let mut parts: Vec<&str> = page.split('/').collect();
    parts.pop();
    for part in path.split('/') {
        match part {
            ".." => _ = parts.pop(),
            "." | "" => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

/// Returns the anchors of a page: those of its headings, as GitHub and mdBook form them, and explicit ones.
fn anchors(text: &str) -> HashSet<String> {
    let mut found = HashSet::new();
    let mut seen: HashMap<String, usize> = HashMap::new();
    for (_, line) in outside_fences(text) {
        let title = line.trim_start_matches('#');
        if title.len() < line.len() && title.starts_with(' ') {
            let slug = slug(title.trim());
            let times = seen.entry(slug.clone()).or_default();
            found.insert(if *times == 0 { slug } else { format!("{slug}-{times}") });
            *times += 1;
        }
        for piece in line.split("id=\"").skip(1) {
            found.extend(piece.split('"').next().map(str::to_string));
        }
    }
    found
}

/// Returns the anchor of a heading: lower case, hyphens for spaces, no punctuation, links replaced by their text.
fn slug(title: &str) -> String {
    let mut plain = String::new();
    let mut rest = title;
    while let Some((before, after)) = rest.split_once("](") {
        plain += before;
        rest = after.split_once(')').map_or("", |(_, after)| after);
    }
    plain += rest;
    let kept = plain.chars().filter(|c| c.is_alphanumeric() || [' ', '-', '_'].contains(c));
    kept.flat_map(char::to_lowercase).map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// Returns the targets of links, images and link definitions of a page, each with its offset.
fn targets(text: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    for (offset, line) in outside_fences(text) {
        let code = |at: usize| line[..at].matches('`').count() % 2 == 1;
        for (at, _) in line.match_indices("](").filter(|(at, _)| !code(*at)) {
            let target = line[at + 2..].split([')', ' ']).next().unwrap_or_default();
            found.push((offset + at, target));
        }
        // An image with a width.
        for (at, start) in line.match_indices("<img src=\"").filter(|(at, _)| !code(*at)) {
            found.push((offset + at, line[at + start.len()..].split('"').next().unwrap_or_default()));
        }
        if let Some((_, target)) = line.strip_prefix('[').and_then(|line| line.split_once("]: ")) {
            found.push((offset, target.trim()));
        }
    }
    found
}

/// Returns the lines outside fenced code, each with its offset.
fn outside_fences(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let (mut offset, mut fenced) = (0, false);
    text.split_inclusive('\n').filter_map(move |line| {
        let start = offset;
        offset += line.len();
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        (!fence && !fenced).then(|| (start, line.trim_end()))
    })
}

/// Returns the paths that begin with `folder`, each with its offset.
fn mentions<'t>(text: &'t str, folder: &'t str) -> impl Iterator<Item = (usize, &'t str)> {
    let part = |c: char| c.is_ascii_alphanumeric() || ['_', '.', '/', '-'].contains(&c);
    text.match_indices(folder).filter_map(move |(at, _)| {
        if text[..at].chars().next_back().is_some_and(part) {
            return None;
        }
        let end = text[at..].find(|c| !part(c)).map_or(text.len(), |length| at + length);
        let path = text[at..end].trim_end_matches(['.', '/', '-']);
        // A name in capitals is a placeholder, and so is a name followed by a bracket or an ellipsis.
        let stands_for_others = path.split(['/', '.']).any(|name| name == "DATE" || name.contains("NN"))
            || text[end..].starts_with(['*', '<', '{', '…']);
        (!stands_for_others).then_some((at, path))
    })
}

/// True if a file or folder has this path, or a name that begins with it and a hyphen.
fn exists(path: &str) -> bool {
    let place = root().join(path);
    if place.exists() {
        return true;
    }
    let (Some(folder), Some(name)) = (place.parent(), place.file_name().and_then(|name| name.to_str())) else {
        return false;
    };
    let begins = |file: &Path| {
        file.file_name().and_then(|file| file.to_str()).is_some_and(|file| file.starts_with(&format!("{name}-")))
    };
    std::fs::read_dir(folder).into_iter().flatten().flatten().any(|entry| begins(&entry.path()))
}

/// True if a file exists at this path relative to the page.
fn beside(page: &str, path: &str) -> bool {
    root().join(joined(page, path)).exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_become_anchors_as_on_the_web() {
        let text = "# One `two`, three!\n## A–B\n## A–B\n```text\n# no heading\n```\n### [Linked](x.md) part\n";
        let expected = ["one-two-three", "ab", "ab-1", "linked-part"];
        assert_eq!(anchors(text), expected.map(str::to_string).into());
    }

    #[test]
    fn links_are_found_outside_code_only() {
        let text =
            "[a](b.md#c) `[x](y)` ![d](e.png)\n[f]: g.md\n<img src=\"j.png\" width=\"640\">\n```text\n[h](i)\n```\n";
        let found: Vec<&str> = targets(text).into_iter().map(|(_, target)| target).collect();
        assert_eq!(found, ["b.md#c", "e.png", "g.md", "j.png"]);
    }

    #[test]
    fn a_missing_file_heading_or_path_is_reported_with_its_line() {
        let text = |text: &str| [Text { name: "docs/x.md".to_string(), text: text.to_string() }];
        let found = |page: &str| broken(&text(page));
        assert_eq!(found("# Here\n[a](../README.md) [b](#here) [c](https://x.y)\ndocs/book/cli.md\n"), [""; 0]);
        assert_eq!(found("\n[a](no.md)\n"), ["docs/x.md:2: link to no.md: there is no such file"]);
        assert_eq!(found("[a](#no)\n"), ["docs/x.md:1: link to #no: the page has no such heading"]);
        let by_address = |path: &str| format!("[a]({}/blob/main/{path})\n", address());
        assert_eq!(found(&by_address("docs/book/cli.md")), [""; 0]);
        assert_eq!(found(&by_address("docs/book/no.md")).len(), 1);
        assert_eq!(found("in docs/no.md.\n"), ["docs/x.md:1: docs/no.md does not exist"]);
        assert_eq!(found("in docs/decisions/0001\n"), [""; 0]);
    }
}

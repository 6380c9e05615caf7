//! Agreement of the files that state address and version of the project.

use crate::root;
use crate::tree::{Text, texts};

/// File that defines the address of the repository, in the line that begins with [`KEY`].
const ADDRESS: &str = "pyproject.toml";

const KEY: &str = "Repository = ";

/// Address used before the repository has one.
const PLACEHOLDER: &str = "https://example.org/foldline";

/// Files that state the address.
const WITH_ADDRESS: [&str; 7] = [
    "CHANGELOG.md",
    "CITATION.cff",
    "CODE_OF_CONDUCT.md",
    "SECURITY.md",
    ".github/ISSUE_TEMPLATE/config.yml",
    "Cargo.toml",
    "python/README.md",
];

/// Address of the repository.
pub fn address() -> String {
    let text = std::fs::read_to_string(root().join(ADDRESS)).unwrap_or_default();
    text.lines().find_map(|line| line.strip_prefix(KEY)).map_or("", |value| value.trim_matches('"')).to_string()
}

/// Returns messages on files whose address differs from that in pyproject.toml, and on a version or date in
/// CITATION.cff that differs from that of the latest release in CHANGELOG.md.
pub fn contradictions(texts: &[Text]) -> Vec<String> {
    let mut found = Vec::new();
    let address = address();
    let text = |name: &str| texts.iter().find(|text| text.name == name).map_or("", |text| text.text.as_str());
    for name in WITH_ADDRESS.iter().filter(|name| !text(name).contains(&address)) {
        found.push(format!("{name}: the address is not {address} ({ADDRESS}); run `cargo xtask address {address}`"));
    }
    if address != PLACEHOLDER {
        for text in texts.iter().filter(|text| text.name != "crates/xtask/src/release.rs") {
            found.extend(
                text.text
                    .match_indices(PLACEHOLDER)
                    .map(|(at, _)| format!("{}: {PLACEHOLDER}: write {address} ({ADDRESS})", text.place(at))),
            );
        }
    }
    let [released, cited] = [latest(text("CHANGELOG.md")), cited(text("CITATION.cff"))]
        .map(|release| release.map_or("none".to_string(), |(version, date)| format!("{version} of {date}")));
    if released != cited || released == "none" {
        found.push(format!("CITATION.cff: the release is {cited}, but the latest one in CHANGELOG.md is {released}"));
    }
    found
}

/// Returns version and date of the first release in a changelog.
fn latest(changelog: &str) -> Option<(String, String)> {
    changelog.lines().filter_map(|line| line.strip_prefix("## [")).find_map(|line| {
        let (version, date) = line.split_once("] - ")?;
        Some((version.to_string(), date.trim().to_string()))
    })
}

/// Returns version and date in a citation file.
fn cited(citation: &str) -> Option<(String, String)> {
    let field = |name: &str| {
        let value = citation.lines().find_map(|line| line.strip_prefix(name))?;
        Some(value.trim().trim_matches('"').to_string())
    };
    Some((field("version:")?, field("date-released:")?))
}

/// Replaces the address of the repository in every file that states it.
pub fn move_to(new: &str) -> bool {
    let (old, new) = (address(), new.trim_end_matches('/'));
    if old.is_empty() || !new.starts_with("https://") {
        eprintln!("usage: cargo xtask address https://HOST/PATH");
        return false;
    }
    let stating = |text: &Text| text.name != "crates/xtask/src/release.rs" && text.text.contains(&old);
    let changed = texts().into_iter().filter(stating).all(|text| {
        eprintln!("{}", text.name);
        std::fs::write(root().join(&text.name), text.text.replace(&old, new)).is_ok()
    });
    changed && address() == new
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(changelog: &str, citation: &str) -> Vec<Text> {
        let text = |name: &str, text: String| Text { name: name.to_string(), text };
        let rest = WITH_ADDRESS[2..].iter().map(|name| text(name, address()));
        let own = [
            text("CHANGELOG.md", format!("{changelog}\n{}", address())),
            text("CITATION.cff", format!("{citation}\n{}", address())),
        ];
        own.into_iter().chain(rest).collect()
    }

    #[test]
    fn version_date_and_address_must_agree() {
        let changelog = "## [Unreleased]\n\n## [0.2.0] - 2026-01-31\n\n## [0.1.0] - 2025-01-31\n";
        let citation = "version: 0.2.0\ndate-released: \"2026-01-31\"\n";
        assert_eq!(contradictions(&texts(changelog, citation)), [""; 0]);
        assert_eq!(contradictions(&texts(changelog, &citation.replace("0.2.0", "0.1.0"))).len(), 1);
        assert_eq!(contradictions(&texts(changelog, &citation.replace("31", "30"))).len(), 1);
        let mut elsewhere = texts(changelog, citation);
        elsewhere[2].text = "https://elsewhere.org".to_string();
        assert_eq!(contradictions(&elsewhere).len(), 1);
    }
}

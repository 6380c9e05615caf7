//! Text files of the repository.

use crate::root;
use std::path::Path;

/// Text file with its path from the root, with forward slashes.
pub struct Text {
    pub name: String,
    pub text: String,
}

impl Text {
    /// True if the name ends in one of the extensions.
    pub fn is(&self, extensions: &[&str]) -> bool {
        self.name.rsplit_once('.').is_some_and(|(_, extension)| extensions.contains(&extension))
    }

    /// True if the path of the file starts with one of the given paths.
    pub fn lies_in(&self, paths: &[&str]) -> bool {
        paths.iter().any(|path| self.name.starts_with(path))
    }

    /// Returns name and line of the byte at `offset`.
    pub fn place(&self, offset: usize) -> String {
        let line = self.text[..offset].bytes().filter(|&byte| byte == b'\n').count() + 1;
        format!("{}:{line}", self.name)
    }
}

/// Reads all handwritten text files, sorted by name.
pub fn texts() -> Vec<Text> {
    let mut found = Vec::new();
    collect(&root(), "", &mut found);
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found
}

const EXTENSIONS: [&str; 8] = ["md", "rs", "py", "toml", "yml", "yaml", "cff", "ipynb"];

fn collect(folder: &Path, prefix: &str, found: &mut Vec<Text>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let own = entry.file_name().to_string_lossy().into_owned();
        let name = format!("{prefix}{own}");
        let path = entry.path();
        if path.is_dir() {
            // Skips build products, runs and caches.
            let skipped = ["target", "runs", "out"].contains(&name.as_str()) || own == "__pycache__";
            if !skipped && (own == ".github" || !own.starts_with('.')) {
                collect(&path, &format!("{name}/"), found);
            }
        } else if own.rsplit_once('.').is_some_and(|(_, extension)| EXTENSIONS.contains(&extension))
            && let Ok(text) = std::fs::read_to_string(&path)
        {
            found.push(Text { name, text });
        }
    }
}

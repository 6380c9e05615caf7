//! The page: a closed list of files that are part of the program.
//!
//! **Idea.** The script consists of modules that import from each other. They are joined in an order in which each
//! comes after those that it uses, without their `import` and `export` words, so that the same script can also stand
//! inside a file without a server. Names at the top of a module are therefore unique in all of them.

use std::sync::LazyLock;

/// Modules of the script, each after those that it imports.
const MODULES: [&str; 19] = [
    include_str!("../page/numbers.js"),
    include_str!("../page/colours.js"),
    include_str!("../page/dom.js"),
    include_str!("../page/source.js"),
    include_str!("../page/run.js"),
    include_str!("../page/axis.js"),
    include_str!("../page/draw.js"),
    include_str!("../page/pdf.js"),
    include_str!("../page/chart.js"),
    include_str!("../page/diagram.js"),
    include_str!("../page/orbit.js"),
    include_str!("../page/spectrum.js"),
    include_str!("../page/lists.js"),
    include_str!("../page/editor.js"),
    include_str!("../page/study.js"),
    include_str!("../page/save.js"),
    include_str!("../page/keys.js"),
    include_str!("../page/names.js"),
    include_str!("../page/main.js"),
];

pub(crate) const PAGE: &str = include_str!("../page/index.html");
pub(crate) const STYLE: &str = include_str!("../page/app.css");
const ICON: &str = include_str!("../page/icon.svg");

/// Answer to a request without cookie and without a valid token.
pub(crate) const FORBIDDEN: &str = "403 Forbidden\n\nThe address printed by `foldline view` works once, in one browser. \
    Start `foldline view` again for a new one.\n";

static SCRIPT: LazyLock<String> = LazyLock::new(|| MODULES.map(joined).concat());

/// The script of the page as one text.
pub fn script() -> &'static str {
    &SCRIPT
}

/// A module without its imports and without the word `export`.
fn joined(module: &str) -> String {
    let mut importing = false;
    let mut out = String::with_capacity(module.len());
    for line in module.lines() {
        importing |= line.starts_with("import ");
        if importing {
            importing = !line.trim_end().ends_with(';');
            continue;
        }
        out.push_str(line.strip_prefix("export ").unwrap_or(line));
        out.push('\n');
    }
    out
}

/// Content type and text of a file of the page.
pub(crate) fn asset(path: &str) -> Option<(&'static str, &'static str)> {
    match path {
        "/" => Some(("text/html; charset=utf-8", PAGE)),
        "/app.js" => Some(("text/javascript; charset=utf-8", script())),
        "/app.css" => Some(("text/css; charset=utf-8", STYLE)),
        "/icon.svg" => Some(("image/svg+xml", ICON)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{joined, script};

    #[test]
    fn the_script_does_not_end_the_element_that_contains_it() {
        assert!(!script().to_lowercase().contains("</script"));
    }

    #[test]
    fn imports_and_exports_disappear() {
        let module = "import { a,\n  b } from \"./x.js\";\nexport function f() {\n  return a;\n}\nimport { c } from \"./y.js\";\n";
        assert_eq!(joined(module), "function f() {\n  return a;\n}\n");
        assert!(!script().contains("\nexport ") && !script().contains("\nimport "));
    }
}

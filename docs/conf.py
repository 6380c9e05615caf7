"""The documentation site. `cargo xtask site` builds it.

The source directory is the root of the repository, so that every link between pages, models and notebooks is the same on the site and in
the repository. The native half of the package is replaced by a stand-in: nothing has to be compiled.
"""

import os
import sys

import tomllib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
HERE = "docs/"
sys.path[:0] = [os.path.join(ROOT, "python"), os.path.join(ROOT, "docs", "site")]

import bibliography  # noqa: E402
from pygments.lexers.special import TextLexer  # noqa: E402
from sphinx.ext.napoleon import Config, NumpyDocstring  # noqa: E402

with open(os.path.join(ROOT, "docs", "references.bib"), encoding="utf-8") as file:
    SOURCES = file.read()

with open(os.path.join(ROOT, "Cargo.toml"), "rb") as file:
    release = tomllib.load(file)["workspace"]["package"]["version"]
with open(os.path.join(ROOT, "pyproject.toml"), "rb") as file:
    REPOSITORY = tomllib.load(file)["project"].get("urls", {}).get("Repository", "")

project = "foldline"
author = "The foldline authors"
project_copyright = author
version = release
language = "en"

extensions = ["myst_nb", "sphinx.ext.autodoc"]
root_doc = HERE + "index"
include_patterns = ["docs/**", "python/notebooks/**", "*.md"]
exclude_patterns = [
    "**/.*",
    ".*",
    "target",
    "crates",
    "fuzz",
    "benches",
    "runs",
    "out",
    "**/.ipynb_checkpoints",
    "docs/images",
    "docs/schema",
]
templates_path = []

# Messages of the program name pages by their path, as in docs/book/units.md; headings have the anchors that they have in the repository.
myst_heading_anchors = 4
myst_enable_extensions = ["deflist", "html_image"]
highlight_language = "none"

# Notebooks keep the outputs that are stored in them; python/tests/test_notebooks.py compares these with new ones.
nb_execution_mode = "off"

autodoc_mock_imports = ["foldline._native"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
# Several classes have attributes of one name.
suppress_warnings = ["ref.python"]
add_module_names = False
# Single backticks in docstrings are code.
default_role = "code"

html_theme = "furo"
html_title = f"foldline {release}"
html_static_path = ["site/static"]
html_css_files = ["site.css"]
html_extra_path = ["site/extra"]
html_show_sourcelink = False
html_copy_source = False
html_theme_options = {
    "source_repository": REPOSITORY,
    "source_branch": "main",
    "source_directory": "",
    "top_of_page_buttons": [],
}


# Pages that the overviews in these files link to, put below them in the navigation. The overviews themselves stay plain Markdown.
CHILDREN = {HERE + "book/bifurcations": "bifurcations/*", HERE + "decisions/README": "0*"}


def add_children(app, docname, source):
    """Adds the pages below an overview."""
    if docname in CHILDREN:
        source[0] += f"\n```{{toctree}}\n:hidden:\n:glob:\n\n{CHILDREN[docname]}\n```\n"


def add_references(app, docname, source):
    """Makes the page of references, and links to it from lines that name sources."""
    if docname == HERE + "reference/references":
        source[0] += bibliography.page(SOURCES)
    elif docname.startswith(HERE):
        lines = source[0].split("\n")
        source[0] = "\n".join(bibliography.linked(line, SOURCES) if line.startswith("Source: ") else line for line in lines)


STYLE = Config(napoleon_google_docstring=False, napoleon_use_ivar=True, napoleon_use_rtype=False)


def read_numpy_style(app, what, name, obj, options, lines):
    """Turns sections of docstrings into lists. Docstrings of properties are left as they are: a colon in them does not end a type."""
    if what not in ("property", "attribute", "data"):
        lines[:] = NumpyDocstring(lines, STYLE, app, what, name, obj, options).lines()
    # Not a substitution.
    lines[:] = [line.replace("|value|", "\\|value\\|") for line in lines]


def setup(app):
    """Connects what is above."""
    # Tables that a command prints are no shell script: no word in them is coloured.
    app.add_lexer("console", TextLexer)
    app.connect("source-read", add_children)
    app.connect("source-read", add_references)
    app.connect("autodoc-process-docstring", read_numpy_style)

"""The notebooks run from the first cell to the last, and their stored results agree with the program.

``FOLDLINE_WRITE_NOTEBOOKS=1 pytest python/tests/test_notebooks.py`` stores new ones.
"""

import os

import pytest

from conftest import ROOT

FOLDER = os.path.join(ROOT, "python", "notebooks")
# The positions of points along a branch depend on the last digits of the machine's elementary functions.
RELATIVE = 1e-4


WIDGET = "application/vnd.jupyter.widget-view+json"


def shown(out):
    """False for progress bars, which are widgets where ipywidgets is installed and otherwise written to standard error."""
    return WIDGET not in out.get("data", {}) and (out.output_type != "stream" or out.name != "stderr")


def executed(notebook, folder):
    """Runs a notebook in a folder of its own; leaves out progress bars and times."""
    nbclient = pytest.importorskip("nbclient")
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.outputs = [out for out in cell.outputs if shown(out)]
    return notebook


def texts(notebook):
    """The printed results of each cell, without those of pictures."""
    for cell in notebook.cells:
        for out in cell.get("outputs", []):
            data = out.get("data", {})
            if "image/png" not in data:
                yield data.get("text/plain", out.get("text", ""))


def number(word):
    """Value of a word that is a number, with or without brackets around it."""
    try:
        return float(word.strip("()[]<>,:;"))
    except ValueError:
        return None


def same(stored, found):
    """True if two results have the same words and, to the accuracy of the machine, the same numbers."""
    stored, found = stored.split(), found.split()
    return len(stored) == len(found) and all(map(agree, stored, found))


def agree(a, b):
    x, y = number(a), number(b)
    if x is None or y is None:
        return a == b
    if "." not in a + b and "e" not in a + b:
        return x == y
    # Of error estimates only the magnitude matters.
    small = max(abs(x), abs(y)) < 1e-5
    return abs(x - y) < 1e-9 or (small and abs(x) < 10 * abs(y) and abs(y) < 10 * abs(x)) or abs(x - y) <= RELATIVE * abs(x)


@pytest.mark.parametrize("name", sorted(name for name in os.listdir(FOLDER) if name.endswith(".ipynb")))
def test_notebook(name, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    path = os.path.join(FOLDER, name)
    stored = list(texts(nbformat.read(path, as_version=4)))
    notebook = executed(nbformat.read(path, as_version=4), tmp_path)
    if os.environ.get("FOLDLINE_WRITE_NOTEBOOKS"):
        nbformat.write(notebook, path)
        return
    pictures = [out for cell in notebook.cells for out in cell.get("outputs", []) if "image/png" in out.get("data", {})]
    assert pictures
    found = list(texts(notebook))
    assert len(found) == len(stored), "run FOLDLINE_WRITE_NOTEBOOKS=1 pytest python/tests/test_notebooks.py"
    for old, new in zip(stored, found, strict=True):
        assert same(old, new), f"stored:\n{old}\nnow:\n{new}"


def test_results_are_compared_to_their_accuracy():
    row = "<hopf of steady at B = 2 ± 2e-15, l1 = -0.50000>  0 → 2  1.4e-08"
    assert same(row, "<hopf of steady at B = 2 ± 4e-15, l1 = -0.50001>  0 → 2  2.4e-08")
    for other in (
        "<fold of steady at B = 2 ± 2e-15, l1 = -0.50000>  0 → 2  1.4e-08",
        "<hopf of steady at B = 3 ± 2e-15, l1 = -0.50000>  0 → 2  1.4e-08",
        "<hopf of steady at B = 2 ± 2e-15, l1 = -0.50100>  0 → 2  1.4e-08",
        "<hopf of steady at B = 2 ± 2e-15, l1 = -0.50000>  0 → 1  1.4e-08",
        "<hopf of steady at B = 2 ± 2e-15, l1 = -0.50000>  0 → 2  1.4e-06",
    ):
        assert not same(row, other)

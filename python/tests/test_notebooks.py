"""The notebooks run, from the first cell to the last."""

import os

import pytest

from conftest import ROOT

FOLDER = os.path.join(ROOT, "python", "notebooks")


@pytest.mark.parametrize("name", sorted(name for name in os.listdir(FOLDER) if name.endswith(".ipynb")))
def test_notebook(name, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(os.path.join(FOLDER, name), as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    kept = os.environ.get("FOLDLINE_NOTEBOOKS")
    if kept:
        nbformat.write(notebook, os.path.join(kept, name))
    pictures = [out for cell in notebook.cells for out in cell.get("outputs", []) if "image/png" in out.get("data", {})]
    assert pictures

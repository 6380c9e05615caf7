"""The Python examples of the README and the book run unchanged and print the quoted output."""

import os
import re
import runpy

import pytest
from matplotlib import pyplot

from conftest import ROOT


def examples(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        page = file.read()
    # A block of TOML may begin with the name of its file; a block of text right below an example is its output.
    files = re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", page, flags=re.DOTALL)
    return files, re.findall(r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", page, flags=re.DOTALL)


PAGES = [
    "README.md",
    os.path.join("python", "README.md"),
    *(os.path.join("docs", "book", page) for page in ("first-model.md", "python.md", "tutorial-rotor.md")),
]


@pytest.mark.parametrize("path", PAGES)
def test_examples_run_and_end_in_a_picture(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    os.symlink(os.path.join(ROOT, "models"), "models")
    files, found = examples(path)
    assert found
    for name, text in files:
        (tmp_path / name).write_text(text, encoding="utf-8")
    for number, (text, printed) in enumerate(found):
        pyplot.close("all")
        capsys.readouterr()
        script = tmp_path / f"example_{number}.py"
        script.write_text(text, encoding="utf-8")
        runpy.run_path(str(script))
        if printed:
            assert capsys.readouterr().out == printed
        (figure,) = map(pyplot.figure, pyplot.get_fignums())
        assert figure.axes[0].lines
        kept = os.environ.get("FOLDLINE_PICTURES")
        if kept:
            figure.savefig(os.path.join(kept, f"{os.path.basename(path)}-{number}.png"), dpi=110)
    pyplot.close("all")

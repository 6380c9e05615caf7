"""What the README and the book show in Python runs as it stands there."""

import os
import re
import runpy

import pytest
from matplotlib import pyplot

from conftest import ROOT


def examples(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return re.findall(r"```python\n(.*?)```", file.read(), flags=re.DOTALL)


@pytest.mark.parametrize("path", ["README.md", os.path.join("docs", "book", "python.md")])
def test_examples_run_and_end_in_a_picture(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = examples(path)
    assert found
    for number, text in enumerate(found):
        pyplot.close("all")
        script = tmp_path / f"example_{number}.py"
        script.write_text(text, encoding="utf-8")
        runpy.run_path(str(script))
        (figure,) = map(pyplot.figure, pyplot.get_fignums())
        assert figure.axes[0].lines
        kept = os.environ.get("FOLDLINE_PICTURES")
        if kept:
            figure.savefig(os.path.join(kept, f"{os.path.basename(path)}-{number}.png"), dpi=110)
    pyplot.close("all")

"""The explorer in notebooks and browsers. anywidget is imported only here."""

from __future__ import annotations

import os
import sys
import tempfile
import warnings
import webbrowser
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from . import _native
from ._branch import Branch
from ._diagram import Diagram

#: Bytes for orbits in a page in the browser, as in those of the command line.
_SPACE = 6 << 20
#: Bytes for orbits in a notebook, where the kernel has the others. They are all that a notebook shows without a kernel.
_SPACE_IN_NOTEBOOK = 1 << 20


def view(
    shown: Diagram | Branch | str | os.PathLike[str],
    x: str | None = None,
    y: str | None = None,
    *,
    height: int = 640,
    browser: bool | None = None,
) -> Any:
    """Shows a diagram in the explorer: the pointer reads off numbers, a click opens the orbit of a point with its harmonics and multipliers.

    In a notebook the explorer is a widget in the output of the cell; elsewhere it is a page in the browser. Both contain all points and
    need no network. The widget takes orbits from the kernel as they are clicked. The page contains the orbits of all special points and
    of others spread along the branches, up to 6 MB.

    Parameters
    ----------
    shown : Diagram, Branch or path
        A diagram, a branch, which is then selected in its diagram, or the folder of a run.
    x, y : str, optional
        Quantities on the axes, such as ``"Omega"``, ``"r_rms"``, ``"r_h1_dB"``; by default the free parameter, and the largest value of the
        first output, or of the first state if there is no output.
    height : int
        Height of the widget in pixels.
    browser : bool, optional
        True for a page in the browser, False for a widget. By default a widget in notebooks and a page elsewhere.

    Returns
    -------
    anywidget.AnyWidget or str
        The widget, or the path of the page. The page is a temporary file; copy it to keep it.

    Raises
    ------
    ImportError
        If a widget is needed and anywidget is not installed.
    InputError
        If a quantity is unknown.
    RunFileError
        If the folder holds no run.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> widget = foldline.view(branch, y="x_mean", browser=False)
    >>> widget.height
    640
    """
    diagram = shown.diagram if isinstance(shown, Branch) else shown
    if isinstance(diagram, (str, os.PathLike)):
        diagram = Diagram(_loaded(os.fspath(diagram)), None, os.fspath(diagram))
    named = {key: name for key, name in (("x", x), ("y", y)) if name is not None}
    for name in named.values():
        # Refuses what does not exist, with the names that do.
        _native.label(diagram.model._native, name)
    named = {key: f"{name}_max" if name in diagram.model.states or name in diagram.model.outputs else name for key, name in named.items()}
    selected = {"branch": shown.name, "position": "0"} if isinstance(shown, Branch) else {}
    address = {**named, **selected}
    opened = f"#{urlencode(address)}" if address else ""
    widget = _in_notebook() if browser is None else not browser
    made = _widget_class() if widget else None
    folder, kept = diagram.folder, None
    if folder is None:
        kept = tempfile.TemporaryDirectory(prefix="foldline-view-")
        folder = os.path.join(kept.name, "run")
        diagram.save(folder)
    page = _native.page(folder, list(named.values()), opened, _SPACE_IN_NOTEBOOK if widget else _SPACE, not widget)
    if made is not None:
        return made(page, height, _native.Explored(folder), kept)
    if kept is not None:
        kept.cleanup()
    return _opened(page)


def _loaded(folder: str) -> Any:
    return lambda: _native.Diagram.load(folder)


def _opened(page: str) -> str:
    """Writes a page to a temporary file and opens it in the browser. Returns its path."""
    with tempfile.NamedTemporaryFile("w", prefix="foldline-", suffix=".html", delete=False, encoding="utf-8") as file:
        file.write(page)
    if not webbrowser.open(Path(file.name).as_uri()):
        warnings.warn(f"there is no browser here; the page is {file.name}", stacklevel=3)
    return file.name


def _in_notebook() -> bool:
    """True in a kernel of Jupyter, and in programs that have one."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


@cache
def _widget_class() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise ImportError(
            'the explorer in a notebook needs anywidget: pip install "foldline[view]"\n'
            "  help: foldline.view(diagram, browser=True) opens it as a page in the browser, without anywidget"
        ) from error

    class Explorer(anywidget.AnyWidget):
        """The explorer as a widget: the page, and the orbits that it asks for."""

        _esm = files("foldline").joinpath("view.js").read_text(encoding="utf-8")
        page = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int(640).tag(sync=True)

        def __init__(self, page: str, height: int, run: _native.Explored, kept: Any) -> None:
            # The page is part of the first message: later ones are limited in bytes per second.
            super().__init__(page=page, height=height)
            self._run = run
            # The folder of a diagram in memory is removed with the widget.
            self._kept = kept
            self.on_msg(self._asked)

        def _asked(self, _: Any, content: Any, __: Any) -> None:
            place = [content.get(key) for key in ("branch", "position", "special")]
            found = self._run.solution(*place) if all(type(own) is int for own in place) else None
            self.send({"id": content.get("id")}, buffers=[] if found is None else [found])

    return Explorer

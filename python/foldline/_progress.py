"""Progress of a computation: a bar of tqdm, if that is installed and the output is a terminal or a notebook."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Progress = bool | Callable[[int, int, str], None] | None


def _notebook() -> bool:
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return shell is not None and hasattr(shell, "kernel")


def _watched() -> bool:
    return _notebook() or bool(getattr(sys.stderr, "isatty", lambda: False)())


@contextmanager
def shown(progress: Progress) -> Iterator[Callable[[int, int, str], None] | None]:
    """Yields the function to be called with points, special points and the position of the last one; `None` if nothing is shown."""
    if callable(progress):
        yield progress
        return
    wanted = _watched() if progress is None else progress
    if not wanted or importlib.util.find_spec("tqdm") is None:
        yield None
        return
    # A short computation needs no bar, unless one was requested.
    bar = _bar(0.5 if progress is None else 0.0)
    try:
        yield lambda points, special, place: _show(bar, points, special, place)
    finally:
        bar.close()


def _bar(delay: float) -> Any:
    return _tqdm()(bar_format="{n_fmt} points{postfix} [{elapsed}]", leave=False, delay=delay)


def _bar_of_cells(delay: float) -> Any:
    form = "{n_fmt} of {total_fmt} cells {bar} [{elapsed}, {remaining} left]"
    return _tqdm()(total=0, bar_format=form, leave=False, delay=delay)


def _tqdm() -> Any:
    if _notebook() and importlib.util.find_spec("ipywidgets") is not None:
        from tqdm.notebook import tqdm
    else:
        from tqdm import tqdm
    return tqdm


def _show(bar: Any, points: int, special: int, place: str) -> None:
    bar.set_postfix_str(f"{special} special   {place}", refresh=False)
    bar.update(points - bar.n)
    bar.refresh()

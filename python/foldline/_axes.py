"""Axes, labels, colours and markers of pictures. matplotlib is imported only when something is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _native

if TYPE_CHECKING:
    from ._model import Model

#: Distinguishable with all common types of colour vision (Okabe and Ito), as in the pictures of the command line.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#c68500", "#2f9bd8", "#000000", "#8c8400")
#: Markers of matplotlib for the shapes that the command line draws.
MARKS = {
    "circle": "o",
    "square": "s",
    "diamond": "D",
    "triangle": "^",
    "nabla": "v",
    "right": ">",
    "left": "<",
    "cross": "x",
    "plus": "+",
    "star": "*",
    "dot": ".",
}


def _pyplot() -> Any:
    try:
        from matplotlib import pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install matplotlib") from error
    return pyplot


def axes_or_new(ax: Any) -> Any:
    """Returns the given axes, or new ones."""
    return ax if ax is not None else _pyplot().subplots(layout="constrained")[1]


def new_figure(count: int) -> Any:
    """Returns the axes of a new figure with `count` panels."""
    rows, columns = (2, 2) if count > 3 else (1, count)
    return _pyplot().subplots(rows, columns, layout="constrained", figsize=(4 * columns, 3.4 * rows))[1]


def label(name: str, model: Model) -> str:
    """An axis label: Greek names as letters, the unit in brackets if there is one."""
    return _native.label(model._native, name)


def variable(name: str, model: Model) -> str:
    """The label of a state or output itself, not of its largest value."""
    return label(f"{name}_max", model).removeprefix("max ")

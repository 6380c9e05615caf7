"""Layout of a map over parameters: a grid, a refined grid, or a list of cases."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ._arguments import check_free, described, number
from ._arrays import Floats, finite
from ._cells import Cell
from ._errors import ArgumentError, InputError
from ._model import Model

_CALL = 'foldline.map(model, over={{"{0}": [0.1, 0.2, 0.3]}}, what="motions")'


class Layout:
    """Names of the parameters, and the cells in order.

    Attributes
    ----------
    names : tuple of str
        Parameters of the map.
    axes : tuple of arrays, or None
        Values of each parameter of a grid; None for a list of cases.
    cells : list of tuple of float
        Values of the parameters in each cell, in the order of the result.
    """

    def __init__(self, names: Sequence[str], axes: Sequence[Floats] | None, cells: list[Cell]) -> None:
        self.names = tuple(names)
        self.axes = None if axes is None else tuple(axes)
        self.cells = cells

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of cells along each dimension."""
        return (len(self.cells),) if self.axes is None else tuple(len(own) for own in self.axes)

    @property
    def dims(self) -> tuple[str, ...]:
        """Names of the dimensions."""
        return ("case",) if self.axes is None else self.names

    def identity(self) -> Any:
        """Returns what tells this layout from others."""
        return [list(self.names), self.cells if self.axes is None else [own.tolist() for own in self.axes]]

    def coordinates(self, model: Model) -> dict[str, Any]:
        """Returns the coordinates of a data set."""
        about = {name: attributes(model, name) for name in self.names}
        if self.axes is not None:
            return {name: (name, own, about[name]) for name, own in zip(self.names, self.axes, strict=True)}
        columns = np.array(self.cells, dtype=float).reshape(len(self.cells), len(self.names)).T
        own = {name: ("case", column, about[name]) for name, column in zip(self.names, columns, strict=True)}
        return {"case": ("case", np.arange(len(self.cells))), **own}


def grid(names: Sequence[str], axes: Sequence[Floats]) -> Layout:
    """Returns the layout of a grid."""
    return Layout(names, axes, list(_product(axes)))


def _product(axes: Sequence[Floats]) -> Iterator[Cell]:
    if not axes:
        yield ()
        return
    for first in axes[0].tolist():
        for rest in _product(axes[1:]):
            yield (first, *rest)


def layout_of(model: Model, over: Any) -> Layout:
    """Returns the layout that the argument `over` of `foldline.map` means."""
    call = _CALL.format(next(iter(model.parameters), "a"))
    if isinstance(over, Mapping):
        if not over:
            raise InputError(f"the map has no parameters\n  help: {call}")
        axes = []
        for name, values in over.items():
            check_free(name, model, "foldline.map(model, over={{{}: [0.1, 0.2]}}, what='motions')")
            axes.append(_axis(name, values, call))
        return grid(list(over), axes)
    if isinstance(over, Sequence) and not isinstance(over, str) and all(isinstance(own, Mapping) for own in over):
        if not len(over):
            raise InputError(f"the list of cases is empty\n  help: {call}")
        names = list(over[0])
        for name in names:
            check_free(name, model, "foldline.map(model, over=[{{{}: 0.1}}], what='motions')")
        cells = []
        for index, own in enumerate(over):
            if set(own) != set(names):
                odd = sorted(set(own) ^ set(names))
                raise InputError(f"case {index} and case 0 have different parameters: {', '.join(odd)}\n  help: the same in every case")
            cells.append(tuple(_value(name, own[name]) for name in names))
        return Layout(names, None, cells)
    raise ArgumentError(f"over must be a dictionary or a list of dictionaries, but got {described(over)}\n  help: {call}")


def _value(name: str, value: Any) -> float:
    own = number(name, value)
    if not np.isfinite(own):
        raise InputError(f"{name} = {own} is not a finite number\n  help: a number such as 5, 0.25 or 1e-6")
    return own


def _axis(name: str, values: Any, call: str) -> Floats:
    if isinstance(values, (str, Mapping)) or not hasattr(values, "__len__"):
        raise ArgumentError(f"the values of {name} must be a list of numbers, but got {described(values)}\n  help: {call}")
    axis = finite(f"the list of values of {name}", values)
    if axis.ndim != 1 or not len(axis):
        raise InputError(f"the values of {name} have the shape {axis.shape}\n  help: a list of at least one number: {call}")
    own, counts = np.unique(axis, return_counts=True)
    if (counts > 1).any():
        raise InputError(f"{name} has the value {own[counts > 1][0]:g} more than once\n  help: different values")
    return axis


def attributes(model: Model, name: str) -> dict[str, str]:
    """Returns unit and description of a parameter, or of an extreme of a state or output, where the model states them."""
    base, _, side = name.rpartition("_")
    words = {"max": "largest value of ", "min": "smallest value of "}
    if name in model.parameters:
        own, before = model.parameters[name], ""
    elif side in words and (base in model.states or base in model.outputs):
        own, before = {**model.states, **model.outputs}[base], words[side]
    elif name == "period":
        return {"long_name": "period", **({"units": model.time} if model.time else {})}
    else:
        return {}
    long = before + (own["description"] or (base if before else ""))
    return {**({"units": own["unit"]} if own["unit"] else {}), **({"long_name": long} if long else {})}

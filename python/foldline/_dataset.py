"""Answers of a map over parameters as a data set of xarray."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ._arguments import suggestion
from ._cells import Cell
from ._errors import InputError
from ._layout import Layout, attributes
from ._model import Model
from ._questions import RESERVED, Question
from ._tables import _xarray

#: Reasons why a cell without an answer has none.
UNFINISHED = "not computed: the map was interrupted"
BETWEEN = "not computed: the cells around it agree"


def library() -> Any:
    """Returns xarray, or says how to install it."""
    try:
        return _xarray()
    except ImportError as error:
        raise ImportError('a map over parameters needs xarray: pip install "foldline[cluster]"') from error


def assembled(
    model: Model,
    question: Question,
    layout: Layout,
    answers: Mapping[Cell, str],
    attrs: Mapping[str, Any],
    refined: Mapping[Cell, str] | None = None,
) -> Any:
    """Returns the data set. `refined` has the category of every cell of a refined grid, computed or not."""
    read = [json.loads(answers[cell]) if cell in answers else None for cell in layout.cells]
    missing = UNFINISHED if refined is None else BETWEEN
    failure = [missing if own is None else own["failure"] if isinstance(own, dict) else "" for own in read]
    found = [own if isinstance(own, list) else None for own in read]
    values = [{} if own is None else own[0] for own in found]
    items = [{} if own is None else own[1] for own in found]
    about = question.about(model)
    made = _Made(model, layout, about)
    for name in _names(values):
        made.add(name, [own.get(name) for own in values], question.category if name == question.category else "")
    if refined is not None:
        made.replace(attrs["refined_by"], [refined.get(cell, "") for cell in layout.cells])
        made.add("computed", [cell in answers for cell in layout.cells], known=True)
    if question.items:
        labels = list(dict.fromkeys(label for own in items for label in own))
        for name in _names(own[label] for own in items for label in own):
            none = [None if own is None else own[3].get(name) for own in found]
            rows = [[own.get(label, {}).get(name, other) for label in labels] for own, other in zip(items, none, strict=True)]
            made.add_items(name, question.items, labels, rows)
    made.add("failure", failure, known=True)
    made.add("remark", ["" if own is None else own[2] for own in found], known=True)
    return library().Dataset(made.data, {**layout.coordinates(model), **made.coordinates}, dict(attrs))


class _Made:
    """Variables of a data set in the making."""

    def __init__(self, model: Model, layout: Layout, about: Mapping[str, Mapping[str, str]]) -> None:
        self.model = model
        self.layout = layout
        self.about = {
            **about,
            "failure": {"long_name": "reason why a cell has no values"},
            "remark": {"long_name": "what fell short in a cell"},
            "computed": {"long_name": "true where a cell was computed"},
        }
        self.data: dict[str, Any] = {}
        self.coordinates: dict[str, Any] = {}

    def _attributes(self, name: str) -> dict[str, str]:
        return {**attributes(self.model, name), **self.about.get(name, {})}

    def add(self, name: str, column: Sequence[Any], category: str = "", known: bool = False) -> None:
        """Adds a variable over the cells; one of lists has a further dimension."""
        if not known and not category and (name in self.layout.dims or name in RESERVED):
            raise InputError(f"the name `{name}` is taken in the result\n  help: another name for what the function returns")
        dims, array = list(self.layout.dims), _array(column)
        array = array.reshape(*self.layout.shape, *array.shape[1:])
        self.data[name] = (dims if array.ndim == len(dims) else [*dims, f"{name}_index"], array, self._attributes(name))

    def replace(self, name: str, column: Sequence[str]) -> None:
        """Replaces a variable by texts."""
        array = np.array(column, dtype=object).reshape(self.layout.shape)
        self.data[name] = (list(self.layout.dims), array, self._attributes(name))

    def add_items(self, name: str, dim: str, labels: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """Adds a variable over the cells and the motions or points found in them; a text becomes a coordinate if it is the same in all cells."""
        columns = [[row[k] for row in rows] for k in range(len(labels))]
        self.coordinates[dim] = (dim, np.array(labels, dtype=object))
        if any(isinstance(own, str) for column in columns for own in column):
            each = [next((own for own in column if own is not None), "") for column in columns]
            self.coordinates[name] = (dim, np.array(each, dtype=object))
            return
        array = _array([own for row in rows for own in row]).reshape(*self.layout.shape, len(labels))
        frees = self.coordinates.get("free", ((), ()))[1]
        unit = attributes(self.model, frees[0]).get("units") if name in ("value", "error") and len(set(frees)) == 1 else None
        attrs = {**self._attributes(name), **({"units": unit} if unit else {})}
        self.data[name] = ([*self.layout.dims, dim], array, attrs)


def _names(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Names in the order in which they appear, texts first."""
    seen: dict[str, bool] = {}
    for row in rows:
        for name, value in row.items():
            seen[name] = seen.get(name, False) or isinstance(value, str)
    return sorted(seen, key=lambda name: not seen[name])


def _array(column: Sequence[Any]) -> Any:
    """Returns an array of numbers, truth values or texts; missing numbers are NaN, missing texts are empty."""
    present = [own for own in column if own is not None]
    if any(isinstance(own, str) for own in present):
        return np.array(["" if own is None else str(own) for own in column], dtype=object)
    if any(isinstance(own, list) for own in present):
        rows = [own if isinstance(own, list) else [] if own is None else [own] for own in column]
        array = np.full((len(rows), max(map(len, rows))), np.nan)
        for k, own in enumerate(rows):
            array[k, : len(own)] = own
        return array
    if len(present) == len(column) and present:
        if all(isinstance(own, bool) for own in present):
            return np.array(column, dtype=bool)
        if all(isinstance(own, int) for own in present) and all(abs(own) < 2**63 for own in present):
            return np.array(column, dtype=np.int64)
    return np.array([np.nan if own is None else float(own) for own in column], dtype=np.float64)


def category_of(text: str, by: str) -> str:
    """Returns the value of a cell that decides where to refine."""
    read = json.loads(text)
    if isinstance(read, dict):
        return "failed"
    values = read[0]
    if by not in values:
        raise InputError(f"there is no value `{by}` to refine by\n  help: {suggestion(by, values)}")
    if isinstance(values[by], (float, list)):
        raise InputError(f"`{by}` is a number that varies, not a category\n  help: refine by a text, a truth value or a whole number")
    return str(values[by])


def only_category(texts: Iterable[str]) -> str:
    """Returns the only value of the cells that is a text or a truth value."""
    for text in texts:
        read = json.loads(text)
        if isinstance(read, dict):
            continue
        names = [str(name) for name, value in read[0].items() if isinstance(value, (str, bool))]
        if len(names) == 1:
            return names[0]
        raise InputError(f"by which value should the map be refined?\n  help: by=NAME, one of {', '.join(read[0])}")
    raise InputError(
        "no cell has a value, so the map cannot be refined\n  help: the reasons are in the variable `failure` of the map without refine="
    )

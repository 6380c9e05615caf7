"""Settled motions that simulation found: surveys and sweeps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import suggestion
from ._arrays import Floats, Integers, floats

if TYPE_CHECKING:
    import pandas

    from ._diagram import Diagram
    from ._model import Model

_NUMBERS = (
    "value",
    "period",
    "share",
    "share_low",
    "share_high",
    "settled_after",
    "error",
    "rotation",
    "rotation_error",
    "exponent",
    "exponent_error",
)


class Responses(Mapping[str, Any]):
    """Settled motions at values of one parameter: a `Survey` or a `Sweep`.

    ``found["omega"]`` and ``found["x_max"]`` are columns, arrays of shape (responses,), in the order in which the values were visited.

    Attributes
    ----------
    name : str
        Name of the survey or sweep.
    free : str
        Name of the parameter that varies.
    diagram : Diagram
        Diagram to which it belongs; ``diagram.save(folder)`` stores it.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, parameters={"h": -1.0})
    >>> found = foldline.sweep(model.settle([-1.3]), "h", (-1, 1), 3)
    >>> found["h"].tolist(), found["x_max"].round(4).tolist()
    ([-1.0, 0.0, 1.0], [-1.3247, -1.0, 1.3247])
    """

    def __init__(self, diagram: Diagram, parts: Mapping[str, Any]) -> None:
        self.diagram = diagram
        self.name: str = parts["name"]
        self.free: str = list(diagram.model.parameters)[parts["free"]]
        self._table = _table(parts, diagram.model)
        self._jumps: list[int] = parts["jumps"]

    @property
    def model(self) -> Model:
        """The model."""
        return self.diagram.model

    @property
    def value(self) -> Any:
        """Value of the parameter at each response, shape (responses,), in the unit of the model."""
        return self._table["value"]

    @property
    def motion(self) -> np.ndarray[Any, Any]:
        """Type of each motion, shape (responses,).

        ``"equilibrium"``, ``"cycle"``, ``"torus"``, ``"chaos"``, ``"other"`` (undecided; the column ``"undecided"`` says why),
        ``"chatter"`` (its impacts accumulate) or ``"escaped"``.
        Columns ``"rotation"``, ``"exponent"`` and their errors hold the evidence for a torus or chaos.
        """
        own: np.ndarray[Any, Any] = self._table["motion"]
        return own

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self._table)

    def __getitem__(self, name: str) -> Any:
        """Returns a column by name; the name of a state or output alone means its largest value."""
        if name in self._table:
            return self._table[name]
        if f"{name}_max" in self._table:
            return self._table[f"{name}_max"]
        raise KeyError(f"{name}: {suggestion(name, self._table)}")

    def __contains__(self, name: object) -> bool:
        return name in self._table or f"{name}_max" in self._table

    def __iter__(self) -> Iterator[str]:
        return iter(self._table)

    def __len__(self) -> int:
        """Number of columns, as of any mapping; ``len(found.value)`` is the number of responses."""
        return len(self._table)

    def _left_out(self) -> tuple[str, ...]:
        return ()

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each response.

        Returns
        -------
        pandas.DataFrame
            Quantities are in the units of the model. Periods of motions that do not repeat, and ranges of motions that escaped, are NaN.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "h + x - x^3"}, parameters={"h": -1.0})
        >>> foldline.sweep(model.settle([-1.3]), "h", (-1, 1), 9).to_pandas()["h"].tolist()
        [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0]
        """
        from ._tables import responses_frame

        return responses_frame(self, self._left_out())

    def plot(self, ax: Any = None, y: str | None = None, **style: Any) -> list[Any]:
        """Draws the responses over the parameter.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        y : str, optional
            Column; by default the largest value of the first output, or of the first state if there is no output.
        **style
            For the marks, such as ``color="black"``.

        Returns
        -------
        list of matplotlib artists

        Raises
        ------
        InputError
            If a quantity is unknown.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "h + x - x^3"}, parameters={"h": -1.0})
        >>> artists = foldline.sweep(model.settle([-1.3]), "h", (-1, 1), 9).plot()
        >>> artists[0].axes.get_xlabel()
        'h'
        """
        from ._overlay import responses

        return responses(self, ax, y, style)

    def _repr_html_(self) -> str:
        from ._html import responses

        return responses(self)


class Sweep(Responses):
    """A stepped sweep: settled motions from value to value, each started from the last state of the one before.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, parameters={"h": -1.0})
    >>> sweep = foldline.sweep(model.settle([-1.3]), "h", (-1, 1), 9, back=True)
    >>> sweep.jumps.tolist()
    [[0.25, 0.5], [-0.25, -0.5]]
    """

    @property
    def jumped(self) -> np.ndarray[Any, Any]:
        """Array of True, False and None, shape (responses,).

        True if the motion is not the continuation of the motion at the previous value. None at the first value, and if the two could
        not be compared.
        """
        own: np.ndarray[Any, Any] = self._table["jumped"]
        return own

    @property
    def jumps(self) -> Floats:
        """Values before and after each jump, shape (jumps, 2).

        If the two motions could not be compared, a change of the type of motion counts as a jump.
        """
        values = self.value
        return np.array([[values[k - 1], values[k]] for k in self._jumps], dtype=np.float64).reshape(-1, 2)

    @property
    def legs(self) -> list[tuple[str, Integers]]:
        """Pieces of one direction: ``"up"`` or ``"down"``, and the indices of their responses.

        A value at which the sweep turns back belongs to both pieces.
        """
        values = self.value
        steps = np.sign(np.diff(values))
        if not len(steps):
            return [("up", np.arange(len(values)))]
        turns = [0, *(np.flatnonzero(np.diff(steps) != 0) + 1).tolist(), len(values) - 1]
        pieces = pairwise(turns)
        return [("up" if steps[first] >= 0 else "down", np.arange(first, last + 1)) for first, last in pieces]

    def _left_out(self) -> tuple[str, ...]:
        return ("hits", "share", "share_low", "share_high")

    def __repr__(self) -> str:
        values = self.value
        if not len(values):
            return f"<sweep {self.name}: no responses>"
        route = " → ".join(f"{values[own[0]]:.6g}" for _, own in self.legs) + f" → {values[-1]:.6g}"
        jumps = "; ".join(f"{before:.6g} → {after:.6g}" for before, after in self.jumps) or "none"
        unknown = sum(own is None for k, own in enumerate(self.jumped) if k and k not in self._jumps)
        doubt = f"; {unknown} not compared" if unknown else ""
        return f"<sweep {self.name}: {len(values)} values of {self.free}, {route}; jumps: {jumps}{doubt}>"


class Survey(Responses):
    """A survey: the motions to which many initial states settle, at each value of a parameter.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": 0.0})
    >>> survey = foldline.survey(model, "h", values=[0, 1], starts=16)
    >>> survey.at(0)["x_max"].round(4).tolist()
    [-1.0, 1.0]
    >>> survey.at(1)["share"].tolist()
    [1.0]
    """

    @property
    def share(self) -> Floats:
        """Basin fraction of each motion with its 95 % confidence interval, shape (responses, 3): estimate, low, high.

        It is estimated from the initial states drawn uniformly from the ranges of the states. Every fourth initial state is drawn
        towards the origin instead and counts in `hits` only.
        """
        return np.stack([self._table[name] for name in ("share", "share_low", "share_high")], axis=1)

    @property
    def hits(self) -> Integers:
        """Number of initial states that settled to each motion, shape (responses,)."""
        own: Integers = self._table["hits"]
        return own

    def at(self, value: float) -> dict[str, Any]:
        """Returns the rows at the value nearest to a given one.

        Parameters
        ----------
        value : float
            Value of the parameter, in the unit of the model.

        Returns
        -------
        dict of arrays, shape (motions,)
            The columns; motions are ordered as in the table, the most frequent first.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": 0.0})
        >>> found = foldline.survey(model, "h", (-1, 1), 3, starts=16)
        >>> sorted(found.at(0.1)["x_max"].round(4).tolist())
        [-1.0, 1.0]
        """
        nearest = self.value[np.argmin(np.abs(self.value - value))] if len(self.value) else np.nan
        chosen = self.value == nearest
        return {name: column[chosen] for name, column in self._table.items()}

    def _left_out(self) -> tuple[str, ...]:
        return ("jumped",)

    def __repr__(self) -> str:
        motions = {str(name): int(np.count_nonzero(self.motion == name)) for name in dict.fromkeys(self.motion.tolist())}
        told = ", ".join(f"{count} × {name}" for name, count in motions.items()) or "no responses"
        values = np.unique(self.value)
        span = f", {values[0]:.6g} … {values[-1]:.6g}" if len(values) else ""
        return f"<survey {self.name}: {len(values)} values of {self.free}{span}; {told}>"


def made(diagram: Diagram, parts: Mapping[str, Any]) -> Survey | Sweep:
    """Returns the survey or sweep with the columns from the native half."""
    return Sweep(diagram, parts) if parts["search"] == "sweep" else Survey(diagram, parts)


def _table(own: Mapping[str, Any], model: Model) -> dict[str, Any]:
    numbers = {key: floats(own[key]) for key in _NUMBERS}
    count = len(numbers["value"])
    variables = [*model.states, *model.outputs]
    parameters = floats(own["parameters"]).reshape(count, len(model.parameters))
    ranges = floats(own["ranges"]).reshape(count, len(variables), 2)
    table: dict[str, Any] = {name: parameters[:, k] for k, name in enumerate(model.parameters)}
    for k, name in enumerate(variables):
        table[f"{name}_min"], table[f"{name}_max"] = ranges[:, k, 0], ranges[:, k, 1]
    words = {key: np.array(own[key]) for key in ("motion", "multiplicity", "hits", "undecided")}
    words["jumped"] = np.array(own["jumped"], dtype=object)
    ratios = ["" if pair is None else f"{pair[0]}:{pair[1]}" for pair in own["ratio"]]
    return {**numbers, **words, "ratio": np.array(ratios), **table}

"""Derivatives of special points and solutions with respect to every parameter, and their uncertainty."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from ._axes import COLOURS, axes_or_new, label
from ._errors import ArgumentError

if TYPE_CHECKING:
    import pandas

    from ._model import Model


class Derivative(NamedTuple):
    """A derivative with a bound on its error, in the units of the model.

    Attributes
    ----------
    value : float
        The derivative.
    error : float
        Bound on its error.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> slope = branch.special["fold"][0].sensitivity["b"]
    >>> round(slope.value, 9), slope.error < 1e-9
    (1.0, True)
    """

    value: float
    error: float


class Sensitivity(Mapping[str, Derivative]):
    """Derivatives of one number with respect to the parameters: ``sensitivity["zeta"].value``.

    Parameters without a derivative are not among the keys; `reasons` says why.

    Attributes
    ----------
    name : str
        Name of the number: a parameter, ``"period"``, ``"angle"``, or a state or output followed by ``_min`` or ``_max``.
    unit : str
        Its unit.
    value : float
        Its value.
    reasons : dict
        For every parameter without a derivative, the reason.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> own = branch.special["fold"][0].sensitivity
    >>> own.name, list(own), round(own.elasticity("b"), 6)
    ('a', ['b'], 1.5)
    """

    def __init__(self, model: Model, parameters: Mapping[str, float], row: Any) -> None:
        self.name: str = row[0]
        self.unit: str = row[1]
        self.value: float = row[2]
        self.reasons: dict[str, str] = {name: reason for name, pair, reason in row[3] if pair is None}
        self._found = {name: Derivative(*pair) for name, pair, _ in row[3] if pair is not None}
        self._model = model
        self._parameters = parameters

    def __getitem__(self, name: str) -> Derivative:
        if name in self.reasons:
            raise KeyError(f"{name}: {self.reasons[name]}")
        return self._found[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def __repr__(self) -> str:
        parts = ", ".join(f"{name}: {own.value:.8g} ± {own.error:.1e}" for name, own in self.items())
        return f"<derivatives of {self.name} = {self.value:.10g}: {parts}>"

    def elasticity(self, name: str) -> float:
        """Returns the percentage by which the number changes if the parameter changes by one per cent: (p/q) dq/dp.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        float
            NaN if the number is 0.

        Raises
        ------
        KeyError
            If the model has no such parameter.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a - c*x^2"}, parameters={"a": 1.0, "c": 2.0})
        >>> rest = foldline.follow(model.settle([0.5]), "a", (0.5, 2))
        >>> round(rest.sensitivities(0)["x_max"].elasticity("c"), 6)
        -0.5
        """
        return self[name].value * self._parameters[name] / self.value if self.value else float("nan")

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each parameter: derivative, error and elasticity.

        Returns
        -------
        pandas.DataFrame
            Indexed by the names of the parameters.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a - c*x^2"}, parameters={"a": 1.0, "c": 2.0})
        >>> rest = foldline.follow(model.settle([0.5]), "a", (0.5, 2))
        >>> rest.sensitivities(0)["x_max"].to_pandas()["elasticity"].round(6).tolist()
        [0.5, -0.5]
        """
        import pandas

        rows = {name: (own.value, own.error, self.elasticity(name)) for name, own in self.items()}
        return pandas.DataFrame.from_dict(rows, orient="index", columns=["derivative", "error", "elasticity"])

    def plot(self, changes: Mapping[str, float] | None = None, ax: Any = None) -> Any:
        """Draws a tornado chart: how much each parameter changes the number, the most influential on top.

        Parameters
        ----------
        changes : mapping, optional
            Change of each parameter, such as its standard deviation; one per cent of its value where it is absent.
        ax : matplotlib axes, optional
            Where to draw; new axes by default.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Raises
        ------
        ArgumentError
            If the model has no such parameter.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a - c*x^2"}, parameters={"a": 1.0, "c": 2.0})
        >>> rest = foldline.follow(model.settle([0.5]), "a", (0.5, 2))
        >>> axes = rest.sensitivities(0)["x_max"].plot({"a": 0.1})
        >>> [label.get_text() for label in axes.get_yticklabels()]
        ['c ± 0.02', 'a ± 0.1']
        """
        given = dict(changes or {})
        unknown = [name for name in given if name not in self._model.parameters]
        if unknown:
            raise ArgumentError(f"changes: the model has no parameter `{unknown[0]}`\n  help: one of {', '.join(self)}")
        axes = axes_or_new(ax)
        change = {name: given.get(name, 0.01 * abs(self._parameters[name]) or 0.01) for name in self}
        order = sorted(self, key=lambda name: abs(self[name].value * change[name]))
        for side, colour, word in ((-1, COLOURS[0], "lower"), (1, COLOURS[1], "higher")):
            lengths = [side * self[name].value * change[name] for name in order]
            axes.barh(range(len(order)), lengths, color=colour, alpha=0.85, height=0.65, label=word)
        axes.set_yticks(range(len(order)), [f"{label(name, self._model)} ± {change[name]:.3g}" for name in order])
        axes.axvline(0.0, color="0.3", linewidth=1.0)
        unit = f" [{self.unit}]" if self.unit not in ("", "1", "-") else ""
        axes.set_xlabel(f"change of {self.name}{unit}")
        axes.legend()
        return axes


class Band(NamedTuple):
    """Distribution of a number at a special point if parameters are uncertain.

    Attributes
    ----------
    value : float
        Value at the values of the parameters.
    first_order : tuple of float or None
        Mean and standard deviation from the derivatives; None if one is missing.
    sampled : tuple of float or None
        Mean and standard deviation of the samples.
    range : tuple of float or None
        Range that contains 95 % of the samples.
    failed : dict
        Reasons why samples have no such point, with their number.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> band = branch.special["fold"][0].uncertainty(b=0.01)["a"]
    >>> round(band.first_order[1], 6), round(band.sampled[1], 3), band.failed
    (0.01, 0.01, {})
    """

    value: float
    first_order: tuple[float, float] | None
    sampled: tuple[float, float] | None
    range: tuple[float, float] | None
    failed: dict[str, int]


def bands(rows: Any, failed: Any) -> dict[str, Band]:
    """Returns the bands of a special point by the name of the number."""
    reasons = dict(failed)
    return {name: Band(value, _pair(first), _pair(sampled), _pair(span), reasons) for name, value, first, sampled, span in rows}


def _pair(own: Any) -> tuple[float, float] | None:
    return None if own is None else (own[0], own[1])


def spreads(model: Model, given: Mapping[str, Any]) -> dict[str, tuple[float, float | None]]:
    """Returns standard deviations as (sigma, None) and ranges as (low, high)."""
    found: dict[str, tuple[float, float | None]] = {}
    for name, own in given.items():
        if name not in model.parameters:
            raise ArgumentError(f"{name}: the model has no such parameter\n  help: one of {', '.join(model.parameters)}")
        pair: tuple[Any, Any] | list[Any] = own if isinstance(own, (tuple, list)) and len(own) == 2 else (own, None)
        low, high = pair[0], pair[1]
        try:
            low, high = float(low), None if high is None else float(high)
        except (TypeError, ValueError):
            raise ArgumentError(f"{name}: {own!r} is not an uncertainty\n  help: a standard deviation, or a range (low, high)") from None
        if not (low > 0 if high is None else low < high):
            raise ArgumentError(f"{name}: {own!r} is not an uncertainty\n  help: a positive standard deviation, or a range (low, high)")
        found[name] = (low, high)
    return found

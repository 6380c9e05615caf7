"""Uncertainty of all special points of a study, by derivatives and by whole diagrams at samples of the parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._arguments import check_parameters, is_branch, is_model, wrong_kind
from ._arrays import Floats, whole
from ._diagram import Diagram
from ._errors import ArgumentError, InputError
from ._layout import Layout
from ._maps import CellProgress, mapped, unit_hypercube
from ._model import Model
from ._questions import Points
from ._sensitivity import spreads as checked_spreads
from ._studies import Path
from ._study_at import check_replaceable, tables_of

if TYPE_CHECKING:
    import pandas

    from ._branch import SpecialPoint

#: Ends of the range that contains 95 % of the samples.
_ENDS = (0.025, 0.975)


class Spread(NamedTuple):
    """Distribution of the parameter value of a special point: a row of `Uncertainty`.

    Attributes
    ----------
    name : str
        Branch, kind and number of the point: ``"response: fold 1"``.
    free : str
        Parameter of the branch, whose value this is.
    value : float
        Value at the values of the parameters.
    first_order : float or None
        Standard deviation from the derivatives; None if one is missing.
    mean, sigma : float
        Mean and standard deviation of the samples; NaN without samples.
    range : tuple of float
        Range that contains 95 % of the samples.
    samples : int
        Number of samples with this point.
    without : dict
        Reasons why other samples do not count, with their number.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> row = foldline.uncertainty(branch, {"b": 0.01}, samples=20)[0]
    >>> row.name, round(row.value, 6), round(row.first_order, 6), row.samples, row.without
    ('equilibrium over a: fold 1', 2.0, 0.01, 20, {})
    """

    name: str
    free: str
    value: float
    first_order: float | None
    mean: float
    sigma: float
    range: tuple[float, float]
    samples: int
    without: dict[str, int]


class Uncertainty(Sequence[Spread]):
    """Distributions of the special points of a diagram for uncertain parameters: the result of `foldline.uncertainty`.

    Attributes
    ----------
    diagram : Diagram
        Diagram at the values of the parameters.
    spreads : dict
        Standard deviation, or range, of each uncertain parameter.
    samples : xarray.Dataset
        Special points of the diagrams at all samples, over `case` and `point`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> found = foldline.uncertainty(branch, {"b": (2.9, 3.1)}, samples=20)
    >>> len(found), [round(end, 1) for end in found[0].range]
    (2, [1.9, 2.1])
    """

    def __init__(self, diagram: Diagram, spreads: dict[str, Any], samples: Any, rows: list[Spread]) -> None:
        self.diagram = diagram
        self.spreads = spreads
        self.samples = samples
        self._rows = rows

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, str):
            for row in self._rows:
                if row.name == index:
                    return row
            raise KeyError(f"{index}: one of {', '.join(row.name for row in self._rows)}")
        return self._rows[index]

    def __len__(self) -> int:
        return len(self._rows)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each special point.

        Returns
        -------
        pandas.DataFrame
            Values are in the unit of the parameter `free`.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
        >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
        >>> foldline.uncertainty(branch, {"b": 0.01}, samples=20).to_pandas()["value"].round(6).tolist()
        [2.0, -2.0]
        """
        from ._tables import _pandas

        rows = [{**own._asdict(), "low": own.range[0], "high": own.range[1], "without": sum(own.without.values())} for own in self._rows]
        columns = ["name", "free", "value", "first_order", "mean", "sigma", "low", "high", "samples", "without"]
        frame: pandas.DataFrame = _pandas().DataFrame(rows, columns=columns)
        return frame

    def plot(self, ax: Any = None, y: str | None = None) -> list[Any]:
        """Draws the diagram with its special points at the samples, and bands that contain 95 % of them.

        Thin lines with ends are two standard deviations to either side, from the derivatives.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        y : str, optional
            Largest value of an output or, if the model has none, of a state: ``"x_max"``. By default the first of them.

        Returns
        -------
        list of matplotlib artists

        Raises
        ------
        InputError
            If the samples have no such quantity.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
        >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
        >>> artists = foldline.uncertainty(branch, {"b": 0.01}, samples=20).plot()
        >>> artists[0].axes.get_xlabel()
        'a'
        """
        from ._axes import COLOURS, axes_or_new

        model = self.diagram.model
        known = [f"{name}_max" for name in list(model.outputs) or list(model.states)]
        own = y or known[0]
        if own not in known:
            raise InputError(f"the samples have no values of {own}\n  help: one of {', '.join(known)}")
        axes = axes_or_new(ax)
        free = self._rows[0].free if self._rows else None
        artists = self.diagram.plot(axes, x=free, y=own)
        points = _named(self.diagram)
        for index, row in enumerate(row for row in self._rows if row.free == free):
            colour = COLOURS[(index + 1) % len(COLOURS)]
            if row.samples:
                at = self.samples.sel(point=row.name)
                artists.append(axes.plot(at["value"], at[own], ".", color=colour, alpha=0.25, markersize=3, zorder=1)[0])
                artists.append(axes.axvspan(*row.range, color=colour, alpha=0.12, linewidth=0, zorder=0))
            if row.first_order is not None:
                height = points[row.name][own]
                bar = axes.errorbar(row.value, height, xerr=2 * row.first_order, color=colour, capsize=4, linewidth=1.2, zorder=4)
                artists.append(bar)
        return artists

    def __repr__(self) -> str:
        head = f"  {'value':>13}  {'first order':>11}  {'sampled':>11}  {'95 % of samples':>22}  without  special point"
        lines = [
            f"  {own.value:13.9g}  {_short(own.first_order):>11}  {_short(own.sigma):>11}  "
            f"{'[{:.6g}, {:.6g}]'.format(*own.range):>22}  {sum(own.without.values()):7d}  {own.name}"
            for own in self._rows
        ]
        given = ", ".join(f"{name} {_said(own)}" for name, own in self.spreads.items())
        return "\n".join([f"uncertain: {given}", head, *lines])


def _short(value: float | None) -> str:
    return "·" if value is None else f"{value:.4g}"


def _said(spread: tuple[float, float | None]) -> str:
    low, high = spread
    return f"± {low:g}" if high is None else f"in [{low:g}, {high:g}]"


def uncertainty(
    study: Any,
    spreads: Mapping[str, float | tuple[float, float]],
    *,
    model: Model | None = None,
    samples: int = 100,
    seed: int = 1,
    client: Any = None,
    out: Path | None = None,
    jobs: int | None = None,
    progress: CellProgress = None,
) -> Uncertainty:
    """Finds how uncertain the special points of a study are if parameters are: by derivatives, and by the study at samples.

    `SpecialPoint.uncertainty` solves one point again at samples, from its own position. Here the whole study is computed
    again at each sample, so that points which vanish, and others which appear, are noticed.

    Parameters
    ----------
    study : Branch, Diagram, path, str or mapping
        A branch or diagram that is known, or a study as for `run`.
    spreads : mapping
        For each uncertain parameter the standard deviation of a normal distribution about its value, ``{"zeta": 0.002}``, or the ends
        of a uniform distribution, ``{"zeta": (0.008, 0.012)}``. Parameters are independent.
    model : Model, optional
        As for `run`.
    samples : int
        Number of samples, drawn in a Latin hypercube; 0 for derivatives only.
    seed : int
        Seed of the random numbers.
    client, out, jobs, progress
        As for `map`.

    Returns
    -------
    Uncertainty
        A sequence of `Spread`, one for each special point, with `to_pandas` and `plot`.

    Raises
    ------
    ArgumentError, InputError
        If a parameter is unknown, varies in the study, or has no spread.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
    >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
    >>> foldline.uncertainty(branch, {"b": 0.01}, samples=50)
    uncertain: b ± 0.01
              value  first order      sampled         95 % of samples  without  special point
                  2         0.01 ...        0  equilibrium over a: fold 1
                 -2         0.01 ...        0  equilibrium over a: fold 2
    """
    from ._compute import run

    if is_model(study):
        raise wrong_kind("a study is needed", study, "foldline.uncertainty(branch, {'zeta': 0.002}), with a branch of foldline.follow")
    if not isinstance(spreads, Mapping) or not spreads:
        check_parameters("spreads", spreads)
        raise ArgumentError("no parameter is uncertain\n  help: {'zeta': 0.002} or {'zeta': (0.008, 0.012)}")
    if is_branch(study):
        diagram = study.diagram
    elif isinstance(study, Diagram):
        diagram = study
    else:
        diagram = run(study, model, jobs=jobs)
    own = diagram.model
    given = checked_spreads(own, spreads)
    tables = {name: item for name, item in tables_of(diagram.study).items() if name != "model"}
    check_replaceable(tables, list(given))
    points = _named(diagram)
    middle = _middle(diagram, given)
    cells = _drawn(given, middle, whole("samples", samples, 0), whole("seed", seed, 0))
    found = None
    if cells:
        layout = Layout(list(given), None, cells)
        found = mapped(own, layout, Points(tables), client=client, out=out, jobs=jobs, progress=progress)
    firsts = _first_orders(points, given)
    rows = [_row(name, point, firsts[name], points, found) for name, point in points.items()]
    return Uncertainty(diagram, dict(given), found, rows)


def _named(diagram: Diagram) -> dict[str, SpecialPoint]:
    return {f"{branch.name}: {point.kind} {point.number}": point for branch in diagram for point in branch.special}


def _middle(diagram: Diagram, names: Mapping[str, Any]) -> dict[str, float]:
    """Returns the values of uncertain parameters in the diagram."""
    values: dict[str, float] = {}
    for branch in diagram:
        if len(branch):
            for name in names:
                values.setdefault(name, float(branch[name][0]))
    if not values:
        raise InputError(f"the study has no branches: {'; '.join(diagram.short)}\n  help: a study with at least one branch")
    return values


def _drawn(
    spreads: Mapping[str, tuple[float, float | None]], middle: Mapping[str, float], count: int, seed: int
) -> list[tuple[float, ...]]:
    if not count:
        return []
    unit = unit_hypercube(len(spreads), count, seed)
    from scipy.stats import norm

    columns: list[Floats] = []
    for k, (name, (low, high)) in enumerate(spreads.items()):
        columns.append(middle[name] + low * norm.ppf(unit[:, k]) if high is None else low + (high - low) * unit[:, k])
    return [tuple(row) for row in np.array(columns).T.tolist()]


def _first_orders(points: Mapping[str, SpecialPoint], given: Mapping[str, tuple[float, float | None]]) -> dict[str, float | None]:
    found: dict[str, float | None] = {}
    for name, point in points.items():
        band = point.branch.diagram._native.uncertainty(point.branch._index, point._index, given, 0)[0]
        first = next((row[2] for row in band if row[0] == point.branch.free), None)
        found[name] = None if first is None else float(first[1])
    return found


def _row(name: str, point: SpecialPoint, first: float | None, points: Mapping[str, SpecialPoint], found: Any) -> Spread:
    """Returns the distribution of a point. Samples in which its branch has another number of points of its kind do not count."""
    free, value = point.branch.free, point.value
    if found is None:
        return Spread(name, free, value, first, np.nan, np.nan, (np.nan, np.nan), 0, {})
    stem = name.rpartition(" ")[0]
    expected = sum(own.rpartition(" ")[0] == stem for own in points)
    labels = [str(own) for own in found["point"].values] if "point" in found.dims else []
    alike = [k for k, own in enumerate(labels) if own.rpartition(" ")[0] == stem]
    without: dict[str, int] = {}
    values = []
    failures = found["failure"].values
    table = found["value"].values if labels else np.empty((len(failures), 0))
    for case, failure in enumerate(failures):
        count = int(np.isfinite(table[case, alike]).sum())
        if failure or count != expected:
            why = failure or f"{count} points of this kind on the branch instead of {expected}"
            without[why] = without.get(why, 0) + 1
        else:
            values.append(table[case, labels.index(name)])
    own = np.array(values)
    if len(own) < 2:
        return Spread(name, free, value, first, np.nan, np.nan, (np.nan, np.nan), len(own), without)
    low, high = (float(end) for end in np.quantile(own, _ENDS))
    return Spread(name, free, value, first, float(own.mean()), float(own.std(ddof=1)), (low, high), len(own), without)

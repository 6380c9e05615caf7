"""Basins of attraction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arguments import check_model, number, suggestion
from ._arrays import Floats, Integers, finite, floats, integers, limits, processors, raw, tolerable, whole
from ._errors import ArgumentError, InputError
from ._solution import Solution

if TYPE_CHECKING:
    from ._model import Model

#: Reasons why a state has no attractor, by its number.
LOST = {-1: "not settled", -2: "unbounded", -3: "left the domain of f", -4: "step too small", -5: "not computed"}
#: 97.5 % quantile of the normal distribution.
QUANTILE = 1.959963984540054


class Basins:
    """Basins of attraction: the result of `foldline.basins`.

    Attributes
    ----------
    model : Model
    attractors : list of Solution
        The equilibria and cycles that were reached.
    samples : array, shape (samples, n)
        Initial states drawn uniformly from the ranges.
    fates : array of int, shape (samples,)
        For each of them the index of its attractor, or a negative number: -1 not settled, -2 unbounded, -3 left the region in which f
        is defined, -4 the step size became too small, -5 not computed.
    axes : pair of str, or None
        States that span the plane.
    x, y : arrays, shapes (columns,) and (rows,)
        Centres of the cells along both axes.
    cells : array of int, shape (rows, columns)
        Fate of each cell; row 0 has the smallest y.
    early : tuple, or None
        For each attractor the distance, relative to its size, at which a steady approach counted as settled, if there is one; number of
        trajectories that were followed further; number of those that then went elsewhere.
    filled : tuple, or None
        Of an adaptive section: for each cell 1 if it was computed and 0 if it was filled, shape (rows, columns); number of filled
        cells that were checked; number of those that were wrong.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "x - x^3"}, states={"x": dict(range=(-2, 2))})
    >>> found = foldline.basins(model, samples=64)
    >>> found.share(0)[0] + found.share(1)[0], found.share(-1)[0]
    (1.0, 0.0)
    """

    def __init__(
        self,
        model: Model,
        attractors: list[Solution],
        samples: Floats,
        fates: Integers,
        axes: tuple[str, str] | None,
        x: Floats,
        y: Floats,
        cells: Integers,
        early: tuple[list[float | None], int, int] | None,
        filled: tuple[Integers, int, int] | None = None,
    ) -> None:
        self.model = model
        self.attractors = attractors
        self.samples = samples
        self.fates = fates
        self.axes = axes
        self.x = x
        self.y = y
        self.cells = cells
        self.early = early
        self.filled = filled

    def share(self, fate: int) -> tuple[float, float, float]:
        """Returns the fraction of the ranges from which states go to an attractor.

        Parameters
        ----------
        fate : int
            Index of an attractor, or a negative number as in `fates`.

        Returns
        -------
        tuple of three floats
            Estimate from the samples, and its 95 % confidence interval (Wilson).

        Examples
        --------
        >>> import foldline
        >>> box = dict(range=(-2, 2))
        >>> model = foldline.model(equations={"x": "v", "v": "x - x^3 - 0.5*v"}, states={"x": box, "v": box})
        >>> share, low, high = foldline.basins(model, samples=256).share(0)
        >>> bool(low < 0.5 < high)
        True
        """
        hits, of = float(np.count_nonzero(self.fates == fate)), float(len(self.fates))
        if not of:
            return float("nan"), 0.0, 1.0
        square = QUANTILE * QUANTILE
        middle = (hits + 0.5 * square) / (of + square)
        half = QUANTILE / (of + square) * (hits * (of - hits) / of + 0.25 * square) ** 0.5
        return hits / of, min(max(middle - half, 0.0), hits / of), max(min(middle + half, 1.0), hits / of)

    def part(self, fate: int) -> float:
        """Returns the fraction of the plane from which states go to an attractor.

        Parameters
        ----------
        fate : int
            Index of an attractor, or a negative number as in `fates`.

        Returns
        -------
        float

        Examples
        --------
        >>> import foldline
        >>> box = dict(range=(-2, 2))
        >>> model = foldline.model(equations={"x": "v", "v": "x - x^3 - 0.5*v"}, states={"x": box, "v": box})
        >>> foldline.basins(model, samples=0, plane=("x", "v"), cells=16).part(0)
        0.5
        """
        return float(np.mean(self.cells == fate)) if self.cells.size else float("nan")

    def plot(self, ax: Any = None) -> Any:
        """Draws the basins in the plane with matplotlib.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.

        Returns
        -------
        matplotlib axes

        Raises
        ------
        InputError
            If no plane was computed.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> box = dict(range=(-2, 2))
        >>> model = foldline.model(equations={"x": "v", "v": "x - x^3 - 0.5*v"}, states={"x": box, "v": box})
        >>> axes = foldline.basins(model, samples=0, plane=("x", "v"), cells=16).plot()
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('x', 'v')
        """
        from matplotlib.colors import ListedColormap
        from matplotlib.patches import Patch

        from ._axes import axes_or_new

        if self.axes is None:
            raise InputError('there is no plane to draw\n  help: foldline.basins(model, plane=("x", "y"))')
        axes = axes_or_new(ax)
        lost = sorted((own for own in LOST if (self.cells == own).any()), reverse=True)
        basins = ["#56b4e9", "#e69f00", "#009e73", "#f0e442", "#cc79a7", "#0072b2", "#d55e00"]
        shades = {-1: "#c8c8c8", -2: "#000000", -3: "#7a5230", -4: "#444444", -5: "#ffffff"}
        kinds = [*range(len(self.attractors)), *lost]
        colours = [shades[own] if own < 0 else basins[own % len(basins)] for own in kinds]
        place = np.zeros(self.cells.shape, dtype=int)
        for index, own in enumerate(kinds):
            place[self.cells == own] = index
        half = [0.5 * (own[1] - own[0]) if len(own) > 1 else 0.5 for own in (self.x, self.y)]
        extent = (self.x[0] - half[0], self.x[-1] + half[0], self.y[0] - half[1], self.y[-1] + half[1])
        axes.imshow(
            place,
            origin="lower",
            extent=extent,
            cmap=ListedColormap(colours),
            vmin=-0.5,
            vmax=len(kinds) - 0.5,
            aspect="auto",
            interpolation="nearest",
        )
        names = [LOST[own] if own < 0 else self.attractors[own]._what() for own in kinds]
        said = [f"{name}: {100 * self.part(own):.1f} %" for name, own in zip(names, kinds, strict=True)]
        axes.legend(handles=[Patch(color=colour, label=label) for colour, label in zip(colours, said, strict=True)], loc="upper right")
        axes.set_xlabel(self.axes[0])
        axes.set_ylabel(self.axes[1])
        return axes

    def __repr__(self) -> str:
        shown = [(own._what(), index) for index, own in enumerate(self.attractors)]
        shown += [(name, own) for own, name in LOST.items() if (self.fates == own).any() or (self.cells == own).any()]
        lines = []
        for name, own in shown:
            share = "{:.3f} [{:.3f}, {:.3f}]".format(*self.share(own)) if len(self.fates) else ""
            lines.append(f"{share:>22}  {self.part(own):8.4f}  {name}" if self.axes else f"{share:>22}  {name}")
        head = f"{'fraction of the ranges':>22}  {'of plane':>8}  attractor" if self.axes else f"{'fraction of the ranges':>22}  attractor"
        return "\n".join([head, *lines])


def basins(
    model: Model,
    *,
    parameters: Mapping[str, float] | None = None,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    samples: int = 1024,
    seed: int = 1,
    plane: tuple[str, str] | None = None,
    at: Mapping[str, float] | None = None,
    cells: int | tuple[int, int] = 256,
    adaptive: int | None = None,
    tolerance: float = 1e-6,
    jobs: int | None = None,
    max_steps: int | None = None,
    max_time: float | None = None,
) -> Basins:
    """Finds which attractor each initial state leads to: at random in the ranges of the states, and in the cells of a plane.

    Parameters
    ----------
    model : Model
    parameters : mapping, optional
        Values that replace those of the model.
    ranges : mapping, optional
        Smallest and largest value of states; by default the ranges of the model.
    samples : int
        Number of initial states drawn uniformly from the ranges; 0 for none.
    seed : int
        Seed of the random numbers.
    plane : pair of str, optional
        States along the horizontal and the vertical axis of a plane.
    at : mapping, optional
        Values of the other states in the plane; by default 0, or the nearest value of the range.
    cells : int or pair
        Number of cells along both axes.
    adaptive : int, optional
        Computes the cells of the plane only where the fate changes, beginning with blocks of so many cells. The others are filled.
    tolerance : float
        Relative tolerance of the attractors, from 1e-10 to 1e-4.
    jobs : int, optional
        Number of threads; by default the number of processors.
    max_steps, max_time : optional
        Limits beyond which a trajectory counts as not settled.

    Returns
    -------
    Basins

    Raises
    ------
    ArgumentError, InputError
        If an argument is of the wrong kind, or a name is unknown.

    Examples
    --------
    >>> import foldline
    >>> box = dict(range=(-2, 2))
    >>> model = foldline.model(equations={"x": "v", "v": "x - x^3 - 0.5*v"}, states={"x": box, "v": box})
    >>> found = foldline.basins(model, samples=0, plane=("x", "v"), cells=16)
    >>> found.cells.shape, found.part(0), found.part(1)
    ((16, 16), 0.5, 0.5)
    """
    check_model(model, "foldline.basins({})")
    names = list(model.states)
    # Ranges and values that are not given are those of the model, which the compiled half knows.
    box = [[float("nan")] * 2 for _ in names]
    for name, pair in (ranges or {}).items():
        ends = finite(f"the range of {name}", pair)
        if ends.shape != (2,) or ends[0] > ends[1]:
            raise InputError(f"the range of {name} is not a pair (smallest, largest)\n  help: ranges={{{name!r}: (-1, 1)}}")
        box[_index(model, name)] = [float(ends[0]), float(ends[1])]
    count = whole("samples", samples, 0)
    if plane is None and count == 0:
        raise InputError('nothing is left to compute\n  help: a number of samples, or plane=("x", "y")')
    section, axes, columns, rows = None, (0, 0), 0, 0
    if plane is not None:
        if isinstance(plane, str) or len(plane) != 2 or plane[0] == plane[1]:
            raise ArgumentError(f"plane={plane!r} is not a pair of states\n  help: plane=({names[0]!r}, {names[-1]!r})")
        axes = _index(model, plane[0]), _index(model, plane[1])
        number_of = cells if isinstance(cells, (tuple, list)) else (cells, cells)
        columns, rows = (whole("cells", own) for own in number_of)
        through = [float("nan")] * len(names)
        for name, value in (at or {}).items():
            index = _index(model, name)
            if index in axes:
                raise InputError(f"{name} is an axis of the plane\n  help: at={{...}} is for the other states")
            through[index] = number(name, value)
        section = (axes, (columns, rows), raw(through))
    if adaptive is not None and plane is None:
        raise ArgumentError("adaptive has no effect without a plane\n  help: plane=('x', 'y'), adaptive=8")
    found, drawn, fates, states, early, spans, filled = _native.basins(
        model._native,
        model._values(parameters),
        raw(box),
        section,
        count,
        whole("seed", seed, 0),
        tolerable(tolerance),
        processors(jobs),
        limits(max_steps, max_time),
        None if adaptive is None else whole("adaptive", adaptive),
    )
    attractors = [Solution(own, model) for own, _ in found]
    used = floats(spans, len(names), 2)
    x, y = (low + (np.arange(n) + 0.5) / max(n, 1) * (high - low) for n, (low, high) in ((columns, used[axes[0]]), (rows, used[axes[1]])))
    grid = integers(fates).reshape(len(y), len(x)) if plane is not None else np.empty((0, 0), dtype=np.int64)
    samples_of = floats(states, count, len(names))
    known = None if filled is None else (integers(filled[0]).reshape(len(y), len(x)), *filled[1:])
    return Basins(model, attractors, samples_of, integers(drawn), (plane[0], plane[1]) if plane else None, x, y, grid, early, known)


def _index(model: Model, name: str) -> int:
    names = list(model.states)
    if name not in names:
        raise InputError(f"the model `{model.name}` has no state `{name}`\n  help: {suggestion(str(name), names)}")
    return names.index(name)

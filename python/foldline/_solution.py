"""Solutions one by one: equilibria and cycles."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

from . import _native
from ._arguments import suggestion
from ._arrays import Complexes, Floats, complexes, floats, whole
from ._errors import InputError

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._branch import Branch
    from ._model import Model


class Solution:
    """An equilibrium or a cycle (periodic orbit) at given parameters, with its stability and error estimates.

    ``solution["Omega"]`` is a parameter, ``solution["r_max"]`` an extreme of a state or output (``solution["r"]`` the largest value),
    ``solution["period"]`` the period.

    Attributes
    ----------
    model : Model
        Model that the solution satisfies.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "y", "y": "-x - 0.2*y"})
    >>> rest = model.settle([0.1, 0.0])
    >>> rest.family, rest.stable, rest.unstable
    ('equilibrium', True, 0)
    >>> rest.spectrum.real.round(6).tolist()
    [-0.1, -0.1]
    """

    #: Branch on which it lies, and its number there, if it was taken from one.
    _home: tuple[Branch, int] | None = None

    def __init__(self, native: _native.Solution, model: Model) -> None:
        self._native = native
        self.model = model

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the branch on which it lies. A solution that lies on none cannot be pickled."""
        if self._home is None:
            cure = "a point of a branch, branch[0]; or send model and state, and let it settle again: model.settle(solution.state)"
            raise TypeError(f"a solution that lies on no branch cannot be pickled\n  help: {cure}")
        return operator.getitem, self._home

    @property
    def family(self) -> str:
        """``"equilibrium"`` or ``"cycle"``."""
        return self._native.family

    @property
    def is_cycle(self) -> bool:
        """True for a cycle."""
        return self.family == "cycle"

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Values of all parameters of the model, in its units."""
        return dict(zip(self.model.parameters, floats(self._native.parameters()).tolist(), strict=True))

    @property
    def period(self) -> float | None:
        """Period of a cycle, in the time unit of the model; None for an equilibrium."""
        return self._native.period

    @property
    def turns(self) -> dict[str, int]:
        """Number of turns of each state that is an angle over the cycle, with its sign."""
        return dict(self._native.turns)

    @property
    def forcing_periods(self) -> int:
        """Number of forcing periods that a cycle lasts; 0 if the model is not forced."""
        return self._native.forcing_periods

    @property
    def unstable(self) -> int:
        """Number of unstable eigenvalues or multipliers."""
        return self._native.unstable

    @property
    def stable(self) -> bool:
        """True if no eigenvalue or multiplier is unstable."""
        return self.unstable == 0

    @cached_property
    def state(self) -> Floats:
        """The equilibrium, or the first state of the cycle, shape (n,). A forced cycle begins with a forcing period."""
        return floats(self._native.state())

    @cached_property
    def spectrum(self) -> Complexes:
        """Eigenvalues of an equilibrium (per time unit), or Floquet multipliers of a cycle, shape (n,). The trivial multiplier comes first."""
        return complexes(self._native.spectrum())

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of every state and output, in the units of the model."""
        rows = floats(self._native.ranges()).reshape(-1, 2).tolist()
        names = [*self.model.states, *self.model.outputs]
        return {name: (low, high) for name, (low, high) in zip(names, rows, strict=False)}

    @property
    def trust(self) -> dict[str, float]:
        """Error estimates: `discretisation`, `residual`, `trivial_defect`, `liouville_defect`, `spectrum_error`."""
        names = ("discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error")
        return dict(zip(names, self._native.trust, strict=True))

    @property
    def ratio(self) -> tuple[int, int] | None:
        """Ratio of the two strongest spectral lines of a whirling cycle, such as (2, 1); None if one line outweighs all others."""
        return self._native.ratio

    @cached_property
    def mesh(self) -> Floats:
        """Boundaries of the N mesh intervals of a cycle, shape (N + 1,), in fractions of the period."""
        return floats(self._native.mesh())

    @cached_property
    def profile(self) -> Floats:
        """Collocation values of a cycle, shape (N, m + 1, n): on each mesh interval the left end and the m collocation points."""
        values, degree = self._native.profile()
        return floats(values, -1, degree + 1, len(self.model.states)) if degree else floats(values)

    @cached_property
    def t(self) -> Floats:
        """Times of the nodes of the profile, shape (N (m + 1),), in the time unit of the model."""
        times = floats(self._native.node_times())
        return times * (self.period or 0.0)

    @property
    def states(self) -> Floats:
        """States at the times `t`, shape (N (m + 1), n); shape (1, n) for an equilibrium."""
        return self.profile.reshape(-1, len(self.model.states)) if self.is_cycle else self.state[None, :]

    def _check_stored(self) -> None:
        """Refuses a cycle whose profile was not stored in the run file."""
        if self.is_cycle and not self.state.size:
            cure = 'a special point or an end of its branch, whose profiles are kept; or run the study with store = "all"'
            raise InputError(f"the profile of this cycle was not stored\n  help: {cure}")

    def uniform(self, count: int = 1024) -> dict[str, Floats]:
        """Returns a cycle at uniformly spaced times over one period, the end point excluded.

        Parameters
        ----------
        count : int
            Number of times.

        Returns
        -------
        dict of arrays, shape (count,)
            `t`, every state and every output, in the units of the model. For an equilibrium the arrays are empty.

        Raises
        ------
        InputError
            If `count` is not a positive whole number, or the profile of the cycle was not stored.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> track = model.settle("cycle").uniform(4)
        >>> track["x"].round(4).tolist()
        [0.5, 0.5, -0.5, -0.5]
        """
        import numpy as np

        count = whole("count", count)
        self._check_stored()
        names = [*self.model.states, *self.model.outputs]
        rows = floats(self._native.uniform(count)).reshape(-1, len(names))
        times = np.arange(len(rows), dtype=np.float64) * np.float64((self.period or 0.0) / count)
        return {"t": times, **{name: rows[:, k] for k, name in enumerate(names)}}

    def signed_spectrum(self, count: int = 1024) -> tuple[Floats, Complexes]:
        """Returns the two-sided spectrum of the whirling motion u + jv: forward whirl at positive frequencies, backward at negative ones.

        Parameters
        ----------
        count : int
            Number of samples, and of spectral lines.

        Returns
        -------
        frequencies : array, shape (count,)
            Frequencies in cycles per time unit of the model; empty if the model names no whirl.
        amplitudes : complex array, shape (count,)
            Amplitudes in the unit of the states u and v.

        Raises
        ------
        InputError
            If `count` is not a positive whole number, or the profile of the cycle was not stored.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x", "y": "sin(w*t) - y"}, parameters={"w": 1.0}, frequency="w", whirl="x y")
        >>> frequencies, amplitudes = model.settle("cycle").signed_spectrum(8)
        >>> largest = abs(amplitudes).argmax()
        >>> round(float(6.28318531*frequencies[largest]), 6), round(float(abs(amplitudes[largest])), 6)
        (1.0, 0.707107)
        """
        count = whole("count", count)
        self._check_stored()
        frequencies, amplitudes = self._native.signed_spectrum(count)
        return floats(frequencies), complexes(amplitudes)

    def __getitem__(self, name: str) -> float:
        """A parameter, `period`, or `NAME`, `NAME_max` or `NAME_min` of a state or output."""
        if name in self.parameters:
            return self.parameters[name]
        if name == "period":
            return float("nan") if self.period is None else self.period
        if name in self.ranges:
            return self.ranges[name][1]
        for ending, side in (("_max", 1), ("_min", 0)):
            if name.endswith(ending) and name[: -len(ending)] in self.ranges:
                return self.ranges[name[: -len(ending)]][side]
        known = [*self.parameters, "period", *(f"{own}_{side}" for own in self.ranges for side in ("max", "min"))]
        raise KeyError(f"{name}: {suggestion(str(name), known)}")

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each node of the profile of a cycle; an equilibrium has one row.

        Returns
        -------
        pandas.DataFrame
            Columns `t`, every state and every output, in the units of the model.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> list(model.settle("cycle").to_pandas())
        ['t', 'x']
        """
        from ._tables import solution_frame

        return solution_frame(self)

    def to_xarray(self) -> xarray.Dataset:
        """Returns a data set over the dimension `t`.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> list(model.settle("cycle").to_xarray().sizes)
        ['t']
        """
        from ._tables import solution_dataset

        return solution_dataset(self)

    def plot(self, axes: Any = None) -> dict[str, list[Any]]:
        """Draws a cycle with matplotlib: orbit, time series, signed spectrum, and multipliers on the unit circle.

        For an equilibrium its eigenvalues are drawn.

        Parameters
        ----------
        axes : sequence of matplotlib axes, optional
            One for each panel; by default a new figure.

        Returns
        -------
        dict
            Artists of the panels `orbit`, `series`, `spectrum` (if the model names a whirl) and `multipliers`.

        Raises
        ------
        InputError
            If there are not as many axes as panels, or the profile of the cycle was not stored.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> list(model.settle("cycle").plot())
        ['orbit', 'series', 'multipliers']
        """
        from ._plot import solution

        return solution(self, axes)

    def _what(self) -> str:
        period = "" if self.period is None else f" of period {self.period:.9g}"
        ratio = self.ratio
        named = f"{ratio[0]}:{ratio[1]} " if ratio else ""
        stability = "stable" if self.stable else f"unstable ({self.unstable})"
        return f"{stability} {named}{self.family}{period}"

    def __repr__(self) -> str:
        at = ", ".join(f"{name}={value:g}" for name, value in self.parameters.items())
        return f"<{self._what()} of {self.model.name}{' at ' if at else ''}{at}>"

    def _repr_html_(self) -> str:
        from ._html import solution

        return solution(self)


class Attractor(Solution):
    """A stable solution that sampled initial states reached.

    Attributes
    ----------
    hits : int
        Number of initial states that settled there. It is not a basin fraction, because every fourth initial state is drawn towards
        the origin.
    share : tuple of three floats
        Basin fraction, estimated from the initial states drawn uniformly from the ranges, and its 95 % confidence interval (Wilson).
    example : array, shape (n,)
        The first initial state that settled there.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "x - x^3"}, states={"x": dict(range=(-2, 2))})
    >>> left, right = model.attractors(samples=16)
    >>> left.hits + right.hits, left.share[0] + right.share[0]
    (16, 1.0)
    """

    def __init__(
        self,
        native: _native.Solution,
        model: Model,
        ratio: tuple[int, int] | None,
        hits: int,
        share: tuple[float, float, float] | None,
        example: Floats,
    ) -> None:
        super().__init__(native, model)
        self._ratio = ratio
        self.hits = hits
        self.share = share
        self.example = example

    @property
    def ratio(self) -> tuple[int, int] | None:
        """Ratio of the two strongest spectral lines of a whirling cycle, such as (2, 1); None if one line outweighs all others."""
        return self._ratio


class Attractors(Sequence[Attractor]):
    """The attractors that sampled initial states reached: a sequence, the most frequent first.

    Attributes
    ----------
    samples : int
        Number of initial states.
    escaped : int
        Number of those that ran to infinity or left the region in which f is defined.
    stuck : int
        Number of those that could not be integrated.
    unsettled : int
        Number of those that did not settle.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "x - x^3"}, states={"x": dict(range=(-2, 2))})
    >>> found = model.attractors(samples=16)
    >>> len(found), found.samples, found.escaped, found.unsettled
    (2, 16, 0, 0)
    """

    def __init__(self, found: list[Attractor], samples: int, escaped: int, stuck: int, unsettled: int) -> None:
        self._found = found
        self.samples = samples
        self.escaped = escaped
        self.stuck = stuck
        self.unsettled = unsettled

    @overload
    def __getitem__(self, index: int) -> Attractor: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Attractor]: ...
    def __getitem__(self, index: int | slice) -> Attractor | Sequence[Attractor]:
        return self._found[index]

    def __len__(self) -> int:
        return len(self._found)

    def __iter__(self) -> Iterator[Attractor]:
        return iter(self._found)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each attractor.

        Returns
        -------
        pandas.DataFrame
            `family`, `ratio`, `hits`, `share` with its confidence interval, `period`, and the extremes of every state and output.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": 0.0})
        >>> model.attractors(samples=16).to_pandas()["family"].tolist()
        ['equilibrium', 'equilibrium']
        """
        from ._tables import attractors_frame

        return attractors_frame(self)

    def __repr__(self) -> str:
        shares = ["" if own.share is None else "{:.3f} [{:.3f}, {:.3f}]".format(*own.share) for own in self]
        lines = [f"{own.hits:6d}  {share:>20}  {own._what()}" for own, share in zip(self, shares, strict=True)]
        stuck = f", {self.stuck} stuck" if self.stuck else ""
        lines.append(f"{self.samples} samples, {self.escaped} escaped{stuck}, {self.unsettled} not settled")
        return "\n".join([f"  hits  {'share of uniform':>20}  attractor", *lines])

    def _repr_html_(self) -> str:
        from ._html import attractors

        return attractors(self)

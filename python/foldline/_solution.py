"""Solutions one by one: equilibria and cycles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

from . import _native
from ._arrays import Complexes, Floats, complexes, floats

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._model import Model


class Solution:
    """An equilibrium or a cycle (periodic orbit) at given parameters, with its stability and how far it can be trusted.

    ``solution["Omega"]`` is a parameter, ``solution["r_max"]`` an extreme of a state or output (``solution["r"]`` the largest),
    ``solution["period"]`` the period.

    Attributes
    ----------
    model : Model
    """

    def __init__(self, native: _native.Solution, model: Model) -> None:
        self._native = native
        self.model = model

    @property
    def family(self) -> str:
        """``"equilibrium"`` or ``"cycle"``."""
        return self._native.family

    @property
    def is_cycle(self) -> bool:
        """Whether it is a cycle."""
        return self.family == "cycle"

    @cached_property
    def parameters(self) -> dict[str, float]:
        """Every parameter of the model."""
        return dict(zip(self.model.parameters, floats(self._native.parameters()).tolist(), strict=True))

    @property
    def period(self) -> float | None:
        """The period of a cycle, in the time unit of the model."""
        return self._native.period

    @property
    def turns(self) -> dict[str, int]:
        """How often each state that is an angle turns over the cycle, with its sign."""
        return dict(self._native.turns)

    @property
    def forcing_periods(self) -> int:
        """How many periods of the forcing a cycle lasts; 0 where there is none."""
        return self._native.forcing_periods

    @property
    def unstable(self) -> int:
        """How many eigenvalues or multipliers are unstable."""
        return self._native.unstable

    @property
    def stable(self) -> bool:
        """Whether none is."""
        return self.unstable == 0

    @cached_property
    def state(self) -> Floats:
        """The equilibrium, or the first state of the cycle, shape (n,)."""
        return floats(self._native.state())

    @cached_property
    def spectrum(self) -> Complexes:
        """Eigenvalues of an equilibrium, Floquet multipliers of a cycle (the trivial one first where it is not forced), shape (n,)."""
        return complexes(self._native.spectrum())

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of every state and output."""
        rows = floats(self._native.ranges()).reshape(-1, 2).tolist()
        names = [*self.model.states, *self.model.outputs]
        return {name: (low, high) for name, (low, high) in zip(names, rows, strict=False)}

    @property
    def trust(self) -> dict[str, float]:
        """How far it can be trusted: `discretisation`, `residual`, `trivial_defect`, `liouville_defect`, `spectrum_error`."""
        names = ("discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error")
        return dict(zip(names, self._native.trust, strict=True))

    @property
    def ratio(self) -> tuple[int, int] | None:
        """The ratio of the two strongest spectral lines of a whirling cycle, such as (2, 1); None where one outweighs all others."""
        return self._native.ratio

    @cached_property
    def mesh(self) -> Floats:
        """Boundaries of the N mesh intervals of a cycle in normalised time, shape (N + 1,)."""
        return floats(self._native.mesh())

    @cached_property
    def profile(self) -> Floats:
        """A cycle as it was computed, shape (N, m + 1, n): on each interval its left end and its m Gauss points."""
        values, degree = self._native.profile()
        return floats(values, -1, degree + 1, len(self.model.states)) if degree else floats(values)

    @cached_property
    def t(self) -> Floats:
        """Times of the nodes of the profile, shape (N (m + 1),), in the unit of the model."""
        times = floats(self._native.node_times())
        return times * (self.period or 0.0)

    @property
    def states(self) -> Floats:
        """The states at the times `t`, shape (N (m + 1), n); of an equilibrium shape (1, n)."""
        return self.profile.reshape(-1, len(self.model.states)) if self.is_cycle else self.state[None, :]

    def uniform(self, count: int = 1024) -> dict[str, Floats]:
        """A cycle at uniformly spaced times over one period, the end point excluded.

        Parameters
        ----------
        count : int

        Returns
        -------
        dict of arrays, shape (count,)
            `t`, every state, every output.
        """
        import numpy as np

        names = [*self.model.states, *self.model.outputs]
        rows = floats(self._native.uniform(count)).reshape(-1, len(names))
        times = np.arange(len(rows), dtype=np.float64) * np.float64((self.period or 0.0) / count)
        return {"t": times, **{name: rows[:, k] for k, name in enumerate(names)}}

    def signed_spectrum(self, count: int = 1024) -> tuple[Floats, Complexes]:
        """The two-sided spectrum of the whirling motion u + jv: forward whirl at positive frequencies, backward at negative ones.

        Parameters
        ----------
        count : int
            How many samples, and lines.

        Returns
        -------
        frequencies : array, shape (count,)
            In cycles per time unit of the model; empty where the model names no whirl.
        amplitudes : complex array, shape (count,)
        """
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
        raise KeyError(f"{name}: a parameter, `period`, or NAME_max or NAME_min of {', '.join(self.ranges)}")

    def to_pandas(self) -> pandas.DataFrame:
        """A cycle as a table with a row for each node of its profile; an equilibrium as one row."""
        from ._tables import solution_frame

        return solution_frame(self)

    def to_xarray(self) -> xarray.Dataset:
        """The same as a data set over the dimension `t`."""
        from ._tables import solution_dataset

        return solution_dataset(self)

    def plot(self, axes: Any = None) -> dict[str, list[Any]]:
        """Draws a cycle: its orbit, its time series, its signed spectrum, its multipliers on the unit circle.

        An equilibrium is drawn as its eigenvalues.

        Parameters
        ----------
        axes : sequence of matplotlib axes, optional
            One for each panel; by default a figure of its own.

        Returns
        -------
        dict
            The artists of `orbit`, `series`, `spectrum` and `multipliers`.
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
    """A stable solution, and how often it was reached.

    Attributes
    ----------
    hits : int
        How many initial states went there. This is not a share of a basin of attraction: every fourth initial state is drawn
        towards the origin.
    share : tuple of three floats
        The share of the initial states drawn uniformly from the ranges that went there, and its 95 % confidence interval
        (Wilson).
    example : array, shape (n,)
        The first of them.
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
        """The ratio of the two strongest spectral lines of a whirling cycle, such as (2, 1); None where one outweighs all others."""
        return self._ratio


class Attractors(Sequence[Attractor]):
    """Where sampled initial states settled.

    Attributes
    ----------
    samples, escaped, stuck, unsettled : int
        How many initial states there were, and how many ran to infinity or out of the region in which f is defined, could not be
        followed, or did not settle.
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
        """A table with a row for each."""
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

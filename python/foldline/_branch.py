"""Branches: curves of solutions, with their special points."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _native
from ._arrays import Complexes, Floats, Integers, complexes, floats, integers
from ._solution import Solution

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._diagram import Diagram

TRUST = ("discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error")
WORK = ("newton", "factorisations", "rejected", "evaluations", "linearisations")


class SpecialPoint(Solution):
    """A located special point: a solution, and what happens there.

    Attributes
    ----------
    kind : str
        ``"fold"``, ``"hopf"``, ``"period-doubling"`` …
    number : int
        Of the special points of this kind on its branch, from 1 at the side of smaller positions.
    branch : Branch
        On which it lies.
    unstable_before, unstable_after : int
        Unstable eigenvalues or multipliers on the side of smaller and of larger positions.
    error : float
        Bound on the error of the parameter, relative to ``branch.scale`` + |value|, of the extremes of states, relative to their scale +
        |value|, of the period, relative to that, and of the extremes of outputs, relative to 1 + |value|.
    coefficients : tuple of float
        Of the normal form.
    coefficient_errors : tuple of float
        Bounds on the errors of the coefficients.
    criticality : str or None
        ``"supercritical"`` or ``"subcritical"`` where that is known, ``"degenerate"`` where a coefficient that matters is zero within its
        error, ``"undetermined"`` where the error is as large as what the coefficient is made of.
    normal_form : str
        Coefficients and criticality in words, or why there are none.
    """

    def __init__(self, branch: Branch, index: int, number: int, row: Any) -> None:
        diagram = branch.diagram
        super().__init__(diagram._native.solution(branch._index, True, index), diagram.model)
        self.branch = branch
        self.number = number
        self.kind: str = row[0]
        self.unstable_before: int = row[1]
        self.unstable_after: int = row[2]
        self.error: float = row[3]
        self.coefficients: tuple[float, ...] = tuple(row[4][0])
        self.coefficient_errors: tuple[float, ...] = tuple(row[4][1])
        self.criticality: str | None = row[5]
        self.normal_form: str = row[6]

    @property
    def value(self) -> float:
        """Of the parameter of the branch."""
        return self[self.branch.free]

    def __repr__(self) -> str:
        form = f", {self.normal_form}" if self.normal_form else ""
        error = self.error * (self.branch.scale + abs(self.value))
        return f"<{self.kind} of {self.branch.name} at {self.branch.free} = {self.value:.10g} ± {error:.1e}{form}>"


class SpecialPoints(Sequence[SpecialPoint]):
    """Special points in order: ``points[0]``, or those of one kind, ``points["fold"]``."""

    def __init__(self, found: Sequence[SpecialPoint]) -> None:
        self._found = list(found)

    @overload
    def __getitem__(self, index: int) -> SpecialPoint: ...
    @overload
    def __getitem__(self, index: slice | str) -> SpecialPoints: ...
    def __getitem__(self, index: int | slice | str) -> SpecialPoint | SpecialPoints:
        if isinstance(index, str):
            kind = index.replace("_", "-")
            return SpecialPoints([own for own in self._found if own.kind == kind])
        found = self._found[index]
        return SpecialPoints(found) if isinstance(found, list) else found

    def __len__(self) -> int:
        return len(self._found)

    def __iter__(self) -> Iterator[SpecialPoint]:
        return iter(self._found)

    def to_pandas(self) -> pandas.DataFrame:
        """The table of special points, as `foldline table --special` has it."""
        from ._tables import special_frame

        return special_frame(self)

    def __repr__(self) -> str:
        from ._html import special_text

        return special_text(self)

    def _repr_html_(self) -> str:
        from ._html import special_table

        return special_table(self)


class Branch(Sequence[Solution]):
    """A curve of solutions in one parameter, or in two with a special point held.

    ``branch["Omega"]`` and ``branch["r_max"]`` are columns, ``branch[0]`` and ``branch[-1]`` solutions.

    Attributes
    ----------
    name : str
    family : str
        ``"equilibrium"`` or ``"cycle"``.
    free : str
        The parameter of the continuation.
    scale : float
        The scale of that parameter: errors are relative to it.
    held : tuple or None
        Of a curve in two parameters: what is held, and the parameter that follows from it.
    origin : tuple
        Where it comes from: ``("seed", name, None, None)``, ``("end", name, None, None)`` or ``("switch", parent, kind, value)``.
    ends : tuple of str
        How the side of smaller and the side of larger positions ended.
    diagram : Diagram
        To which it belongs.
    """

    def __init__(self, diagram: Diagram, index: int, parts: Mapping[str, Any]) -> None:
        names = list(diagram.model.parameters)
        self.diagram = diagram
        self._index = index
        self.name: str = parts["name"]
        self.family: str = parts["family"]
        self.free: str = names[parts["free"]]
        self.scale: float = parts["scale"]
        held = parts["held"]
        self.held: tuple[str, str] | None = None if held is None else (held[0], names[held[1]])
        self.origin: tuple[str, str, str | None, float | None] = tuple(parts["origin"])
        self._count: int = parts["points"]
        self._ends: list[tuple[str, str, bool] | None] = parts["ends"]
        self.ends: tuple[str, str] = tuple("not finished" if end is None else end[1] for end in self._ends)  # type: ignore[assignment]

    @property
    def complete(self) -> bool:
        """Whether both sides ended where they should: at a bound, closed, or joined to another branch."""
        return all(end is not None and end[2] for end in self._ends)

    @property
    def stopped(self) -> bool:
        """Whether it was interrupted."""
        return any(end is None or end[0] == "stopped" for end in self._ends)

    # Columns.

    def _column(self, name: str) -> bytes:
        return self.diagram._native.column(self._index, False, name)

    @cached_property
    def position(self) -> Integers:
        """Place on the branch, shape (points,): 0 at the start, counting up forwards and down backwards."""
        return integers(self._column("position"))

    @cached_property
    def parameters(self) -> Floats:
        """Every parameter of every point, shape (points, k)."""
        return floats(self._column("parameters"), self._count, -1) if self._count else np.empty((0, 0))

    @cached_property
    def ranges(self) -> Floats:
        """Smallest and largest value of every state, then of every output, shape (points, n + outputs, 2)."""
        return floats(self._column("ranges"), self._count, -1, 2) if self._count else np.empty((0, 0, 2))

    @cached_property
    def spectrum(self) -> Complexes:
        """Eigenvalues or Floquet multipliers, shape (points, n); the trivial multiplier first where there is one."""
        return complexes(self._column("spectrum"), self._count, -1) if self._count else np.empty((0, 0), dtype=complex)

    @cached_property
    def unstable(self) -> Integers:
        """How many eigenvalues or multipliers are unstable, shape (points,)."""
        return integers(self._column("unstable"))

    @property
    def stable(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Whether none is, shape (points,)."""
        found: np.ndarray[Any, np.dtype[np.bool_]] = self.unstable == 0
        return found

    @cached_property
    def period(self) -> Floats:
        """Periods in the time unit of the model, shape (points,); NaN for equilibria."""
        return floats(self._column("period"))

    @property
    def columns(self) -> list[str]:
        """What ``branch[name]`` knows."""
        model = self.diagram.model
        extremes = [f"{name}_{side}" for name in [*model.outputs, *model.states] for side in ("min", "max")]
        turns = [f"{name}_turns" for name, state in model.states.items() if state["period"]]
        return ["position", *model.parameters, "period", *turns, *extremes, "unstable", *TRUST, *WORK, "step", "forcing_periods"]

    @cached_property
    def _turns(self) -> dict[str, Integers]:
        """NAME_turns of every state that is an angle: how often it turns over a cycle, shape (points,)."""
        gain = floats(self._column("gain")).reshape(self._count, -1)
        angles = [(k, name, state["period"]) for k, (name, state) in enumerate(self.diagram.model.states.items()) if state["period"]]
        none = np.zeros(self._count, dtype=np.int64)
        return {f"{name}_turns": np.rint(gain[:, k] / turn).astype(np.int64) if gain.size else none for k, name, turn in angles}

    def _by_name(self, name: str) -> Floats | Integers:
        model = self.diagram.model
        if name in model.parameters:
            return self.parameters[:, list(model.parameters).index(name)]
        variables = [*model.states, *model.outputs]
        for ending, side in (("", 1), ("_max", 1), ("_min", 0)):
            own = name[: -len(ending)] if ending and name.endswith(ending) else name
            if own in variables and (own != name or not ending):
                return self.ranges[:, variables.index(own), side]
        if name == "period":
            return self.period
        if name in self._turns:
            return self._turns[name]
        if name in ("position", "unstable", "forcing_periods", *WORK):
            return integers(self._column(name))
        if name in (*TRUST, "step"):
            return floats(self._column(name))
        raise KeyError(f"{name}: one of {', '.join(self.columns)}")

    @overload
    def __getitem__(self, index: int) -> Solution: ...
    @overload
    def __getitem__(self, index: slice) -> list[Solution]: ...
    @overload
    def __getitem__(self, index: str) -> Any: ...
    def __getitem__(self, index: int | slice | str) -> Any:
        if isinstance(index, str):
            return self._by_name(index)
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(self._count))]
        place = index + self._count if index < 0 else index
        if not 0 <= place < self._count:
            raise IndexError(f"the branch {self.name} has {self._count} points")
        return Solution(self.diagram._native.solution(self._index, False, place), self.diagram.model)

    def __len__(self) -> int:
        return self._count

    @cached_property
    def special(self) -> SpecialPoints:
        """The special points, by position."""
        seen: dict[str, int] = {}
        found = []
        for index, row in enumerate(self.diagram._native.special(self._index)):
            seen[row[0]] = seen.get(row[0], 0) + 1
            found.append(SpecialPoint(self, index, seen[row[0]], row))
        return SpecialPoints(found)

    @property
    def switched(self) -> list[Branch]:
        """The branches of the diagram that leave this one at its special points."""
        return [own for own in self.diagram if own.origin[:2] == ("switch", self.name) and own.held is None]

    def switch(
        self,
        point: SpecialPoint,
        *,
        depth: int = 1,
        range: Sequence[float] | None = None,
        mark: Mapping[str, Any] | None = None,
        stop: Mapping[str, Any] | None = None,
        max_points: int = 10_000,
        out: str | os.PathLike[str] | None = None,
        jobs: int | None = None,
        resume: bool = False,
        progress: bool | Callable[[int, int, str], None] | None = None,
    ) -> Branch:
        """Follows the branch that leaves this one at a Hopf point, branch point or period doubling.

        Parameters
        ----------
        point : SpecialPoint
            Of this branch.
        depth : int
            At how many levels it is switched on, at points of the same kind of the new branch.
        range : pair, optional
            Smallest and largest value of the parameter; by default those of this branch.
        mark, stop, max_points, out, jobs, progress
            As for `foldline.follow`.

        Returns
        -------
        Branch
            In a diagram with this one.

        Raises
        ------
        NoSolution
            Where no branch leaves there, or one that is known already; the message says which.
        """
        from ._compute import switched

        own = {"range": range, "mark": mark, "stop": stop, "max-points": max_points}
        return switched(self, point, depth, own, out=out, jobs=jobs, resume=resume, progress=progress)

    def _shown(self, unit: Mapping[str, str] | None) -> Branch:
        return self if not unit else self.diagram._shown(unit).branches[self._index]

    def plot(
        self,
        ax: Any = None,
        x: str | None = None,
        y: str | None = None,
        unit: Mapping[str, str] | None = None,
        **style: Any,
    ) -> list[Any]:
        """Draws the branch: stable pieces solid, unstable ones dashed, special points as marks.

        Parameters
        ----------
        ax : matplotlib axes, optional
        x, y : str, optional
            Columns; by default the free parameter, and the largest value of the first output.
        unit : mapping, optional
            Units in which quantities are shown, as for `Diagram.plot`.
        **style
            For the lines, such as ``color="black"``.

        Returns
        -------
        list of matplotlib artists
        """
        from ._plot import branch

        return branch(self._shown(unit), ax, x, y, style)

    def plotly(self, x: str | None = None, y: str | None = None) -> Any:
        """An interactive figure of this branch; see `Diagram.plotly`."""
        from ._plotly import figure

        return figure([self], x, y)

    def to_pandas(self, unit: Mapping[str, str] | None = None) -> pandas.DataFrame:
        """A table with a row for each point and the columns of `foldline table --points`; `unit` as for `plot`."""
        from ._tables import branches_frame

        return branches_frame([self._shown(unit)])

    def to_xarray(self) -> xarray.Dataset:
        """A data set over the dimensions `point`, `eigenvalue` and `variable`."""
        from ._tables import branches_dataset

        return branches_dataset([self])

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes the diagram of the branch as a run; see `Diagram.save`."""
        self.diagram.save(folder)

    def __repr__(self) -> str:
        from ._html import branch_text

        return branch_text(self)

    def _repr_html_(self) -> str:
        from ._html import branches

        return branches([self], branch_text_of(self))


def branch_text_of(branch: Branch) -> str:
    """One line about a branch."""
    held = f", {branch.held[0]} held, {branch.held[1]} following" if branch.held else ""
    span = ""
    if len(branch):
        low, high = np.min(branch[branch.free]), np.max(branch[branch.free])
        span = f" in {low:.6g} … {high:.6g}"
    ends = "; ".join(dict.fromkeys(end.splitlines()[0] for end in branch.ends))
    return f"{branch.name}: {len(branch)} points over {branch.free}{span}{held}, {len(branch.special)} special; {ends}"


def native_only(branch: Branch) -> _native.Diagram:
    """A diagram of this branch alone."""
    return branch.diagram._native.only(branch._index, branch.name)

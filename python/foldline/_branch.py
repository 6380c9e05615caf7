"""Branches: curves of solutions, with their special points."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from . import _native
from ._arguments import suggestion
from ._arrays import Complexes, Floats, Integers, complexes, floats, integers, whole
from ._sensitivity import Band, Sensitivity, bands, spreads
from ._solution import Solution

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._diagram import Diagram
    from ._responses import Responses
    from ._strobe import Strobe

TRUST = ("discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error")
WORK = ("newton", "factorisations", "rejected", "evaluations", "linearisations")


class SpecialPoint(Solution):
    """A located special point: a solution, and the bifurcation there.

    Attributes
    ----------
    kind : str
        ``"fold"``, ``"hopf"``, ``"period-doubling"`` …
    number : int
        Number among the special points of this kind on the branch, counted from 1 at the side of smaller positions.
    branch : Branch
        Branch on which it lies.
    unstable_before, unstable_after : int
        Number of unstable eigenvalues or multipliers on the side of smaller and of larger positions.
    error : float
        Error bound. It holds for the parameter, relative to ``branch.scale`` + |value|; for the extremes of states, relative to their
        scale + |value|; for the period, relative to the period; and for the extremes of outputs, relative to 1 + |value|.
    coefficients : tuple of float
        Coefficients of the normal form.
    coefficient_errors : tuple of float
        Error bounds of the coefficients.
    criticality : str or None
        ``"supercritical"`` or ``"subcritical"`` if known; ``"degenerate"`` if a decisive coefficient is zero within its error;
        ``"undetermined"`` if the error is as large as the terms of which the coefficient is the sum.
    normal_form : str
        Coefficients and criticality in words, or the reason why there are none.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> point = branch.special[0]
    >>> point.kind, round(point.value, 6), point.unstable_before, point.unstable_after
    ('fold', 0.0, 1, 0)
    """

    def __init__(self, branch: Branch, index: int, number: int, row: Any) -> None:
        diagram = branch.diagram
        super().__init__(diagram._native.solution(branch._index, True, index), diagram.model)
        self.branch = branch
        self._index = index
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
        """Value of the parameter of the branch, in the unit of the model."""
        return self[self.branch.free]

    @cached_property
    def sensitivities(self) -> dict[str, Sensitivity]:
        """Derivatives of every number at this point with respect to every other parameter, by the name of the number.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
        >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
        >>> round(branch.special["fold"][0].sensitivities["x_max"]["b"].value, 6)
        -0.166667
        """
        return self.branch._sensitivities(True, self._index, self.parameters)

    @property
    def sensitivity(self) -> Sensitivity:
        """Derivatives of the parameter of the branch at this point with respect to every other parameter.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
        >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
        >>> round(branch.special["fold"][0].sensitivity["b"].value, 6)
        1.0
        """
        return self.sensitivities[self.branch.free]

    def uncertainty(self, samples: int = 100, **parameters: float | tuple[float, float]) -> dict[str, Band]:
        """Returns the distribution of every number at this point if parameters are uncertain.

        Parameters
        ----------
        samples : int
            Number of samples of the parameters at which the point is solved again.
        **parameters : float or tuple of float
            Standard deviation of a normal distribution about the value, or ends of a uniform distribution. Others are as in the
            study and the model.

        Returns
        -------
        dict
            `Band` by the name of the number.

        Raises
        ------
        ArgumentError
            If a parameter is unknown, or its value is no uncertainty.
        InputError
            If `samples` is not a positive whole number.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a + b*x - x^3"}, parameters={"a": -2.0, "b": 3.0})
        >>> branch = foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))
        >>> band = branch.special["fold"][0].uncertainty(b=(2.9, 3.1))["a"]
        >>> [round(end, 2) for end in band.range]
        [1.91, 2.1]
        """
        diagram = self.branch.diagram
        given = spreads(diagram.model, parameters)
        return bands(*diagram._native.uncertainty(self.branch._index, self._index, given, whole("samples", samples)))

    def __reduce__(self) -> tuple[Any, ...]:
        return _special_of, (self.branch, self._index)

    def __repr__(self) -> str:
        form = f", {self.normal_form}" if self.normal_form else ""
        error = self.error * (self.branch.scale + abs(self.value))
        return f"<{self.kind} of {self.branch.name} at {self.branch.free} = {self.value:.10g} ± {error:.1e}{form}>"


def _special_of(branch: Branch, index: int) -> SpecialPoint:
    return branch.special[index]


def _branch_of(diagram: Diagram, index: int) -> Branch:
    return diagram.branches[index]


class SpecialPoints(Sequence[SpecialPoint]):
    """Special points in order: ``points[0]``, or those of one kind, ``points["fold"]``.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> len(branch.special), len(branch.special["fold"]), len(branch.special["hopf"])
    (1, 1, 0)
    """

    def __init__(self, found: Sequence[SpecialPoint], kind: str = "") -> None:
        self._found = list(found)
        self._kind = kind

    @overload
    def __getitem__(self, index: int) -> SpecialPoint: ...
    @overload
    def __getitem__(self, index: slice | str) -> SpecialPoints: ...
    def __getitem__(self, index: int | slice | str) -> SpecialPoint | SpecialPoints:
        if isinstance(index, str):
            kind = index.replace("_", "-")
            return SpecialPoints([own for own in self._found if own.kind == kind], kind)
        if isinstance(index, int) and not -len(self._found) <= index < len(self._found):
            raise IndexError(
                f"there are {len(self._found)} special points{f' of the kind {self._kind}' * bool(self._kind)}, and not one of index {index}"
            )
        found = self._found[index]
        return SpecialPoints(found) if isinstance(found, list) else found

    def __len__(self) -> int:
        return len(self._found)

    def __iter__(self) -> Iterator[SpecialPoint]:
        return iter(self._found)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each special point, with the columns of `foldline table --special`.

        Returns
        -------
        pandas.DataFrame
            Quantities are in the units of the model.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> branch.special.to_pandas()["kind"].tolist()
        ['fold']
        """
        from ._tables import special_frame

        return special_frame(self)

    def __repr__(self) -> str:
        from ._html import special_text

        return special_text(self)

    def _repr_html_(self) -> str:
        from ._html import special_table

        return special_table(self)


class Branch(Sequence[Solution]):
    """A curve of solutions in one parameter, or a bifurcation curve in two.

    ``branch["Omega"]`` and ``branch["r_max"]`` are columns, arrays of shape (points,). ``branch[0]`` and ``branch[-1]`` are solutions.
    Arrays cannot be written to; copy one to change it.

    Attributes
    ----------
    name : str
        Name of the branch.
    family : str
        ``"equilibrium"`` or ``"cycle"``.
    free : str
        Name of the continuation parameter.
    scale : float
        Scale of that parameter, to which errors are relative.
    held : tuple or None
        For a bifurcation curve: the kind of bifurcation, and the name of the other parameter.
    also : tuple of str
        On a branch with held quantities: the other free parameters.
    levels : dict
        On a branch with held quantities: their values, by name.
    origin : tuple
        Where the branch comes from: ``("seed", name, None, None)``, ``("end", name, None, None)`` or ``("switch", parent, kind, value)``.
    ends : tuple of str
        Why the branch ended on the side of smaller and on the side of larger positions.
    diagram : Diagram
        Diagram to which the branch belongs.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> branch.name, branch.family, branch.free
    ('equilibrium over mu', 'equilibrium', 'mu')
    >>> bool(abs(branch["x"]**2 - branch["mu"]).max() < 1e-9)
    True
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
        self.also: tuple[str, ...] = tuple(names[index] for index in parts["also"])
        self.levels: dict[str, float] = dict(parts["levels"])
        self.origin: tuple[str, str, str | None, float | None] = tuple(parts["origin"])
        self._count: int = parts["points"]
        self._ends: list[tuple[str, str, bool] | None] = parts["ends"]
        self.ends: tuple[str, str] = tuple("unfinished" if end is None else end[1] for end in self._ends)  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return _branch_of, (self.diagram, self._index)

    @property
    def complete(self) -> bool:
        """True if both sides ended as intended: at a bound, closed on itself, or joined to another branch."""
        return all(end is not None and end[2] for end in self._ends)

    @property
    def stopped(self) -> bool:
        """True if the branch was interrupted."""
        return any(end is None or end[0] == "stopped" for end in self._ends)

    # Columns.

    def _column(self, name: str) -> bytes:
        return self.diagram._native.column(self._index, False, name)

    @cached_property
    def position(self) -> Integers:
        """Number of each point along the branch, shape (points,): 0 at the start, positive on one side, negative on the other."""
        return integers(self._column("position"))

    @cached_property
    def parameters(self) -> Floats:
        """All k parameters at each point, shape (points, k), in the units of the model."""
        return floats(self._column("parameters"), self._count, -1) if self._count else np.empty((0, 0))

    @cached_property
    def ranges(self) -> Floats:
        """Smallest and largest value of every state, then of every output, shape (points, n + outputs, 2), in the units of the model."""
        return floats(self._column("ranges"), self._count, -1, 2) if self._count else np.empty((0, 0, 2))

    @cached_property
    def spectrum(self) -> Complexes:
        """Eigenvalues (per time unit) or Floquet multipliers, shape (points, n). The trivial multiplier of an unforced cycle comes first."""
        return complexes(self._column("spectrum"), self._count, -1) if self._count else np.empty((0, 0), dtype=complex)

    @cached_property
    def unstable(self) -> Integers:
        """Number of unstable eigenvalues or multipliers at each point, shape (points,)."""
        return integers(self._column("unstable"))

    @property
    def stable(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """True at each stable point, shape (points,)."""
        found: np.ndarray[Any, np.dtype[np.bool_]] = self.unstable == 0
        return found

    @cached_property
    def period(self) -> Floats:
        """Period at each point, shape (points,), in the time unit of the model; NaN for equilibria."""
        return floats(self._column("period"))

    @property
    def columns(self) -> list[str]:
        """Names of the columns: those that ``branch[name]`` accepts."""
        model = self.diagram.model
        extremes = [f"{name}_{side}" for name in [*model.outputs, *model.states] for side in ("min", "max")]
        turns = [f"{name}_turns" for name, state in model.states.items() if state["period"]]
        return ["position", *model.parameters, "period", *turns, *extremes, "unstable", *TRUST, *WORK, "step", "forcing_periods"]

    @cached_property
    def _turns(self) -> dict[str, Integers]:
        """Number of turns over a cycle of every state that is an angle, as NAME_turns, shape (points,)."""
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
        values = self.diagram._native.quantity(self._index, False, name)
        if values is not None:
            return floats(values)
        raise KeyError(f"{name}: {suggestion(name, self.columns)}")

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
        found = Solution(self.diagram._native.solution(self._index, False, place), self.diagram.model)
        found._home = (self, place)
        return found

    def __len__(self) -> int:
        return self._count

    def _sensitivities(self, special: bool, index: int, parameters: Mapping[str, float]) -> dict[str, Sensitivity]:
        rows = self.diagram._native.sensitivities(self._index, special, index)
        return {row[0]: Sensitivity(self.diagram.model, parameters, row) for row in rows}

    def sensitivities(self, index: int) -> dict[str, Sensitivity]:
        """Returns the derivatives of the period and the extremes of a solution with respect to every parameter.

        Parameters
        ----------
        index : int
            Number of the solution on the branch, as in ``branch[index]``.

        Returns
        -------
        dict
            `Sensitivity` by the name of the number: ``"period"``, or a state or output followed by ``_min`` or ``_max``. The
            continuation parameter is one of the parameters; each changes while the others stay.

        Raises
        ------
        IndexError
            If the branch has no such point.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a - c*x^2"}, parameters={"a": 1.0, "c": 2.0})
        >>> rest = foldline.follow(model.settle([0.5]), "a", (0.5, 2))
        >>> start = list(rest["position"]).index(0)
        >>> [round(rest.sensitivities(start)["x_max"][name].value, 6) for name in ("a", "c")]
        [0.353553, -0.176777]
        """
        own = self[index]
        return self._sensitivities(False, range(self._count)[index], own.parameters)

    @cached_property
    def special(self) -> SpecialPoints:
        """Special points in the order of their positions."""
        seen: dict[str, int] = {}
        found = []
        for index, row in enumerate(self.diagram._native.special(self._index)):
            seen[row[0]] = seen.get(row[0], 0) + 1
            found.append(SpecialPoint(self, index, seen[row[0]], row))
        return SpecialPoints(found)

    @property
    def switched(self) -> list[Branch]:
        """Branches of the diagram that leave this one at its special points."""
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
            Special point of this branch.
        depth : int
            Number of levels of switching, at points of the same kind on the new branches.
        range : pair, optional
            Smallest and largest value of the parameter; by default the range of this branch.
        mark, stop, max_points, out, jobs, resume, progress
            As for `foldline.follow`. The folder `out` receives this branch as well.

        Returns
        -------
        Branch
            In a diagram together with this branch.

        Raises
        ------
        ArgumentError, InputError
            If `point` is not a special point of this branch, or a value is not allowed.
        NoSolution
            If no branch leaves there, or only a known one; the message says which.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu*x - x^3"}, parameters={"mu": -1.0})
        >>> trivial = foldline.follow(model.settle([0.0]), "mu", (-1, 1))
        >>> pair = trivial.switch(trivial.special["branch-point"][0])
        >>> bool(abs(pair["x"]**2 - pair["mu"]).max() < 1e-6)
        True
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
        sweeps: Responses | Sequence[Responses] | None = None,
        strobe: Strobe | None = None,
        **style: Any,
    ) -> list[Any]:
        """Draws the branch with matplotlib: stable parts solid, unstable ones dashed, special points as marks.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        x, y : str, optional
            Columns; by default the free parameter, and the largest value of the first output, or of the first state if there is no output.
        unit : mapping, optional
            Units in which quantities are shown, as for `Diagram.plot`.
        sweeps : Sweep, Survey or list of them, optional
            Drawn over the branch. Marks of a sweep point in its direction, filled upwards and hollow downwards; jumps are dotted.
        strobe : Strobe, optional
            Stroboscopic points, drawn under the branch. The branch is then drawn as its states at the start of each forcing period, and `y`
            names a state or output; by default the first state.
        **style
            For the lines, such as ``color="black"``.

        Returns
        -------
        list of matplotlib artists

        Raises
        ------
        InputError
            If a quantity or unit is unknown.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> artists = branch.plot(y="x_max", color="black")
        >>> artists[0].axes.get_xlabel()
        'μ'
        """
        from ._plot import branch

        return branch(self._shown(unit), ax, x, y, style, shown_in(sweeps, unit), strobe)

    def plotly(
        self,
        x: str | None = None,
        y: str | None = None,
        sweeps: Responses | Sequence[Responses] | None = None,
    ) -> Any:
        """Draws the branch as an interactive figure.

        Parameters
        ----------
        x, y, sweeps
            As for `plot`.

        Returns
        -------
        plotly.graph_objects.Figure

        Raises
        ------
        ImportError
            If plotly is not installed.
        InputError
            If a quantity is unknown, or there is nothing to draw.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> branch.plotly(y="x_max").layout.xaxis.title.text
        'μ'
        """
        from ._plotly import figure

        return figure([self], x, y, sweeps)

    def to_pandas(self, unit: Mapping[str, str] | None = None) -> pandas.DataFrame:
        """Returns a table with a row for each point, with the columns of `foldline table --points`.

        Parameters
        ----------
        unit : mapping, optional
            Units in which quantities are given, as for `plot`; by default those of the model.

        Returns
        -------
        pandas.DataFrame

        Raises
        ------
        ImportError
            If pandas is not installed.
        InputError
            If a unit is unknown, or the quantity has none in the model.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> table = branch.to_pandas()
        >>> len(table) == len(branch), bool(table["mu"].min() >= -1)
        (True, True)
        """
        from ._tables import branches_frame

        return branches_frame([self._shown(unit)])

    def to_xarray(self) -> xarray.Dataset:
        """Returns a data set over the dimensions `point`, `eigenvalue` and `variable`.

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
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> dict(branch.to_xarray().sizes)["point"] == len(branch)
        True
        """
        from ._tables import branches_dataset

        return branches_dataset([self])

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes the diagram of the branch to a run file.

        Parameters
        ----------
        folder : path
            As for `Diagram.save`.

        Raises
        ------
        RunFileError
            If the folder holds a run already or cannot be written to.

        Examples
        --------
        >>> import foldline
        >>> import os, tempfile
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> folder = os.path.join(tempfile.mkdtemp(), "run")
        >>> branch.save(folder)
        >>> foldline.open(folder)[0].name
        'equilibrium over mu'
        """
        self.diagram.save(folder)

    def __repr__(self) -> str:
        from ._html import branch_text

        return branch_text(self)

    def _repr_html_(self) -> str:
        from ._html import branches

        return branches([self], branch_text_of(self))


def branch_text_of(branch: Branch) -> str:
    """Describes a branch in one line."""
    held = f", {branch.held[0]} held, {branch.held[1]} following" if branch.held else ""
    span = ""
    if len(branch):
        low, high = np.min(branch[branch.free]), np.max(branch[branch.free])
        span = f" in {low:.6g} … {high:.6g}"
    ends = "; ".join(dict.fromkeys(end.splitlines()[0] for end in branch.ends))
    return f"{branch.name}: {len(branch)} points over {branch.free}{span}{held}, {len(branch.special)} special; {ends}"


def native_only(branch: Branch) -> _native.Diagram:
    """Returns a diagram of this branch alone."""
    return branch.diagram._native.only(branch._index, branch.name)


def shown_in(sweeps: Any, unit: Mapping[str, str] | None) -> Any:
    """Returns surveys and sweeps with some quantities in other units."""
    from ._overlay import listed

    return [own.diagram._shown(unit).responses[own.name] for own in listed(sweeps)] if unit and sweeps is not None else sweeps

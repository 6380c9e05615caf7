"""Models from a file, from expressions, or from a Python function that is traced once. All three give the same text and tape."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np

from . import _native
from ._arguments import check_parameters, is_branch, is_model, number, suggestion, wrong_kind
from ._arrays import Floats, finite, floats, limits, pairs, processors, raw, real, tolerable, whole
from ._errors import ArgumentError, InputError
from ._simulation import Trajectory, simulated
from ._solution import Attractor, Attractors, Solution
from ._texts import check_file, is_text
from ._trace import Expressions, Parameters, Parts, States, refuse_other_signatures
from ._write import value

Path_ = str | os.PathLike[str]


class Model:
    """A compiled model: parameters, states with their equations, and outputs.

    Made by `foldline.model`. A model does not change.

    Attributes
    ----------
    name, description : str
        Name and description of the model.
    states, parameters, outputs : dict
        A dictionary for each name with its `unit` and `description`; for parameters also `value`, for states `scale`, `range` and, for
        angles, `period`. An entry that the model does not state is `None`.
    time : str
        Unit of time; empty if it is not known.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "y", "y": "-k*x"}, parameters={"k": dict(value=2.0, unit="1/s^2")})
    >>> list(model.states), model.parameters["k"]["value"]
    (['x', 'y'], 2.0)
    """

    def __init__(self, native: _native.Model) -> None:
        if not isinstance(native, _native.Model):
            raise wrong_kind("models are made by the function `foldline.model`", native, 'foldline.model("model.toml")')
        self._native = native
        self.name: str = native.name
        self.description: str = native.description
        self.states: dict[str, dict[str, Any]] = {
            name: {"unit": unit, "description": text, "scale": scale, "range": span, "period": turn}
            for (name, unit, text), (scale, span, turn) in native.states
        }
        self.parameters: dict[str, dict[str, Any]] = {
            name: {"value": value, "unit": unit, "description": text} for (name, unit, text), value in native.parameters
        }
        self.time: str = native.time
        self.outputs: dict[str, dict[str, Any]] = {name: {"unit": unit, "description": text} for name, unit, text in native.outputs}

    @property
    def text(self) -> str:
        """The text of the model as a model file."""
        return self._native.text

    @property
    def forced(self) -> bool:
        """True if the equations depend on time."""
        return self._native.forced

    def save(self, path: Path_) -> None:
        """Writes the model to a model file.

        Parameters
        ----------
        path : path
            Path of the file. An existing file is replaced.

        Raises
        ------
        OSError
            If the file cannot be written.

        Examples
        --------
        >>> import foldline
        >>> import os, tempfile
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> path = os.path.join(tempfile.mkdtemp(), "fold.toml")
        >>> model.save(path)
        >>> list(foldline.model(path).parameters)
        ['mu']
        """
        Path(path).write_text(self.text, encoding="utf-8")

    def __call__(
        self,
        state: Any,
        parameters: Mapping[str, float] | None = None,
        t: Any = 0.0,
        *,
        outputs: bool = False,
    ) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Evaluates the right-hand side, or the outputs, at one state or several.

        Parameters
        ----------
        state : array, shape (n,) or (points, n)
            States in their units.
        parameters : mapping, optional
            Values that replace those of the model.
        t : float or array, shape (points,)
            Time, in the time unit of the model; used if the model is forced.
        outputs : bool
            If True, the outputs are returned instead of the time derivatives.

        Returns
        -------
        array, shape (n,) or (points, n); with `outputs` (outputs,) or (points, outputs)
            Derivatives in the units of the states per time unit of the model.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "y", "y": "-x"})
        >>> model([1.0, 2.0]).tolist()
        [2.0, -1.0]
        """
        states = real("the state", state)
        self._fitting(states)
        rows = states.reshape(-1, len(self.states))
        times = np.broadcast_to(np.asarray(t, dtype=float), (len(rows),)) if self.forced else np.empty(0)
        values = self._native.evaluate(raw(rows), self._values(parameters), raw(times), outputs)
        width = len(self.outputs) if outputs else len(self.states)
        return floats(values, *states.shape[:-1], width)

    def settle(
        self,
        start: str | Mapping[str, float] | Sequence[float] | Solution | Trajectory | Any = "equilibrium",
        *,
        parameters: Mapping[str, float] | None = None,
        samples: int = 128,
        random: int = 1,
        tolerance: float = 1e-6,
        jobs: int | None = None,
        max_steps: int | None = None,
        max_time: float | None = None,
    ) -> Solution:
        """Finds a first solution, as `[[seed]]` does in a study.

        Parameters
        ----------
        start : str, mapping, sequence, Solution, Trajectory or result of SciPy
            The solution sought, or a start.

            * ``"equilibrium"``: the equilibrium of smallest norm. ``"cycle"``: the cycle that most initial states reach. ``"2:1"``: the
              cycle with this spectral ratio of its whirling motion. ``"torus"``: a quasi-periodic motion, as a torus.
            * A state: ``{"x": 2, "y": 0}`` or ``[2, 0]``, one number for each state in its unit. An equilibrium near it is taken; if there is
              none, the attractor to which the trajectory from there settles.
            * A `Trajectory`, or what `scipy.integrate.solve_ivp` returned: begins at its last state. With a forced model, that state is
              first carried on to the start of the next forcing period.
            * A `Solution`: begins at its state, with its parameters.
        parameters : mapping, optional
            Values that replace those of the model, or of the solution. Those of a simulation elsewhere are not known here and
            must be given.
        samples : int
            Largest number of initial states to sample.
        random : int
            Seed of the random numbers; the same seed gives the same sample.
        tolerance : float
            Relative tolerance, from 1e-10 to 1e-4.
        jobs : int, optional
            Number of threads; by default the number of processors.
        max_steps, max_time : optional
            Number of integration steps, and time in the unit of the model, after which a trajectory counts as unsettled.

        Returns
        -------
        Solution

        Raises
        ------
        ArgumentError
            If `start` is none of these; the message shows the right call.
        InputError
            If a state or parameter is unknown or missing, or a value is not allowed.
        NoSolution
            If nothing of that kind was found; the message lists what was.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 4.0})
        >>> float(model.settle({"x": 1.0}).state[0])
        2.0
        >>> float(model.settle([1.0], parameters={"mu": 9.0}).state[0])
        3.0
        """
        given = self._given(start.parameters if isinstance(start, Solution) else {}, parameters)
        values = self._values(given)
        attractor = start if isinstance(start, str) else None
        state = b"" if isinstance(start, str) else raw(self._beginning(start, given))
        counts = whole("samples", samples), whole("random", random, 0)
        found = _native.settle(
            self._native, attractor, state, values, *counts, tolerable(tolerance), processors(jobs), limits(max_steps, max_time)
        )
        return Solution(found, self)

    def _beginning(self, start: Any, parameters: Mapping[str, float]) -> Any:
        """Returns the state at which `settle` begins, shape (n,)."""
        if isinstance(start, Solution):
            self._own(start)
            return start.state
        if isinstance(start, Trajectory):
            if start.model.states.keys() != self.states.keys():
                shown = f"the trajectory has the states {', '.join(start.model.states)}"
                raise InputError(f"{shown}, the model `{self.name}` has {', '.join(self.states)}\n  help: a trajectory of this model")
            if not len(start):
                raise InputError("the trajectory has no times\n  help: one with at least one time")
            return self._at_phase_zero(start.states[-1], float(start.t[-1]), parameters)
        if hasattr(start, "t") and hasattr(start, "y"):
            return self._at_phase_zero(*self._integrated(start), parameters)
        if is_model(start) or is_branch(start) or callable(start) or start is None:
            cure = f"model.settle(), model.settle({{{', '.join(f'{name!r}: 0.0' for name in self.states)}}})"
            raise wrong_kind("a state, or the name of an attractor, is needed", start, f"{cure}, or model.settle(branch[-1])")
        return self.state(start)

    def _integrated(self, found: Any) -> tuple[Floats, float]:
        """Returns the last state and time of a result of `scipy.integrate.solve_ivp`."""
        times, states = finite("the times of the simulation", found.t), finite("the simulation", found.y)
        if not getattr(found, "success", True):
            told = getattr(found, "message", "it did not reach the end of its time span")
            raise InputError(f"the simulation failed: {told}\n  help: one that reaches its end, or a state: model.settle(sol.y[:, -1])")
        if states.ndim != 2 or states.shape[0] != len(self.states) or not states.shape[1]:
            shape = f"the simulation has an array y of shape {states.shape}, and the model `{self.name}` has {len(self.states)} states"
            raise InputError(
                f"{shape}\n  help: shape ({len(self.states)}, times), as solve_ivp returns it, in the order {', '.join(self.states)}"
            )
        return states[:, -1], float(times[-1])

    def _at_phase_zero(self, state: Any, time: float, parameters: Mapping[str, float]) -> Any:
        """Integrates to the next start of a forcing period; returns the state itself if there is no forcing."""
        if not self.forced:
            return state
        period = self._native.time_unit(self._values(parameters))
        left = -time % period
        if left <= 1e-9 * period or period - left <= 1e-9 * period:
            return state
        track = self.simulate(list(state), (time, time + left), parameters=parameters)
        if track.ending != "reached":
            raise InputError(f"the trajectory cannot be carried on to the next forcing period: {track.ending}\n  help: another state")
        return track.states[-1]

    def _own(self, start: Solution) -> None:
        """Refuses a solution of a model with other states."""
        if list(start.model.states) != list(self.states):
            shown = f"the solution has the states {', '.join(start.model.states)}"
            raise InputError(f"{shown}, the model `{self.name}` has {', '.join(self.states)}\n  help: a solution of this model")
        start._check_stored()

    def _given(self, known: Mapping[str, float], given: Any) -> dict[str, float]:
        check_parameters("parameters", given, self)
        return {**{name: value for name, value in known.items() if name in self.parameters}, **(given or {})}

    def attractors(
        self,
        parameters: Mapping[str, float] | None = None,
        *,
        samples: int = 128,
        seed: int = 1,
        tolerance: float = 1e-6,
        jobs: int | None = None,
        max_steps: int | None = None,
        max_time: float | None = None,
    ) -> Attractors:
        """Samples initial states and returns the equilibria and cycles to which they settle.

        Parameters
        ----------
        parameters : mapping, optional
            Values that replace those of the model.
        samples : int
            Number of initial states, drawn from the ranges of the states; every fourth of them is drawn towards the origin.
        seed : int
            Seed of the random numbers; the same seed gives the same table.
        tolerance : float
            Relative tolerance, from 1e-10 to 1e-4.
        jobs : int, optional
            Number of threads; by default the number of processors.
        max_steps, max_time : optional
            As for `settle`.

        Returns
        -------
        Attractors
            A sequence of solutions with `hits`, `share`, `ratio` and `example`. `share` is the basin fraction, estimated from the
            initial states drawn uniformly from the ranges, with a confidence interval; `hits` also counts those drawn towards the origin.

        Raises
        ------
        ArgumentError, InputError
            As for `settle`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "x - x^3"}, states={"x": dict(range=(-2, 2))})
        >>> [round(float(own.state[0]), 6) for own in model.attractors(samples=16)]
        [-1.0, 1.0]
        """
        counts = whole("samples", samples), whole("seed", seed, 0)
        own_limits = limits(max_steps, max_time)
        found, lost = _native.attractors(
            self._native, self._values(parameters), *counts, tolerable(tolerance), processors(jobs), own_limits
        )
        each = [Attractor(own, self, ratio, hits, share, floats(example)) for own, ratio, hits, share, example in found]
        return Attractors(each, samples, *lost)

    def simulate(
        self,
        start: Solution | Mapping[str, float] | Sequence[float],
        span: float | tuple[float, float],
        *,
        times: Any = None,
        parameters: Mapping[str, float] | None = None,
        tolerance: float = 1e-8,
    ) -> Trajectory:
        """Integrates the equations from a state.

        Parameters
        ----------
        start : Solution, mapping or sequence
            One number for each state, or a solution, whose parameters are used too.
        span : float or pair
            Duration, or first and last time, in the time unit of the model. The last time may be the smaller one.
        times : array, shape (times,), optional
            Times at which the state is returned, within the span and in its direction; by default the ends of the integration steps.
        parameters : mapping, optional
            Values that replace those of the model, or of the solution.
        tolerance : float
            Error of a step, relative to the state and to its scale, from 1e-14 to 0.1.

        Returns
        -------
        Trajectory
            `t`, shape (times,); `states`, shape (times, n); `outputs`, shape (times, outputs); `ending`.

        Raises
        ------
        ArgumentError, InputError
            As for `settle`.
        Interrupted
            After Ctrl-C, with the trajectory so far in `partial`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "-x"})
        >>> track = model.simulate([1.0], 1.0, times=[0.0, 1.0])
        >>> track.states.round(6).tolist()
        [[1.0], [0.367879]]
        """
        given = self._given(start.parameters if isinstance(start, Solution) else {}, parameters)
        if isinstance(start, Solution):
            self._own(start)
        state = start.state if isinstance(start, Solution) else self.state(start)
        if isinstance(span, (tuple, list, np.ndarray)):
            if len(span) != 2:
                raise ArgumentError(f"the span has {len(span)} values\n  help: a duration, or a pair (first, last)")
            ends = number("the span", span[0]), number("the span", span[1])
        else:
            ends = 0.0, number("the span", span)
        return simulated(self, state, ends, times, self._values(given), tolerable(tolerance, 1e-14, 1e-1))

    def state(self, values: Mapping[str, float] | Sequence[float]) -> Any:
        """Returns a state, given by names or in order, as an array.

        Parameters
        ----------
        values : mapping or sequence
            One number for each state, in its unit.

        Returns
        -------
        array, shape (n,)

        Raises
        ------
        ArgumentError, InputError
            If a value is not a number, or a state is unknown or missing.

        Examples
        --------
        >>> import foldline
        >>> foldline.model(equations={"x": "y", "y": "-x"}).state({"y": 2, "x": 1}).tolist()
        [1.0, 2.0]
        """
        if isinstance(values, Mapping):
            cure = f"one number for each of {', '.join(self.states)}"
            for name in values:
                if name not in self.states:
                    raise InputError(f"the model `{self.name}` has no state `{name}`\n  help: {suggestion(str(name), self.states)}")
            missing = [name for name in self.states if name not in values]
            if missing:
                what = f"the state {missing[0]} has" if len(missing) == 1 else f"the states {', '.join(missing)} have"
                raise InputError(f"{what} no value\n  help: {cure}")
            values = [number(name, values[name]) for name in self.states]
        if is_branch(values) or is_model(values) or isinstance(values, Solution):
            cure = {"Branch": "branch[-1].state", "Model": "one number for each state"}.get(type(values).__name__, "solution.state")
            raise wrong_kind("a state is needed", values, cure)
        array = finite("the state", values)
        if array.ndim != 1:
            self._fitting(array)
            cure = "a single state, such as the last row: states[-1]"
            raise InputError(f"a single state is needed, and an array of shape {array.shape} was given\n  help: {cure}")
        self._fitting(array)
        return array

    def _fitting(self, states: Any) -> None:
        if states.ndim == 0 or states.shape[-1] != len(self.states):
            message = f"the model `{self.name}` has {len(self.states)} states, but an array of shape {states.shape} was given"
            raise InputError(f"{message}\n  help: one number for each of {', '.join(self.states)}")

    def _values(self, given: Mapping[str, float] | None) -> bytes:
        return self._native.values(pairs(given))

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self.text, self._native.file)

    def __repr__(self) -> str:
        outputs = f", outputs {' '.join(self.outputs)}" if self.outputs else ""
        given = ", ".join(f"{name}={own['value']:g}" for name, own in self.parameters.items())
        return f"<model {self.name}: states {' '.join(self.states)}{outputs}; {given}>"

    def _repr_html_(self) -> str:
        from ._html import model

        return model(self)


def _again(text: str, file: str) -> Model:
    return Model(_native.Model.parse(text, file))


@overload
def model(path: Path_, /) -> Model: ...


@overload
def model(
    *,
    equations: Expressions,
    parameters: Parameters | None = None,
    states: States | None = None,
    definitions: Expressions | None = None,
    outputs: Expressions | None = None,
    frequency: Any = None,
    period: Any = None,
    whirl: str | Sequence[str] | None = None,
    totals: Mapping[str, Mapping[str, Any]] | None = None,
    map: bool = False,
    time: str | None = None,
    units: str | None = None,
    name: str = "model",
    description: str = "",
) -> Model: ...


@overload
def model(
    *,
    states: States,
    parameters: Parameters | None = None,
    definitions: Expressions | None = None,
    outputs: Expressions | None = None,
    frequency: Any = None,
    period: Any = None,
    whirl: str | Sequence[str] | None = None,
    totals: Mapping[str, Mapping[str, Any]] | None = None,
    map: bool = False,
    time: str | None = None,
    units: str | None = None,
    name: str | None = None,
    description: str | None = None,
) -> Callable[[Callable[..., Any]], Model]: ...


def model(
    path: Path_ | None = None,
    /,
    *,
    equations: Expressions | None = None,
    states: States | None = None,
    parameters: Parameters | None = None,
    definitions: Expressions | None = None,
    outputs: Expressions | None = None,
    frequency: Any = None,
    period: Any = None,
    whirl: str | Sequence[str] | None = None,
    totals: Mapping[str, Mapping[str, Any]] | None = None,
    map: bool = False,
    time: str | None = None,
    units: str | None = None,
    name: str | None = None,
    description: str | None = None,
) -> Model | Callable[[Callable[..., Any]], Model]:
    """Makes a model from a file, from expressions, or from a function.

    ``foldline.model("rotor.toml")`` reads a model file. ``foldline.model(equations={"x": "y", "y": "-x"})`` takes text or
    expressions of SymPy. ``@foldline.model(states="x y")`` above a function of the states, the parameters and, if the model is
    forced, the time calls the function once, with symbols, and compiles it. In all three cases no Python runs during a computation.

    Parameters
    ----------
    path : path or str
        The path of a model file, or its text: a string with line breaks. No other argument is allowed beside it.
    equations : mapping
        The time derivative of every state; for a map its next value.
    states : str, list or mapping
        Names in order: ``"u v du dv"``. A mapping gives `range` (where initial states are sampled), `scale` (characteristic size),
        `period` (of an angle), `unit` and `description` of each: ``{"u": dict(range=(-5, 5)), "phi": dict(period="2*pi")}``.
    parameters : mapping
        Names with values, or with dictionaries of `value`, `unit` and `description`.
    definitions : mapping
        Names for intermediate expressions, for use in equations that are text.
    outputs : mapping
        Scalar functions of the state: names with expressions or functions.
    frequency, period : str, symbol or function of p
        Angular frequency, or period, of the forcing if the equations depend on the time `t`. One of the two.
    whirl : str or pair
        The two states of the complex signal from whose spectrum cycles are named 2:1, 3:1 …
    totals : mapping
        Conserved sums of states, which become parameters: ``{"T": dict(sum="x + 2*y", value=1.0)}``.
    map : bool
        True for a map: the equations give the next value of every state instead of its time derivative.
    time : str
        Unit of time; by default it follows from the other units. For a map, the unit of its steps.
    units : str
        ``"labels"`` leaves units unchecked.
    name, description : str
        By default the name and the docstring of the function.

    Returns
    -------
    Model
        Without `path` and `equations`, a decorator that makes a `Model` of a function.

    Raises
    ------
    ArgumentError
        If the decorator is used without brackets, or a function is given in place of a path; the message shows the right call.
    InputError
        With every mistake, its place and a remedy. Also if the file is missing.
    TraceError
        If the function does something that cannot be compiled, with the line and a remedy; and if it takes ``(t, y)``, as SciPy calls it.

    Examples
    --------
    >>> import foldline
    >>> @foldline.model(states="x y", parameters=dict(mu=1.5))
    ... def van_der_pol(s, p):
    ...     return s.y, p.mu * (1 - s.x**2) * s.y - s.x
    >>> van_der_pol
    <model van_der_pol: states x y; mu=1.5>
    """
    if path is not None:
        return _read(path, equations is not None or states is not None)
    if equations is None and states is None:
        shown = 'foldline.model("model.toml"), foldline.model(equations={"x": "y", "y": "-x"}), or @foldline.model(states="x y")'
        raise ArgumentError(f"a model needs a file, equations or states\n  help: {shown}")
    if equations is not None and not isinstance(equations, Mapping):
        raise wrong_kind("equations must be a dictionary", equations, 'equations={"x": "y", "y": "-x"}')
    stated = {key: own for key, own in (("time", time), ("units", units)) if own is not None}
    head = "".join(f"{key} = {value(own)}\n" for key, own in stated.items())
    parts = Parts(states, equations, parameters, definitions, outputs, frequency, period, whirl, totals, map)
    if equations is not None:
        return _compiled(head + parts.text(equations, name or "model", description or ""), name)

    def traced(function: Callable[..., Any]) -> Model:
        own = name or str(getattr(function, "__name__", "model"))
        text = (inspect.getdoc(function) or "") if description is None else description
        return _compiled(head + parts.text(parts.trace(function), own, text), own)

    return traced


def _read(path: Any, more: bool) -> Model:
    """Reads the model of a file or text, which must be the only argument."""
    if is_model(path):
        raise wrong_kind("the path of a model file is needed", path, "it is a model already: use it as it is")
    if not isinstance(path, (str, os.PathLike)):
        if callable(path):
            refuse_other_signatures(path)
            cure = '@foldline.model(states="x y", parameters=dict(a=1.0)) above the function, or foldline.model(states="x y")(function)'
            what = "a function is given in place of a path" if more else "the decorator needs the names of the states"
            raise ArgumentError(f"{what}\n  help: {cure}")
        if isinstance(path, Mapping):
            raise wrong_kind("the path of a model file is needed", path, 'foldline.model(equations={"x": "y", "y": "-x"})')
        raise wrong_kind("the path of a model file is needed", path, 'foldline.model("model.toml")')
    if more:
        raise ArgumentError("both a path and equations or states are given\n  help: a path alone, or equations alone")
    if is_text(path):
        return _compiled(str(path), None)
    check_file(path, "model")
    return _told(Model(_native.Model.read(os.fspath(path))))


def _compiled(text: str, name: str | None) -> Model:
    return _told(Model(_native.Model.parse(text, f"<model {name}>" if name else "<model>")))


def _told(made: Model) -> Model:
    """Warns of doubtful units."""
    for remark in made._native.remarks:
        warnings.warn(remark, UserWarning, stacklevel=4)
    return made

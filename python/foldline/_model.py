"""Models three ways: a file, strings, a Python function traced once. All become the same text, and the same tape."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np

from . import _native
from ._arrays import finite, floats, limits, pairs, processors, raw, tolerable, whole
from ._simulation import Trajectory, simulated
from ._solution import Attractor, Attractors, Solution
from ._trace import Expressions, Parameters, Parts, States
from ._write import value

Path_ = str | os.PathLike[str]


class Model:
    """A compiled model: parameters, states with their equations, outputs.

    Made by `foldline.model`. A model does not change.

    Attributes
    ----------
    name, description : str
    text : str
        The model as a model file has it.
    states, parameters, outputs : dict
        Names, and what is known about each: `unit` and `description`, of parameters `value`, of states `scale`, `range` and, of
        angles, `period` (`None` where the model does not state them).
    time : str
        Unit of time; empty where it is not known.
    """

    def __init__(self, native: _native.Model) -> None:
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
        """The model as a model file has it."""
        return self._native.text

    @property
    def forced(self) -> bool:
        """Whether the equations depend on time."""
        return self._native.forced

    def save(self, path: Path_) -> None:
        """Writes the model to a model file, for the command line or for later.

        Parameters
        ----------
        path : path
            The file; one that is there is replaced.
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
        """The right-hand side at states, or the outputs there.

        Parameters
        ----------
        state : array, shape (n,) or (points, n)
            In the units of the states.
        parameters : mapping, optional
            Values that replace those of the model.
        t : float or array, shape (points,)
            Time, of a forced model.
        outputs : bool
            The outputs instead of the derivatives.

        Returns
        -------
        array, shape (n,) or (points, n); with `outputs` (outputs,) or (points, outputs)
        """
        states = np.asarray(state, dtype=float)
        self._fitting(states)
        rows = states.reshape(-1, len(self.states))
        times = np.broadcast_to(np.asarray(t, dtype=float), (len(rows),)) if self.forced else np.empty(0)
        values = self._native.evaluate(raw(rows), self._values(parameters), raw(times), outputs)
        width = len(self.outputs) if outputs else len(self.states)
        return floats(values, *states.shape[:-1], width)

    def settle(
        self,
        start: str | Mapping[str, float] | Sequence[float] = "equilibrium",
        *,
        parameters: Mapping[str, float] | None = None,
        samples: int = 128,
        random: int = 1,
        tolerance: float = 1e-6,
        jobs: int | None = None,
        max_steps: int | None = None,
        max_time: float | None = None,
    ) -> Solution:
        """A first solution: what `[[seed]]` means in a study.

        Parameters
        ----------
        start : str, mapping or sequence
            ``"equilibrium"``: the equilibrium of smallest norm; ``"cycle"``: the cycle reached most often; ``"2:1"``: the cycle with
            this spectral ratio of its whirling motion. A value for every state: an equilibrium near it, else what the trajectory
            from there settles to.
        parameters : mapping, optional
            Values that replace those of the model.
        samples : int
            How many initial states to sample, at most.
        random : int
            Seed of the random numbers; the same seed gives the same sample.
        tolerance : float
            The one relative tolerance.
        jobs : int, optional
            Threads; by default as many as there are processors.
        max_steps, max_time : optional
            Integration steps, and time, after which a trajectory counts as unsettled.

        Returns
        -------
        Solution

        Raises
        ------
        NoSolution
            Where nothing of that kind was found; the message says what was.
        """
        attractor = start if isinstance(start, str) else None
        state = b"" if isinstance(start, str) else raw(self.state(start))
        values = self._values(parameters)
        counts = whole("samples", samples), whole("random", random, 0)
        found = _native.settle(
            self._native, attractor, state, values, *counts, tolerable(tolerance), processors(jobs), limits(max_steps, max_time)
        )
        return Solution(found, self)

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
        """Where sampled initial states settle: stable equilibria and cycles, and how many went to each.

        Parameters
        ----------
        parameters : mapping, optional
            Values that replace those of the model.
        samples : int
            How many initial states, from the ranges of the states; every fourth of them is drawn towards the origin.
        seed : int
            Seed of the random numbers; the same seed gives the same table.
        tolerance : float
            The one relative tolerance.
        jobs : int, optional
            Threads; by default as many as there are processors.
        max_steps, max_time : optional
            As for `settle`.

        Returns
        -------
        Attractors
            A sequence of solutions with `hits`, `share`, `ratio` and `example`. `share` is that of the initial states drawn
            uniformly from the ranges, with a confidence interval; `hits` counts those drawn towards the origin too.
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
        """The trajectory from a state.

        Parameters
        ----------
        start : Solution, mapping or sequence
            A value for every state, or a solution, whose parameters are taken too.
        span : float or pair
            How long, or from when to when, in the time unit of the model; it may run backwards.
        times : array, shape (times,), optional
            When the state is wanted, within the span and growing in its direction; by default at the ends of the steps.
        parameters : mapping, optional
            Values that replace those of the model, or of the solution.
        tolerance : float
            Error of a step, relative to the state and to its scale.

        Returns
        -------
        Trajectory
            `t`, shape (times,); `states`, shape (times, n); `outputs`, shape (times, outputs); `ending`.
        """
        given = {**(start.parameters if isinstance(start, Solution) else {}), **(parameters or {})}
        state = start.state if isinstance(start, Solution) else self.state(start)
        ends = (0.0, float(span)) if isinstance(span, (int, float)) else (float(span[0]), float(span[1]))
        return simulated(self, state, ends, times, self._values(given), tolerable(tolerance, 1e-14, 1e-1))

    def state(self, values: Mapping[str, float] | Sequence[float]) -> Any:
        """A state by names or in order, as an array of shape (n,)."""
        if isinstance(values, Mapping):
            unknown = [name for name in values if name not in self.states]
            missing = [name for name in self.states if name not in values]
            if unknown or missing:
                what = f"has no state `{unknown[0]}`" if unknown else f"has states without a value: {', '.join(missing)}"
                from ._errors import InputError

                cure = f"give a number for each of {', '.join(self.states)}"
                raise InputError(f"the model `{self.name}` {what}\n  help: {cure}")
            values = [values[name] for name in self.states]
        array = finite("the state", values)
        self._fitting(array)
        return array

    def _fitting(self, states: Any) -> None:
        if states.ndim == 0 or states.shape[-1] != len(self.states):
            from ._errors import InputError

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
    time: str | None = None,
    units: str | None = None,
    name: str | None = None,
    description: str | None = None,
) -> Model | Callable[[Callable[..., Any]], Model]:
    """A model from a file, from expressions, or from a function.

    ``foldline.model("rotor.toml")`` reads a model file. ``foldline.model(equations={"x": "y", "y": "-x"})`` takes text or
    expressions of SymPy. ``@foldline.model(states="x y")`` stands above a function of states, parameters and, where the model is
    forced, time; the function is called once, with symbols, and compiled. There is no Python in the computation whichever way
    is taken.

    Parameters
    ----------
    path : path
        A model file, alone.
    equations : mapping
        The right-hand side of d/dt of every state.
    states : str, list or mapping
        Names, in order: ``"u v du dv"``. A mapping gives `range` (where initial states are sampled), `scale` (characteristic size),
        `period` (of an angle), `unit` and `description` of each: ``{"u": dict(range=(-5, 5)), "phi": dict(period="2*pi")}``.
    parameters : mapping
        Names with values, or with tables of `value`, `unit` and `description`.
    definitions : mapping
        Names for intermediate expressions, where equations are text.
    outputs : mapping
        Scalars of the state: names with expressions or functions.
    frequency, period : str, symbol or function of p
        Of the forcing, angular, where equations depend on the time `t`.
    whirl : str or pair
        The two states of the complex signal from whose spectrum cycles are named 2:1, 3:1 …
    totals : mapping
        Sums of states that keep their values, which become parameters: ``{"T": dict(sum="x + 2*y", value=1.0)}``.
    time : str
        Unit of time; by default it follows from the other units.
    units : str
        ``"labels"`` leaves units unchecked.
    name, description : str
        By default those of the function.

    Returns
    -------
    Model
        Or, without a file and equations, what makes a model of the function below it.

    Raises
    ------
    InputError
        With every mistake, its place and what would be right.
    TraceError
        Where the function does something that cannot be compiled, with its line and the remedy.

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
        if not isinstance(path, (str, os.PathLike)):
            raise TypeError('@foldline.model needs brackets with the states: @foldline.model(states="x y")')
        return _told(Model(_native.Model.read(os.fspath(path))))
    stated = {key: own for key, own in (("time", time), ("units", units)) if own is not None}
    head = "".join(f"{key} = {value(own)}\n" for key, own in stated.items())
    parts = Parts(states, equations, parameters, definitions, outputs, frequency, period, whirl, totals)
    if equations is not None:
        return _compiled(head + parts.text(equations, name or "model", description or ""), name)

    def traced(function: Callable[..., Any]) -> Model:
        own = name or str(getattr(function, "__name__", "model"))
        text = (inspect.getdoc(function) or "") if description is None else description
        return _compiled(head + parts.text(parts.trace(function), own, text), own)

    return traced


def _compiled(text: str, name: str | None) -> Model:
    return _told(Model(_native.Model.parse(text, f"<model {name}>" if name else "<model>")))


def _told(made: Model) -> Model:
    """Warns of what is doubtful about the units."""
    for remark in made._native.remarks:
        warnings.warn(remark, UserWarning, stacklevel=4)
    return made

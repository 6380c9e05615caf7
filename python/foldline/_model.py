"""Models three ways: a file, strings, a Python function traced once. All become the same text, and the same tape."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np

from . import _native, _write
from ._arrays import finite, floats, pairs, processors, raw, tolerable, whole
from ._errors import Error, TraceError
from ._simulation import Trajectory, simulated
from ._solution import Attractor, Attractors, Solution
from ._symbols import Operand, Symbol, operand, refused, shown

Path_ = str | os.PathLike[str]
#: Names in one string, a list of names, or names with range, scale, unit and description.
States = str | Sequence[str] | Mapping[str, Mapping[str, Any] | None]
#: Names with values, or with tables of value, unit and description.
Parameters = Mapping[str, float | Mapping[str, Any]]
#: Names with expressions: text, SymPy, or functions of (s, p) or (s, p, t).
Expressions = Mapping[str, Any]


class Symbols(Sequence[Any]):
    """The states or parameters of a model while it is traced: by attribute, by name, or in order.

    Examples
    --------
    >>> u, v = s          # doctest: +SKIP
    >>> s.u, s["u"], s[0]  # doctest: +SKIP
    """

    def __init__(self, what: str, names: Sequence[str]) -> None:
        self._what = what
        self._symbols = {name: Symbol(name) for name in names}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self[name]

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            if key not in self._symbols:
                raise refused(f"there is no {self._what} `{key}`", f"one of: {', '.join(self._symbols)}")
            return self._symbols[key]
        return list(self._symbols.values())[key]

    def __len__(self) -> int:
        return len(self._symbols)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._symbols.values())


class Model:
    """A compiled model: parameters, states with their equations, outputs.

    Made by `foldline.model`. A model does not change.

    Attributes
    ----------
    name, description : str
    text : str
        The model as a model file has it.
    states, parameters, outputs : dict
        Names, and what is known about each: `unit` and `description`, of parameters `value`, of states `scale` and `range`.
    """

    def __init__(self, native: _native.Model) -> None:
        self._native = native
        self.name: str = native.name
        self.description: str = native.description
        self.states: dict[str, dict[str, Any]] = {
            name: {"unit": unit, "description": text, "scale": scale, "range": span} for (name, unit, text), scale, span in native.states
        }
        self.parameters: dict[str, dict[str, Any]] = {
            name: {"value": value, "unit": unit, "description": text} for (name, unit, text), value in native.parameters
        }
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
        found = _native.settle(self._native, attractor, state, values, *counts, tolerable(tolerance), processors(jobs))
        return Solution(found, self)

    def attractors(
        self,
        parameters: Mapping[str, float] | None = None,
        *,
        samples: int = 128,
        seed: int = 1,
        tolerance: float = 1e-6,
        jobs: int | None = None,
    ) -> Attractors:
        """Where sampled initial states settle: stable equilibria and cycles, and how many went to each.

        Parameters
        ----------
        parameters : mapping, optional
            Values that replace those of the model.
        samples : int
            How many initial states, from the ranges of the states.
        seed : int
            Seed of the random numbers; the same seed gives the same table.
        tolerance : float
            The one relative tolerance.
        jobs : int, optional
            Threads; by default as many as there are processors.

        Returns
        -------
        Attractors
            A sequence of solutions with `hits`, `ratio` and `example`.
        """
        counts = whole("samples", samples), whole("seed", seed, 0)
        found, lost = _native.attractors(self._native, self._values(parameters), *counts, tolerable(tolerance), processors(jobs))
        each = [Attractor(own, self, ratio, hits, floats(example)) for own, ratio, hits, example in found]
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

            message = f"the model `{self.name}` has {len(self.states)} states, and an array of shape {states.shape} was given"
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
        `unit` and `description` of each: ``{"u": dict(range=(-5, 5)), "v": None}``.
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
        return Model(_native.Model.read(os.fspath(path)))
    parts = _Parts(states, equations, parameters, definitions, outputs, frequency, period, whirl)
    if equations is not None:
        return parts.compiled(equations, name or "model", description or "")

    def traced(function: Callable[..., Any]) -> Model:
        own = name or str(getattr(function, "__name__", "model"))
        text = (inspect.getdoc(function) or "") if description is None else description
        return parts.compiled(parts.trace(function), own, text)

    return traced


class _Parts:
    """What a model is made of, on its way to text."""

    def __init__(
        self,
        states: States | None,
        equations: Expressions | None,
        parameters: Parameters | None,
        definitions: Expressions | None,
        outputs: Expressions | None,
        frequency: Any,
        period: Any,
        whirl: str | Sequence[str] | None,
    ) -> None:
        if states is None:
            states = list(equations or {})
        elif isinstance(states, str):
            states = states.replace(",", " ").split()
        self.states: dict[str, Mapping[str, Any]] = (
            {str(name): own or {} for name, own in states.items()} if isinstance(states, Mapping) else {str(name): {} for name in states}
        )
        self.parameters = dict(parameters or {})
        self.definitions = dict(definitions or {})
        self.outputs = dict(outputs or {})
        self.forcing = {"frequency": frequency, "period": period}
        self.whirl = whirl.replace(",", " ").split() if isinstance(whirl, str) else whirl
        self.arguments = (Symbols("state", list(self.states)), Symbols("parameter", list(self.parameters)), Symbol("t"))

    def trace(self, function: Callable[..., Any]) -> dict[str, Any]:
        """The equations that a function returns."""
        found = _called(function, self.arguments)
        place = _defined(function)
        if isinstance(found, Mapping):
            if set(found) != set(self.states):
                cure = f"return one for each of {', '.join(self.states)}"
                raise refused(f"the function returns equations for {', '.join(map(str, found))}", cure, place)
            return dict(found)
        values = list(found) if isinstance(found, (tuple, list, np.ndarray)) else [found]
        if len(values) != len(self.states):
            cure = f"return one for each of {', '.join(self.states)}, in this order"
            raise refused(f"the function returns {len(values)} values for {len(self.states)} states", cure, place)
        return dict(zip(self.states, values, strict=True))

    def compiled(self, equations: Expressions, name: str, description: str) -> Model:
        """The model, by way of its text."""
        text = self.text(equations, name, description)
        return Model(_native.Model.parse(text, "<model>" if name == "model" else f"<model {name}>"))

    def text(self, equations: Expressions, name: str, description: str) -> str:
        """The text of a model file."""
        groups = [self.definitions, dict(equations), self.outputs, {k: v for k, v in self.forcing.items() if v is not None}]
        for group in groups:
            group.update({key: self._expression(value) for key, value in group.items()})
        taken = [*self.states, *self.parameters, *self.definitions, "t", "pi"]
        writer = _write.Writer(taken)
        traced = [(group, key) for group in groups for key, value in group.items() if not isinstance(value, str)]
        for (group, key), own in zip(traced, writer.write([group[key] for group, key in traced]), strict=True):
            group[key] = own
        definitions, own_equations, outputs, forcing = groups
        lines = [f"name = {_write.value(name)}"]
        lines += [f"description = {_write.value(description)}"] if description else []
        lines += [f"whirl = {_write.value([str(state) for state in self.whirl])}"] if self.whirl else []
        lines += _table("parameters", self.parameters)
        lines += _table("forcing", forcing)
        lines += _table("definitions", {**definitions, **writer.definitions})
        for state, about in self.states.items():
            equation = {"equation": own_equations[state]} if state in own_equations else {}
            lines += _table(f"states.{_write.key(state)}", {**equation, **about})
        # The equations of states that there are not: the reader says so.
        extra = {state: text for state, text in own_equations.items() if state not in self.states}
        lines += _table("equations", extra)
        lines += _table("outputs", outputs)
        return "\n".join(lines) + "\n"

    def _expression(self, value: Any) -> str | Operand:
        """An expression as text or symbol; a function is called."""
        if isinstance(value, str):
            return value
        if callable(value) and not isinstance(value, Symbol) and type(value).__module__.split(".")[0] != "sympy":
            s, p, t = self.arguments
            value = _called(value, (p,) if len(_positional(value)) == 1 else (s, p, t))
        if isinstance(value, str):
            return value
        return operand(value)


def _table(name: str, entries: Mapping[str, Any]) -> list[str]:
    return ["", f"[{name}]", *(f"{_write.key(str(k))} = {_write.value(v)}" for k, v in entries.items())] if entries else []


def _positional(function: Callable[..., Any]) -> list[inspect.Parameter]:
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return [own for own in inspect.signature(function).parameters.values() if own.kind in kinds and own.default is own.empty]


def _defined(function: Callable[..., Any]) -> tuple[str, int] | None:
    code = getattr(function, "__code__", None)
    return (code.co_filename, code.co_firstlineno) if code else None


def _called(function: Callable[..., Any], arguments: Sequence[Any]) -> Any:
    """What a function returns for symbols: for as many of them as it takes."""
    count = len(_positional(function))
    if not 1 <= count <= len(arguments):
        cure = "write `def f(s, p):`, or `def f(s, p, t):` for a forced model: states, parameters, time"
        raise refused(f"the function takes {count} arguments", cure, _defined(function))
    try:
        return function(*arguments[:count])
    except Error:
        raise
    except Exception as error:
        raise TraceError(
            f"the function of the model cannot be traced: {type(error).__name__}: {error}{shown(_failed(error))}\n"
            "  = help: it is called once with symbols; use arithmetic, functions of numpy and foldline.where"
        ) from error


def _failed(error: Exception) -> tuple[str, int] | None:
    """The innermost line of the user's code in a traceback."""
    trace = error.__traceback__
    place = None
    inner = (os.path.dirname(os.path.abspath(__file__)), os.path.dirname(os.path.abspath(np.__file__ or "")), sys.prefix)
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if not os.path.abspath(file).startswith(inner):
            place = (file, trace.tb_lineno)
        trace = trace.tb_next
    return place

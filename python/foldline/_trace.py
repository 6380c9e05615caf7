"""Text of a model file from a function or from expressions."""

from __future__ import annotations

import inspect
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from . import _write
from ._errors import Error, TraceError
from ._symbols import Operand, Symbol, operand, refused, shown

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


class Parts:
    """Parts of a model, and their text."""

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
        totals: Mapping[str, Mapping[str, Any]] | None,
        map: bool = False,
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
        self.totals = dict(totals or {})
        self.map = map
        self.arguments = (Symbols("state", list(self.states)), Symbols("parameter", list(self.parameters)), Symbol("t"))

    def trace(self, function: Callable[..., Any]) -> dict[str, Any]:
        """Returns the equations of a function."""
        refuse_other_signatures(function, list(self.states))
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

    def text(self, equations: Expressions, name: str, description: str) -> str:
        """Returns the text of a model file."""
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
        # Equations of unknown states are reported by the reader.
        extra = {state: text for state, text in own_equations.items() if state not in self.states}
        lines += _table("map" if self.map else "equations", extra) or (["", "[map]"] if self.map else [])
        lines += _table("totals", self.totals)
        lines += _table("outputs", outputs)
        return "\n".join(lines) + "\n"

    def _expression(self, value: Any) -> str | Operand:
        """Returns an expression as text or symbol; calls a function."""
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
    return [own for own in inspect.signature(function).parameters.values() if own.kind in _IN_ORDER and own.default is own.empty]


def _defined(function: Callable[..., Any]) -> tuple[str, int] | None:
    code = getattr(function, "__code__", None)
    return (code.co_filename, code.co_firstlineno) if code else None


#: Names of the time in functions written for SciPy.
_TIME = ("t", "time", "_t")


def refuse_other_signatures(function: Callable[..., Any], states: Sequence[str] = (), own: str = "") -> None:
    """Refuses a right-hand side written for SciPy, f(t, y) or f(y, t), and shows how it becomes a model."""
    try:
        names = [parameter.name for parameter in inspect.signature(function).parameters.values() if parameter.kind in _IN_ORDER]
    except (TypeError, ValueError):
        return
    if len(names) < 2 or (names[0] in _TIME) == (names[1] in _TIME):
        return
    first = names[0] in _TIME
    caller = "scipy.integrate.solve_ivp" if first else "scipy.integrate.odeint"
    name = own or getattr(function, "__name__", "f")
    name = "f" if name == "<lambda>" else name
    more = names[2:]
    given = f", parameters=dict({', '.join(f'{extra}=1.0' for extra in more)})" if more else ""
    passed = ", ".join([*(("0.0", "s") if first else ("s", "0.0")), *(f"p.{extra}" for extra in more)])
    listed = " ".join(states) or "x y"
    raise refused(
        f"the function takes ({', '.join(names)}), as {caller} calls it; a model takes the states, the parameters and, if it is forced, "
        "the time",
        f"write `def {name}(s, p):`, or `def {name}(s, p, t):` with frequency=... if the equations depend on time; or wrap the function as "
        f'it is: foldline.model(states="{listed}"{given})(lambda s, p: {name}({passed}))',
        _defined(function),
    )


_IN_ORDER = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


def _called(function: Callable[..., Any], arguments: Sequence[Any]) -> Any:
    """Calls a function with as many symbols as it takes, and returns its result."""
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
            f"the model function cannot be traced: {type(error).__name__}: {error}{shown(_failed(error))}\n"
            "  = help: it is called once with symbols; use arithmetic, functions of numpy and foldline.where"
        ) from error


def _failed(error: Exception) -> tuple[str, int] | None:
    """Returns the innermost line of the user's code in a traceback."""
    trace = error.__traceback__
    place = None
    inner = (os.path.dirname(os.path.abspath(__file__)), os.path.dirname(os.path.abspath(np.__file__ or "")), sys.prefix)
    while trace is not None:
        file = trace.tb_frame.f_code.co_filename
        if not os.path.abspath(file).startswith(inner):
            place = (file, trace.tb_lineno)
        trace = trace.tb_next
    return place

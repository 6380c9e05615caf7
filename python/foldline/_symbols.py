"""Symbolic operands, with which the function of a model is called once.

A symbol is a node of an expression. Arithmetic and the functions of NumPy make new nodes. Operations that need a number are refused,
with the line of the code and a remedy.
"""

from __future__ import annotations

import linecache
import os
import sys
from collections.abc import Callable
from typing import Any, Union

import numpy as np

from ._errors import TraceError

Operand = Union["Symbol", float]

#: Functions of NumPy with one operand, and their names in the model language.
_ONE = {
    "sqrt": "sqrt", "exp": "exp", "log": "log", "sin": "sin", "cos": "cos", "tan": "tan", "arcsin": "asin", "arccos": "acos",
    "arctan": "atan", "sinh": "sinh", "cosh": "cosh", "tanh": "tanh", "absolute": "abs", "fabs": "abs", "sign": "sign",
}  # fmt: skip
_TWO = {"arctan2": "atan2", "minimum": "min", "maximum": "max", "fmin": "min", "fmax": "max", "hypot": "hypot"}
_OPERATORS = {
    "add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "^", "float_power": "^", "less": "<", "less_equal": "<=",
    "greater": ">", "greater_equal": ">=", "equal": "==", "not_equal": "!=",
}  # fmt: skip
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")

#: Folders whose frames are not user code.
_INNER = tuple(os.path.dirname(os.path.abspath(p)) + os.sep for p in (__file__, np.__file__ or __file__))


def refused(message: str, cure: str, place: tuple[str, int] | None = None) -> TraceError:
    """Returns the exception for an operation that cannot be traced, with the line of the user's code."""
    return TraceError(f"{message}{shown(place or _place())}\n  = help: {cure}")


def shown(place: tuple[str, int] | None) -> str:
    """Shows a place in source code as the command line does."""
    if place is None:
        return ""
    file, number = place
    line = linecache.getline(file, number).rstrip()
    margin = " " * len(str(number))
    code = f"\n{margin} |\n{number} | {line}\n{margin} |" if line else ""
    return f"\n{margin}--> {file}:{number}{code}"


def _place() -> tuple[str, int] | None:
    frame = sys._getframe(1)
    while frame is not None:
        file = frame.f_code.co_filename
        if not os.path.abspath(file).startswith(_INNER):
            return file, frame.f_lineno
        frame = frame.f_back  # type: ignore[assignment]
    return None


def _needs_number(what: str) -> TraceError:
    return refused(
        f"{what} needs a number, but the model is traced with symbols",
        "use the functions of numpy instead of those of math; collect values with np.array([...]) or a list, not by assignment into "
        "an array of numbers",
    )


class Symbol:
    """A node of an expression: a name, a function or an operator with its operands.

    Not made by hand: the function of a model receives symbols for its states, its parameters and the time.
    """

    __slots__ = ("op", "operands")

    def __init__(self, op: str, operands: tuple[Operand, ...] = ()) -> None:
        self.op = op
        self.operands = operands

    # Arithmetic.

    def __add__(self, other: Any) -> Any:
        return _operator("+", self, other)

    def __radd__(self, other: Any) -> Any:
        return _operator("+", other, self)

    def __sub__(self, other: Any) -> Any:
        return _operator("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return _operator("-", other, self)

    def __mul__(self, other: Any) -> Any:
        return _operator("*", self, other)

    def __rmul__(self, other: Any) -> Any:
        return _operator("*", other, self)

    def __truediv__(self, other: Any) -> Any:
        return _operator("/", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _operator("/", other, self)

    def __pow__(self, other: Any) -> Any:
        return _operator("^", self, other)

    def __rpow__(self, other: Any) -> Any:
        return _operator("^", other, self)

    def __neg__(self) -> Symbol:
        return Symbol("negate", (self,))

    def __pos__(self) -> Symbol:
        return self

    def __abs__(self) -> Symbol:
        return Symbol("abs", (self,))

    # Comparisons.

    def __lt__(self, other: Any) -> Any:
        return _operator("<", self, other)

    def __le__(self, other: Any) -> Any:
        return _operator("<=", self, other)

    def __gt__(self, other: Any) -> Any:
        return _operator(">", self, other)

    def __ge__(self, other: Any) -> Any:
        return _operator(">=", self, other)

    def __eq__(self, other: Any) -> Any:
        return _operator("==", self, other)

    def __ne__(self, other: Any) -> Any:
        return _operator("!=", self, other)

    __hash__ = object.__hash__

    def __and__(self, other: Any) -> Any:
        return _combined("*", self, other)

    def __rand__(self, other: Any) -> Any:
        return _combined("*", other, self)

    def __or__(self, other: Any) -> Any:
        return _combined("max", self, other)

    def __ror__(self, other: Any) -> Any:
        return _combined("max", other, self)

    def __invert__(self) -> Symbol:
        return Symbol("-", (1.0, _condition(self)))

    # Operations that need a number.

    def __bool__(self) -> bool:
        raise refused(
            "the model branches on a value that is unknown while it is traced",
            "write foldline.where(condition, a, b) instead of `if`, `and`, `or`, `while` and chained comparisons; & and | combine "
            "conditions; np.minimum and np.maximum, of single values, replace min and max",
        )

    def __float__(self) -> float:
        raise _needs_number("a function outside numpy")

    def __int__(self) -> int:
        raise _needs_number("a whole number or an index")

    def __index__(self) -> int:
        raise _needs_number("a whole number or an index")

    def __complex__(self) -> complex:
        raise _needs_number("a complex number")

    def __mod__(self, other: Any) -> Any:
        raise refused("`%` is discontinuous and not available in a model", "remove it: sin and cos of an angle need no reduction")

    __rmod__ = __mod__

    def __floordiv__(self, other: Any) -> Any:
        raise refused("`//` is discontinuous and not available in a model", "write `/`, or foldline.where for steps")

    __rfloordiv__ = __floordiv__

    def __round__(self, digits: int | None = None) -> Any:
        raise refused("round is discontinuous and not available in a model", "remove it, or write foldline.where for steps")

    # NumPy.

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or any(value is not None for key, value in options.items() if key in ("out", "where")):
            raise refused(f"np.{ufunc.__name__}.{method} cannot be traced", "write out the operation for each value")
        if any(isinstance(value, np.ndarray) and value.ndim > 0 for value in inputs):
            each = np.frompyfunc(lambda *own: _function(ufunc.__name__, own), len(inputs), 1)
            return each(*(_boxed(value) for value in inputs))
        return _function(ufunc.__name__, inputs)

    def __array_function__(self, function: Callable[..., Any], types: Any, args: Any, kwargs: Any) -> Any:
        if function is np.where and len(args) == 3:
            return where(*args)
        if function is np.clip and len(args) == 3 and not kwargs:
            value, low, high = args
            return _function("minimum", (_function("maximum", (value, low)), high))
        raise refused(
            f"np.{getattr(function, '__name__', '?')} cannot be traced",
            "write it with + - * / **, foldline.where and the elementary functions of numpy",
        )

    # Methods that NumPy calls for the elements of an array of objects; functions of one operand are found by __getattr__.

    def hypot(self, other: Any) -> Any:
        return _function("hypot", (self, other))

    def arctan2(self, other: Any) -> Any:
        return _function("arctan2", (self, other))

    def __getattr__(self, name: str) -> Any:
        if name in _ONE or name in ("deg2rad", "radians", "log10", "log2"):
            return lambda: _function(name, (self,))
        raise AttributeError(f"a symbol has no attribute `{name}`")

    def __repr__(self) -> str:
        from ._write import written

        return f"<symbol {written(self)}>"


def _boxed(value: Any) -> Any:
    if isinstance(value, Symbol):
        box = np.empty((), dtype=object)
        box[()] = value
        return box
    return value


def operand(value: Any) -> Operand:
    """Returns a symbol, or a number as Python writes it."""
    if isinstance(value, Symbol):
        return value
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
        return value if isinstance(value, Symbol) else operand(value)
    if isinstance(value, (bool, int, float, np.bool_, np.integer, np.floating)):
        number = float(value)
        if not np.isfinite(number):
            raise refused(f"{number} is not a finite number", "use finite numbers")
        return number
    if type(value).__module__.split(".")[0] == "sympy":
        from ._sympy import converted

        return converted(value)
    raise refused(f"{value!r} cannot be used in a model", "a real number, a state, a parameter, or an expression of them")


def _operator(op: str, a: Any, b: Any) -> Any:
    if (isinstance(a, np.ndarray) and a.ndim > 0) or (isinstance(b, np.ndarray) and b.ndim > 0):
        each = np.frompyfunc(lambda x, y: Symbol(op, (operand(x), operand(y))), 2, 1)
        return each(_boxed(a), _boxed(b))
    return Symbol(op, (operand(a), operand(b)))


def _condition(value: Any) -> Operand:
    own = operand(value)
    if isinstance(own, Symbol):
        logical = own.op in COMPARISONS or (own.op in ("*", "max", "-") and all(_logical(part) for part in own.operands))
        if logical:
            return own
    raise refused("& | ~ combine conditions only", "put each comparison in brackets: (a < b) & (b < c)")


def _logical(value: Operand) -> bool:
    if isinstance(value, Symbol):
        return value.op in COMPARISONS or (value.op in ("*", "max", "-") and all(_logical(part) for part in value.operands))
    return value in (0.0, 1.0)


def _combined(op: str, a: Any, b: Any) -> Symbol:
    return Symbol(op, (_condition(a), _condition(b)))


def _function(name: str, inputs: tuple[Any, ...]) -> Any:
    values = tuple(operand(value) for value in inputs)
    if name in _OPERATORS and len(values) == 2:
        return Symbol(_OPERATORS[name], values)
    if name in _ONE and len(values) == 1:
        return Symbol(_ONE[name], values)
    if name in _TWO and len(values) == 2:
        return Symbol(_TWO[name], values)
    match name:
        case "negative":
            return Symbol("negate", values)
        case "positive":
            return values[0]
        case "square":
            return Symbol("^", (values[0], 2.0))
        case "reciprocal":
            return Symbol("/", (1.0, values[0]))
        case "heaviside" if values[1] == 0.5 and not isinstance(values[1], Symbol):
            return Symbol("heaviside", values[:1])
        case "heaviside":
            positive = Symbol("if", (Symbol(">", (values[0], 0.0)), 1.0, values[1]))
            return Symbol("if", (Symbol("<", (values[0], 0.0)), 0.0, positive))
        case "deg2rad" | "radians":
            return Symbol("*", (values[0], float(np.pi / 180)))
        case "log10" | "log2":
            return Symbol("/", (Symbol("log", values), float(np.log(10.0 if name == "log10" else 2.0))))
        case "logical_and":
            return _combined("*", *values)
        case "logical_or":
            return _combined("max", *values)
        case "logical_not":
            return Symbol("-", (1.0, _condition(values[0])))
    known = sorted([*_ONE, *_TWO, "square", "heaviside"])
    raise refused(f"`{name}` is not available in a model", f"write it with + - * / **, foldline.where and {', '.join(known)}")


def where(condition: Any, a: Any, b: Any) -> Any:
    """Returns `a` where the condition holds and `b` elsewhere, for use in the function of a model: `if(condition, a, b)` in a model file.

    The derivative is that of the alternative taken, even if the other one is undefined there. A singular point can thus be left
    out: ``foldline.where(r > 0, f(r)/r, 0)``.

    Parameters
    ----------
    condition : symbol or bool
        A comparison, or comparisons combined with ``&`` and ``|``.
    a, b : symbol or float
        The two alternatives. Both are traced.

    Returns
    -------
    symbol
        A number if all arguments are numbers.

    Examples
    --------
    >>> import foldline
    >>> @foldline.model(states="x", parameters=dict(k=4.0))
    ... def stop(s, p):
    ...     return foldline.where(s.x > 1, p.k * (1 - s.x), 0.0)
    >>> stop([[0.5], [1.5]]).ravel().tolist()
    [0.0, -2.0]
    """
    if not any(isinstance(value, (Symbol, np.ndarray)) for value in (condition, a, b)):
        return a if condition else b
    if any(isinstance(value, np.ndarray) and value.ndim > 0 for value in (condition, a, b)):
        return np.frompyfunc(where, 3, 1)(_boxed(condition), _boxed(a), _boxed(b))
    return Symbol("if", (operand(condition), operand(a), operand(b)))

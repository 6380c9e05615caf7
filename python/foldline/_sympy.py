"""Expressions of SymPy as symbols."""

from __future__ import annotations

from typing import Any

from ._symbols import Operand, Symbol, refused

_FUNCTIONS = {
    "sin": "sin", "cos": "cos", "tan": "tan", "asin": "asin", "acos": "acos", "atan": "atan", "atan2": "atan2", "sinh": "sinh",
    "cosh": "cosh", "tanh": "tanh", "exp": "exp", "log": "log", "Abs": "abs", "sign": "sign",
}  # fmt: skip
_RELATIONS = {
    "StrictLessThan": "<", "LessThan": "<=", "StrictGreaterThan": ">", "GreaterThan": ">=", "Equality": "==", "Unequality": "!=",
}  # fmt: skip


def converted(expression: Any) -> Operand:
    """Returns the symbol of a SymPy expression; names stand for the states and parameters of that name."""
    done: dict[Any, Operand] = {}
    stack: list[tuple[Any, bool]] = [(expression, False)]
    while stack:
        node, ready = stack.pop()
        if node in done:
            continue
        if not ready:
            stack.append((node, True))
            stack.extend((part, False) for part in _parts(node))
            continue
        done[node] = _one(node, done)
    return done[expression]


def _parts(node: Any) -> list[Any]:
    if type(node).__name__ == "Piecewise":
        return [part for pair in node.args for part in pair.args]
    return [] if node.is_Atom else list(node.args)


def _one(node: Any, done: dict[Any, Operand]) -> Operand:
    name = type(node).__name__
    if node.is_Symbol:
        return Symbol(str(node.name))
    if name in ("BooleanTrue", "BooleanFalse"):
        return 1.0 if name == "BooleanTrue" else 0.0
    if node.is_Rational and not node.is_Integer:
        return Symbol("/", (float(node.p), float(node.q)))
    if node.is_Atom and node.is_number and node.is_real and node.is_finite:
        return float(node)
    if name == "Piecewise":
        return _piecewise(node, done)
    parts = tuple(done[part] for part in node.args)
    if node.is_Add or node.is_Mul:
        return _chain(node, parts)
    if node.is_Pow:
        if node.exp.is_Rational and node.exp.p == 1 and node.exp.q == 2:
            return Symbol("sqrt", parts[:1])
        return Symbol("^", parts)
    if name in _FUNCTIONS and len(parts) == (2 if name == "atan2" else 1):
        return Symbol(_FUNCTIONS[name], parts)
    if name in _RELATIONS:
        return Symbol(_RELATIONS[name], parts)
    if name in ("Min", "Max", "And", "Or"):
        op = {"Min": "min", "Max": "max", "And": "*", "Or": "max"}[name]
        whole = parts[0]
        for part in parts[1:]:
            whole = Symbol(op, (whole, part))
        return whole
    if name == "Not":
        return Symbol("-", (1.0, parts[0]))
    if name == "Heaviside" and len(node.args) == 2 and float(node.args[1]) == 0.5:
        return Symbol("heaviside", parts[:1])
    raise refused(
        f"the SymPy expression `{node}` cannot be used in a model",
        "expand it, with .doit() or .rewrite(), into sums, products, powers, Piecewise and elementary functions",
    )


def _chain(node: Any, parts: tuple[Operand, ...]) -> Operand:
    """Writes a sum with negative terms subtracted, or a product with negative powers as divisions."""
    whole: Operand | None = None
    minus, sign = ("-", "+") if node.is_Add else ("/", "*")
    below: list[Operand] = []
    for part, own in zip(node.args, parts, strict=True):
        if node.is_Mul and part.is_Pow and part.exp.is_Rational and part.exp.is_negative:
            inverse = 1 / part
            below.append(converted(inverse))
        else:
            whole = own if whole is None else Symbol(sign, (whole, own))
    for own in below:
        whole = Symbol(minus, (1.0 if whole is None else whole, own))
    return 1.0 if whole is None else whole


def _piecewise(node: Any, done: dict[Any, Operand]) -> Operand:
    pairs = [(done[pair.args[0]], done[pair.args[1]]) for pair in node.args]
    value, condition = pairs.pop()
    if isinstance(condition, Symbol) or condition != 1.0:
        raise refused(
            f"the SymPy expression `{node}` is undefined where none of its conditions holds", "end the Piecewise with a pair (value, True)"
        )
    for own, when in reversed(pairs):
        value = Symbol("if", (when, own, value))
    return value

"""Expressions and tables as text for the readers of the command line."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ._symbols import COMPARISONS, Operand, Symbol

# Binding strength, from loosest to tightest.
_COMPARISON, _SUM, _PRODUCT, _SIGNED, _POWER, _ATOM = range(6)
#: Deeper nesting than this becomes a definition; the reader refuses 200.
_DEEPEST = 60

#: Text, its binding strength, and the depth of nested brackets in it.
_Piece = tuple[str, int, int]


def number(value: float) -> str:
    """Writes a number that reads back to the last bit."""
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text


def _bracketed(piece: _Piece, least: int) -> tuple[str, int]:
    text, binding, depth = piece
    return (text, depth) if binding >= least else (f"({text})", depth + 1)


def _joined(a: _Piece, sign: str, b: _Piece, least: tuple[int, int], binding: int) -> _Piece:
    (left, deep), (right, deeper) = _bracketed(a, least[0]), _bracketed(b, least[1])
    return f"{left}{sign}{right}", binding, max(deep, deeper)


def _piece(op: str, parts: list[_Piece]) -> _Piece:
    if op in COMPARISONS:
        return _joined(*_around(parts, f" {op} "), (_SUM, _SUM), _COMPARISON)
    if op in ("+", "-"):
        return _joined(*_around(parts, f" {op} "), (_SUM, _PRODUCT), _SUM)
    if op in ("*", "/"):
        return _joined(*_around(parts, op), (_SIGNED if op == "*" and parts[0][1] == _SIGNED else _PRODUCT, _POWER), _PRODUCT)
    if op == "^":
        sign = _SIGNED if re.fullmatch(r"-[\d.e+-]+", parts[1][0]) else _ATOM
        return _joined(*_around(parts, "^"), (_ATOM, sign), _POWER)
    if op == "negate":
        text, depth = _bracketed(parts[0], _POWER)
        return f"-{text}", _SIGNED, depth + 1
    inner = ", ".join(text for text, _, _ in parts)
    return f"{op}({inner})", _ATOM, 1 + max(depth for _, _, depth in parts)


def _around(parts: list[_Piece], sign: str) -> tuple[_Piece, str, _Piece]:
    return parts[0], sign, parts[1]


def _leaf(value: Operand) -> _Piece:
    if isinstance(value, Symbol):
        return value.op, _ATOM, 0
    text = number(value)
    return text, _SIGNED if text.startswith("-") else _ATOM, 0


def _is_leaf(value: Operand) -> bool:
    return not isinstance(value, Symbol) or not value.operands


class Writer:
    """Writes expressions that share parts: a part used more than once becomes a named definition.

    Parameters
    ----------
    taken : iterable of str
        Names that are not free.
    """

    def __init__(self, taken: Iterable[str]) -> None:
        self.definitions: dict[str, str] = {}
        self._taken = set(taken)
        self._pieces: dict[int, _Piece] = {}
        # Nodes are identified by their address, so they must live as long as this object.
        self._kept: list[Symbol] = []

    def write(self, roots: Sequence[Operand]) -> list[str]:
        """Returns the texts of expressions."""
        order, uses = _nodes(roots)
        for node in order:
            parts = [self._of(part) for part in node.operands]
            piece = _piece(node.op, parts)
            if uses[id(node)] > 1 or piece[2] > _DEEPEST:
                piece = self._named(piece[0])
            self._pieces[id(node)] = piece
            self._kept.append(node)
        return [self._of(root)[0] for root in roots]

    def _of(self, value: Operand) -> _Piece:
        return _leaf(value) if _is_leaf(value) else self._pieces[id(value)]

    def _named(self, text: str) -> _Piece:
        count = len(self.definitions) + 1
        while f"e{count}" in self._taken:
            count += 1
        name = f"e{count}"
        self._taken.add(name)
        self.definitions[name] = text
        return name, _ATOM, 0


def _nodes(roots: Sequence[Operand]) -> tuple[list[Symbol], dict[int, int]]:
    """Returns the nodes with operands below some roots, operands first, and the number of uses of each."""
    order: list[Symbol] = []
    uses: dict[int, int] = {}
    stack: list[tuple[Operand, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        node, done = stack.pop()
        if not isinstance(node, Symbol) or not node.operands:
            continue
        if done:
            order.append(node)
            continue
        uses[id(node)] = uses.get(id(node), 0) + 1
        if uses[id(node)] == 1:
            stack.append((node, True))
            stack.extend((part, False) for part in reversed(node.operands))
    return order, uses


def written(value: Operand) -> str:
    """Writes one expression, preceded by its shared parts."""
    writer = Writer(())
    text = writer.write([value])[0]
    return ", ".join([*(f"{name} = {own}" for name, own in writer.definitions.items()), text])


# Tables in TOML.

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def key(name: str) -> str:
    """Writes a key in TOML."""
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def value(own: Any) -> str:
    """Writes a value in TOML."""
    if isinstance(own, (bool, np.bool_)):
        return "true" if own else "false"
    if isinstance(own, (int, np.integer)):
        return str(int(own))
    if isinstance(own, (float, np.floating)):
        # TOML has words for infinities and NaN; the reader reports them.
        return repr(float(own))
    if isinstance(own, str):
        return json.dumps(own, ensure_ascii=False)
    if isinstance(own, Mapping):
        return "{ " + ", ".join(f"{key(str(k))} = {value(v)}" for k, v in own.items()) + " }" if own else "{}"
    if isinstance(own, (Sequence, np.ndarray)):
        return "[" + ", ".join(value(v) for v in own) + "]"
    return json.dumps(str(own), ensure_ascii=False)


def study(tables: Mapping[str, Any]) -> str:
    """Writes the text of a study: plain keys, then its lists of tables in the given order."""
    lists = ("seed", "branch", "curve", "homotopy", "explore", "survey", "sweep", "design", "map")
    lines = [f"{key(name)} = {value(own)}" for name, own in tables.items() if name not in lists]
    for name, items in tables.items():
        if name in lists:
            for item in items:
                lines += ["", f"[[{name}]]", *(f"{key(str(k))} = {value(v)}" for k, v in item.items() if v is not None)]
    return "\n".join(lines) + "\n"

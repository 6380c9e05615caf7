"""Identity of a function: its source, and the values and functions that it refers to."""

from __future__ import annotations

import functools
import hashlib
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def fingerprint(function: Any) -> list[str]:
    """Returns texts that are the same in another process if the function is.

    They contain the source of the function, its default values, the values that it closes over, and the global values and functions of the
    same module that it names, with theirs. Functions of other modules count by their names.
    """
    return list(_parts(function, set()))


def _parts(value: Any, seen: set[int]) -> Iterator[str]:
    if id(value) in seen:
        return
    if isinstance(value, functools.partial):
        yield "partial"
        for own in (value.func, *value.args, *(part for pair in sorted(value.keywords.items()) for part in pair)):
            yield from _parts(own, seen)
    elif isinstance(value, FunctionType):
        seen.add(id(value))
        yield from _of_function(value, seen)
    elif inspect.ismethod(value):
        yield from _parts(value.__func__, seen)
        yield from _parts(value.__self__, seen)
    elif isinstance(value, (list, tuple)):
        yield type(value).__name__
        for own in value:
            yield from _parts(own, seen)
    elif isinstance(value, Mapping):
        yield "mapping"
        for name, own in value.items():
            yield str(name)
            yield from _parts(own, seen)
    elif isinstance(value, (set, frozenset)):
        yield f"set {sorted(map(repr, value))}"
    else:
        yield from _of_value(value, seen)


def _of_function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    yield function.__qualname__
    try:
        yield textwrap.dedent(inspect.getsource(function))
    except (OSError, TypeError):
        yield function.__code__.co_code.hex()
        yield repr([own for own in function.__code__.co_consts if not isinstance(own, CodeType)])
    for cell in function.__closure__ or ():
        try:
            yield from _parts(cell.cell_contents, seen)
        except ValueError:
            yield "unset"
    yield from _parts(function.__defaults__ or (), seen)
    yield from _parts(function.__kwdefaults__ or {}, seen)
    for name in sorted(_names(function.__code__)):
        own = function.__globals__.get(name)
        if own is None or isinstance(own, ModuleType):
            continue
        foreign = isinstance(own, (FunctionType, type)) and own.__module__ != function.__module__
        yield name
        yield from [f"{own.__module__}.{own.__qualname__}"] if foreign else _parts(own, seen)


def _names(code: CodeType) -> set[str]:
    """Global names that code refers to, inner functions included."""
    inner = (own for own in code.co_consts if isinstance(own, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _of_value(value: Any, seen: set[int]) -> Iterator[str]:
    from ._model import Model

    if isinstance(value, Model):
        yield value.text
    elif isinstance(value, np.ndarray) and value.dtype != object:
        yield f"array {value.dtype} {value.shape} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"
    elif inspect.isroutine(value) or isinstance(value, type):
        yield f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value)}"
    elif " at 0x" not in repr(value):
        yield repr(value)
    else:
        # An object without a text of its own: its type, its call if it has one, and its attributes.
        seen.add(id(value))
        yield f"{type(value).__module__}.{type(value).__qualname__}"
        call = next((vars(kind)["__call__"] for kind in type(value).__mro__ if "__call__" in vars(kind)), None)
        if isinstance(call, FunctionType):
            yield from _parts(call, seen)
        yield from _parts(getattr(value, "__dict__", {}), seen)

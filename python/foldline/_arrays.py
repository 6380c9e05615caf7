"""Bytes of the native half as arrays. The arrays are views of these bytes, and cannot be written to."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import InputError

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Complexes = npt.NDArray[np.complex128]


def floats(raw: bytes, *shape: int) -> Floats:
    """Numbers in the given shape."""
    array = np.frombuffer(raw, dtype=np.float64)
    return array.reshape(shape) if shape else array


def integers(raw: bytes) -> Integers:
    """Whole numbers."""
    return np.frombuffer(raw, dtype=np.int64)


def complexes(raw: bytes, *shape: int) -> Complexes:
    """Complex numbers in the given shape."""
    array = np.frombuffer(raw, dtype=np.complex128)
    return array.reshape(shape) if shape else array


def raw(values: Any) -> bytes:
    """Numbers as bytes."""
    return np.ascontiguousarray(values, dtype=np.float64).tobytes()


def processors(jobs: int | None) -> int:
    """How many threads are meant."""
    return whole("jobs", jobs) if jobs is not None else (os.cpu_count() or 1)


def whole(name: str, value: int, least: int = 1) -> int:
    """A whole number that is not too small."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{name} = {value!r} is not allowed\n  help: a whole number from {least} upwards")
    return int(value)


def tolerable(tolerance: float, least: float = 1e-10, most: float = 1e-4) -> float:
    """A tolerance within its bounds."""
    if not least <= tolerance <= most:
        raise InputError(f"the tolerance {tolerance:g} is out of range\n  help: a number from {least:g} to {most:g}")
    return float(tolerance)


def limits(steps: int | None, time: float | None) -> tuple[int | None, float | None]:
    """Limits on trajectories, as far as they are given."""
    if time is not None and not time > 0:
        raise InputError(f"max_time = {time!r} is not allowed\n  help: a positive time in the units of the model")
    return None if steps is None else whole("max_steps", steps), None if time is None else float(time)


def finite(name: str, values: Any) -> Floats:
    """Numbers, all of them finite."""
    array: Floats = np.asarray(values, dtype=np.float64)
    if not np.isfinite(array).all():
        raise InputError(f"{name} has values that are not finite\n  help: numbers such as 5, 0.25 or 1e-6")
    return array


def pairs(values: Mapping[str, Any] | None) -> list[tuple[str, float]]:
    """Names with numbers."""
    return [(str(name), float(value)) for name, value in (values or {}).items()]

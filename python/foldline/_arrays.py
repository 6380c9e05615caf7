"""Bytes from the native half as arrays. The arrays are read-only views of these bytes."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arguments import check_parameters, number
from ._errors import ArgumentError, InputError

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Complexes = npt.NDArray[np.complex128]


def floats(raw: bytes, *shape: int) -> Floats:
    """Returns numbers in the given shape."""
    array = np.frombuffer(raw, dtype=np.float64)
    return array.reshape(shape) if shape else array


def integers(raw: bytes) -> Integers:
    """Returns whole numbers."""
    return np.frombuffer(raw, dtype=np.int64)


def complexes(raw: bytes, *shape: int) -> Complexes:
    """Returns complex numbers in the given shape."""
    array = np.frombuffer(raw, dtype=np.complex128)
    return array.reshape(shape) if shape else array


def raw(values: Any) -> bytes:
    """Returns numbers as bytes."""
    return np.ascontiguousarray(values, dtype=np.float64).tobytes()


def processors(jobs: int | None) -> int:
    """Number of threads."""
    return whole("jobs", jobs) if jobs is not None else (os.cpu_count() or 1)


def whole(name: str, value: int, least: int = 1) -> int:
    """Returns a whole number, which must not be smaller than `least`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise InputError(f"{name} = {value!r} is not allowed\n  help: a whole number from {least} upwards")
    return int(value)


def tolerable(tolerance: float, least: float = 1e-10, most: float = 1e-4) -> float:
    """Returns a tolerance, which must lie within its bounds."""
    own = number("tolerance", tolerance)
    if not least <= own <= most:
        raise InputError(f"the tolerance {own:g} is out of range\n  help: a number from {least:g} to {most:g}")
    return own


def limits(steps: int | None, time: float | None) -> tuple[int | None, float | None]:
    """Returns limits on trajectories; `None` for those not given."""
    time = None if time is None else number("max_time", time)
    if time is not None and not time > 0:
        raise InputError(f"max_time = {time!r} is not allowed\n  help: a positive time in the units of the model")
    return None if steps is None else whole("max_steps", steps), None if time is None else float(time)


def real(name: str, values: Any) -> Floats:
    """Returns real numbers as an array of floats."""
    try:
        given = np.asarray(values)
        # NumPy would read the digits of strings, and drop imaginary parts.
        array: Floats = given.astype(np.float64) if given.dtype.kind not in "USc" else _refused(given)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"{name} has values that are not real numbers: {values!r}\n  help: numbers such as 5, 0.25 or 1e-6") from error
    return array


def finite(name: str, values: Any) -> Floats:
    """Returns real numbers, all of which must be finite."""
    array = real(name, values)
    if not np.isfinite(array).all():
        raise InputError(f"{name} has values that are not finite\n  help: numbers such as 5, 0.25 or 1e-6")
    return array


def _refused(given: Any) -> Floats:
    raise TypeError(given.dtype.name)


def pairs(values: Mapping[str, Any] | None) -> list[tuple[str, float]]:
    """Returns pairs of names and numbers."""
    check_parameters("parameters", values)
    return [(str(name), number(str(name), value)) for name, value in (values or {}).items()]

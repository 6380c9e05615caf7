"""Bytes of the native half as arrays. The arrays are views of these bytes, and cannot be written to."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

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
    return jobs if jobs is not None else (os.cpu_count() or 1)


def pairs(values: Mapping[str, Any] | None) -> list[tuple[str, float]]:
    """Names with numbers."""
    return [(str(name), float(value)) for name, value in (values or {}).items()]

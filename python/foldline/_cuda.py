"""Trajectories on an NVIDIA card, through CuPy. The kernel is the source that `foldline emit` writes."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from . import _native
from ._arrays import Floats, floats, raw
from ._errors import DeviceError, InputError

if TYPE_CHECKING:
    from ._model import Model

#: Threads of a block, and blocks on a multiprocessor: the launch bounds of the source.
THREADS, BLOCKS = 128, 4
#: Types of the members of a job.
TYPES = {"q": "i8", "i": "i4", "d": "f8", "p": "u8"}


class Ends(NamedTuple):
    """Final states, times, outcomes, accepted and rejected steps."""

    states: Floats
    times: Floats
    outcomes: Any
    steps: Any
    rejected: Any


def _cupy() -> Any:
    """Returns CuPy with a card, or says what is missing."""
    try:
        import cupy  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise DeviceError("CuPy is not installed\n  help: pip install foldline[cuda], or device='cpu'") from error
    try:
        count = cupy.cuda.runtime.getDeviceCount()
    except Exception as error:
        raise DeviceError(
            f"CuPy finds no NVIDIA driver: {error}\n  help: a machine with an NVIDIA card and its driver, or device='cpu'"
        ) from error
    if count == 0:
        raise DeviceError("there is no NVIDIA card\n  help: a machine with one, or device='cpu'")
    return cupy


@lru_cache(maxsize=16)
def _kernel(source: str) -> tuple[Any, Any]:
    """Compiles a source; returns its module and kernel."""
    cupy = _cupy()
    try:
        module = cupy.RawModule(code=source, options=("-std=c++14",))
        return module, module.get_function("fl_kernel")
    except cupy.cuda.compiler.CompileException as error:
        raise DeviceError(
            f"the kernel does not compile: {error}\n  help: report it with the model; device='cpu' needs no kernel"
        ) from error


def job_type(emitted: Any) -> np.dtype[Any]:
    """Returns the memory layout of the structure `fl_job` of a source."""
    shapes = {"n": ("f8", (emitted.states,)), "s": ("f8", (emitted.scalars,))}
    members = [(name, *shapes[kind]) if kind in shapes else (name, TYPES[kind]) for name, kind in emitted.layout]
    return np.dtype(members, align=True)


def on_card(
    model: Model, starts: Floats, values: Floats, own: bool, span: tuple[float, float], scales: Floats, tolerance: float, steps: int
) -> Ends:
    """Integrates from `starts` (count, n) at `values` (k,) or, with `own`, (count, k)."""
    cupy = _cupy()
    emitted = _native.Emitted(model._native, own, False, False)
    n, count = emitted.states, len(starts)
    units = np.array([model._native.time_unit(raw(row)) for row in (np.unique(values, axis=0) if own else values[None])])
    if len(units) and np.ptp(units) != 0.0:
        raise InputError("the forcing period differs between the trajectories\n  help: one call for each period, or device='cpu'")
    unit = units[0] if len(units) else 1.0
    begin, end = span[0] / unit, span[1] / unit
    across = np.full((n, count), begin)
    across[: starts.shape[1]] = starts.T
    absolute = np.append(scales, np.ones(n - len(scales))) * tolerance
    arrays = {
        "starts": cupy.asarray(across),
        "own": cupy.asarray(np.ascontiguousarray(values.T) if own else np.zeros(1)),
        "states": cupy.empty((n, count)),
        "times": cupy.empty(count),
        "outcomes": cupy.empty(count, np.int32),
        "steps": cupy.empty(count, np.uint32),
        "rejected": cupy.empty(count, np.uint32),
        "next": cupy.zeros(1, np.uint64),
    }
    job = np.zeros(1, job_type(emitted))
    numbers = {
        "count": count,
        "begin": begin,
        "end": end,
        "sign": -1.0 if end < begin else 1.0,
        "longest": 1e100,
        "limit": float(steps),
        "size": absolute.max() / tolerance,
        "relative": tolerance,
        "absolute": absolute,
        "s": np.zeros(emitted.scalars) if own else floats(emitted.values(raw(values))),
    }
    for name, value in numbers.items():
        job[name] = value
    for name, array in arrays.items():
        job[name] = array.data.ptr
    module, kernel = _kernel(emitted.source)
    module.get_global("fl_the_job").copy_from_host(job.ctypes.data, job.nbytes)
    card = cupy.cuda.Device()
    blocks = min(card.attributes["MultiProcessorCount"] * BLOCKS, -(-count // THREADS))
    if count:
        kernel((blocks,), (THREADS,), ())
    card.synchronize()
    states = np.ascontiguousarray(arrays["states"].get()[: starts.shape[1]].T)
    times = arrays["times"].get() * unit
    whole = [arrays[name].get().astype(np.int64) for name in ("outcomes", "steps", "rejected")]
    return Ends(states, times, *whole)

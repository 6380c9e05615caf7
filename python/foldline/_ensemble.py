"""Many trajectories at once, on the processor or on a graphics card."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arguments import check_model, number
from ._arrays import Floats, Integers, finite, floats, integers, pairs, processors, raw, tolerable, whole
from ._errors import ArgumentError, InputError, Interrupted

if TYPE_CHECKING:
    from ._model import Model

#: Names of the endings, as numbered by the compiled half and by kernels.
ENDINGS = np.array(["reached", "stopped", "escaped", "undefined", "step-too-small", "step-limit", "slides", "chatter"])
#: A trajectory that a kernel does not follow: it slides along the surface of a switch.
SLIDES = 6


class Ensemble:
    """Final states of many trajectories: the result of `foldline.ensemble`.

    Attributes
    ----------
    model : Model
        Model that was integrated.
    starts : array, shape (count, n)
        Initial states.
    states : array, shape (count, n)
        Final states, in their units.
    times : array, shape (count,)
        Times at which the trajectories ended, in the time unit of the model.
    endings : array of str, shape (count,)
        ``"reached"``, ``"escaped"``, ``"undefined"``, ``"step-too-small"``, ``"step-limit"`` or ``"chatter"``.
    steps, rejected : arrays of int, shape (count,)
        Numbers of accepted and rejected steps.
    device : str
        ``"cpu"`` or ``"cuda"``.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "x - x^3"})
    >>> ends = foldline.ensemble(model, [[-0.5], [0.5], [2.0]], 30.0)
    >>> ends["x"].round(4).tolist(), set(ends.endings.tolist())
    ([-1.0, 1.0, 1.0], {'reached'})
    """

    def __init__(
        self, model: Model, starts: Floats, states: Floats, times: Floats, endings: Any, steps: Integers, rejected: Integers, device: str
    ) -> None:
        self.model = model
        self.starts = starts
        self.states = states
        self.times = times
        self.endings = endings
        self.steps = steps
        self.rejected = rejected
        self.device = device

    def __getitem__(self, name: str) -> Floats:
        """Returns the final values of a state, shape (count,)."""
        from ._arguments import suggestion

        if name not in self.model.states:
            raise KeyError(f"{name}: {suggestion(str(name), self.model.states)}")
        column: Floats = self.states[:, list(self.model.states).index(name)]
        return column

    def __len__(self) -> int:
        return len(self.states)

    def __repr__(self) -> str:
        kinds, counts = np.unique(self.endings, return_counts=True)
        said = ", ".join(f"{count} {kind}" for kind, count in zip(kinds, counts, strict=True))
        return f"<ensemble of {self.model.name}: {len(self)} trajectories, {said}>"


def ensemble(
    model: Model,
    starts: Any,
    span: float | tuple[float, float],
    *,
    parameters: Mapping[str, Any] | None = None,
    tolerance: float = 1e-6,
    max_steps: int = 1_000_000,
    device: str = "cpu",
    jobs: int | None = None,
) -> Ensemble:
    """Integrates many trajectories over one time span.

    Parameters
    ----------
    model : Model
        A differential equation.
    starts : array, shape (count, n)
        Initial states.
    span : float or pair
        Duration, or first and last time, in the time unit of the model. The last time may be the smaller one.
    parameters : mapping, optional
        Values that replace those of the model: a number, or an array of shape (count,) with one value for each trajectory.
    tolerance : float
        Error of a step, relative to the state and to its scale, from 1e-14 to 0.1.
    max_steps : int
        Largest number of accepted and rejected steps of a trajectory.
    device : str
        ``"cpu"``, or ``"cuda"`` for an NVIDIA card. That needs the package with its extra: ``pip install foldline[cuda]``. The card
        uses the same method and tolerance; its results differ by rounding and by step lengths that differ in the sixth digit.
    jobs : int, optional
        Number of threads; by default all processors.

    Returns
    -------
    Ensemble

    Raises
    ------
    DeviceError
        If there is no CuPy, or no card that it can use.
    ArgumentError, InputError
        If an argument is of the wrong kind, or an array has the wrong shape.
    Interrupted
        After Ctrl-C, with the trajectories so far in `partial`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "-a*x"}, parameters={"a": 1.0})
    >>> foldline.ensemble(model, [[1.0], [1.0]], 1.0, parameters={"a": [1.0, 2.0]})["x"].round(5).tolist()
    [0.36788, 0.13534]
    """
    check_model(model, "foldline.ensemble({}, starts, 100.0)")
    if device not in ("cpu", "cuda"):
        raise InputError(f"device = {device!r} is not known\n  help: 'cpu' or 'cuda'")
    at = _starts(model, starts)
    ends = _span(span)
    values, own = _parameters(model, parameters, len(at))
    tolerance, max_steps = tolerable(tolerance, 1e-14, 1e-1), whole("max_steps", max_steps)
    scales = np.array([state["scale"] or 1.0 for state in model.states.values()])
    if device == "cuda":
        from ._cuda import on_card

        found = on_card(model, at, values, own, ends, scales, tolerance, max_steps)
        left = np.flatnonzero(found.outcomes == SLIDES)
        if len(left):
            rest, interrupt = _on_processor(model, at[left], values[left] if own else values, own, ends, scales, tolerance, max_steps, jobs)
            done = left[: len(rest[1])]
            for whole_array, part in zip(found, rest, strict=True):
                whole_array[done] = part
            if interrupt is not None:
                raise interrupt
        parts = tuple(found)
        return _made(model, at, parts, device)
    parts, interrupt = _on_processor(model, at, values, own, ends, scales, tolerance, max_steps, jobs)
    made = _made(model, at[: len(parts[1])], parts, device)
    if interrupt is not None:
        raise Interrupted(made) if isinstance(interrupt, KeyboardInterrupt) else interrupt
    return made


def _made(model: Model, starts: Floats, parts: Any, device: str) -> Ensemble:
    states, times, outcomes, steps, rejected = parts
    return Ensemble(model, starts, states, times, ENDINGS[outcomes], steps, rejected, device)


def _on_processor(
    model: Model,
    starts: Floats,
    values: Floats,
    own: bool,
    ends: tuple[float, float],
    scales: Floats,
    tolerance: float,
    steps: int,
    jobs: Any,
) -> Any:
    (states, times, outcomes, accepted, rejected), interrupt = _native.ensemble(
        model._native, raw(starts), raw(values), own, ends, raw(scales), tolerance, steps, processors(jobs)
    )
    at = floats(times)
    return (floats(states, len(at), starts.shape[1]), at, integers(outcomes), integers(accepted), integers(rejected)), interrupt


def _starts(model: Model, starts: Any) -> Floats:
    at = finite("starts", starts)
    n = len(model.states)
    if at.ndim != 2 or at.shape[1] != n:
        raise InputError(
            f"starts has the shape {at.shape}\n  help: (count, {n}): a row for each trajectory, a column for each of {', '.join(model.states)}"
        )
    return np.ascontiguousarray(at)


def _span(span: Any) -> tuple[float, float]:
    if isinstance(span, (tuple, list, np.ndarray)):
        if len(span) != 2:
            raise ArgumentError(f"the span has {len(span)} values\n  help: a duration, or a pair (first, last)")
        ends = number("the span", span[0]), number("the span", span[1])
    else:
        ends = 0.0, number("the span", span)
    finite("the time span", ends)
    return ends


def _parameters(model: Model, given: Mapping[str, Any] | None, count: int) -> tuple[Floats, bool]:
    """Returns values, shape (k,) or (count, k), and whether each trajectory has its own."""
    arrays = {name: value for name, value in (given or {}).items() if np.ndim(value) == 1}
    single = pairs({name: value for name, value in (given or {}).items() if name not in arrays})
    # Names are checked by the compiled half.
    names = pairs({name: 0.0 for name in arrays})
    values = floats(model._native.values(single + names)).copy()
    if not arrays:
        return floats(model._native.values(single)), False
    every = np.tile(values, (count, 1))
    for name, value in arrays.items():
        column = finite(name, value)
        if len(column) != count:
            raise InputError(f"{name} has {len(column)} values for {count} trajectories\n  help: one number, or one for each trajectory")
        every[:, list(model.parameters).index(name)] = column
    return every, True

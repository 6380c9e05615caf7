"""Trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arrays import Floats, finite, floats, raw
from ._errors import InputError, Interrupted

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._model import Model


class Trajectory:
    """A trajectory.

    Attributes
    ----------
    t : array, shape (times,)
        Times, in the unit of the model.
    states : array, shape (times, n)
    outputs : array, shape (times, outputs)
    ending : str
        ``"reached"``, ``"escaped"``, ``"undefined"`` (it leads out of the region in which f is defined),
        ``"step-too-small"`` or ``"stopped"``.
    """

    def __init__(self, model: Model, t: Floats, states: Floats, outputs: Floats, ending: str) -> None:
        self.model = model
        self.t = t
        self.states = states
        self.outputs = outputs
        self.ending = ending

    def __getitem__(self, name: str) -> Floats:
        """A state or output by name, shape (times,)."""
        for names, values in ((self.model.states, self.states), (self.model.outputs, self.outputs)):
            if name in names:
                column: Floats = values[:, list(names).index(name)]
                return column
        raise KeyError(f"{name}: one of {', '.join([*self.model.states, *self.model.outputs])}")

    def __len__(self) -> int:
        return len(self.t)

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each time."""
        from ._tables import trajectory_frame

        return trajectory_frame(self)

    def to_xarray(self) -> xarray.Dataset:
        """A data set over the dimension `t`."""
        from ._tables import trajectory_dataset

        return trajectory_dataset(self)

    def plot(self, ax: Any = None, names: list[str] | None = None) -> list[Any]:
        """Draws states, or outputs, over time.

        Parameters
        ----------
        ax : matplotlib axes, optional
        names : list of str, optional
            By default every state.

        Returns
        -------
        list of matplotlib lines
        """
        from ._plot import axes_or_new

        axes = axes_or_new(ax)
        lines = [line for name in names or list(self.model.states) for line in axes.plot(self.t, self[name], label=name)]
        axes.set_xlabel("t")
        axes.legend()
        return lines

    def __repr__(self) -> str:
        span = f"t = {self.t[0]:g} … {self.t[-1]:g}" if len(self) else "no times"
        return f"<trajectory of {self.model.name}: {len(self)} times, {span}, {self.ending}>"


def simulated(model: Model, state: Any, span: tuple[float, float], times: Any, parameters: bytes, tolerance: float) -> Trajectory:
    """Integrates; Ctrl-C ends it, and is raised again."""
    finite("the time span", span)
    wanted = None if times is None else raw(_within(finite("times", times).ravel(), span))
    (t, states, outputs, ending), interrupt = _native.simulate(model._native, raw(state), span, wanted, parameters, tolerance)
    at = floats(t)
    rows = floats(states, len(at), len(model.states))
    found = Trajectory(model, at, rows, floats(outputs, len(at), len(model.outputs)), ending)
    if interrupt is not None:
        raise Interrupted(found) if isinstance(interrupt, KeyboardInterrupt) else interrupt
    return found


def _within(times: Floats, span: tuple[float, float]) -> Floats:
    """Times in the direction of the span and, but for rounding, within it."""
    low, high = sorted(span)
    steps = np.diff(times) * (1.0 if span[1] >= span[0] else -1.0)
    room = 1e-12 * max(abs(low), abs(high))
    if (steps < 0).any() or (times.size and not (low - room <= times.min() and times.max() <= high + room)):
        message = f"the times do not go from {span[0]:g} towards {span[1]:g}"
        raise InputError(f"{message}\n  help: times within the span, in its direction, as np.linspace({span[0]:g}, {span[1]:g}, 100)")
    clipped: Floats = np.clip(times, low, high)
    return clipped

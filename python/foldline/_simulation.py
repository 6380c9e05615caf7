"""Trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arrays import Floats, floats, raw
from ._errors import Interrupted

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
        ``"reached"``, ``"escaped"``, ``"step-too-small"`` or ``"stopped"``.
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
    wanted = None if times is None else raw(np.asarray(times, dtype=float).ravel())
    (t, states, outputs, ending), interrupt = _native.simulate(model._native, raw(state), span, wanted, parameters, tolerance)
    at = floats(t)
    rows = floats(states, len(at), len(model.states))
    found = Trajectory(model, at, rows, floats(outputs, len(at), len(model.outputs)), ending)
    if interrupt is not None:
        raise Interrupted(found) if isinstance(interrupt, KeyboardInterrupt) else interrupt
    return found

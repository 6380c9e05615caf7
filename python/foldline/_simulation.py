"""Trajectories."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arguments import suggestion
from ._arrays import Floats, finite, floats, raw
from ._errors import InputError, Interrupted

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._model import Model


class Trajectory:
    """A trajectory: the result of `Model.simulate`. ``track["x"]`` is a state or output over time, shape (times,).

    Attributes
    ----------
    model : Model
        Model that was integrated.
    t : array, shape (times,)
        Times, in the time unit of the model.
    states : array, shape (times, n)
        States in their units.
    outputs : array, shape (times, outputs)
        Outputs in their units.
    ending : str
        ``"reached"``, ``"escaped"``, ``"undefined"`` (the trajectory left the region in which f is defined),
        ``"step-too-small"``, ``"step-limit"``, ``"chatter"`` or ``"stopped"``.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "y", "y": "-x"})
    >>> track = model.simulate({"x": 1, "y": 0}, 6.283185307179586, times=[0.0, 6.283185307179586])
    >>> track["x"].round(6).tolist(), track.ending
    ([1.0, 1.0], 'reached')
    """

    def __init__(self, model: Model, t: Floats, states: Floats, outputs: Floats, ending: str) -> None:
        self.model = model
        self.t = t
        self.states = states
        self.outputs = outputs
        self.ending = ending

    def __getitem__(self, name: str) -> Floats:
        """Returns a state or output over time, shape (times,)."""
        for names, values in ((self.model.states, self.states), (self.model.outputs, self.outputs)):
            if name in names:
                column: Floats = values[:, list(names).index(name)]
                return column
        raise KeyError(f"{name}: {suggestion(str(name), [*self.model.states, *self.model.outputs])}")

    def __len__(self) -> int:
        return len(self.t)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each time.

        Returns
        -------
        pandas.DataFrame
            Columns `t`, every state and every output, in the units of the model.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "-a*x"}, parameters={"a": 1.0})
        >>> list(model.simulate([1.0], 1.0).to_pandas())
        ['t', 'x']
        """
        from ._tables import trajectory_frame

        return trajectory_frame(self)

    def to_xarray(self) -> xarray.Dataset:
        """Returns a data set over the dimension `t`.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "-a*x"}, parameters={"a": 1.0})
        >>> list(model.simulate([1.0], 1.0).to_xarray().sizes)
        ['t']
        """
        from ._tables import trajectory_dataset

        return trajectory_dataset(self)

    def plot(self, ax: Any = None, names: list[str] | None = None) -> list[Any]:
        """Draws states or outputs over time with matplotlib.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        names : list of str, optional
            Names of states and outputs; by default every state.

        Returns
        -------
        list of matplotlib lines

        Raises
        ------
        KeyError
            If there is no such state or output.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "-a*x"}, parameters={"a": 1.0})
        >>> len(model.simulate([1.0], 1.0).plot())
        1
        """
        from ._axes import axes_or_new

        axes = axes_or_new(ax)
        lines = [line for name in names or list(self.model.states) for line in axes.plot(self.t, self[name], label=name)]
        axes.set_xlabel("t")
        axes.legend()
        return lines

    def __repr__(self) -> str:
        span = f"t = {self.t[0]:g} … {self.t[-1]:g}" if len(self) else "no times"
        return f"<trajectory of {self.model.name}: {len(self)} times, {span}, {self.ending}>"


def simulated(model: Model, state: Any, span: tuple[float, float], times: Any, parameters: bytes, tolerance: float) -> Trajectory:
    """Integrates a trajectory; Ctrl-C ends it and is raised again."""
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
    """Returns times that are in the direction of the span and, up to rounding, within it."""
    low, high = sorted(span)
    steps = np.diff(times) * (1.0 if span[1] >= span[0] else -1.0)
    room = 1e-12 * max(abs(low), abs(high))
    if (steps < 0).any() or (times.size and not (low - room <= times.min() and times.max() <= high + room)):
        message = f"the times do not go from {span[0]:g} towards {span[1]:g}"
        raise InputError(f"{message}\n  help: times within the span, in its direction, as np.linspace({span[0]:g}, {span[1]:g}, 100)")
    clipped: Floats = np.clip(times, low, high)
    return clipped

"""Stroboscopic points: states of a forced model once in every forcing period."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import call_of, check_free, check_parameters, check_solution, suggestion
from ._arrays import Floats, tolerable, whole
from ._errors import InputError
from ._model import Model
from ._solution import Solution
from ._studies import Range
from ._sweeps import between, visited

if TYPE_CHECKING:
    import pandas


class Strobe:
    """Stroboscopic points of a forced model at values of a parameter: the result of `foldline.strobe`.

    ``points["x"]`` is a state or output at the start of each recorded forcing period, shape (values, periods).

    Attributes
    ----------
    model : Model
        Model that was integrated.
    free : str
        Name of the parameter that varies.
    values : array, shape (values,)
        Its values in the order in which they were visited, in the unit of the model.
    states : array, shape (values, periods, n)
        States in their units.
    outputs : array, shape (values, periods, outputs)
        Outputs in their units.
    ending : str
        ``"reached"``, or why the simulation ended before the last value: ``"escaped"``, ``"undefined"``, ``"step-too-small"``.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
    >>> points = foldline.strobe(model, "w", (1, 2), 3, periods=4, transient=10)
    >>> points.states.shape
    (3, 4, 1)
    >>> points["x"].mean(axis=1).round(4).tolist()
    [0.5, 0.3077, 0.2]
    """

    def __init__(self, model: Model, free: str, values: Floats, states: Floats, outputs: Floats, ending: str) -> None:
        self.model = model
        self.free = free
        self.values = values
        self.states = states
        self.outputs = outputs
        self.ending = ending

    def __getitem__(self, name: str) -> Floats:
        """Returns a state or output, shape (values, periods)."""
        for names, values in ((self.model.states, self.states), (self.model.outputs, self.outputs)):
            if name in names:
                column: Floats = values[:, :, list(names).index(name)]
                return column
        raise KeyError(f"{name}: {suggestion(str(name), [*self.model.states, *self.model.outputs])}")

    def __len__(self) -> int:
        return len(self.values)

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table with a row for each point.

        Returns
        -------
        pandas.DataFrame
            The parameter, the number of the recorded period, every state and every output, in the units of the model.

        Raises
        ------
        ImportError
            If pandas is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> len(foldline.strobe(model, "w", (1, 2), 3, periods=4, transient=10).to_pandas())
        12
        """
        from ._tables import strobe_frame

        return strobe_frame(self)

    def plot(self, ax: Any = None, y: str | None = None, **style: Any) -> list[Any]:
        """Draws the points over the parameter with matplotlib.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        y : str, optional
            State or output; by default the first state.
        **style
            For the points, such as ``color="black"``.

        Returns
        -------
        list of matplotlib artists

        Raises
        ------
        InputError
            If there is no such state or output.
        ImportError
            If matplotlib is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
        >>> artists = foldline.strobe(model, "w", (1, 2), 3, periods=4, transient=10).plot()
        >>> artists[0].axes.get_xlabel()
        'w'
        """
        from ._overlay import strobe

        return strobe(self, ax, y, style)

    def __repr__(self) -> str:
        span = f", {self.values[0]:.6g} … {self.values[-1]:.6g}" if len(self) else ""
        early = "" if self.ending == "reached" else f"; ended early: {self.ending}"
        return f"<stroboscopic points of {self.model.name}: {len(self)} values of {self.free}{span}, {self.states.shape[1]} periods each{early}>"


def strobe(
    start: Model | Solution,
    free: str,
    range: Range | None = None,
    count: int = 101,
    *,
    values: Sequence[float] | None = None,
    back: bool = False,
    periods: int = 64,
    transient: int = 200,
    parameters: Mapping[str, float] | None = None,
    tolerance: float = 1e-8,
) -> Strobe:
    """Records the state of a forced model once in every forcing period while a parameter varies in steps.

    A cycle of one forcing period shows as one point, one of two periods as two, a quasi-periodic or chaotic motion as a cloud. The points come
    from plain simulation, which does not check that the motion has settled after `transient` periods. `foldline.sweep` does.

    Parameters
    ----------
    start : Model or Solution
        Where the simulation begins. From a solution, its state is taken; from a model, the cycle that it settles to at the first value.
    free : str
        Name of the parameter that varies.
    range : pair
        First and last value, in the unit of the model; their order is the direction. It may be left out if `values` is given.
    count : int
        Number of values, the ends included.
    values : sequence, optional
        Values in the order in which they are visited, instead of `range` and `count`.
    back : bool
        Return to the first value after the last one.
    periods : int
        Number of forcing periods recorded at each value.
    transient : int
        Number of forcing periods that pass before, at each value. The state at the previous value is the initial state.
    parameters : mapping, optional
        Values that replace those of the start.
    tolerance : float
        Error of an integration step, relative to the state and to its scale, from 1e-14 to 0.1.

    Returns
    -------
    Strobe
        It ends early at a value at which the trajectory escapes.

    Raises
    ------
    ArgumentError, InputError
        As for `follow`; also if the model is not forced.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w")
    >>> foldline.strobe(model, "w", (1, 2), 3, periods=4, transient=10)
    <stroboscopic points of model: 3 values of w, 1 … 2, 4 periods each>
    """
    if not isinstance(start, Model):
        check_solution(start, call_of("strobe", free, range))
    model = start if isinstance(start, Model) else start.model
    if not model.forced:
        cure = f'a sweep shows the extremes of its motions: foldline.sweep(start, "{free}", (0.5, 4))'
        raise InputError(f"the model `{model.name}` is not forced: there is no forcing period\n  help: {cure}")
    check_free(free, model, "foldline.strobe(start, {}, (0.5, 4))")
    check_parameters("parameters", parameters, model)
    given = visited(free, "foldline.strobe(start", range, count, values, back, ordered=False)
    for own in given.get("values") or given["range"]:
        if isinstance(own, str):
            raise InputError(f"values are numbers here, and {own!r} was given\n  help: numbers in the unit of the model")
    stated: list[float] = given.get("values") or between(given["range"], given["count"])
    fixed = {**({} if isinstance(start, Model) else start.parameters), **(parameters or {})}
    kept, skipped = whole("periods", periods), whole("transient", transient, 0)
    known = start.settle("cycle", parameters={**fixed, free: stated[0]}) if isinstance(start, Model) else start
    return _recorded(model, known.state, free, stated, fixed, (kept, skipped), tolerable(tolerance, 1e-14, 1e-1))


def _recorded(
    model: Model,
    state: Any,
    free: str,
    values: Sequence[float],
    fixed: Mapping[str, float],
    counts: tuple[int, int],
    tolerance: float,
) -> Strobe:
    kept, skipped = counts
    states, outputs, ending = [], [], "reached"
    for value in values:
        own = {**fixed, free: value}
        period = model._native.time_unit(model._values(own))
        times = period * np.arange(skipped + 1, skipped + kept + 1)
        track = model.simulate(state, (0.0, float(times[-1])), times=times, parameters=own, tolerance=tolerance)
        if track.ending != "reached":
            ending = track.ending
            break
        states.append(track.states)
        outputs.append(track.outputs)
        state = track.states[-1]
    count = len(states)
    return Strobe(
        model,
        free,
        np.array(values[:count], dtype=np.float64),
        np.array(states, dtype=np.float64).reshape(count, kept, len(model.states)),
        np.array(outputs, dtype=np.float64).reshape(count, kept, len(model.outputs)),
        ending,
    )

"""Simulation over a range of a parameter: stepped sweeps and surveys of attractors."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._arguments import call_of, check_free, check_model, check_parameters, check_range, check_solution, end
from ._arrays import finite, tolerable, whole
from ._diagram import Diagram
from ._errors import ArgumentError, InputError, NoSolution
from ._model import Model
from ._progress import Progress
from ._responses import Responses, Survey, Sweep
from ._solution import Solution
from ._studies import START, Path, Range, carried_out, parsed


def sweep(
    start: Model | Solution,
    free: str,
    range: Range | None = None,
    count: int = 51,
    *,
    values: Sequence[float | str] | None = None,
    back: bool = False,
    parameters: Mapping[str, float] | None = None,
    name: str | None = None,
    tolerance: float = 1e-6,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    max_steps: int | None = None,
    max_time: float | str | None = None,
    progress: Progress = None,
) -> Sweep:
    """Sweeps a parameter in steps by simulation, as `[[sweep]]` does in a study.

    At each value the trajectory starts from its last state at the previous value and is integrated until it has settled. A jump is reported
    where the settled motion is not the continuation of the previous one.

    Parameters
    ----------
    start : Model or Solution
        Where the sweep begins. From a solution, its state is taken. From a model, an attractor at the first value: a cycle of a forced
        model, otherwise an equilibrium.
    free : str
        Name of the parameter that varies.
    range : pair
        First and last value, in the unit of the model; their order is the direction. It may be left out if `values` is given.
    count : int
        Number of values, the ends included.
    values : sequence, optional
        Values in the order in which they are visited, instead of `range` and `count`.
    back : bool
        Return to the first value after the last one. A hysteresis loop is one call: ``foldline.sweep(model, "omega", (1, 2), back=True)``.
    parameters : mapping, optional
        Values that replace those of the start.
    name : str, optional
        Name of the sweep.
    tolerance : float
        Relative tolerance with which jumps are checked, and with which the start is found; from 1e-10 to 1e-4.
    out, jobs, resume, max_steps, max_time, progress
        As for `run`. A sweep waits at each value for the one before, so it uses one thread. One that was interrupted starts again.

    Returns
    -------
    Sweep
        Columns of shape (responses,), `jumps`, `legs`, `plot` and `to_pandas`. It ends early where the motion escapes.

    Raises
    ------
    ArgumentError, InputError
        As for `follow`.
    NoSolution
        If nothing was found to start from.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, parameters={"h": -1.0})
    >>> foldline.sweep(model.settle([-1.3]), "h", (-1, 1), 9, back=True)
    <sweep sweep of h: 17 values of h, -1 → 1 → -1; jumps: 0.25 → 0.5; -0.25 → -0.5>
    """
    if not isinstance(start, Model):
        check_solution(start, call_of("sweep", free, range))
    model = start if isinstance(start, Model) else start.model
    check_free(free, model, "foldline.sweep(start, {}, (0.5, 4))")
    check_parameters("parameters", parameters, model)
    steps = visited(free, "foldline.sweep(start", range, count, values, back, ordered=False)
    own = name or f"sweep of {free}"
    fixed = {key: end(key, value) for key, value in (parameters or {}).items()}
    seed: dict[str, Any] = {"name": START}
    given = None
    if isinstance(start, Solution):
        given = start
        seed["state"] = dict(zip(model.states, start.state.tolist(), strict=True))
        seed["parameters"] = {**start.parameters, **fixed}
    else:
        seed["attractor"] = "cycle" if model.forced else "equilibrium"
        seed["parameters"] = {**fixed, free: steps["range"][0] if "range" in steps else steps["values"][0]}
    item = {"name": own, "from": START, "free": free, **steps}
    options: dict[str, Any] = {"given": given, "out": out, "jobs": jobs, "resume": resume, "progress": progress}
    found = _found(model, own, tolerance, (max_steps, max_time), {"seed": [seed], "sweep": [item]}, options)
    assert isinstance(found, Sweep)
    return found


def survey(
    model: Model,
    free: str,
    range: Range | None = None,
    count: int = 25,
    *,
    values: Sequence[float | str] | None = None,
    starts: int = 64,
    random: int = 1,
    parameters: Mapping[str, float] | None = None,
    name: str | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    max_steps: int | None = None,
    max_time: float | str | None = None,
    progress: Progress = None,
) -> Survey:
    """Finds the attractors and their basin fractions at values of a parameter by simulation, as `[[survey]]` does in a study.

    At each value, initial states are drawn from the ranges of the states and integrated until they have settled. A survey only integrates
    in time, so it finds the attractors independently of the branches.

    Parameters
    ----------
    model : Model
        Its states need a `range`, from which initial states are drawn.
    free : str
        Name of the parameter that varies.
    range : pair
        Smallest and largest value, in the unit of the model. It may be left out if `values` is given.
    count : int
        Number of values, the ends included.
    values : sequence, optional
        Values instead of `range` and `count`.
    starts : int
        Number of initial states at each value.
    random : int
        Seed of the random numbers; the same seed gives the same initial states.
    parameters : mapping, optional
        Values that replace those of the model.
    name : str, optional
        Name of the survey.
    out, jobs, resume, max_steps, max_time, progress
        As for `run`. A survey that was interrupted starts again.

    Returns
    -------
    Survey
        Columns of shape (responses,), one response for each motion at each value; `share`, `at`, `plot` and `to_pandas`.

    Raises
    ------
    ArgumentError, InputError
        As for `follow`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": 0.0})
    >>> foldline.survey(model, "h", (-1, 1), 3, starts=16)
    <survey survey of h: 3 values of h, -1 … 1; 4 × equilibrium>
    """
    check_model(model, call_of("survey", free, range))
    check_free(free, model, "foldline.survey(model, {}, (0.5, 4))")
    check_parameters("parameters", parameters, model)
    steps = visited(free, "foldline.survey(model", range, count, values, back=False, ordered=True)
    own = name or f"survey of {free}"
    fixed = {key: end(key, value) for key, value in (parameters or {}).items()}
    item = {"name": own, "parameters": fixed or None, "free": free, **steps, "starts": whole("starts", starts),
            "random": whole("random", random, 0)}  # fmt: skip
    options: dict[str, Any] = {"out": out, "jobs": jobs, "resume": resume, "progress": progress}
    found = _found(model, own, 1e-6, (max_steps, max_time), {"survey": [item]}, options)
    assert isinstance(found, Survey)
    return found


def visited(free: str, call: str, range: Any, count: Any, values: Any, back: bool, ordered: bool) -> dict[str, Any]:
    """Returns the values to visit, as a study states them."""
    if values is not None:
        if range is not None:
            raise ArgumentError(f"both a range and values are given\n  help: {call}, {free!r}, values=[1.0, 1.5, 2.0])")
        if isinstance(values, (str, Mapping)) or not hasattr(values, "__len__"):
            raise ArgumentError(f"values must be a list of numbers\n  help: {call}, {free!r}, values=[1.0, 1.5, 2.0])")
        stated = [end("values", own) for own in values]
        finite("values", [own for own in stated if not isinstance(own, str)])
        if not stated:
            raise InputError("the list of values is empty\n  help: at least one value")
        return {"values": [*stated, *stated[-2::-1]] if back else stated}
    pair = check_range(range, f'{call}, "{free}", {{}})', f"the range of `{free}` is missing", ordered)
    number = whole("count", count, 2)
    if pair is None or not back:
        return {"range": pair, "count": number}
    there = between(pair, number)
    return {"values": [*there, *there[-2::-1]]}


def between(pair: Sequence[float | str], count: int) -> list[Any]:
    """Returns equally spaced values from the first to the last, in the unit of both."""
    parts = [re.fullmatch(r"\s*([-+\d.eE]+)\s*(\S.*?)?\s*", str(own)) for own in pair]
    units = [None if part is None else part[2] for part in parts]
    if None in parts or units[0] != units[1]:
        raise InputError(f"the ends of the range carry different units: {pair[0]!r} and {pair[1]!r}\n  help: the same unit for both")
    first, last = (float(part[1]) for part in parts if part is not None)
    spaced = np.linspace(first, last, count).tolist()
    return [own if units[0] is None else f"{own!r} {units[0]}" for own in spaced]


def _found(
    model: Model, name: str, tolerance: float, limits: tuple[Any, Any], tables: Mapping[str, Any], options: Mapping[str, Any]
) -> Responses:
    """Runs a study and returns its survey or sweep."""
    steps, time = limits
    head: dict[str, Any] = {"tolerance": tolerable(tolerance)}
    head.update({} if steps is None else {"max-steps": whole("max_steps", steps)})
    head.update({} if time is None else {"max-time": end("max_time", time)})
    diagram = carried_out(parsed({**head, **tables}, model), Diagram, model, **options)
    if name not in diagram.responses:
        told = "; ".join(dict.fromkeys([*diagram.short, *(note for _, note in diagram.notes)]))
        raise NoSolution(told or f"{name} has no responses")
    return diagram.responses[name]

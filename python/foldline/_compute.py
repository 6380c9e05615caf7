"""What is computed: studies, and the questions that become studies.

Everything here is written as a study and read by the reader of study files, so that names, defaults and mistakes are those of the
command line, and everything can be saved as a run.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

from . import _native
from ._arrays import whole
from ._branch import Branch, SpecialPoint
from ._diagram import Diagram, Homotopy
from ._errors import InputError, NoSolution
from ._model import Model
from ._progress import Progress
from ._solution import Solution
from ._studies import (
    RESCUED,
    START,
    Path,
    Range,
    begun,
    branch_of,
    carried_out,
    check_ordinary,
    check_solution,
    cleaned,
    going_on,
    parsed,
    study_from,
    text_of,
)


def rescued() -> Any:
    """What the last computation that Ctrl-C ended had found until then, or None."""
    return RESCUED[-1] if RESCUED else None


def run(
    study: Path | Mapping[str, Any],
    model: Model | None = None,
    *,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    max_steps: int | None = None,
    max_time: float | str | None = None,
    progress: Progress = None,
) -> Diagram:
    """Runs a study.

    Parameters
    ----------
    study : path or mapping
        A study file, or the same tables as a dictionary: ``dict(seed=[dict(...)], branch=[dict(...)])``.
    model : Model, optional
        Instead of the one that the study names; a dictionary needs one.
    out : path, optional
        Folder for the run, to which every point is written as it is accepted; one that has a run in it already is refused. By default
        nothing is written, and `Diagram.save` does that later.
    jobs : int, optional
        How many branches are followed at a time; by default as many as there are processors.
    resume : bool
        Go on with the run in `out`.
    max_steps, max_time : optional
        Integration steps, and time, after which a trajectory counts as unsettled; they replace those of the study. A time may have a
        unit: ``"20 ms"``.
    progress : bool or callable, optional
        Whether a bar is shown; by default in terminals and notebooks where tqdm is installed. A function is called with the number of
        points, of special points, and the place of the last one.

    Returns
    -------
    Diagram

    Warns
    -----
    EndedShort
        Where some branch ended before it got to where it was asked to go.

    Raises
    ------
    InputError
        With every mistake in the study, its place and what would be right.
    Interrupted
        After Ctrl-C, with what there is; the second Ctrl-C does not wait for the next point.
    """
    if isinstance(study, Mapping):
        if model is None:
            raise InputError("a study given as a dictionary needs a model\n  help: foldline.run(study, model)")
        own = parsed(dict(study), model)
    elif model is None:
        own = _native.Study.read(os.fspath(study))
    else:
        own = _native.Study.parse(text_of(study), os.fspath(study), model._native)
    own = own.limited(None if max_steps is None else whole("max_steps", max_steps), None if max_time is None else str(max_time))
    return carried_out(own, Diagram, model, out=out, jobs=jobs, resume=resume, progress=progress)


def open(folder: Path) -> Diagram:
    """The run in a folder, which may still be growing.

    Parameters
    ----------
    folder : path
        What `foldline run`, `out=` or `save` wrote.

    Returns
    -------
    Diagram
    """
    native = _native.Diagram.load(os.fspath(folder))
    return Diagram(native, folder=os.fspath(folder))


def follow(
    start: Solution,
    free: str,
    range: Range | None = None,
    *,
    until: float | None = None,
    switch: Mapping[str, int] | None = None,
    mark: Mapping[str, Any] | None = None,
    stop: Mapping[str, Any] | None = None,
    max_points: int = 10_000,
    name: str | None = None,
    tolerance: float = 1e-6,
    degree: int = 4,
    out: Path | None = None,
    jobs: int | None = None,
    progress: Progress = None,
) -> Branch:
    """Follows a branch of solutions in a parameter: what `[[branch]]` means in a study.

    Parameters
    ----------
    start : Solution
        From `Model.settle`, `Model.attractors`, or a point of another branch.
    free : str
        The parameter that varies.
    range : pair, optional
        Smallest and largest value; the branch is followed from its start to both sides until it leaves the range, closes on itself or
        joins another branch.
    until : float, optional
        Follow only towards this value and stop there; alone it makes the way from the start to it the range.
    switch : mapping, optional
        At which special points to branch off, and how deep: ``{"hopf": 1, "period-doubling": 2}``; ``{"hopf-2": 1}`` means the second
        Hopf point only. What is found is in `Branch.switched` and `Branch.diagram`.
    mark, stop : mapping, optional
        Values of quantities to locate on the way, or to stop at: ``{"Omega": [4, 5], "r_max": 2}``.
    max_points : int
        Limit on the number of points of each side.
    name : str, optional
    tolerance : float
        The one relative tolerance, from 1e-10 to 1e-4.
    degree : int
        Of the collocation polynomials, 2 to 7.
    out, jobs, progress
        As for `run`.

    Returns
    -------
    Branch

    Raises
    ------
    NoSolution
        Where the branch does not begin; the message says why.
    InputError, Interrupted
        As for `run`. After Ctrl-C the branch is in `partial`.
    """
    check_solution(start)
    own = name or f"{start.family} over {free}"
    item = {"name": own, "from": START, "free": free, "range": range, "until": until, "switch": switch, "mark": mark,
            "stop": stop, "max-points": max_points}  # fmt: skip
    study = study_from(start, tolerance, degree, branch=[cleaned(item)])
    return branch_of(study, start, own, out=out, jobs=jobs, progress=progress)


def switched(branch: Branch, point: SpecialPoint, depth: int, own: Mapping[str, Any], **options: Any) -> Branch:
    """The branch that leaves another one at a special point."""
    if not isinstance(point, SpecialPoint) or point.branch.name != branch.name:
        raise InputError(f"{point!r} is not a special point of {branch.name}\n  help: one of branch.special")
    check_ordinary(branch, "switched from")
    name = f"{branch.name}/{point.kind}-{point.number}"
    study, start = going_on(branch, {**own, "switch": {f"{point.kind}-{point.number}": depth}})
    diagram = carried_out(study, Diagram, branch.diagram.model, given=start, earlier=branch, of=name, **options)
    if name not in diagram:
        about = [note for whose, note in diagram.notes if whose == branch.name]
        raise NoSolution("\n".join(about) or f"no branch leaves {branch.name} at this {point.kind}")
    return diagram[name]


def hold(
    point: SpecialPoint,
    free: str,
    range: Range | None = None,
    *,
    until: float | None = None,
    branch_range: Range | None = None,
    max_points: int = 10_000,
    name: str | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    progress: Progress = None,
) -> Branch:
    """Follows a special point in a second parameter: what `[[curve]]` means in a study.

    Parameters
    ----------
    point : SpecialPoint
        A fold, Hopf, period-doubling or torus point.
    free : str
        The second parameter, another one than that of the branch.
    range : pair, optional
        Smallest and largest value of it; the curve is followed to both sides.
    until : float, optional
        Follow only towards this value and stop there; alone it makes the way from the start to it the range.
    branch_range : pair, optional
        Of the parameter of the branch; by default the range of the branch.
    max_points : int
        Limit on the number of points of each side.
    name : str, optional
    out, jobs, progress
        As for `run`.

    Returns
    -------
    Branch
        With `held`, and points of codimension two among its special points.
    """
    if not isinstance(point, SpecialPoint):
        raise InputError(f"{point!r} is not a special point\n  help: one of branch.special")
    branch = point.branch
    check_ordinary(branch, "held on")
    own = name or f"{point.kind} of {branch.name} over {free}"
    options: dict[str, Any] = {"out": out, "jobs": jobs, "progress": progress}
    curve = {"name": own, "hold": point.kind, "of": branch.name, "near": point.value, "free": free, "range": range,
             "branch-range": branch_range, "until": until, "max-points": max_points}  # fmt: skip
    study, start = going_on(branch, {}, curve=[cleaned(curve)])
    diagram = carried_out(study, Diagram, branch.diagram.model, given=start, earlier=branch, of=own, **options)
    return begun(diagram, own)


def homotopy(
    start: Solution,
    to: Mapping[str, float],
    via: str,
    range: Range,
    *,
    max_points: int = 10_000,
    name: str = "homotopy",
    tolerance: float = 1e-6,
    degree: int = 4,
    out: Path | None = None,
    jobs: int | None = None,
    progress: Progress = None,
) -> Homotopy:
    """Brings a family to other parameter values, by whatever route gets through: what `[[homotopy]]` means in a study.

    Parameters
    ----------
    start : Solution
    to : mapping
        The parameters that change together, with their values at the goal.
    via : str
        The parameter in which the family may be moved on the way; none of those in `to`.
    range : pair
        Smallest and largest value of that parameter.
    max_points : int
        Limit on the number of points of each run.
    name : str
    tolerance, degree
        As for `follow`.
    out, jobs, progress
        As for `run`.

    Returns
    -------
    Homotopy
        `arrived`, `end` (the solution at the goal), `route` (in sentences), and the branches on the way.
    """
    check_solution(start)
    item = {"name": name, "from": START, "to": dict(to), "via": via, "range": range, "max-points": max_points}
    study = study_from(start, tolerance, degree, homotopy=[cleaned(item)])
    made: Callable[..., Diagram] = Homotopy
    found = carried_out(study, made, start.model, given=start, out=out, jobs=jobs, progress=progress)
    assert isinstance(found, Homotopy)
    found.name = name
    return found


def explore(
    model: Model,
    free: str,
    range: Range,
    *,
    parameters: Mapping[str, float] | None = None,
    connect: Mapping[str, Range] | None = None,
    values: int = 15,
    samples: int = 64,
    seed: int = 1,
    budget: int = 100_000,
    doublings: int | None = None,
    tolerance: float = 1e-6,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    max_steps: int | None = None,
    max_time: float | str | None = None,
    progress: Progress = None,
) -> Diagram:
    """Finds the whole diagram of a model in a range of a parameter, without being told where anything is.

    Parameters
    ----------
    model : Model
    free : str
        The parameter that varies.
    range : pair
        Its smallest and largest value.
    parameters : mapping, optional
        Values that replace those of the model.
    connect : mapping, optional
        A second parameter and its range, in which folds are followed to isolated branches: ``{"kappa": (0, 1)}``.
    values : int
        At how many values of the parameter attractors and equilibria are looked for.
    samples : int
        How many initial states are sampled at each.
    seed : int
        Seed of the random numbers.
    budget : int
        No branch is begun once this many points are accepted.
    doublings : int, optional
        How many levels of period doubling are followed; by default 2.
    tolerance : float
        The one relative tolerance.
    out, jobs, resume, max_steps, max_time, progress
        As for `run`.

    Returns
    -------
    Diagram
    """
    item: dict[str, Any] = {"name": model.name, "parameters": dict(parameters) if parameters else None, "free": free, "range": range,
            "values": values, "samples": samples, "random": seed, "connect": dict(connect) if connect else None,
            "budget": budget}  # fmt: skip
    if doublings is not None:
        item["switch"] = {"hopf": 4, "branch-point": 4, "period-doubling": doublings}
    own = {"tolerance": tolerance, "max-steps": max_steps, "max-time": max_time, "explore": [cleaned(item)]}
    study = parsed({key: value for key, value in own.items() if value is not None}, model)
    return carried_out(study, Diagram, model, out=out, jobs=jobs, resume=resume, progress=progress)

"""What is computed: studies, and the questions that become studies.

Everything here is written as a study and read by the reader of study files, so that names, defaults and mistakes are those of the
command line, and everything can be saved as a run.
"""

from __future__ import annotations

import builtins
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _native, _write
from ._arrays import whole
from ._branch import Branch, SpecialPoint, native_only
from ._diagram import Diagram, Homotopy
from ._errors import EndedShort, InputError, Interrupted, NoSolution
from ._model import Model
from ._progress import Progress, shown
from ._solution import Solution

Path = str | os.PathLike[str]
Range = Sequence[float]

#: What the seed is called at which something starts.
_START = "the given solution"

_rescued: list[Any] = []


def rescued() -> Any:
    """What the last computation that Ctrl-C ended had found until then, or None."""
    return _rescued[-1] if _rescued else None


def run(
    study: Path | Mapping[str, Any],
    model: Model | None = None,
    *,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
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
            raise InputError("a study that is a dictionary names no model\n  help: foldline.run(study, model)")
        own = _parsed(dict(study), model)
    elif model is None:
        own = _native.Study.read(os.fspath(study))
    else:
        own = _native.Study.parse(_text(study), os.fspath(study), model._native)
    return _carried_out(own, Diagram, model, out=out, jobs=jobs, resume=resume, progress=progress)


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
    max_points: int = 5000,
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
    _is_solution(start)
    own = name or f"{start.family} over {free}"
    item = {"name": own, "from": _START, "free": free, "range": range, "until": until, "switch": switch, "mark": mark,
            "stop": stop, "max-points": max_points}  # fmt: skip
    study = _study(start, tolerance, degree, branch=[_cleaned(item)])
    return _branch(study, start, own, out=out, jobs=jobs, progress=progress)


def switched(branch: Branch, point: SpecialPoint, depth: int, options: dict[str, Any]) -> Branch:
    """The branch that leaves another one at a special point."""
    if not isinstance(point, SpecialPoint) or point.branch.name != branch.name:
        raise InputError(f"{point!r} is no special point of {branch.name}\n  help: one of branch.special")
    _ordinary(branch, "switched from")
    name = f"{branch.name}/{point.kind}-{point.number}"
    study, start = _going_on(branch, options, switch={f"{point.kind}-{point.number}": depth})
    diagram = _carried_out(study, Diagram, branch.diagram.model, given=start, earlier=branch, of=name, **options)
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
    max_points: int = 5000,
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
        raise InputError(f"{point!r} is no special point\n  help: one of branch.special")
    branch = point.branch
    _ordinary(branch, "held on")
    own = name or f"{point.kind} of {branch.name} over {free}"
    options: dict[str, Any] = {"out": out, "jobs": jobs, "progress": progress}
    curve = {"name": own, "hold": point.kind, "of": branch.name, "near": point.value, "free": free, "range": range,
             "branch-range": branch_range, "until": until, "max-points": max_points}  # fmt: skip
    study, start = _going_on(branch, options, curve=[_cleaned(curve)])
    diagram = _carried_out(study, Diagram, branch.diagram.model, given=start, earlier=branch, of=own, **options)
    return _begun(diagram, own)


def homotopy(
    start: Solution,
    to: Mapping[str, float],
    via: str,
    range: Range,
    *,
    max_points: int = 5000,
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
    _is_solution(start)
    item = {"name": name, "from": _START, "to": dict(to), "via": via, "range": range, "max-points": max_points}
    study = _study(start, tolerance, degree, homotopy=[_cleaned(item)])
    made: Callable[..., Diagram] = Homotopy
    found = _carried_out(study, made, start.model, given=start, out=out, jobs=jobs, progress=progress)
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
    out, jobs, resume, progress
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
    study = _parsed({"tolerance": tolerance, "explore": [_cleaned(item)]}, model)
    return _carried_out(study, Diagram, model, out=out, jobs=jobs, resume=resume, progress=progress)


def _text(study: Path) -> str:
    try:
        with builtins.open(study, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        cure = "check the spelling of the path; relative paths start at the current folder"
        raise InputError(f"the study file {os.fspath(study)} cannot be read: {error}\n  help: {cure}") from error


def _depth() -> int:
    """How many calls below the user's code the caller is."""
    inner = os.path.dirname(os.path.abspath(__file__))
    frame, depth = sys._getframe(1).f_back, 2
    while frame is not None and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == inner:
        frame, depth = frame.f_back, depth + 1
    return depth


# How a question becomes a study.


def _cleaned(item: Mapping[str, Any]) -> dict[str, Any]:
    """Without what was not said; names with hyphens, as files have them; numbers, where files have numbers."""
    cleaned = {key: value for key, value in item.items() if value is not None}
    for key in ("range", "branch-range"):
        if key in cleaned:
            cleaned[key] = [float(end) for end in cleaned[key]]
    if "switch" in cleaned:
        cleaned["switch"] = {str(kind).replace("_", "-"): depth for kind, depth in cleaned["switch"].items()}
    if "connect" in cleaned:
        cleaned["connect"] = {name: [float(end) for end in ends] for name, ends in cleaned["connect"].items()}
    return cleaned


def _is_solution(start: Any) -> None:
    if not isinstance(start, Solution):
        cure = "model.settle(...), one of model.attractors(), or a point of a branch, such as branch[-1]"
        raise InputError(f"{start!r} is no solution to start from\n  help: {cure}")


def _ordinary(branch: Branch, what: str) -> None:
    if branch.held is not None or branch.diagram._native.study().is_leg(branch.name):
        noun = "curve in two parameters" if branch.held is not None else "run of a homotopy"
        raise InputError(f"{branch.name} is a {noun}, which cannot be {what}\n  help: follow a branch from one of its points")


def _parsed(tables: dict[str, Any], model: Model) -> _native.Study:
    text = _write.study({"model": model._native.file, **{k: v for k, v in tables.items() if k != "model"}})
    return _native.Study.parse(text, "<study>", model._native)


def _study(start: Solution, tolerance: float, degree: int, **items: Any) -> _native.Study:
    """A study with one seed, whose solution is known."""
    state = dict(zip(start.model.states, start.state.tolist(), strict=True))
    seed = {"name": _START, "state": state, "parameters": start.parameters}
    return _parsed({"tolerance": float(tolerance), "degree": degree, "seed": [seed], **items}, start.model)


def _going_on(branch: Branch, options: dict[str, Any], **items: Any) -> tuple[_native.Study, Solution]:
    """A study that has a finished branch already."""
    own = branch.diagram._native.study()
    start = branch[int((branch.position == 0).argmax())]
    span = options.pop("range", None) or own.range_of(branch.name)
    if span is None:
        span = (float(branch[branch.free].min()), float(branch[branch.free].max()))
    item = {"name": branch.name, "from": _START, "free": branch.free, "range": span, "switch": items.pop("switch", None)}
    item.update({key.replace("_", "-"): options.pop(key) for key in ("max_points", "mark", "stop") if key in options})
    return _study(start, own.tolerance, own.degree, branch=[_cleaned(item)], **items), start


def _branch(study: _native.Study, start: Solution, name: str, **options: Any) -> Branch:
    return _begun(_carried_out(study, Diagram, start.model, given=start, of=name, **options), name)


def _begun(diagram: Diagram, name: str) -> Branch:
    if name not in diagram or len(diagram[name]) == 0:
        ends = list(dict.fromkeys(diagram[name].ends)) if name in diagram else diagram.short
        raise NoSolution("; ".join(ends))
    return diagram[name]


def _carried_out(
    study: _native.Study,
    made: Callable[..., Diagram],
    model: Model | None,
    *,
    given: Solution | None = None,
    earlier: Branch | None = None,
    of: str | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    progress: Progress = None,
) -> Diagram:
    folder = None if out is None else os.fspath(out)
    if jobs is not None:
        whole("jobs", jobs)
    if resume and folder is None:
        raise InputError('resume=True goes on with a run in a folder, and none is given\n  help: out="runs/study"')
    known = None if earlier is None else native_only(earlier)
    seeds = {} if given is None else {_START: given._native}
    with shown(progress) as show:
        native, short, interrupt = _native.run(study, seeds, known, folder, jobs, resume, show)
    diagram = made(native if native is not None else lambda: _native.Diagram.load(folder or ""), model, folder)
    if interrupt is not None:
        if not isinstance(interrupt, KeyboardInterrupt):
            raise interrupt
        partial = diagram[of] if of is not None and of in diagram else diagram
        _rescued[:] = [partial]
        raise Interrupted(partial) from None
    # That a branch ended short from which another one is switched to is known already.
    known_short = f"{earlier.name}:" if earlier is not None else "\0"
    for line in short:
        if not line.startswith(known_short):
            warnings.warn(line, EndedShort, stacklevel=_depth())
    return diagram

"""Computations: studies, and single calls that are turned into studies.

Every call is written as a study and read by the reader of study files. Names, defaults and messages are therefore those of the
command line, and every result can be saved as a run.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from . import _native
from ._arguments import (
    call_of,
    check_free,
    check_frees,
    check_marks,
    check_model,
    check_names,
    check_parameters,
    check_point,
    check_range,
    check_solution,
    check_switch,
    check_within,
    described,
    end,
    is_model,
    wrong_kind,
)
from ._arrays import tolerable, whole
from ._branch import Branch, SpecialPoint
from ._diagram import Diagram, Homotopy
from ._errors import ArgumentError, InputError, NoSolution
from ._model import Model, model
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
    cleaned,
    going_on,
    parsed,
    study_from,
)
from ._texts import is_model_text, is_text, text_of, with_model


def rescued() -> Any:
    """Returns the partial result of the last computation that Ctrl-C ended.

    Returns
    -------
    Diagram, Branch or None
        `None` if no computation was interrupted in this session.

    Examples
    --------
    >>> import foldline
    >>> foldline.rescued() is None
    True
    """
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
    study : path, str or mapping
        A study in one of three forms.

        * The path of a study file: a `pathlib.Path`, or a string without line breaks such as ``"study.toml"``. The file names its model.
        * The text of a study: a string with line breaks. Its `model` is a path relative to the current folder, unless `model` is given.
        * The tables of a study as a dictionary: ``dict(seed=[dict(...)], branch=[dict(...)])``. Its key `model` is a `Model` or the
          path of a model file, unless `model` is given.
    model : Model, optional
        Replaces the model that the study names.
    out : path, optional
        Folder for the run. Every point is written there as it is accepted. A folder that already holds a run is refused, unless
        `resume` is set. By default nothing is written; `Diagram.save` can do that later.
    jobs : int, optional
        Number of branches followed at a time; by default the number of processors.
    resume : bool
        Continue the run in `out`, whatever ended it: Ctrl-C, a kill, a power failure. The study and the model must be the same as before.
        If the folder holds no run yet, one is begun. Branches continue from their last stored points; an unfinished survey or
        sweep starts again.
    max_steps, max_time : optional
        Number of integration steps, and time in the unit of the model, after which a trajectory counts as unsettled. They replace those
        of the study. A time may carry a unit: ``"20 ms"``.
    progress : bool or callable, optional
        True shows a progress bar, False shows none. By default a bar is shown in terminals and notebooks if tqdm is installed. A function
        is called a few times a second with the number of points, the number of special points, and the place of the last point.

    Returns
    -------
    Diagram

    Warns
    -----
    EndedShort
        If a branch ended before it reached the end of its range.

    Raises
    ------
    ArgumentError
        If `study` is none of the three; the message shows the right call.
    InputError
        With every mistake in the study: its place and a remedy. Also if a file is missing.
    RunFileError
        If `out` holds a run already, cannot be written, or holds the run of another study.
    Interrupted
        After Ctrl-C, with what was found so far in `partial`. A second Ctrl-C does not wait for the next point.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> diagram = foldline.run('''
    ... [[seed]]
    ... name = "rest"
    ... state = { x = 1.0 }
    ...
    ... [[branch]]
    ... name = "steady"
    ... from = "rest"
    ... free = "mu"
    ... range = [-1, 2]
    ... ''', model)
    >>> [(point.kind, round(point["mu"], 6)) for point in diagram["steady"].special]
    [('fold', 0.0)]
    """
    own = _study(study, model)
    steps = None if max_steps is None else whole("max_steps", max_steps)
    own = own.limited(steps, None if max_time is None else str(end("max_time", max_time)))
    used = model if model is not None else _named(study)
    return carried_out(own, Diagram, used, out=out, jobs=jobs, resume=resume, progress=progress)


def _named(study: Any) -> Model | None:
    """Returns the model object in a dictionary."""
    own = study.get("model") if isinstance(study, Mapping) else None
    return own if is_model(own) else None


def _study(study: Any, given: Any) -> _native.Study:
    """Returns the study given by the argument of `run`."""
    if given is not None:
        check_model(given, "foldline.run(study, {})")
    if isinstance(study, Mapping):
        own = given if given is not None else study.get("model")
        if isinstance(own, (str, os.PathLike)):
            own = model(own)
        if own is None:
            cure = "foldline.run(study, model), or a key `model` with a model or the path of a model file"
            raise InputError(f"a study given as a dictionary needs a model\n  help: {cure}")
        check_model(own, 'foldline.run({{**study, "model": {}}})')
        return parsed(dict(study), own)
    if not isinstance(study, (str, os.PathLike)):
        raise wrong_kind("a study must be a path, a text or a dictionary", study, _instead(study))
    text, file = (str(study), "<study>") if is_text(study) else (text_of(study, "study"), os.fspath(study))
    if given is not None:
        return _native.Study.parse(with_model(text, given._native.file), file, given._native)
    if is_model_text(text):
        shown = "foldline.model(text)" if file == "<study>" else f"foldline.model({file!r})"
        raise InputError(f"this is a model, not a study: it has states and nothing to compute\n  help: {shown}")
    return _native.Study.parse_text(text, file) if file == "<study>" else _native.Study.read(file)


def _instead(study: Any) -> str:
    what = described(study)
    if what == "a model":
        name = next(iter(study.parameters), "a")
        return f'to find its whole diagram, foldline.explore(model, "{name}", (0.5, 4)); to run a study, foldline.run("study.toml", model)'
    if what in ("a solution", "a special point"):
        name = next(iter(study.parameters), "a")
        return f'to follow a branch from it, foldline.follow(solution, "{name}", (0.5, 4))'
    return 'foldline.run("study.toml"), or foldline.run(dict(seed=[...], branch=[...]), model)'


def open(folder: Path) -> Diagram:
    """Opens the run in a folder, which may still be growing.

    Parameters
    ----------
    folder : path
        Folder that `foldline run`, `out=` or `save` wrote.

    Returns
    -------
    Diagram

    Raises
    ------
    RunFileError
        If there is no run in the folder, or it cannot be read.

    Examples
    --------
    >>> import foldline, tempfile
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2), out=folder)
    ...     again = foldline.open(folder)[branch.name]
    ...     bool((again["x"] == branch["x"]).all())
    True
    """
    if not isinstance(folder, (str, os.PathLike)):
        raise wrong_kind("the folder of a run is needed", folder, 'foldline.open("runs/study")')
    native = _native.Diagram.load(os.fspath(folder))
    return Diagram(native, folder=os.fspath(folder))


def follow(
    start: Solution,
    free: str | Sequence[str],
    range: Range | Mapping[str, Range] | None = None,
    *,
    hold: Mapping[str, Any] | Sequence[str] | None = None,
    until: float | str | None = None,
    switch: Mapping[str, int] | None = None,
    mark: Mapping[str, Any] | None = None,
    stop: Mapping[str, Any] | None = None,
    peaks: Sequence[str] | None = None,
    max_points: int = 10_000,
    name: str | None = None,
    tolerance: float = 1e-6,
    degree: int = 4,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    progress: Progress = None,
) -> Branch:
    """Follows a branch of solutions in one parameter, as `[[branch]]` does in a study.

    Parameters
    ----------
    start : Solution
        From `Model.settle` or `Model.attractors`, or a point of another branch. It is used as it is, stable or not.
    free : str or list of str
        Name of the parameter that varies; with `hold`, the names of one parameter more than there are held quantities. The first
        is the continuation parameter.
    range : pair, or mapping of pairs
        Smallest and largest value of that parameter, or of each free parameter: ``{"Omega": (0.5, 4), "epsilon": (0, 1)}``. The branch is followed from its start to both sides until it leaves the range,
        closes on itself or joins another branch. It may be left out if `until` is given. Numbers are in the unit of the model;
        ``"500 rpm"`` carries its own.
    hold : mapping or list of str, optional
        Quantities that keep a value along the branch: ``{"r_max": 2.0}``, or ``["period"]`` for the value at the start. From a start
        with another value, the further parameters are changed first.
    until : float or str, optional
        Follow only towards this value and stop there. Without `range`, the range extends from the start to this value.
    switch : mapping, optional
        Kinds of special points at which to branch off, and how many levels deep: ``{"hopf": 1, "period-doubling": 2}``. ``{"hopf-2": 1}``
        means the second Hopf point only. The branches found are in `Branch.switched` and `Branch.diagram`.
    mark, stop : mapping, optional
        Values of quantities to locate along the branch, or to stop at: ``{"Omega": [4, 5], "r_max": 2}``.
    peaks : list of str, optional
        Quantities whose largest and smallest values along the branch are located as special points of the kind ``peak``.
    max_points : int
        Largest number of points on each side of the start.
    name : str, optional
        Name of the branch; by default the solution type and the parameter.
    tolerance : float
        Relative tolerance, from 1e-10 to 1e-4.
    degree : int
        Degree of the collocation polynomials, 2 to 7.
    out, jobs, resume, progress
        As for `run`. To resume, repeat the call with ``resume=True``: the start must have the same state and parameters.

    Returns
    -------
    Branch

    Raises
    ------
    ArgumentError
        If `start` is not a solution, `range` is missing or not a pair, or a number is given as a string; the message shows the right call.
    InputError
        If the parameter is unknown, the range is reversed, empty or does not contain the start, or a value is not allowed.
    NoSolution
        If the branch cannot be started; the message says why.
    RunFileError
        As for `run`.
    Interrupted
        After Ctrl-C, with the branch so far in `partial`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> round(branch.special["fold"][0]["mu"], 6)
    0.0
    >>> bool(branch["mu"].max() == 2)
    True
    """
    listed = isinstance(free, Sequence) and not isinstance(free, str) and all(isinstance(own, str) for own in free)
    several = hold is not None or listed
    frees: list[Any] = check_frees(free, hold, start) if several else [free]
    first = frees[0]
    check_solution(start, call_of("follow", first, range))
    check_free(first, start.model, "foldline.follow(start, {}, (0.5, 4))")
    missing = f"the range of `{first}` is missing" if until is None else ""
    call = f'foldline.follow(start, "{first}", {{}})' if not several else f"foldline.follow(start, {frees!r}, {{}}, hold={hold!r})"
    ranges: Any = None
    if several and isinstance(range, Mapping):
        ranges = {own: check_range(pair, call) for own, pair in range.items()}
        check_within(start, first, ranges.get(first))
    else:
        ranges = check_range(range, call, missing)
        check_within(start, first, ranges)
    check_switch(switch)
    check_marks("mark", mark)
    check_marks("stop", stop)
    check_names("peaks", peaks)
    own = name or f"{start.family} over {' and '.join(frees)}"
    item = {"name": own, "from": START, "free": frees if several else first, "range": ranges, "hold": hold,
            "until": None if until is None else end("until", until), "switch": switch, "mark": mark, "stop": stop, "peaks": peaks,
            "max-points": whole("max_points", max_points)}  # fmt: skip
    study = study_from(start, tolerance, degree, branch=[cleaned(item)])
    return branch_of(study, start, own, out=out, jobs=jobs, resume=resume, progress=progress)


def switched(branch: Branch, point: SpecialPoint, depth: int, own: Mapping[str, Any], **options: Any) -> Branch:
    """Returns the branch that leaves another one at a special point."""
    check_point(point, "branch.switch({})", branch)
    check_ordinary(branch, "switched from")
    ends = check_range(own.get("range"), "branch.switch(point, range={})")
    check_marks("mark", own.get("mark"))
    check_marks("stop", own.get("stop"))
    whole("max_points", own.get("max-points", 1))
    name = f"{branch.name}/{point.kind}-{point.number}"
    study, start = going_on(branch, {**own, "range": ends, "switch": {f"{point.kind}-{point.number}": whole("depth", depth)}})
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
    until: float | str | None = None,
    branch_range: Range | None = None,
    also: Mapping[str, Range] | None = None,
    max_points: int = 10_000,
    name: str | None = None,
    out: Path | None = None,
    jobs: int | None = None,
    resume: bool = False,
    progress: Progress = None,
) -> Branch:
    """Continues a bifurcation point in two parameters, as `[[curve]]` does in a study.

    Parameters
    ----------
    point : SpecialPoint
        A fold, Hopf, period-doubling or torus point, or a branch point of equilibria.
    free : str
        Name of the second parameter. The parameter of the branch follows from it.
    range : pair
        Smallest and largest value of the second parameter. The curve is followed from the point to both sides. It may be left out if
        `until` is given.
    until : float or str, optional
        Follow only towards this value and stop there. Without `range`, the range extends from the point to this value.
    branch_range : pair, optional
        Range of the parameter of the branch within which the curve stays; by default the range of the branch.
    also : mapping, optional
        A third parameter and its range, as in `{"c": (-1, 1)}`: a branch point is followed in three parameters.
    max_points : int
        Largest number of points on each side of the point.
    name : str, optional
        Name of the curve.
    out, jobs, resume, progress
        As for `follow`.

    Returns
    -------
    Branch
        The bifurcation curve, with `held` set. Its special points are of codimension two.

    Raises
    ------
    ArgumentError, InputError
        As for `follow`.
    NoSolution
        If the curve cannot be started; the message says why.

    Examples
    --------
    >>> import foldline
    >>> cusp = foldline.model(equations={"x": "h + r*x - x^3"}, parameters={"h": 1.0, "r": 1.0})
    >>> branch = foldline.follow(cusp.settle([1.3]), "h", (-1, 1))
    >>> curve = foldline.hold(branch.special["fold"][0], "r", (-1, 2))
    >>> [point.kind for point in curve.special]
    ['cusp']
    """
    check_point(point, call_of("hold", free, range))
    branch = point.branch
    check_ordinary(branch, "continued in two parameters")
    check_free(free, point.model, "foldline.hold(point, {}, (0, 1))", [branch.free])
    missing = f"the range of `{free}` is missing" if until is None else ""
    ends = check_range(range, f'foldline.hold(point, "{free}", {{}})', missing)
    own = name or f"{point.kind} of {branch.name} over {free}"
    options: dict[str, Any] = {"out": out, "jobs": jobs, "resume": resume, "progress": progress}
    ranges = {
        key: check_range(pair, f'foldline.hold(point, "{free}", (0, 1), also={{"{key}": {{}}}})') for key, pair in (also or {}).items()
    }
    curve = {"name": own, "hold": point.kind, "of": branch.name, "near": point.value, "free": free, "range": ends, "also": ranges or None,
             "branch-range": check_range(branch_range, f'foldline.hold(point, "{free}", (0, 1), branch_range={{}})'),
             "until": None if until is None else end("until", until), "max-points": whole("max_points", max_points)}  # fmt: skip
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
    resume: bool = False,
    progress: Progress = None,
) -> Homotopy:
    """Carries a solution to new parameter values, finding a path and reporting it, as `[[homotopy]]` does in a study.

    Parameters
    ----------
    start : Solution
        The solution to be carried over.
    to : mapping
        Parameters that change together, with their target values.
    via : str
        Name of a further parameter in which the solution may be moved along the path; not one of those in `to`.
    range : pair
        Smallest and largest value of that parameter.
    max_points : int
        Largest number of points of each run.
    name : str
        Name of the homotopy; its branches are called ``name/1``, ``name/2``, …
    tolerance, degree
        As for `follow`.
    out, jobs, resume, progress
        As for `follow`.

    Returns
    -------
    Homotopy
        `arrived`, `end` (the solution at the target), `route` (in sentences), and the branches of the path.

    Raises
    ------
    ArgumentError, InputError
        As for `follow`.

    Examples
    --------
    >>> import foldline
    >>> cusp = foldline.model(equations={"x": "h + r*x - x^3"}, parameters={"h": 1.0, "r": 1.0})
    >>> found = foldline.homotopy(cusp.settle([1.3]), {"h": -1.0}, "r", (-1, 2))
    >>> found.arrived, found.end["h"]
    (True, -1.0)
    """
    check_solution(start, 'foldline.homotopy({}, {{"a": 1.0}}, "b", (0, 1))')
    if not isinstance(to, Mapping) or not to:
        raise wrong_kind("`to` must be a dictionary of parameters with their target values", to, '{"kappa": 1.0}')
    for target in to:
        check_free(target, start.model, f"foldline.homotopy(start, {{{{{{}}: 1.0}}}}, {via!r}, (0, 1))")
    check_free(via, start.model, "foldline.homotopy(start, to, {}, (0, 1))", list(to))
    missing = f"the range of `{via}` is missing"
    ends = check_range(range, f'foldline.homotopy(start, to, "{via}", {{}})', missing)
    targets = {target: end(target, value) for target, value in to.items()}
    points = whole("max_points", max_points)
    item = {"name": name, "from": START, "to": targets, "via": via, "range": ends, "max-points": points}
    study = study_from(start, tolerance, degree, homotopy=[cleaned(item)])
    made: Callable[..., Diagram] = Homotopy
    found = carried_out(study, made, start.model, given=start, out=out, jobs=jobs, resume=resume, progress=progress)
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
    """Finds the diagram of a model in a range of one parameter without starting solutions, as `[[explore]]` does in a study.

    Parameters
    ----------
    model : Model
        Its states need a `range`, from which initial states are drawn.
    free : str
        Name of the parameter that varies.
    range : pair
        Smallest and largest value of that parameter.
    parameters : mapping, optional
        Values that replace those of the model.
    connect : mapping, optional
        A second parameter and its range, in which folds are followed to isolated branches: ``{"kappa": (0, 1)}``.
    values : int
        Number of values of the parameter at which attractors and equilibria are sought.
    samples : int
        Number of initial states at each value.
    seed : int
        Seed of the random numbers.
    budget : int
        Number of accepted points beyond which no new branch is begun.
    doublings : int, optional
        Number of levels of period doubling that are followed; by default 2.
    tolerance : float
        Relative tolerance, from 1e-10 to 1e-4.
    out, jobs, resume, max_steps, max_time, progress
        As for `run`.

    Returns
    -------
    Diagram

    Raises
    ------
    ArgumentError, InputError
        As for `follow`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": 0.0})
    >>> diagram = foldline.explore(model, "h", (-1, 1), values=3, samples=8)
    >>> [(point.kind, round(point["h"], 4)) for point in diagram.special]
    [('fold', -0.3849), ('fold', 0.3849)]
    """
    check_model(model, call_of("explore", free, range))
    check_free(free, model, "foldline.explore(model, {}, (0.5, 4))")
    ends = check_range(range, f'foldline.explore(model, "{free}", {{}})', f"the range of `{free}` is missing")
    check_parameters("parameters", parameters, model)
    if connect is not None and (not isinstance(connect, Mapping) or len(connect) != 1):
        raise ArgumentError('connect must be a dictionary with one parameter and its range\n  help: connect={"kappa": (0, 1)}')
    for other, span in (connect or {}).items():
        check_free(other, model, "connect={{{}: (0, 1)}}", [free])
        check_range(span, f'connect={{{{"{other}": {{}}}}}}', f"the range of `{other}` is missing")
    fixed = {key: end(key, value) for key, value in (parameters or {}).items()}
    item: dict[str, Any] = {"name": model.name, "parameters": fixed or None, "free": free, "range": ends,
            "values": whole("values", values), "samples": whole("samples", samples), "random": whole("seed", seed, 0),
            "connect": dict(connect) if connect else None, "budget": whole("budget", budget)}  # fmt: skip
    if doublings is not None:
        item["switch"] = {"hopf": 4, "branch-point": 4, "period-doubling": whole("doublings", doublings, 0)}
    own = {
        "tolerance": tolerable(tolerance),
        "max-steps": None if max_steps is None else whole("max_steps", max_steps),
        "max-time": None if max_time is None else end("max_time", max_time),
        "explore": [cleaned(item)],
    }
    study = parsed({key: value for key, value in own.items() if value is not None}, model)
    return carried_out(study, Diagram, model, out=out, jobs=jobs, resume=resume, progress=progress)

"""Studies made from single calls, and their execution."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from typing import Any

from . import _native, _write
from ._arguments import end
from ._arrays import tolerable, whole
from ._branch import Branch, native_only
from ._diagram import Diagram
from ._errors import EndedShort, InputError, Interrupted, NoSolution
from ._model import Model
from ._progress import Progress, shown
from ._solution import Solution

Path = str | os.PathLike[str]
Range = Sequence[float | str]

#: Name of the seed for a given solution.
START = "the given solution"
#: Partial result of the last computation that was interrupted.
RESCUED: list[Any] = []
#: Receives what fell short in the computations of a case, in place of warnings.
HEARD: ContextVar[list[str] | None] = ContextVar("HEARD", default=None)


def _depth() -> int:
    """Number of calls between the user's code and the caller."""
    inner = os.path.dirname(os.path.abspath(__file__))
    frame, depth = sys._getframe(1).f_back, 2
    while frame is not None and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == inner:
        frame, depth = frame.f_back, depth + 1
    return depth


def cleaned(item: Mapping[str, Any]) -> dict[str, Any]:
    """Returns an item of a study without the keys not given, and with hyphens in kinds of special points, as in files."""
    kept = {key: value for key, value in item.items() if value is not None}
    for key in ("range", "branch-range", "also"):
        if isinstance(kept.get(key), Mapping):
            kept[key] = {name: [end("the range", own) for own in ends] for name, ends in kept[key].items()}
        elif key in kept:
            kept[key] = [end("the range", own) for own in kept[key]]
    if "switch" in kept:
        kept["switch"] = {str(kind).replace("_", "-"): depth for kind, depth in kept["switch"].items()}
    if "connect" in kept:
        kept["connect"] = {name: [end("the range", own) for own in ends] for name, ends in kept["connect"].items()}
    return kept


def check_ordinary(branch: Branch, what: str) -> None:
    if branch.held is not None or branch.diagram._native.study().is_leg(branch.name):
        noun = "two-parameter curve" if branch.held is not None else "leg of a homotopy"
        raise InputError(f"{branch.name} is a {noun}, which cannot be {what}\n  help: follow a branch from one of its points")


def parsed(tables: dict[str, Any], model: Model) -> _native.Study:
    text = _write.study({"model": model._native.file, **{k: v for k, v in tables.items() if k != "model"}})
    return _native.Study.parse(text, "<study>", model._native)


def study_from(start: Solution, tolerance: float, degree: int, **items: Any) -> _native.Study:
    """Returns a study with one seed, whose solution is known."""
    state = dict(zip(start.model.states, start.state.tolist(), strict=True))
    seed = {"name": START, "state": state, "parameters": start.parameters}
    return parsed({"tolerance": tolerable(tolerance), "degree": degree, "seed": [seed], **items}, start.model)


def going_on(branch: Branch, own: Mapping[str, Any], **items: Any) -> tuple[_native.Study, Solution]:
    """Returns a study that contains a finished branch, with new settings for it."""
    study = branch.diagram._native.study()
    start = branch[int((branch.position == 0).argmax())]
    span = own.get("range") or study.range_of(branch.name)
    if span is None:
        span = (float(branch[branch.free].min()), float(branch[branch.free].max()))
    item = {"name": branch.name, "from": START, "free": branch.free, **own, "range": span}
    return study_from(start, study.tolerance, study.degree, branch=[cleaned(item)], **items), start


def branch_of(study: _native.Study, start: Solution, name: str, **options: Any) -> Branch:
    return begun(carried_out(study, Diagram, start.model, given=start, of=name, **options), name)


def begun(diagram: Diagram, name: str) -> Branch:
    if name not in diagram or len(diagram[name]) == 0:
        ends = list(dict.fromkeys(diagram[name].ends)) if name in diagram else diagram.short
        raise NoSolution("; ".join(ends))
    return diagram[name]


def carried_out(
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
        raise InputError('resume=True continues a run in a folder, but no folder is given\n  help: out="runs/study"')
    known = None if earlier is None else native_only(earlier)
    seeds = {} if given is None else {START: given._native}
    with shown(progress) as show:
        native, short, interrupt = _native.run(study, seeds, known, folder, jobs, resume, show)
    diagram = made(native if native is not None else lambda: _native.Diagram.load(folder or ""), model, folder)
    if interrupt is not None:
        if not isinstance(interrupt, KeyboardInterrupt):
            raise interrupt
        partial = diagram[of] if of is not None and of in diagram else diagram
        RESCUED[:] = [partial]
        raise Interrupted(partial) from None
    # The branch switched from has already given its warning.
    known_short = f"{earlier.name}:" if earlier is not None else "\0"
    heard = HEARD.get()
    for line in short:
        if line.startswith(known_short):
            continue
        if heard is None:
            warnings.warn(line, EndedShort, stacklevel=_depth())
        else:
            heard.append(line)
    return diagram

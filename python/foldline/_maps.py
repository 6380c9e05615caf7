"""Maps over parameters: the same question at many parameter values, on one machine or a cluster."""

from __future__ import annotations

import importlib.util
import json
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from ._arguments import check_model, wrong_kind
from ._arrays import finite, limits, processors, tolerable, whole
from ._cells import Cell, Done, Job, repeatable
from ._dataset import assembled, category_of, library, only_category
from ._engines import Cluster, Threads, engine_of
from ._errors import ArgumentError, EndedShort, Error, InputError, Interrupted
from ._kept import Kept, digest
from ._layout import Layout, layout_of
from ._progress import _bar_of_cells, _watched
from ._questions import Limits, Question, Settled, question_of
from ._refining import Refined, refine
from ._solution import Solution
from ._studies import RESCUED, Path, _depth

if TYPE_CHECKING:
    import xarray

    from ._model import Model

#: A function called with the number of finished cells, of all cells, and the seconds that are probably left.
CellProgress = bool | Callable[[int, int, float], None] | None
#: If so many cells fail in one and the same unexpected way before any succeeds, the map ends.
HOPELESS = 10


def map(
    model: Model,
    over: Mapping[str, Sequence[float]] | Sequence[Mapping[str, float]],
    what: Any,
    *,
    client: Any = None,
    out: Path | None = None,
    jobs: int | None = None,
    refine: int = 0,
    by: str | None = None,
    start: Any = None,
    samples: int = 64,
    seed: int = 1,
    tolerance: float = 1e-6,
    max_steps: int | None = None,
    max_time: float | None = None,
    progress: CellProgress = None,
) -> xarray.Dataset:
    """Computes the same quantities at many parameter values, on all processors or on a cluster.

    Parameters
    ----------
    model : Model
        The model. Parameters that the map does not name keep the values of the model.
    over : mapping, or list of mappings
        A grid, ``{"zeta": [0.01, 0.02], "epsilon": np.linspace(0.2, 0.5, 31)}``: the dimensions of the result in this order. Or a list
        of cases, ``[{"zeta": 0.01, "epsilon": 0.3}, …]``, such as that of `latin_hypercube`: the result has the dimension `case`.
    what : str, list of str, study, function, or mapping of functions
        * ``"motions"``: which attractors exist, with their number, period and largest values, from `samples` initial states.
        * ``"shares"``: basin fractions with 95 % confidence intervals, from `samples` initial states.
        * ``["x_max", "period"]``: quantities of the motion that settles from `start`.
        * A study as for `run` (path, text, dictionary): the special points of all its branches, with errors. The values of the cell
          replace those that the study states for the parameters of the map.
        * A function of a `Case`: returns a number, a truth value, a text, a list of numbers, or a dictionary of these. Or a dictionary of
          functions.
    client : dask.distributed.Client, optional
        Computes on the workers of this client: a `LocalCluster`, or any cluster, such as one of SLURM by dask-jobqueue. By default the
        threads of this process.
    out : path, optional
        Folder to which each answer is written as it is computed. Repeating the call continues the map and computes no answer twice.
        A folder of another map is refused.
    jobs : int, optional
        Number of threads without a client; by default the number of processors.
    refine : int
        Number of times that the steps of a grid over one or two parameters are halved where the answer changes. The result is on the
        fine grid; cells between others that agree are not computed.
    by : str, optional
        Name of the value that decides: a text, a truth value or a whole number. By default ``motions``, ``points``, the kind of the
        settled motion, or the only text or truth value that a function returns.
    start : optional
        As for `Model.settle`: where to settle for quantities of a motion; by default a cycle of a forced model, otherwise an equilibrium.
    samples, seed
        Number of initial states, and seed of the random numbers, in every cell.
    tolerance, max_steps, max_time
        As for `Model.settle`. A study has its own.
    progress : bool or callable, optional
        As for `run`. A function is called with the number of finished cells, of all cells, and an estimate of the seconds left.

    Returns
    -------
    xarray.Dataset
        Over the parameters or `case`, and `motion` or `point` where there are several answers in a cell. A number that does not exist
        is NaN. `failure` says for each cell why it has no values, or is empty; `remark` says what fell short. ``to_netcdf`` and ``to_zarr`` save it.

    Warns
    -----
    EndedShort
        If cells have no values.

    Raises
    ------
    ArgumentError, InputError
        If an argument is of the wrong kind, a name is unknown, or a study has a mistake. Also if a client cannot be used.
    RunFileError
        If `out` holds another map, or cannot be written.
    Error
        If a function fails in the same unexpected way in each of the first ten cells.
    Interrupted
        After Ctrl-C, with the answers so far in `partial`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "a*x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"a": 1.0})
    >>> found = foldline.map(model, over={"a": [-1.0, 1.0, 4.0]}, what=["x_max"], start=[1.0])
    >>> found["x_max"].values.round(6).tolist()
    [0.0, 1.0, 2.0]
    >>> found = foldline.map(model, over={"a": [-1.0, 1.0]}, what=lambda case: len(case.attractors(samples=16)))
    >>> found["value"].values.tolist()
    [1, 2]
    """
    check_model(model, "foldline.map({}, over={{...}}, what='motions')")
    library()
    layout = layout_of(model, over)
    if by is not None and not refine:
        raise ArgumentError(f"by={by!r} has no effect without refine\n  help: refine=3, by={by!r}")
    if client is not None and jobs is not None:
        raise ArgumentError("both client and jobs are given\n  help: jobs is the number of threads without a client; a cluster has its own")
    if isinstance(start, Solution):
        start = start.state
    if start is not None and not isinstance(start, str):
        start = model.state(start).tolist()
    own = Limits(start, whole("samples", samples), whole("seed", seed, 0), tolerable(tolerance), *limits(max_steps, max_time))
    question = question_of(what, model, own, layout.names)
    if start is not None and not isinstance(question, Settled):
        raise ArgumentError(
            "start has no effect here\n  help: it is for quantities of a settled motion, what=['x_max']; a function can use case.settle(start)"
        )
    found: xarray.Dataset = mapped(
        model, layout, question, client=client, out=out, jobs=jobs, depth=whole("refine", refine, 0), by=by, progress=progress
    )  # fmt: skip
    return found


def mapped(
    model: Model,
    layout: Layout,
    question: Question,
    *,
    client: Any = None,
    out: Path | None = None,
    jobs: int | None = None,
    depth: int = 0,
    by: str | None = None,
    progress: CellProgress = None,
) -> Any:
    """Computes a map and returns its data set."""
    from . import __version__

    refined = Refined(layout, depth) if depth else None
    job = Job(model, layout.names, question)
    engine = engine_of(job, client, processors(jobs))
    parts = {"model": digest(model.text), "what": digest(question.identity()), "over": digest(layout.identity()), "version": __version__}
    head = {**parts, "name": model.name, "parameters": list(layout.names)}
    run = _Run(engine, None if out is None else Kept(os.fspath(out), head), len(layout.cells))
    category = ""
    filled = None
    with _cells_shown(progress) as run.show:
        try:
            run.compute(layout.cells)
            if refined is not None:
                category = by or question.category or only_category(run.answers[cell] for cell in layout.cells)
                filled = refine(refined, run.answers, lambda text: category_of(text, category), run.compute)
        except KeyboardInterrupt:
            partial = assembled(model, question, layout, run.answers, {**_about(model, parts), **run.attributes()})
            RESCUED[:] = [partial]
            raise Interrupted(partial) from None
        finally:
            run.close()
    attrs = {**_about(model, parts), **run.attributes()}
    if refined is not None:
        attrs |= {"refined": depth, "refined_by": category}
    run.complain()
    return assembled(model, question, refined.fine if refined else layout, run.answers, attrs, filled)


def _about(model: Model, parts: Mapping[str, str]) -> dict[str, str]:
    return {"model": model.name, "model_text": model.text, "foldline_version": parts["version"], "digest": digest(parts)}


class _Run:
    """A map in progress: its answers, the folder, the time."""

    def __init__(self, engine: Threads | Cluster, kept: Kept | None, total: int) -> None:
        self.engine = engine
        self.kept = kept
        self.answers: dict[Cell, str] = dict(kept.known) if kept else {}
        self.used: dict[Cell, None] = {}
        self.total = total
        self.show: Callable[[int, int, float], None] | None = None
        self._elapsed, self._computing, self._new = 0.0, 0.0, 0
        self._hopeless: str | None = ""

    def compute(self, cells: Sequence[Cell]) -> None:
        """Computes those of the cells that have no answer yet."""
        self.used.update(dict.fromkeys(cells))
        self.total = max(self.total, len(self.used))
        missing = [cell for cell in dict.fromkeys(cells) if cell not in self.answers]
        done, start, before = len(self.used) - len(missing), time.perf_counter(), self._elapsed
        first = self._new

        def deliver(found: Done, storable: bool) -> None:
            self.answers[found[0]] = found[1]
            if self.kept is not None and storable and repeatable(found[1]):
                self.kept.add(found)
            self._new += 1
            self._computing += found[2]
            self._elapsed = before + time.perf_counter() - start
            self._check_hope(found[1])
            if self.show is not None:
                of = self._new - first
                self.show(done + of, self.total, (len(missing) - of) * (time.perf_counter() - start) / of)

        if missing:
            self.engine.compute(missing, deliver)
        self._elapsed = before + time.perf_counter() - start

    def _check_hope(self, text: str) -> None:
        """Ends the map if all cells so far failed in one and the same way that is no answer."""
        if self._hopeless is None:
            return
        read = json.loads(text)
        if isinstance(read, list) or read["expected"] or self._hopeless not in ("", read["failure"]):
            self._hopeless = None
            return
        self._hopeless = read["failure"]
        if self._new >= min(HOPELESS, self.total):
            raise Error(f"the first {self._new} cells failed in the same way: {self._hopeless}\n  help: try it in one cell, foldline.Case")

    def attributes(self) -> dict[str, Any]:
        """Returns how the answers were computed."""
        engine = self.engine
        return {
            "cells_computed": self._new,
            "tasks": engine.tasks,
            "threads": engine.threads,
            "elapsed_seconds": self._elapsed,
            "computing_seconds": self._computing,
            "preparing_seconds": engine.prepared,
            "task_seconds": engine.task,
        }

    def complain(self) -> None:
        """Warns of cells without values."""
        reasons: dict[str, int] = {}
        for cell in self.used:
            text = self.answers[cell]
            if text.startswith('{"failure"'):
                reason = json.loads(text)["failure"]
                reasons[reason] = reasons.get(reason, 0) + 1
        if reasons:
            most = sorted(reasons.items(), key=lambda own: -own[1])
            said = "; ".join(f"{count} × {reason}" for reason, count in most[:3])
            more = f"; and {len(most) - 3} other reasons" if len(most) > 3 else ""
            count = sum(reasons.values())
            warnings.warn(
                f"{count} of {len(self.used)} cells have no values: {said}{more}. See the variable `failure`",
                EndedShort,
                stacklevel=_depth(),
            )

    def close(self) -> None:
        if self.kept is not None:
            self.kept.close()


@contextmanager
def _cells_shown(progress: CellProgress) -> Iterator[Callable[[int, int, float], None] | None]:
    """Yields the function to be called after each cell; `None` if nothing is shown."""
    if callable(progress):
        yield progress
        return
    wanted = _watched() if progress is None else progress
    if not wanted or importlib.util.find_spec("tqdm") is None:
        yield None
        return
    bar = _bar_of_cells(0.5 if progress is None else 0.0)

    def show(done: int, total: int, left: float) -> None:
        bar.total = total
        bar.update(done - bar.n)

    try:
        yield show
    finally:
        bar.close()


def latin_hypercube(ranges: Mapping[str, tuple[float, float]], count: int, *, seed: int = 1) -> list[dict[str, float]]:
    """Draws parameter values in a Latin hypercube: every parameter has one value in each of `count` equal parts of its range.

    Parameters
    ----------
    ranges : mapping
        Smallest and largest value of each parameter.
    count : int
        Number of cases.
    seed : int
        Seed of the random numbers; the same seed gives the same cases.

    Returns
    -------
    list of dict
        Cases for the argument `over` of `foldline.map`.

    Raises
    ------
    ArgumentError, InputError
        If a range is not a pair, or is reversed.

    Examples
    --------
    >>> import foldline
    >>> cases = foldline.latin_hypercube({"zeta": (0.0, 1.0), "epsilon": (2.0, 4.0)}, 4)
    >>> sorted(int(4 * case["zeta"]) for case in cases)
    [0, 1, 2, 3]
    """
    if not isinstance(ranges, Mapping):
        raise wrong_kind("the ranges must be a dictionary", ranges, 'foldline.latin_hypercube({"zeta": (0.01, 0.02)}, 100)')
    ends = []
    for name, pair in ranges.items():
        own = finite(f"the range of {name}", pair)
        if own.shape != (2,) or not own[0] < own[1]:
            raise InputError(f"the range of {name} is not a pair (smallest, largest)\n  help: {{{name!r}: (0.01, 0.02)}}")
        ends.append(own)
    if not ends:
        raise InputError('the hypercube has no parameters\n  help: {"zeta": (0.01, 0.02)}')
    low, high = np.array(ends).T
    drawn = low + (high - low) * unit_hypercube(len(ends), whole("count", count), whole("seed", seed, 0))
    return [dict(zip(ranges, row, strict=True)) for row in drawn.tolist()]


def unit_hypercube(dimensions: int, count: int, seed: int) -> Any:
    """Returns a Latin hypercube in the unit cube, shape (count, dimensions)."""
    try:
        from scipy.stats import qmc
    except ImportError as error:
        raise ImportError('a Latin hypercube needs SciPy: pip install "foldline[cluster]"') from error
    return qmc.LatinHypercube(dimensions, rng=seed).random(count)

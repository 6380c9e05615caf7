"""Questions that a map over parameters asks in each of its cells, and their answers as plain values."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._arguments import described, suggestion, wrong_kind
from ._errors import ArgumentError, InputError
from ._fingerprint import fingerprint
from ._study_at import check_replaceable, study_at, tables_of

if TYPE_CHECKING:
    from ._case import Case
    from ._model import Model
    from ._solution import Solution

#: Names of variables that every map has.
RESERVED = ("failure", "remark", "computed", "case", "motion", "point")


class Answer(NamedTuple):
    """Values of a cell; values of each of the motions or points found there; a remark; values of motions that were not found."""

    values: Mapping[str, Any]
    items: Mapping[str, Mapping[str, Any]] = {}
    remark: str = ""
    absent: Mapping[str, Any] = {}


@dataclass(frozen=True)
class Limits:
    """Settings of searches for settled motions."""

    start: Any = None
    samples: int = 64
    seed: int = 1
    tolerance: float = 1e-6
    max_steps: int | None = None
    max_time: float | None = None

    def options(self) -> dict[str, Any]:
        """Returns keyword arguments."""
        return {"tolerance": self.tolerance, "max_steps": self.max_steps, "max_time": self.max_time}

    def identity(self) -> dict[str, Any]:
        """Returns what tells these settings from others."""
        return {"start": self.start, "samples": self.samples, "seed": self.seed, **self.options()}


class Motions:
    """Which attractors exist, found from sampled initial states."""

    items = "motion"
    category = "motions"

    def __init__(self, limits: Limits) -> None:
        self.limits = limits

    def identity(self) -> Any:
        return ["motions", self.limits.identity()]

    def answer(self, case: Case) -> Answer:
        return _motions(case, self.limits, shares=False)

    def about(self, model: Model) -> dict[str, dict[str, str]]:
        return {
            "motions": {"long_name": "motions found"},
            "number": {"long_name": "number of motions of this kind"},
            "unsettled": {"long_name": "number of initial states that did not settle"},
            "escaped": {"long_name": "number of initial states that escaped"},
        }


class Shares:
    """Basin fractions of all attractors of a kind together, with 95 % confidence intervals."""

    items = "motion"
    category = "motions"

    def __init__(self, limits: Limits) -> None:
        self.limits = limits

    def identity(self) -> Any:
        return ["shares", self.limits.identity()]

    def answer(self, case: Case) -> Answer:
        return _motions(case, self.limits, shares=True)

    def about(self, model: Model) -> dict[str, dict[str, str]]:
        return {
            "motions": {"long_name": "motions found"},
            "number": {"long_name": "number of motions of this kind"},
            "share": {"units": "1", "long_name": "basin fraction"},
            "share_low": {"units": "1", "long_name": "lower end of the 95 % confidence interval of the basin fraction"},
            "share_high": {"units": "1", "long_name": "upper end of the 95 % confidence interval of the basin fraction"},
            "unsettled": {"units": "1", "long_name": "fraction of initial states that did not settle"},
            "escaped": {"units": "1", "long_name": "fraction of initial states that escaped"},
        }


class Settled:
    """Quantities of one settled motion."""

    items = ""
    category = "settled_motion"

    def __init__(self, names: Sequence[str], limits: Limits) -> None:
        self.names = list(names)
        self.limits = limits

    def identity(self) -> Any:
        return ["settled", self.names, self.limits.identity()]

    def answer(self, case: Case) -> Answer:
        limits = self.limits
        found = case.settle(limits.start, samples=limits.samples, random=limits.seed, **limits.options())
        return Answer({**{name: found[name] for name in self.names}, "settled_motion": kind_of(found)})

    def about(self, model: Model) -> dict[str, dict[str, str]]:
        return {"settled_motion": {"long_name": "motion reached"}}


class Points:
    """Special points of a study."""

    items = "point"
    category = "points"

    def __init__(self, tables: Mapping[str, Any]) -> None:
        self.tables = dict(tables)

    def identity(self) -> Any:
        from . import _write

        return ["points", _write.study({name: own for name, own in self.tables.items() if name != "model"})]

    def answer(self, case: Case) -> Answer:
        found = case.run(self.tables)
        answer, reason = found._native.answer(found.short)
        if answer is None:
            raise InputError(reason)
        values, items, _, _ = answer
        # What fell short was heard while the study ran.
        return Answer(values, dict(items))

    def about(self, model: Model) -> dict[str, dict[str, str]]:
        return {
            "points": {"long_name": "special points found"},
            "value": {"long_name": "value of the parameter of the branch at the special point"},
            "error": {"long_name": "bound on the error of value"},
            "unstable_before": {"long_name": "number of unstable eigenvalues or multipliers before the point"},
            "unstable_after": {"long_name": "number of unstable eigenvalues or multipliers after the point"},
        }


class Calls:
    """Functions of a case, given by the user."""

    items = ""
    category = ""

    def __init__(self, functions: Callable[[Case], Any] | Mapping[str, Callable[[Case], Any]]) -> None:
        self.functions = functions

    def identity(self) -> Any:
        if isinstance(self.functions, Mapping):
            return ["functions", {name: fingerprint(own) for name, own in self.functions.items()}]
        return ["function", fingerprint(self.functions)]

    def answer(self, case: Case) -> Answer:
        if isinstance(self.functions, Mapping):
            return Answer({name: _checked(name, own(case)) for name, own in self.functions.items()})
        found = self.functions(case)
        if isinstance(found, Mapping):
            return Answer({str(name): _checked(str(name), own) for name, own in found.items()})
        return Answer({"value": _checked("value", found)})

    def about(self, model: Model) -> dict[str, dict[str, str]]:
        return {}


Question = Motions | Shares | Settled | Points | Calls


def question_of(what: Any, model: Model, limits: Limits, names: Sequence[str]) -> Question:
    """Returns the question that the argument `what` of `foldline.map` means; `names` are the parameters of the map."""
    from ._diagram import Diagram

    if what == "motions":
        return Motions(limits)
    if what == "shares":
        return Shares(limits)
    if callable(what):
        return Calls(what)
    if isinstance(what, Diagram):
        return _points(what.study, model, names)
    if isinstance(what, Mapping):
        if what and all(callable(own) for own in what.values()):
            _check_free_names(what, model, names)
            return Calls(dict(what))
        return _points(what, model, names)
    if isinstance(what, os.PathLike) or (isinstance(what, str) and ("\n" in what or what.endswith(".toml"))):
        return _points(what, model, names)
    quantities = [what] if isinstance(what, str) else what
    if isinstance(quantities, Sequence) and quantities and all(isinstance(own, str) for own in quantities):
        known = [*(f"{own}_{side}" for own in [*model.states, *model.outputs] for side in ("max", "min")), "period"]
        for own in quantities:
            if own not in known:
                words = f"{suggestion(own, known)}; or 'motions', 'shares', a study, or a function of a case"
                raise InputError(f"a map cannot show {own!r}: it is not a quantity of a settled motion\n  help: {words}")
        return Settled(quantities, limits)
    cure = "what='motions', 'shares', ['x_max', 'period'], a study, or a function of a case"
    raise wrong_kind("what a map is to compute must be a name, a study or a function", what, cure)


def _points(study: Any, model: Model, names: Sequence[str]) -> Points:
    from . import _native
    from ._studies import parsed

    tables = tables_of(study)
    if not any(tables.get(part) for part in ("branch", "explore", "homotopy")):
        cure = "a study with branches, or a function: lambda case: case.run(study).surveys[0].share(...)"
        raise InputError(f"the study has no branches, whose special points a map could show\n  help: {cure}")
    check_replaceable(tables, names)
    # Mistakes in the study are found before anything is computed.
    if not isinstance(study, Mapping) and "\n" not in str(study):
        _native.Study.read(os.fspath(study))
    tables = {name: own for name, own in tables.items() if name != "model"}
    parsed(study_at(tables, {name: model.parameters[name]["value"] for name in names}), model)
    return Points(tables)


def _check_free_names(given: Mapping[str, Any], model: Model, names: Sequence[str]) -> None:
    for name in given:
        if name in names or name in RESERVED:
            raise ArgumentError(f"the name `{name}` is taken in the result\n  help: another name for this function")


def _motions(case: Case, limits: Limits, shares: bool) -> Answer:
    """Attractors by kind, or their basin fractions, as the maps of study files have them."""
    from . import _native
    from ._arrays import limits as pair

    values, items, remark, absent = _native.motions(
        case.model._native, case.model._values(case.given), shares, limits.samples, limits.seed, limits.tolerance,
        pair(limits.max_steps, limits.max_time),
    )  # fmt: skip
    return Answer(values, dict(items), remark, absent)


def kind_of(found: Solution) -> str:
    """Returns the kind of a motion in words: ``"equilibrium"``, ``"cycle"``, ``"2:1 cycle"``, ``"period-3 cycle"``."""
    ratio = found.ratio
    if ratio:
        return f"{ratio[0]}:{ratio[1]} {found.family}"
    return f"period-{found.forcing_periods} {found.family}" if found.forcing_periods > 1 else found.family


def _checked(name: str, value: Any) -> Any:
    """Returns a value of a cell as a number, a truth value, a text or a list of numbers."""
    if value is None:
        raise InputError(f"the function returned None for {name}")
    if isinstance(value, (bool, np.bool_)):
        return bool(value)
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        return float(value)
    if isinstance(value, str):
        return str(value)
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.empty(0, dtype=object)
    if array.dtype.kind in "biuf" and array.ndim <= 1:
        return array.astype(float).tolist()
    raise TypeError(f"the function returned {described(value)} for {name}, not a number, a text, or a list of numbers")

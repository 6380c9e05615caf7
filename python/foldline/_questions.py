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
        found = case.attractors(samples=self.limits.samples, seed=self.limits.seed, **self.limits.options())
        kinds: dict[str, dict[str, Any]] = {}
        for own in found:
            # The first attractor of a kind is the one that most initial states reached.
            first = kinds.setdefault(kind_of(own), {"number": 0, "period": own["period"], **_maxima(own)})
            first["number"] += 1
        said = " + ".join(counted(kinds[kind]["number"], kind) for kind in sorted(kinds))
        values = {"motions": said or "none", "unsettled": found.unsettled + found.stuck, "escaped": found.escaped}
        lost = found.unsettled + found.stuck
        remark = f"{lost} of {found.samples} initial states did not settle" if lost else ""
        return Answer(values, kinds, remark, {"number": 0})

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
        from ._basins import Basins

        found = case.basins(samples=self.limits.samples, seed=self.limits.seed, **self.limits.options())
        names = [kind_of(own) for own in found.attractors]
        kinds = sorted(set(names))
        # Fates of the samples as numbers of kinds; -1 did not settle, -2 escaped.
        merged = np.array(
            [kinds.index(names[fate]) if fate >= 0 else -2 if fate in (-2, -3) else -1 for fate in found.fates], dtype=np.int64
        )
        joined = Basins(found.model, [], found.samples, merged, None, found.x, found.y, found.cells, None)
        items: dict[str, dict[str, Any]] = {}
        for index, kind in enumerate(kinds):
            share, low, high = joined.share(index)
            if share > 0:
                reached = [fate for fate, name in enumerate(names) if name == kind and (found.fates == fate).any()]
                items[kind] = {"share": share, "share_low": low, "share_high": high, "number": len(reached)}
        unsettled, escaped = joined.share(-1)[0], joined.share(-2)[0]
        said = " + ".join(counted(own["number"], kind) for kind, own in items.items())
        values = {"motions": said or "none", "unsettled": unsettled, "escaped": escaped}
        none, low, high = joined.share(len(kinds))
        absent = {"share": none, "share_low": low, "share_high": high, "number": 0}
        return Answer(values, items, f"{100 * unsettled:.3g} % of the initial states did not settle" if unsettled else "", absent)

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
        if not any(len(branch) for branch in found):
            told = dict.fromkeys([*found.short, *(note for _, note in found.notes)])
            raise InputError("; ".join(told) or "the study has no branches")
        items: dict[str, dict[str, Any]] = {}
        kinds: dict[str, int] = {}
        for branch in found:
            for own in branch.special:
                # As in `SpecialPoint`, the error is relative to the scale of the parameter.
                error = own.error * (branch.scale + abs(own.value))
                items[f"{branch.name}: {own.kind} {own.number}"] = {
                    "value": own.value, "error": error, "period": own["period"], "unstable_before": own.unstable_before,
                    "unstable_after": own.unstable_after, **_maxima(own),
                    "branch": branch.name, "kind": own.kind, "free": branch.free,
                }  # fmt: skip
                kinds[own.kind] = kinds.get(own.kind, 0) + 1
        said = ", ".join(counted(kinds[kind], kind) for kind in sorted(kinds)) or "none"
        return Answer({"points": said}, items)

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


def _maxima(found: Solution) -> dict[str, float]:
    """Largest values of the outputs, or of the states if there are no outputs."""
    return {f"{name}_max": found[f"{name}_max"] for name in list(found.model.outputs) or list(found.model.states)}


def kind_of(found: Solution) -> str:
    """Returns the kind of a motion in words: ``"equilibrium"``, ``"cycle"``, ``"2:1 cycle"``, ``"period-3 cycle"``."""
    ratio = found.ratio
    if ratio:
        return f"{ratio[0]}:{ratio[1]} {found.family}"
    return f"period-{found.forcing_periods} {found.family}" if found.forcing_periods > 1 else found.family


def counted(number: int, kind: str) -> str:
    """Returns a number of motions or points of a kind in words: ``"2 equilibria"``."""
    if number == 1:
        return kind
    return f"{number} {kind.removesuffix('um')}a" if kind.endswith("um") else f"{number} {kind}s"


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

"""Checks of arguments. Messages about mistakes show the right call."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from . import _native
from ._errors import ArgumentError, InputError

if TYPE_CHECKING:
    from ._branch import Branch
    from ._model import Model
    from ._solution import Solution

#: A number, or a text with a number and a unit, such as "500 rpm".
End = float | str


def described(value: Any) -> str:
    """Describes a value in a user's words, with an article."""
    from ._branch import Branch, SpecialPoint, SpecialPoints
    from ._diagram import Diagram
    from ._model import Model
    from ._responses import Responses
    from ._simulation import Trajectory
    from ._solution import Attractors, Solution

    words = {
        Model: "a model", SpecialPoint: "a special point", Solution: "a solution", Branch: "a branch", Diagram: "a diagram",
        SpecialPoints: "a list of special points", Attractors: "a list of attractors", Trajectory: "a trajectory",
        Responses: "a survey or sweep", str: "a string", Mapping: "a dictionary", type(None): "None",
    }  # fmt: skip
    for kind, word in words.items():
        if isinstance(value, kind):
            return word
    return "a function" if callable(value) else f"a value of type {type(value).__name__}"


def wrong_kind(what: str, value: Any, cure: str) -> ArgumentError:
    """Returns the exception for an argument of the wrong kind."""
    return ArgumentError(f"{what}, but got {described(value)}\n  help: {cure}")


def suggestion(word: str, known: Iterable[str]) -> str:
    """Suggests the known name nearest to a word, or lists all known names."""
    return _native.suggest(word, list(known))


def is_model(value: Any) -> TypeGuard[Model]:
    """True for a model."""
    from ._model import Model

    return isinstance(value, Model)


def is_solution(value: Any) -> TypeGuard[Solution]:
    """True for a solution."""
    from ._solution import Solution

    return isinstance(value, Solution)


def is_branch(value: Any) -> TypeGuard[Branch]:
    """True for a branch."""
    from ._branch import Branch

    return isinstance(value, Branch)


def check_solution(start: Any, call: str) -> None:
    """Refuses anything but a solution; `call` is the right call with `{}` for the solution."""
    if is_solution(start):
        start._check_stored()
        return
    from ._diagram import Diagram
    from ._simulation import Trajectory
    from ._solution import Attractors

    if is_model(start):
        cure = f"find a first solution: {call.format('model.settle()')}"
    elif is_branch(start):
        cure = f"start at one of its points: {call.format('branch[-1]')}"
    elif isinstance(start, Diagram):
        cure = f"start at a point of one of its branches: {call.format('diagram[0][-1]')}"
    elif isinstance(start, Attractors):
        cure = f"start at one of them: {call.format('attractors[0]')}"
    elif isinstance(start, (Trajectory, Mapping, Sequence, np.ndarray)) or hasattr(start, "y"):
        cure = f"let it settle first: {call.format('model.settle(start)')}"
    else:
        cure = f"model.settle(...), one of model.attractors(), or a point of a branch: {call.format('branch[-1]')}"
    raise wrong_kind("the start must be a solution", start, cure)


def check_model(value: Any, call: str) -> None:
    """Refuses anything but a model; `call` is the right call with `{}` for the model."""
    if is_model(value):
        return
    if is_solution(value):
        cure = f"take the model of the solution: {call.format('solution.model')}"
    elif is_branch(value):
        cure = f"take the model of its diagram: {call.format('branch.diagram.model')}"
    elif isinstance(value, str):
        cure = f"read the model file: {call.format(f'foldline.model({value!r})')}"
    elif callable(value):
        cure = 'make a model of the function: @foldline.model(states="x y", parameters=dict(a=1.0)) above its definition'
    else:
        cure = f"one made by foldline.model: {call.format('model')}"
    raise wrong_kind("a model is needed", value, cure)


def check_point(point: Any, call: str, branch: Branch | None = None) -> None:
    """Refuses anything but a special point (of the branch, if given); `call` is the right call with `{}` for the point."""
    from ._branch import SpecialPoint, SpecialPoints

    if not isinstance(point, SpecialPoint):
        if isinstance(point, SpecialPoints) and len(point):
            kind = point[0].kind
            raise wrong_kind("a single special point is needed", point, call.format(f'branch.special["{kind}"][0]'))
        if isinstance(point, str):
            cure = call.format(f"branch.special[{point!r}][0]")
        else:
            cure = call.format('branch.special["fold"][0]')
        raise wrong_kind("a special point of a branch is needed", point, cure)
    if branch is not None and point.branch.name != branch.name:
        message = f"this {point.kind} lies on the branch `{point.branch.name}`, not on `{branch.name}`"
        raise InputError(f"{message}\n  help: point.branch.switch(point)")


def check_free(free: Any, model: Model, call: str, taken: Sequence[str] = ()) -> None:
    """Refuses anything but the name of a parameter; `call` is the right call with `{}` for the name."""
    names = [name for name in model.parameters if name not in taken]
    if not names:
        none = "no parameter" if not taken else f"no parameter but {', '.join(taken)}"
        raise InputError(f"the model `{model.name}` has {none}\n  help: give the model one that is to vary")
    example = call.format(f'"{names[0]}"')
    if not isinstance(free, str):
        raise wrong_kind("the name of the parameter that varies is needed", free, f"{example}; the parameters are {', '.join(names)}")
    if free in model.parameters:
        if free in taken:
            raise InputError(f"`{free}` varies already\n  help: another parameter: {', '.join(names)}")
        return
    if free in model.states:
        cure = f"one of the parameters {', '.join(names)}: {example}"
        raise InputError(f"`{free}` is a state of the model `{model.name}`, not a parameter\n  help: {cure}")
    raise InputError(f"the model `{model.name}` has no parameter `{free}`\n  help: {suggestion(free, names)}")


def check_frees(free: Any, hold: Any, start: Any) -> list[str]:
    """Returns the free parameters of a branch with held quantities."""
    frees = [free] if isinstance(free, str) else free
    if not isinstance(frees, Sequence) or not frees or not all(isinstance(own, str) for own in frees):
        raise wrong_kind("the names of the parameters that vary are needed", free, 'free=["Omega", "epsilon"]')
    if hold is not None and (isinstance(hold, str) or not isinstance(hold, (Mapping, Sequence))):
        raise wrong_kind("hold must be a dictionary, or a list of names", hold, 'hold={"x_max": 2.0}')
    for index, own in enumerate(frees):
        check_free(own, start.model, "foldline.follow(start, [{}, …], (0.5, 4), hold=…)", frees[:index])
    return list(frees)


def check_names(name: str, names: Any) -> None:
    """Refuses anything but a list of names."""
    if names is None or (isinstance(names, Sequence) and not isinstance(names, str) and all(isinstance(own, str) for own in names)):
        return
    raise wrong_kind(f"{name} must be a list of names", names, f'{name}=["x_max"]')


def number(name: str, value: Any) -> float:
    """Returns a number; refuses text."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf":
        return float(value)
    if isinstance(value, str):
        shown = f"{name} = {value!r} is a string"
        raise ArgumentError(f"{shown}\n  help: a number, without quotes{_unquoted(name, value)}")
    raise wrong_kind(f"{name} must be a number", value, "a number such as 5, 0.25 or 1e-6")


def _unquoted(name: str, text: str) -> str:
    try:
        return f": {name} = {float(text):g}"
    except ValueError:
        return ", in the unit that the model states"


def end(name: str, value: Any) -> End:
    """Returns a number, or a text with a number and its unit."""
    if not isinstance(value, str):
        return number(name, value)
    try:
        plain = float(value)
    except ValueError:
        return value
    raise ArgumentError(f"{name} has the string {value!r}\n  help: a number, {plain:g}, or one with its unit, such as '500 rpm'")


def call_of(function: str, free: Any, range: Any = None) -> str:
    """The right call, with `{}` for its first argument; correct arguments are kept."""
    given = range if isinstance(range, (tuple, list)) and len(range) == 2 else (0.5, 4)
    numbers = all(isinstance(own, Real) and not isinstance(own, bool) for own in given)
    ends = ", ".join(f"{float(own):g}" for own in given) if numbers else "0.5, 4"
    name = free if isinstance(free, str) else "a"
    return f'foldline.{function}({{}}, "{name.translate({123: None, 125: None})}", ({ends}))'


def check_range(range: Any, call: str, missing: str = "", ordered: bool = True) -> list[End] | None:
    """Returns a pair of ends, the smaller one first; `call` is the right call with `{}` for the pair."""
    if range is None:
        if missing:
            raise ArgumentError(f"{missing}\n  help: {call.format('(0.5, 4)')}, the smallest and the largest value")
        return None
    pair = f"the range must be a pair (smallest, largest){'' if ordered else ', or (first, last)'}"
    example = "(0.5, 4)"
    if isinstance(range, (str, Mapping)) or not (isinstance(range, (Sequence, np.ndarray))):
        raise wrong_kind(pair, range, call.format(example))
    if len(range) != 2:
        raise ArgumentError(f"{pair}, but has {len(range)} values\n  help: {call.format(example)}")
    low, high = (end("the range", own) for own in range)
    if isinstance(low, float) and isinstance(high, float):
        if not (np.isfinite(low) and np.isfinite(high)):
            raise InputError(f"the range ({low:g}, {high:g}) is not finite\n  help: two finite numbers: {call.format(example)}")
        if low == high:
            raise InputError(f"the range ({low:g}, {high:g}) is empty\n  help: two different numbers: {call.format(example)}")
        if ordered and low > high:
            right = call.format(f"({high:g}, {low:g})")
            raise InputError(f"the range ({low:g}, {high:g}) is the wrong way round\n  help: the smaller value first: {right}")
    return [low, high]


def check_within(start: Solution, free: str, ends: Sequence[End] | None) -> None:
    """Refuses a range that does not contain the value at which a branch starts."""
    value = start.parameters[free]
    if ends is None or isinstance(ends[0], str) or isinstance(ends[1], str) or ends[0] <= value <= ends[1]:
        return
    low, high = min(value, ends[0]), max(value, ends[1])
    cure = f"a range that contains it, such as ({low:g}, {high:g}), or another start: model.settle(parameters={{{free!r}: {ends[0]:g}}})"
    raise InputError(f"the branch starts at {free} = {value:g}, outside its range ({ends[0]:g}, {ends[1]:g})\n  help: {cure}")


def check_switch(switch: Any) -> None:
    """Refuses anything but a mapping of kinds of special points to depths."""
    _check_table(switch, "switch", '{"hopf": 1, "period-doubling": 2}', lambda own: f'{{"{own}": 1}}')


def check_marks(name: str, marks: Any) -> None:
    """Refuses anything but a mapping of quantities to values."""
    _check_table(marks, name, '{"x_max": 2.0}', lambda own: f'{{"{own}": 2.0}}')


def check_parameters(name: str, values: Any, model: Model | None = None) -> None:
    """Refuses anything but a mapping of names to numbers."""
    first = next(iter(model.parameters), "a") if model is not None else "a"
    _check_table(values, name, f'{{"{first}": 1.0}}', lambda own: f'{{"{own}": 1.0}}')


def _check_table(given: Any, name: str, example: str, of: Any) -> None:
    if given is None or isinstance(given, Mapping):
        return
    shown = of(given) if isinstance(given, str) else example
    raise wrong_kind(f"{name} must be a dictionary", given, f"{name}={shown}")

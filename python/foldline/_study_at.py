"""Studies as tables, and the same studies at other parameter values."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ._errors import InputError
from ._texts import is_text, text_of

#: Parts of a study with parameter values of their own.
_PARTS = ("seed", "explore", "survey")


def tables_of(study: Any) -> dict[str, Any]:
    """Returns the tables of a study given as a path, a text or a dictionary."""
    if isinstance(study, Mapping):
        return dict(study)
    text = str(study) if is_text(study) else text_of(study, "study")
    try:
        import tomllib
    except ImportError as error:
        cure = "give the study as a dictionary: dict(seed=[...], branch=[...])"
        raise InputError(f"a study as text needs Python 3.11 in a map over parameters\n  help: {cure}") from error
    try:
        found = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        where = "the study" if is_text(study) else os.fspath(study)
        raise InputError(f"{where} is not valid TOML: {error}\n  help: foldline check shows the place") from error
    return found


def _stated(tables: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yields the values that a study states, and where."""
    yield "at the top", tables.get("parameters") or {}
    for part in _PARTS:
        for item in tables.get(part) or ():
            yield f"in the {part} `{item.get('name', '')}`", item.get("parameters") or {}


def check_replaceable(tables: Mapping[str, Any], names: Sequence[str]) -> None:
    """Refuses a study that states several values of a parameter which a map is to replace, or changes it on the way."""
    for name in names:
        places = [(place, own[name]) for place, own in _stated(tables) if name in own]
        values = {repr(own.get("value") if isinstance(own, Mapping) else own) for _, own in places}
        if len(values) > 1:
            said = ", ".join(f"{own!r} {place}" for place, own in places)
            raise InputError(f"the study states several values of `{name}`, which the map replaces: {said}\n  help: one value of `{name}`")
        for item in tables.get("homotopy") or ():
            if name in (item.get("to") or {}):
                raise InputError(f"the homotopy `{item.get('name', '')}` changes `{name}`\n  help: a map over other parameters")
        for part in ("branch", "explore", "survey", "sweep", "curve"):
            for item in tables.get(part) or ():
                free = item.get("free")
                if name in ([free] if isinstance(free, str) else free or ()):
                    message = f"`{name}` varies in the {part} `{item.get('name', '')}`"
                    raise InputError(f"{message}\n  help: a map over other parameters, or a study with another free parameter")


def study_at(study: Any, given: Mapping[str, float]) -> dict[str, Any]:
    """Returns the tables of a study with other values of some parameters, wherever it states them."""
    tables = tables_of(study)
    tables["parameters"] = {**(tables.get("parameters") or {}), **given}
    # A map of the study has values of its own and would be the same in each case.
    tables.pop("map", None)
    for part in _PARTS:
        if tables.get(part):
            tables[part] = [_item_at(item, given) for item in tables[part]]
    return tables


def _item_at(item: Mapping[str, Any], given: Mapping[str, float]) -> dict[str, Any]:
    own = item.get("parameters")
    if not own:
        return dict(item)
    return {**item, "parameters": {name: given.get(name, value) for name, value in own.items()}}

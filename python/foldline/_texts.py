"""Files and texts: telling them apart, and checking paths."""

from __future__ import annotations

import os
import re
from typing import Any

from . import _write
from ._arguments import suggestion
from ._errors import InputError

Path = str | os.PathLike[str]
_RELATIVE = "relative paths start at the current folder,"


def text_of(path: Path, what: str) -> str:
    """Returns the text of a file, called `what` in messages."""
    check_file(path, what)
    try:
        with open(path, encoding="utf-8") as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read the {what} file {os.fspath(path)}: {error}\n  help: a text file in UTF-8") from error


def is_text(given: Any) -> bool:
    """True for a string that is a text rather than a path: one with several lines, or with an equation sign and no file of that name."""
    if not isinstance(given, str) or (given.endswith(".toml") and "\n" not in given):
        return False
    return "\n" in given or ("=" in given and not os.path.exists(given))


def is_model_text(text: str) -> bool:
    """True for the text of a model: it has states, and no part of a study."""
    return re.search(r"^\s*\[states\b", text, re.MULTILINE) is not None and with_model(text, "") != text


def with_model(text: str, file: str) -> str:
    """Returns the text of a study, with the file of its model added at the top if it names none."""
    head = re.split(r"^\s*\[", text, maxsplit=1, flags=re.MULTILINE)[0]
    if re.search(r"""^\s*["']?model["']?\s*=""", head, re.MULTILINE):
        return text
    # Line numbers are unchanged if the text begins with an empty line.
    return f"model = {_write.value(file)}\n{text.removeprefix(chr(10))}"


def check_file(path: Path, what: str) -> None:
    """Refuses the path of a missing file."""
    own = os.fspath(path)
    if os.path.isfile(own):
        return
    if os.path.isfile(os.path.join(own, "run.sqlite")):
        raise InputError(f"{own} is the folder of a run, not a {what} file\n  help: foldline.open({own!r})")
    if os.path.exists(own):
        raise InputError(f"{own} cannot be read: it is a folder\n  help: the path of a {what} file")
    folder, name = os.path.split(os.path.abspath(own))
    message = f"cannot read the {what} file {own}: there is no such file in {folder}"
    if not os.path.isdir(folder):
        raise InputError(f"cannot read the {what} file {own}: there is no folder {folder}\n  help: {_RELATIVE} {os.getcwd()}")
    files = sorted(file for file in os.listdir(folder) if file.endswith(".toml"))
    near = suggestion(name, files)
    near = near if near.startswith("did you mean") else "check the spelling of the path"
    raise InputError(f"{message}\n  help: {near if os.path.isabs(own) else f'{near}; {_RELATIVE} {os.getcwd()}'}")

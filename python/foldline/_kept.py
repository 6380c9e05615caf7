"""Answers of a map over parameters in a folder: one line each, appended as they come, so that a map killed at any instant can be continued."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from typing import IO, Any

from ._cells import Cell, Done
from ._errors import RunFileError

#: Version of the format of the folder.
FORMAT = 1
_HEAD, _LINES = "map.json", "cells.jsonl"
_PARTS = {"model": "the model", "what": "what is computed", "over": "the parameters or their values", "version": "the version of foldline"}


def digest(value: Any) -> str:
    """Returns the SHA-256 of a value that JSON can express."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


class Kept:
    """The folder of a map. A folder with another map is refused."""

    def __init__(self, folder: str, head: Mapping[str, Any]) -> None:
        self.folder = folder
        self.known: dict[Cell, str] = {}
        own = {"format": FORMAT, **head}
        try:
            os.makedirs(folder, exist_ok=True)
            path = os.path.join(folder, _HEAD)
            if os.path.exists(path):
                self._check(path, own)
                self._read()
            elif os.path.exists(os.path.join(folder, "run.sqlite")):
                raise RunFileError(f"{folder} holds a run, not a map over parameters\n  help: another folder")
            else:
                _written(path, json.dumps(own, indent=1) + "\n")
            self._file: IO[str] = open(os.path.join(folder, _LINES), "a", encoding="utf-8")
        except OSError as error:
            raise RunFileError(f"{folder} cannot be used: {error}\n  help: a folder that can be written to") from error
        if self._torn:
            self._file.write("\n")

    _torn = False

    def _check(self, path: str, own: Mapping[str, Any]) -> None:
        try:
            with open(path, encoding="utf-8") as file:
                found = json.load(file)
        except ValueError as error:
            raise RunFileError(f"{path} is damaged: {error}\n  help: another folder") from error
        if found.get("format", 0) > FORMAT:
            raise RunFileError(f"{self.folder} was written by a newer version of foldline\n  help: pip install --upgrade foldline")
        for part, words in _PARTS.items():
            if found.get(part) != own[part]:
                versions = f" ({found.get(part)} there, {own[part]} here)" if part == "version" else ""
                message = f"{self.folder} holds another map: {words} differs{versions}"
                raise RunFileError(f"{message}\n  help: another folder, or the same call as before")

    def _read(self) -> None:
        path = os.path.join(self.folder, _LINES)
        if not os.path.exists(path):
            return
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                # The last line of a map that was killed may be torn.
                self._torn = not line.endswith("\n")
                try:
                    cell, text, _ = json.loads(line)
                except ValueError:
                    continue
                self.known[tuple(cell)] = text

    def add(self, done: Done) -> None:
        """Stores an answer; it is safe from a kill when this returns, and from a power failure after `close`."""
        cell, text, seconds = done
        self._file.write(json.dumps([list(cell), text, round(seconds, 6)]) + "\n")
        self._file.flush()

    def close(self) -> None:
        """Makes the answers safe from a power failure."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()


def _written(path: str, text: str) -> None:
    """Writes a file whole or not at all."""
    with open(path + ".tmp", "w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    os.replace(path + ".tmp", path)

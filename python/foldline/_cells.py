"""Cells of a map over parameters: what a worker computes, and the text of its answer.

Answers are kept as text from the moment they are computed, so that serial, parallel, remote and resumed maps are equal to the bit.
"""

from __future__ import annotations

import json
import pickle
import time
from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from ._case import Case
from ._errors import Error
from ._studies import HEARD

if TYPE_CHECKING:
    from ._model import Model
    from ._questions import Question

#: Values of the parameters of a cell.
Cell = tuple[float, ...]
#: Cell, answer as text, and seconds that it took.
Done = tuple[Cell, str, float]


#: Exceptions that say what a cell is like. Others, such as a lost file, may be gone when the cell is tried again.
_ANSWERS = (Error, IndexError, ValueError, ArithmeticError)


class Job:
    """What is computed in every cell: a model, the names of the parameters, and a question."""

    def __init__(self, model: Model, names: Sequence[str], question: Question) -> None:
        from . import __version__

        self.version = __version__
        self.model = model
        self.names = tuple(names)
        self.question = question

    def at(self, cell: Cell) -> Done:
        """Returns the answer in a cell. A failure is an answer, too."""
        start = time.perf_counter()
        heard: list[str] = []
        token = HEARD.set(heard)
        try:
            answer = self.question.answer(Case(self.model, dict(zip(self.names, cell, strict=True))))
            remark = "; ".join(dict.fromkeys([*heard, *([answer.remark] if answer.remark else [])]))
            items = {name: dict(own) for name, own in answer.items.items()}
            text = json.dumps([dict(answer.values), items, remark, dict(answer.absent)])
        except Exception as error:
            text = failed(sentence(error), isinstance(error, _ANSWERS))
        finally:
            HEARD.reset(token)
        return cell, text, time.perf_counter() - start


def sentence(error: BaseException) -> str:
    """Returns the message of an exception on one line, with its kind unless it is one of foldline's."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    told = "; ".join(lines)
    if isinstance(error, Error):
        return told or type(error).__name__
    return f"{type(error).__name__}: {told}" if told else type(error).__name__


def failed(reason: str, expected: bool = True) -> str:
    """Returns the answer of a cell that has no value."""
    return json.dumps({"failure": reason, "expected": expected})


def repeatable(text: str) -> bool:
    """True if computing the cell again would give the same answer."""
    return not text.startswith('{"failure"') or bool(json.loads(text)["expected"])


def computed(payload: bytes, cells: Sequence[Cell]) -> list[Done]:
    """Computes cells on a worker; `payload` is a pickled `Job`."""
    job = _unpacked(payload)
    return [job.at(cell) for cell in cells]


def ready(payload: bytes) -> None:
    """Reads a job, which the worker then has at hand."""
    _unpacked(payload)


@lru_cache(maxsize=4)
def _unpacked(payload: bytes) -> Any:
    from . import __version__

    job = pickle.loads(payload)
    if job.version != __version__:
        message = f"a worker has foldline {__version__}, and the map was made with foldline {job.version}"
        raise Error(f"{message}\n  help: the same version on all machines")
    return job

"""What can go wrong, with the sentences of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._branch import Branch
    from ._diagram import Diagram
    from ._simulation import Trajectory


class Error(Exception):
    """Everything that foldline raises, but for `Interrupted`."""


class InputError(Error, ValueError):
    """A mistake in a text or an argument: where, what, and what would be right.

    Attributes
    ----------
    diagnostics : list of dict
        Of mistakes in texts: file, line, column, message and hint of each.
    """

    diagnostics: list[dict[str, Any]]

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.diagnostics = []


class ArgumentError(InputError, TypeError):
    """An argument of the wrong kind, such as a model where a solution is needed. The message shows the right call."""


class TraceError(InputError):
    """The function of a model does something that cannot be compiled."""


class NoSolution(Error):
    """There is nothing to start from, or nothing was found."""


class RunFileError(Error):
    """A run file cannot be made, read or continued."""


class EndedShort(UserWarning):
    """A branch ended before it got to where it was asked to go."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a computation; what was computed until then is kept.

    Attributes
    ----------
    partial : Diagram, Branch or Trajectory
        What there is. Branches that were not finished end as "stopped on request". `foldline.rescued()` returns it too.
    """

    def __init__(self, partial: Diagram | Branch | Trajectory) -> None:
        super().__init__("stopped on request; what was computed until then is in the attribute `partial`, and in foldline.rescued()")
        self.partial = partial

"""Exceptions and warnings, with the messages of the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray

    from ._branch import Branch
    from ._diagram import Diagram
    from ._ensemble import Ensemble
    from ._simulation import Trajectory


class Error(Exception):
    """Base class of all exceptions of foldline except `Interrupted`.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> try:
    ...     foldline.follow(model, "mu", (-1, 2))
    ... except foldline.Error as error:
    ...     print(error)
    the start must be a solution, but got a model
      help: find a first solution: foldline.follow(model.settle(), "mu", (-1, 2))
    """


class InputError(Error, ValueError):
    """A mistake in a text or an argument. The message gives the place, the cause and a remedy.

    Attributes
    ----------
    diagnostics : list of dict
        For mistakes in texts: file, line, column, message and hint of each. Empty for mistakes in arguments.
    """

    diagnostics: list[dict[str, Any]]

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.diagnostics = []


class ArgumentError(InputError, TypeError):
    """An argument of the wrong kind, such as a model where a solution is needed. The message shows the right call."""


class TraceError(InputError):
    """The function of a model does something that cannot be compiled. The message shows the line and a remedy."""


class NoSolution(Error):
    """Nothing was found to start from, or a branch did not begin. The message says why."""


class RunFileError(Error):
    """A run file cannot be written, read or resumed."""


class DeviceError(Error):
    """There is no graphics card to compute on, or CuPy is missing. The message says which, and what to install."""


class EndedShort(UserWarning):
    """Warning that a branch ended before it reached the end of its range, or that cells of a map have no values."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a computation. The results so far are kept.

    Attributes
    ----------
    partial : Diagram, Branch, Trajectory, Ensemble or Dataset
        The results so far. Unfinished branches end as "stopped on request". `foldline.rescued()` returns them too.
    """

    def __init__(self, partial: Diagram | Branch | Trajectory | Ensemble | xarray.Dataset) -> None:
        super().__init__("stopped on request; the results so far are in the attribute `partial` and in foldline.rescued()")
        self.partial = partial

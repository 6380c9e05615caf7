"""Diagrams: all branches of a study."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

from . import _native
from ._arguments import suggestion, wrong_kind
from ._branch import Branch, SpecialPoints, shown_in
from ._designs import Design
from ._errors import NoSolution
from ._model import Model
from ._responses import Responses, Survey, Sweep, made
from ._solution import Solution

if TYPE_CHECKING:
    import pandas
    import xarray


class Diagram:
    """The result of a study: branches by name, ``diagram["contact SL"]``, or in the order of the study.

    A run in a folder is read on first access.

    Attributes
    ----------
    folder : str or None
        Folder of the run, if there is one.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
    >>> branch.diagram
    <diagram of model: 1 branches, ...
      equilibrium over mu: ...
    >>> [own.name for own in branch.diagram]
    ['equilibrium over mu']
    """

    def __init__(
        self,
        native: _native.Diagram | Callable[[], _native.Diagram],
        model: Model | None = None,
        folder: str | None = None,
    ) -> None:
        if not (isinstance(native, _native.Diagram) or callable(native)):
            raise wrong_kind("diagrams are results of studies", native, 'foldline.open("runs/study") for a run in a folder')
        self._source = native
        self._model = model
        self.folder = folder

    @cached_property
    def _native(self) -> _native.Diagram:
        return self._source() if callable(self._source) else self._source

    @cached_property
    def model(self) -> Model:
        """Model of the study."""
        return self._model or Model(self._native.study().model())

    @property
    def study(self) -> str:
        """Text of the study, as a study file has it."""
        return self._native.study().text

    @cached_property
    def branches(self) -> list[Branch]:
        """All branches, in the order of the study."""
        return [Branch(self, index, parts) for index, parts in enumerate(self._native.branches())]

    @cached_property
    def special(self) -> SpecialPoints:
        """Special points of all branches."""
        return SpecialPoints([point for branch in self for point in branch.special])

    @property
    def notes(self) -> list[tuple[str, str]]:
        """Notes of the run as pairs of a name and a sentence: what was found for a seed, which path a homotopy took."""
        return list(self._native.notes)

    @property
    def short(self) -> list[str]:
        """Requests of the study that were not fulfilled, one line each."""
        return self._native.short()

    @cached_property
    def responses(self) -> dict[str, Survey | Sweep]:
        """The surveys and sweeps of the study by name: tables of columns, arrays of shape (responses,)."""
        return {own["name"]: made(self, own) for own in self._native.responses()}

    @cached_property
    def designs(self) -> dict[str, Design]:
        """Answers to the design questions of the study by name."""
        return {own["name"]: Design(**{**own, "range": tuple(own["range"])}) for own in self._native.designs()}

    @cached_property
    def maps(self) -> dict[str, list[dict[str, Any]]]:
        """Maps over parameters of the study by name: a row for each motion or special point of each cell, as `foldline table --map` prints it.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a*x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"a": 1.0})
        >>> study = dict(map=[dict(name="wells", what="motions", samples=16, over=dict(a=[-1.0, 1.0]))])
        >>> [(row["a"], row["motions"]) for row in foldline.run(study, model).maps["wells"]]
        [(-1.0, 'equilibrium'), (1.0, '2 equilibria')]
        """
        return dict(self._native.maps())

    @property
    def sweeps(self) -> list[Sweep]:
        """The sweeps of the study."""
        return [own for own in self.responses.values() if isinstance(own, Sweep)]

    @property
    def surveys(self) -> list[Survey]:
        """The surveys of the study."""
        return [own for own in self.responses.values() if isinstance(own, Survey)]

    def __getitem__(self, key: str | int) -> Branch:
        if isinstance(key, int):
            return self.branches[key]
        for branch in self.branches:
            if branch.name == key:
                return branch
        raise KeyError(f"{key}: {suggestion(str(key), [branch.name for branch in self.branches])}")

    def __contains__(self, name: object) -> bool:
        return any(branch.name == name for branch in self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    def __len__(self) -> int:
        return len(self.branches)

    def _shown(self, unit: Mapping[str, str] | None) -> Diagram:
        """Returns the diagram with some quantities in other units, for display only."""
        return self if not unit else Diagram(self._native.in_units(list(unit.items())))

    def plot(
        self,
        ax: Any = None,
        x: str | None = None,
        y: str | None = None,
        curves: bool = False,
        unit: Mapping[str, str] | None = None,
        sweeps: Responses | Sequence[Responses] | None = None,
    ) -> list[Any]:
        """Draws all branches with matplotlib: stable parts solid, unstable ones dashed, special points as marks.

        Parameters
        ----------
        ax : matplotlib axes, optional
            By default a new figure.
        x, y : str, optional
            Columns; by default the free parameter, and the largest value of the first output, or of the first state if there is no output.
        curves : bool
            Draw the bifurcation curves in the plane of their two parameters instead of the branches.
        unit : mapping, optional
            Units in which quantities are shown: ``{"Omega": "rpm", "r": "mm"}``; ``"orders:Omega"`` divides a frequency by a speed.
        sweeps : Sweep, Survey or list of them, optional
            Drawn over the branches; by default those of the study. An empty list draws none. Marks of a sweep point in its direction,
            filled upwards and hollow downwards; jumps are dotted. The marks of a survey distinguish equilibria (squares) from cycles (circles).

        Returns
        -------
        list of matplotlib artists

        Raises
        ------
        InputError
            If a quantity or unit is unknown, or there is nothing to draw.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> artists = branch.diagram.plot(y="x_max")
        >>> artists[0].axes.get_xlabel()
        'μ'
        """
        from ._plot import diagram

        return diagram(self._shown(unit), ax, x, y, curves, shown_in(sweeps, unit))

    def plotly(
        self,
        x: str | None = None,
        y: str | None = None,
        sweeps: Responses | Sequence[Responses] | None = None,
    ) -> Any:
        """Draws all branches as an interactive figure. The pointer shows parameters, period, multipliers and error of a point.

        Parameters
        ----------
        x, y, sweeps
            As for `plot`.

        Returns
        -------
        plotly.graph_objects.Figure

        Raises
        ------
        ImportError
            If plotly is not installed.
        InputError
            If a quantity is unknown, or there is nothing to draw.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> branch.diagram.plotly(y="x_max").layout.xaxis.title.text
        'μ'
        """
        from ._plotly import figure

        shown = [own for own in self if own.held is None] or list(self)
        return figure(shown, x, y, sweeps, self)

    def to_pandas(self, unit: Mapping[str, str] | None = None) -> pandas.DataFrame:
        """Returns a table with a row for each point of each branch, with the columns of `foldline table --points`.

        Parameters
        ----------
        unit : mapping, optional
            Units in which quantities are given, as for `plot`; by default those of the model.

        Returns
        -------
        pandas.DataFrame
            Special points are in ``diagram.special.to_pandas()``, surveys and sweeps in ``diagram.responses[name].to_pandas()``.

        Raises
        ------
        ImportError
            If pandas is not installed.
        InputError
            If a unit is unknown, or the quantity has none in the model.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> branch.diagram.to_pandas()["branch"].unique().tolist()
        ['equilibrium over mu']
        """
        from ._tables import branches_frame

        return branches_frame(list(self._shown(unit)))

    def to_xarray(self) -> xarray.Dataset:
        """Returns a data set over the dimensions `point`, `eigenvalue` and `variable`.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        ImportError
            If xarray is not installed.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> branch.diagram.to_xarray().sizes["point"] == len(branch)
        True
        """
        from ._tables import branches_dataset

        return branches_dataset(list(self))

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes a run file, which `foldline.open`, the command line and every reader of SQLite can read.

        Parameters
        ----------
        folder : path
            Folder for the run; it is created if needed.

        Raises
        ------
        RunFileError
            If the folder holds a run already or cannot be written to.

        Examples
        --------
        >>> import foldline
        >>> import os, tempfile
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> branch = foldline.follow(model.settle([1.0]), "mu", (-1, 2))
        >>> folder = os.path.join(tempfile.mkdtemp(), "run")
        >>> branch.diagram.save(folder)
        >>> len(foldline.open(folder).special)
        1
        """
        self._native.save(os.fspath(folder))

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the run file. The folder of the run, if there is one, is not known to the copy."""
        with tempfile.TemporaryDirectory() as folder:
            self._native.save(folder)
            with open(os.path.join(folder, _RUN), "rb") as file:
                return _unpacked, (type(self), file.read())

    def __repr__(self) -> str:
        from ._html import diagram_text

        return diagram_text(self)

    def _repr_html_(self) -> str:
        from ._html import diagram

        return diagram(self)


#: Name of the run file in its folder.
_RUN = "run.sqlite"


def _unpacked(kind: type[Diagram], run: bytes) -> Diagram:
    """Returns a diagram from its run file."""
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, _RUN), "wb") as file:
            file.write(run)
        return kind(_native.Diagram.load(folder))


class Homotopy(Diagram):
    """The result of `foldline.homotopy`: a solution carried to new parameter values, and the branches of the path.

    Examples
    --------
    >>> import foldline
    >>> cusp = foldline.model(equations={"x": "h + r*x - x^3"}, parameters={"h": 1.0, "r": 1.0})
    >>> found = foldline.homotopy(cusp.settle([1.3]), {"h": 0.5}, "r", (-1, 2))
    >>> found.arrived
    True
    """

    name: str = "homotopy"

    @cached_property
    def _arrival(self) -> Solution | None:
        found = self._native.arrival(self.name)
        return None if found is None else Solution(found, self.model)

    @property
    def arrived(self) -> bool:
        """True if a path reached the target."""
        return self._arrival is not None

    @property
    def end(self) -> Solution:
        """The solution at the target.

        Raises
        ------
        NoSolution
            If no path reached the target; the message lists the paths that were tried.
        """
        if self._arrival is None:
            raise NoSolution("\n".join(note for _, note in self.notes) or "the target was not reached")
        return self._arrival

    @property
    def route(self) -> list[str]:
        """Path taken, in sentences."""
        return [note for about, note in self.notes if about == self.name]

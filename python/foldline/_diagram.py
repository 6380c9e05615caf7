"""Diagrams: all branches of a study."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any

from . import _native
from ._branch import Branch, SpecialPoints
from ._errors import NoSolution
from ._model import Model
from ._responses import Survey, Sweep, made
from ._solution import Solution

if TYPE_CHECKING:
    import pandas
    import xarray


class Diagram:
    """What a study has found: branches by name, ``diagram["contact SL"]``, or in the order of the study.

    A run that was written to a folder is read from there when it is first looked at.

    Attributes
    ----------
    folder : str or None
        Where the run is written, if it is.
    """

    def __init__(
        self,
        native: _native.Diagram | Callable[[], _native.Diagram],
        model: Model | None = None,
        folder: str | None = None,
    ) -> None:
        self._source = native
        self._model = model
        self.folder = folder

    @cached_property
    def _native(self) -> _native.Diagram:
        return self._source() if callable(self._source) else self._source

    @cached_property
    def model(self) -> Model:
        """The model of the study."""
        return self._model or Model(self._native.study().model())

    @property
    def study(self) -> str:
        """The study, as a study file has it."""
        return self._native.study().text

    @cached_property
    def branches(self) -> list[Branch]:
        """Every branch, in the order of the study."""
        return [Branch(self, index, parts) for index, parts in enumerate(self._native.branches())]

    @cached_property
    def special(self) -> SpecialPoints:
        """The special points of all branches."""
        return SpecialPoints([point for branch in self for point in branch.special])

    @property
    def notes(self) -> list[tuple[str, str]]:
        """What each remark is about, and the remark: what was found for a seed, which route a homotopy took."""
        return list(self._native.notes)

    @property
    def short(self) -> list[str]:
        """What of the study was not reached, a line each."""
        return self._native.short()

    @cached_property
    def responses(self) -> dict[str, Survey | Sweep]:
        """The surveys and sweeps of the study by name: tables of columns, arrays of shape (responses,)."""
        return {own["name"]: made(self, own) for own in self._native.responses()}

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
        raise KeyError(f"{key}: one of {', '.join(branch.name for branch in self.branches)}")

    def __contains__(self, name: object) -> bool:
        return any(branch.name == name for branch in self.branches)

    def __iter__(self) -> Iterator[Branch]:
        return iter(self.branches)

    def __len__(self) -> int:
        return len(self.branches)

    def _shown(self, unit: Mapping[str, str] | None) -> Diagram:
        """The same diagram with some quantities in other units, to be shown; nothing starts from it."""
        return self if not unit else Diagram(self._native.in_units(list(unit.items())))

    def plot(
        self,
        ax: Any = None,
        x: str | None = None,
        y: str | None = None,
        curves: bool = False,
        unit: Mapping[str, str] | None = None,
    ) -> list[Any]:
        """Draws all branches: stable pieces solid, unstable ones dashed, special points as marks.

        Parameters
        ----------
        ax : matplotlib axes, optional
        x, y : str, optional
            Columns; by default the free parameter, and the largest value of the first output.
        curves : bool
            Curves in two parameters, in their plane, instead of the branches.
        unit : mapping, optional
            Units in which quantities are shown: ``{"Omega": "rpm", "r": "mm"}``; ``"orders:Omega"`` divides a frequency by a speed.

        Returns
        -------
        list of matplotlib artists
        """
        from ._plot import diagram

        return diagram(self._shown(unit), ax, x, y, curves)

    def plotly(self, x: str | None = None, y: str | None = None) -> Any:
        """An interactive figure; a point tells its parameters, its period, its multipliers and its error.

        Parameters
        ----------
        x, y : str, optional
            Columns, as for `plot`.

        Returns
        -------
        plotly.graph_objects.Figure
        """
        from ._plotly import figure

        return figure([own for own in self if own.held is None] or list(self), x, y)

    def to_pandas(self, unit: Mapping[str, str] | None = None) -> pandas.DataFrame:
        """A table with a row for each point of each branch and the columns of `foldline table --points`; `unit` as for `plot`."""
        from ._tables import branches_frame

        return branches_frame(list(self._shown(unit)))

    def to_xarray(self) -> xarray.Dataset:
        """A data set over the dimensions `point`, `eigenvalue` and `variable`."""
        from ._tables import branches_dataset

        return branches_dataset(list(self))

    def save(self, folder: str | os.PathLike[str]) -> None:
        """Writes a run file, which `foldline.open`, the command line and every reader of SQLite can read.

        Parameters
        ----------
        folder : path
            Made if it is not there; one that has a run in it already is refused.
        """
        self._native.save(os.fspath(folder))

    def __repr__(self) -> str:
        from ._html import diagram_text

        return diagram_text(self)

    def _repr_html_(self) -> str:
        from ._html import diagram

        return diagram(self)


class Homotopy(Diagram):
    """A family brought to other parameter values: the runs on its way, and where it arrived."""

    name: str = "homotopy"

    @cached_property
    def _arrival(self) -> Solution | None:
        found = self._native.arrival(self.name)
        return None if found is None else Solution(found, self.model)

    @property
    def arrived(self) -> bool:
        """Whether some way got through."""
        return self._arrival is not None

    @property
    def end(self) -> Solution:
        """The solution at the goal.

        Raises
        ------
        NoSolution
            Where no way got through; the message tells the ways that were tried.
        """
        if self._arrival is None:
            raise NoSolution("\n".join(note for _, note in self.notes) or "the goal was not reached")
        return self._arrival

    @property
    def route(self) -> list[str]:
        """Which way it took, in sentences."""
        return [note for about, note in self.notes if about == self.name]

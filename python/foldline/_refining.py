"""Refinement of a map over one or two parameters where the answer changes from cell to cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from ._cells import Cell
from ._errors import InputError
from ._layout import Layout, grid

#: Largest number of cells of a fine grid.
LARGEST = 4_000_000
#: Index of a cell on the fine grid.
Index = tuple[int, ...]
#: Lowest corner of a box, and its size along every dimension.
Box = tuple[Index, int]


class Refined:
    """A grid whose boxes are halved where the cells on their edges differ.

    Boxes have a cell at each corner. A box is split along every dimension if two cells on its edges differ, those of smaller
    neighbours included, until all differ by one step of the fine grid only. A region that lies within one box of the first grid,
    so that no cell falls into it, is not found.
    """

    def __init__(self, layout: Layout, depth: int) -> None:
        if layout.axes is None or len(layout.axes) > 2:
            raise InputError("only a grid over one or two parameters can be refined\n  help: over={...} with one or two parameters")
        for name, own in zip(layout.names, layout.axes, strict=True):
            steps = np.diff(own)
            if not len(steps) or not ((steps > 0).all() or (steps < 0).all()):
                raise InputError(f"the values of {name} do not rise or fall throughout\n  help: at least two values in order")
        self.factor = 2**depth
        size = math.prod((len(own) - 1) * self.factor + 1 for own in layout.axes)
        if size > LARGEST:
            raise InputError(f"the fine grid would have {size} cells\n  help: a smaller refine=; at most {LARGEST} cells")
        axes = []
        for own in layout.axes:
            inner = own[:-1, None] + np.diff(own)[:, None] * (np.arange(self.factor) / self.factor)[None, :]
            axes.append(np.append(inner.ravel(), own[-1]))
        self.fine: Layout = grid(layout.names, axes)
        counts = [range(0, len(own) - self.factor, self.factor) for own in axes]
        self.boxes: list[Box] = [(corner, self.factor) for corner in product(*counts)]
        self._values = [own.tolist() for own in axes]

    def cell(self, index: Index) -> Cell:
        """Returns the values of the parameters at an index."""
        return tuple(own[k] for own, k in zip(self._values, index, strict=True))

    def _edge(self, box: Box) -> Iterator[Index]:
        """Yields the indices on the edges of a box; in one dimension its ends."""
        corner, size = box
        if len(corner) == 1:
            yield from ((corner[0],), (corner[0] + size,))
            return
        (i, j), steps = corner, range(size + 1)
        for k in steps:
            yield from ((i + k, j), (i + k, j + size), (i, j + k), (i + size, j + k))

    def _seen(self, box: Box, categories: Mapping[Cell, str]) -> set[str]:
        return {categories[cell] for cell in map(self.cell, self._edge(box)) if cell in categories}

    def split(self, categories: Mapping[Cell, str]) -> list[Cell]:
        """Splits boxes and returns the cells that are needed next; none if no box is to be split."""
        kept: list[Box] = []
        wanted: dict[Index, None] = {}
        for box in self.boxes:
            corner, size = box
            if size == 1 or len(self._seen(box, categories)) < 2:
                kept.append(box)
                continue
            half = size // 2
            steps: Sequence[tuple[int, ...]] = list(product((0, 1), repeat=len(corner)))
            kept += [(tuple(c + half * s for c, s in zip(corner, step, strict=True)), half) for step in steps]
            for step in product((0, 1, 2), repeat=len(corner)):
                wanted[tuple(c + half * s for c, s in zip(corner, step, strict=True))] = None
        self.boxes = kept
        return [cell for cell in map(self.cell, sorted(wanted)) if cell not in categories]

    def filled(self, categories: Mapping[Cell, str]) -> dict[Cell, str]:
        """Returns the category of every cell of the fine grid: between cells that agree, theirs."""
        found = dict(categories)
        for corner, size in self.boxes:
            own = categories[self.cell(corner)]
            for index in product(*(range(c, c + size + 1) for c in corner)):
                found.setdefault(self.cell(index), own)
        return found


def refine(
    refined: Refined, answers: Mapping[Cell, str], category: Callable[[str], str], compute: Callable[[list[Cell]], None]
) -> dict[Cell, str]:
    """Refines until nothing is left to split; returns the category of every cell."""
    categories: dict[Cell, str] = {}

    def read(cells: Sequence[Cell]) -> None:
        categories.update({cell: category(answers[cell]) for cell in cells})

    read([refined.cell(corner) for corner in product(*(range(0, n, refined.factor) for n in refined.fine.shape))])
    while True:
        before = len(refined.boxes)
        wanted = refined.split(categories)
        if wanted:
            compute(wanted)
            read(wanted)
        if len(refined.boxes) == before:
            return refined.filled(categories)

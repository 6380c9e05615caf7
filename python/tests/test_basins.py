"""Basins of attraction as arrays."""

import numpy as np
import pytest
from matplotlib import pyplot

import foldline


@pytest.fixture(scope="module")
def well():
    box = dict(range=(-2, 2))
    return foldline.model(equations={"x": "v", "v": "x - x^3 - d*v"}, states={"x": box, "v": box}, parameters={"d": 0.3})


@pytest.fixture(scope="module")
def found(well):
    return foldline.basins(well, samples=200, plane=("x", "v"), cells=(30, 20))


def test_cells_opposite_each_other_go_to_opposite_wells(found):
    assert found.cells.shape == (20, 30) and found.x.shape == (30,) and found.y.shape == (20,)
    assert np.array_equal(found.cells[::-1, ::-1], 1 - found.cells)
    assert found.part(0) == found.part(1) == 0.5
    assert (found.x[0], found.x[-1]) == pytest.approx((-2 + 2 / 30, 2 - 2 / 30))


def test_an_adaptive_section_says_which_cells_it_computed(well, found):
    own = foldline.basins(well, samples=0, plane=("x", "v"), cells=(60, 40), adaptive=8)
    known, checked, wrong = own.filled
    assert known.shape == own.cells.shape == (40, 60) and set(np.unique(known)) == {0, 1}
    assert 0 < checked and wrong <= checked and found.filled is None
    full = foldline.basins(well, samples=0, plane=("x", "v"), cells=(60, 40))
    # The attractors may come in another order.
    off = min((own.cells != full.cells).sum(), (own.cells != 1 - full.cells).sum())
    # Upper end of Wilson's interval for the error rate of the filled cells.
    square = 1.96**2
    rate = (wrong + square / 2 + 1.96 * (wrong * (checked - wrong) / checked + square / 4) ** 0.5) / (checked + square)
    assert off <= rate * (known == 0).sum()
    with pytest.raises(foldline.ArgumentError, match="without a plane"):
        foldline.basins(well, adaptive=8)


def test_the_fate_of_a_cell_is_that_of_its_trajectory(well, found):
    column, row = 3, 14
    end = well.simulate([found.x[column], found.y[row]], 200.0, times=[200.0]).states[-1]
    assert np.abs(end - found.attractors[found.cells[row, column]].state).max() < 1e-6


def test_shares_have_intervals_that_contain_a_half(found):
    for fate in (0, 1):
        value, low, high = found.share(fate)
        assert low < value < high and low < 0.5 < high
    assert found.share(-1)[0] == 0.0 and found.samples.shape == (200, 2)
    for state, fate in zip(found.samples[:5], found.fates[:5], strict=True):
        assert np.abs(found.model.settle(state).state - found.attractors[fate].state).max() < 1e-6


def test_ranges_and_values_can_be_given(well):
    small = foldline.basins(well, samples=20, ranges={"x": (0.9, 1.1), "v": (-0.1, 0.1)})
    assert len(small.attractors) == 1 and small.attractors[0].state[0] == pytest.approx(1.0)
    assert small.axes is None and small.cells.size == 0
    assert (small.samples[:, 0] >= 0.9).all() and (small.samples[:, 0] <= 1.1).all()


def test_it_is_drawn_with_a_legend(found):
    axes = found.plot()
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert len(texts) == 2 and all("50.0 %" in text for text in texts)
    assert "of plane" in repr(found)
    pyplot.close("all")


def test_mistakes_are_explained(well):
    for wrong, words in (
        (dict(plane=("x", "w")), "no state `w`"),
        (dict(plane="xv"), "not a pair of states"),
        (dict(samples=0), "nothing is left to compute"),
        (dict(plane=("x", "v"), at={"x": 1.0}), "an axis of the plane"),
        (dict(ranges={"x": (1, -1)}), "smallest, largest"),
        (dict(plane=("x", "v"), ranges={"x": (1, 1)}), "the range of x is empty"),
    ):
        with pytest.raises(foldline.InputError, match=words):
            foldline.basins(well, **wrong)

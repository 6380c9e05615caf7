"""Pictures: the lines drawn, and the values returned."""

import numpy as np
import pytest
from matplotlib import pyplot

import foldline


@pytest.fixture(scope="module")
def cycles(steady):
    return steady.switch(steady.special[0])


@pytest.fixture(autouse=True)
def closed():
    yield
    pyplot.close("all")


def test_a_branch_is_solid_where_it_is_stable_and_changes_at_the_special_point(steady):
    artists = steady.plot()
    solid, dashed, marks = artists
    assert (solid.get_linestyle(), dashed.get_linestyle()) == ("-", "--")
    hopf = steady.special[0]
    assert solid.get_xdata()[-1] == dashed.get_xdata()[0] == hopf["B"]
    assert solid.get_ydata()[-1] == dashed.get_ydata()[0] == hopf["x_max"]
    assert marks.get_xdata() == [hopf["B"]]
    assert (marks.get_markerfacecolor(), marks.get_marker()) == ("white", "D")
    assert marks.get_label() == "hopf, supercritical"
    assert solid.axes.get_xlabel() == "B"
    drawn = np.concatenate([line.get_xydata() for line in (solid, dashed)])
    for place in zip(steady["B"], steady["x_max"], strict=True):
        assert (drawn == place).all(axis=1).any()


def test_axes_and_quantities_can_be_given(cycles):
    _, ax = pyplot.subplots()
    artists = cycles.plot(ax, y="period", color="black")
    assert all(artist.axes is ax for artist in artists)
    assert artists[0].get_color() == "black"
    with pytest.raises(foldline.InputError, match="there is no quantity `w`"):
        cycles.plot(y="w")


def test_a_diagram_has_a_colour_for_each_root(cycles):
    artists = cycles.diagram.plot()
    assert len({artist.get_color() for artist in artists}) == 1
    assert len(artists) >= 4


def test_a_curve_in_two_parameters_is_drawn_in_their_plane(steady):
    curve = foldline.hold(steady.special[0], "A", (0.8, 1.2))
    (line,) = curve.plot()
    assert line.axes.get_xlabel() == "B"
    assert line.axes.get_ylabel() == "A"
    assert curve.diagram.plot(curves=True)


def test_a_cycle_is_drawn_in_panels(cycles, rotor):
    panels = cycles[3].plot()
    assert list(panels) == ["orbit", "series", "multipliers"]
    whirling = rotor.settle("2:1", parameters={"kappa": 1}, samples=48)
    panels = whirling.plot()
    assert list(panels) == ["orbit", "series", "spectrum", "multipliers"]
    circle = panels["multipliers"][0]
    assert np.allclose(np.hypot(circle.get_xdata(), circle.get_ydata()), 1)
    drawn = sum(len(line.get_xdata()) for line in panels["multipliers"][1:])
    assert drawn == len(whirling.spectrum)
    assert panels["orbit"][0].axes.get_xlabel() == "u"
    # No multiplier is unstable, whichever side of 1 the trivial one is on.
    assert len(panels["multipliers"][-1].get_xdata()) == whirling.unstable == 0


def test_an_equilibrium_is_drawn_as_its_eigenvalues(steady):
    assert list(steady[0].plot()) == ["multipliers"]


def test_an_interactive_figure_shows_details_on_hover(cycles):
    pytest.importorskip("plotly")
    figure = cycles.diagram.plotly()
    names = [trace.name for trace in figure.data]
    assert "hopf" in names
    lines = [trace for trace in figure.data if trace.mode == "lines"]
    assert {trace.line.dash for trace in lines} == {"solid", "dash"}
    told = [trace for trace in figure.data if trace.mode == "markers" and trace.name == cycles.name]
    assert len(told[0].text) == len(cycles)
    text = told[0].text[2]
    for word in ("A = ", "B = ", "period ", "multipliers ", "error "):
        assert word in text
    assert cycles.plotly().data


def test_special_points_are_hollow_and_marks_are_dots(brusselator):
    pytest.importorskip("plotly")
    branch = foldline.follow(brusselator.settle(), "B", (0.5, 4), mark={"B": 1.0})
    symbols = {trace.name: list(trace.marker.symbol) for trace in branch.plotly().data if trace.name in ("hopf", "mark")}
    assert symbols == {"hopf": ["diamond-open"], "mark": ["circle-dot"]}


def test_trajectories_are_drawn(brusselator):
    track = brusselator.simulate([1.0, 1.0], 5)
    assert len(track.plot()) == 2

"""Sweeps and surveys as single calls."""

import numpy as np
import pytest
from matplotlib import pyplot

import foldline


@pytest.fixture(autouse=True)
def closed():
    yield
    pyplot.close("all")


@pytest.fixture(scope="module")
def cusp():
    """x' = h + x - x³ has folds at h = ±2/√27 = ±0.3849."""
    return foldline.model(equations={"x": "h + x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"h": -1.0})


@pytest.fixture(scope="module")
def loop(cusp):
    return foldline.sweep(cusp.settle([-1.3]), "h", (-1, 1), 21, back=True)


@pytest.fixture(scope="module")
def survey(cusp):
    return foldline.survey(cusp, "h", (-1, 1), 5, starts=16)


def test_a_sweep_there_and_back_jumps_beyond_both_folds(loop):
    assert loop.jumps.round(9).tolist() == [[0.3, 0.4], [-0.3, -0.4]]
    assert [direction for direction, _ in loop.legs] == ["up", "down"]
    up, down = (leg for _, leg in loop.legs)
    assert np.allclose(loop.value[up], np.linspace(-1, 1, 21))
    assert np.allclose(loop.value[down], np.linspace(1, -1, 21))
    # Every response is an equilibrium.
    assert np.abs(loop["h"] + loop["x"] - loop["x"] ** 3).max() < 1e-6
    assert set(loop.motion) == {"equilibrium"}
    assert (loop["x"] == loop["x_max"]).all()


def test_the_order_of_the_range_is_the_direction(cusp):
    down = foldline.sweep(cusp.settle([1.3], parameters={"h": 1.0}), "h", (1, -1), 21)
    assert down.jumps.round(9).tolist() == [[-0.3, -0.4]]
    assert [direction for direction, _ in down.legs] == ["down"]
    by_values = foldline.sweep(cusp.settle([1.3], parameters={"h": 1.0}), "h", values=np.linspace(1, -1, 21))
    assert np.allclose(by_values["x"], down["x"], atol=1e-6)


def test_a_sweep_of_a_model_starts_at_its_first_value(cusp):
    assert foldline.sweep(cusp, "h", (-1, 1), 21).jumps.round(9).tolist() == [[0.3, 0.4]]


def test_an_output_with_a_corner_makes_no_jump():
    """|x| has its smallest value at a corner, which every mesh meets a little differently."""

    @foldline.model(
        states="x v",
        parameters=dict(zeta=0.05, A=0.3, omega=0.5),
        frequency="omega",
        outputs={"amplitude": lambda s, p: abs(s.x)},
    )
    def duffing(s, p, t):
        return s.v, p.A * np.cos(p.omega * t) - 2 * p.zeta * s.v - s.x - s.x**3

    sweep = foldline.sweep(duffing, "omega", (0.5, 2.5), 21)
    branch = foldline.follow(duffing.settle("cycle"), "omega", (0.5, 2.5))
    fold = max(point["omega"] for point in branch.special["fold"])
    ((before, after),) = sweep.jumps
    assert before < fold < after
    lines = branch.plot(y="x_max", sweeps=sweep)
    assert lines


def test_a_survey_has_attractors_with_basin_fractions(survey):
    assert np.unique(survey.value).tolist() == [-1.0, -0.5, 0.0, 0.5, 1.0]
    middle = survey.at(0.01)
    assert middle["value"].tolist() == [0.0, 0.0]
    # The error is relative to scale plus size, here 1 + 1.
    assert (np.abs(np.sort(middle["x_max"]) - [-1.0, 1.0]) <= 2 * middle["error"].max()).all()
    assert 0 < middle["error"].max() <= 1e-6
    for value in np.unique(survey.value):
        own = survey.at(value)
        assert own["hits"].sum() == 16
        assert own["share"].sum() == pytest.approx(1, abs=1e-12)
    low, high = survey.share[:, 1], survey.share[:, 2]
    assert (low <= survey.share[:, 0]).all() and (survey.share[:, 0] <= high).all()


def test_escaping_starts_have_no_ranges_and_do_not_affect_those_of_others():
    """x' = mu - x² has no attractor below mu = 0; above it, starts below -√mu escape and the others go to √mu."""
    model = foldline.model(equations={"x": "mu - x^2"}, states={"x": dict(range=(-3, 3))}, parameters={"mu": 1.0})
    survey = foldline.survey(model, "mu", (-1, 1), 3, starts=16)
    assert survey.at(-1)["motion"].tolist() == ["escaped"]
    assert np.isnan(survey.at(-1)["x_max"]).all()
    one = survey.at(1)
    found = dict(zip(one["motion"], one["x_max"], strict=True))
    # The error is relative to scale plus size, here 1.5 + 1.
    error = np.nanmax(one["error"])
    assert 0 < error <= 1e-6
    assert abs(found["equilibrium"] - 1) <= 2.5 * error
    assert np.isnan(found["escaped"])
    assert survey.to_pandas()["x_max"].notna().sum() == (survey.motion == "equilibrium").sum()
    assert survey.plot()
    with pytest.warns(foldline.EndedShort, match="the motion grows without bound") as warned:
        down = foldline.sweep(model.settle([1.0]), "mu", (1, -1), 5)
    assert {own.filename for own in warned} == {__file__}
    assert down.motion[-1] == "escaped"
    assert abs(down["x_max"][0] - 1) <= 2.5 * down["error"][0] <= 2.5e-9


def test_sweeps_and_surveys_convert_to_tables_and_runs(loop, survey, tmp_path):
    frame = loop.to_pandas()
    assert len(frame) == len(loop.value)
    assert "hits" not in frame and "jumped" in frame
    assert (frame["x_max"].to_numpy() == loop["x_max"]).all()
    frame = survey.to_pandas()
    assert "share" in frame and "jumped" not in frame
    loop.diagram.save(tmp_path / "run")
    again = foldline.open(tmp_path / "run")
    assert [own.name for own in again.sweeps] == [loop.name]
    assert (again.sweeps[0]["x_max"] == loop["x_max"]).all()
    assert repr(again.sweeps[0]) == repr(loop)
    assert "jumps: 0.3 → 0.4; -0.3 → -0.4" in repr(loop)
    assert "6 × equilibrium" in repr(survey)
    for own in (loop, survey):
        assert own._repr_html_().count("<tr>") == min(len(own.value), 40) + 1
    with pytest.raises(KeyError, match="did you mean `x_max`"):
        loop["x_maxx"]


def test_values_may_have_units():
    model = foldline.model(
        equations={"x": "h - k*x"},
        parameters={"h": dict(value=1.0, unit="mm/s"), "k": dict(value=1.0, unit="1/s")},
        states={"x": dict(range=(-3, 3), unit="mm")},
    )
    sweep = foldline.sweep(model.settle([1.0]), "h", ("0.001 m/s", "0.003 m/s"), 3, back=True)
    assert np.allclose(sweep["h"], [1, 2, 3, 2, 1])
    assert np.allclose(sweep["x"], sweep["h"], atol=1e-6)
    with pytest.raises(foldline.InputError, match="different units"):
        foldline.sweep(model.settle([1.0]), "h", ("1 mm/s", "0.003 m/s"), 3, back=True)


def test_sweeps_and_surveys_are_drawn_over_branches(cusp, loop, survey):
    branch = foldline.follow(cusp.settle([-1.3]), "h", (-1, 1))
    alone = branch.plot()
    pyplot.close("all")
    both = branch.plot(sweeps=[loop, survey])
    lines = [own for own in both[len(alone) :] if hasattr(own, "get_xdata")]
    up, down = (own for own in lines if own.get_marker() in "<>")
    assert (up.get_marker(), down.get_marker()) == (">", "<")
    # In print without colours the directions differ by the filling of their marks.
    assert up.get_markerfacecolor() != "none" and down.get_markerfacecolor() == "none"
    assert [len(up.get_xdata()), len(down.get_xdata())] == [21, 20]
    jumps = [own for own in lines if own.get_linestyle() == ":"]
    assert sorted(own.get_xdata().round(9).tolist() for own in jumps) == [[-0.3, -0.4], [0.3, 0.4]]
    assert [own.get_text() for own in both if hasattr(own, "get_text")] == ["up →", "down ←"]
    (marks,) = (own for own in lines if own.get_marker() == "s")
    assert len(marks.get_xdata()) == len(survey.value)
    with pytest.raises(foldline.InputError, match="has no quantity `x_mean`"):
        loop.plot(y="x_mean")


def test_a_diagram_draws_the_surveys_and_sweeps_of_its_study(brusselator):
    study = {
        "seed": [{"name": "rest", "attractor": "equilibrium"}],
        "branch": [{"name": "steady", "from": "rest", "free": "B", "range": [0.5, 4], "switch": {"hopf": 1}}],
        "sweep": [{"name": "up", "from": "rest", "free": "B", "range": [1, 3], "count": 5}],
        "survey": [{"name": "what attracts", "free": "B", "range": [1, 3], "count": 3, "starts": 4}],
    }
    diagram = foldline.run(study, brusselator)
    labels = [own.get_label() for own in diagram.plot()]
    assert "up →" in labels
    assert "what attracts: cycle" in labels
    pyplot.close("all")
    assert "up →" not in [own.get_label() for own in diagram.plot(sweeps=[])]
    pyplot.close("all")
    # Over another quantity than their parameter they are left out.
    assert "up →" not in [own.get_label() for own in diagram.plot(x="y_max", y="x_max")]
    pytest.importorskip("plotly")
    figure = diagram.plotly()
    named = {trace.name: trace for trace in figure.data if trace.name}
    assert named["up, up →"].marker.symbol == "triangle-right"
    assert "basin fraction" in named["what attracts: cycle"].text[0]
    assert "up, up →" not in [trace.name for trace in diagram.plotly(sweeps=[]).data]


def test_a_survey_draws_basin_fractions(survey):
    (bars,) = survey.plot(y="share")
    assert bars.lines[0].axes.get_ylabel() == "basin fraction"
    assert bars.has_yerr


def test_a_study_of_sweeps_alone_is_drawn(loop, survey):
    assert loop.diagram.plot()
    assert loop.plot()
    pytest.importorskip("plotly")
    assert loop.diagram.plotly().data
    symbols = {trace.marker.symbol for trace in loop.diagram.plotly().data if trace.mode == "markers"}
    assert symbols == {"triangle-right", "triangle-left-open"}


@pytest.fixture(scope="module")
def linear():
    """x' = cos(w t) - x settles to (cos(w t) + w sin(w t))/(1 + w²)."""
    return foldline.model(equations={"x": "cos(w*t) - x"}, parameters={"w": 1.0}, frequency="w", outputs={"twice": "2*x"})


def test_stroboscopic_points_agree_with_a_known_motion(linear):
    points = foldline.strobe(linear, "w", (1, 2), 5, periods=3, transient=20, back=True)
    assert points.values.tolist() == [1.0, 1.25, 1.5, 1.75, 2.0, 1.75, 1.5, 1.25, 1.0]
    assert np.allclose(points["x"], 1 / (1 + points.values**2)[:, None], atol=1e-6)
    assert np.allclose(points["twice"], 2 * points["x"], rtol=1e-12)
    frame = points.to_pandas()
    assert list(frame.columns) == ["w", "period_number", "x", "twice"]
    assert len(frame) == 27
    with pytest.raises(KeyError, match="did you mean `twice`"):
        points["twicee"]


def test_stroboscopic_points_are_drawn_under_a_branch(linear):
    points = foldline.strobe(linear, "w", (1, 2), 5, periods=3, transient=20)
    branch = foldline.follow(linear.settle("cycle"), "w", (0.5, 2))
    dots, line = branch.plot(strobe=points)
    assert len(dots.get_xdata()) == 15
    across, up = line.get_xdata(), line.get_ydata()
    # At the points of the branch; between them the curve is rounded.
    assert across[::8].tolist() == branch["w"].tolist()
    assert np.allclose(up[::8], 1 / (1 + across[::8] ** 2), atol=1e-5)
    assert np.allclose(up, 1 / (1 + across**2), atol=5e-3)
    assert "start of a forcing period" in line.axes.get_ylabel()
    assert len(points.plot(y="twice")) == 1
    with pytest.raises(foldline.InputError, match="no state or output `y`"):
        points.plot(y="y")
    with pytest.raises(foldline.ArgumentError, match="stroboscopic points are needed"):
        branch.plot(strobe=[1.0])


def test_a_cycle_of_two_forcing_periods_shows_as_two_points():
    """A Duffing oscillator in two wells, after a period doubling."""
    duffing = foldline.model(
        equations={"x": "v", "v": "x - x^3 - 0.25*v + A*cos(t)"}, parameters={"A": 0.2}, frequency="1", states=dict(x={}, v={})
    )
    simple = duffing.settle([1.0, 0.0])
    branch = foldline.follow(simple, "A", (0.1, 0.35))
    doubled = branch.switch(branch.special["period-doubling"][0])
    stable = [point for point in doubled if point.stable]
    start = stable[len(stable) // 2]
    assert start.forcing_periods == 2
    points = foldline.strobe(start, "A", values=[start["A"]], periods=6, transient=100)
    seen = np.unique(points["x"].round(4))
    expected = np.unique(start.uniform(2)["x"].round(4))
    assert len(seen) == 2
    assert np.allclose(seen, expected, atol=2e-4)
    lines = doubled.plot(strobe=points)
    assert len(lines) > 2


def test_stroboscopic_points_need_a_forcing(cusp):
    with pytest.raises(foldline.InputError, match="is not forced"):
        foldline.strobe(cusp, "h", (0, 1))

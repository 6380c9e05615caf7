"""Branches, curves, runs on disk, tables."""

import numpy as np
import pytest

import foldline


def test_the_brusselator_has_its_hopf_point_at_the_theoretical_value(steady):
    """B = 1 + A², and the first Lyapunov coefficient is negative."""
    (hopf,) = steady.special
    assert hopf.kind == "hopf"
    assert hopf["B"] == pytest.approx(2.0, abs=2 * hopf.error)
    assert hopf.criticality == "supercritical"
    assert (hopf.unstable_before, hopf.unstable_after) == (0, 2)
    assert (steady.stable == (steady["B"] < 2)).all()
    assert steady.complete


def test_a_hopf_point_can_be_switched_at_and_continued(steady):
    hopf = steady.special["hopf"][0]
    cycles = steady.switch(hopf)
    assert cycles.family == "cycle"
    # At the Hopf point the frequency is A = 1.
    assert cycles["period"][np.argmin(cycles["B"])] == pytest.approx(2 * np.pi, rel=1e-4)
    curve = foldline.hold(hopf, "A", (0.5, 1.5))
    assert curve.held == ("hopf", "B")
    assert np.allclose(curve["B"], 1 + curve["A"] ** 2, rtol=1e-7)


def test_a_point_of_a_branch_starts_a_branch_in_another_parameter(steady):
    hopf = steady.special[0]
    cycles = steady.switch(hopf)
    start = cycles[-1]
    other = foldline.follow(start, "A", (0.8, 1.2))
    home = other[int(np.argmin(np.abs(other.position)))]
    assert home.period == pytest.approx(start.period, rel=1e-6)
    assert other["B"].tolist() == [start["B"]] * len(other)


def test_an_unstable_cycle_starts_a_branch(brusselator):
    """No simulation would reach it: it is used as given, not settled again."""
    lorenz = foldline.model(
        equations={"x": "sigma*(y - x)", "y": "x*(rho - z) - y", "z": "x*y - beta*z"},
        parameters=dict(sigma=10.0, rho=20.0, beta=8 / 3),
    )
    rest = foldline.follow(lorenz.settle([7.0, 7.0, 19.0]), "rho", (14, 26))
    saddle = rest.switch(rest.special["hopf"][0])[2]
    assert not saddle.stable
    branch = foldline.follow(saddle, "sigma", (9.5, 10.5))
    assert branch.family == "cycle"
    assert not branch.stable.any()
    home = branch[int(np.argmin(np.abs(branch.position)))]
    assert home.period == pytest.approx(saddle.period, rel=1e-6)


def test_only_the_given_special_point_is_switched_at():
    """x' = mu (mu - 2) x - x³ has a pitchfork at mu = 0 and another one at mu = 2."""
    model = foldline.model(equations={"x": "mu*(mu - 2)*x - x^3"}, parameters=dict(mu=1.0))
    both = foldline.follow(model.settle([0.0]), "mu", (-1, 3), switch={"branch-point": 1})
    one = foldline.follow(model.settle([0.0]), "mu", (-1, 3), switch={"branch-point-2": 1})
    assert [own.kind for own in one.special] == ["branch-point", "branch-point"]
    assert len(both.switched) == 2
    (other,) = one.switched
    assert other.name == f"{one.name}/branch-point-2"
    assert np.allclose(np.abs(other["x"]), np.sqrt(np.maximum(other["mu"] * (other["mu"] - 2), 0)), atol=1e-5)


def test_a_saved_run_is_opened_to_the_last_bit(steady, tmp_path):
    cycles = steady.switch(steady.special[0])
    cycles.save(tmp_path / "run")
    again = foldline.open(tmp_path / "run")
    assert again.study == cycles.diagram.study
    assert [own.name for own in again] == [own.name for own in cycles.diagram]
    for a, b in zip(again, cycles.diagram, strict=True):
        assert (a.origin, a.ends, a.free, a.family) == (b.origin, b.ends, b.free, b.family)
        for column in a.columns:
            assert np.array_equal(a[column], b[column], equal_nan=True), column
        assert [repr(point) for point in a.special] == [repr(point) for point in b.special]
    assert (again[cycles.name][3].profile == cycles[3].profile).all()
    with pytest.raises(foldline.RunFileError, match="already exists"):
        cycles.save(tmp_path / "run")
    # A saved run can be continued.
    curve = foldline.hold(again[steady.name].special[0], "A", (0.9, 1.1))
    assert np.allclose(curve["B"], 1 + curve["A"] ** 2, rtol=1e-7)


def test_a_run_in_a_folder_equals_the_run_in_memory(brusselator, tmp_path):
    study = {
        "seed": [{"name": "rest", "attractor": "equilibrium"}],
        "branch": [{"name": "steady", "from": "rest", "free": "B", "range": [0.5, 4], "switch": {"hopf": 1}}],
    }
    in_memory = foldline.run(study, brusselator)
    on_disk = foldline.run(study, brusselator, out=tmp_path / "run")
    for a, b in zip(in_memory, on_disk, strict=True):
        assert (a.parameters == b.parameters).all()
    resumed = foldline.run(study, brusselator, out=tmp_path / "run", resume=True)
    assert len(resumed.special) == 1
    with pytest.raises(foldline.RunFileError, match="continue this run with `resume=True`"):
        foldline.run(study, brusselator, out=tmp_path / "run")
    switched = on_disk["steady"].switch(on_disk["steady"].special[0], out=tmp_path / "switched")
    assert (switched["period"] == foldline.open(tmp_path / "switched")[switched.name]["period"]).all()


def test_a_cycle_without_its_profile_is_refused_as_a_start(brusselator, tmp_path):
    """A run may store the profiles of special points and ends only; the numbers of all other points are kept."""
    study = {
        "store": "special",
        "seed": [{"name": "rest", "attractor": "equilibrium"}],
        "branch": [{"name": "steady", "from": "rest", "free": "B", "range": [0.5, 4], "switch": {"hopf": 1}}],
    }
    cycles = foldline.run(study, brusselator, out=tmp_path / "run")["steady/hopf-1"]
    light = cycles[len(cycles) // 2]
    assert light.is_cycle and light.period > 0
    for use in (
        lambda: foldline.follow(light, "A", (0.8, 1.2)),
        lambda: foldline.sweep(light, "A", (0.8, 1.2)),
        lambda: brusselator.settle(light),
        lambda: brusselator.simulate(light, 1.0),
        light.uniform,
        light.plot,
    ):
        with pytest.raises(foldline.InputError, match="the profile of this cycle was not stored"):
            use()
    assert foldline.follow(cycles[-1], "A", (0.9, 1.1)).complete


def test_exploring_finds_the_equilibrium_and_the_cycles(brusselator):
    diagram = foldline.explore(brusselator, "B", (0.5, 4), values=3, samples=8)
    assert [own.family for own in diagram] == ["equilibrium", "cycle"]
    assert [point.kind for point in diagram.special] == ["hopf"]
    assert diagram.notes


def test_a_branch_that_ends_short_gives_a_warning(brusselator):
    with pytest.warns(foldline.EndedShort, match="limit of 3 points") as warned:
        branch = foldline.follow(brusselator.settle(), "B", (0.5, 4), max_points=3)
    assert {own.filename for own in warned} == {__file__}
    assert not branch.complete


def test_surveys_and_sweeps_are_tables(brusselator):
    study = {
        "seed": [{"name": "rest", "attractor": "equilibrium"}],
        "survey": [{"name": "what attracts", "free": "B", "range": [1, 3], "count": 2, "starts": 4}],
    }
    table = foldline.run(study, brusselator).responses["what attracts"]
    assert table["motion"].tolist() == ["equilibrium", "cycle"]
    assert table["B"].tolist() == [1.0, 3.0]
    assert table["x_max"].shape == (2,)


def test_results_convert_to_tables_and_data_sets(steady, brusselator):
    frame = steady.to_pandas()
    assert len(frame) == len(steady)
    assert (frame["B"].to_numpy() == steady["B"]).all()
    special = steady.special.to_pandas()
    assert special.loc[0, "kind"] == "hopf"
    both = steady.switch(steady.special[0]).diagram
    data = both.to_xarray()
    assert data.sizes["point"] == sum(len(branch) for branch in both)
    assert data["largest"].sel(variable="x").values.tolist() == np.concatenate([own["x_max"] for own in both]).tolist()
    cycle = both[1][3]
    assert cycle.to_xarray()["x"].shape == cycle.t.shape
    assert len(cycle.to_pandas()) == len(cycle.t)
    attractors = brusselator.attractors(parameters={"B": 3}, samples=8)
    assert attractors.to_pandas()["hits"].sum() == 8
    shares = [own.share for own in attractors]
    assert abs(sum(share[0] for share in shares) - 1) < 1e-12, "of the six uniform samples each went somewhere"
    assert all(0 <= low <= share <= high <= 1 for share, low, high in shares)
    assert "8 samples, 0 escaped, 0 not settled" in repr(attractors)


def test_results_have_informative_representations(steady, brusselator):
    diagram = steady.switch(steady.special[0]).diagram
    assert "1 special; reached 0.5; reached 4" in repr(steady)
    assert "supercritical" in repr(steady.special)
    for own in (steady, diagram):
        html = own._repr_html_()
        assert "<svg" in html
        assert "stroke-dasharray" in html
        assert "</svg>" in html
        assert "<td>hopf</td>" in html
    for own in (brusselator, steady[0], diagram[1][2], steady.special):
        assert own._repr_html_().count("<") == own._repr_html_().count(">")
    assert "unstable" in repr(steady[-1])

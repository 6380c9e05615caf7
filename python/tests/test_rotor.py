"""The rotor: a traced function and the model file give the same results to the last digit."""

import os

import numpy as np
import pytest

import foldline

from conftest import ROOT

STUDY = {
    "seed": [
        {"name": "SL at 5", "attractor": "2:1", "parameters": {"kappa": 1}, "samples": 48},
        {"name": "cubic S at 0.5", "attractor": "equilibrium", "parameters": {"Omega": 0.5}, "samples": 16},
    ],
    "branch": [
        {"name": "contact SL", "from": "SL at 5", "free": "Omega", "range": [0.5, 12], "switch": {"period-doubling": 1}},
        {"name": "cubic S", "from": "cubic S at 0.5", "free": "Omega", "range": [0.5, 12]},
    ],
}


@pytest.fixture(scope="module")
def traced(rotor):
    return foldline.run(STUDY, rotor)


@pytest.fixture(scope="module")
def from_file(rotor_file):
    return foldline.run(STUDY, rotor_file)


def test_special_points_are_the_same_to_the_last_digit(traced, from_file):
    assert len(traced.special) >= 6
    for a, b in zip(traced.special, from_file.special, strict=True):
        assert (a.branch.name, a.kind) == (b.branch.name, b.kind)
        assert a.parameters == b.parameters
        assert a.period == b.period
        assert a.ranges == b.ranges
        assert a.coefficients == b.coefficients
        assert (a.spectrum == b.spectrum).all()


def test_folds_agree_with_the_reference_study(traced):
    """The values of crates/foldline-cli/tests: contact SL has folds at 3.35261 and 10.34062."""
    folds = sorted(point["Omega"] for point in traced["contact SL"].special["fold"])
    assert np.allclose(folds, [3.352613, 10.340617], atol=2e-6)


def test_a_branch_is_followed_and_switched_by_single_calls(rotor, traced):
    start = rotor.settle("2:1", parameters={"kappa": 1}, samples=48)
    assert start.ratio == (2, 1)
    branch = foldline.follow(start, "Omega", (0.5, 12))
    for by_hand, by_study in zip(branch.special, traced["contact SL"].special, strict=True):
        assert by_hand.kind == by_study.kind
        assert by_hand["Omega"] == pytest.approx(by_study["Omega"], rel=1e-6)
    doubled = branch.switch(branch.special["period-doubling"][1])
    assert doubled.name.endswith("period-doubling-2")
    assert doubled.origin[:3] == ("switch", branch.name, "period-doubling")
    assert [own.name for own in doubled.diagram] == [branch.name, doubled.name]
    assert doubled[len(doubled) // 2].period > 1.9 * branch["period"].min()


def test_a_cycle_knows_its_orbit_and_spectrum(traced):
    branch = traced["contact SL"]
    cycle = branch[0]
    n, count = len(cycle.model.states), cycle.profile.shape[0]
    assert cycle.profile.shape == (count, 5, n)
    assert cycle.mesh.shape == (count + 1,)
    assert cycle.t.shape == (5 * count,)
    track = cycle.uniform(256)
    assert np.allclose(track["r"], np.hypot(track["u"], track["v"]), rtol=1e-14)
    frequencies, amplitudes = cycle.signed_spectrum(256)
    assert np.sum(np.abs(amplitudes) ** 2) == pytest.approx(np.mean(track["r"] ** 2), rel=1e-10)
    assert frequencies[129] == pytest.approx(1 / cycle.period, rel=1e-14)
    assert branch["r_max"].shape == (len(branch),)
    assert (branch["Omega"] == [point["Omega"] for point in branch]).all()
    assert not branch["Omega"].flags.writeable


def test_the_file_of_a_study_runs_with_any_model(rotor):
    path = os.path.join(ROOT, "studies", "overhung-rotor", "homotopy.toml")
    diagram = foldline.run(path)
    again = foldline.run(path, rotor)
    assert [own.name for own in again] == [own.name for own in diagram]
    for a, b in zip(again, diagram, strict=True):
        assert (a.parameters == b.parameters).all()


def test_a_family_is_carried_to_contact(rotor):
    start = rotor.settle("2:1")
    found = foldline.homotopy(start, {"kappa": 1.0}, "Omega", (0.5, 12))
    assert found.arrived
    assert found.end["kappa"] == 1.0
    assert found.route[-1].startswith("reached the goal")

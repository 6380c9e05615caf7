"""A forced oscillator."""

import os

import numpy as np
import pytest

import foldline

from conftest import ROOT


@pytest.fixture(scope="module")
def duffing():
    parameters = dict(zeta=0.05, A=0.3, omega=0.5)

    @foldline.model(states="x y", parameters=parameters, frequency="omega", outputs={"amplitude": lambda s, p: abs(s.x)})
    def duffing(s, p, t):
        return s.y, p.A * np.cos(p.omega * t) - 2 * p.zeta * s.y - s.x - s.x**3

    return duffing


def test_the_response_has_the_period_of_the_forcing(duffing):
    response = duffing.settle("cycle")
    assert duffing.forced
    assert response.forcing_periods == 1
    assert response.period == pytest.approx(4 * np.pi, rel=1e-14)
    assert len(response.spectrum) == 2
    # Liouville: the product of the multipliers is exp of the integral of the trace.
    assert np.prod(response.spectrum).real == pytest.approx(np.exp(-2 * 0.05 * response.period), rel=1e-5)


def test_the_resonance_has_two_folds_between_which_it_is_unstable(duffing):
    branch = foldline.follow(duffing.settle("cycle"), "omega", (0.5, 3))
    folds = branch.special["fold"]
    assert len(folds) == 2
    assert (folds[0].unstable_before, folds[0].unstable_after) == (0, 1)
    between = (branch.position > folds[0]._native.position) & (branch.position <= folds[1]._native.position)
    assert (branch.stable == ~between).all()


def test_simulation_settles_to_a_stable_point(duffing):
    branch = foldline.follow(duffing.settle("cycle"), "omega", (0.5, 1))
    point = branch[-1]
    track = duffing.simulate(point, 3 * point.period, times=[3 * point.period])
    assert np.abs(track.states[-1] - point.state).max() < 1e-5


def test_a_traced_model_agrees_with_the_model_file():
    model = foldline.model(os.path.join(ROOT, "models", "duffing-forced.toml"))
    again = foldline.model(equations=_equations(model), parameters=_values(model), frequency="omega")
    places = np.random.default_rng(2).normal(size=(20, 2))
    times = np.linspace(0, 9, 20)
    assert (model(places, t=times) == again(places, t=times)).all()


def _equations(model):
    tomllib = pytest.importorskip("tomllib")
    states = tomllib.loads(model.text)["states"]
    found = {name: own if isinstance(own, str) else own["equation"] for name, own in states.items()}
    definitions = tomllib.loads(model.text).get("definitions", {})
    for name, own in definitions.items():
        found = {state: text.replace(name, f"({own})") for state, text in found.items()}
    return found


def _values(model):
    return {name: own["value"] for name, own in model.parameters.items()}


def test_time_without_a_forcing_is_refused():
    with pytest.raises(foldline.InputError, match="`t` is defined only for a forced model"):
        foldline.model(states="x")(lambda s, p, t: np.cos(t) - s.x)

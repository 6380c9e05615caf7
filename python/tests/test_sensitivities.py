"""Derivatives of special points and solutions, and the uncertainty of special points."""

import numpy as np
import pytest

import foldline


@pytest.fixture(scope="module")
def cubic():
    model = foldline.model(equations={"x": "a + b*x - c*x^3"}, parameters={"a": -2.0, "b": 3.0, "c": 1.0})
    return foldline.follow(model.settle([-2.0]), "a", (-2.5, 2.5))


def test_a_hopf_point_moves_as_its_closed_form_says(steady):
    """B = 1 + A² and the period 2π/A."""
    (hopf,) = steady.special
    by_a = hopf.sensitivity["A"]
    assert abs(by_a.value - 2.0) <= by_a.error < 1e-6
    assert hopf.sensitivities["period"]["A"].value == pytest.approx(-2 * np.pi, rel=1e-8)
    assert hopf.sensitivity.elasticity("A") == pytest.approx(1.0, rel=1e-8)
    assert "B" not in hopf.sensitivity


def test_extremes_of_a_cycle_change_as_differences_do(steady):
    cycles = steady.switch(steady.special["hopf"][0])
    middle = len(cycles) // 2
    own = cycles.sensitivities(middle)
    assert {"period", "x_max", "x_min", "y_max", "y_min"} <= set(own)
    # Along the branch: dx_max/dB from the neighbours.
    slope = np.gradient(cycles["x_max"], cycles["B"])[middle]
    assert own["x_max"]["B"].value == pytest.approx(slope, rel=0.05)
    assert all(value.error < 1e-4 * (1 + abs(value.value)) for value in own["x_max"].values())


def test_a_pitchfork_has_derivatives_only_where_it_persists():
    model = foldline.model(equations={"x": "l*x + q*x - x^3 + h"}, parameters={"l": -1.0, "q": 0.5, "h": 0.0})
    branch = foldline.follow(model.settle([0.0]), "l", (-2, 2))
    own = branch.special["branch-point"][0].sensitivity
    assert own["q"].value == pytest.approx(-1.0, abs=1e-8)
    assert list(own) == ["q"] and "no longer cross" in own.reasons["h"]
    with pytest.raises(KeyError, match="no longer cross"):
        own["h"]


def test_uncertainty_follows_from_standard_deviations_and_ranges(cubic):
    fold = max(cubic.special["fold"], key=lambda own: own.value)
    band = fold.uncertainty(samples=200, b=0.03, c=(0.9, 1.1))["a"]
    sigma = np.hypot(0.03, 0.2 / np.sqrt(12))
    assert band.first_order[1] == pytest.approx(sigma, rel=1e-6)
    # 200 samples of two parameters are correlated by 1/√200 at random: three times the effect of that.
    assert band.sampled[1] == pytest.approx(sigma, rel=0.09)
    assert band.range[0] < fold.value < band.range[1] and band.failed == {}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"q": 1.0}, "no such parameter"),
        ({"b": -1.0}, "positive standard deviation"),
        ({"b": (2, 1)}, "range"),
        ({"b": "x"}, "not an uncertainty"),
    ],
)
def test_mistakes_name_their_remedy(cubic, given, said):
    with pytest.raises(foldline.ArgumentError, match=said):
        cubic.special["fold"][0].uncertainty(**given)


def test_derivatives_are_shown_as_a_chart_and_a_table(cubic):
    own = cubic.special["fold"][0].sensitivity
    axes = own.plot({"b": 0.1})
    assert len(axes.patches) == 4
    assert set(own.to_pandas().index) == {"b", "c"}
    with pytest.raises(foldline.ArgumentError, match="no parameter"):
        own.plot({"nothing": 1.0})

"""Held quantities, harmonics and peaks."""

import numpy as np
import pytest

import foldline

OSCILLATOR = {
    "equations": {"x": "v", "v": "-0.2*v - x + F*cos(Omega*t)"},
    "parameters": {"Omega": 0.5, "F": 0.3},
    "frequency": "Omega",
}


@pytest.fixture(scope="module")
def start():
    return foldline.model(**OSCILLATOR).settle("cycle")


def test_harmonics_and_peaks_are_those_of_the_linear_oscillator(start):
    branch = foldline.follow(start, "Omega", (0.2, 3), peaks=["x_h1"], mark={"x_h1_phase": 90})
    omega = branch["Omega"]
    answer = 0.3 / (1 - omega**2 + 0.2j * omega)
    assert np.allclose(branch["x_h1"], abs(answer), rtol=1e-8)
    assert np.allclose(branch["x_h1_phase"], -np.angle(answer, deg=True), atol=1e-5)
    assert np.allclose(branch["v_h1/x_h1"], omega, rtol=1e-8)
    assert abs(branch.special["peak"][0]["Omega"] - np.sqrt(0.98)) < 1e-7
    assert abs(branch.special["mark"][0]["Omega"] - 1) < 1e-8


def test_an_amplitude_is_held_in_two_parameters(start):
    branch = foldline.follow(start, ["Omega", "F"], {"Omega": (0.3, 2), "F": (0, 5)}, hold={"x_max": 0.8})
    omega = branch["Omega"]
    assert branch.also == ("F",) and branch.levels == {"x_max": 0.8}
    assert np.allclose(branch["F"], 0.8 * abs(1 - omega**2 + 0.2j * omega), rtol=1e-6)


def test_wrong_calls_say_what_is_right(start):
    with pytest.raises(foldline.ArgumentError, match="hold must be a dictionary"):
        foldline.follow(start, ["Omega", "F"], (0.3, 2), hold="x_max")
    with pytest.raises(foldline.InputError, match="varies already"):
        foldline.follow(start, ["Omega", "Omega"], (0.3, 2), hold={"x_max": 1})
    with pytest.raises(foldline.ArgumentError, match="must be a list of names"):
        foldline.follow(start, "Omega", (0.3, 2), peaks="x_max")
    with pytest.raises(foldline.InputError, match="no quantity is held"):
        foldline.follow(start, ["Omega", "F"], (0.3, 2))

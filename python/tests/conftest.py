"""Models shared by several tests."""

import os

import matplotlib
import numpy as np
import pytest

import foldline

matplotlib.use("Agg")

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


def traced_rotor():
    """The overhung rotor of models/overhung-rotor.toml as a function."""

    @foldline.model(
        states={
            "u": dict(range=(-5, 5), scale=1),
            "v": dict(range=(-5, 5), scale=1),
            "du": dict(range=(-15, 15), scale=1),
            "dv": dict(range=(-15, 15), scale=1),
        },
        parameters=dict(Omega=5.0, kappa=0.0, zeta=0.01, epsilon=0.353, gamma=0.25, beta=10.0, K=150.0, J_p=0.143, m=0.9),
        outputs=dict(r=lambda s, p: np.hypot(s.u, s.v)),
        whirl="u v",
    )
    def rotor(s, p):
        u, v, du, dv = s
        r = np.hypot(u, v)
        contact = foldline.where(r > 0, (np.tanh(p.K * (r - 1)) + 1) / 2 * p.beta * (1 - 1 / r), 0)
        stiffness = 1 - (1 - p.J_p) * p.Omega**2 + (1 - p.kappa) * p.gamma * r**2 + p.kappa * contact
        gyroscopic = (2 - p.J_p) * p.Omega
        circulatory = 2 * p.zeta * p.Omega
        ddu = p.m * p.epsilon * p.Omega**2 + gyroscopic * dv - 2 * p.zeta * du - stiffness * u + circulatory * v
        ddv = -gyroscopic * du - 2 * p.zeta * dv - stiffness * v - circulatory * u
        return du, dv, ddu, ddv

    return rotor


@pytest.fixture(scope="session")
def rotor():
    return traced_rotor()


@pytest.fixture(scope="session")
def rotor_file():
    return foldline.model(os.path.join(ROOT, "models", "overhung-rotor.toml"))


@pytest.fixture(scope="session")
def brusselator():
    @foldline.model(states={"x": dict(range=(0, 5)), "y": dict(range=(0, 5))}, parameters=dict(A=1.0, B=1.5))
    def brusselator(s, p):
        return p.A - (p.B + 1) * s.x + s.x**2 * s.y, p.B * s.x - s.x**2 * s.y

    return brusselator


@pytest.fixture(scope="session")
def steady(brusselator):
    return foldline.follow(brusselator.settle(), "B", (0.5, 4))

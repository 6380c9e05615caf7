"""Rotors from matrices and from the objects of other programs."""

from __future__ import annotations

import numpy as np
import pytest

import foldline

DISC = {"M": np.diag([2.0, 2.0, 0.01, 0.01]), "K": np.diag([8e4, 8e4, 1e3, 1e3]), "C": np.diag([20.0, 20.0, 0.1, 0.1])}


class Other:
    """A rotor with six degrees of freedom at one node, as other programs have it."""

    nodes_pos = (0.25,)

    def __init__(self, coupling: float = 0.0) -> None:
        self.coupling = coupling

    @staticmethod
    def _spread(lateral: np.ndarray) -> np.ndarray:
        full = np.diag([0.0, 0.0, 3.0, 0.0, 0.0, 0.02])
        kept = [0, 1, 3, 4]
        full[np.ix_(kept, kept)] = lateral
        return full

    def M(self, frequency: float = 0.0) -> np.ndarray:
        return self._spread(DISC["M"])

    def C(self, frequency: float) -> np.ndarray:
        return self._spread(DISC["C"])

    def K(self, frequency: float) -> np.ndarray:
        full = self._spread(DISC["K"])
        full[0, 2] = full[2, 0] = self.coupling
        return full

    def G(self) -> np.ndarray:
        return np.zeros((6, 6))


def test_the_response_of_a_disc_is_the_closed_form():
    rotor = foldline.rotor(**DISC, unbalance={0: 1e-3}, speed="100 rad/s")
    found = rotor.settle()
    # |u + iv| = U W^2 / |k - m W^2 + i c W|
    expected = 1e-3 * 1e4 / abs(8e4 - 2.0 * 1e4 + 20.0 * 100 * 1j)
    assert abs(np.hypot(found["u_0"], found["v_0"]) / expected - 1) < 1e-6


def test_the_rotor_of_another_program_gives_the_same_equations():
    ours = foldline.rotor(**DISC, nodes=[0.25], unbalance={0: 1e-3}).text
    assert foldline.rotor(Other(), unbalance={0: 1e-3}).text == ours


def test_coupled_axial_motion_is_refused():
    with pytest.raises(foldline.ArgumentError, match="couples lateral motion"):
        foldline.rotor(Other(coupling=1e3))


def test_mistakes_in_sections_are_reported_with_a_remedy():
    with pytest.raises(foldline.InputError, match="there is no node 3"):
        foldline.rotor(**DISC, contacts=[dict(node=3, clearance="1 mm", stiffness=1e6)])
    with pytest.raises(foldline.ArgumentError, match="K is missing"):
        foldline.rotor(M=DISC["M"])


def test_a_rotor_of_ross_has_its_natural_frequencies():
    ross = pytest.importorskip("ross")
    steel = ross.Material("steel", rho=7810, E=211e9, G_s=81.2e9)
    shaft = [ross.ShaftElement(0.25, 0.0, 0.05, material=steel) for _ in range(6)]
    disc = ross.DiskElement.from_geometry(6, steel, 0.07, 0.05, 0.35)
    bearings = [ross.BearingElement(n, kxx=1e7, kyy=1e7, cxx=0, cyy=0) for n in (0, 4)]
    own = foldline.rotor(ross.Rotor(shaft, [disc], bearings))
    assert len(own.states) == 56

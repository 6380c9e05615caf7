"""Branches that were killed resume where they stopped."""

import subprocess
import sys

import numpy as np
import pytest

import foldline

from conftest import ROOT, traced_rotor

#: A process that ends itself without cleaning up once points are stored.
KILLED = """
import os, sys
sys.path.insert(0, {tests!r})
from conftest import traced_rotor
import foldline
start = traced_rotor().settle("2:1", parameters={{"kappa": 1}}, samples=48)
foldline.follow(start, "Omega", (0.5, 12), tolerance=1e-9, out={folder!r}, progress=lambda *seen: os._exit(9) if seen[0] else None)
"""


@pytest.fixture(scope="module")
def start():
    return traced_rotor().settle("2:1", parameters={"kappa": 1}, samples=48)


def test_a_branch_that_was_killed_resumes(start, tmp_path):
    code = KILLED.format(tests=f"{ROOT}/python/tests", folder=str(tmp_path / "run"))
    ended = subprocess.run([sys.executable, "-c", code], check=False)
    assert ended.returncode == 9
    (kept,) = foldline.open(tmp_path / "run")
    again = {"tolerance": 1e-9, "out": tmp_path / "run"}
    with pytest.raises(foldline.RunFileError, match="resume=True"):
        foldline.follow(start, "Omega", (0.5, 12), **again)
    resumed = foldline.follow(start, "Omega", (0.5, 12), resume=True, **again)
    whole = foldline.follow(start, "Omega", (0.5, 12), tolerance=1e-9)
    assert 0 < len(kept) < len(whole)
    assert resumed.complete
    # Stored points are unchanged. Beyond them step sizes may depend on the moment of the kill; the curve does not.
    stays = np.isin(resumed["position"], kept["position"])
    for column in ("position", "Omega", "period", "r_max", "unstable"):
        assert np.array_equal(resumed[column][stays], kept[column]), column
    assert [resumed[0]["Omega"], resumed[-1]["Omega"]] == [whole[0]["Omega"], whole[-1]["Omega"]]
    assert [point.kind for point in resumed.special] == [point.kind for point in whole.special]
    for own, other in zip(resumed.special, whole.special, strict=True):
        assert own.value == pytest.approx(other.value, rel=1e-9, abs=1e-9), "the tolerance of both"
    with pytest.raises(foldline.RunFileError, match="study"):
        foldline.follow(start, "Omega", (0.5, 11), resume=True, **again)


def test_resuming_a_run_that_has_not_begun_starts_it(brusselator, steady, tmp_path):
    rest = brusselator.settle()
    branch = foldline.follow(rest, "B", (0.5, 4), out=tmp_path / "branch", resume=True)
    assert (branch.parameters == steady.parameters).all()
    hopf = steady.special["hopf"][0]
    counts = []
    cycles = steady.switch(hopf, out=tmp_path / "cycles", resume=True, progress=lambda points, *_: counts.append(points))
    # The known branch is stored, not recomputed.
    assert counts[-1] == len(cycles)
    assert (cycles.diagram[steady.name]["newton"] == steady["newton"]).all()
    again = steady.switch(hopf, out=tmp_path / "cycles", resume=True)
    assert (again["period"] == cycles["period"]).all()
    curve = foldline.hold(hopf, "A", (0.5, 1.5), out=tmp_path / "curve", resume=True)
    again = foldline.hold(hopf, "A", (0.5, 1.5), out=tmp_path / "curve", resume=True)
    assert (again["A"] == curve["A"]).all()
    there = foldline.homotopy(rest, {"A": 1.2}, "B", (0.5, 4), out=tmp_path / "way", resume=True)
    again = foldline.homotopy(rest, {"A": 1.2}, "B", (0.5, 4), out=tmp_path / "way", resume=True)
    assert again.end.parameters == there.end.parameters
    with pytest.raises(foldline.InputError, match=r'out="runs/study"'):
        foldline.follow(rest, "B", (0.5, 4), resume=True)


def test_an_unstable_cycle_resumes_from_the_cycle_itself(tmp_path):
    """Its seed in the study is a state from which nothing settles to it."""
    lorenz = foldline.model(
        equations={"x": "sigma*(y - x)", "y": "x*(rho - z) - y", "z": "x*y - beta*z"},
        parameters=dict(sigma=10.0, rho=20.0, beta=8 / 3),
    )
    rest = foldline.follow(lorenz.settle([7.0, 7.0, 19.0]), "rho", (14, 26))
    saddle = rest.switch(rest.special["hopf"][0])[2]
    with pytest.warns(foldline.EndedShort):
        foldline.follow(saddle, "sigma", (9.5, 10.5), max_points=2, out=tmp_path / "short")
    first = foldline.follow(saddle, "sigma", (9.5, 10.5), out=tmp_path / "run")
    again = foldline.follow(saddle, "sigma", (9.5, 10.5), out=tmp_path / "run", resume=True)
    assert (again["period"] == first["period"]).all()
    assert not again.stable.any()


def test_a_sweep_in_a_folder_resumes(brusselator, tmp_path):
    rest = brusselator.settle(parameters={"B": 1.0})
    first = foldline.sweep(rest, "B", (1, 3), 3, out=tmp_path / "run")
    again = foldline.sweep(rest, "B", (1, 3), 3, out=tmp_path / "run", resume=True)
    assert (again["x_max"] == first["x_max"]).all()
    with pytest.raises(foldline.RunFileError, match="resume=True"):
        foldline.sweep(rest, "B", (1, 3), 3, out=tmp_path / "run")

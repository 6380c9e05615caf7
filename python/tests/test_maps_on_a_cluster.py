"""Maps over parameters on a cluster of two processes: equal to the serial result to the bit, also where workers are lost."""

import logging
import os
import signal
import sys
import time

import numpy as np
import pytest
from test_maps_over_parameters import STUDY, bits

import foldline

distributed = pytest.importorskip("distributed")
dask = pytest.importorskip("dask")


@pytest.fixture(scope="module")
def client():
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    options = dict(n_workers=2, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL)
    # A task is given up after the second worker, which takes less time than after the fourth.
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        distributed.LocalCluster(**options) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def cusp():
    return foldline.model(equations={"x": "mu + b*x - x^3"}, states={"x": dict(range=(-3, 3))}, parameters={"mu": -2.0, "b": 3.0})


@pytest.fixture(scope="module")
def over():
    return {"b": np.linspace(0.5, 3.0, 200)}


@pytest.fixture(scope="module")
def serial(cusp, over):
    return foldline.map(cusp, over, STUDY, jobs=1)


def test_a_cluster_gives_the_serial_result_to_the_bit(client, cusp, over, serial, record_property):
    found = foldline.map(cusp, over, STUDY, client=client)
    assert bits(found) == bits(serial)
    own = found.attrs
    assert own["cells_computed"] == 200 and own["tasks"] < 200 and own["threads"] == 2
    cost = 1 - own["computing_seconds"] / own["threads"] / (own["elapsed_seconds"] - own["preparing_seconds"])
    record_property("scheduling_cost", cost)
    print(f"scheduling: {100 * cost:.1f} % of the time of two workers, {own['tasks']} tasks, {1e3 * own['task_seconds']:.1f} ms each")


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_the_cells_of_a_killed_worker_are_computed_by_others(client, cusp, over, serial, tmp_path):
    workers = client.run(os.getpid)
    killed = []

    def kill(done, total, left):
        if done >= 100 and not killed:
            killed.append(next(iter(workers.values())))
            os.kill(killed[0], signal.SIGKILL)

    found = foldline.map(cusp, over, STUDY, client=client, progress=kill, out=tmp_path / "map")
    assert len(killed) == 1 and killed[0] not in client.run(os.getpid).values()
    assert bits(found) == bits(serial)
    again = foldline.map(cusp, over, STUDY, client=client, out=tmp_path / "map")
    assert again.attrs["cells_computed"] == 0 and bits(again) == bits(serial)
    client.wait_for_workers(2, timeout=30)


def test_an_interrupted_map_goes_on_elsewhere(client, cusp, over, serial, tmp_path):
    def press(done, total, left):
        if done >= 60:
            raise KeyboardInterrupt

    with pytest.raises(foldline.Interrupted) as caught:
        foldline.map(cusp, over, STUDY, client=client, progress=press, out=tmp_path / "map")
    known = int((caught.value.partial["failure"] == "").sum())
    assert 60 <= known < 200
    # Begun on the cluster, finished here.
    found = foldline.map(cusp, over, STUDY, jobs=1, out=tmp_path / "map")
    assert found.attrs["cells_computed"] == 200 - known and bits(found) == bits(serial)


def test_rotors_refined_on_a_cluster_are_those_of_threads(client, rotor_file):
    over, what = {"epsilon": [0.2, 0.35], "Omega": [4.5, 5.0]}, ["r_max", "period"]
    options = dict(start="cycle", samples=16)
    found = foldline.map(rotor_file, over, what, client=client, **options)
    assert bits(found) == bits(foldline.map(rotor_file, over, what, **options))
    assert found["r_max"].attrs["long_name"].startswith("largest value of")
    # What a function closes over is sent with it.
    limit = 0.3
    areas = foldline.map(rotor_file, {"epsilon": [0.2, 0.4]}, lambda case: case["epsilon"] > limit, client=client, refine=3, by="value")
    assert areas["value"].values.tolist() == [str(own) for own in (areas["epsilon"] > limit).values]


def test_a_cell_that_ends_its_workers_is_told_from_its_neighbours(client, cusp):
    client.wait_for_workers(2, timeout=30)

    def deadly(case):
        if case["b"] == 3.0:
            # A nanny that loses its worker before that has started gives up.
            time.sleep(0.2)
            os._exit(1)
        return case["b"]

    over = {"b": np.arange(100.0)}
    with pytest.warns(foldline.EndedShort, match="1 of 100 cells have no values: 1 × every worker that computed this cell died"):
        found = foldline.map(cusp, over, deadly, client=client)
    assert np.flatnonzero(found["failure"].values != "").tolist() == [3]
    assert np.array_equal(np.delete(found["value"].values, 3), np.delete(np.arange(100.0), 3))


def test_what_workers_cannot_read_is_refused(client, cusp):
    rest = cusp.settle([-2.0])
    with pytest.raises(foldline.InputError, match="cannot be sent to workers: TypeError: a solution that lies on no branch"):
        foldline.map(cusp, {"b": [1.0]}, lambda case: case.follow("mu", (-2.5, 2.5), rest)["x"][0], client=client)


def test_uncertainty_and_branches_travel(client, cusp):
    branch = foldline.follow(cusp.settle([-2.0]), "mu", (-2.5, 2.5))
    here, there = (foldline.uncertainty(branch, {"b": 0.01}, samples=10, client=own) for own in (None, client))
    assert list(here) == list(there)
    found = foldline.map(cusp, {"b": [3.0]}, lambda case: branch.special["fold"][0].value, client=client)
    assert found["value"].item() == branch.special["fold"][0].value


def test_workers_with_another_version_are_refused(client, cusp, monkeypatch):
    monkeypatch.setattr(foldline, "__version__", "99.0")
    with pytest.raises(foldline.InputError, match=r"a worker has foldline .*, and the map was made with foldline 99\.0"):
        foldline.map(cusp, {"b": [1.0]}, STUDY, client=client)


def test_a_closed_client_is_refused(client, cusp):
    other = distributed.Client(client.scheduler.address)
    other.close()
    with pytest.raises(foldline.InputError, match="the client is closed"):
        foldline.map(cusp, {"b": [1.0]}, STUDY, client=other)

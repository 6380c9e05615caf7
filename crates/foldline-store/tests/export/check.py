"""Compares what xarray and pandas read from an export with the bytes of the run file.

Called by tests/export/main.rs with a folder that contains run.sqlite, run.nc, csv and parquet.
"""

import sqlite3
import sys
from pathlib import Path

import h5py
import numpy
import pandas
import xarray

run = Path(sys.argv[1])
database = sqlite3.connect(run / "run.sqlite")
database.row_factory = sqlite3.Row
NAMES = {"parameter": ["K", "k_2", "step_2"], "state": ["x", "node_2"]}


def numbers(blob):
    return numpy.frombuffer(blob or b"", "<f8")


def same(a, b):
    a, b = (numpy.asarray(v, dtype="<f8") for v in (a, b))
    bits = a.view("<u8") == b.view("<u8")
    assert a.shape == b.shape and (bits | (numpy.isnan(a) & numpy.isnan(b))).all(), (a, b)


def profile(row):
    """Returns normalised times and states, laid out as docs/book/run-file.md and docs/book/exports.md state."""
    mesh, degree = numbers(row["mesh_bytes"]), row["degree"]
    gauss = numpy.concatenate([[0.0], (numpy.polynomial.legendre.leggauss(degree)[0] + 1) / 2])
    times = (mesh[:-1, None] + gauss[None, :] * numpy.diff(mesh)[:, None]).ravel()
    states = numbers(row["solution_bytes"]).reshape(len(times), -1)
    return numpy.append(times, mesh[-1]), numpy.vstack([states, states[:1]])


def check_group(points, rows, node):
    for k, row in enumerate(rows):
        point = points.isel({points["K"].dims[0]: k})
        same([point[name] for name in NAMES["parameter"]], numbers(row["parameter_bytes"]))
        same(point["unstable"], row["unstable"])
        spectrum = numbers(row["spectrum_bytes"]).reshape(-1, 2)
        same(point["spectrum_re"], spectrum[:, 0])
        same(point["spectrum_im"], spectrum[:, 1])
        if row["mesh_bytes"] is None:
            same([point[name] for name in NAMES["state"]], numbers(row["solution_bytes"]))
            continue
        times, states = profile(row)
        count = len(times)
        assert numpy.abs(point["normalised_time"].values[:count] - times).max() < 1e-15
        for i, name in enumerate(NAMES["state"]):
            assert point[name].dims == (node,)
            same(point[name].values[:count], states[:, i])
            assert numpy.isnan(point[name].values[count:]).all()


def rows_of(table, branch):
    order = "position" if table == "points" else "position, rowid"
    return database.execute(f"SELECT * FROM {table} WHERE branch = ? ORDER BY {order}", [branch]).fetchall()


branches = database.execute("SELECT * FROM branches ORDER BY branch").fetchall()
study = database.execute("SELECT value FROM meta WHERE key = 'study'").fetchone()[0]
compared = 0
for engine in ["netcdf4", "h5netcdf"]:
    tree = xarray.open_datatree(run / "run.nc", engine=engine)
    assert tree.attrs["study_text"] == study
    assert sorted(tree["name"].values) == sorted(branch["name"] for branch in branches)
    groups = dict(zip(tree["name"].values, tree["group"].values))
    compared = 0
    for branch in branches:
        group = groups[branch["name"]]
        assert tree[group].attrs["branch"] == branch["name"]
        points, special = (rows_of(table, branch["branch"]) for table in ["points", "special_points"])
        if points:
            alone = xarray.open_dataset(run / "run.nc", group=group, engine=engine)
            assert list(alone["point"].values) == [row["position"] for row in points]
            assert alone["K"].attrs == {"long_name": "gain, größer als 0", "units": "N/m"}
            assert "K" in alone.coords and alone["x_max"].dims == ("point",)
            check_group(alone, points, "node")
            same(tree[group]["x_max"], alone["x_max"])
            compared += len(points)
        if special:
            alone = xarray.open_dataset(run / "run.nc", group=f"{group}/special", engine=engine)
            assert list(alone["kind"].values) == [row["kind"] for row in special]
            check_group(alone, special, "special_node")
    assert tree["down"]["hits"].values.tolist() == [7]
    tree.close()

attached = 0
with h5py.File(run / "run.nc") as file:

    def check_dimensions(name, variable):
        """Checks that a variable and its dimensions refer to each other."""
        global attached
        for place, scales in enumerate(variable.attrs.get("DIMENSION_LIST", [])):
            scale = file[scales[0]]
            assert h5py.h5ds.is_scale(scale.id) and h5py.h5ds.is_attached(variable.id, scale.id, place), name
            assert scale.shape[0] == variable.shape[place]
            attached += 1

    file.visititems(check_dimensions)
assert attached > 100

for table in ["branches", "points", "special_points", "profiles", "special_profiles", "responses"]:
    texts = pandas.read_csv(run / "csv" / f"{table}.csv", keep_default_na=False, dtype=str)
    bits = pandas.read_parquet(run / "parquet" / f"{table}.parquet")
    assert list(texts.columns) == list(bits.columns) and len(texts) == len(bits) > 0, table
    for name in bits.columns:
        if bits[name].dtype == "float64":
            same(texts[name].replace("", "nan").map(float), bits[name])
        else:
            assert texts[name].tolist() == bits[name].astype(str).tolist(), (table, name)
points = pandas.read_parquet(run / "parquet" / "points.parquet")
for branch in branches:
    stored = [numbers(row["parameter_bytes"]) for row in rows_of("points", branch["branch"])]
    if stored:
        same(points[points["branch"] == branch["name"]][NAMES["parameter"]], stored)
print(f"compared {compared} points")

"""Maps over parameters on threads: answers, failures, folders, refinement."""

import functools
import json
import os
import pickle
import shutil
import signal
import subprocess
import sys
import warnings

import numpy as np
import pytest
import xarray
from matplotlib import pyplot
from test_book import examples

import foldline
from foldline._engines import COST, group_size
from foldline._fingerprint import fingerprint

STUDY = {
    "seed": [{"name": "low", "state": {"x": -2}}],
    "branch": [{"name": "all", "from": "low", "free": "mu", "range": [-2.5, 2.5]}],
}


@pytest.fixture(scope="module")
def cusp():
    """Two folds at mu = ±2 (b/3)^(3/2) for b > 0; three equilibria between them."""
    box = {"x": dict(range=(-3, 3), description="deflection")}
    parameters = {"mu": dict(value=-2.0, description="load"), "b": 3.0}
    return foldline.model(equations={"x": "mu + b*x - x^3"}, states=box, parameters=parameters)


@pytest.fixture(autouse=True)
def closed():
    yield
    pyplot.close("all")


def fold(case):
    return case.follow("mu", (-2.5, 2.5), [-2.0]).special["fold"][0].value


def bits(found):
    """All variables as bytes or texts."""
    return {
        name: (own.dims, own.values.tolist() if own.dtype == object else own.values.tobytes())
        for name, own in {**found.data_vars, **found.coords}.items()
    }


# What can be asked.


def test_special_points_of_a_study_are_where_theory_puts_them(cusp):
    found = foldline.map(cusp, {"b": [-1.0, 0.75, 3.0]}, STUDY)
    assert found["point"].values.tolist() == ["all: fold 1", "all: fold 2"]
    right = 2 * (found["b"].values[1:, None] / 3) ** 1.5 * [1, -1]
    assert (np.abs(found["value"].values[1:] - right) <= found["error"].values[1:]).all()
    assert np.isnan(found["value"].values[0]).all() and found["points"].values.tolist() == ["none", "2 folds", "2 folds"]
    assert set(found["failure"].values) == {""} and found["free"].values.tolist() == ["mu", "mu"]


def test_motions_are_counted_and_named(cusp):
    found = foldline.map(cusp, {"b": [-1.0, 2.0], "mu": [0.0, 2.0]}, "motions", samples=32)
    assert found["motions"].dims == ("b", "mu")
    assert found["motions"].values.tolist() == [["equilibrium", "equilibrium"], ["2 equilibria", "equilibrium"]]
    assert found["number"].sel(motion="equilibrium").values.tolist() == [[1, 1], [2, 1]]
    assert found["mu"].attrs["long_name"] == "load" and found["x_max"].attrs["long_name"] == "largest value of deflection"


def test_shares_have_confidence_intervals(cusp):
    found = foldline.map(cusp, {"mu": [0.0, 5.0]}, "shares", samples=64)
    own = found.sel(motion="equilibrium")
    assert own["share"].values.tolist() == [1.0, 1.0] and own["number"].values.tolist() == [2, 1]
    assert (own["share_low"] > 0.9).all() and (own["share_high"] == 1).all()


def test_a_motion_that_no_sample_reached_has_the_share_zero_with_an_upper_bound():
    equations = {"x": "y", "y": "(1 - x^2)*y - x + F"}
    box = dict(range=(-3, 3))
    circling = foldline.model(equations=equations, states={"x": box, "y": box}, parameters={"F": 0.0})
    own = foldline.map(circling, {"F": [0.0, 1.2]}, "shares", samples=64).sel(motion="equilibrium")
    assert own["share"].values.tolist() == [0.0, 1.0] and own["number"].values.tolist() == [0, 1]
    # Wilson: z²/(n + z²).
    assert own["share_high"].values[0] == pytest.approx(1.96**2 / (64 + 1.96**2), rel=1e-4)


def test_quantities_of_a_settled_motion(cusp):
    found = foldline.map(cusp, {"mu": [0.0]}, ["x_max", "period"], start={"x": 2.0})
    assert found["x_max"].item() == pytest.approx(3**0.5, abs=1e-9) and np.isnan(found["period"].item())
    assert found["settled_motion"].item() == "equilibrium"


def test_functions_return_numbers_texts_and_lists(cusp):
    def several(case):
        return {"sum": case["b"] + case["mu"], "word": f"{case['b']:g}", "both": [case["b"], 1], "large": case["b"] > 1, "n": 3}

    found = foldline.map(cusp, [{"b": 1.0}, {"b": 2.0}], several)
    assert found["sum"].values.tolist() == [-1.0, 0.0] and found["word"].values.tolist() == ["1", "2"]
    assert found["both"].dims == ("case", "both_index") and found["both"].values.tolist() == [[1, 1], [2, 1]]
    assert found["large"].dtype == bool and found["n"].dtype == np.int64 and found["b"].dims == ("case",)
    two = foldline.map(cusp, {"b": [3.0]}, {"first": fold, "twice": lambda case: 2 * fold(case)})
    assert two["twice"].item() == 2 * two["first"].item()


def test_a_latin_hypercube_has_one_value_in_each_part():
    cases = foldline.latin_hypercube({"b": (1.0, 3.0), "mu": (-1.0, 0.0)}, 8, seed=3)
    assert sorted(int((case["b"] - 1) * 4) for case in cases) == list(range(8))
    assert sorted(int((case["mu"] + 1) * 8) for case in cases) == list(range(8))
    assert cases == foldline.latin_hypercube({"b": (1.0, 3.0), "mu": (-1.0, 0.0)}, 8, seed=3)


def rows_of(found, item):
    """Rows of a data set as a study's map has them: one for each motion or point that exists."""
    frame = found.to_dataframe().reset_index()
    return [row for row in frame.to_dict("records") if not item or row.get("number", 1) > 0 or "share" in row]


def test_a_map_in_a_study_has_the_same_numbers(cusp):
    grid = {"b": [0.75, 3.0]}
    own = dict(name="own", over=grid, samples=32)
    tables = {
        **STUDY,
        "map": [
            dict(name="points", what="points", over=grid),
            {**own, "name": "motions", "what": "motions"},
            {**own, "name": "shares", "what": "shares"},
        ],
    }
    maps = foldline.run(tables, cusp).maps
    assert list(maps) == ["points", "motions", "shares"]
    for name, what, item in (("points", STUDY, "point"), ("motions", "motions", "motion"), ("shares", "shares", "motion")):
        found = foldline.map(cusp, grid, what, samples=32)
        expected = rows_of(found, item)
        assert len(maps[name]) == len(expected)
        for row in maps[name]:
            other = next(own for own in expected if own["b"] == row["b"] and own[item] == row[item])
            for key in set(row) & set(other):
                same = row[key] == other[key] or (row[key] != row[key] and other[key] != other[key])
                assert same, (name, key, row[key], other[key])


# What fails, and what falls short.


def test_a_cell_without_values_says_why(cusp):
    with pytest.warns(
        foldline.EndedShort, match="1 of 3 cells have no values: 1 × IndexError: there are 0 special points of the kind fold"
    ):
        found = foldline.map(cusp, {"b": [-1.0, 1.0, 2.0]}, fold)
    assert np.isnan(found["value"].values).tolist() == [True, False, False]
    assert [bool(own) for own in found["failure"].values] == [True, False, False]


def test_what_falls_short_is_a_remark_and_no_warning(cusp):
    few = {**STUDY, "branch": [{**STUDY["branch"][0], "max-points": 3}]}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = foldline.map(cusp, {"b": [1.0]}, few)
    assert "3 points" in found["remark"].item()


def test_a_wrong_function_ends_the_map(cusp):
    calls = []

    def wrong(case):
        calls.append(case)
        return case.nothing

    with pytest.raises(foldline.Error, match="failed in the same way: AttributeError"):
        foldline.map(cusp, {"b": np.linspace(0, 1, 100)}, wrong, jobs=1)
    assert len(calls) == 10
    with pytest.raises(
        foldline.Error, match="the first 2 cells failed in the same way: TypeError: the function returned a solution for value"
    ):
        foldline.map(cusp, {"mu": [-2.0, -1.9]}, lambda case: case.settle([-2.0]))


@pytest.mark.parametrize(
    ("over", "what", "options", "said"),
    [
        ({}, "motions", {}, "no parameters"),
        ({"c": [1.0]}, "motions", {}, "no parameter `c`"),
        ({"x": [1.0]}, "motions", {}, "is a state"),
        ({"b": 1.0}, "motions", {}, "must be a list"),
        ({"b": [1.0, 1.0]}, "motions", {}, "more than once"),
        ({"b": [1.0, np.nan]}, "motions", {}, "not finite"),
        ([{"b": 1.0}, {"mu": 1.0}], "motions", {}, "different parameters: b, mu"),
        (3, "motions", {}, "a dictionary or a list"),
        ({"b": [1.0]}, "x_mx", {}, "did you mean `x_max`"),
        ({"b": [1.0]}, "motion", {}, "cannot show 'motion'"),
        ({"b": [1.0]}, 3, {}, "a name, a study or a function"),
        ({"mu": [1.0]}, STUDY, {}, "`mu` varies in the branch"),
        ({"b": [1.0]}, {**STUDY, "seed": [{"name": "low", "state": {"y": 1}}]}, {}, "no state `y`"),
        ({"b": [1.0]}, {"failure": fold}, {}, "is taken"),
        ({"b": [1.0]}, lambda case: {"b": 1.0}, {}, "is taken"),
        ({"b": [1.0]}, "motions", {"refine": 1}, "at least two values"),
        ([{"b": 1.0}], "motions", {"refine": 1}, "only a grid"),
        ({"b": [1.0, 2.0]}, fold, {"refine": 1}, "by which value"),
        ({"b": [1.0, 2.0]}, fold, {"refine": 1, "by": "value"}, "not a category"),
        ({"b": [1.0, 2.0]}, "motions", {"refine": 22}, "fine grid would have"),
        ({"b": [1.0]}, "motions", {"by": "motions"}, "no effect without refine"),
        ({"b": [1.0]}, "motions", {"start": [1.0]}, "start has no effect"),
        ({"b": [1.0]}, ["x_max"], {"start": {"y": 1.0}}, "no state `y`"),
        ({"b": [1.0]}, "motions", {"client": 1, "jobs": 2}, "both client and jobs"),
        ({"b": [1.0]}, {"survey": [{"name": "s"}]}, {}, "no branches"),
        ({"b": [1.0]}, "motions", {"client": "tcp://here:1"}, "client of dask"),
    ],
)
def test_mistakes_name_their_remedy(cusp, over, what, options, said):
    with pytest.raises(foldline.InputError, match=said) as caught:
        foldline.map(cusp, over, what, **options)
    assert "help:" in str(caught.value)


def test_a_file_is_no_model():
    with pytest.raises(foldline.ArgumentError, match="a model is needed"):
        foldline.map("model.toml", {"b": [1.0]}, "motions")


def test_a_study_with_several_values_of_a_parameter_of_the_map_is_refused(cusp):
    seeds = [{"name": "low", "state": {"x": -2}, "parameters": {"b": value}} for value in (1.0, 2.0)]
    with pytest.raises(foldline.InputError, match="several values of `b`"):
        foldline.map(cusp, {"b": [1.0]}, {**STUDY, "seed": seeds})
    one = foldline.map(cusp, {"b": [3.0]}, {**STUDY, "seed": seeds[:1]})
    assert one["value"].values[0, 0] == pytest.approx(2.0)


def test_missing_packages_are_named_with_the_cure(cusp, monkeypatch):
    for module, client in (("xarray", None), ("distributed", "any")):
        with monkeypatch.context() as patch:
            patch.setitem(sys.modules, module, None)
            with pytest.raises(ImportError, match=r'pip install "foldline\[cluster\]"'):
                foldline.map(cusp, {"b": [1.0]}, "motions", client=client)
    monkeypatch.setitem(sys.modules, "scipy.stats", None)
    with pytest.raises(ImportError, match=r'pip install "foldline\[cluster\]"'):
        foldline.latin_hypercube({"b": (0, 1)}, 3)


def test_what_may_be_passing_is_tried_again(cusp, tmp_path):
    broken = tmp_path / "broken"
    broken.touch()

    def moody(case):
        if case["b"] > 1 and broken.exists():
            raise OSError("the disk is gone")
        return 1 / (case["b"] - 1) if case["b"] < 1 else case["b"] if case["b"] > 1 else 1 // 0

    over = {"b": [0.0, 1.0, 2.0]}
    with pytest.warns(foldline.EndedShort, match="2 of 3 cells"):
        foldline.map(cusp, over, moody, out=tmp_path / "map")
    broken.unlink()
    with pytest.warns(foldline.EndedShort, match="1 of 3 cells have no values: 1 × ZeroDivisionError"):
        found = foldline.map(cusp, over, moody, out=tmp_path / "map")
    assert found.attrs["cells_computed"] == 1 and found["value"].values[[0, 2]].tolist() == [-1.0, 2.0]


# Equality, folders, interruption.


def test_threads_give_the_serial_result_to_the_bit(cusp):
    over = {"b": np.linspace(-0.5, 3.0, 15)}
    assert bits(foldline.map(cusp, over, STUDY, jobs=1)) == bits(foldline.map(cusp, over, STUDY, jobs=3))


def test_progress_has_an_estimate(cusp):
    seen = []
    foldline.map(cusp, {"b": np.linspace(1, 2, 5)}, STUDY, jobs=1, progress=lambda *own: seen.append(own))
    assert [own[:2] for own in seen] == [(k, 5) for k in range(1, 6)]
    assert seen[0][2] > 0 and seen[-1][2] == 0


def test_an_interrupted_map_keeps_its_answers(cusp, tmp_path):
    def press(done, total, left):
        if done == 3:
            raise KeyboardInterrupt

    over = {"b": np.linspace(1, 2, 6)}
    with pytest.raises(foldline.Interrupted) as caught:
        foldline.map(cusp, over, STUDY, jobs=1, out=tmp_path / "map", progress=press)
    partial = caught.value.partial
    assert (partial["failure"] == "").values.tolist() == [True] * 3 + [False] * 3
    assert "interrupted" in partial["failure"].values[-1] and foldline.rescued() is partial
    rest = foldline.map(cusp, over, STUDY, jobs=1, out=tmp_path / "map")
    assert rest.attrs["cells_computed"] == 3
    assert bits(rest) == bits(foldline.map(cusp, over, STUDY, jobs=1))


KILLED = """
import os, signal, sys
import numpy as np
sys.path.insert(0, {tests!r})
import foldline
from test_maps_over_parameters import STUDY
model = foldline.model({text!r})

def kill(done, total, left):
    if done == 20:
        os.kill(os.getpid(), signal.SIGKILL)

foldline.map(model, {{"b": np.linspace(0.5, 3, 40)}}, STUDY, out={folder!r}, progress=kill)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_a_killed_map_computes_nothing_twice(cusp, tmp_path):
    folder = str(tmp_path / "map")
    script = KILLED.format(tests=os.path.dirname(__file__), text=cusp.text, folder=folder)
    ended = subprocess.run([sys.executable, "-c", script], capture_output=True, timeout=60)
    assert ended.returncode == -signal.SIGKILL, ended.stderr
    lines = (tmp_path / "map" / "cells.jsonl").read_text()
    # The power may also have failed in the middle of a line.
    (tmp_path / "map" / "cells.jsonl").write_text(lines + '[[0.99], "[{')
    again = foldline.model(cusp.text)
    found = foldline.map(again, {"b": np.linspace(0.5, 3, 40)}, STUDY, out=folder)
    assert found.attrs["cells_computed"] == 20
    stored = [line for line in (tmp_path / "map" / "cells.jsonl").read_text().splitlines() if line != '[[0.99], "[{']
    cells = [json.loads(line)[0][0] for line in stored]
    assert len(cells) == len(set(cells)) == 40
    assert bits(found) == bits(foldline.map(again, {"b": np.linspace(0.5, 3, 40)}, STUDY))


def test_a_folder_of_another_map_is_refused(cusp, tmp_path, monkeypatch):
    folder = tmp_path / "map"
    foldline.map(cusp, {"b": [1.0]}, STUDY, out=folder)
    other = foldline.model(cusp.text.replace("-2.0", "-1.5"))
    for model, over, what, said in (
        (other, {"b": [1.0]}, STUDY, "the model differs"),
        (cusp, {"b": [1.0, 2.0]}, STUDY, "the parameters or their values differs"),
        (cusp, {"b": [1.0]}, "motions", "what is computed differs"),
    ):
        with pytest.raises(foldline.RunFileError, match=said):
            foldline.map(model, over, what, out=folder)
    monkeypatch.setattr(foldline, "__version__", "99.0")
    with pytest.raises(foldline.RunFileError, match=r"version of foldline differs .*, 99\.0 here"):
        foldline.map(cusp, {"b": [1.0]}, STUDY, out=folder)


LIMIT = 1.0


def limited(case):
    return case["b"] > LIMIT


def test_a_function_is_known_by_its_text_and_by_what_it_refers_to(cusp, tmp_path, monkeypatch):
    offset, table = 1.0, np.arange(2000.0)
    own = lambda case: inner(case) + offset + table[1000]  # noqa: E731

    def first(case):
        return case["b"]

    def second(case):
        return -case["b"]

    inner = first
    before = fingerprint(own)
    assert before == fingerprint(own)
    offset = 2.0
    assert before != fingerprint(own)
    offset = 1.0
    table[1000] = 7.0
    assert before != fingerprint(own)
    table[1000] = 1000.0
    assert before == fingerprint(own)

    inner = second
    assert before != fingerprint(own)
    assert fingerprint(functools.partial(limited, 1)) != fingerprint(functools.partial(limited, 2))
    foldline.map(cusp, {"b": [2.0]}, limited, out=tmp_path / "map")
    monkeypatch.setitem(globals(), "LIMIT", 3.0)
    with pytest.raises(foldline.RunFileError, match="what is computed differs"):
        foldline.map(cusp, {"b": [2.0]}, limited, out=tmp_path / "map")


def test_a_map_is_saved_as_netcdf(cusp, tmp_path):
    found = foldline.map(cusp, {"b": [-1.0, 1.0], "mu": [0.0, 1.0]}, "motions", samples=16)
    found.to_netcdf(tmp_path / "map.nc")
    with xarray.open_dataset(tmp_path / "map.nc") as read:
        xarray.testing.assert_equal(found, read.load())


# Refinement.


def test_a_boundary_is_bracketed_by_halving(cusp):
    found = foldline.map(cusp, {"mu": [-3.0, 0.0, 3.0]}, "motions", samples=32, refine=6)
    assert found.sizes["mu"] == 129 and found.attrs["cells_computed"] == int(found["computed"].sum()) == 3 + 2 * 6
    several = found["mu"].values[found["motions"].values == "2 equilibria"]
    assert several.min() == -several.max() and 2 - 3 / 64 <= several.max() <= 2
    between = ~found["computed"].values
    assert set(found["failure"].values[between]) == {"not computed: the cells around it agree"}


def test_areas_of_a_refined_map_agree_with_theory(cusp):
    def number(case):
        return {"three": bool(case["b"] > 0 and 27 * case["mu"] ** 2 < 4 * case["b"] ** 3)}

    over = {"b": np.linspace(-1, 3, 9), "mu": np.linspace(-2.1, 2.1, 9)}
    found = foldline.map(cusp, over, number, refine=4)
    b, mu = np.meshgrid(found["b"], found["mu"], indexing="ij")
    right = (b > 0) & (27 * mu**2 < 4 * np.maximum(b, 0) ** 3)
    assert (found["three"].values == right.astype(str)).all()
    assert found["three"].size == 129**2 and found.attrs["cells_computed"] < 2000


# Scheduling.


def test_groups_keep_the_cost_of_a_task_below_its_limit():
    for task in (3e-4, 3e-3):
        for cell in (1e-4, 1e-2, 1.0):
            for threads in (1, 8, 1000):
                size = group_size(task, cell, threads, 10**9)
                assert task / (size * cell) <= COST and (size == 1 or size * cell <= max(60, 2 * task * threads / 0.5))
                assert group_size(task, cell, threads, 3) <= 3
    assert group_size(1e-3, 10.0, 8, 1000) == 1


# Values that can be sent.


def test_diagrams_branches_and_points_are_pickled(steady):
    cycles = steady.switch(steady.special["hopf"][0])
    diagram, branch, point, cycle = pickle.loads(pickle.dumps((cycles.diagram, cycles, steady.special["hopf"][0], cycles[3])))
    assert branch.diagram is diagram and [own.name for own in diagram] == [own.name for own in cycles.diagram]
    assert branch.parameters.tobytes() == cycles.parameters.tobytes() and branch.spectrum.tobytes() == cycles.spectrum.tobytes()
    assert point.value == steady.special["hopf"][0].value and point.sensitivity["A"] == steady.special["hopf"][0].sensitivity["A"]
    assert cycle.profile.tobytes() == cycles[3].profile.tobytes() and cycle.period == cycles[3].period
    assert foldline.follow(cycle, "B", (cycle["B"], cycle["B"] + 0.01)).family == "cycle"


def test_a_solution_that_lies_on_no_branch_says_how_to_send_it(brusselator):
    with pytest.raises(TypeError, match="let it settle again"):
        pickle.dumps(brusselator.settle())


# Uncertainty.


def test_derivatives_and_samples_agree_on_small_spreads(cusp):
    branch = foldline.follow(cusp.settle([-2.0]), "mu", (-2.5, 2.5))
    found = foldline.uncertainty(branch, {"b": 0.03}, samples=60)
    row = found["equilibrium over mu: fold 1"]
    # mu = 2 (b/3)^(3/2), so dmu/db = 1 at b = 3.
    assert row.first_order == pytest.approx(0.03, rel=1e-6) and row.sigma == pytest.approx(0.03, rel=0.05)
    assert row.mean == pytest.approx(2.0, abs=0.001) and row.without == {} and row.samples == 60
    assert list(found.to_pandas()["without"]) == [0, 0]
    assert len(found.plot()) > 4


def test_points_that_vanish_are_counted(cusp):
    branch = foldline.follow(foldline.Case(cusp, {"b": 0.5}).settle([-1.5]), "mu", (-2.5, 2.5))
    found = foldline.uncertainty(branch, {"b": (-0.5, 1.5)}, samples=40)
    row = found[0]
    assert row.samples == 30 and row.without == {"0 points of this kind on the branch instead of 2": 10}
    only = foldline.uncertainty(branch, {"b": 0.01}, samples=0)
    assert only.samples is None and only[0].first_order > 0 and np.isnan(only[0].sigma)


@pytest.mark.parametrize(
    ("spreads", "said"),
    [
        ({}, "no parameter is uncertain"),
        ({"mu": 0.1}, "`mu` varies"),
        ({"c": 0.1}, "no such parameter"),
        ({"b": -1.0}, "positive standard"),
    ],
)
def test_wrong_uncertainties_are_refused(cusp, spreads, said):
    branch = foldline.follow(cusp.settle([-2.0]), "mu", (-2.5, 2.5))
    with pytest.raises(foldline.InputError, match=said):
        foldline.uncertainty(branch, spreads)


# Pictures.


def test_maps_are_drawn(cusp):
    plane = foldline.map(cusp, {"b": np.linspace(-1, 3, 5), "mu": np.linspace(-2, 2, 5)}, "motions", samples=16, refine=2)
    axes = foldline.draw(plane)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["2 equilibria", "equilibrium"]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("b", "μ")
    with pytest.raises(foldline.InputError, match="some cells only"):
        foldline.draw(plane, "x_max", motion="equilibrium")
    folds = foldline.map(cusp, {"b": [1.0, 2.0, 3.0]}, STUDY)
    assert len(foldline.draw(folds, "value").lines) == 2
    with pytest.raises(foldline.InputError, match="no variable"):
        foldline.draw(folds, "values")
    cases = foldline.map(cusp, [{"b": 1.0}, {"b": 2.0}], fold)
    with pytest.raises(foldline.InputError, match=r"found\.plot\.scatter\(x='b', y='value'\)"):
        foldline.draw(cases)
    cases.plot.scatter(x="b", y="value")
    grid = foldline.map(cusp, {"b": [1.0, 2.0, 3.0], "mu": [0.0, 1.0, 2.0]}, ["x_max"], start=[3.0])
    assert foldline.draw(grid, "x_max").collections


# The book.


def test_the_examples_of_the_book_print_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    _, found = examples(os.path.join("docs", "book", "maps-over-parameters.md"))
    names = {}
    for number, (text, printed) in enumerate(found):
        script = tmp_path / f"example_{number}.py"
        script.write_text(text, encoding="utf-8")
        exec(compile(text, str(script), "exec"), names)
        assert capsys.readouterr().out == printed
    assert len(found) == 4 and (tmp_path / "jumps.png").exists() and (tmp_path / "uncertain.png").exists()
    kept = os.environ.get("FOLDLINE_PICTURES")
    for name in ("jumps.png", "uncertain.png") if kept else ():
        shutil.copy(tmp_path / name, os.path.join(kept, f"map-{name}"))

"""Messages about wrong calls show the right one; a study may be a path, a text or tables."""

import os
import pathlib

import numpy as np
import pytest

import foldline

from conftest import ROOT

STUDY = """
[[seed]]
name = "rest"
state = { x = 1.0, y = 1.5 }

[[branch]]
name = "steady"
from = "rest"
free = "B"
range = [0.5, 4]
"""


@pytest.fixture(scope="module")
def rest(brusselator):
    return brusselator.settle()


@pytest.fixture(scope="module")
def calls(brusselator, rest, steady):
    """Wrong calls by name: the call, the exception, and parts of the message."""
    (hopf,) = steady.special
    follow, hold, argument, value = foldline.follow, foldline.hold, foldline.ArgumentError, foldline.InputError
    return {
        "model for solution": (lambda: follow(brusselator, "B", (1, 2)), argument, 'foldline.follow(model.settle(), "B", (1, 2))'),
        "branch for solution": (lambda: follow(steady, "B", (1, 2)), argument, 'foldline.follow(branch[-1], "B", (1, 2))'),
        "diagram for solution": (lambda: follow(steady.diagram, "B", (1, 2)), argument, "diagram[0][-1]"),
        "state for solution": (lambda: follow([1.0, 1.5], "B", (1, 2)), argument, "model.settle(start)"),
        "text for solution": (lambda: follow("rest", "B", (1, 2)), argument, "but got a string"),
        "solution for model": (lambda: foldline.explore(rest, "B", (1, 2)), argument, 'foldline.explore(solution.model, "B", (1, 2))'),
        "branch for model": (lambda: foldline.survey(steady, "B", (1, 2)), argument, "branch.diagram.model"),
        "path for model": (lambda: foldline.explore("m.toml", "B", (1, 2)), argument, "foldline.model('m.toml')"),
        "class for model": (lambda: foldline.Model("model.toml"), argument, 'foldline.model("model.toml")'),
        "class for run": (lambda: foldline.Diagram("runs/study"), argument, 'foldline.open("runs/study")'),
        "no range": (lambda: follow(rest, "B"), argument, "the range of `B` is missing"),
        "no range held": (lambda: hold(hopf, "A"), argument, 'foldline.hold(point, "A", (0.5, 4))'),
        "range reversed": (lambda: follow(rest, "B", (4, 0.5)), value, 'foldline.follow(start, "B", (0.5, 4))'),
        "range empty": (lambda: follow(rest, "B", (2, 2)), value, "is empty"),
        "range infinite": (lambda: follow(rest, "B", (1, float("inf"))), value, "is not finite"),
        "range elsewhere": (lambda: follow(rest, "B", (3, 4)), value, "starts at B = 1.5, outside its range (3, 4)"),
        "range a number": (lambda: follow(rest, "B", 4), argument, "pair (smallest, largest)"),
        "range of three": (lambda: follow(rest, "B", (1, 2, 3)), argument, "has 3 values"),
        "range as text": (lambda: follow(rest, "B", ("0.5", 4)), argument, "has the string '0.5'"),
        "parameter forgotten": (lambda: follow(rest, (0.5, 4)), argument, 'foldline.follow(start, "A", (0.5, 4))'),
        "parameter unknown": (lambda: follow(rest, "b", (0.5, 4)), value, "did you mean `B`?"),
        "parameter a state": (lambda: follow(rest, "x", (0.5, 4)), value, "`x` is a state"),
        "parameter taken": (lambda: hold(hopf, "B", (0, 1)), value, "`B` varies already"),
        "switch as text": (lambda: follow(rest, "B", (0.5, 4), switch="hopf"), argument, 'switch={"hopf": 1}'),
        "mark as list": (lambda: follow(rest, "B", (0.5, 4), mark=[2]), argument, "mark must be a dictionary"),
        "tolerance as text": (lambda: follow(rest, "B", (0.5, 4), tolerance="1e-6"), argument, "is a string"),
        "points as float": (lambda: follow(rest, "B", (0.5, 4), max_points=2.5), value, "a whole number"),
        "value as text": (lambda: brusselator.settle(parameters={"B": "3"}), argument, "B = 3"),
        "values as list": (lambda: brusselator.settle(parameters=[3]), argument, 'parameters={"A": 1.0}'),
        "value unknown": (lambda: brusselator.settle(parameters={"b": 3}), value, "did you mean `B`?"),
        "state unknown": (lambda: brusselator.settle({"X": 1, "y": 2}), value, "did you mean `x`?"),
        "state missing": (lambda: brusselator.settle({"x": 1}), value, "the state y has no value"),
        "state as text": (lambda: brusselator.settle({"x": "1", "y": 2}), argument, "x = 1"),
        "states as texts": (lambda: brusselator.settle(["1", "2"]), argument, "not real numbers"),
        "state of a table": (lambda: brusselator.settle(np.ones((3, 2))), value, "states[-1]"),
        "simulated from a branch": (lambda: brusselator.simulate(steady, 5), argument, "branch[-1].state"),
        "settled at a branch": (lambda: brusselator.settle(steady), argument, "model.settle(branch[-1])"),
        "kind for point": (lambda: steady.switch("hopf"), argument, "branch.special['hopf'][0]"),
        "points for point": (lambda: steady.switch(steady.special), argument, 'branch.special["hopf"][0]'),
        "solution for point": (lambda: hold(rest, "A", (0.5, 2)), argument, 'foldline.hold(branch.special["fold"][0], "A", (0.5, 2))'),
        "model for study": (lambda: foldline.run(brusselator), argument, 'foldline.explore(model, "A", (0.5, 4))'),
        "solution for study": (lambda: foldline.run(rest), argument, 'foldline.follow(solution, "A", (0.5, 4))'),
        "number for study": (lambda: foldline.run(3), argument, 'foldline.run("study.toml")'),
        "solution beside study": (lambda: foldline.run(STUDY, rest), argument, "foldline.run(study, solution.model)"),
        "goal of a homotopy": (lambda: foldline.homotopy(rest, {"a": 2}, "B", (0.5, 4)), value, "did you mean `A`?"),
        "way of a homotopy": (lambda: foldline.homotopy(rest, {"A": 2}, "A", (0.5, 4)), value, "`A` varies already"),
        "folder for run": (lambda: foldline.open(rest), argument, 'foldline.open("runs/study")'),
        "column": (lambda: steady.plot(y="w"), value, "there is no quantity `w`"),
        "sweep of a branch": (lambda: foldline.sweep(steady, "B", (1, 2)), argument, 'foldline.sweep(branch[-1], "B", (1, 2))'),
        "sweep without range": (lambda: foldline.sweep(rest, "B"), argument, "the range of `B` is missing"),
        "sweep with both": (lambda: foldline.sweep(rest, "B", (1, 2), values=[1]), argument, "both a range and values"),
        "sweeps that are none": (lambda: steady.plot(sweeps=[rest]), argument, "surveys and sweeps are needed"),
        "nothing for a model": (lambda: foldline.model(), argument, "needs a file, equations or states"),
        "function for a path": (lambda: foldline.model(lambda s, p: s), argument, 'foldline.model(states="x y")(function)'),
        "function before states": (lambda: foldline.model(lambda s, p: s, states="x"), argument, "in place of a path"),
        "equations as path": (lambda: foldline.model({"x": "-x"}), argument, "foldline.model(equations="),
        "model as path": (lambda: foldline.model(brusselator), argument, "a model already"),
    }


def test_messages_about_wrong_calls_show_the_right_one(calls):
    wrong = []
    for name, (call, kind, words) in calls.items():
        try:
            call()
            wrong.append((name, "was let through"))
        except foldline.Error as error:
            if type(error) is not kind or words not in str(error) or "\n  help: " not in str(error):
                wrong.append((name, repr(error)))
    assert not wrong


def test_errors_are_also_the_usual_python_exceptions():
    assert issubclass(foldline.ArgumentError, (foldline.Error, TypeError)) and issubclass(foldline.ArgumentError, TypeError)
    assert issubclass(foldline.InputError, foldline.Error) and issubclass(foldline.InputError, ValueError)


def test_a_message_about_an_unknown_column_suggests_the_nearest(steady, rest):
    with pytest.raises(KeyError, match="did you mean `x_max`"):
        steady["x_maxx"]
    with pytest.raises(KeyError, match="did you mean `y_min`"):
        rest["y_minn"]


def right_hand_side(t, y, sigma, rho):
    return [sigma * (y[1] - y[0]), rho * y[0] - y[1]]


def reversed_side(y, t):
    return [-y[0]]


@pytest.mark.parametrize(
    ("function", "make", "words"),
    [
        (right_hand_side, foldline.model(states="a b"), "lambda s, p: right_hand_side(0.0, s, p.sigma, p.rho)"),
        (right_hand_side, foldline.model, 'states="x y", parameters=dict(sigma=1.0, rho=1.0)'),
        (reversed_side, foldline.model(states="x"), "lambda s, p: reversed_side(s, 0.0)"),
        (lambda t, y: -y, foldline.model, "as scipy.integrate.solve_ivp calls it"),
    ],
)
def test_a_function_written_for_scipy_is_recognised(function, make, words):
    with pytest.raises(foldline.TraceError) as refusal:
        make(function)
    assert words in str(refusal.value)
    assert "test_calls.py" in str(refusal.value)


def test_the_wrapping_that_the_message_shows_works():
    model = foldline.model(states="x y", parameters=dict(sigma=2.0, rho=3.0))(lambda s, p: right_hand_side(0.0, s, p.sigma, p.rho))
    assert model([1.0, 4.0]).tolist() == right_hand_side(0.0, [1.0, 4.0], 2.0, 3.0)


def test_a_study_may_be_a_path_a_text_or_tables(brusselator, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    brusselator.save("brusselator.toml")
    pathlib.Path("study.toml").write_text(f'model = "brusselator.toml"{STUDY}', encoding="utf-8")
    tables = {
        "seed": [{"name": "rest", "state": {"x": 1.0, "y": 1.5}}],
        "branch": [{"name": "steady", "from": "rest", "free": "B", "range": [0.5, 4]}],
    }
    runs = [
        foldline.run("study.toml"),
        foldline.run(pathlib.Path("study.toml")),
        foldline.run("study.toml", brusselator),
        foldline.run(STUDY, brusselator),
        foldline.run(f'model = "brusselator.toml"{STUDY}'),
        foldline.run(f'model = "elsewhere.toml"{STUDY}', brusselator),
        foldline.run(tables, brusselator),
        foldline.run({**tables, "model": brusselator}),
        foldline.run({**tables, "model": "brusselator.toml"}),
    ]
    first, *others = (run["steady"] for run in runs)
    assert first.special[0].kind == "hopf"
    for other in others:
        assert (other.parameters == first.parameters).all()
    # A run from a text is a run like any other.
    runs[3].save("run")
    assert (foldline.open("run")["steady"].parameters == first.parameters).all()
    assert (foldline.model(brusselator.text)([1.0, 2.0]) == brusselator([1.0, 2.0])).all()


def test_a_message_about_a_missing_file_suggests_an_existing_one(brusselator, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    brusselator.save("brusselator.toml")
    for make, what in ((foldline.model, "model"), (foldline.run, "study")):
        with pytest.raises(foldline.InputError, match=f"cannot read the {what} file brussellator.toml") as refusal:
            make("brussellator.toml")
        assert "did you mean `brusselator.toml`?" in str(refusal.value)
        assert str(tmp_path) in str(refusal.value)
    with pytest.raises(foldline.InputError, match="there is no folder"):
        foldline.run(os.path.join("nowhere", "study.toml"))
    with pytest.raises(foldline.InputError, match="it is a folder"):
        foldline.run(tmp_path)
    with pytest.raises(foldline.InputError, match=r"foldline\.model\('brusselator\.toml'\)"):
        foldline.run("brusselator.toml")
    foldline.follow(brusselator.settle(), "B", (0.5, 4), out="run")
    with pytest.raises(foldline.InputError, match=r"foldline\.open\('run'\)"):
        foldline.run("run")


def test_mistakes_in_the_text_of_a_study_are_reported_with_their_line(brusselator):
    with pytest.raises(foldline.InputError) as refusal:
        foldline.run(STUDY.replace('"B"', '"b"'), brusselator)
    assert "<study>:9:8" in str(refusal.value)
    assert "did you mean `B`?" in str(refusal.value)


def test_the_model_of_a_study_file_is_found_beside_it():
    diagram = foldline.run(pathlib.Path(ROOT, "studies", "overhung-rotor", "homotopy.toml"), max_steps=60_000)
    assert diagram.branches

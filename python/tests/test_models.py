"""Models from files, expressions and functions, and refused input."""

import os
import pickle
import subprocess

import numpy as np
import pytest

import foldline

from conftest import ROOT

PLACES = np.random.default_rng(1).normal(scale=2.0, size=(200, 4))


@pytest.mark.parametrize("kappa", [0.0, 0.3, 1.0])
def test_a_traced_function_equals_the_model_file_to_the_last_bit(rotor, rotor_file, kappa):
    at = {"kappa": kappa}
    assert (rotor(PLACES, at) == rotor_file(PLACES, at)).all()
    assert (rotor(PLACES, at, outputs=True) == rotor_file(PLACES, at, outputs=True)).all()


def test_strings_symbols_and_functions_give_the_same_tape():
    sympy = pytest.importorskip("sympy")
    x, y, mu = sympy.symbols("x y mu")
    by_text = foldline.model(equations={"x": "y", "y": "mu*(1 - x^2)*y - x"}, parameters={"mu": 1.5})
    by_sympy = foldline.model(equations={"x": y, "y": mu * (1 - x**2) * y - x}, parameters={"mu": 1.5})

    @foldline.model(states="x y", parameters={"mu": 1.5})
    def by_function(s, p):
        return {"x": s.y, "y": p.mu * (1 - s.x**2) * s.y - s.x}

    states = PLACES[:, :2]
    expected = np.stack([states[:, 1], 1.5 * (1 - states[:, 0] ** 2) * states[:, 1] - states[:, 0]], axis=1)
    for model in (by_text, by_sympy, by_function):
        assert np.allclose(model(states), expected, rtol=1e-14, atol=1e-14)
    assert (by_text(states) == by_function(states)).all()


def test_every_traced_numpy_function_has_its_value():
    positive = {"sqrt", "log", "log10", "log2", "reciprocal"}
    small = {"arcsin", "arccos"}
    one = [
        "sqrt", "exp", "log", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "sinh", "cosh", "tanh", "abs", "absolute", "fabs",
        "sign", "square", "negative", "positive", "reciprocal", "log10", "log2", "radians", "deg2rad",
    ]  # fmt: skip
    two = ["arctan2", "minimum", "maximum", "hypot", "add", "subtract", "multiply", "divide", "less", "greater_equal"]
    x, y = np.linspace(-0.9, 0.9, 7), np.linspace(0.8, -0.7, 7)
    for name in one:
        own = np.abs(x) + 0.1 if name in positive else x
        own = own if name not in small else 0.9 * own
        model = foldline.model(states="x y")(lambda s, p, name=name: (getattr(np, name)(s.x), 0.0))
        found = model(np.stack([own, y], axis=1))[:, 0]
        assert np.allclose(found, getattr(np, name)(own), rtol=1e-14, atol=1e-15), name
    for name in two:
        model = foldline.model(states="x y")(lambda s, p, name=name: (getattr(np, name)(s.x, s.y), 0.0))
        assert np.allclose(model(np.stack([x, y], axis=1))[:, 0], getattr(np, name)(x, y), rtol=1e-14), name


def test_conditions_arrays_and_constants_are_traced():
    matrix = np.array([[0.0, 1.0], [-2.0, -0.1]])

    @foldline.model(states="x y", parameters=dict(c=0.5))
    def model(s, p):
        inside = (s.x > -p.c) & (s.x < p.c) | ~(s.y < 3)
        force = np.where(inside, np.float64(0.0), np.clip(s.x, -1, 1) - np.sin(np.array([s.y, s.x]))[0])
        return matrix @ np.array([s.x, s.y]) + np.array([0.0, force])

    def plain(x, y):
        inside = (-0.5 < x < 0.5) or not (y < 3)
        return [y, -2.0 * x - 0.1 * y + (0.0 if inside else min(max(x, -1), 1) - np.sin(y))]

    for x, y in PLACES[:, :2]:
        assert np.allclose(model([x, y]), plain(x, y), rtol=1e-13, atol=1e-13)


def test_long_sums_and_deep_nesting_can_be_read_back():
    @foldline.model(states="x")
    def model(s, p):
        total, deep = 0.0, s.x
        for k in range(1, 500):
            total = total + s.x / k
            deep = 1 / (2 + deep)
        return total + deep

    total, deep = 0.0, 0.3
    for k in range(1, 500):
        total, deep = total + 0.3 / k, 1 / (2 + deep)
    assert model([0.3])[0] == pytest.approx(total + deep, rel=1e-13)


def test_sympy_piecewise_and_rationals_are_converted():
    sympy = pytest.importorskip("sympy")
    x = sympy.Symbol("x")
    expression = sympy.Piecewise((sympy.sqrt(x) / 3 - sympy.Rational(2, 7) / (1 + x**2), x > 1), (sympy.pi * x, True))
    model = foldline.model(equations={"x": expression})
    plain = sympy.lambdify(x, expression, "math")
    for value in (0.2, 0.9, 1.1, 3.0):
        assert model([value])[0] == pytest.approx(plain(value), rel=1e-14)


def branching(s, p):
    if s.x > 1:
        return s.x
    return -s.x


def foreign(s, p):
    import math

    return math.sin(s.x)


def stored(s, p):
    out = np.zeros(1)
    out[0] = s.x
    return out


def rounded(s, p):
    return s.x % 1.0


def unknown(s, p):
    return p.nu * s.x


def failing(s, p):
    return s.x.missing()


@pytest.mark.parametrize(
    ("function", "line", "words"),
    [
        (branching, "if s.x > 1:", "foldline.where"),
        (foreign, "return math.sin(s.x)", "functions of numpy"),
        (stored, "out[0] = s.x", "np.array"),
        (rounded, "return s.x % 1.0", "remove it"),
        (unknown, "return p.nu * s.x", "there is no parameter `nu`"),
        (failing, "return s.x.missing()", "AttributeError"),
    ],
)
def test_untraceable_operations_are_refused_with_line_and_remedy(function, line, words):
    with pytest.raises(foldline.TraceError) as refusal:
        foldline.model(states="x", parameters=dict(mu=1.0))(function)
    message = str(refusal.value)
    assert f"{os.path.basename(__file__)}:" in message
    assert line in message
    assert words in message
    assert "= help: " in message


def test_a_wrong_number_of_equations_is_refused():
    with pytest.raises(foldline.TraceError, match="returns 1 values for 2 states"):
        foldline.model(states="x y")(lambda s, p: s.x)


def test_a_mistake_in_a_model_file_is_reported_as_on_the_command_line(tmp_path):
    file = tmp_path / "wrong.toml"
    file.write_text('[parameters]\nmu = 1\n[states]\nx = "tahn(y)"\ny = "-x + nu"\n')
    with pytest.raises(foldline.InputError) as refusal:
        foldline.model(file)
    message = str(refusal.value)
    assert f"{file}:4:6" in message
    assert "did you mean `tanh`?" in message
    assert [own["line"] for own in refusal.value.diagnostics] == [4, 5]
    program = os.path.join(ROOT, "target", "debug", "foldline")
    if os.path.exists(program):
        told = subprocess.run([program, "check", str(file)], capture_output=True, text=True, check=False)
        assert told.stderr.strip() == message.strip()


def test_messages_about_wrong_arguments_give_the_remedy(brusselator):
    with pytest.raises(foldline.InputError, match=r"has no parameter `b`(.|\n)*help"):
        brusselator.settle(parameters={"b": 3})
    with pytest.raises(foldline.InputError, match="has no state `z`"):
        brusselator.settle({"z": 3})
    with pytest.raises(foldline.InputError, match="is not an attractor"):
        brusselator.settle("spiral")
    with pytest.raises(foldline.NoSolution, match="no stable cycle was found"):
        brusselator.settle("cycle")
    with pytest.raises(foldline.InputError, match="the wrong way round"):
        foldline.follow(brusselator.settle(), "B", (4, 0.5))
    for wrong in (dict(samples=0), dict(jobs=-1), dict(tolerance=1.0), dict(samples=2.5)):
        with pytest.raises(foldline.InputError, match=r"help: a (whole )?number from"):
            brusselator.settle(**wrong)
    for span, times in ((float("nan"), None), (1.0, [0.5, 2.0]), (1.0, [0.5, 0.2]), (1.0, [float("inf")])):
        with pytest.raises(foldline.InputError, match="help: "):
            brusselator.simulate([1.0, 1.0], span, times=times)
    with pytest.raises(foldline.InputError, match="cannot read the study file"):
        foldline.run("nowhere.toml", brusselator)
    with pytest.raises(foldline.InputError, match="no folder is given"):
        foldline.run({"survey": [{"name": "s", "free": "B", "values": [1]}]}, brusselator, resume=True)
    with pytest.raises(foldline.InputError, match="the start must be a solution"):
        foldline.follow(brusselator, "B", (0.5, 4))


def test_a_model_is_saved_read_and_pickled(brusselator, tmp_path):
    brusselator.save(tmp_path / "brusselator.toml")
    again = foldline.model(tmp_path / "brusselator.toml")
    packed = pickle.loads(pickle.dumps(brusselator))
    for model in (again, packed):
        assert model.text == brusselator.text
        assert (model([1.0, 2.0]) == brusselator([1.0, 2.0])).all()


def test_simulation_agrees_with_the_exact_solution():
    model = foldline.model(equations={"x": "y", "y": "-x"})
    times = np.linspace(0, 2 * np.pi, 9)
    track = model.simulate({"x": 1, "y": 0}, 2 * np.pi, times=times, tolerance=1e-10)
    assert track.ending == "reached"
    assert track.states.shape == (9, 2)
    # The interpolant is of order 4: coarser than the steps.
    assert np.abs(track["x"] - np.cos(times)).max() < 1e-7
    back = model.simulate(track.states[-1], (2 * np.pi, 0))
    assert np.abs(back.states[-1] - [1, 0]).max() < 1e-7
    assert list(track.to_pandas().columns) == ["t", "x", "y"]
    assert track.to_xarray()["x"].dims == ("t",)


@pytest.fixture(scope="module")
def duffing():
    @foldline.model(states="x v", parameters=dict(zeta=0.1, A=0.3, omega=1.2), frequency="omega")
    def duffing(s, p, t):
        return s.v, p.A * np.cos(p.omega * t) - 2 * p.zeta * s.v - s.x - s.x**3

    return duffing


def test_a_model_settles_from_a_state_in_any_form(brusselator):
    at = {"B": 3.0}
    named = brusselator.settle({"y": 0, "x": 2}, parameters=at)
    for form in ([2, 0], (2.0, 0.0), np.array([2, 0])):
        assert brusselator.settle(form, parameters=at).period == named.period
    track = brusselator.simulate({"x": 2, "y": 0}, 40, parameters=at)
    assert brusselator.settle(track, parameters=at).period == pytest.approx(named.period, rel=1e-6)
    # A solution provides its parameters, unless others are given.
    assert brusselator.settle(named).period == pytest.approx(named.period, rel=1e-6)
    other = brusselator.settle(named, parameters={"B": 3.1})
    assert other["B"] == 3.1
    assert other.period > named.period


def test_a_result_of_scipy_can_be_settled(brusselator):
    integrate = pytest.importorskip("scipy.integrate")
    at = {"B": 3.0}
    sol = integrate.solve_ivp(lambda t, y: brusselator(y, at), (0, 40), [2.0, 0.0], rtol=1e-8, atol=1e-8)
    cycle = brusselator.settle(sol, parameters=at)
    assert cycle.is_cycle
    assert cycle.period == pytest.approx(brusselator.settle([2, 0], parameters=at).period, rel=1e-6)
    lorenz = foldline.model(equations={"x": "y", "y": "-x", "z": "-z"})
    with pytest.raises(foldline.InputError, match=r"an array y of shape \(2, .*has 3 states"):
        lorenz.settle(sol)
    failed = integrate.solve_ivp(lambda t, y: y**2, (0, 2), [1.0, 1.0])
    assert not failed.success
    with pytest.raises(foldline.InputError, match="the simulation failed"):
        brusselator.settle(failed)


def test_a_forced_simulation_is_continued_to_the_start_of_a_period(duffing):
    """At omega = 1.5 two cycles attract: a state at the wrong phase may lead to the other one."""
    integrate = pytest.importorskip("scipy.integrate")
    at = {"omega": 1.5, "A": 0.3, "zeta": 0.05}
    period = 2 * np.pi / 1.5
    large, small = (duffing.settle(state, parameters=at) for state in ([1.4, 0.0], [-0.2, 0.0]))
    assert large["x_max"] > 2 * small["x_max"]
    assert duffing._beginning([1.0, 0.0], at).tolist() == [1.0, 0.0]
    for cycle in (large, small):
        for share in (0.25, 0.5, 0.75):
            end = (3 + share) * period
            sol = integrate.solve_ivp(lambda t, y: duffing(y, at, t), (0, end), cycle.state, rtol=1e-10, atol=1e-10)
            assert np.abs(duffing._beginning(sol, at) - cycle.state).max() < 1e-6
            assert duffing.settle(sol, parameters=at)["x_max"] == pytest.approx(cycle["x_max"], rel=1e-6)
            track = duffing.simulate(cycle, end, tolerance=1e-10)
            assert np.abs(duffing._beginning(track, at) - cycle.state).max() < 1e-6

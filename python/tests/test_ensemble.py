"""Ensembles, and the way of a kernel to a card, for which a C compiler stands in here."""

import ctypes
import shutil
import subprocess
import sys
import types

import numpy as np
import pytest

import foldline


@pytest.fixture(scope="module")
def pendulum():
    return foldline.model(
        equations={"x": "v", "v": "-sin(x) - d*v + a*cos(w*t)"},
        parameters={"d": 0.2, "a": 0.3, "w": 0.7},
        period="2*pi/w",
    )


@pytest.fixture(scope="module")
def well():
    return foldline.model(equations={"x": "v", "v": "x - x^3 - d*v"}, parameters={"d": 0.25})


def starts(count):
    return 2 * np.modf(np.arange(1, count + 1)[:, None] * np.sqrt([2.0, 3.0]))[0] - 1


def test_an_ensemble_is_as_accurate_as_one_trajectory(well):
    at = starts(600)
    ends = foldline.ensemble(well, at, 20.0, tolerance=1e-8)
    assert len(ends) == 600 and set(ends.endings) == {"reached"} and (ends.times == 20.0).all()
    for k in (0, 255, 256, 599):
        one = well.simulate(at[k], 20.0, times=[20.0], tolerance=1e-10).states[-1]
        # Both wells attract, so errors do not grow; some hundred steps of 1e-8 each.
        assert np.abs(ends.states[k] - one).max() < 1e-6
    assert np.array_equal(ends["v"], ends.states[:, 1])
    assert np.array_equal(ends.states, foldline.ensemble(well, at, 20.0, tolerance=1e-8, jobs=1).states)


def test_parameters_may_differ_between_trajectories(well):
    damping = np.linspace(0.1, 1.0, 50)
    ends = foldline.ensemble(well, np.tile([0.1, 0.0], (50, 1)), 5.0, parameters={"d": damping})
    one = foldline.ensemble(well, [[0.1, 0.0]], 5.0, parameters={"d": damping[7]})
    assert np.array_equal(ends.states[7], one.states[0])


def test_a_forced_model_may_have_periods_that_differ(pendulum):
    frequency = np.array([0.5, 0.7, 0.9])
    ends = foldline.ensemble(pendulum, np.zeros((3, 2)), (1.0, 12.0), parameters={"w": frequency}, tolerance=1e-9)
    for k, w in enumerate(frequency):
        one = pendulum.simulate([0, 0], (1.0, 12.0), times=[12.0], parameters={"w": w}, tolerance=1e-11).states[-1]
        assert np.abs(ends.states[k] - one).max() < 1e-6


def test_mistakes_are_explained(well):
    with pytest.raises(foldline.InputError, match="a column for each of x, v"):
        foldline.ensemble(well, [[1.0, 2.0, 3.0]], 1.0)
    with pytest.raises(foldline.InputError, match="'cpu' or 'cuda'"):
        foldline.ensemble(well, [[1.0, 2.0]], 1.0, device="gpu")
    with pytest.raises(foldline.InputError, match="3 values for 1 trajectories"):
        foldline.ensemble(well, [[1.0, 2.0]], 1.0, parameters={"d": [1, 2, 3]})
    with pytest.raises(foldline.InputError, match="no parameter `e`"):
        foldline.ensemble(well, [[1.0, 2.0]], 1.0, parameters={"e": [1.0]})


def test_a_missing_card_is_a_typed_error(well, monkeypatch):
    monkeypatch.setitem(sys.modules, "cupy", None)
    with pytest.raises(foldline.DeviceError, match=r"pip install foldline\[cuda\]"):
        foldline.ensemble(well, [[1.0, 2.0]], 1.0, device="cuda")


class Array(np.ndarray):
    """An array with CuPy's address and copy to the host."""

    @property
    def data(self):
        return types.SimpleNamespace(ptr=self.ctypes.data)

    def get(self):
        return np.array(self)


def stand_in(folder):
    """Returns a module with the part of CuPy that is used; kernels are compiled for the processor."""

    class Module:
        def __init__(self, code, options):
            source, library = folder / "kernel.c", folder / f"kernel{abs(hash(code))}.so"
            source.write_text(code)
            subprocess.run(["cc", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-o", library, source, "-lm"], check=True)
            self.library = ctypes.CDLL(str(library))
            self.job = None

        def get_global(self, name):
            assert name == "fl_the_job"

            def copy(address, size):
                self.job = ctypes.create_string_buffer(ctypes.string_at(address, size), size)

            return types.SimpleNamespace(copy_from_host=copy)

        def get_function(self, name):
            assert name == "fl_kernel"
            return lambda grid, block, arguments: self.library.fl_run_all(self.job)

    def view(array):
        return np.ascontiguousarray(array).view(Array)

    runtime = types.SimpleNamespace(getDeviceCount=lambda: 1)
    device = types.SimpleNamespace(attributes={"MultiProcessorCount": 2}, synchronize=lambda: None)
    cuda = types.SimpleNamespace(runtime=runtime, Device=lambda: device, compiler=types.SimpleNamespace(CompileException=OSError))
    made = types.ModuleType("cupy")
    made.cuda, made.RawModule, made.asarray = cuda, Module, view
    made.empty = lambda shape, dtype=float: view(np.full(shape, 77, dtype))
    made.zeros = lambda shape, dtype=float: view(np.zeros(shape, dtype))
    return made


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_a_kernel_gets_its_job_and_returns_what_the_processor_does(well, pendulum, monkeypatch, tmp_path):
    from foldline import _cuda

    monkeypatch.setitem(sys.modules, "cupy", stand_in(tmp_path))
    _cuda._kernel.cache_clear()
    damping = np.linspace(0.1, 1.0, 100)
    for model, parameters in ((well, {}), (well, {"d": damping}), (pendulum, {"d": damping}), (pendulum, {})):
        for span in (10.0, (2.0, -0.5)):
            found = [foldline.ensemble(model, starts(100), span, parameters=parameters, device=device) for device in ("cpu", "cuda")]
            # The C library of another compiler may differ in the last digit of a sine.
            assert np.abs(found[0].states - found[1].states).max() < 1e-10
            assert np.array_equal(found[0].steps, found[1].steps) and np.array_equal(found[0].endings, found[1].endings)
            assert np.allclose(found[0].times, found[1].times, rtol=1e-15)
    _cuda._kernel.cache_clear()


@pytest.mark.skipif(shutil.which("cc") is None, reason="needs a C compiler")
def test_what_slides_is_integrated_on_the_processor(monkeypatch, tmp_path):
    from foldline import _cuda

    friction = foldline.model(equations={"x": "v", "v": "-x - 0.5*sign(v)"})
    monkeypatch.setitem(sys.modules, "cupy", stand_in(tmp_path))
    _cuda._kernel.cache_clear()
    found = [foldline.ensemble(friction, 3 * starts(40), 30.0, device=device) for device in ("cpu", "cuda")]
    assert set(found[1].endings) == {"reached"}
    assert np.abs(found[0].states - found[1].states).max() < 1e-10
    # Everything has come to rest.
    assert np.abs(found[1]["v"]).max() < 1e-9 and np.abs(found[1]["x"]).max() <= 0.5 + 1e-9
    _cuda._kernel.cache_clear()

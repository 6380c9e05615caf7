"""Ctrl-C, the interpreter's lock, and imports."""

import _thread
import os
import signal
import subprocess
import sys
import threading

import pytest

import foldline

from conftest import ROOT

STUDY = os.path.join(ROOT, "studies", "overhung-rotor", "bouncing.toml")


@pytest.fixture(autouse=True)
def heeded():
    """Makes Ctrl-C raise an exception, which processes started in the background by a shell ignore by default."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="module")
def long_study(tmp_path_factory):
    """The reference study with a tolerance that makes it take long enough to be interrupted."""
    with open(STUDY, encoding="utf-8") as file:
        text = "tolerance = 1e-9\n" + file.read().replace("../../models", os.path.join(ROOT, "models"))
    path = tmp_path_factory.mktemp("study") / "long.toml"
    path.write_text(text, encoding="utf-8")
    return path


def interrupting(points):
    """Returns a progress function that presses Ctrl-C once after a number of points, and the calls it received."""
    seen = []

    def show(count, special, place):
        if count >= points and not seen:
            seen.append((count, special, place))
            _thread.interrupt_main()

    return show, seen


def test_ctrl_c_stops_at_the_next_point_and_keeps_earlier_results(long_study):
    show, seen = interrupting(1)
    with pytest.raises(foldline.Interrupted) as interrupt:
        foldline.run(long_study, progress=show)
    assert isinstance(interrupt.value, KeyboardInterrupt)
    assert "Omega = " in seen[0][2]
    partial = interrupt.value.partial
    assert foldline.rescued() is partial
    points = sum(len(branch) for branch in partial)
    assert points >= seen[0][0]
    assert any(branch.stopped for branch in partial)


def test_an_interrupted_run_in_a_folder_resumes(long_study, tmp_path):
    show, _seen = interrupting(1)
    with pytest.raises(foldline.Interrupted) as interrupt:
        foldline.run(long_study, out=tmp_path / "run", progress=show)
    kept = {branch.name: len(branch) for branch in interrupt.value.partial}
    whole = foldline.run(long_study, out=tmp_path / "run", resume=True)
    assert not any(branch.stopped for branch in whole)
    assert all(len(whole[name]) >= count for name, count in kept.items())
    assert sum(len(branch) for branch in whole) > sum(kept.values())


def test_other_threads_run_while_it_computes(long_study):
    turns = []
    done = threading.Event()

    def turn():
        while not done.wait(0.001):
            turns.append(1)

    thread = threading.Thread(target=turn)
    thread.start()
    before = len(turns)
    foldline.run(long_study)
    after = len(turns)
    done.set()
    thread.join()
    assert after - before > 20


def test_a_mistake_in_progress_is_raised(long_study):
    def wrong(points, special, place):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        foldline.run(long_study, progress=wrong)


def test_progress_counts_the_points(steady, brusselator):
    last = []
    branch = foldline.follow(brusselator.settle(), "B", (0.5, 4), progress=lambda points, special, place: last.append((points, special)))
    assert last[-1] == (len(branch), 1)


def test_a_bar_is_shown_on_request(brusselator, capfd):
    pytest.importorskip("tqdm")
    foldline.follow(brusselator.settle(), "B", (0.5, 4), progress=True)
    assert "1 special" in capfd.readouterr().err


def test_heavy_packages_are_imported_on_first_use():
    code = (
        "import sys, foldline\n"
        "m = foldline.model(equations={'x': 'mu - x^2'}, parameters={'mu': 1.0})\n"
        "b = foldline.follow(m.settle([1.0]), 'mu', (-1, 2)); repr(b); b._repr_html_()\n"
        "heavy = ('matplotlib', 'plotly', 'xarray', 'pandas', 'sympy', 'scipy', 'tqdm', 'IPython')\n"
        "print([name for name in heavy if name in sys.modules])\n"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"

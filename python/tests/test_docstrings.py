"""Public names are documented in one style, and their examples run."""

import doctest
import importlib
import inspect
import pkgutil

import pytest

import foldline

PUBLIC = [getattr(foldline, name) for name in foldline.__all__]
MODULES = ["foldline", *(f"foldline.{own.name}" for own in pkgutil.iter_modules(foldline.__path__) if own.name != "_native")]
#: Names that need no example: methods that draw, convert or store, whose examples would show nothing.
QUIET = ("plot", "plotly", "to_pandas", "to_xarray", "save", "signed_spectrum", "at")


def members():
    for own in PUBLIC:
        yield own.__name__, own
        if inspect.isclass(own):
            for name, part in vars(own).items():
                if not name.startswith("_") and (callable(part) or isinstance(part, property) or hasattr(part, "func")):
                    yield f"{own.__name__}.{name}", part


@pytest.mark.parametrize("name", MODULES)
def test_examples_run(name):
    module = importlib.import_module(name)
    found = doctest.testmod(module, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert found.failed == 0
    if name in ("foldline", "foldline._compute", "foldline._model", "foldline._sweeps"):
        assert found.attempted > 2


def test_everything_public_is_documented():
    missing = [name for name, part in members() if not inspect.getdoc(part)]
    assert not missing


def test_docstrings_have_parameters_returns_and_examples():
    wrong = []
    for name, part in members():
        if not inspect.isfunction(part):
            continue
        text, last = inspect.getdoc(part) or "", name.rsplit(".", 1)[-1]
        taken = [own for own in inspect.signature(part).parameters if own != "self"]
        section = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0] if taken else ""
        documented = text.partition("Parameters\n----------\n")[2]
        lines = [line.split(" : ")[0].lstrip("*") for line in documented.splitlines() if line and not line.startswith(" ")]
        named = {word.strip() for line in lines for word in line.split(",")}
        wrong += [f"{name}: {own}" for own in taken if own not in named]
        wrong += [f"{name}: Examples"] if ">>>" not in text and last not in QUIET else []
        returns = inspect.signature(part).return_annotation not in ("None", None)
        wrong += [f"{name}: Returns"] if returns and "Returns\n-------" not in text else []
        assert section or not taken, name
    assert not wrong


def test_classes_have_an_example_or_are_exceptions():
    without = [own.__name__ for own in PUBLIC if inspect.isclass(own) and ">>>" not in (own.__doc__ or "")]
    kinds = (BaseException,)
    assert [name for name in without if not issubclass(getattr(foldline, name), kinds)] == ["Responses"]

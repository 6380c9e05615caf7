"""Public names are documented in one style, and their examples run."""

import doctest
import inspect

import pytest
from matplotlib import pyplot

import foldline

PUBLIC = [getattr(foldline, name) for name in foldline.__all__]
#: Functions without errors of their own.
HARMLESS = ("Basins.part", "Basins.share", "Survey.at", "rescued", "where")


def members():
    for own in PUBLIC:
        yield own.__name__, own
        if inspect.isclass(own):
            for name, part in vars(own).items():
                if not name.startswith("_") and (callable(part) or isinstance(part, property) or hasattr(part, "func")):
                    yield f"{own.__name__}.{name}", part


EXAMPLES = {name: inspect.getdoc(own) or "" for name, own in [("foldline", foldline), *members()]}
#: Compared as the book is: white space may differ, and an ellipsis stands for numbers that depend on the processor.
FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


# doctest.testmod passes over methods of classes whose module was renamed to that from which they are imported.
@pytest.mark.parametrize("name", [name for name, text in EXAMPLES.items() if ">>>" in text])
def test_examples_run(name):
    test = doctest.DocTestParser().get_doctest(EXAMPLES[name], {}, name, None, None)
    result = doctest.DocTestRunner(optionflags=FLAGS).run(test)
    pyplot.close("all")
    assert result.attempted > 1
    assert result.failed == 0


def test_everything_public_is_documented():
    missing = [name for name, part in members() if not inspect.getdoc(part)]
    assert not missing


def test_docstrings_have_parameters_returns_errors_and_examples():
    wrong = []
    for name, part in members():
        if not inspect.isfunction(part):
            continue
        text = inspect.getdoc(part) or ""
        taken = [own for own in inspect.signature(part).parameters if own != "self"]
        section = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0] if taken else ""
        documented = text.partition("Parameters\n----------\n")[2]
        lines = [line.split(" : ")[0].lstrip("*") for line in documented.splitlines() if line and not line.startswith(" ")]
        named = {word.strip() for line in lines for word in line.split(",")}
        wrong += [f"{name}: {own}" for own in taken if own not in named]
        wrong += [f"{name}: Examples"] if ">>>" not in text else []
        wrong += [f"{name}: Raises"] if "Raises\n------" not in text and name not in HARMLESS else []
        returns = inspect.signature(part).return_annotation not in ("None", None)
        wrong += [f"{name}: Returns"] if returns and "Returns\n-------" not in text else []
        assert section or not taken, name
    assert not wrong


def test_classes_have_an_example_or_are_exceptions():
    without = [own.__name__ for own in PUBLIC if inspect.isclass(own) and ">>>" not in (own.__doc__ or "")]
    kinds = (BaseException,)
    assert [name for name in without if not issubclass(getattr(foldline, name), kinds)] == []

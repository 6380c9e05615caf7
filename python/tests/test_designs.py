"""Answers to design questions."""

import math

import pytest

import foldline

MODEL = foldline.model(equations={"x": "1 - p - (l - 2)^2 - x^2"}, parameters={"l": 2.0, "p": 0.1})
STUDY = """
[[seed]]
name = "s"
state = { x = 1 }

[[branch]]
name = "b"
from = "s"
free = "l"
range = [0, 5]

[[design]]
name = "inside"
of = "b"
least = { p = [0, 3] }
without = "motion"

[[design]]
name = "narrow"
of = "b"
least = { p = [0, 0.5] }
without = "motion"
"""


def test_answers_have_values_errors_and_reasons():
    diagram = foldline.run(STUDY, MODEL)
    inside, narrow = diagram.designs["inside"], diagram.designs["narrow"]
    assert abs(inside.value - 1) <= inside.error < 1e-6 and inside.answered and not inside.reasons
    assert inside.at == pytest.approx(2, abs=1e-3) and inside.binds == "inside" and inside.vary == "p"
    assert inside.curve in [branch.name for branch in diagram] and len(inside.checks) == 2
    assert not narrow.answered and math.isnan(narrow.value) and "end of its range" in narrow.reasons[0]
    assert "not answered" in repr(narrow) and "least p" in repr(inside)

"""Display of results: text in terminals, a small diagram with a table in notebooks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from . import _native
from ._branch import Branch, SpecialPoint, SpecialPoints, branch_text_of
from ._plot import quantities

if TYPE_CHECKING:
    from ._diagram import Diagram
    from ._model import Model
    from ._responses import Responses
    from ._solution import Attractors, Solution

#: Largest number of rows shown; the rest is counted.
_MOST = 40
#: Width and height of the picture.
_SIZE = (640.0, 360.0)


def _cells(points: SpecialPoints) -> tuple[list[str], list[list[str]]]:
    """Returns columns and rows of special points, without constant parameters."""
    shown = list(points)
    if not shown:
        return [], []
    model = shown[0].model
    free = {own.branch.free for own in shown} | {own.branch.held[1] for own in shown if own.branch.held}
    varying = [n for n in model.parameters if n in free or len({own[n] for own in shown}) > 1]
    outputs = [name for name in model.outputs if name in shown[0].ranges]
    cycles = any(own.is_cycle for own in shown)
    names = ["branch", "kind", *varying, *(["period"] if cycles else []), *(f"{n}_max" for n in outputs), "unstable", "error"]
    forms = any(own.normal_form for own in shown)
    rows = []
    for own in shown:
        numbers = [_significant(own, name) for name in [*varying, *(["period"] if cycles else []), *(f"{n}_max" for n in outputs)]]
        row = [own.branch.name, own.kind, *("" if np.isnan(v) else f"{v:.10g}" for v in numbers)]
        row += [f"{own.unstable_before} → {own.unstable_after}", f"{own.error:.1e}"]
        rows.append([*row, *([own.normal_form] if forms else [])])
    return [*names, *(["normal form"] if forms else [])], rows


def _significant(own: SpecialPoint, name: str) -> float:
    """Returns a quantity; the parameter of the branch is rounded to digits that its error justifies."""
    value = own[name]
    error = own.error * (own.branch.scale + abs(value))
    if name != own.branch.free or not 0 < error < 1:
        return value
    return round(value, 2 - math.floor(math.log10(error))) + 0.0


def special_text(points: SpecialPoints) -> str:
    """Writes a table in aligned columns."""
    names, rows = _cells(points)
    if not rows:
        return "no special points"
    widths = [max(len(row[k]) for row in [names, *rows]) for k in range(len(names))]
    words = {0, 1, len(names) - 1} if names[-1] == "normal form" else {0, 1}

    def line(row: list[str]) -> str:
        cells = (c.ljust(w) if k in words else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True)))
        return "  ".join(cells).rstrip()

    return "\n".join(line(row) for row in [names, *rows])


def branch_text(branch: Branch) -> str:
    """Text of a branch for `repr`."""
    table = f"\n{special_text(branch.special)}" if len(branch.special) else ""
    return f"<branch {branch_text_of(branch)}>{table}"


def diagram_text(own: Diagram) -> str:
    """Text of a diagram for `repr`."""
    points = sum(len(branch) for branch in own)
    head = f"<diagram of {own.model.name}: {len(own)} branches, {points} points, {len(own.special)} special points>"
    return "\n".join([head, *(f"  {branch_text_of(branch)}" for branch in own)])


def special_table(points: SpecialPoints) -> str:
    """A table of special points."""
    names, rows = _cells(points)
    if not rows:
        return "<p>no special points</p>"
    head = "".join(f"<th>{escape(name)}</th>" for name in names)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows[:_MOST])
    more = f"<p>and {len(rows) - _MOST} more</p>" if len(rows) > _MOST else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def branches(shown: Sequence[Branch], caption: str) -> str:
    """A small diagram and the table of special points."""
    special = SpecialPoints([point for branch in shown for point in branch.special])
    return f"<div><p>{escape(caption)}</p>{_picture(shown)}{special_table(special)}</div>"


def diagram(own: Diagram) -> str:
    """A small picture of a whole diagram and the table of its special points."""
    ordinary = [branch for branch in own if branch.held is None] or list(own)
    lines = "<br>".join(escape(line) for line in diagram_text(own).splitlines()[1 : _MOST + 1])
    special = special_table(own.special)
    return f"<div>{_picture(ordinary)}<details><summary>{len(own)} branches</summary>{lines}</details>{special}</div>"


def _picture(shown: Sequence[Branch]) -> str:
    """Draws the picture of the command line, smaller."""
    drawn = [branch for branch in shown if len(branch)]
    if not drawn:
        return ""
    held = drawn[0].held
    x, y = (held[1], drawn[0].free) if held is not None else quantities(drawn, None, None)
    svg = _native.svg(drawn[0].diagram._native, [branch._index for branch in drawn], x, y, _SIZE)
    return f'<div style="max-width: {_SIZE[0]:g}px; background: white">{svg}</div>'


def solution(own: Solution) -> str:
    """A table of the properties of a solution."""
    rows = [*((name, f"{value:.10g}") for name, value in own.parameters.items())]
    rows += [(name, f"{low:.8g} … {high:.8g}") for name, (low, high) in own.ranges.items()]
    what = "multipliers" if own.is_cycle else "eigenvalues"
    rows.append((what, ", ".join(f"{value:.5g}" for value in own.spectrum)))
    rows.append(("trust", ", ".join(f"{name} {value:.1e}" for name, value in own.trust.items())))
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<div><p>{escape(own._what())}</p><table>{body}</table></div>"


def attractors(found: Attractors) -> str:
    """A table of attractors."""
    shares = ["" if own.share is None else "{:.3f} [{:.3f}, {:.3f}]".format(*own.share) for own in found]
    cells = [(str(own.hits), share, escape(own._what())) for own, share in zip(found, shares, strict=True)]
    rows = "".join(f"<tr><td>{'</td><td>'.join(row)}</td></tr>" for row in cells)
    head = "<tr><th>hits</th><th>share of uniform</th><th>attractor</th></tr>"
    return f"<div><table>{head}{rows}</table><p>{escape(repr(found).splitlines()[-1])}</p></div>"


def responses(own: Responses) -> str:
    """A line about a survey or sweep, and its first rows."""
    names = ["value", "motion", *(f"{name}_max" for name in [*own.model.states, *own.model.outputs][:6])]
    names += ["share"] if "share" in own and np.isfinite(own["share"]).any() else ["jumped"]
    count = len(own.value)
    rows = [[_cell(own[name][k]) for name in names] for k in range(min(count, _MOST))]
    head = "".join(f"<th>{escape(own.free if name == 'value' else name)}</th>" for name in names)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    more = f"<p>and {count - _MOST} more</p>" if count > _MOST else ""
    return f"<div><p>{escape(repr(own))}</p><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}</div>"


def _cell(value: object) -> str:
    if isinstance(value, (float, np.floating)):
        return "" if np.isnan(value) else f"{value:.8g}"
    return {True: "jump", False: "", None: ""}.get(value, str(value)) if value is None or isinstance(value, bool) else str(value)


def model(own: Model) -> str:
    """A model as its text."""
    return f"<div><p>{escape(repr(own))}</p><details><summary>text</summary><pre>{escape(own.text)}</pre></details></div>"

"""How results show themselves: text in terminals, a small diagram with a table in notebooks."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ._branch import Branch, SpecialPoints, branch_text_of
from ._plot import COLOURS, _root, quantities, stretches

if TYPE_CHECKING:
    from ._diagram import Diagram
    from ._model import Model
    from ._solution import Solution

#: Rows of a table that are shown; the rest is counted.
_MOST = 40
_WIDTH, _HEIGHT, _MARGIN = 420, 240, 34


def _cells(points: SpecialPoints) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of special points. Parameters that are the same everywhere are left out."""
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
        numbers = [own[name] for name in [*varying, *(["period"] if cycles else []), *(f"{n}_max" for n in outputs)]]
        row = [own.branch.name, own.kind, *("" if np.isnan(v) else f"{v:.10g}" for v in numbers)]
        row += [f"{own.unstable_before} → {own.unstable_after}", f"{own.error:.1e}"]
        rows.append([*row, *([own.normal_form] if forms else [])])
    return [*names, *(["normal form"] if forms else [])], rows


def special_text(points: SpecialPoints) -> str:
    """A table in aligned columns."""
    names, rows = _cells(points)
    if not rows:
        return "no special points"
    widths = [max(len(row[k]) for row in [names, *rows]) for k in range(len(names))]
    words = {0, 1, len(names) - 1} if names[-1] == "normal form" else {0, 1}
    line = lambda row: "  ".join(c.ljust(w) if k in words else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True)))  # noqa: E731
    return "\n".join(line(row).rstrip() for row in [names, *rows])


def branch_text(branch: Branch) -> str:
    """What `repr` says of a branch."""
    table = f"\n{special_text(branch.special)}" if len(branch.special) else ""
    return f"<branch {branch_text_of(branch)}>{table}"


def diagram_text(own: Diagram) -> str:
    """What `repr` says of a diagram."""
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
    """The same for a whole diagram."""
    ordinary = [branch for branch in own if branch.held is None] or list(own)
    lines = "<br>".join(escape(line) for line in diagram_text(own).splitlines()[1 : _MOST + 1])
    special = special_table(own.special)
    return f"<div>{_picture(ordinary)}<details><summary>{len(own)} branches</summary>{lines}</details>{special}</div>"


def _picture(shown: Sequence[Branch]) -> str:
    """An SVG of a few kilobytes: stable solid, unstable dashed, special points as dots."""
    drawn = [branch for branch in shown if len(branch)]
    if not drawn:
        return ""
    held = drawn[0].held
    x, y = (held[1], drawn[0].free) if held is not None else quantities(drawn, None, None)
    across = np.concatenate([branch[x] for branch in drawn])
    up = np.concatenate([branch[y] for branch in drawn])
    seen = np.isfinite(across) & np.isfinite(up)
    if not seen.any():
        return ""
    low, high = np.array([across[seen].min(), up[seen].min()]), np.array([across[seen].max(), up[seen].max()])
    span = np.where(high > low, high - low, 1.0)

    def place(a: Any, b: Any) -> str:
        px = _MARGIN + (a - low[0]) / span[0] * (_WIDTH - 2 * _MARGIN)
        py = _HEIGHT - _MARGIN - (b - low[1]) / span[1] * (_HEIGHT - 2 * _MARGIN)
        return f"{px:.1f},{py:.1f}"

    parts = []
    roots = list(dict.fromkeys(_root(branch.diagram, branch.name) for branch in drawn))
    for branch in drawn:
        colour = COLOURS[roots.index(_root(branch.diagram, branch.name)) % len(COLOURS)]
        for xs, ys, stable in stretches(branch, x, y):
            every = max(1, len(xs) // 300)
            path = " ".join(place(a, b) for a, b in [*zip(xs[:-1:every], ys[:-1:every], strict=True), (xs[-1], ys[-1])])
            dashes = "" if stable or branch.held is not None else ' stroke-dasharray="4 3"'
            parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.5"{dashes}/>')
        for point in branch.special:
            cx, cy = place(point[x], point[y]).split(",")
            name = escape(f"{point.kind} {point.value:.8g}")
            parts.append(f'<circle cx="{cx}" cy="{cy}" r="3" fill="white" stroke="{colour}"><title>{name}</title></circle>')
    text = 'font-family="sans-serif" font-size="11" fill="currentColor"'
    bottom, top = _HEIGHT - _MARGIN, _MARGIN
    frame = f'<path d="M{_MARGIN},{top} V{bottom} H{_WIDTH - _MARGIN}" fill="none" stroke="currentColor" stroke-width="0.8"/>'
    ticks = [
        (f"{low[0]:.4g}", _MARGIN, bottom + 14, "start"), (f"{high[0]:.4g}", _WIDTH - _MARGIN, bottom + 14, "end"),
        (x, _WIDTH / 2, bottom + 26, "middle"), (f"{high[1]:.4g}", _MARGIN, top - 6, "middle"),
        (f"{y}   ({low[1]:.4g} below)", _MARGIN + 30, top - 6, "start"),
    ]  # fmt: skip
    words = "".join(f'<text x="{a:g}" y="{b:g}" text-anchor="{anchor}" {text}>{escape(word)}</text>' for word, a, b, anchor in ticks)
    size = f'width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size}>{frame}{words}{"".join(parts)}</svg>'


def solution(own: Solution) -> str:
    """A table of what is known about a solution."""
    rows = [*((name, f"{value:.10g}") for name, value in own.parameters.items())]
    rows += [(name, f"{low:.8g} … {high:.8g}") for name, (low, high) in own.ranges.items()]
    what = "multipliers" if own.is_cycle else "eigenvalues"
    rows.append((what, ", ".join(f"{value:.5g}" for value in own.spectrum)))
    rows.append(("trust", ", ".join(f"{name} {value:.1e}" for name, value in own.trust.items())))
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<div><p>{escape(own._what())}</p><table>{body}</table></div>"


def model(own: Model) -> str:
    """A model as its text."""
    return f"<div><p>{escape(repr(own))}</p><details><summary>text</summary><pre>{escape(own.text)}</pre></details></div>"

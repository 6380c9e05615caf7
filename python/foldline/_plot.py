"""Pictures of branches, diagrams and solutions with matplotlib."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._arrays import Floats, floats
from ._axes import COLOURS, MARKS, axes_or_new, label, new_figure, variable
from ._errors import ArgumentError, InputError
from ._overlay import Seen, listed, overlaid, simulated, stroboscopic

if TYPE_CHECKING:
    from ._branch import Branch, SpecialPoint
    from ._diagram import Diagram
    from ._solution import Solution


def quantities(branches: Sequence[Branch], x: str | None, y: str | None) -> tuple[str, str]:
    """Returns the columns to draw."""
    model = branches[0].diagram.model
    first = next(iter(model.outputs), None) or next(iter(model.states))
    free = [own.free for own in branches]
    chosen = x or max(dict.fromkeys(free), key=free.count), y or f"{first}_max"
    known = [*branches[0].columns, *model.states, *model.outputs]
    for name in chosen:
        if name not in known:
            raise InputError(f"there is no quantity `{name}`\n  help: one of {', '.join(known)}")
    return chosen


def pieces(branch: Branch, x: str, y: str, scale: tuple[float, float]) -> Iterator[tuple[Floats, Floats, bool]]:
    """Yields pieces of uniform stability. They change exactly at special points; between points the curve is rounded."""
    for stable, across, up in _native.pieces(branch.diagram._native, branch._index, x, y, scale):
        yield floats(across), floats(up), stable


def size(branches: Sequence[Branch], x: str, y: str) -> tuple[float, float]:
    """Returns the extent of all branches together in both directions."""
    spans = []
    for name in (x, y):
        values = np.concatenate([branch[name] for branch in branches])
        seen = values[np.isfinite(values)]
        spans.append(float(np.ptp(seen)) if seen.size and np.ptp(seen) > 0 else 1.0)
    return spans[0], spans[1]


def branch(own: Branch, ax: Any, x: str | None, y: str | None, style: dict[str, Any], seen: Seen, points: Any = None) -> list[Any]:
    """Draws one branch, and results of simulation on top of it."""
    given = listed(seen)
    if points is not None:
        if given:
            cure = "draw them in two pictures: sweeps show extremes, stroboscopic points the state at the start of a forcing period"
            raise ArgumentError(f"both sweeps and stroboscopic points are given\n  help: {cure}")
        return stroboscopic(own, points, ax, y, style)
    axes = axes_or_new(ax)
    across, up = quantities([own], x, y) if own.held is None else (x or own.held[1], y or own.free)
    artists = _lines(axes, own, across, up, size([own], across, up), {"color": COLOURS[0], "label": own.name, **style})
    artists += _marks(axes, own, across, up, artists[0].get_color() if artists else COLOURS[0], set())
    artists += overlaid(axes, given, across, up)
    axes.set_xlabel(label(across, own.diagram.model))
    axes.set_ylabel(label(up, own.diagram.model))
    return artists


def _lines(axes: Any, own: Branch, x: str, y: str, scale: tuple[float, float], style: dict[str, Any]) -> list[Any]:
    artists: list[Any] = []
    for across, up, stable in pieces(own, x, y, scale):
        dashes = "-" if stable or own.held is not None else "--"
        artists += axes.plot(across, up, **{"linestyle": dashes, **style})
        style = {**style, "label": "_"}
    return artists


def _marks(axes: Any, own: Branch, x: str, y: str, colour: Any, named: set[str]) -> list[Any]:
    """Draws special points, hollow or, if subcritical, filled; each sort is named once."""
    sorts: dict[tuple[str, str | None], list[SpecialPoint]] = {}
    for point in own.special:
        sorts.setdefault((point.kind, point.criticality), []).append(point)
    artists: list[Any] = []
    for (kind, criticality), points in sorts.items():
        name = kind if criticality is None else f"{kind}, {criticality}"
        style = {"color": colour, "markerfacecolor": colour if criticality == "subcritical" else "white", "markersize": 5, "zorder": 3}
        places = ([p[x] for p in points], [p[y] for p in points])
        mark = MARKS[_native.marker(kind)]
        artists += axes.plot(*places, marker=mark, linestyle="none", label="_" if name in named else name, **style)
        named.add(name)
    return artists


def diagram(own: Diagram, ax: Any, x: str | None, y: str | None, curves: bool, seen: Seen) -> list[Any]:
    """Draws all branches of a diagram, with one colour per branch not reached by switching, and its surveys and sweeps on top of them."""
    shown = [branch for branch in own if (branch.held is not None) == curves and len(branch)]
    given = listed(seen) if seen is not None else [] if curves else list(own.responses.values())
    if not shown and given:
        return simulated(axes_or_new(ax), given, x, y)
    axes = axes_or_new(ax)
    if not shown:
        cure = "there are only two-parameter curves: use curves=True" if len(own) and not curves else "follow a branch first"
        raise InputError(f"there is nothing to draw\n  help: {cure}")
    held = shown[0].held
    across, up = (x or held[1], y or shown[0].free) if held is not None else quantities(shown, x, y)
    roots = list(dict.fromkeys(_root(own, branch.name) for branch in shown))
    scale = size(shown, across, up)
    artists: list[Any] = []
    for branch in shown:
        root = _root(own, branch.name)
        colour = COLOURS[roots.index(root) % len(COLOURS)]
        main = branch.name == root
        style = {"color": colour, "linewidth": 1.8 if main else 1.2}
        artists += _lines(axes, branch, across, up, scale, {**style, "label": branch.name if main else "_"})
    named: set[str] = set()
    for branch in shown:
        artists += _marks(axes, branch, across, up, COLOURS[roots.index(_root(own, branch.name)) % len(COLOURS)], named)
    artists += overlaid(axes, [one for one in given if seen is not None or (one.free == across and up in one)], across, up)
    axes.set_xlabel(label(across, own.model))
    axes.set_ylabel(label(up, own.model))
    if len(roots) <= 14:
        axes.legend(fontsize="small")
    return artists


def _root(own: Diagram, name: str) -> str:
    """Returns the branch from which another was reached by switching, directly or not."""
    origins = {branch.name: branch.origin for branch in own if branch.held is None}
    for _ in range(len(origins)):
        origin = origins.get(name)
        if origin is None or origin[0] != "switch" or origin[1] not in origins:
            break
        name = origin[1]
    return name


def solution(own: Solution, axes: Any) -> dict[str, list[Any]]:
    """Draws a cycle in four panels; an equilibrium in one."""
    names = ["orbit", "series", "spectrum", "multipliers"] if own.is_cycle else ["multipliers"]
    if own.is_cycle and not own.signed_spectrum(2)[0].size:
        names.remove("spectrum")
    if axes is None:
        axes = new_figure(len(names))
    panels = list(np.ravel(axes))
    if len(panels) < len(names):
        raise InputError(f"{len(panels)} axes were given for {len(names)} panels\n  help: one for each of {', '.join(names)}")
    draw = {"orbit": _orbit, "series": _series, "spectrum": _spectrum, "multipliers": _multipliers}
    return {name: draw[name](panel, own) for name, panel in zip(names, panels, strict=False)}


def _orbit(axes: Any, own: Solution) -> list[Any]:
    whirl = own.model._native.whirl
    names = list(own.model.states)
    pair = [names[k] for k in (whirl or (0, min(1, len(names) - 1)))]
    track = own.uniform(2048)
    closed = [np.append(track[name], track[name][:1]) for name in pair]
    artists: list[Any] = axes.plot(*closed, color=COLOURS[0])
    axes.set_xlabel(variable(pair[0], own.model))
    axes.set_ylabel(variable(pair[1], own.model))
    if whirl is not None:
        axes.set_aspect("equal", "datalim")
    return artists


def _series(axes: Any, own: Solution) -> list[Any]:
    track = own.uniform(2048)
    names = list(own.model.outputs) or list(own.model.states)[:4]
    artists = []
    for k, name in enumerate(names):
        artists += axes.plot(track["t"], track[name], color=COLOURS[k % len(COLOURS)], label=name)
    axes.set_xlabel("t")
    if len(names) > 1:
        axes.legend(fontsize="small")
    else:
        axes.set_ylabel(variable(names[0], own.model))
    return artists


def _spectrum(axes: Any, own: Solution) -> list[Any]:
    frequencies, amplitudes = own.signed_spectrum(1024)
    height = np.abs(amplitudes)
    loud = height > 1e-4 * height.max()
    lines = axes.vlines(frequencies[loud], 1e-4 * height.max(), height[loud], color=COLOURS[0])
    heads = axes.plot(frequencies[loud], height[loud], "o", color=COLOURS[0], markersize=3)
    axes.set_yscale("log")
    axes.set_xlabel("frequency (backward < 0 < forward)")
    axes.set_ylabel("amplitude")
    return [lines, *heads]


def _multipliers(axes: Any, own: Solution) -> list[Any]:
    artists: list[Any] = []
    if own.is_cycle:
        angle = np.linspace(0, 2 * np.pi, 361)
        artists += axes.plot(np.cos(angle), np.sin(angle), color="#8f8f8f", linewidth=1)
    else:
        artists.append(axes.axvline(0, color="#8f8f8f", linewidth=1))
    values = own.spectrum
    # The trivial multiplier, 1 up to rounding, comes first if there is one.
    trivial = 1 if own.is_cycle and not own.forcing_periods else 0
    size = np.abs(values[trivial:]) if own.is_cycle else values.real
    outside = np.zeros(len(values), dtype=bool)
    outside[trivial + np.argsort(-size)[: own.unstable]] = True
    for chosen, colour in ((~outside, COLOURS[0]), (outside, COLOURS[1])):
        artists += axes.plot(values.real[chosen], values.imag[chosen], "o", color=colour, markersize=5)
    if own.is_cycle:
        axes.set_aspect("equal", "datalim")
    axes.set_xlabel("Re μ" if own.is_cycle else "Re λ")
    axes.set_ylabel("Im μ" if own.is_cycle else "Im λ")
    return artists

"""Pictures of simulation: surveys, sweeps and stroboscopic points, alone or over branches."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Union

import numpy as np

from . import _native
from ._arguments import suggestion, wrong_kind
from ._arrays import Floats
from ._axes import COLOURS, MARKS, axes_or_new, label, variable
from ._errors import InputError
from ._responses import Sweep

if TYPE_CHECKING:
    from ._branch import Branch
    from ._model import Model
    from ._responses import Responses
    from ._solution import Solution
    from ._strobe import Strobe

#: Surveys and sweeps, one or several.
Seen = Union["Responses", Sequence["Responses"], None]
#: Colour of surveys and sweeps: dark enough for a print in grey, and not used for branches.
INK = "#333333"
#: Marks that point in the direction of a sweep, filled upwards and hollow downwards.
_ARROWS = {"up": (">", 3.5, "→"), "down": ("<", 6.0, "←")}
#: Maximum number of legs of sweeps labelled beside their curves; more are named in the legend only.
_ROOM = 2
#: Marks of the motions of a survey.
_MOTIONS = {"equilibrium": "s", "cycle": "o", "torus": "d", "chaos": "x", "other": "_"}


def listed(seen: Seen) -> list[Responses]:
    """Surveys and sweeps as a list."""
    from ._responses import Responses

    if seen is None:
        return []
    found = [seen] if isinstance(seen, Responses) else seen
    if isinstance(found, (str, Mapping)) or not isinstance(found, Iterable):
        raise wrong_kind("surveys and sweeps are needed", seen, 'sweeps=foldline.sweep(start, "omega", (0.5, 4))')
    own = list(found)
    for one in own:
        if not isinstance(one, Responses):
            raise wrong_kind("surveys and sweeps are needed", one, 'sweeps=[foldline.sweep(start, "omega", (0.5, 4))]')
    return own


def responses(own: Responses, ax: Any, y: str | None, style: dict[str, Any]) -> list[Any]:
    """Draws one survey or sweep."""
    return simulated(axes_or_new(ax), [own], None, y, style)


def simulated(axes: Any, shown: Sequence[Responses], x: str | None, y: str | None, style: Mapping[str, Any] | None = None) -> list[Any]:
    """Draws surveys and sweeps without a branch."""
    first = shown[0]
    model = first.model
    across = x or first.free
    up = y or f"{next(iter(model.outputs), None) or next(iter(model.states))}_max"
    artists = overlaid(axes, [one for one in shown if one is first or one.free == across], across, up, style, joined=True)
    axes.set_xlabel(label(across, model))
    axes.set_ylabel(named(up, model))
    if not isinstance(first, Sweep):
        axes.legend(fontsize="small")
    return artists


def named(column: str, model: Model) -> str:
    words = {"share": "basin fraction", "hits": "initial states that settled there", "settled_after": "time until settled"}
    return words.get(column) or label(column, model)


def check_columns(own: Responses, *columns: str) -> None:
    """Refuses a quantity that a survey or sweep does not have."""
    for column in columns:
        if column not in own:
            raise InputError(f"`{own.name}` has no quantity `{column}`\n  help: {suggestion(column, own.columns)}")


def overlaid(
    axes: Any, shown: Sequence[Responses], x: str, y: str, style: Mapping[str, Any] | None = None, joined: bool = False
) -> list[Any]:
    """Draws surveys and sweeps over existing curves; `joined` by lines if there are none."""
    artists: list[Any] = []
    legs = 0
    for own in shown:
        check_columns(own, x, y)
        legs += len(own.legs) if isinstance(own, Sweep) else 0
    for own in shown:
        if isinstance(own, Sweep):
            artists += _swept(axes, own, (x, y), legs <= _ROOM, joined, style or {})
        else:
            artists += _surveyed(axes, own, x, y, style or {})
    return artists


def _swept(axes: Any, own: Sweep, quantities: tuple[str, str], room: bool, joined: bool, style: Mapping[str, Any]) -> list[Any]:
    """Draws a sweep with marks that point in its direction and dotted jumps."""
    across, up = (own[name] for name in quantities)
    legs = own.legs
    jumped = own._jumps
    colour = style.get("color", INK)
    artists: list[Any] = []
    for number, (direction, leg) in enumerate(legs):
        mark, size, arrow = _ARROWS[direction]
        # The value at which the sweep turns back is marked once.
        places = leg if number == 0 else leg[1:]
        looks = {"marker": mark, "linestyle": "none", "markersize": size, "markeredgewidth": 0.8, "zorder": 4, "color": colour}
        looks["markerfacecolor"] = colour if direction == "up" else "none"
        artists += axes.plot(across[places], up[places], **{**looks, "label": f"{own.name} {arrow}", **style})
        for piece in np.split(leg, [k for k, index in enumerate(leg) if index in jumped and k]) if joined else ():
            artists += axes.plot(across[piece], up[piece], color=colour, linewidth=0.7, label="_", zorder=3)
        if room and len(leg) > 1:
            others = np.array([index for _, other in legs if other is not leg for index in other], dtype=int)
            artists.append(_direct(axes, across, up, (leg, others), direction, f"{direction} {arrow}", colour))
    for k in jumped:
        ends = (across[k - 1 : k + 1], up[k - 1 : k + 1])
        artists += axes.plot(*ends, color=colour, linewidth=0.9, linestyle=":", label="_", zorder=3)
    return artists + _spread(axes, own, *quantities, colour)


def _direct(axes: Any, across: Any, up: Any, indices: tuple[Any, Any], direction: str, text: str, colour: Any) -> Any:
    """Draws a label where a leg is farthest from the other legs, or at its largest value if it is the only leg."""
    leg, others = indices
    heights = up[leg]
    if others.size:
        nearest = others[np.argmin(np.abs(across[others][None, :] - across[leg][:, None]), axis=1)]
        apart = np.nan_to_num(heights - up[nearest])
    else:
        apart = np.nan_to_num(heights - np.nanmin(heights)) if np.isfinite(heights).any() else np.zeros(len(leg))
    k = int(np.argmax(np.abs(apart)))
    # Place the label on the side from which the sweep comes, since a jump often follows, and off the curve.
    before = max(k - 1, 0)
    above = bool(heights[before] <= heights[k])
    side, aside = {"up": ("right", -6), "down": ("left", 6)}[direction]
    offset = (aside, 4 if above else -4)
    look = {"fontsize": "small", "color": colour, "ha": side, "va": "bottom" if above else "top", "zorder": 5}
    return axes.annotate(text, (float(across[leg[k]]), float(heights[k])), offset, textcoords="offset points", **look)


def strobe(own: Strobe, ax: Any, y: str | None, style: Mapping[str, Any]) -> list[Any]:
    """Draws stroboscopic points over the parameter."""
    axes = axes_or_new(ax)
    name = y or next(iter(own.model.states))
    known = [*own.model.states, *own.model.outputs]
    if name not in known:
        raise InputError(f"there is no state or output `{name}`\n  help: {suggestion(name, known)}")
    heights = own[name]
    across = np.repeat(own.values, heights.shape[1])
    look = {"marker": ".", "linestyle": "none", "color": INK, "markersize": 2, "label": "simulation", "zorder": 2, **style}
    artists: list[Any] = axes.plot(across, heights.ravel(), **look)
    axes.set_xlabel(label(own.free, own.model))
    axes.set_ylabel(f"{variable(name, own.model)} at the start of a forcing period")
    return artists


def stroboscopic(own: Branch, points: Any, ax: Any, y: str | None, style: dict[str, Any]) -> list[Any]:
    """Draws a branch of forced cycles as its states at the start of each forcing period, over stroboscopic points."""
    from ._strobe import Strobe

    if not isinstance(points, Strobe):
        raise wrong_kind("stroboscopic points are needed", points, 'strobe=foldline.strobe(start, "omega", (0.5, 4))')
    if own.family != "cycle" or not own.diagram.model.forced or own.held is not None or own.free != points.free:
        cure = f"a branch of cycles of a forced model over `{points.free}`"
        raise InputError(f"the branch `{own.name}` cannot be drawn with these points\n  help: {cure}")
    name = y or next(iter(points.model.states))
    axes = axes_or_new(ax)
    artists = strobe(points, axes, name, {"color": "#777777"})
    look: dict[str, Any] = {"color": COLOURS[0], "label": own.name, **style}
    # Points and special points in order; a special point lies after the point of its position.
    rows = [(k, float(own[own.free][n]), own[n], bool(own.stable[n])) for n, k in enumerate(own.position.tolist())]
    rows += [(point._native.position + 0.5, point.value, point, point.unstable_after == 0) for point in own.special]
    rows.sort(key=lambda row: row[0])
    across = np.array([row[1] for row in rows])
    images = np.array([_images(row[2], name) for row in rows]).reshape(len(rows), -1)
    stable = np.array([row[3] for row in rows])
    changes = [0, *(np.flatnonzero(stable[1:] != stable[:-1]) + 1).tolist(), len(rows) - 1]
    for image in images.T:
        smooth = _rounded(across, image)
        for first, last in pairwise(changes):
            piece = slice(first * _FINE, last * _FINE + 1)
            line = {"linestyle": "-" if stable[first] else "--", "zorder": 3, **look}
            artists += axes.plot(*(values[piece] for values in smooth), **line)
            look["label"] = "_"
    for point in own.special:
        mark = {"marker": MARKS[_native.marker(point.kind)], "linestyle": "none", "color": look["color"], "markersize": 5, "zorder": 4}
        face = look["color"] if point.criticality == "subcritical" else "white"
        heights = _images(point, name)
        artists += axes.plot([point.value] * len(heights), heights, markerfacecolor=face, label="_", **mark)
    return artists


#: Number of vertices of a rounded curve from one point to the next.
_FINE = 8


def _rounded(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Returns a smooth curve through points, with `_FINE` vertices from each to the next."""
    if len(x) < 3:
        places = np.arange((len(x) - 1) * _FINE + 1) / _FINE
        return np.interp(places, np.arange(len(x)), x), np.interp(places, np.arange(len(x)), y)
    scale = [float(np.ptp(values)) or 1.0 for values in (x, y)]
    # The square root of the distance keeps the curve from looping where points are unevenly spaced.
    steps = np.sqrt(np.hypot(np.diff(x) / scale[0], np.diff(y) / scale[1]))
    at = np.concatenate([[0.0], np.cumsum(np.maximum(steps, 1e-9))])
    share = np.arange(_FINE) / _FINE
    weights = (2 * share**3 - 3 * share**2 + 1, share**3 - 2 * share**2 + share, 3 * share**2 - 2 * share**3, share**3 - share**2)
    found = []
    for values in (x, y):
        slope, length = np.gradient(values, at), np.diff(at)[:, None]
        ends = (values[:-1, None], slope[:-1, None] * length, values[1:, None], slope[1:, None] * length)
        curve = sum((own * weight[None, :] for own, weight in zip(ends, weights, strict=True)), np.zeros((len(x) - 1, _FINE)))
        found.append(np.append(curve.ravel(), values[-1]))
    return found[0], found[1]


def _images(solution: Solution, name: str) -> Floats:
    """Returns a state or output of a forced cycle at the start of each of its forcing periods."""
    return solution.uniform(max(solution.forcing_periods, 1))[name]


def _surveyed(axes: Any, own: Responses, x: str, y: str, style: Mapping[str, Any]) -> list[Any]:
    """Draws a survey: a mark for each motion, shaped by its type; basin fractions with their confidence intervals."""
    across, up = own[x], own[y]
    colour = style.get("color", INK)
    artists: list[Any] = []
    for motion in dict.fromkeys(own.motion.tolist()):
        chosen = (own.motion == motion) & np.isfinite(up.astype(float))
        if not chosen.any():
            continue
        mark = {"marker": _MOTIONS.get(motion, "x"), "linestyle": "none", "color": colour, "markerfacecolor": "none", "markersize": 4.5,
                "zorder": 4, "label": f"{own.name}: {motion}", **style}  # fmt: skip
        if y == "share":
            low, high = own["share_low"][chosen], own["share_high"][chosen]
            spans = np.maximum([up[chosen] - low, high - up[chosen]], 0)
            bars = axes.errorbar(across[chosen], up[chosen], yerr=spans, elinewidth=0.8, capsize=2, **mark)
            artists.append(bars)
        else:
            artists += axes.plot(across[chosen], up[chosen], **mark)
    artists += _spread(axes, own, x, y, colour)
    return artists


def _spread(axes: Any, own: Responses, x: str, y: str, colour: Any) -> list[Any]:
    """Draws the range of every motion that does not repeat, as a bar from its smallest to its largest value."""
    name = y.removesuffix("_max").removesuffix("_min")
    chosen = np.isin(own.motion, ["torus", "chaos", "other"])
    if not chosen.any() or f"{name}_min" not in own.columns:
        return []
    low, high = own[f"{name}_min"][chosen], own[f"{name}_max"][chosen]
    return [axes.vlines(own[x][chosen], low, high, color=colour, linewidth=0.8, alpha=0.5, zorder=2)]

"""Interactive pictures with plotly, which is imported only here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._axes import COLOURS, label
from ._errors import InputError
from ._overlay import INK, Seen, check_columns, listed, named
from ._plot import _root, pieces, quantities, size
from ._responses import Sweep

if TYPE_CHECKING:
    from ._branch import Branch
    from ._diagram import Diagram
    from ._model import Model
    from ._responses import Responses

#: Symbols of plotly for the shapes that the command line draws.
_SYMBOLS = {
    "circle": "circle",
    "square": "square",
    "diamond": "diamond",
    "triangle": "triangle-up",
    "nabla": "triangle-down",
    "right": "triangle-right",
    "left": "triangle-left",
    "cross": "x",
    "plus": "cross",
    "star": "star",
    "dot": "circle-dot",
}


def figure(branches: Sequence[Branch], x: str | None, y: str | None, seen: Seen = None, diagram: Diagram | None = None) -> Any:
    """Draws lines with hover text for points, and marks for special points and results of simulation."""
    try:
        from plotly import graph_objects
    except ImportError as error:
        raise ImportError("interactive pictures need plotly: pip install plotly") from error
    shown = [branch for branch in branches if len(branch)]
    given = listed(seen) if seen is not None or diagram is None else list(diagram.responses.values())
    if not shown and given:
        return _simulated(graph_objects, given, x, y)
    if not shown:
        raise InputError("there is nothing to draw\n  help: follow a branch first")
    held = shown[0].held
    across, up = (x or held[1], y or shown[0].free) if held is not None else quantities(shown, x, y)
    scale = size(shown, across, up)
    picture = graph_objects.Figure()
    roots = list(dict.fromkeys(_root(own.diagram, own.name) for own in shown))
    for own in shown:
        colour = COLOURS[roots.index(_root(own.diagram, own.name)) % len(COLOURS)]
        for trace in (*_lines(graph_objects, own, across, up, scale, colour), *_marks(graph_objects, own, across, up, colour)):
            picture.add_trace(trace)
    drawn = [own for own in given if seen is not None or (own.free == across and up in own)]
    for trace in _overlaid(graph_objects, drawn, across, up):
        picture.add_trace(trace)
    return _laid_out(picture, across, up, shown[0].diagram.model)


def _laid_out(picture: Any, x: str, y: str, model: Model) -> Any:
    picture.update_layout(xaxis_title=label(x, model), yaxis_title=named(y, model), template="plotly_white", hovermode="closest")
    return picture


def _simulated(graph_objects: Any, given: Sequence[Responses], x: str | None, y: str | None) -> Any:
    """Draws surveys and sweeps without a branch."""
    first = given[0]
    across, up = x or first.free, y or f"{next(iter(first.model.outputs), None) or next(iter(first.model.states))}_max"
    picture = graph_objects.Figure()
    for trace in _overlaid(graph_objects, [own for own in given if own is first or own.free == across], across, up, joined=True):
        picture.add_trace(trace)
    return _laid_out(picture, across, up, first.model)


#: Marks that point in the direction of a sweep, filled upwards and hollow downwards.
_ARROWS = {"up": ("triangle-right", 6, "→"), "down": ("triangle-left-open", 10, "←")}
_MOTIONS = {"equilibrium": "square-open", "cycle": "circle-open", "torus": "diamond-open", "chaos": "x-thin-open", "other": "line-ew-open"}


def _overlaid(graph_objects: Any, given: Sequence[Responses], x: str, y: str, joined: bool = False) -> list[Any]:
    """Draws surveys and sweeps; jumps are dotted, other steps are drawn if `joined`."""
    traces: list[Any] = []
    for own in given:
        check_columns(own, x, y)
        across, up = own[x], own[y]
        if not isinstance(own, Sweep):
            for motion in dict.fromkeys(own.motion.tolist()):
                places = np.flatnonzero((own.motion == motion) & np.isfinite(up.astype(float)))
                mark = {"symbol": _MOTIONS.get(motion, "x"), "color": INK, "size": 8, "line": {"width": 1.5}}
                traces.append(_seen(graph_objects, own, places, across, up, mark, f"{own.name}: {motion}", "markers"))
            continue
        jumped = set(own._jumps)
        for number, (direction, leg) in enumerate(own.legs):
            symbol, large, arrow = _ARROWS[direction]
            name = f"{own.name}, {direction} {arrow}"
            # The value at which the sweep turns back is marked once.
            mark = {"symbol": symbol, "color": INK, "size": large}
            traces.append(_seen(graph_objects, own, leg if number == 0 else leg[1:], across, up, mark, name, "markers"))
            for first, second in zip(leg[:-1].tolist(), leg[1:].tolist(), strict=True):
                if not joined and second not in jumped:
                    continue
                line = {"color": INK, "width": 1, "dash": "dot" if second in jumped else "solid"}
                ends = {"x": [across[first], across[second]], "y": [up[first], up[second]]}
                shown = {"mode": "lines", "line": line, "hoverinfo": "skip", "showlegend": False, "legendgroup": name}
                traces.append(graph_objects.Scatter(**ends, **shown))
    return traces


def _seen(graph_objects: Any, own: Responses, places: Any, across: Any, up: Any, mark: Any, name: str, mode: str) -> Any:
    texts = [_response_text(own, int(k)) for k in places]
    told = {"mode": mode, "marker": mark, "text": texts, "hoverinfo": "text", "name": name, "legendgroup": name}
    return graph_objects.Scatter(x=across[places], y=up[places], **told)


def _response_text(own: Responses, k: int) -> str:
    """Describes a response: its values, its motion, its basin fraction or its jump."""
    values = [f"{name} = {own[name][k]:.8g}" for name in own.model.parameters]
    ratio = f"{own['ratio'][k]} " if own["ratio"][k] else ""
    period = "" if np.isnan(own["period"][k]) else f" of period {own['period'][k]:.8g}"
    told = [own.name, ", ".join(values), f"{ratio}{own.motion[k]}{period}"]
    if isinstance(own, Sweep):
        told += ["jumped"] if k in own._jumps else []
    elif not np.isnan(own["share"][k]):
        told.append(f"basin fraction {own['share'][k]:.3f} ({own['share_low'][k]:.3f} … {own['share_high'][k]:.3f})")
    return "<br>".join(told)


def _lines(graph_objects: Any, own: Branch, x: str, y: str, scale: tuple[float, float], colour: str) -> list[Any]:
    """Draws the curve, solid where stable and dashed where unstable, and its points, which show when the pointer is on them."""
    common = {"legendgroup": own.name, "name": own.name}
    traces: list[Any] = []
    for across, up, stable in pieces(own, x, y, scale):
        style = {"color": colour, "dash": "solid" if stable or own.held is not None else "dash", "width": 2}
        shown = {"mode": "lines", "line": style, "hoverinfo": "skip", "showlegend": not traces}
        traces.append(graph_objects.Scatter(x=across, y=up, **shown, **common))
    texts = [_text(own, k) for k in range(len(own))]
    style = {"color": colour, "size": 7, "opacity": 0}
    told = {"mode": "markers", "marker": style, "text": texts, "hoverinfo": "text", "showlegend": False}
    return [*traces, graph_objects.Scatter(x=own[x], y=own[y], **told, **common)]


def _text(own: Branch, k: int) -> str:
    values = [f"{name} = {value:.8g}" for name, value in zip(own.diagram.model.parameters, own.parameters[k], strict=True)]
    period = [] if np.isnan(own.period[k]) else [f"period {own.period[k]:.8g}"]
    what = "multipliers" if own.family == "cycle" else "eigenvalues"
    spectrum = ", ".join(_complex(value) for value in own.spectrum[k])
    error = f"error {own['discretisation'][k]:.1e}, of {what} {own['spectrum_error'][k]:.1e}"
    return "<br>".join([own.name, ", ".join(values), *period, f"{what} {spectrum}", error])


def _special_text(point: Any) -> str:
    values = [f"{name} = {value:.10g}" for name, value in point.parameters.items()]
    period = [] if point.period is None else [f"period {point.period:.8g}"]
    form = [point.normal_form] if point.normal_form else []
    head = f"<b>{point.kind}</b> of {point.branch.name}"
    spectrum = ", ".join(_complex(value) for value in point.spectrum)
    return "<br>".join([head, ", ".join(values), *period, spectrum, f"error {point.error:.1e}", *form])


def _complex(value: complex) -> str:
    return f"{value.real:.4g}" if value.imag == 0 else f"{value.real:.4g}{value.imag:+.4g}j"


def _marks(graph_objects: Any, own: Branch, x: str, y: str, colour: str) -> list[Any]:
    traces = []
    for kind in dict.fromkeys(point.kind for point in own.special):
        chosen = own.special[kind]
        symbol = _SYMBOLS[_native.marker(kind)]
        # Hollow; subcritical ones filled. The dot of a mark is filled as well.
        filled = symbol == "circle-dot"
        symbols = [symbol if filled or point.criticality == "subcritical" else f"{symbol}-open" for point in chosen]
        style = {"symbol": symbols, "color": colour, "size": 9, "line": {"width": 1.5}}
        traces.append(
            graph_objects.Scatter(
                x=[p[x] for p in chosen],
                y=[p[y] for p in chosen],
                mode="markers",
                marker=style,
                name=kind,
                legendgroup=own.name,
                showlegend=False,
                text=[_special_text(p) for p in chosen],
                hoverinfo="text",
            )
        )
    return traces

"""Interactive pictures with plotly, which is imported only here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._errors import InputError
from ._plot import COLOURS, _root, label, pieces, quantities, size

if TYPE_CHECKING:
    from ._branch import Branch

#: Of plotly, by the shapes that the command line draws.
_SYMBOLS = {
    "circle": "circle",
    "square": "square",
    "diamond": "diamond",
    "triangle": "triangle-up",
    "nabla": "triangle-down",
    "cross": "x",
    "plus": "cross",
    "star": "star",
    "dot": "circle-dot",
}


def figure(branches: Sequence[Branch], x: str | None, y: str | None) -> Any:
    """Lines with hover for points, marks for special points."""
    try:
        from plotly import graph_objects
    except ImportError as error:
        raise ImportError("interactive pictures need plotly: pip install plotly") from error
    shown = [branch for branch in branches if len(branch)]
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
    model = shown[0].diagram.model
    picture.update_layout(xaxis_title=label(across, model), yaxis_title=label(up, model), template="plotly_white", hovermode="closest")
    return picture


def _lines(graph_objects: Any, own: Branch, x: str, y: str, scale: tuple[float, float], colour: str) -> list[Any]:
    """The curve, solid where it is stable, dashed where not, and its points, which are seen when the pointer is at them."""
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
        style = {"symbol": _SYMBOLS[_native.marker(kind)], "color": colour, "size": 9, "line": {"width": 1, "color": "white"}}
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

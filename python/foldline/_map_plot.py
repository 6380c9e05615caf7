"""Pictures of maps over one or two parameters."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from . import _native
from ._arguments import suggestion, wrong_kind
from ._arrays import Floats
from ._axes import COLOURS, axes_or_new, label
from ._errors import InputError
from ._model import Model

#: Colours of areas, distinguishable with all common types of colour vision.
_AREAS = ("#56b4e9", "#e69f00", "#009e73", "#f0e442", "#cc79a7", "#0072b2", "#d55e00", "#999999")


def draw(found: Any, name: str | None = None, ax: Any = None, **where: str) -> Any:
    """Draws a map over one or two parameters with matplotlib.

    Texts and truth values become areas with their boundaries; over one parameter, coloured marks. Numbers become a coloured
    surface with contour lines; over one parameter, lines. Cells without a value are grey, with the number of them in the legend.

    Parameters
    ----------
    found : xarray.Dataset
        Result of `foldline.map` over one or two parameters.
    name : str, optional
        Variable to draw; by default ``motions`` or ``points`` if there is one, or else the first variable.
    ax : matplotlib axes, optional
        By default a new figure.
    **where
        Which motion or point to draw: ``motion="2:1 cycle"``, ``point="response: fold 1"``. Over one parameter, by default all.

    Returns
    -------
    matplotlib axes

    Raises
    ------
    InputError
        If the variable is unknown, or has more than two parameters.

    Examples
    --------
    >>> import foldline, matplotlib
    >>> matplotlib.use("Agg")
    >>> model = foldline.model(equations={"x": "a*x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"a": 1.0})
    >>> found = foldline.map(model, over={"a": [-1.0, 0.5, 1.0]}, what="motions", samples=16)
    >>> foldline.draw(found, "x_max").get_xlabel()
    'a'
    """
    if not hasattr(found, "data_vars"):
        raise wrong_kind("the result of a map over parameters is needed", found, "foldline.draw(foldline.map(model, over={...}, what=...))")
    names = [str(own) for own in found.data_vars]
    own = name or next((known for known in ("motions", "points") if known in names), names[0])
    if own not in names:
        raise InputError(f"the map has no variable `{own}`\n  help: {suggestion(own, names)}")
    shown = found[own].sel(where) if where else found[own]
    items = [dim for dim in shown.dims if dim in ("motion", "point")]
    dims = [str(dim) for dim in shown.dims if dim not in items]
    if "case" in dims:
        cure = f"found.plot.scatter(x={_parameter(found)!r}, y={own!r}), of xarray"
        raise InputError(f"a list of cases has no order in which it could be drawn\n  help: {cure}")
    if not 1 <= len(dims) <= 2 or (items and len(dims) == 2):
        cure = f"choose one: {items[0]}={str(found[items[0]].values[0])!r}" if items and len(dims) == 2 else "found.sel(...) reduces a grid"
        raise InputError(f"`{own}` extends over {', '.join(map(str, shown.dims))} and cannot be drawn\n  help: {cure}")
    axes = axes_or_new(ax)
    texts = shown.dtype.kind in "OUSb"
    if len(dims) == 1:
        _line(axes, found, shown, dims[0], items, texts)
    elif texts:
        _areas(axes, found, shown, dims)
    else:
        _surface(axes, found, shown, dims)
    axes.set_xlabel(_label(found, dims[0]))
    return axes


def _parameter(found: Any) -> str:
    """Returns the first parameter of a list of cases."""
    return next((str(name) for name, own in found.coords.items() if own.dims == ("case",) and name != "case"), "case")


def _label(found: Any, name: str) -> str:
    """An axis label as in diagrams, if the name is one of the model."""
    model = _model_of(str(found.attrs.get("model_text", "")))
    if model is not None and (name in model.parameters or name == "period" or name.rpartition("_")[2] in ("max", "min")):
        return label(name, model)
    unit = found[name].attrs.get("units", "")
    return f"{name} [{unit}]" if unit not in ("", "1", "-") else name


@lru_cache(maxsize=4)
def _model_of(text: str) -> Model | None:
    return Model(_native.Model.parse(text, "<model>")) if text else None


def _without(found: Any) -> Any:
    """True in the cells that were tried and have no values."""
    failed = found["failure"] != ""
    return failed & found["computed"] if "computed" in found else failed


def _line(axes: Any, found: Any, shown: Any, dim: str, items: list[Any], texts: bool) -> None:
    x = found[dim].values
    if texts:
        kinds = sorted({str(own) for own in shown.values})
        level = [kinds.index(str(own)) for own in shown.values]
        for index in range(len(kinds)):
            here = np.array(level) == index
            axes.plot(x[here], np.full(here.sum(), index), "s", color=_AREAS[index % len(_AREAS)], markersize=5)
        axes.set_yticks(range(len(kinds)), [kind or "no value" for kind in kinds])
        axes.set_ylim(-0.6, len(kinds) - 0.4)
        return
    order = np.argsort(x)
    labels = [str(own) for own in found[items[0]].values] if items else [shown.name]
    for index, kind in enumerate(labels):
        y = (shown.isel({items[0]: index}) if items else shown).values
        known = order[np.isfinite(y[order])] if "computed" in found else order
        axes.plot(x[known], y[known], ".-", color=COLOURS[index % len(COLOURS)], label=kind)
    lost = _without(found).values
    if lost.any():
        axes.plot(x[lost], np.zeros(lost.sum()), "|", color="0.5", transform=axes.get_xaxis_transform(), label=f"no value ({lost.sum()})")
    axes.set_ylabel(_label(found, str(shown.name)))
    if items or lost.any():
        axes.legend(fontsize="small")


def _areas(axes: Any, found: Any, shown: Any, dims: list[str]) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    x, y = found[dims[0]].values, found[dims[1]].values
    cells = np.array([[str(own) for own in row] for row in shown.transpose(*dims).values])
    kinds = sorted(set(cells.ravel()), key=lambda own: (own == "", own))
    place = np.array([[kinds.index(own) for own in row] for row in cells])
    colours = ["0.8" if own == "" else _AREAS[k % len(_AREAS)] for k, own in enumerate(kinds)]
    axes.pcolormesh(x, y, place.T, cmap=ListedColormap(colours), vmin=-0.5, vmax=len(kinds) - 0.5, shading="nearest", rasterized=True)
    axes.add_collection(LineCollection(_edges(x, y, place), colors="black", linewidths=0.8))
    handles = [Patch(color=own, label=kind or "no value") for own, kind in zip(colours, kinds, strict=True)]
    # Areas fill the axes, so the legend stands above them.
    axes.legend(handles=handles, fontsize="small", loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(3, len(kinds)), frameon=False)
    axes.set_ylabel(_label(found, dims[1]))


def _edges(x: Floats, y: Floats, place: Any) -> list[Any]:
    """Returns the lines between cells that differ."""
    across, up = _between(x), _between(y)
    lines = []
    for i, j in zip(*np.nonzero(place[1:] != place[:-1]), strict=True):
        lines.append([(across[i + 1], up[j]), (across[i + 1], up[j + 1])])
    for i, j in zip(*np.nonzero(place[:, 1:] != place[:, :-1]), strict=True):
        lines.append([(across[i], up[j + 1]), (across[i + 1], up[j + 1])])
    return lines


def _between(values: Floats) -> Floats:
    """Returns the middles between values, and the outer ends of the first and the last cell."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middles = 0.5 * (values[1:] + values[:-1])
    return np.concatenate([[2 * values[0] - middles[0]], middles, [2 * values[-1] - middles[-1]]])


def _surface(axes: Any, found: Any, shown: Any, dims: list[str]) -> None:
    x, y, z = found[dims[0]].values, found[dims[1]].values, shown.transpose(*dims).values.T
    axes.set_facecolor("0.8")
    if "computed" in found:
        raise InputError(
            f"`{shown.name}` of a refined map is known in some cells only\n  help: a map without refine=, or a text such as `{found.attrs.get('refined_by')}`"
        )
    surface = axes.pcolormesh(x, y, z, shading="nearest", cmap="viridis", rasterized=True)
    if min(z.shape) > 2 and np.isfinite(z).any() and np.nanmin(z) < np.nanmax(z):
        axes.contour(x, y, z, colors="white", linewidths=0.5)
    axes.figure.colorbar(surface, ax=axes, label=_label(found, str(shown.name)))
    axes.set_ylabel(_label(found, dims[1]))

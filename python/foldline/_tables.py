"""Results as tables of pandas and data sets of xarray, which are imported only here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas
    import xarray

    from ._branch import Branch, SpecialPoints
    from ._responses import Responses
    from ._simulation import Trajectory
    from ._solution import Attractors, Solution
    from ._strobe import Strobe


def _pandas() -> Any:
    try:
        import pandas
    except ImportError as error:
        raise ImportError("tables need pandas: pip install pandas") from error
    return pandas


def _xarray() -> Any:
    try:
        import xarray
    except ImportError as error:
        raise ImportError("data sets need xarray: pip install xarray") from error
    return xarray


def branches_frame(branches: Sequence[Branch]) -> pandas.DataFrame:
    """A row for each point."""
    library = _pandas()
    tables = []
    for branch in branches:
        columns: dict[str, Any] = {"branch": [branch.name] * len(branch)}
        columns.update({name: branch[name] for name in branch.columns if len(branch)})
        columns["multipliers"] = list(branch.spectrum)
        tables.append(library.DataFrame(columns))
    frame: pandas.DataFrame = library.concat(tables, ignore_index=True) if tables else library.DataFrame()
    return frame


def special_frame(points: SpecialPoints) -> pandas.DataFrame:
    """A row for each special point."""
    rows = []
    for point in points:
        extremes = {f"{name}_max": point.ranges[name][1] for name in point.model.outputs if name in point.ranges}
        row: dict[str, Any] = {"branch": point.branch.name, "kind": point.kind, **point.parameters}
        row.update({"period": point["period"], **extremes, "unstable_before": point.unstable_before})
        row.update({"unstable_after": point.unstable_after, "error": point.error, "normal_form": point.normal_form})
        both = zip(point.coefficients, point.coefficient_errors, strict=False)
        for number, (value, error) in enumerate(both, start=1):
            row.update({f"coefficient_{number}": value, f"coefficient_{number}_error": error})
        rows.append(row)
    frame: pandas.DataFrame = _pandas().DataFrame(rows)
    return frame


def branches_dataset(branches: Sequence[Branch]) -> xarray.Dataset:
    """Over the dimensions `point`, `eigenvalue` and `variable`."""
    some = [branch for branch in branches if len(branch)]
    if not some:
        empty: xarray.Dataset = _xarray().Dataset()
        return empty
    model = some[0].diagram.model
    width = max(branch.spectrum.shape[1] for branch in some)

    def padded(branch: Branch) -> Any:
        missing = ((0, 0), (0, width - branch.spectrum.shape[1]))
        return np.pad(branch.spectrum, missing, constant_values=complex(np.nan, np.nan))

    def joined(name: str) -> Any:
        return np.concatenate([branch[name] for branch in some])

    single = ("period", "unstable", "step", "discretisation", "residual", "trivial_defect", "liouville_defect", "spectrum_error")
    ranges = np.concatenate([branch.ranges for branch in some])
    data: dict[str, Any] = {name: ("point", joined(name)) for name in single}
    data["smallest"] = (("point", "variable"), ranges[:, :, 0])
    data["largest"] = (("point", "variable"), ranges[:, :, 1])
    data["spectrum"] = (("point", "eigenvalue"), np.concatenate([padded(branch) for branch in some]))
    coordinates: dict[str, Any] = {
        "branch": ("point", np.concatenate([np.repeat(branch.name, len(branch)) for branch in some])),
        "position": ("point", joined("position")),
        "variable": [*model.states, *model.outputs],
    }
    for name, own in model.parameters.items():
        coordinates[name] = ("point", joined(name), {"units": own["unit"], "long_name": own["description"]})
    found: xarray.Dataset = _xarray().Dataset(data, coordinates, {"model": model.name})
    return found


def solution_frame(solution: Solution) -> pandas.DataFrame:
    """A row for each node."""
    frame: pandas.DataFrame = _pandas().DataFrame(_columns(solution))
    return frame


def solution_dataset(solution: Solution) -> xarray.Dataset:
    """Over the dimension `t`."""
    columns = _columns(solution)
    times = columns.pop("t")
    data = {name: ("t", values, _about(solution.model, name)) for name, values in columns.items()}
    attributes = {**solution.parameters, "period": solution["period"], "family": solution.family}
    found: xarray.Dataset = _xarray().Dataset(data, {"t": times}, attributes)
    return found


def _columns(solution: Solution) -> dict[str, Any]:
    times = solution.t if solution.is_cycle else np.zeros(1)
    model = solution.model
    states = solution.states
    outputs = model(states, solution.parameters, times, outputs=True)
    named = {name: states[:, k] for k, name in enumerate(model.states)}
    return {"t": times, **named, **{name: outputs[:, k] for k, name in enumerate(model.outputs)}}


def _about(model: Any, name: str) -> dict[str, str]:
    own = model.states.get(name) or model.outputs.get(name) or {}
    return {"units": own.get("unit", "1"), "long_name": own.get("description", "")}


def trajectory_frame(trajectory: Trajectory) -> pandas.DataFrame:
    """A row for each time."""
    names = [*trajectory.model.states, *trajectory.model.outputs]
    frame: pandas.DataFrame = _pandas().DataFrame({"t": trajectory.t, **{name: trajectory[name] for name in names}})
    return frame


def trajectory_dataset(trajectory: Trajectory) -> xarray.Dataset:
    """Over the dimension `t`."""
    names = [*trajectory.model.states, *trajectory.model.outputs]
    data = {name: ("t", trajectory[name], _about(trajectory.model, name)) for name in names}
    found: xarray.Dataset = _xarray().Dataset(data, {"t": trajectory.t}, {"ending": trajectory.ending})
    return found


def responses_frame(found: Responses, left_out: Sequence[str]) -> pandas.DataFrame:
    """A row for each response."""
    first = [name for name in ("value", "motion", "ratio", "multiplicity", "period") if name in found]
    rest = [name for name in found if name not in first and name not in left_out]
    frame: pandas.DataFrame = _pandas().DataFrame({name: found[name] for name in [*first, *rest]})
    return frame


def strobe_frame(found: Strobe) -> pandas.DataFrame:
    """A row for each stroboscopic point."""
    count, periods = found.states.shape[:2]
    names = [*found.model.states, *found.model.outputs]
    first = {found.free: np.repeat(found.values, periods), "period_number": np.tile(np.arange(1, periods + 1), count)}
    frame: pandas.DataFrame = _pandas().DataFrame({**first, **{name: found[name].ravel() for name in names}})
    return frame


def attractors_frame(found: Attractors) -> pandas.DataFrame:
    """A row for each attractor."""
    rows = []
    for own in found:
        extremes = {f"{name}_{side}": own[f"{name}_{side}"] for name in own.ranges for side in ("min", "max")}
        ratio = "" if own.ratio is None else f"{own.ratio[0]}:{own.ratio[1]}"
        shares = dict(zip(("share", "share_low", "share_high"), own.share or (float("nan"),) * 3, strict=True))
        rows.append({"family": own.family, "ratio": ratio, "hits": own.hits, **shares, "period": own["period"], **extremes})
    frame: pandas.DataFrame = _pandas().DataFrame(rows)
    return frame

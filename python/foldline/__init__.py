"""Bifurcation diagrams of ordinary differential equations.

>>> import foldline
>>> @foldline.model(states={"x": dict(range=(0, 5)), "y": dict(range=(0, 5))}, parameters=dict(A=1.0, B=1.5))
... def brusselator(s, p):
...     return p.A - (p.B + 1)*s.x + s.x**2*s.y, p.B*s.x - s.x**2*s.y
>>> steady = foldline.follow(brusselator.settle(), "B", (0.5, 4), switch={"hopf": 1})
>>> [(point.kind, round(point["B"], 6)) for point in steady.special]
[('hopf', 2.0)]
"""

from importlib.metadata import PackageNotFoundError as _NotFound
from importlib.metadata import version as _version

from ._basins import Basins, basins
from ._branch import Branch, SpecialPoint, SpecialPoints
from ._case import Case
from ._compute import explore, follow, hold, homotopy, open, rescued, run
from ._designs import Design
from ._diagram import Diagram, Homotopy
from ._ensemble import Ensemble, ensemble
from ._errors import ArgumentError, DeviceError, EndedShort, Error, InputError, Interrupted, NoSolution, RunFileError, TraceError
from ._map_plot import draw
from ._maps import latin_hypercube, map
from ._model import Model, model
from ._responses import Responses, Survey, Sweep
from ._rotor import rotor
from ._sensitivity import Band, Derivative, Sensitivity
from ._simulation import Trajectory
from ._solution import Attractor, Attractors, Solution
from ._strobe import Strobe, strobe
from ._sweeps import survey, sweep
from ._symbols import where
from ._uncertainty import Spread, Uncertainty, uncertainty
from ._view import view

try:
    __version__ = _version("foldline")
except _NotFound:
    __version__ = "unknown"

__all__ = [
    "ArgumentError",
    "Attractor",
    "Attractors",
    "Band",
    "Basins",
    "Branch",
    "Case",
    "Derivative",
    "Design",
    "DeviceError",
    "Diagram",
    "EndedShort",
    "Ensemble",
    "Error",
    "Homotopy",
    "InputError",
    "Interrupted",
    "Model",
    "NoSolution",
    "Responses",
    "RunFileError",
    "Sensitivity",
    "Solution",
    "SpecialPoint",
    "SpecialPoints",
    "Spread",
    "Strobe",
    "Survey",
    "Sweep",
    "TraceError",
    "Trajectory",
    "Uncertainty",
    "basins",
    "draw",
    "ensemble",
    "explore",
    "follow",
    "hold",
    "homotopy",
    "latin_hypercube",
    "map",
    "model",
    "open",
    "rescued",
    "rotor",
    "run",
    "strobe",
    "survey",
    "sweep",
    "uncertainty",
    "view",
    "where",
]

# The module from which they are imported, which tracebacks show.
for _class in [globals()[own] for own in __all__ if isinstance(globals()[own], type)]:
    _class.__module__ = __name__

"""A case: a model at given parameter values. It is what the cells of a map over parameters are made of."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ._arguments import suggestion
from ._study_at import study_at

if TYPE_CHECKING:
    from ._basins import Basins
    from ._branch import Branch
    from ._diagram import Diagram
    from ._model import Model
    from ._simulation import Trajectory
    from ._solution import Attractors, Solution


class Case:
    """A model at given parameter values: the argument of a function that `foldline.map` evaluates.

    Its methods are those of the model and of the package, at the parameter values of the case and on one thread.

    Attributes
    ----------
    model : Model
        The model, whose own parameter values are unchanged.
    given : dict
        Values of the parameters over which the map extends.
    parameters : dict
        Values of all parameters.

    Examples
    --------
    >>> import foldline
    >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
    >>> case = foldline.Case(model, {"mu": 4.0})
    >>> case["mu"], float(case.settle([1.0]).state[0])
    (4.0, 2.0)
    """

    def __init__(self, model: Model, given: Mapping[str, float]) -> None:
        self.model = model
        self.given = dict(given)
        self.parameters: dict[str, float] = {**{name: own["value"] for name, own in model.parameters.items()}, **self.given}

    def __getitem__(self, name: str) -> float:
        """Returns the value of a parameter."""
        if name not in self.parameters:
            raise KeyError(f"{name}: {suggestion(str(name), self.parameters)}")
        return self.parameters[name]

    def _at(self, options: dict[str, Any], jobs: bool = True) -> dict[str, Any]:
        own = {"jobs": 1} if jobs else {}
        return {**own, **options, "parameters": {**self.given, **(options.get("parameters") or {})}}

    def settle(self, start: Any = None, **options: Any) -> Solution:
        """Finds a solution, as `Model.settle` does.

        Parameters
        ----------
        start : optional
            As for `Model.settle`; by default a cycle of a forced model, otherwise an equilibrium.
        **options
            Further arguments of `Model.settle`.

        Returns
        -------
        Solution

        Raises
        ------
        ArgumentError, InputError, NoSolution
            As for `Model.settle`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu - x^2"}, parameters={"mu": 1.0})
        >>> float(foldline.Case(model, {"mu": 9.0}).settle([1.0]).state[0])
        3.0
        """
        return self.model.settle(self._start(start), **self._at(options))

    def _start(self, start: Any) -> Any:
        return start if start is not None else "cycle" if self.model.forced else "equilibrium"

    def attractors(self, **options: Any) -> Attractors:
        """Samples initial states, as `Model.attractors` does.

        Parameters
        ----------
        **options
            Arguments of `Model.attractors`.

        Returns
        -------
        Attractors

        Raises
        ------
        ArgumentError, InputError
            As for `Model.attractors`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a*x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"a": 1.0})
        >>> [len(foldline.Case(model, {"a": a}).attractors(samples=16)) for a in (-1.0, 1.0)]
        [1, 2]
        """
        return self.model.attractors(**self._at(options))

    def basins(self, **options: Any) -> Basins:
        """Finds basins of attraction, as `foldline.basins` does.

        Parameters
        ----------
        **options
            Arguments of `foldline.basins`.

        Returns
        -------
        Basins

        Raises
        ------
        ArgumentError, InputError
            As for `foldline.basins`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "a*x - x^3"}, states={"x": dict(range=(-2, 2))}, parameters={"a": 1.0})
        >>> found = foldline.Case(model, {"a": 2.0}).basins(samples=64)
        >>> found.share(0)[0] + found.share(1)[0]
        1.0
        """
        from ._basins import basins

        return basins(self.model, **self._at(options))

    def simulate(self, start: Any, span: Any, **options: Any) -> Trajectory:
        """Integrates the equations from a state, as `Model.simulate` does.

        Parameters
        ----------
        start, span
            As for `Model.simulate`.
        **options
            Further arguments of `Model.simulate`.

        Returns
        -------
        Trajectory

        Raises
        ------
        ArgumentError, InputError
            As for `Model.simulate`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "-a*x"}, parameters={"a": 1.0})
        >>> track = foldline.Case(model, {"a": 2.0}).simulate([1.0], 1.0)
        >>> round(float(track["x"][-1]), 6)
        0.135335
        """
        return self.model.simulate(start, span, **self._at(options, jobs=False))

    def follow(self, free: str, range: Any = None, start: Any = None, **options: Any) -> Branch:
        """Follows a branch, as `foldline.follow` does.

        Parameters
        ----------
        free, range
            As for `foldline.follow`.
        start : optional
            A solution, or where to settle first, as for `settle`. Then the value of `free` is that of the case or, if it lies outside
            the range, the nearest end of the range.
        **options
            Further arguments of `foldline.follow`.

        Returns
        -------
        Branch

        Raises
        ------
        ArgumentError, InputError, NoSolution
            As for `foldline.follow`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu + b*x - x^3"}, parameters={"mu": -2.0, "b": 1.0})
        >>> branch = foldline.Case(model, {"b": 3.0}).follow("mu", (-2.5, 2.5), [-2.0])
        >>> [round(point.value, 6) for point in branch.special]
        [2.0, -2.0]
        """
        from ._compute import follow
        from ._solution import Solution

        if not isinstance(start, Solution):
            start = self.settle(start, parameters=self._inside(free, range))
        return follow(start, free, range, **{"jobs": 1, **options})

    def _inside(self, free: Any, range: Any) -> dict[str, float]:
        """Returns a value of the continuation parameter within its range, if that is known."""
        pair = range if isinstance(range, (tuple, list)) and len(range) == 2 else ()
        if free not in self.parameters or not pair or not all(isinstance(own, (int, float)) for own in pair):
            return {}
        return {free: float(min(max(self.parameters[free], pair[0]), pair[1]))}

    def run(self, study: Any, **options: Any) -> Diagram:
        """Runs a study, as `foldline.run` does. The values of the case replace those that the study states.

        Parameters
        ----------
        study : path, str or mapping
            As for `foldline.run`.
        **options
            Further arguments of `foldline.run`.

        Returns
        -------
        Diagram

        Raises
        ------
        InputError
            As for `foldline.run`.

        Examples
        --------
        >>> import foldline
        >>> model = foldline.model(equations={"x": "mu + b*x - x^3"}, parameters={"mu": -2.0, "b": 1.0})
        >>> study = dict(seed=[dict(name="low", state=dict(x=-2))],
        ...              branch=[dict(name="all", free="mu", range=(-2.5, 2.5), **{"from": "low"})])
        >>> [round(point.value, 6) for point in foldline.Case(model, {"b": 3.0}).run(study).special]
        [2.0, -2.0]
        """
        from ._compute import run

        return run(study_at(study, self.given), self.model, **{"jobs": 1, **options})

    def __repr__(self) -> str:
        given = ", ".join(f"{name}={value:g}" for name, value in self.given.items())
        return f"<case of {self.model.name}: {given}>"

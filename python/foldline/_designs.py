"""Answers to design questions."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Design:
    """Answer to a design question of a study.

    Attributes
    ----------
    name : str
        Name of the question.
    of : str
        Branch in question.
    free, vary : str
        The parameter of the branch, and the design parameter.
    range : tuple of float
        Range of the parameter of the branch.
    greatest : bool
        True for the greatest value, below which the condition is met; False for the least, above which it is.
    wanted : str
        The condition: ``"no motion"``, ``"no stable motion"``, or a bound such as ``"r_max < 1.2"``.
    value, error : float
        The answer and a bound on its error, in the unit of the model; NaN without an answer.
    at : float
        Value of ``free`` at which it is attained.
    binds : str or None
        ``"inside"`` the range, or at its ``"lower end of the range"`` or ``"upper end of the range"``.
    boundary, curve : str or None
        Kind of the special points that bound the motion there, and the branch of the diagram that follows them.
    answered : bool
        False if there is no answer, or only a bound on one; ``reasons`` then say why.
    reasons, checks : list of str
        Reasons, and what was found on both sides of the answer.

    Examples
    --------
    Equilibria exist for x² = 1 - p - (l - 2)², at some l up to p = 1.

    >>> import foldline
    >>> model = foldline.model(equations={"x": "1 - p - (l - 2)^2 - x^2"}, parameters={"l": 2.0, "p": 0.1})
    >>> study = {
    ...     "seed": [{"name": "s", "state": {"x": 1}}],
    ...     "branch": [{"name": "b", "from": "s", "free": "l", "range": [0, 5]}],
    ...     "design": [{"name": "limit", "of": "b", "least": {"p": [0, 3]}, "without": "motion"}],
    ... }
    >>> limit = foldline.run(study, model).designs["limit"]
    >>> limit.answered, round(limit.value, 6), limit.binds
    (True, 1.0, 'inside')
    """

    name: str
    of: str
    free: str
    vary: str
    range: tuple[float, float]
    greatest: bool
    wanted: str
    value: float
    error: float
    at: float
    binds: str | None
    boundary: str | None
    curve: str | None
    answered: bool
    reasons: list[str]
    checks: list[str]

    def __repr__(self) -> str:
        bound = "greatest" if self.greatest else "least"
        how = f"{self.vary} = {self.value:.10g} at {self.free} = {self.at:.10g}" if self.value == self.value else "no answer"
        rest = "" if self.answered else ", not answered"
        return f"<design {self.name}: {bound} {self.vary} with {self.wanted} of {self.of}: {how}{rest}>"

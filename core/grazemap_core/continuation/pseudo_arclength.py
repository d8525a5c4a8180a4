"""Pseudo-arclength continuation: a predictor along the tangent and a corrector perpendicular to it.

The length of the steps is adapted to the convergence of the corrector and to the angle between tangents.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.continuation import tolerances
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.errors import ParameterError, checked_order

ENDS = {
    "range": "a parameter reaches the end of its range",
    "closed": "the curve is closed: it comes back to where it began",
    "together": "impacts on one stop come together, and their velocities vanish",
    "step": "steps become too short: impacts come together, or the orbits stop being smooth in the parameter",
    "singular": "the curve has no tangent: curves meet there",
    "points": "the number of points that was allowed is reached",
    "special": "there is a special point, at which the branch was to end",
    "real": "the pair of multipliers on the unit circle becomes real",
}
"""Why a curve is not followed further."""

Bounds = Sequence[tuple[int, float, float]]
"""For each bounded unknown, its index, minimum and maximum."""

Visit = Callable[[Floats, Floats, bool], str | None]
"""Takes the tangent at the previous point, the unknowns of a point, and whether the last unknown has turned. Returns
the reason why the curve ends there, a key of `ENDS`, or None."""

Beside = Callable[[Floats, Floats], Floats | None]
"""Takes the unknowns of a point, and a step along the tangent at whose end there is no orbit. Returns the unknowns of
an orbit just before a meeting of impacts (`branch_ends.Meeting`) within the step, or None."""


def check_steps(longest_step: float, max_points: int) -> None:
    """Raise ParameterError where a curve cannot be followed with steps of this length, or to so many points."""
    if not 0.0 < longest_step <= 1.0:
        raise ParameterError("longest_step", "must lie between 0 and 1")
    checked_order("max_points", max_points, 1)


def follow_path(
    path: ContinuationProblem,
    start: Floats,
    tangent: Floats,
    bounds: Bounds,
    longest: float,
    most: int,
    visit: Visit,
    beside: Beside | None = None,
) -> str:
    """Follow a path one way from a point, and return why it ends, a key of `ENDS`.

    `longest` is the longest step in the unknowns, `most` the maximum number of points. With `beside`, the path ends
    where impacts come together.
    """
    here, step, begun = start, tolerances.FIRST_STEP * longest, tangent
    number = 0
    while number < most:
        solution = path.correct(here + step * tangent, tangent)
        following = path.tangent(solution[0], tangent) if solution is not None else None
        if solution is None or following is None or float(following @ tangent) < tolerances.MIN_TANGENT_COSINE:
            before = beside(here, step * tangent) if beside is not None and solution is None else None
            if before is not None:
                # the path ends here whatever `visit` returns
                visit(tangent, before, _turned(path.tangent(before, tangent), tangent))
                return "together"
            step *= 0.5
            if step < tolerances.PATH_MIN_STEP:
                return "singular" if solution is not None and following is None else "step"
            continue
        unknowns, steps = solution
        outside = _first_bound(here, unknowns, bounds)
        if outside is not None:
            index, bound, share = outside
            guess = here + share * (unknowns - here)
            guess[index] = bound
            at_bound = path.correct(guess, np.eye(len(guess))[index])
            if at_bound is None or (
                step > tolerances.PATH_MIN_STEP and float(np.linalg.norm(at_bound[0] - guess)) > step
            ):
                step *= 0.5  # the parameter turns near the end of the range: shorter steps may stay inside
                if step < tolerances.PATH_MIN_STEP:
                    return "range"
                continue
            unknowns = at_bound[0]
            if float(tangent @ (unknowns - here)) <= 0.0:  # the bound is not ahead: the path starts at it
                return "range"
            following = path.tangent(unknowns, tangent)
        reason = visit(tangent, unknowns, _turned(following, tangent))
        number += 1
        if reason is not None or outside is not None or following is None:
            return reason or "range"
        here, tangent = unknowns, following
        apart = float(np.linalg.norm(_change(path, start, here)))
        if (
            number >= tolerances.MIN_CLOSED_POINTS
            and apart < step
            and float(tangent @ begun) > tolerances.MIN_TANGENT_COSINE
        ):
            return "closed"
        if steps <= tolerances.FAST_NEWTON_STEPS:
            step = min(step * tolerances.STEP_GROWTH, longest)
    return "points"


def _turned(following: Floats | None, tangent: Floats) -> bool:
    """Return whether the last unknown has an extremum between two points with these tangents."""
    return following is not None and float(following[-1] * tangent[-1]) < 0.0


def _change(path: ContinuationProblem, start: Floats, here: Floats) -> Floats:
    """Return the change of the unknowns, with phases that count from the same forcing period."""
    change = here - start
    change[: path.count] -= 2.0 * math.pi * round(float(change[0]) / (2.0 * math.pi))
    return change


def _first_bound(here: Floats, there: Floats, bounds: Bounds) -> tuple[int, float, float] | None:
    """Return which bound a step passes first, its value, and at what share of the step; None if none."""
    passed: list[tuple[float, int, float]] = []
    for index, low, high in bounds:
        if not low <= there[index] <= high:
            bound = low if there[index] < low else high
            change = float(there[index] - here[index])
            passed.append(((bound - float(here[index])) / change if change != 0.0 else 0.0, index, bound))
    if not passed:
        return None
    share, index, bound = min(passed)
    return index, bound, share

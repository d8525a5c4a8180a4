"""Types of motion: what a settled trajectory is called, or why it could not be named (theory: n-p_r-q_l)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core import codes
from grazemap_core.arrays import Integers
from grazemap_core.codes import CHAOTIC, QUASI_PERIODIC

KINDS: Final = ("unresolved", "periodic", "quasi-periodic", "chaotic")
"""Kinds of motion that this version tells apart; the position is the code."""

REASONS: Final[dict[int, str]] = {
    codes.NAMED: "",
    codes.NOT_CLOSED: "the stroboscopic orbit has not closed within the periods and the longest period looked at, "
    "and the growth of small changes, where it was measured, does not tell what it is",
    codes.SLOW: "the stroboscopic orbit closes too slowly to tell its limit",
    codes.GRAZES: "an impact is so slow that it may be none in the limit",
    codes.NOT_HELD: "mass 1 rests on a stop, and the chain behind it is at an undamped resonance or ill-conditioned",
    codes.BUDGET: "too many impacts: in half a forcing period, or without settling",
    codes.OVERFLOWS: "a number overflowed",
    codes.HIDDEN: "the steady motion is so large, as near an undamped resonance, that its round-off hides the "
    "motion between the stops",
    codes.NOT_SOUGHT: "verification was not requested, or the chain has an undamped mode or ill-conditioned ones",
    codes.RESTS: "mass 1 rests on a stop or chatters: found by simulation, which has no finite sequence of impacts "
    "to be solved for",
    codes.SEQUENCE_UNKNOWN: "there are more impacts than are verified, or a graze or a rest among them",
    codes.NOT_SOLVED: "Newton's method finds no orbit close to the trajectory",
    codes.NOT_ISOLATED: "the orbit is not certain to be the only one nearby, as at a saddle-node",
    codes.TOUCHES_OR_NOT: "an impact, or a passage of a stop, is so near to a graze that the orbit is not "
    "known well enough to tell",
    codes.NOT_STABLE: "a multiplier is on the unit circle or too close to it",
    codes.NOT_DISTINCT: "the orbit is too close to one of a shorter period, or to its own mirror image",
}
"""Why a motion is unresolved, or is periodic but not verified; the key is the code."""


@dataclass(frozen=True)
class Motion:
    """The motion that a trajectory settled to.

    Attributes
    ----------
    kind : one of KINDS
    period : int or None
        Least period n, in forcing periods.
    impacts_right, impacts_left : int or None
        Impacts on stop A and stop C per n forcing periods; -1: the stop is not touched, 0: mass 1 rests on it without
        ever striking it, -2 (`codes.INFINITE`): infinitely many, in complete chatter.
    symmetric : bool or None
        Whether the motion is its own mirror image, half a period later.
    sticking : bool or None
        Whether mass 1 rests on a stop some time in the period.
    verified : bool
        Whether the periodic orbit was solved for and is isolated, admissible and stable, with the least period. A
        trajectory that returns to its start is not verified by that alone.
    reason : str or None
        Why an unresolved motion is so.
    """

    kind: str
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    verified: bool = False
    reason: str | None = None


def motion_from_codes(
    reason: int, period: int, impacts_right: int, impacts_left: int, symmetric: bool, sticking: bool
) -> Motion:
    """Return the motion that the kernels' codes stand for."""
    if reason != codes.NAMED:
        return Motion(kind="unresolved", reason=REASONS[reason])
    return Motion(
        kind="periodic",
        period=period,
        impacts_right=impacts_right,
        impacts_left=impacts_left,
        symmetric=symmetric,
        sticking=sticking,
    )


def kinds_of(reason: Integers, growth: Integers, doubt: Integers) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Return the codes of kind and reason.

    From the codes of `closing`; of `lyapunov` where that has named nothing, and of `verification` where it has.
    """
    periodic = reason == codes.NAMED
    kind = np.select(
        [periodic, growth == QUASI_PERIODIC, growth == CHAOTIC],
        [KINDS.index("periodic"), KINDS.index("quasi-periodic"), KINDS.index("chaotic")],
        KINDS.index("unresolved"),
    )
    why = np.select([periodic, kind == KINDS.index("unresolved")], [doubt, reason], codes.NAMED)
    return kind.astype(np.int8), why.astype(np.int8)

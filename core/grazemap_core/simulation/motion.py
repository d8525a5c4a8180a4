"""The motion that a trajectory settles to: its name n-p_r-q_l (theory), or why it is unresolved."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core import codes
from grazemap_core.arrays import Integers
from grazemap_core.codes import CHAOTIC, QUASI_PERIODIC
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels.period_detection import NamedMotion

KINDS: Final = ("unresolved", "periodic", "quasi-periodic", "chaotic")
"""Kinds of motion; the index is the code."""

SENSITIVE_REASON: Final = (
    "sensitive: on its way to the orbit the trajectory passed a stop, or hit it, so narrowly that the round-off of a "
    "chaotic transient may have decided it."
)
REASONS: Final[dict[int, str]] = {
    codes.RESOLVED: "",
    codes.NOT_CLOSED: "the stroboscopic orbit did not close within the periods simulated and the largest period "
    "looked for, and the Lyapunov exponents, if they were computed, do not decide the kind of the motion. "
    "Remedy: simulate more periods, or look for longer ones (max_period); a preview computes no exponents.",
    codes.SLOW_CONVERGENCE: "the stroboscopic orbit converges too slowly to determine its limit. "
    "Remedy: simulate more periods; a bifurcation is near, which a branch or bifurcation curves locate.",
    codes.NEAR_GRAZING: "an impact is so slow that the limit motion may not contain it. "
    "Remedy: solve for the orbit (periodic-orbits), or move away from the graze.",
    codes.NO_STICKING_FLOW: "the contact rests on a stop, and the rest of the structure is at an undamped resonance or "
    "ill-conditioned. Remedy: add damping, or change the frequency.",
    codes.TOO_MANY_IMPACTS: "too many impacts: in half a forcing period, or before the motion settled. "
    "Remedy: a larger clearance or a smaller restitution; fewer masses with light damping.",
    codes.OVERFLOW: "a number overflowed. Remedy: choose units in which masses, stiffnesses and forcing are near 1.",
    codes.HIDDEN_BY_ROUNDING: "the steady motion is so large, as near an undamped resonance, that its round-off hides "
    "the motion between the stops. Remedy: add damping, or change the frequency.",
    codes.NOT_VERIFIED: "verification was not asked for, or the structure has an undamped mode or ill-conditioned "
    "modes. Remedy: damp every mode.",
    codes.STICKS: "the contact rests on a stop or chatters: the motion was found by simulation, and there is no finite "
    "sequence of impacts to solve for. Remedy: compare it with a longer trajectory.",
    codes.SEQUENCE_UNKNOWN: "more impacts than verification handles, or a graze or a rest among them. "
    "Remedy: solve for the orbit (periodic-orbits).",
    codes.NOT_SOLVED: "Newton's method finds no orbit close to the trajectory. "
    "Remedy: simulate more periods, or solve for the orbit (periodic-orbits).",
    codes.NOT_ISOLATED: "it is not certain that the orbit is the only one nearby, as at a saddle-node. "
    "Remedy: compute its branch, which locates the saddle-node.",
    codes.GRAZE_UNRESOLVED: "an impact, or a passage near a stop, is so close to a graze that the accuracy of the "
    "orbit does not decide between them. Remedy: move away from the graze; a branch locates it.",
    codes.NOT_STABLE: "a multiplier is on the unit circle or too close to it. "
    "Remedy: compute its branch, which locates the bifurcation.",
    codes.NOT_DISTINCT: "the orbit is too close to one of a smaller period, or to its own mirror image. "
    "Remedy: compute its branch, which locates the period doubling or the symmetry breaking.",
    codes.NOT_CAPTURED: "arrival-slow: the orbit is verified, but within the periods simulated the trajectory did not "
    "come so close to it that it certainly stays there. Remedy: simulate more periods (max_periods); beside a graze or "
    "a bifurcation, move away from it.",
    codes.ROUNDING_DECIDES: f"{SENSITIVE_REASON} "
    "Remedy: a certificate (proofs, an attraction) of where the state leads.",
}
"""Why a motion is unresolved, or is periodic but not verified, and what to do; the key is the code."""


@dataclass(frozen=True)
class Motion:
    """The motion that a trajectory settled to."""

    kind: str
    """One of KINDS."""
    period: int | None = None
    """Minimal period n, in forcing periods."""
    impacts_right: int | None = None
    """Impacts on the right stop per n forcing periods; -1: the stop is not touched, 0: the contact rests there without
    impacts, -2 (`codes.INFINITE`): infinitely many, in complete chatter."""
    impacts_left: int | None = None
    """Impacts on the left stop, likewise."""
    symmetric: bool | None = None
    """Whether the motion is its own mirror image, half a period later."""
    sticking: bool | None = None
    """Whether the contact rests on a stop some time in the period."""
    verified: bool = False
    """Whether the periodic orbit was solved for and is isolated, admissible and stable, with the minimum period. A
    trajectory that returns to its start is not verified by that alone."""
    reason: str | None = None
    """Why the motion is unresolved, or periodic but not verified."""


def unresolved(reason: int) -> Motion:
    """Return a motion without a name; `reason` is a code."""
    return Motion(kind="unresolved", reason=REASONS[reason])


def motion_of(named: NamedMotion) -> Motion:
    """Return the motion that was named, or why it was not."""
    if named.reason != codes.RESOLVED:
        return unresolved(named.reason)
    return Motion(
        kind="periodic",
        period=named.period,
        impacts_right=named.impacts_right,
        impacts_left=named.impacts_left,
        symmetric=named.symmetric,
        sticking=named.sticking,
    )


def kinds_of(reason: Integers, growth: Integers, unverified: Integers) -> tuple[NDArray[np.int8], NDArray[np.int8]]:
    """Return the codes of kind and reason.

    `reason` is the code of `period_detection`. If it is RESOLVED, the motion is periodic and its reason is
    `unverified`, the code of `verification`. Otherwise `growth`, the code of `lyapunov`, decides the kind.
    """
    periodic = reason == codes.RESOLVED
    kind = np.select(
        [periodic, growth == QUASI_PERIODIC, growth == CHAOTIC],
        [KINDS.index("periodic"), KINDS.index("quasi-periodic"), KINDS.index("chaotic")],
        KINDS.index("unresolved"),
    )
    why = np.select([periodic, kind == KINDS.index("unresolved")], [unverified, reason], codes.RESOLVED)
    return kind.astype(np.int8), why.astype(np.int8)

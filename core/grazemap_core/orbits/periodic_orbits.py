"""Periodic orbits with any number of impacts: impacts, states, multipliers, contacts and error bounds.

`periodic_orbit` computes all of a single orbit. `solve_sequences` solves for many orbits of one sequence of stops at
one frequency, each with its own gaps and guess; compiled code does it for all of them together.

Newton's method starts from a sequence of impacts near that of the orbit. The equations are analytic through impacts of
velocity 0, so a solution may have virtual impacts, at which the contact moves away from the stop. Such a solution is no
motion, and not admissible (theory, "Any impacting orbit").
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.stops import Stops, gap_of
from grazemap_core.contact.stops import Clearance, stops_between
from grazemap_core.errors import ParameterError, check_point
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.orbits.family import ForcedFamily, OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, MEETS, NO_FURTHER_CONTACT, TOUCHES
from grazemap_core.orbits.kernels.batches import OrbitResults, orbit_results, orbit_scratch, solve_orbits
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem
from grazemap_core.orbits.kernels.newton import CONVERGED, NOT_CONVERGED, OUT_OF_ORDER, SINGULAR
from grazemap_core.orbits.states import multipliers_of, states_at, with_unseen
from grazemap_core.orbits.tolerances import MAX_KANTOROVICH
from grazemap_core.records import dataclass
from grazemap_core.simulation.motion import Motion
from grazemap_core.simulation.start import State

ORBIT_REASONS = {
    CONVERGED: "",
    NOT_CONVERGED: "Newton's method does not converge from this guess. "
    "Remedy: a guess with phases and velocities, as from a trajectory near the motion.",
    OUT_OF_ORDER: "the order of the impacts would have to change: there is no orbit of this sequence near the guess. "
    "Remedy: another sequence of stops, or none, to solve for the motion that a trajectory settles to.",
    SINGULAR: "the equations are singular at the guess, as at a saddle-node or a resonant graze. "
    "Remedy: another frequency or clearance.",
}
"""Why an orbit is not found, and what to do, by status."""

CONTACTS = {NO_FURTHER_CONTACT: "none", MEETS: "some", TOUCHES: "undecided", GIVEN_UP: "not searched"}
"""Contacts of an orbit with a stop other than its impacts, by the code of `admissibility`."""


@dataclass(frozen=True, eq=False)
class PeriodicOrbit:
    """A periodic orbit with impacts or, where `converged` is false, the last iterate of Newton's method."""

    omega: float
    """Forcing frequency."""
    clearance: Clearance
    """Clearances of the stops."""
    impacts: ImpactSequence
    """As solved for: for a symmetric motion, half the period. `impacts.whole` has all impacts."""
    converged: bool
    """The residual is round-off. Otherwise the numbers below are NaN."""
    reason: str
    """Why Newton's method has not converged; empty if it has."""
    residual: float
    """Largest residual, in units of the larger of `Stops.unit` and the steady amplitude."""
    steps: int
    """Newton steps used."""
    kantorovich: float
    """The Newton-Kantorovich quantity, with the round-off of the residual. If it is at most 1/2, exactly one solution
    lies within `radius`, as certainly as floating-point numbers allow."""
    radius: float
    """For phases p omega t in radians, and for velocities in units of p omega times the unit of `residual`."""
    displacement: Floats
    """(N,) Displacements just before the first impact; a trajectory started there begins with the impact."""
    velocity: Floats
    """(N,) Velocities there."""
    phase: float
    """Forcing phase just before the first impact, in (-pi/p, pi/p]."""
    start: State
    """State at forcing phase 0, on the stroboscopic section."""
    multipliers: Complexes
    """(2N,) Floquet multipliers over the period, by decreasing modulus."""
    half_multipliers: Complexes | None
    """(2N,) Symmetric motions only: those of half the period and the mirror image; their squares are the
    multipliers."""
    stable: bool
    """Every multiplier lies inside the unit circle."""
    physical: bool
    """No impact is virtual."""
    contacts: str
    """Contacts with a stop other than the impacts: "none", "some" (also where an impact is virtual), "undecided" or
    "not searched"."""
    excess: float
    """Largest excess of the contact over a stop at a maximum between impacts, in units of length; negative where it
    stays inside, minus infinity where there is no such maximum."""
    excess_phase: float
    """Phase of that maximum, radians; NaN without one."""
    excess_stop: int
    """Stop of that maximum; 0 without one."""
    least_period: int
    """Forcing periods after which the motion repeats: `impacts.period`, or less if that is a multiple of it."""
    symmetric: bool
    """The orbit is its own mirror image half a period later."""

    @property
    def isolated(self) -> bool:
        """The Newton-Kantorovich theorem holds: exactly one orbit lies within `radius`."""
        return self.converged and self.kantorovich <= MAX_KANTOROVICH

    @property
    def admissible(self) -> bool:
        """Every impact velocity points at its stop, and the contact has no other contact with a stop."""
        return self.contacts == "none"

    @property
    def verified(self) -> bool:
        """The orbit is isolated, admissible and stable, and its period is the minimum one."""
        return self.isolated and self.admissible and self.stable and self.least_period == self.impacts.period

    @property
    def impacts_per_period(self) -> tuple[int, int]:
        """Impacts on the right and on the left stop in the minimum period; -1 for a stop that is not touched."""
        whole = self.impacts.whole
        parts = self.impacts.period // self.least_period
        right, left = (int(np.sum(whole.stops == stop)) // parts or -1 for stop in (1, -1))
        return right, left

    @property
    def motion(self) -> Motion:
        """The orbit as a motion; unresolved if it has not converged, or is not admissible."""
        if not self.converged:
            return Motion(kind="unresolved", sticking=False, reason=self.reason)
        right, left = self.impacts_per_period
        return Motion(
            kind="periodic" if self.admissible else "unresolved",
            period=self.least_period,
            impacts_right=right,
            impacts_left=left,
            symmetric=self.symmetric,
            sticking=False,
            verified=self.verified,
            reason=None if self.admissible else "the orbit is not admissible",
        )

    @property
    def label(self) -> str:
        """``n-pr-ql`` of the minimum period; -1 for a stop that is not touched."""
        right, left = self.impacts_per_period
        return f"{self.least_period}-{right if right > 0 else '(-1)'}r-{left if left > 0 else '(-1)'}l"


@in_own_period
def periodic_orbit(oscillator: Oscillator, omega: float, clearance: Clearance, guess: ImpactSequence) -> PeriodicOrbit:
    """Return the periodic orbit near a guess of its impacts.

    Parameters
    ----------
    oscillator : Oscillator
        Forced, every mode damped.
    omega : float
        > 0.
    clearance : Clearance
        One number > 0, or those of the right and of the left stop from q = 0; None for an absent stop.
    guess : ImpactSequence
        From `impact_sequences.impacts_of`, from another orbit, or created. The impacts of half the period of a
        symmetric motion, where the stops are not symmetric, stand for those of the whole period.

    Returns
    -------
    PeriodicOrbit
        Not `converged` if Newton's method finds no orbit of this sequence; `reason` states why.

    Raises
    ------
    ParameterError
        A number is out of range, nothing is forced, or an impact is on an absent stop.
    SteadyMotionError
        A mode is undamped.
    ConditioningError
        The modal model is ill-conditioned.
    """
    forced, stops = at_point(oscillator, omega, clearance, guess)
    if guess.symmetric and not stops.symmetric:
        guess = guess.whole
        forced, stops = at_point(oscillator, omega, clearance, guess)
    problem = forced.problem(max(forced.steady_size, stops.unit))
    phases, speeds, results = solve_sequences(problem, guess, [stops], guess.phases[None], guess.velocities[None])
    omega, unit = problem.omega, problem.omega * problem.length
    shift = math.floor(phases[0, 0] / (2.0 * math.pi * guess.period)) * 2.0 * math.pi * guess.period
    impacts = ImpactSequence(guess.period, guess.stops, phases[0] - shift, speeds[0] * unit, guess.symmetric)
    converged = int(results.status[0]) == CONVERGED
    count = oscillator.size
    x, v = np.full(count, np.nan), np.full(count, np.nan)
    state = State(x, v, 0.0)
    multipliers = np.full(2 * count, np.nan, dtype=np.complex128)
    phase = math.remainder(float(impacts.phases[0]), 2.0 * math.pi)
    if converged:
        (x, v), at_start = states_at(forced, impacts, (float(impacts.phases[0]), 0.0))
        # the contact is on its stop, and strikes it with that velocity, exactly
        stop, both = int(impacts.stops[0]), clearance if isinstance(clearance, tuple) else (clearance, clearance)
        x = oscillator.with_contact(x, stop * float(both[0 if stop > 0 else 1] or 0.0))
        v = oscillator.with_contact(v, float(impacts.velocities[0]))
        state = State(*at_start, 0.0)
        solved = OrbitImpacts(stops, impacts.stops.astype(np.float64), phases[0], speeds[0])
        multipliers = with_unseen(forced, multipliers_of(problem, solved, results.before[0]))
    symmetric = converged and stops.symmetric and impacts.mirrors()
    half: Complexes | None = None
    if guess.symmetric:
        half, multipliers = multipliers, multipliers * multipliers
    return PeriodicOrbit(
        omega=omega,
        clearance=clearance,
        impacts=impacts,
        converged=converged,
        reason=ORBIT_REASONS[int(results.status[0])],
        residual=float(results.residual[0]),
        steps=int(results.steps[0]),
        kantorovich=float(results.kantorovich[0]),
        radius=float(results.radius[0]),
        displacement=x,
        velocity=v,
        phase=phase if phase > -math.pi else math.pi,
        start=state,
        multipliers=multipliers,
        half_multipliers=half,
        stable=bool(np.all(np.abs(multipliers) < 1.0)),
        physical=converged and bool(np.all(impacts.stops * impacts.velocities > 0.0)),
        contacts=CONTACTS[int(results.contact_status[0])],
        excess=float(results.excess[0]) * problem.length,
        excess_phase=float(results.excess_phase[0]) - shift,
        excess_stop=int(results.excess_stop[0]),
        least_period=impacts.repeats_after() if converged else impacts.period,
        symmetric=symmetric,
    )


def at_point(
    oscillator: Oscillator, omega: float, clearance: Clearance, impacts: ImpactSequence
) -> tuple[ForcedFamily, Stops]:
    """Return the family of a sequence of impacts at a frequency, and the stops. Raises as `periodic_orbit`."""
    check_point(omega, 1.0 if isinstance(clearance, tuple) else clearance)
    forced = OrbitFamily.of(oscillator, impacts.period, impacts.symmetric).at(omega)
    stops = stops_between(oscillator, clearance, forced.steady_size)
    if any(math.isinf(gap_of(stops, float(stop))) for stop in impacts.whole.stops):
        raise ParameterError("stops", "has an impact on a stop that is absent")
    return forced, stops


def solve_sequences(
    problem: OrbitProblem,
    sequence: ImpactSequence,
    stops: Sequence[Stops],
    phases: Floats,
    velocities: Floats,
    floor: float = -math.inf,
) -> tuple[Floats, Floats, OrbitResults]:
    """Return phases and speeds, (m, k) each, and all other results for m orbits of one sequence of stops.

    Speeds are in units of the problem's omega times length.

    Parameters
    ----------
    sequence : ImpactSequence
        Only the stops of its impacts are used.
    stops : m of Stops
        Of each orbit, m >= 1, all with the same restitutions.
    phases, velocities : (m, k)
        The guesses.
    floor : float
        As in `admissibility.further_contact_from`.
    """
    count, blocks = len(sequence.stops), len(problem.decay)
    results, scratch = orbit_results(len(stops), count, blocks), orbit_scratch(count, blocks)
    phases = np.array(phases)
    speeds = velocities / (problem.omega * problem.length)
    gaps = np.array([[pair.right, pair.left] for pair in stops])
    impacts = OrbitImpacts(stops[0], sequence.stops.astype(np.float64), phases, speeds)
    # writes the solutions into phases and speeds
    solve_orbits(problem, impacts, gaps, floor, results, scratch)
    return phases, speeds, results

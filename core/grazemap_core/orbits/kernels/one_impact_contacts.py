"""Further contacts and multipliers of orbits with one impact in a span: functions of the phase of that impact.

The speed of the impact and the gap of its stop are trigonometric polynomials of the phase (`single_impact.orbits`),
so an orbit is decided by `admissibility` without being solved for.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.admissibility import (
    GIVEN_UP,
    MEETS,
    NO_FURTHER_CONTACT,
    TOUCHES,
    ContactScratch,
    excess_after_first_impact,
    further_contact,
)
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, assemble, sum_of_harmonics
from grazemap_core.orbits.kernels.multipliers import orbit_multipliers
from grazemap_core.orbits.kernels.newton import NewtonScratch
from grazemap_core.orbits.tolerances import MAXIMUM_ACCURACY, ORBIT_FLOOR, PHASE_HALVINGS, STEPS_TO_ADMISSIBLE
from grazemap_core.records import NamedTuple


class StopGap(NamedTuple):
    """The gap of a stop as a function of that of the stop of the impact: ``fixed + by_gap gap``."""

    fixed: float
    """The gap where `by_gap` is 0; infinite for an absent stop."""
    by_gap: float = 0.0
    """Change of the gap by that of the stop of the impact."""


class OneImpactMotions(NamedTuple):
    """Orbits with one impact in a span at several frequencies, as functions of its phase."""

    problem: OrbitProblem
    """Their equations at the first frequency. What contacts do not depend on is the same at all: derivatives by the
    frequency, and the impulses of a multiplier of -1."""
    omega: Floats
    """(m,) The forcing frequencies."""
    length: Floats
    """(m,) Units of length."""
    periodic_impulse: Floats
    """(m, N, 2) As in `OrbitProblem`."""
    steady: Floats
    """(m, H, 2) As in `OrbitProblem`."""
    speed: Floats
    """(m, H, 2) Real and imaginary parts of the amplitudes of the impact speed, in units of omega times length."""
    gap: Floats
    """(m, H, 2) Real and imaginary parts of the amplitudes of the gap."""
    pressing: Floats
    """(m, H, 2) The same of the acceleration toward the stop just after the impact, in units of omega^2 times
    length."""
    stop: float
    """The stop of the impact, +1 or -1."""
    struck: StopGap
    """The gap at which contacts with the stop of the impact are looked for; infinite for none."""
    other: StopGap
    """The gap at which contacts with the other stop are looked for; infinite for none."""
    restitution: float
    """Restitution of the stop of the impact."""


class MotionScratch(NamedTuple):
    """Scratch for orbits with one impact and N blocks."""

    sides: Floats
    """(1,) Stop of the impact."""
    phases: Floats
    """(1,) Its phase."""
    speeds: Floats
    """(1,) Its speed."""
    contact: ContactScratch
    """For the search for contacts."""


class Contacts(NamedTuple):
    """Contacts of p orbits."""

    status: Integers
    """(p,) Of `admissibility.further_contact`."""
    excess: Floats
    """(p,) Largest excess over a stop at a maximum between the impacts, in units of the problem's length."""
    stop: Integers
    """(p,) The stop there, +1 or -1; 0 without one. Where a contact begins, the stop that it is with."""


@kernel
def _equations_at(motions: OneImpactMotions, row: int) -> OrbitProblem:
    """Return the equations at one of the frequencies."""
    problem = motions.problem
    return OrbitProblem(
        problem.decay,
        problem.discriminant,
        problem.frequency_squared,
        problem.frequency,
        problem.unit_impulse,
        motions.periodic_impulse[row],
        problem.doubled_impulse,
        problem.periodic_impulse_by_span,
        problem.orders,
        motions.steady[row],
        problem.steady_by_omega,
        problem.steady_unit,
        motions.omega[row],
        motions.length[row],
        problem.turn,
        problem.sign,
    )


@kernel
def _impact_at(
    motions: OneImpactMotions, problem: OrbitProblem, row: int, phase: float, scratch: MotionScratch
) -> OrbitImpacts:
    """Return the impact of the orbit at a phase, which the scratch holds."""
    stop, restitution = motions.stop, motions.restitution
    sine, cosine = math.sin(phase), math.cos(phase)
    speed, _, _, _ = sum_of_harmonics(problem, motions.speed[row], sine, cosine)
    gap, _, _, _ = sum_of_harmonics(problem, motions.gap[row], sine, cosine)
    struck = motions.struck.fixed + motions.struck.by_gap * gap
    other = motions.other.fixed + motions.other.by_gap * gap
    right, left = (struck, other) if stop > 0.0 else (other, struck)
    stops = Stops(right, left, restitution, restitution, problem.length, 0.0, 0.0, False)
    impacts = OrbitImpacts(stops, scratch.sides, scratch.phases, scratch.speeds)
    impacts.sides[0], impacts.phases[0], impacts.speeds[0] = stop, phase, stop * speed
    return impacts


@kernel
def _contact_at(
    motions: OneImpactMotions, problem: OrbitProblem, row: int, phase: float, floor: float, scratch: MotionScratch
) -> tuple[int, float, int, float]:
    """Return status, excess and stop of `Contacts` for the orbit at a phase, and the phase of the contact.

    Without rebound the contact stays on the stop that it strikes, if it is pressed against it: it meets that stop.
    """
    impacts = _impact_at(motions, problem, row, phase, scratch)
    status, excess, place, touched = further_contact(problem, impacts, floor, scratch.contact)
    if motions.restitution == 0.0 and math.isfinite(motions.struck.fixed) and status != plain(GIVEN_UP):
        pressing, _, _, _ = sum_of_harmonics(problem, motions.pressing[row], math.sin(phase), math.cos(phase))
        if pressing > 0.0:
            status = plain(MEETS)
    return status, excess, touched, place


@kernel
def multipliers_at(
    motions: OneImpactMotions,
    phases: Floats,
    rows: Integers,
    real: Floats,
    imaginary: Floats,
    newton: NewtonScratch,
    matrix: Floats,
    scratch: MotionScratch,
) -> None:
    """Write the multipliers of the orbits at phases (p,) and the frequencies `rows` (p,), as `orbit_multipliers`.

    `real` and `imaginary` are (p, 2N); `newton`, of one impact, and `matrix` (2N, 2N) are scratch.
    """
    motions, scratch, newton = reference(motions), reference(scratch), reference(newton)
    for i in range(rows.shape[0]):
        problem = reference(_equations_at(motions, rows[i]))
        impacts = _impact_at(motions, problem, rows[i], phases[i], scratch)
        assemble(problem, impacts, newton.residual, newton.jacobian, newton.before)
        orbit_multipliers(problem, impacts, newton.before, matrix, real[i], imaginary[i])


@kernel
def contacts_at(
    motions: OneImpactMotions,
    phases: Floats,
    rows: Integers,
    floor: float,
    contacts: Contacts,
    scratch: MotionScratch,
) -> None:
    """Write the contacts of the orbits at phases (p,) and the frequencies `rows` (p,) into `contacts`.

    `floor` is that of `further_contact`.
    """
    motions, scratch = reference(motions), reference(scratch)
    for i in range(rows.shape[0]):
        row = rows[i]
        problem = reference(_equations_at(motions, row))
        contacts.status[i], contacts.excess[i], contacts.stop[i], _ = _contact_at(
            motions, problem, row, phases[i], floor, scratch
        )


@kernel
def contacts_begin(
    motions: OneImpactMotions, clear: Floats, rows: Integers, met: Floats, contacts: Contacts, scratch: MotionScratch
) -> None:
    """Move phases `clear` (p,), of admissible orbits, to those at which a contact begins, on the way to `met` (p,).

    The contact itself is written into `contacts`.
    """
    motions, scratch = reference(motions), reference(scratch)
    for i in range(rows.shape[0]):
        row = rows[i]
        problem = reference(_equations_at(motions, row))
        inside, outside = clear[i], met[i]
        status, excess, touched, _ = _contact_at(motions, problem, row, outside, -ORBIT_FLOOR, scratch)
        for _ in range(PHASE_HALVINGS):
            middle = 0.5 * (inside + outside)
            if abs(outside - inside) <= MAXIMUM_ACCURACY * (1.0 + abs(middle)):
                break
            at_middle, beyond, on, _ = _contact_at(motions, problem, row, middle, -ORBIT_FLOOR, scratch)
            if at_middle == plain(NO_FURTHER_CONTACT):
                inside = middle
            else:
                outside, status, excess, touched = middle, at_middle, beyond, on
        clear[i] = inside
        contacts.status[i], contacts.excess[i] = status, excess
        contacts.stop[i] = touched if touched != 0 else int(motions.stop)  # it stays on the stop that it strikes


@kernel
def first_admissible(
    motions: OneImpactMotions,
    phases: Floats,
    rows: Integers,
    ends: Floats,
    contacts: Contacts,
    scratch: MotionScratch,
) -> None:
    """Move phases (p,) to those at which admissible orbits begin, under one harmonic of order 1 between like stops.

    No orbit from a phase to where it is moved is admissible; none is at all where it is moved to its end (p,) or above
    it. The status is NO_FURTHER_CONTACT, TOUCHES if the steps do not reach the phase, or GIVEN_UP; the stop is that
    which is touched there, 0 if no stop is touched after the impact at the phase itself.
    """
    motions, scratch = reference(motions), reference(scratch)
    for i in range(rows.shape[0]):
        row = rows[i]
        problem = reference(_equations_at(motions, row))
        contacts.status[i], phases[i], contacts.stop[i] = _first_admissible(
            motions, problem, row, phases[i], ends[i], scratch
        )


@kernel
def _first_admissible(
    motions: OneImpactMotions, problem: OrbitProblem, row: int, start: float, end: float, scratch: MotionScratch
) -> tuple[int, float, int]:
    """Return the status of `first_admissible`, the phase to which `start` is moved, and the stop.

    The excess over a stop at a given time after the impact is a sine of the phase. The largest one at a phase excludes
    all orbits up to the zero of its sine, which is the next phase. So no admissible orbit is passed over. The steps are
    those of Newton's method on a convex function, and converge from one side (theory, "One impact a period").
    """
    phase, stop, step = start, plain(0), 0.0
    for _ in range(STEPS_TO_ADMISSIBLE):
        status, excess, touched, place = _contact_at(motions, problem, row, phase, 0.0, scratch)
        if status == plain(GIVEN_UP):
            return plain(GIVEN_UP), phase, stop
        if touched == 0:
            return plain(NO_FURTHER_CONTACT), phase, stop
        ahead = _impact_at(motions, problem, row, phase + 0.5 * math.pi, scratch)
        quarter, noise = excess_after_first_impact(problem, ahead, place - phase, float(touched), scratch.contact)
        step, before = math.atan2(excess, -quarter), step
        if excess <= noise and step >= before:  # round-off alone: next to the impact it excludes arbitrarily much
            return plain(NO_FURTHER_CONTACT), phase, stop
        stop = touched
        phase += step
        if excess <= noise or phase >= end:
            return plain(NO_FURTHER_CONTACT), phase, stop
    return plain(TOUCHES), phase, stop

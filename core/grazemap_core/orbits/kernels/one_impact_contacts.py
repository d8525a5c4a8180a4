"""Further contacts of orbits with one impact in a span, which are functions of the phase of that impact.

The speed of the impact and the gap of its stop are trigonometric polynomials of the phase (`orbits.explicit_orbits`),
so an orbit is decided by `admissibility` without being solved for.
"""

from __future__ import annotations

import math

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.numerics.jit.compiled import kernel, plain
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT, ContactScratch, further_contact
from grazemap_core.orbits.kernels.equations import OrbitImpacts, OrbitProblem, sum_of_harmonics
from grazemap_core.orbits.tolerances import MAXIMUM_ACCURACY
from grazemap_core.records import NamedTuple

_HALVINGS = 64
"""Maximum number of bisection steps between two phases: 53 reach round-off."""


class OneImpactMotions(NamedTuple):
    """Orbits with one impact in a span, as functions of its phase."""

    speed: Floats
    """(H, 2) Real and imaginary parts of the amplitudes of the impact speed, in units of omega times length."""
    gap: Floats
    """(H, 2) Real and imaginary parts of the amplitudes of the gap."""
    stop: float
    """The stop of the impact, +1 or -1."""
    own: float
    """Contacts with the stop of the impact are looked for at the gap ``own + own_by_gap gap``; infinite for none."""
    own_by_gap: float
    """See `own`."""
    other: float
    """Contacts with the other stop are looked for at the gap ``other + other_by_gap gap``; infinite for none."""
    other_by_gap: float
    """See `other`."""
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
    flow_between: Floats
    """(1, N, 4) Each block's flow from the impact to the next one."""
    contact: ContactScratch
    """For the search for contacts."""


class Contacts(NamedTuple):
    """Contacts of m orbits."""

    status: Integers
    """(m,) Of `admissibility.further_contact`."""
    excess: Floats
    """(m,) Largest excess over a stop at a maximum between the impacts, in units of the problem's length."""
    stop: Integers
    """(m,) The stop there, +1 or -1; 0 without one."""


@kernel
def _contact_at(
    problem: OrbitProblem, motions: OneImpactMotions, phase: float, floor: float, scratch: MotionScratch
) -> tuple[int, float, int]:
    """Return status, excess and stop of `Contacts` for the orbit at a phase."""
    sine, cosine = math.sin(phase), math.cos(phase)
    speed, _, _, _ = sum_of_harmonics(problem, motions.speed, sine, cosine)
    gap, _, _, _ = sum_of_harmonics(problem, motions.gap, sine, cosine)
    own, other = motions.own + motions.own_by_gap * gap, motions.other + motions.other_by_gap * gap
    stop, restitution = motions.stop, motions.restitution
    right, left = (own, other) if stop > 0.0 else (other, own)
    stops = Stops(right, left, restitution, restitution, problem.length, 0.0, 0.0, False)
    impacts = OrbitImpacts(stops, scratch.sides, scratch.phases, scratch.speeds)
    impacts.sides[0], impacts.phases[0], impacts.speeds[0] = stop, phase, stop * speed
    status, excess, _, touched = further_contact(problem, impacts, floor, scratch.flow_between, scratch.contact)
    return status, excess, touched


@kernel
def contacts_at(
    problem: OrbitProblem,
    motions: OneImpactMotions,
    phases: Floats,
    floor: float,
    contacts: Contacts,
    scratch: MotionScratch,
) -> None:
    """Write the contacts of the orbits at phases (m,) into `contacts`; `floor` is that of `further_contact`."""
    structure, family, work = reference(problem), reference(motions), reference(scratch)
    for i in range(phases.shape[0]):
        contacts.status[i], contacts.excess[i], contacts.stop[i] = _contact_at(
            structure, family, phases[i], floor, work
        )


@kernel
def contacts_begin(
    problem: OrbitProblem,
    motions: OneImpactMotions,
    clear: Floats,
    met: Floats,
    floor: float,
    contacts: Contacts,
    scratch: MotionScratch,
) -> None:
    """Move phases `clear` (m,), of admissible orbits, to those at which a contact begins, on the way to `met` (m,).

    The contact itself is written into `contacts`.
    """
    structure, family, work = reference(problem), reference(motions), reference(scratch)
    for i in range(clear.shape[0]):
        inside, outside = clear[i], met[i]
        status, excess, touched = _contact_at(structure, family, outside, floor, work)
        for _ in range(_HALVINGS):
            middle = 0.5 * (inside + outside)
            if abs(outside - inside) <= MAXIMUM_ACCURACY * (1.0 + abs(middle)):
                break
            here, there, on = _contact_at(structure, family, middle, floor, work)
            if here == plain(NO_FURTHER_CONTACT):
                inside = middle
            else:
                outside, status, excess, touched = middle, here, there, on
        clear[i] = inside
        contacts.status[i], contacts.excess[i], contacts.stop[i] = status, excess, touched

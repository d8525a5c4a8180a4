"""Orbits and branches of the default chain and of random chains that several tests have."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math

import numpy as np

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.motion_curves import orbit_in_window
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.search import sequence_of_stops
from grazemap_core.orbits.single_impact.special_orbits import ABSENT, ALIKE, StopMotions
from grazemap_core.simulation.monodromy import monodromy
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbit_at
from tests.support.oscillators import DEFAULT


def one_impact_motions(oscillator, omega, multiple=1, symmetric=False, stop=1, alone=False):
    """The motions with one impact on a stop, or one on each, at a frequency; the other stop is absent or like it."""
    family = OrbitFamily.of(oscillator, multiple, symmetric).at(omega)
    return StopMotions([family], stop, ABSENT if alone else ALIKE)


def special_motion(motions, kind):
    """The only special motion of a type with a gap above 0, or None."""
    motions_with_gap = [orbit for orbit in motions.special(kind) if orbit.gap > 0.0]
    assert len(motions_with_gap) <= 1
    return motions_with_gap[0] if motions_with_gap else None


def angle_of(motions, phase):
    """The angle psi of the theory page of the motion with an impact at a phase, in (-pi, pi]."""
    return math.remainder(phase + np.angle(motions.orbits.toward.amplitudes[0, 0]), 2.0 * math.pi)


def random_chain(rng, count, per_link, restitution):
    """A chain whose every mode is clearly damped, every mass forced."""
    damping = rng.uniform(0.05, 0.5, count) if per_link else float(rng.uniform(0.02, 0.2))
    return Oscillator.create(
        rng.uniform(0.5, 3.0, count),
        rng.uniform(0.5, 3.0, count),
        damping,
        np.concatenate(([1.0], rng.uniform(-0.5, 0.5, count - 1))),
        restitution,
    )


def random_families(seed):
    """Chains of 1..4 masses with both dampings, R from 0 to 0.9, patterns of n = 1..4: without end."""
    rng = np.random.default_rng(seed)
    for number in itertools.count():
        oscillator = random_chain(rng, 1 + number % 4, bool(number // 4 % 2), float(rng.choice([0.0, 0.4, 0.8, 0.9])))
        multiple, symmetric = [(1, False), (1, True), (2, False), (3, True), (3, False), (4, False)][number % 6]
        yield oscillator, one_impact_branch(oscillator, float(rng.uniform(0.2, 2.5)), multiple, symmetric), rng


def mismatch(ours, theirs):
    """Largest difference of two sets of eigenvalues, matched one by one; equal ones differ by the root of round-off."""
    theirs = list(theirs)
    worst = 0.0
    for value in ours:
        nearest = min(theirs, key=lambda other: abs(other - value))
        theirs.remove(nearest)
        worst = max(worst, abs(nearest - value) / max(1.0, abs(value)))
    return worst


SETTLED = {"5-8r-8l": 1.626, "3-4r-4l": 1.642, "1-2r-2l": 1.55, "1-3r-3l": 1.4}
"""Clearances at omega = 0.27 at which the default system settles to these motions from rest."""


def settled(oscillator, omega, clearance, transient=1500):
    """The trajectory from rest after a transient."""
    return trajectory(oscillator, omega, clearance, periods=32, transient_periods=transient, samples_per_period=1)


@functools.cache
def default_orbit(label):
    """The orbit of `SETTLED` with this label."""
    return periodic_orbit(DEFAULT, 0.27, SETTLED[label], impacts_of(settled(DEFAULT, 0.27, SETTLED[label], 2500)))


def guess_of(branch, orbit, shift=0.0):
    """The impact of an orbit of the closed form, or one beside it, as the general solver takes it."""
    phase = orbit.phase % (2.0 * math.pi) + shift
    speed = orbit.stop * orbit.impact_velocity * (1.0 + shift)
    return ImpactSequence.create(orbit.multiple, [orbit.stop], [phase], [speed], branch.pattern.symmetric)


def start(branch, angle):
    """The orbit at an angle of a closed-form branch, from the general solver."""
    known = orbit_at(branch, angle)
    return periodic_orbit(branch.oscillator, branch.omega, known.clearance, guess_of(branch, known))


@functools.cache
def two_impacts():
    """A branch over the clearance, of 1-2r-2l, with an admissible NS point."""
    return orbit_branch(DEFAULT, default_orbit("1-2r-2l"), 1.2, 1.8)


@functools.cache
def sixteen_impacts():
    """A branch over the clearance, of 5-8r-8l."""
    return orbit_branch(DEFAULT, default_orbit("5-8r-8l"), 1.5, 1.75)


FAMILIES = {"PD": (0.285, False), "SB": (0.27, True), "one-sided": (0.27, False)}


@functools.cache
def parent(kind):
    """A branch of motions with one impact, by the closed form's own start, and its special points."""
    omega, symmetric = FAMILIES[kind]
    known = one_impact_branch(DEFAULT, omega, 1, symmetric)
    return orbit_branch(DEFAULT, start(known, 1.3), 0.8 * known.amplitude, 1.05 * known.amplitude)


def special(branch, kind, admissible=True, impact=None):
    """The only special point of a type."""
    (point,) = [p for p in branch.special_points if (p.type, p.admissible, p.impact) == (kind, admissible, impact)]
    return point


def orbit_of(start):
    """The orbit of a start beyond a special point."""
    chain = dataclasses.replace(DEFAULT, restitution=start.restitution)
    return periodic_orbit(chain, start.omega, start.clearance, start.impacts)


def in_window(oscillator, omega, clearance, period, stops, vertical="clearance", other=None):
    """The orbit that is found in a window of the frequency and a clearance; `other` is that of the other stop."""
    at = ParameterPoint.of(oscillator, 1.0, (None, other) if vertical == "clearance_right" else (other, None))
    answer = orbit_in_window(oscillator, at, {"omega": omega, vertical: clearance}, period, stops)
    return None if answer is None else answer.orbit


def orbit_on(oscillator, curve, index):
    """The orbit at a point of a curve, from the general solver; a GR's own graze is left out."""
    keep = np.arange(len(curve.stops)) != (-1 if curve.impact is None else curve.impact)
    impacts = ImpactSequence(
        curve.period, curve.stops[keep], curve.phases[index][keep], curve.velocities[index][keep], curve.symmetric
    )
    return periodic_orbit(oscillator, float(curve.omega[index]), float(curve.clearance[index]), impacts)


def orbit_with(oscillator, omega, clearance, period, stops):
    """The orbit of so many forcing periods that hits these stops in turn, from the search."""
    guess = sequence_of_stops(oscillator, omega, clearance, period, stops)
    assert guess is not None
    return periodic_orbit(oscillator, omega, clearance, guess)


def from_impact(oscillator, orbit, **options):
    """The trajectory from just before the first impact of an orbit."""
    state = orbit.displacement, orbit.velocity, orbit.phase
    return trajectory(oscillator, orbit.omega, orbit.clearance, *state, **options)


def tangent_flow(oscillator, orbit):
    """The linearised flow along an orbit over its period, with its multipliers."""
    start, period = orbit.start, orbit.impacts.period
    return monodromy(oscillator, orbit.omega, orbit.clearance, start.displacement, start.velocity, period=period)

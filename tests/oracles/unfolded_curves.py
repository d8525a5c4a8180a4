"""Curves that leave resonant points, compared with exact motions beside these points."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import acb, arb

from grazemap_core.grazing.codimension_two import CodimensionTwoPoint, codimension_two_points
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.fifty_digits import digits, polynomial
from tests.oracles.harmonics_oracle import HarmonicsOracle
from tests.oracles.impact_orbit_oracle import OneImpact
from tests.oracles.structure_oracle import Forces, StructureOracle
from tests.support.general_systems import positive

NODES = 5
KINDS = (("SN", 1), ("SN", 2), ("PD", 1), ("PD", 2))


def random_system(seed: int, orders: tuple[int, ...] | None = None) -> tuple[Oscillator, HarmonicsOracle]:
    """Return an oscillator with matrices and two or three harmonics, and its oracle."""
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 5))
    mass, stiffness, damping = (positive(random, size) for _ in range(3))
    damping = 0.05 * damping
    if seed % 3 == 1 and size > 1:  # gyroscopic
        turn = 0.1 * random.normal(size=(size, size))
        damping = damping + (turn - turn.T)
    contact = random.normal(size=size)
    chosen = orders or tuple(sorted(random.choice([2, 3, 4, 5], int(random.integers(1, 3)), replace=False).tolist()))
    drive, parts = [], []
    for order in chosen if orders else (1, *chosen):
        amplitude, phase, turning = random.normal(size=size), random.normal(size=size), bool(random.random() < 0.3)
        drive.append(force(order, amplitude, phase, unbalance=turning))
        amplitudes = drive[-1].quadratic if turning else drive[-1].constant
        parts.append((order, forces(amplitudes, order if turning else 0)))
    structure = Matrices.create(mass, stiffness, damping)
    oracle = StructureOracle(structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix, contact)
    return Oscillator.of_structure(structure, contact, drive, 0.8), HarmonicsOracle(oracle, parts)


def forces(amplitudes: Any, unbalance: int) -> Forces:
    """Return the forces of a harmonic as the oracle takes them."""
    values = [acb(float(f.real), float(f.imag)) for f in amplitudes]
    return lambda omega: [f * (unbalance * omega) ** 2 if unbalance else f for f in values]


def unfolded_points(oscillator: Oscillator) -> list[CodimensionTwoPoint]:
    """Return the first resonant point of each of `KINDS` whose unfolding is computed, of the right stop alone."""
    points = codimension_two_points(oscillator, 0.3, 2.0, 1, 2, VariedStop(1))
    known = [p for p in points if p.kind == "resonant" and p.unfolding is not None]
    firsts = (next((p for p in known if (p.bifurcation, p.multiple) == kind), None) for kind in KINDS)
    return [point for point in firsts if point is not None]


def fitted(
    oscillator: Oscillator, oracle: HarmonicsOracle, point: CodimensionTwoPoint, step: float
) -> list[list[float]]:
    """Return coefficients of gap - A and of the speed as polynomials in the distance, from exact motions."""
    assert point.unfolding is not None
    assert point.multiple is not None
    side, places, heights, speeds = point.unfolding.curve_omega, [], [], []
    with digits():
        for k in range(1, NODES + 1):
            omega = arb(point.omega) + side * k * arb(step)
            graze = oracle.maxima(omega, 1)[0]
            family = OneImpact(oscillator, omega, 2 * point.multiple)
            phase = family.special(1 if point.bifurcation == "SN" else -1, float(graze.phase) - 1e-6)
            places.append(omega - arb(point.omega))
            heights.append(family.gap(phase) - graze.height)
            speeds.append(family.speed(phase))
            assert speeds[-1] > 0
        return [[float(a) for a in polynomial(places, values)] for values in (heights, speeds)]


def errors(oscillator: Oscillator, oracle: HarmonicsOracle, point: CodimensionTwoPoint) -> tuple[float, float]:
    """Return the relative errors of the leading coefficient of the curve and of its speed."""
    unfolding = point.unfolding
    assert unfolding is not None
    step = min(1e-5 * point.omega, 1e-5 * point.omega * abs(point.clearance) / unfolding.velocity_slope)
    height, speed = fitted(oscillator, oracle, point, step)
    of_speed = abs(abs(speed[1]) / unfolding.velocity_slope - 1.0)
    if unfolding.contact == "tangent":
        assert unfolding.quadratic is not None
        return abs(height[2] / unfolding.quadratic - 1.0), of_speed
    return abs(height[1] / unfolding.slope - 1.0), of_speed

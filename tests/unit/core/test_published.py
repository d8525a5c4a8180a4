"""Numbers that others have published of oscillators with one stop, on branches that are followed here."""

from __future__ import annotations

import math

import numpy as np
import pytest

from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.orbits.single_impact.orbits import OneImpactOrbits
from tests.support.oscillators import COCO, one_mass
from tests.support.thorough import the_first


def orbit_with(oscillator: Oscillator, omega: float, multiple: int, clearance: float, speed: float) -> PeriodicOrbit:
    """Return the orbit of one impact in so many periods whose impact speed is nearest to a number."""
    family = OrbitFamily.of(oscillator, multiple, False).at(omega)
    orbits = OneImpactOrbits([family], 1, 1.0 + oscillator.restitution)
    phase = min(orbits.phases(clearance).phases, key=lambda impact_phase: abs(orbits.speed(impact_phase) - speed))
    return periodic_orbit(oscillator, omega, (clearance, None), orbits.impacts(phase))


VIVID = one_mass(0.04, 0.9)
"""The oscillator of I. Ghosh and D. J. W. Simpson, arXiv:2510.16218."""


@pytest.mark.parametrize(
    ("kind", "omega", "force_there", "speed", "other"),
    [
        ("PD", 0.80079, 0.3601817821, 0.0060385, -0.432389),
        ("PD", 0.80499, 0.3540145838, 0.0329037, -0.433812),
        ("PD", 0.82001, 0.3372162367, 0.1311963, -0.438800),
        ("PD", 0.87001, 0.3287889277, 0.4908951, -0.454537),
        ("PD", 0.93001, 0.4037395633, 1.0530083, -0.471799),
        ("PD", 0.98001, 0.4665055416, 1.4420962, -0.484985),
        ("SN", 0.799, 0.3628362020, 0.1240866, 0.4317851),
        ("SN", 0.796998, 0.3642240031, 0.4112545, 0.4311005),
        ("SN", 0.788138, 0.3506941723, 1.3730124, 0.4280592),
    ],
)
def test_curves_from_a_resonant_graze(kind: str, omega: float, force_there: float, speed: float, other: float) -> None:
    """The data of Figure 4 of arXiv:2510.16218, in which the force varies and the stop is at 1.

    There a multiplier was followed to 1e-5 of 1 or -1, which on period doublings leaves an error in the force.
    """
    there = 1.0 / force_there  # of a unit force
    beside = there * (1.0 - 1e-3) if kind == "SN" else there
    orbit = orbit_with(VIVID, omega, 2, beside, speed * beside)
    branch = orbit_branch(VIVID, orbit, 0.99 * there, 1.01 * there, "clearance_right")
    points = [point for point in branch.special_points if point.type == kind]
    (point,) = (
        candidate for candidate in points if candidate.impacts.velocities[0] == pytest.approx(speed * there, rel=1e-3)
    )
    assert 1.0 / point.values.clearance_right == pytest.approx(force_there, rel=2e-9 if kind == "SN" else 2e-5)
    assert point.impacts.velocities[0] / point.values.clearance_right == pytest.approx(speed, rel=1e-4)
    assert point.multipliers.real == pytest.approx(
        sorted([other, 1.0 if kind == "SN" else -1.0], key=abs)[::-1], abs=1e-5
    )
    assert np.all(point.multipliers.imag == 0.0)


def test_the_branch_of_the_tutorial_ends_in_a_graze_beyond_a_saddle_node() -> None:
    """Example 15.2 of Dankowicz and Schilder, Recipes for Continuation (SIAM 2013), and PO-Tutorial of COCO, section 9.

    It starts at the force 1, with the velocity -1.36 after the impact at the phase 0.076, and passes through a graze.
    That is at the force 0.1, where 1 is the amplitude; its steps pass over the saddle-node beside it.
    """
    start = orbit_with(COCO, 1.0, 1, 1.0, 1.36 / 0.8)
    assert round(-0.8 * float(start.impacts.velocities[0]), 2) == -1.36
    assert round(float(start.impacts.phases[0]) % (2.0 * math.pi), 3) == 0.076
    assert grazing_curve(COCO, [0.9, 1.0, 1.1]).clearance[1] == pytest.approx(10.0, rel=1e-14)
    branch = orbit_branch(COCO, start, 0.9, 10.1, "clearance_right")
    forces = {
        kind: [1.0 / p.values.clearance_right for p in branch.special_points if p.type == kind] for kind in ["SN", "GR"]
    }
    assert forces["SN"] == [pytest.approx(0.099970753628313, rel=1e-11)]
    assert forces["GR"] == [pytest.approx(0.1, rel=1e-12)]


@pytest.mark.parametrize(
    ("omega", "restitution", "multiple", "fold", "doubling"),
    the_first(
        1,
        [
            (2.4, 0.6, 1, 0.57980111573999, 0.3724424636705),
            (3.7, 0.8, 2, 0.34514712445281, 0.15078703865997),
            (2.8, 0.8, 1, 1.7802356013216, 0.49308158186639),
        ],
    ),
)
def test_the_undamped_oscillator_is_the_limit(
    omega: float, restitution: float, multiple: int, fold: float, doubling: float
) -> None:
    """The formulas of Budd, Cliffe and Dux as F. Dux has coded them: the saddle-node, and the velocity at the doubling.

    They are for no damping; with a little the difference is proportional to it. The clearance of the node is a modulus:
    where sin(2 pi n/omega) > 0 the stop is beyond the equilibrium.
    """
    errors, side = [], -math.copysign(1.0, math.sin(2.0 * math.pi * multiple / omega))
    for damping in (1e-3, 1e-4):
        oscillator = one_mass(damping, restitution)
        start = orbit_with(oscillator, omega, multiple, 0.0, 10.0)
        branch = orbit_branch(oscillator, start, -1.1 * fold, 1.1 * fold, "clearance_right")
        (node,) = (
            side * p.values.clearance_right
            for p in branch.special_points
            if p.type == "SN" and p.impacts.velocities[0] > 0.0
        )
        assert branch.ends == ("closed", "closed")  # an ellipse
        speeds = [float(p.impacts.velocities[0]) for p in branch.special_points if p.type == "PD"]
        errors.append([abs(node - fold) / fold, min(abs(speed - doubling) for speed in speeds) / doubling])
    for coarse, fine in zip(*errors, strict=True):
        assert 8.0 < coarse / fine < 12.0
        assert fine < 1e-3

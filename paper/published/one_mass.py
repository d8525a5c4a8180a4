"""One mass with one stop on the right, x'' + damping x' + stiffness x = cos(omega t), and guesses of its orbits."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from grazemap import Client, OrbitBranch, Oscillator, PeriodicOrbit

QUIET: dict[str, Any] = {"progress": False}


def one_mass(damping: float, restitution: float, stiffness: float = 1.0) -> Oscillator:
    """Return the oscillator."""
    return Oscillator.model_validate(
        {
            "matrices": {"mass": [[1.0]], "damping": [[damping]], "stiffness": [[stiffness]]},
            "restitution": restitution,
            "forcing": {"amplitude": [1.0], "phase": [0.5 * math.pi]},
        }
    )


class Family(NamedTuple):
    """The orbits with one impact in a number of periods, in closed form: what Newton's method starts from.

    Attributes
    ----------
    omega : float
    amplitude, lag : float
        Of the steady motion, amplitude cos(omega t - lag).
    displacement, velocity : float
        Of an orbit with the impact speed v: at the impact the steady motion is at ``clearance + displacement v``, with
        the velocity ``velocity v``.
    """

    omega: float
    amplitude: float
    lag: float
    displacement: float
    velocity: float

    @classmethod
    def of(cls, damping: float, restitution: float, omega: float, multiple: int = 1, stiffness: float = 1.0) -> Family:
        """Return the family of an oscillator."""
        root = np.emath.sqrt(0.25 * damping**2 - stiffness)
        exponents = np.array([-0.5 * damping + root, -0.5 * damping - root], dtype=complex)
        growth = np.exp(exponents * (2.0 * math.pi * multiple / omega))
        sums = growth / (1.0 - growth) / (exponents[0] - exponents[1])
        e = 1.0 + restitution
        response = 1.0 / complex(stiffness - omega**2, damping * omega)
        return cls(
            omega=omega,
            amplitude=abs(response),
            lag=-float(np.angle(response)),
            displacement=e * float((sums[0] - sums[1]).real),
            velocity=1.0 + e * float((exponents[0] * sums[0] - exponents[1] * sums[1]).real),
        )

    def speeds(self, clearance: float) -> list[float]:
        """Return the impact speeds of the orbits at a clearance; the smaller one first."""
        square = self.displacement**2 + (self.velocity / self.omega) ** 2
        half = clearance * self.displacement
        root = half**2 - square * (clearance**2 - self.amplitude**2)
        return [(-half + sign * math.sqrt(root)) / square for sign in (-1.0, 1.0)] if root >= 0.0 else []

    def guess(self, clearance: float, speed: float, multiple: int = 1) -> dict[str, Any]:
        """Return the motion of about an impact speed, for a request."""
        place = (clearance + self.displacement * speed) / self.amplitude
        slope = self.velocity * speed / (self.omega * self.amplitude)
        phase = (math.atan2(-slope, place) + self.lag) % (2.0 * math.pi)
        return {"period": multiple, "stops": [1], "phases": [phase], "velocities": [speed]}


def right(clearance: float) -> dict[str, float | None]:
    """Return the clearances of one stop on the right."""
    return {"right": clearance, "left": None}


def orbit_near(client: Client, oscillator: Oscillator, omega: float, clearance: float, motion: Any) -> PeriodicOrbit:
    """Return the orbit that Newton's method finds from a motion."""
    return client.periodic_orbit(oscillator, omega=omega, clearance=right(clearance), motion=motion, **QUIET)


def branch_over_clearance(
    client: Client,
    oscillator: Oscillator,
    omega: float,
    start: tuple[float, dict[str, Any]],
    interval: tuple[float, float],
) -> OrbitBranch:
    """Return the branch through an orbit, (clearance, motion), over the clearance of the stop."""
    clearance, motion = start
    return client.orbit_branch(
        oscillator,
        omega=omega,
        clearance=right(clearance),
        motion=motion,
        vary="clearance_right",
        range=interval,
        **QUIET,
    )


def points_of(branch: OrbitBranch, kind: str) -> list[tuple[float, float]]:
    """Return the clearance and the impact velocity of the special points of a type."""
    return [
        (float(point.clearance_right or 0.0), float(point.velocities[0]))
        for point in branch.special_points
        if point.type == kind
    ]

"""The cost of a forcing period of an oscillator, and the number of periods of a pixel.

A forcing period is computed in cells, in each of which the fastest mode turns by a radian, and impact by impact. The
time of a cell and of an impact grows with the number of masses. The number of impacts is estimated from the force that
presses mass 1 against a stop: it bounces between stops that are close, and its chatter ends in rest where the
restitution is below 1.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from grazemap.wire import CoordinateRange, Grid, Oscillator, grid_values
from grazemap_worker.planning.rates import (
    BRANCH_IMPACTS,
    BRANCH_SECONDS,
    CELL_SECONDS,
    CHATTER_REST,
    DRAG_OF_BOUNCES,
    DRAG_POWER,
    FLIGHT_SPEED,
    GROWTH_PERIODS,
    HELD_CELLS,
    IMPACT_MASS_SECONDS,
    IMPACT_SECONDS,
    LANES_AT_REST,
    LEAST_CELLS,
    LEAST_UNSETTLED,
    MOST_ORBIT_IMPACTS,
    MOST_PERIOD_IMPACTS,
    MOST_UNSETTLED,
    ORBIT_SECONDS,
    PERIOD_SECONDS,
    PERIODS_PER_SECOND,
    PERIODS_TO_SETTLE,
    POINTS_ORDER_SECONDS,
    RUN_ON,
    RUN_ON_PERIODS,
    RUN_ON_SAMPLE,
    SAMPLED_SIDE,
    SETUP_MASS_SECONDS,
    SETUP_SECONDS,
    UNSETTLED_POWER,
)

Floats = NDArray[np.float64]


def fastest_exponent(oscillator: Oscillator) -> float:
    """Return an upper bound of |lambda| over the eigenvalues of M x'' + C x' + K x = 0.

    With nu and mu the largest absolute row sums of M^-1 C and M^-1 K (Gershgorin), |lambda|^2 <= nu |lambda| + mu.
    Infinite where the numbers overflow.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        mu = _largest_row_sum(oscillator.masses, oscillator.stiffnesses)
        damping = oscillator.damping
        if isinstance(damping, list):
            nu = _damping_factor(oscillator) * _largest_row_sum(oscillator.masses, damping)
        else:
            nu = 2.0 * damping * mu
    bound = 0.5 * (nu + math.hypot(nu, 2.0 * math.sqrt(mu)))
    return math.inf if math.isnan(bound) else bound


def contact_force(oscillator: Oscillator, omega: Floats | float) -> tuple[Floats, Floats]:
    """Return the amplitude of the force on mass 1, held in the middle, at each omega, and its amplitude if it is free.

    At a resonance they are those after GROWTH_PERIODS forcing periods: the forcing grows by a factor e in that time.
    The other masses are eliminated one by one, from the ground.
    """
    rate = omega * (1j + 1.0 / (2.0 * math.pi * GROWTH_PERIODS))
    forces, force, dynamic = oscillator.amplitudes, 0.0 * rate, 0.0 * rate
    for i in reversed(range(oscillator.size)):
        link = oscillator.stiffnesses[i] + rate * _link_damping(oscillator, i)
        # the link from this mass to the next one, which is eliminated; the last one is joined to the ground
        share = link / (dynamic + link) if i < oscillator.size - 1 else 0.0 * link
        force = forces[i] + share * force
        dynamic = oscillator.masses[i] * rate * rate + link * (1.0 - share)
    return np.abs(force), np.abs(force / dynamic)


def period_impacts(oscillator: Oscillator, omega: Floats, clearance: Floats) -> Floats:
    """Return the expected number of impacts of a forcing period, for omega and clearance of any shapes that fit.

    A mass under an acceleration a bounces a/(2 v) times in a unit of time, v being its speed. That is the smallest of
    three: of a flight between the stops under a; of the motion without stops where it meets a stop, with the part of a
    beyond the stop; of a flight under an acceleration that rises from zero with the forcing. With a restitution below 1
    the chatter on each stop ends in rest after a number of impacts that depends on it alone. With 1 it goes on, ever
    faster as the damper takes energy.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        # one number is faster than an array of one
        force, amplitude = contact_force(oscillator, omega.item() if omega.size == 1 else omega)
        mass, period = oscillator.masses[0], 2.0 * math.pi / omega
        acceleration = force / mass
        flight = FLIGHT_SPEED * np.sqrt(acceleration * clearance)
        reached = np.fmin(clearance / amplitude, 1.0)
        steady = omega * amplitude * np.sqrt((1.0 + reached) / (1.0 - reached))
        rising = 0.5 * acceleration * omega * (12.0 * clearance / (acceleration * omega)) ** (2.0 / 3.0)
        bounces = 0.5 * period * acceleration / np.fmin(np.fmin(flight, steady), rising)
        drag = period * _link_damping(oscillator, 0) / mass / DRAG_OF_BOUNCES
        bounces *= 1.0 + drag * oscillator.equal_restitution**DRAG_POWER
        return np.fmin(np.fmin(bounces, _impacts_to_rest(oscillator.equal_restitution)), MOST_PERIOD_IMPACTS)


def period_costs(oscillator: Oscillator, omega: Floats, clearance: Floats, *, lanes: bool = False) -> Floats:
    """Return the cost of a forcing period, in periods of the default oscillator, for shapes as in `period_impacts`.

    In the `lanes` of maps it is higher where mass 1 comes to rest, as such lanes are computed one by one.
    """
    size = oscillator.size
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        impacts = period_impacts(oscillator, omega, clearance)
        rests = impacts >= _impacts_to_rest(oscillator.equal_restitution)
        cells = _cells(oscillator, omega) * size * np.where(rests, HELD_CELLS, 1.0)
        seconds = PERIOD_SECONDS + CELL_SECONDS * cells + (IMPACT_SECONDS + IMPACT_MASS_SECONDS * size) * impacts
        if lanes:
            seconds *= np.where(rests, LANES_AT_REST, 1.0)
    return PERIODS_PER_SECOND * np.where(np.isnan(seconds), np.inf, seconds)


def period_cost(oscillator: Oscillator, omega: float, clearance: float, *, lanes: bool = False) -> float:
    """Return the cost of a forcing period at one point, as `period_costs`."""
    return float(period_costs(oscillator, np.array([omega]), np.array([clearance]), lanes=lanes)[0])


def mean_cost(oscillator: Oscillator, omega: Grid, clearance: Grid) -> float:
    """Return the mean cost of a forcing period in lanes over a grid, from SAMPLED_SIDE values along each side."""
    return float(period_costs(oscillator, _some(omega)[:, None], _some(clearance), lanes=True).mean())


def orbit_seconds(oscillator: Oscillator, omega: Grid, clearance: Grid, max_periods: int) -> float:
    """Return the mean seconds in which the orbit of a trajectory is solved for and verified, if it settles in time."""
    impacts = np.fmin(period_impacts(oscillator, _some(omega)[:, None], _some(clearance)), MOST_ORBIT_IMPACTS)
    settled = (1.0 - oscillator.equal_restitution**UNSETTLED_POWER) * min(1.0, max_periods / PERIODS_TO_SETTLE)
    return ORBIT_SECONDS * oscillator.size * settled * float((impacts**2).mean())


def codimension_two_seconds(start: float, stop: float, max_order: int, max_multiple: int) -> float:
    """Return the seconds in which the codimension-two points between two omegas are found."""
    return math.log(stop / start) * POINTS_ORDER_SECONDS * (max_order + 2 * max_multiple)


def setup_seconds(oscillator: Oscillator) -> float:
    """Return the seconds in which the modes of an oscillator are found, and the tables of a frequency made."""
    return SETUP_SECONDS + SETUP_MASS_SECONDS * oscillator.size**2


def unsettled(oscillator: Oscillator) -> float:
    """Return the share of trajectories that are expected not to settle: more where impacts take less energy."""
    return max(LEAST_UNSETTLED, MOST_UNSETTLED * oscillator.equal_restitution**UNSETTLED_POWER)


def expected_periods(oscillator: Oscillator, max_periods: int, share: float = 1.0) -> float:
    """Return the forcing periods that a pixel takes on average, with a share of the `unsettled` ones."""
    return min(float(max_periods), PERIODS_TO_SETTLE + share * unsettled(oscillator) * max_periods)


def chance_seconds(oscillator: Oscillator, trajectories: float, max_periods: int, cost: float) -> float:
    """Return the seconds in which a sample of the chaotic ones among trajectories is run on."""
    sample = min(RUN_ON_SAMPLE, unsettled(oscillator) * trajectories)
    return sample * min(RUN_ON * max_periods, RUN_ON_PERIODS) * cost / PERIODS_PER_SECOND


def branch_point_seconds(oscillator: Oscillator, impacts: float) -> float:
    """Return the seconds for a point of the branch of an orbit with this number of impacts."""
    return BRANCH_SECONDS * (1.0 + impacts / BRANCH_IMPACTS) * oscillator.size


def _link_damping(oscillator: Oscillator, link: int) -> float:
    damping = oscillator.damping
    if isinstance(damping, list):
        return damping[link] * _damping_factor(oscillator)
    return 2.0 * damping * oscillator.stiffnesses[link]


def _damping_factor(oscillator: Oscillator) -> float:
    return 1.0 if oscillator.units == "SI" else 2.0


def _largest_row_sum(masses: list[float], links: list[float]) -> float:
    """Return the largest absolute row sum of M^-1 times a chain's matrix, its last link to ground."""
    after = np.array(links)
    before = np.concatenate(([0.0], after[:-1]))
    sums = before + after
    sums[:-1] += after[:-1]
    return float(((sums + before) / np.array(masses)).max())


def _cells(oscillator: Oscillator, omega: Floats) -> Floats:
    return np.maximum(LEAST_CELLS, fastest_exponent(oscillator) * 2.0 * math.pi / omega)


def _impacts_to_rest(restitution: float) -> float:
    """Return the number of impacts until a chatter on each stop has ended in rest."""
    if not 0.0 < restitution < 1.0:
        return 2.0 if restitution == 0.0 else math.inf
    return 2.0 * (1.0 + math.log(CHATTER_REST) / math.log(restitution))


def _some(values: Grid | CoordinateRange) -> Floats:
    found = grid_values(values)
    some: Floats = found[np.linspace(0, len(found) - 1, min(len(found), SAMPLED_SIDE)).round().astype(int)]
    return some

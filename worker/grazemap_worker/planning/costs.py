"""Parts of estimates: the cost of a forcing period, the periods until a motion settles, the seconds of other steps.

A forcing period is computed cell by cell and impact by impact. In a cell the fastest mode turns by one radian, or by
less where a period would have fewer than a minimum number of cells. The time of a cell and of an impact grows with the
number of masses. The number of impacts is estimated from the force that presses the contact against a stop: the contact
bounces between stops that are close, and with a restitution below 1 its chatter ends in rest.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap.wire import (
    ClearancePair,
    CodimensionTwoPointsRequest,
    GrazingCurvesRequest,
    Grid,
    Oscillator,
    grid_values,
    linear,
)
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.planes import Line, Parameters, Plane, is_place
from grazemap.wire.process import PointRequest
from grazemap.wire.structure import as_pair, restitutions
from grazemap_worker.planning import rates

Floats = NDArray[np.float64]


def fastest_exponent(oscillator: Oscillator) -> float:
    """Return an upper bound of |lambda| over the eigenvalues of M x'' + C x' + K x = 0.

    With nu and mu the largest absolute row sums of M^-1 C and M^-1 K (Gershgorin), |lambda|^2 <= nu |lambda| + mu.
    Infinite where the numbers overflow.
    """
    if oscillator.matrices is not None:
        return linear.fastest_exponent(oscillator)
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
    """Return two amplitudes at each omega: of the force on a contact that is held, of the displacement of a free one.

    The forcing is taken to grow by a factor e in GROWTH_PERIODS forcing periods, so both amplitudes are finite at a
    resonance too. The masses of a chain are eliminated one by one, beginning at the ground.
    """
    if oscillator.beyond_the_chain() is not None:
        growth = oscillator.common_divisor / (2.0 * math.pi * rates.GROWTH_PERIODS)
        held_force, amplitude = linear.contact_forces(oscillator, np.ravel(omega), growth)
        return held_force.reshape(np.shape(omega)), amplitude.reshape(np.shape(omega))
    rate = omega * (1j + 1.0 / (2.0 * math.pi * rates.GROWTH_PERIODS))
    forces, force, dynamic = oscillator.amplitudes, 0.0 * rate, 0.0 * rate
    for i in reversed(range(oscillator.size)):
        link = oscillator.stiffnesses[i] + rate * _link_damping(oscillator, i)
        # the next mass, to which the link leads, is eliminated already; the link of the last mass leads to the ground
        share = link / (dynamic + link) if i < oscillator.size - 1 else 0.0 * link
        force = forces[i] + share * force
        dynamic = oscillator.masses[i] * rate * rate + link * (1.0 - share)
    return np.abs(force), np.abs(force / dynamic)


class Points(NamedTuple):
    """Points of a parameter plane: forcing frequencies, and the stops at each."""

    omega: Floats
    """(k,) Forcing frequencies."""
    nearer: Floats
    """(k,) Distance of the nearer stop from q = 0."""
    half_distance: Floats
    """(k,) Half the distance between the stops; infinite if there is only one stop."""

    @property
    def stop_count(self) -> Floats:
        """(k,) Number of stops."""
        return np.where(np.isinf(self.half_distance), 1.0, 2.0)

    @classmethod
    def create(cls, places: Iterable[tuple[float, float | ClearancePair]]) -> Points:
        """Return the points with these frequencies and clearances."""
        rows = []
        for omega, clearance in places:
            reach = as_pair(clearance).reach
            rows.append((omega, abs(min(reach)), 0.5 * sum(reach)))
        return cls(*np.array(rows).T)

    def width(self, amplitude: Floats) -> Floats:
        """Return half the width of the motion at each point; `amplitude` (k,) is that of the motion without stops."""
        return np.fmin(self.half_distance, np.fmax(self.nearer, amplitude))


def period_impacts(oscillator: Oscillator, points: Points) -> Floats:
    """Return the expected number of impacts of a forcing period at each point.

    A mass with speed v under an acceleration a bounces a/(2 v) times in a unit of time. The speed v is the minimum of
    three speeds: that of a flight between the stops under a; that of the motion without stops where it meets a stop,
    divided by 1 - r, where r is the distance of the stop over the amplitude; and that of a flight under an acceleration
    that rises from zero with the forcing. With a restitution below 1, the chatter on each stop ends in rest after a
    number of impacts that depends on the restitution alone. With restitution 1 the contact goes on bouncing, and ever
    more often, because damping takes energy.
    """
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        # numpy is faster with a float than with an array of one element
        at = points.omega
        force, amplitude = contact_force(oscillator, at.item() if at.size == 1 else at)
        mass, slowing = _contact_mass(oscillator)
        period, restitution = oscillator.forcing_period(at), _largest_restitution(oscillator)
        omega = oscillator.common_divisor * at  # 2 pi over the period
        acceleration = force / mass
        clearance = points.width(amplitude)
        flight = rates.FLIGHT_SPEED * np.sqrt(acceleration * clearance)
        rising = 0.5 * acceleration * omega * (12.0 * clearance / (acceleration * omega)) ** (2.0 / 3.0)
        # the factor by which damping, which slows the contact, makes it bounce more often
        drag = 1.0 + period * slowing / rates.DRAG_OF_BOUNCES * restitution**rates.DRAG_POWER

        def bounces(distance: Floats) -> Floats:
            """Return the number of impacts where the motion without stops meets a stop at a distance."""
            reached = np.fmin(distance / amplitude, 1.0)
            steady = omega * amplitude * np.sqrt((1.0 + reached) / (1.0 - reached))
            return np.asarray(0.5 * period * acceleration * drag / np.fmin(np.fmin(flight, steady), rising))

        # With one stop, the first impacts are those of a motion as wide as the distance of the stop. A motion that does
        # not come to rest then becomes as wide as the motion without stops.
        first_impacts = bounces(np.where(points.stop_count == 1.0, points.nearer, clearance))
        to_rest = _impacts_to_rest(oscillator, points)
        impacts = np.where(first_impacts < rates.REST_SHARE * to_rest, bounces(clearance), to_rest)
        return np.fmin(impacts, rates.MAX_PERIOD_IMPACTS)


def period_costs(oscillator: Oscillator, points: Points, *, lanes: bool = False) -> Floats:
    """Return the cost of a forcing period at each point, in periods of the default oscillator.

    With `lanes`, it is the cost in a map, whose trajectories are computed side by side, in lanes. It is higher where
    the contact comes to rest, because such lanes are computed one by one.
    """
    size = oscillator.size
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        impacts = period_impacts(oscillator, points)
        rests = _rests(oscillator, points, impacts)
        cells = _cells(oscillator, points.omega) * size * np.where(rests, rates.HELD_CELLS, 1.0)
        impact_seconds = rates.IMPACT_SECONDS + rates.IMPACT_MASS_SECONDS * size
        seconds = rates.PERIOD_SECONDS + rates.CELL_SECONDS * cells + impact_seconds * impacts
        if lanes:
            seconds *= np.where(rests, rates.LANES_AT_REST, 1.0)
    return rates.PERIODS_PER_SECOND * np.where(np.isnan(seconds), np.inf, seconds)


def period_cost(
    oscillator: Oscillator, omega: float, clearance: float | ClearancePair, *, lanes: bool = False
) -> float:
    """Return the cost of a forcing period at one point; see `period_costs`."""
    return float(period_costs(oscillator, Points.create([(omega, clearance)]), lanes=lanes)[0])


def period_cost_at_point(request: PointRequest) -> float:
    """Return the cost of a forcing period of a request with a single frequency and clearance."""
    return period_cost(request.oscillator, request.omega, request.clearance)


class Samples:
    """Some points of a plane or a line, evenly spaced by index; means over them are taken as means over all points."""

    def __init__(self, parameters: Parameters, values: Iterable[Mapping[str, float]]) -> None:
        """Group points by their oscillators; an item of `values` has the values of the varied parameters at a point."""
        # a place is omega or a clearance; other parameters change the oscillator
        groups: dict[tuple[float, ...], list[Mapping[str, float]]] = {}
        for point in values:
            groups.setdefault(tuple(value for name, value in point.items() if not is_place(name)), []).append(point)
        self._groups = [
            (parameters.oscillator_at(points[0]), Points.create(map(parameters.place, points)))
            for points in groups.values()
        ]
        self._count = sum(map(len, groups.values()))

    @classmethod
    def create(cls, varied: Plane | Line) -> Samples:
        """Return the points of a plane or line at SAMPLED_SIDE values of each varied parameter."""
        axes = (varied.horizontal, varied.vertical) if isinstance(varied, Plane) else (varied.axis,)
        names, values = [axis.vary for axis in axes], [_sampled_values(axis.grid) for axis in axes]
        return cls(varied.parameters, (dict(zip(names, point, strict=True)) for point in itertools.product(*values)))

    def mean_cost(self, *, lanes: bool = True) -> float:
        """Return the mean cost of a forcing period: with `lanes` in the lanes of maps, else in a single trajectory."""
        costs = [period_costs(*group, lanes=lanes) for group in self._groups]
        return float(np.concatenate(costs).mean())

    def settling(self, max_periods: int) -> SettlingEstimate:
        """Return how the trajectories of the points settle on average."""
        estimates = [settling(*group, max_periods) for group in self._groups]
        weights = [len(points.omega) for _, points in self._groups]
        return SettlingEstimate(*np.average(np.array(estimates), axis=0, weights=weights).tolist())

    def observed_seconds(self, request: ObservedRequest, cost: float, unsettled: float) -> float:
        """Return the mean seconds for reading observables and outputs off a motion of a map.

        `cost` is the cost of a forcing period, and `unsettled` the share of motions that do not settle.
        """
        if not request.observed:
            return 0.0
        periods = rates.OBSERVED_PERIODS + unsettled * rates.AVERAGED_PERIODS
        seconds = 0.0
        for group in self._groups:
            seconds += len(group[1].omega) * observed_seconds(request, *group, periods)
        return seconds / self._count + periods * cost / rates.PERIODS_PER_SECOND


def longest_period_cost(varied: Plane | Line) -> float:
    """Return the largest cost of a forcing period at the ends of a line, or at the corners of a plane."""
    points = varied.corners()
    return max(period_cost(point.oscillator, point.omega, point.clearance) for point in points)


class Zeros:
    """The expected number of zeros of the impulse response of the contact, as a function of time.

    A sum of oscillations with frequencies w and amplitudes a has on average sqrt(sum a^2 w^2 / sum a^2) / pi zeros in a
    unit of time (S. O. Rice, 1944). After a long time, only the modes that decay slowly contribute. Zeros are counted
    at times from `shortest` to `longest`.
    """

    def __init__(self, oscillator: Oscillator, longest: float, shortest: float) -> None:
        frequencies, decays, amplitudes = linear.contact_modes(oscillator)
        kept = amplitudes > rates.MIN_AMPLITUDE * amplitudes.max()
        frequencies, decays, amplitudes = frequencies[kept], decays[kept], amplitudes[kept] / amplitudes.max()
        self._times = np.geomspace(shortest, longest, rates.ZERO_SAMPLES)
        squares = (amplitudes * np.exp(-np.outer(self._times, decays - decays.min()))) ** 2
        density = np.sqrt((squares @ frequencies**2) / squares.sum(axis=1)) / math.pi
        parts = 0.5 * (density[1:] + density[:-1]) * np.diff(self._times)
        self._until = np.concatenate(([0.0], np.cumsum(parts)))

    def count(self, factors: Floats, start: float, stop: float) -> tuple[float, float]:
        """Count zeros tau for which factor/tau is in [start, stop].

        Returns
        -------
        distinct : float
            Number of zeros for which this holds for at least one factor.
        total : float
            Sum of the numbers of zeros over all factors.
        """
        if not len(factors):
            return 0.0, 0.0
        ends = np.sort(factors)
        low, high = (np.interp(ends / omega, self._times, self._until) for omega in (stop, start))
        before = np.concatenate(([0.0], np.maximum.accumulate(high)[:-1]))
        return float(np.fmax(high - np.fmax(low, before), 0.0).sum()), float((high - low).sum())


def codimension_two_seconds(
    request: CodimensionTwoPointsRequest | GrazingCurvesRequest,
    start: float,
    stop: float,
    max_order: int,
    max_multiple: int,
) -> float:
    """Return the seconds for finding the codimension-two points between two omegas, `start` and `stop`.

    `max_order` and `max_multiple` are those of a request of the process codimension-two-points.
    """
    oscillator = request.oscillator
    divisor = oscillator.common_divisor
    start, stop = divisor * start, divisor * stop
    both = request.clearance is None and oscillator.is_symmetric
    curves = 1 if both or request.clearance is not None else 2
    orders: Floats = math.pi * np.arange(1.0 if both else 2.0, max_order + 1.0, 1.0 if both else 2.0)
    multiples: Floats = 2.0 * math.pi * np.arange(1.0, max_multiple + 1.0)
    if both:
        multiples = np.concatenate((multiples, math.pi * np.arange(1.0, max_multiple + 1.0, 2.0)))
    longest = max([1.0, *orders, *multiples])
    with np.errstate(all="ignore"):
        zeros = Zeros(oscillator, longest / start, math.pi / stop)
    # of each: the number of distinct zeros, and the sum over all orders or multiples
    (isolated, recurring), (periodic, resonant) = (zeros.count(factors, start, stop) for factors in (orders, multiples))
    size = oscillator.size
    compared = len(orders) * isolated + 2 * len(multiples) * periodic
    seconds = compared * rates.ZERO_SECONDS + recurring * (
        rates.RECURRENCE_SECONDS + rates.RECURRENCE_MASS_SECONDS * size
    )
    seconds += 2 * resonant * (rates.RESONANCE_SECONDS + rates.RESONANCE_MASS_SECONDS * size)
    return curves * (seconds + rates.POINTS_SECONDS)


def peaks_seconds(oscillator: Oscillator, start: float, stop: float, points: int = 0) -> float:
    """Return the seconds that several harmonics add.

    They are those for the maxima of the steady motion at the points of a curve, and for finding equal maxima.
    """
    orders = oscillator.orders
    if len(orders) < 2:
        return 0.0
    highest = orders[-1] / oscillator.common_divisor
    searched = rates.PEAKS_SECONDS * math.sqrt(highest) * math.log(stop / start)
    return searched + rates.PEAK_SECONDS * highest * len(orders) * points


def setup_seconds(oscillator: Oscillator) -> float:
    """Return the seconds for finding the modes of an oscillator and making the tables of a frequency."""
    return rates.SETUP_SECONDS + rates.SETUP_MASS_SECONDS * oscillator.size**2


class SettlingEstimate(NamedTuple):
    """How trajectories settle on average."""

    periods: float
    """Forcing periods of a trajectory until it settles or is given up."""
    unsettled: float
    """Share of trajectories that do not settle and count as chaotic; 0 where the contact is free or comes to rest."""
    orbit_seconds: float
    """Seconds per trajectory for solving for its orbit and verifying it."""


def settling(oscillator: Oscillator, points: Points, max_periods: int) -> SettlingEstimate:
    """Return how the trajectories of points settle."""
    with np.errstate(divide="ignore"):
        decays = rates.SETTLING_DECAYS / (oscillator.forcing_period(points.omega) * linear.slowest_decay(oscillator))
    impacts = period_impacts(oscillator, points)
    rests = _rests(oscillator, points, impacts)
    free = points.nearer >= rates.FREE_FROM * contact_force(oscillator, points.omega)[1]
    if oscillator.size == 1:  # nothing moves while the contact rests, so the motion does not depend on its start
        free = free | rests
    to_settle = rates.MIN_PERIODS_TO_SETTLE + np.where(free, 0.0, decays)
    # more trajectories are chaotic if impacts take less energy
    power = _largest_restitution(oscillator) ** rates.UNSETTLED_POWER
    chaotic = max(rates.MIN_UNSETTLED, rates.MAX_UNSETTLED * power)
    share = np.where(free | rests, 0.0, np.where(to_settle > max_periods, 1.0, chaotic))
    periods = np.fmin(to_settle + share * max_periods, max_periods)
    unsettled = float(share.mean())
    orbit_impacts = np.fmin(impacts, rates.MAX_ORBIT_IMPACTS)
    solved = rates.ORBIT_SECONDS * oscillator.size * float((orbit_impacts**2).mean())
    tried = 1.0 - unsettled + rates.ORBITS_TRIED * unsettled
    return SettlingEstimate(
        float(periods.mean()), unsettled, tried * (solved + rates.ORBIT_NORM_SECONDS * oscillator.size**3)
    )


def chance_seconds(trajectories: float, max_periods: int, cost: float, together: int = 1) -> float:
    """Return the seconds for continuing a sample of `trajectories` chaotic trajectories, `together` side by side."""
    sample = min(rates.RUN_ON_SAMPLE, trajectories)
    period = cost / (rates.PERIODS_PER_SECOND * math.sqrt(together))
    return sample * min(rates.RUN_ON * max_periods, rates.RUN_ON_PERIODS) * period


def observed_seconds(request: ObservedRequest, oscillator: Oscillator, points: Points, periods: float) -> float:
    """Return the mean seconds for reading observables and outputs off `periods` of a motion; 0 if none is asked for."""
    if not request.observed:
        return 0.0
    outputs = len(request.outputs) + any(name.endswith("_displacement") for name in request.observables)
    impacts = float(period_impacts(oscillator, points).mean())
    panels = 0.5 * float(_cells(oscillator, points.omega).mean()) + impacts
    return rates.OBSERVED_SECONDS + periods * panels * (rates.PANEL_SECONDS + rates.PANEL_OUTPUT_SECONDS * outputs)


def branch_point_seconds(oscillator: Oscillator, impacts: float) -> float:
    """Return the seconds for a point of the branch of an orbit with so many impacts."""
    seconds = rates.BRANCH_SECONDS + rates.MULTIPLIERS_SECONDS * oscillator.size**3
    return (1.0 + impacts / rates.BRANCH_IMPACTS) * seconds


def _largest_restitution(oscillator: Oscillator) -> float:
    return max(restitutions(oscillator.restitution))


def _contact_mass(oscillator: Oscillator) -> tuple[float, float]:
    """Return the effective mass of the contact under an impulse, and the rate at which damping alone slows it."""
    if oscillator.beyond_the_chain() is not None:
        return linear.contact_mass(oscillator)
    return oscillator.masses[0], _link_damping(oscillator, 0) / oscillator.masses[0]


def _link_damping(oscillator: Oscillator, link: int) -> float:
    damping = oscillator.damping
    if isinstance(damping, list):
        return damping[link] * _damping_factor(oscillator)
    return 2.0 * damping * oscillator.stiffnesses[link]


def _damping_factor(oscillator: Oscillator) -> float:
    return 1.0 if oscillator.units == "SI" else 2.0


def _largest_row_sum(masses: list[float], links: list[float]) -> float:
    """Return the largest absolute row sum of M^-1 times a chain's matrix; the last link leads to the ground."""
    after = np.array(links)
    before = np.concatenate(([0.0], after[:-1]))
    sums = before + after
    sums[:-1] += after[:-1]
    return float(((sums + before) / np.array(masses)).max())


def _cells(oscillator: Oscillator, omega: Floats) -> Floats:
    highest = max(oscillator.orders, default=1) // oscillator.common_divisor
    min_cells = max(rates.MIN_CELLS, 2.0 * math.pi * highest)
    return np.asarray(np.maximum(min_cells, fastest_exponent(oscillator) * oscillator.forcing_period(omega)))


def _rests(oscillator: Oscillator, points: Points, impacts: Floats) -> NDArray[np.bool_]:
    """Return at which points the contact comes to rest; `impacts` are those of `period_impacts`."""
    return np.asarray(impacts >= _impacts_to_rest(oscillator, points))


def _impacts_to_rest(oscillator: Oscillator, points: Points) -> Floats:
    """Return the number of impacts until a chatter on each stop has ended in rest."""
    restitution = _largest_restitution(oscillator)
    if 0.0 < restitution < 1.0:
        return points.stop_count * (1.0 + math.log(rates.CHATTER_REST) / math.log(restitution))
    return points.stop_count * (1.0 if restitution == 0.0 else math.inf)


def _sampled_values(values: Grid) -> list[float]:
    every = grid_values(values)
    indices = np.linspace(0, len(every) - 1, min(len(every), rates.SAMPLED_SIDE)).round().astype(int)
    sampled: list[float] = every[indices].tolist()
    return sampled

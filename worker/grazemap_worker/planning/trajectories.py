"""The cost of trajectories: their forcing periods, and the bytes of their samples."""

from __future__ import annotations

from grazemap.wire import Estimate, TrajectoriesRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import Points, longest_at_point, observed_seconds, period_cost, setup_seconds
from grazemap_worker.planning.plan import Plan
from grazemap_worker.planning.planning import BYTES_PER_NUMBER, Count, Limits, Planning


def _plan(request: TrajectoriesRequest) -> Plan:
    periods = float(len(request.states) * (request.transient_periods + request.periods))
    seconds = periods * period_cost(request.oscillator, request.omega, request.clearance) / rates.PERIODS_PER_SECOND
    size = request.oscillator.size
    sample = size * (rates.SAMPLE_MASS_SECONDS + rates.SAMPLE_SQUARE_SECONDS * size)
    seconds += setup_seconds(request.oscillator) + len(request.states) * request.samples * sample
    points = Points.of([(request.omega, request.clearance)])
    seconds += len(request.states) * observed_seconds(request, request.oscillator, points, request.periods)
    return Plan(estimate=Estimate(periods=periods, seconds=seconds))


def _counts(request: TrajectoriesRequest, limits: Limits) -> list[Count]:
    states, periods = len(request.states), request.periods + request.transient_periods
    samples = states * request.samples
    sampled = "/samples_per_period" if request.times is None else "/times"
    if states * periods > limits.tile_periods >= periods:
        return [Count("/initial", "periods", states * periods, limits.tile_periods)]
    # the time, and displacement and velocity of every mass
    sample_bytes = BYTES_PER_NUMBER * (1 + 2 * request.oscillator.size)
    return [
        Count("/periods", "periods", states * periods, limits.tile_periods),
        Count(sampled, "samples", samples, limits.points),
        Count(sampled, "bytes", samples * sample_bytes, limits.result_bytes),
    ]


PLANNING = Planning(_plan, _counts, longest_at_point, kernels="trajectories")

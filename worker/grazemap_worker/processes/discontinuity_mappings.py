"""The process discontinuity-mappings: the effect of a weak impact near a graze, and later returns of the motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from grazemap import results
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import DiscontinuityMappingsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.costs import period_cost
from grazemap_worker.planning.limits import BYTES_PER_NUMBER, Count, RequestLimits
from grazemap_worker.processes.codimension_two_points import varied_stops
from grazemap_worker.processes.conversion import STOPS, core_oscillator, without_none
from grazemap_worker.processes.process import Process, Report


def _longest_period_cost(request: DiscontinuityMappingsRequest) -> float:
    return period_cost(request.oscillator, request.omega, max(request.overshoot))


def _seconds(request: DiscontinuityMappingsRequest) -> float:
    cost = _longest_period_cost(request)
    # A return takes half a forcing period if both stops are grazed at once, and otherwise a whole period. Each half
    # period is estimated at the cost of a whole one.
    half_periods = request.returns * (1 if request.are_alike else 2)
    overshoot_seconds = rates.OVERSHOOT_SECONDS + rates.OVERSHOOT_MASS_SECONDS * request.oscillator.size
    overshoot_seconds += half_periods * cost / rates.PERIODS_PER_SECOND
    return rates.MAPPING_SECONDS + len(request.overshoot) * overshoot_seconds


def _counts(request: DiscontinuityMappingsRequest, limits: RequestLimits) -> list[Count]:
    # At every return, the state of the map and the state of the simulated motion. A return counts as a whole period,
    # also if it takes half of one.
    numbers = 2 * (2 * request.oscillator.size + 1) * (request.returns + 1) * len(request.overshoot)
    return [
        Count("/returns", "bytes", numbers * BYTES_PER_NUMBER, limits.result_bytes),
        Count("/returns", "periods", len(request.overshoot) * request.returns, limits.tile_periods),
    ]


def compute(request: DiscontinuityMappingsRequest, report: Report) -> ClassDocument:
    """Return the grazing point, the mapped states and their errors, Jacobians, the sequence xi, and later returns.

    The sequence xi, of `recurrence_sequence`, tells at which return an impact recurs. Raises CoreError.
    """
    from grazemap_core.errors import ParameterError
    from grazemap_core.grazing.discontinuity_mapping import (
        beyond_stop,
        exact_mapping,
        largest_overshoot,
        leading_mapping,
        mapping_error,
    )
    from grazemap_core.grazing.poincare_map import compare_returns, return_jacobian
    from grazemap_core.grazing.point import grazing_point
    from grazemap_core.grazing.recurrence import next_contact, recurrence_sequence

    oscillator = core_oscillator(request.oscillator)
    stop = STOPS[request.stop]
    varied = next(each for each in varied_stops(request) if each.alike or each.stop == stop)
    varied = replace(varied, stop=stop)
    point = grazing_point(oscillator, request.omega, varied)
    overshoot = np.array(request.overshoot)
    largest = largest_overshoot(point)
    if np.any(overshoot > largest):
        raise ParameterError("overshoot", f"must be at most {largest:.6g}, the end of the mapping's domain")
    if np.any(overshoot >= point.amplitude):
        raise ParameterError("overshoot", f"must be below {point.amplitude:.6g}, the amplitude of the grazing motion")
    sequence = recurrence_sequence(point, request.returns)
    omegas, relative_overshoot = np.full(len(overshoot), request.omega), overshoot / point.amplitude
    contact = next_contact(oscillator, omegas, relative_overshoot, request.returns, varied)
    errors = mapping_error(point, overshoot)

    state_size = len(point.state)
    start_offsets, displacement = np.empty((len(overshoot), state_size)), np.empty((len(overshoot), state_size))
    comparisons = []
    # the returns of the grazing motion itself, which has no deviation, when the stop is nearer by the overshoot
    no_deviation = np.zeros(state_size)
    for k, depth in enumerate(overshoot.tolist()):
        report(k, len(overshoot))
        start_offsets[k] = start = beyond_stop(point, depth)
        exact = request.order == "exact"
        displacement[k] = exact_mapping(point, start).displacement if exact else leading_mapping(point, start) - start
        comparisons.append(compare_returns(point, no_deviation, request.returns, depth, request.order))
    state = point.state + start_offsets
    return document_of(
        results.DiscontinuityMapping,
        sequence,
        omega=request.omega,
        clearance=point.clearance,
        stop=stop,
        grazing=point,
        overshoot=overshoot,
        largest_overshoot=largest,
        state=state,
        mapped=state + displacement,
        displacement=displacement,
        size=errors.displacement,
        error=errors.leading,
        error_of_second_order=errors.second,
        fitted_order=errors.leading_order,
        fitted_order_of_second=errors.second_order,
        jacobian=return_jacobian(point),
        # the next return is at the other stop if both stops are grazed at once, and otherwise at the same stop
        jacobian_opposite=return_jacobian(point.next()),
        next_contact=contact,
        **without_none({"margin": point.margin if np.isfinite(point.margin) else None}),
        returns=document_of(
            results.Returns,
            mapped=np.array([returns.mapped.deviation for returns in comparisons]),
            simulated=np.array([returns.simulated.deviation for returns in comparisons]),
            mapped_overshoot=np.array([returns.mapped.overshoot for returns in comparisons]),
            simulated_overshoot=np.array([returns.simulated.overshoot for returns in comparisons]),
            error=np.array([returns.error for returns in comparisons]),
        ),
    )


PROCESS = Process(
    whole=compute, seconds=_seconds, counts=_counts, longest_period_cost=_longest_period_cost, kernels="orbits"
)

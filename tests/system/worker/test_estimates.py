"""Estimates against the processor time: one request of each process, and those that were a hundred times too low."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from benchmarks.estimates import seconds_of
from grazemap.wire import Oscillator, linear, parse_request
from grazemap_worker.planning import RequestLimits, costs
from grazemap_worker.processes import IMPLEMENTATIONS

# Machines differ, and other processes use the same caches; one of three measurements has to be within it.
MOST_RATIO = 12.0
POINT = {"omega": 0.29, "clearance": 1.6}
WINDOW = {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}
FOUR = {"period": 1, "stops": [1, 1, -1, -1]}


def chain(masses: int, restitution: float = 0.8) -> dict[str, Any]:
    """Equal masses."""
    lists = {"masses": [1.0] * masses, "stiffnesses": [1.0] * masses, "forcing": [1.0] + [0.0] * (masses - 1)}
    return {**lists, "damping": 0.05, "restitution": restitution}


def grid(points: int) -> dict[str, Any]:
    """A grid over the window."""
    return {name: {**ends, "points": points} for name, ends in WINDOW.items()}


def side(quantity: str) -> dict[str, Any]:
    """A side of a basin."""
    return {"quantity": quantity, "values": {"start": -1.0, "stop": 1.0, "points": 64}}


REQUESTS: dict[str, tuple[str, dict[str, Any]]] = {
    "grazing curve": ("grazing-curves", {"omega": {"start": 0.1, "stop": 1.0, "points": 20_000}}),
    "codimension-two points": ("codimension-two-points", {"omega": {"start": 0.1, "stop": 0.4}, "max_order": 40}),
    "dense zeros": (
        "codimension-two-points",
        {"oscillator": {"damping": 0.001}, "omega": {"start": 0.01, "stop": 0.01045}, "max_order": 40},
    ),
    "dense resonances": (
        "codimension-two-points",
        {"omega": {"start": 0.03, "stop": 0.032}, "max_order": 2, "max_multiple": 40},
    ),
    "discontinuity mapping": ("discontinuity-mappings", {"omega": 0.29, "overshoot": [1e-6, 1e-4, 1e-3]}),
    "trajectory": ("trajectories", {**POINT, "periods": 5000, "samples_per_period": 1}),
    "samples": ("trajectories", {**POINT, "periods": 100, "samples_per_period": 2000}),
    "restitution 1 between close stops": (
        "trajectories",
        {"omega": 0.29, "clearance": 1e-4, "oscillator": {"restitution": 1.0}, "periods": 30, "samples_per_period": 1},
    ),
    "64 masses": (
        "trajectories",
        {"omega": 0.29, "clearance": 1e-3, "oscillator": chain(64, 1.0), "periods": 10, "samples_per_period": 1},
    ),
    "bifurcation diagram": (
        "bifurcation-diagrams",
        {"vary": "clearance", "range": {"start": 1.3, "stop": 2.0, "points": 20}, "omega": 0.29},
    ),
    "map": ("unfolding-maps", grid(16)),
    "diagram": ("unfolding-diagrams", {**grid(12), "max_periods": 200}),
    "basins": (
        "basins",
        {**POINT, "max_periods": 200, "horizontal": side("displacement"), "vertical": side("velocity")},
    ),
    "basin fractions": (
        "basin-fractions",
        {"vary": "clearance", "range": {"start": 1.3, "stop": 2.0, "points": 20}, "omega": 0.29, "max_periods": 200},
    ),
    "periodic orbit": ("periodic-orbits", {**POINT, "transient_periods": 5000}),
    "orbit between close stops": ("periodic-orbits", {"omega": 0.29, "clearance": 0.01}),
    "long branch": (
        "orbit-branches",
        {"omega": 0.29, "clearance": 1.6, "motion": FOUR, "range": {"start": 0.1, "stop": 3}, "max_points": 10_000},
    ),
    "branch": ("orbit-branches", {**POINT, "motion": FOUR, "range": {"start": 1.5, "stop": 1.7}}),
    "bifurcation curves": ("bifurcation-curves", {**WINDOW, "points": 100}),
    "proof": ("proofs", {"statement": {"kind": "orbit", **POINT, "motion": FOUR}}),
}


def test_a_batch_of_dense_zeros_is_not_small() -> None:
    for k in range(20):
        start = 0.003 + 1e-7 * k
        body = {"oscillator": {"damping": 0.001}, "omega": {"start": start, "stop": 0.003135}}
        request = parse_request("codimension-two-points", {**body, "max_order": 200, "max_multiple": 100})
        plan = IMPLEMENTATIONS["codimension-two-points"].plan(request)
        assert plan.lane == "long"
        assert plan.estimate.seconds > 20.0


# the last one has a contact between two masses, and modes that are coupled by dampers
STRUCTURES: list[dict[str, Any]] = [
    {},
    {"damping": 0.001},
    chain(8),
    {**chain(5), "contact": [2, 3], "damping": [0.01, 0.2, 0.003, 0.05, 0.1]},
]


@pytest.mark.parametrize("described", STRUCTURES)
def test_the_zeros_of_the_impulse_response_are_counted_without_the_core(described: dict[str, Any]) -> None:
    oscillator = Oscillator.model_validate(described)
    mass, damping, stiffness = linear.matrices(oscillator)
    size, row = len(mass), np.array(oscillator.contact_row)
    inner, viscous = np.linalg.solve(mass, stiffness), np.linalg.solve(mass, damping)
    exponents, vectors = np.linalg.eig(np.block([[np.zeros((size, size)), np.eye(size)], [-inner, -viscous]]))
    kicked = np.concatenate([np.zeros(size), np.linalg.solve(mass, row)])
    amplitudes = (row @ vectors[:size]) * np.linalg.solve(vectors, kicked)
    longest = 60.0 * math.pi
    times = np.arange(0.01, longest, 0.01)
    slowest = exponents.real.max()
    response = (amplitudes * np.exp(np.outer(times, exponents - slowest))).sum(axis=1).real
    counted = np.count_nonzero(np.diff(np.sign(response)))
    zeros = costs.Zeros(oscillator, longest, math.pi)
    # those of order 1 to 60 between omega 0.5 and 1.0: all times from pi on
    expected, _ = zeros.count(math.pi * np.arange(1.0, 31.0), 0.5, 1.0)
    assert expected == pytest.approx(counted, rel=0.35, abs=3)


def test_the_times_of_zeros_reach_as_far_as_zeros_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """With both stops at once, the last multiple in the list is not the largest one."""
    process, body = REQUESTS["dense resonances"]
    request = parse_request(process, body)
    estimate = IMPLEMENTATIONS[process].plan(request).estimate.seconds

    class Longer(costs.Zeros):
        def __init__(self, oscillator: Oscillator, longest: float, shortest: float) -> None:
            super().__init__(oscillator, 2.0 * longest, shortest)

    monkeypatch.setattr(costs, "Zeros", Longer)
    assert IMPLEMENTATIONS[process].plan(request).estimate.seconds == pytest.approx(estimate, rel=0.05)


def test_the_periods_of_an_orbit_are_those_that_are_simulated() -> None:
    settled = parse_request("periodic-orbits", {**POINT, "transient_periods": 0, "max_period": 50})
    assert IMPLEMENTATIONS["periodic-orbits"].plan(settled).estimate.periods == 100.0
    body = {**POINT, "motion": FOUR, "transient_periods": 10**9}
    known = parse_request("periodic-orbits", body)  # no trajectory is needed
    limits = RequestLimits(points=1, pixels=1, adaptive_pixels=1, tile_periods=1, result_bytes=1)
    assert IMPLEMENTATIONS["periodic-orbits"].counts(known, limits) == []


LONG = ("dense resonances", "orbit between close stops", "long branch", "basin fractions", "bifurcation diagram")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.thorough) if name in LONG else name for name in REQUESTS]
)
def test_an_estimate_is_within_a_factor_of_the_processor_time(name: str) -> None:
    process, body = REQUESTS[name]
    estimate = IMPLEMENTATIONS[process].plan(parse_request(process, body)).estimate.seconds
    seconds_of(process, body)  # loads the kernels
    ratios = (seconds_of(process, body) / estimate for _ in range(3))
    assert any(1.0 / MOST_RATIO < ratio < MOST_RATIO for ratio in ratios)

"""A forcing period is 2 pi/(p omega), with the common divisor p of the orders in which the machine is forced."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from grazemap.wire import Oscillator, notes_on, parse_request
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator as CoreOscillator
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.trajectories import trajectory
from grazemap_worker.processes import IMPLEMENTATIONS
from grazemap_worker.processes.conversion import core_oscillator
from tests.slow.one_period import compared, computed, declared, requests, systems

MACHINES = systems()
REQUESTS = [*requests(MACHINES["a chain"])]


FIRST = [k for k, (process, _) in enumerate(REQUESTS) if process not in [name for name, _ in REQUESTS[:k]]]


@pytest.mark.parametrize(
    ("process", "body"),
    [
        pytest.param(*entry, id=f"{k}-{entry[0]}", marks=() if k in FIRST else pytest.mark.thorough)
        for k, entry in enumerate(REQUESTS)
    ],
)
def test_results_are_those_of_the_forces_own_frequency(process: str, body: dict[str, Any]) -> None:
    own = computed(process, body)
    assert [compared(process, body, times, own) for times in (2, 3)] == [[], []]


def chain(*forcing: dict[str, Any], **more: Any) -> dict[str, Any]:
    each = [{"amplitude": [1.0, 0.0, 0.0], **force} for force in forcing]
    return {"oscillator": {"forcing": each, **more}}


def machine(order: int) -> CoreOscillator:
    return core_oscillator(Oscillator.model_validate(chain({"harmonic": order})["oscillator"]))


def test_only_orders_whose_exact_sum_is_not_zero_count() -> None:
    def divisor(*forcing: dict[str, Any], **more: Any) -> int:
        oscillator = Oscillator.model_validate(chain(*forcing, **more)["oscillator"])
        assert core_oscillator(oscillator).at_own_period[1] == oscillator.common_divisor
        return oscillator.common_divisor

    nothing, third = {"amplitude": [0.0, 0.0, 0.0]}, [0.3, 0.0, 0.0]
    assert divisor({"harmonic": 4}, {"harmonic": 6}) == 2
    assert divisor({"harmonic": 4}, {"harmonic": 3, **nothing}) == 4
    assert divisor({"harmonic": 4}, {"harmonic": 3}) == 1
    assert divisor({"harmonic": 3, **nothing}) == 1
    # a force that the contact sees through no spring counts
    assert divisor({"harmonic": 4}, {"harmonic": 6, "amplitude": [0.0, 0.0, 1.0]}) == 2
    # in double precision these do not add up to zero at this phase
    assert divisor({"harmonic": 4}, *({"amplitude": [a, 0.0, 0.0], "phase": third} for a in (1.0, 2.0, -3.0))) == 4
    # these do in double precision, and not exactly
    assert divisor({"harmonic": 4}, *({"amplitude": [a, 0.0, 0.0]} for a in (1e16, 1.0, -1e16))) == 1
    assert divisor({"harmonic": 4}, {}, {"amplitude": [-1.0, 0.0, 0.0], "law": "unbalance"}) == 1
    assert divisor({"harmonic": 4}, {}, {"phase": [0.1, 0.0, 0.0], "amplitude": [-1.0, 0.0, 0.0]}) == 1


def test_a_base_that_the_forces_cancel_does_not_count() -> None:
    base = {"amplitude": 0.5, "stops_move": True}
    cancels = {"amplitude": [-0.5, -5.0, -5.0], "law": "unbalance"}
    for forces, expected in (([{"harmonic": 2}], 1), ([{"harmonic": 2}, cancels], 2)):
        oscillator = Oscillator.model_validate(chain(*forces, base=base)["oscillator"])
        assert oscillator.common_divisor == core_oscillator(oscillator).at_own_period[1] == expected
    damped = {"amplitude": 0.5, "stops_move": False}
    stiff = {"amplitude": [0.0, 0.0, -2.5]}  # cancels the spring of the ground, not its damper
    of = [Oscillator.model_validate(chain({"harmonic": 2}, stiff, base=damped)["oscillator"])]
    of += [Oscillator.model_validate(chain({"harmonic": 2}, stiff, base=damped, damping=0.0)["oscillator"])]
    assert [oscillator.common_divisor for oscillator in of] == [1, 2]


def test_functions_of_the_core_take_and_return_phases_of_the_declared_frequency() -> None:
    of = {
        times: core_oscillator(Oscillator.model_validate(chain({"harmonic": times})["oscillator"])) for times in (1, 2)
    }
    runs = {
        times: trajectory(oscillator, 0.25 / times, 1.2, phase=1.0 / times, periods=8, transient_periods=400)
        for times, oscillator in of.items()
    }
    own, half = runs[1], runs[2]
    assert own.final is not None
    assert half.final is not None
    np.testing.assert_array_equal(own.displacement, half.displacement)
    assert half.final.phase == own.final.phase / 2
    impacts = {times: impacts_of(run) for times, run in runs.items()}
    np.testing.assert_array_equal(impacts[2].whole.phases, impacts[1].whole.phases / 2)
    orbits = {times: periodic_orbit(of[times], 0.25 / times, 1.2, impacts[times]) for times in of}
    assert orbits[2].omega == 0.125
    assert orbits[2].label == orbits[1].label
    assert (orbits[2].symmetric, orbits[2].verified) == (orbits[1].symmetric, True)
    np.testing.assert_array_equal(orbits[2].impacts.phases, orbits[1].impacts.phases / 2)
    np.testing.assert_array_equal(orbits[2].multipliers, orbits[1].multipliers)
    # a sequence that was made of these phases is as good as the one that was returned
    again = periodic_orbit(of[2], 0.125, 1.2, type(impacts[2]).create(impacts[2].period, *_lists(impacts[2].whole)))
    np.testing.assert_allclose(again.impacts.whole.phases, orbits[2].impacts.whole.phases, rtol=1e-12)


def _lists(sequence: Any) -> tuple[Any, Any, Any]:
    return sequence.stops, sequence.phases, sequence.velocities


def test_phases_may_not_span_a_period() -> None:
    def motion(last: float) -> dict[str, Any]:
        return {"period": 1, "stops": [1, -1], "phases": [0.0, last], "velocities": [1.0, -1.0]}

    body = {**chain({"harmonic": 2}), "omega": 0.25, "clearance": 1.2}
    parse_request("periodic-orbits", {**body, "motion": motion(0.99 * math.pi)})
    with pytest.raises(ValueError, match="phases"):
        parse_request("periodic-orbits", {**body, "motion": motion(1.01 * math.pi)})


def test_times_end_with_the_periods() -> None:
    body = {**chain({"harmonic": 2}), "omega": 0.25, "clearance": 1.2, "periods": 1}
    parse_request("trajectories", {**body, "times": [3.99 * math.pi]})
    with pytest.raises(ValueError, match="record"):
        parse_request("trajectories", {**body, "times": [4.01 * math.pi]})


@pytest.mark.parametrize(("process", "body"), REQUESTS, ids=[name for name, _ in REQUESTS])
def test_a_note_says_what_a_period_is_and_the_estimate_is_the_same(process: str, body: dict[str, Any]) -> None:
    here, there = (parse_request(process, of) for of in (body, declared(body, 2)))
    assert "forcing-period" not in [note.code for note in notes_on(here)]
    assert [note.code for note in notes_on(there)].count("forcing-period") == (process != "structures")
    plans = [IMPLEMENTATIONS[process].plan(of).estimate for of in (here, there)]
    assert plans[1].periods == plans[0].periods
    assert plans[1].seconds == pytest.approx(plans[0].seconds, rel=1e-9)


def test_a_map_of_the_core_has_the_motions_of_the_forces_own_frequency() -> None:
    of = [machine(times) for times in (1, 2)]
    planes = [
        Plane.of(oscillator, np.array([0.25, 0.28]) / (1 + k), np.linspace(1.2, 1.8, 3))
        for k, oscillator in enumerate(of)
    ]
    maps = [unfolding_map_tile(plane, MapSettings(max_periods=200)) for plane in planes]
    for name, values in maps[0].items():
        np.testing.assert_array_equal(values, maps[1][name], err_msg=name)
    assert planes[0].mirrors
    assert planes[1].mirrors

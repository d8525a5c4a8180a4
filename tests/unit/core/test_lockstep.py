"""The lockstep kernel against multi-precision arithmetic, and against the scalar kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.ensemble import Ensemble, first_impacts
from grazemap_core.contact.kernels import half_period
from grazemap_core.contact.kernels.runs import CHATTER, EVENT_COLUMNS, EVENT_COUNT, KIND, OK, new_run
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.kernels.lane_scheduler import settle_column
from grazemap_core.maps.kernels.lane_tables import LANES
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.runner import Runner
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.start import forced_oscillator, initial_state, start
from tests.oracles.impact_accuracy import (
    LOCKSTEP_PERIODS,
    Accuracy,
    compare_lockstep,
    lockstep_amplification,
    plane_points,
)
from tests.oracles.steady_displacements import contact_amplitude
from tests.support.general_systems import random_oscillator
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST

pytestmark = KERNELS_FIRST

Floats = NDArray[np.float64]

FIRST = 20
NUDGE = 1e-9


def alone(oscillator: Oscillator, omega: float, clearances: Floats, periods: int) -> list[Floats]:
    """The first events of every clearance by the scalar kernel, one row each."""
    rows = []
    for clearance in clearances.tolist():
        forced = forced_oscillator(oscillator, omega, clearance)
        begun = start(forced, initial_state(forced, None, None, 0.0))
        run = new_run(oscillator.size, len(forced.structure.orders), 4 * FIRST)
        run.u[:] = begun.run.u
        for half in range(2 * periods):
            assert half_period.run_half(begun.forced, forced.stops, run, half) == OK
            if run.cursor[EVENT_COUNT] >= 2 * FIRST:
                break
        rows.append(run.events[: min(run.cursor[EVENT_COUNT], FIRST), :EVENT_COLUMNS])
    return rows


def compare(oscillator: Oscillator, omega: float, clearances: Floats, periods: int) -> float:
    """Assert that both kernels see the same events; return the largest difference over the round-off to expect."""
    together = first_impacts(oscillator, omega, clearances, periods, FIRST)
    assert together.whole.all()
    half_period = np.pi / omega
    worst = 0.0
    for lane, (events, nudged) in enumerate(
        zip(
            alone(oscillator, omega, clearances, periods),
            alone(oscillator, omega, clearances * (1.0 + NUDGE), periods),
            strict=True,
        )
    ):
        count = len(events)
        assert np.count_nonzero(together.half[lane] >= 0) == count, (omega, clearances[lane])
        # how many bounces of a complete chatter are followed depends on round-off
        chatters = np.flatnonzero((events[:, KIND] == CHATTER) | (together.kind[lane, :count] == CHATTER))
        count = min(count, chatters[0]) if len(chatters) else count
        np.testing.assert_array_equal(together.stop[lane, :count], events[:count, 2])
        np.testing.assert_array_equal(together.kind[lane, :count], events[:count, KIND])
        time = together.half[lane, :count] * half_period + together.time[lane, :count]
        expected = events[:count, 0] * half_period + events[:count, 1]
        same = min(count, len(nudged))
        shift = abs(nudged[:same, 0] * half_period + nudged[:same, 1] - expected[:same]) / NUDGE
        if same == 0:
            continue
        amplification = np.maximum.accumulate(shift + expected[:same])
        worst = max(worst, float(np.max(abs(time - expected)[:same] / (2.0**-52 * amplification))))
    return worst


def test_random_points_of_the_plane_equal_the_scalar_kernel() -> None:
    rng = np.random.default_rng(0)
    worst = []
    for omega in rng.uniform(0.2, 1.5, size=16):
        clearances = rng.uniform(0.3, 1.2, size=125) * contact_amplitude(DEFAULT, omega)
        worst.append(compare(DEFAULT, omega, clearances, 60))
    assert max(worst) < 250.0  # clearances down to 0.3 A: round-off is relative to A, the nudge to the clearance


@pytest.mark.parametrize("masses", [1, 3, 6])
def test_random_chains_equal_the_scalar_kernel(masses: int) -> None:
    rng = np.random.default_rng(masses)
    for case in range(3):
        oscillator = Oscillator.create(
            np.exp(rng.normal(size=masses)),
            np.exp(rng.normal(size=masses)),
            rng.uniform(0.01, 0.1) if case % 2 else list(rng.uniform(0.01, 0.3, size=masses)),
            rng.normal(size=masses),
            float(rng.choice([0.0, 0.3, 0.6, 0.8, 0.95])),
        )
        omega = rng.uniform(0.2, 2.0)
        clearances = rng.uniform(0.3, 1.2, size=20) * contact_amplitude(oscillator, omega)
        assert compare(oscillator, omega, clearances, 40) < 1000.0, case


def same(ensemble: Ensemble, other: Ensemble) -> None:
    for name, value in ensemble._asdict().items():
        np.testing.assert_array_equal(value, getattr(other, name), err_msg=name)


def test_one_kernel_carries_the_lanes_of_any_number_of_masses() -> None:
    """Its arguments have the same types, also for dense matrices, so nothing is compiled for a number of masses."""
    whole: Any = getattr(settle_column, "whole", settle_column)
    oscillators = [Oscillator.create([1.0] * n, [1.0] * n, 0.1, [1.0] + [0.0] * (n - 1), 0.8) for n in (3, 1, 2, 6, 9)]
    oscillators.append(random_oscillator(np.random.default_rng(15), 15))
    compiled = []
    for oscillator in oscillators:
        Runner(oscillator, RunSettings(max_periods=4, max_period=2)).compile_lockstep()
        compiled.append(len(whole.signatures))
    assert compiled == [compiled[0]] * len(oscillators)


@pytest.mark.parametrize("omega", [0.22, 0.29, 0.5])
def test_the_bytes_of_a_lane_do_not_depend_on_the_other_lanes(omega: float) -> None:
    rng = np.random.default_rng(1)
    clearances = rng.uniform(0.3, 1.1, size=LANES + 37) * contact_amplitude(DEFAULT, omega)
    whole = first_impacts(DEFAULT, omega, clearances, 30, 60)
    order = rng.permutation(len(clearances))
    shuffled = first_impacts(DEFAULT, omega, clearances[order], 30, 60)
    same(Ensemble(*(value[order] for value in whole)), shuffled)
    few = order[:3]
    same(Ensemble(*(value[few] for value in whole)), first_impacts(DEFAULT, omega, clearances[few], 30, 60))


def test_a_map_counts_the_periods_that_it_computed() -> None:
    clearances = np.linspace(1.3, 2.1, LANES + 5)
    codes, _ = PlaneRunner(
        Plane.of(DEFAULT, np.array([0.28]), clearances), RunSettings(30, 8, early=False, linearised=False)
    ).grid()
    assert (codes[lane_state.HALVES_RUN] == 60).all()
    ensemble = first_impacts(DEFAULT, 0.28, clearances, 30, 0)
    np.testing.assert_array_equal(codes[lane_state.IMPACTS, :, 0, 0], ensemble.impacts)


def test_random_points_of_the_plane_have_the_impacts_of_48_digits_to_a_few_roundings_of_the_inputs() -> None:
    points = 0
    for omega, clearances in plane_points(DEFAULT, 20, 10):
        amplification = lockstep_amplification(DEFAULT, omega, clearances)
        for accuracy in compare_lockstep(DEFAULT, omega, clearances, amplification):
            assert accuracy.complete
            assert accuracy.worst < 1e-15, accuracy.error / accuracy.amplification
            points += 1
    assert points == 200


def test_the_rounding_estimate_of_these_points_agrees_with_48_digits() -> None:
    omega, clearances = plane_points(DEFAULT, 1, 2)[0]
    quick = lockstep_amplification(DEFAULT, omega, clearances)
    for lane, accuracy in enumerate(compare_lockstep(DEFAULT, omega, clearances)):
        assert len(accuracy.amplification) == FIRST
        np.testing.assert_allclose(quick[lane], accuracy.amplification, rtol=1e-3)


def test_the_comparison_sees_a_missing_an_additional_and_a_late_impact() -> None:
    omega, clearances = plane_points(DEFAULT, 1, 1)[0]
    right = first_impacts(DEFAULT, omega, clearances, LOCKSTEP_PERIODS, FIRST + 1)
    few = np.flatnonzero(right.half[0] < 6)
    late = right.time.copy()
    late[0, 3] += 1e-12

    def planted(ensemble: Ensemble, columns: object) -> list[Accuracy]:
        parts = {name: getattr(ensemble, name)[:, columns] for name in ("half", "time", "stop", "velocity", "kind")}
        return compare_lockstep(DEFAULT, omega, clearances, np.ones((1, FIRST)), ensemble._replace(**parts))

    assert planted(right, slice(FIRST))[0].complete
    assert not planted(right, np.delete(np.arange(FIRST + 1), 5))[0].complete
    assert not planted(right, np.delete(np.arange(FIRST), FIRST - 1))[0].complete
    assert not planted(right, np.insert(np.arange(FIRST - 1), 5, 5))[0].complete
    assert not planted(right, few)[0].complete
    assert planted(right._replace(time=late), slice(FIRST))[0].worst > 9e-13

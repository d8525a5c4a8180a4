"""Which points of maps are sensitive: round-off may have decided on the way whether mass 1 touches a stop."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb
from numpy.typing import NDArray

from grazemap_core.codes import ROUNDING_DECIDES
from grazemap_core.contact.kernels.cells import reference_at
from grazemap_core.contact.kernels.runs import (
    CHATTER,
    EVENT_COLUMNS,
    EVENT_COUNT,
    HALF,
    IMPACT,
    KIND,
    MIN_GAP,
    MIN_SPEED,
    OK,
    STOP,
    TIME,
    VELOCITY,
    new_run,
)
from grazemap_core.maps.kernels.first_pass import LANE_BLOCK
from grazemap_core.maps.kernels.lane_errors import begin_error, forget_error
from grazemap_core.maps.kernels.lane_tables import SHARED_TABLES, LaneModel, lane_tables
from grazemap_core.maps.kernels.lane_tangents import (
    carry_changes,
    count_impacts,
    lane_tangents,
    save_lane_starts,
    steepest_in_run,
)
from grazemap_core.maps.kernels.lanes import lanes, start_lane
from grazemap_core.maps.kernels.lockstep import Engine, run_half
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.runner import impulse_blocks, shared_model
from grazemap_core.maps.tolerances import ERROR_SAFETY
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit.compiled import kernel
from grazemap_core.numerics.jit.record_references import reference
from grazemap_core.simulation.start import forced_oscillator, initial_state
from grazemap_core.simulation.start import start as begin
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.slow.resolved_points import ONE_MASS, SENSITIVE
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST

Floats = NDArray[np.float64]
HALVES = 60


@kernel
def run_half_with_changes(engine, tangents, half):
    """As the columns of a map do: numba's lookup of tables needs references."""
    engine, tangents = reference(engine), reference(tangents)
    save_lane_starts(engine.group, tangents, LANE_BLOCK)
    run_half(engine, half, LANE_BLOCK)
    count_impacts(engine.group, tangents, LANE_BLOCK)
    carry_changes(engine, tangents, half, 0, LANE_BLOCK)


def run_with_error(oscillator: Oscillator, omega: float, clearance: float) -> tuple[Floats, Floats]:
    """The impacts from rest, and the estimated error W at the end of every half period."""
    size = oscillator.size
    forced = forced_oscillator(oscillator, omega, clearance)
    begun = begin(forced, initial_state(forced, None, None, 0.0))
    problem = begun.forced.free
    group, tangents = lanes(size, 50 * HALVES), lane_tangents(size, 1, 0)
    start_lane(group, 0, problem, forced.stops, begun.run.u)
    forget_error(tangents.errors, 0)
    begin_error(problem.frequency, tangents.errors, 0)
    blocks = impulse_blocks(modal_model(oscillator), False)
    models = shared_model(LaneModel(begun.forced, lane_tables(begun.forced), blocks))
    engine = Engine(size, models, SHARED_TABLES, group, new_run(size, 1, 50 * HALVES))
    widths = []
    for half in range(HALVES):
        run_half_with_changes(engine, tangents, half)
        assert group.status[0] == OK
        widths.append(np.sqrt(tangents.errors.square[0]))
        group.tally[:] = 0.0
        group.tally[MIN_GAP], group.tally[MIN_SPEED] = np.inf, np.inf
    return group.events[0, : group.contacts.cursor[0, EVENT_COUNT]].copy(), np.array(widths)


@pytest.mark.thorough
@pytest.mark.parametrize("clearance", [0.9, 1.35, 1.7])
def test_the_error_is_the_one_estimated(clearance):
    """Against 60 digits: the time by which an impact differs, times its speed, is below W with its safety factor."""
    oscillator, omega = DEFAULT, 0.28
    impacts, widths = run_with_error(oscillator, omega, clearance)
    exact = GeneralOracle.between(oscillator, omega, clearance, digits=60)
    exact.run(len(impacts) + 1, HALVES * np.pi / omega)
    largest = 0.0
    for impact, time, speed in zip(impacts, exact.times, exact.speeds, strict=False):
        half = int(impact[HALF])
        width = max(widths[half], widths[max(half - 1, 0)])
        if ERROR_SAFETY * width > 1e-4 * clearance:
            break
        assert impact[VELOCITY] == pytest.approx(float(speed), abs=1e-3)
        with digits(60):
            late = float(half * arb.pi() / arb(omega) + arb(float(impact[TIME])) - time)
        largest = max(largest, abs(late * impact[VELOCITY]) / width)
    assert 0.01 < largest < ERROR_SAFETY


@pytest.mark.parametrize(
    ("oscillator", "omega", "clearance"),
    [SENSITIVE[:3], pytest.param(*ONE_MASS[:3], marks=KERNELS_FIRST)],
    ids=["three masses", "one mass"],
)
def test_a_long_chaotic_transient_is_sensitive(oscillator, omega, clearance):
    tile = unfolding_map_tile(Plane.of(oscillator, np.array([omega]), np.array([clearance])))
    assert tile["sensitive"][0, 0]
    assert not tile["verified"][0, 0]
    assert tile["reason"][0, 0] == ROUNDING_DECIDES
    assert tile["transient_growth"][0, 0] > 30.0


def test_hardly_any_point_of_the_papers_map_is_sensitive():
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.linspace(0.26, 0.3, 4), np.linspace(1.3, 2.0, 64)))
    periodic = tile["kind"] == 1
    share = tile["sensitive"][periodic].mean()
    assert share < 0.05
    assert (tile["verified"] | tile["sensitive"] | (tile["reason"] > 0))[periodic].all()
    captured = tile["verified"] | (tile["reason"] == ROUNDING_DECIDES)
    assert (np.isfinite(tile["transient_growth"]) == captured).all()


@pytest.mark.parametrize(
    ("policy", "borders"),
    [
        pytest.param("rest", 4, marks=pytest.mark.thorough),
        pytest.param("rest", 8, marks=pytest.mark.thorough),
        pytest.param("ensemble", 8, marks=pytest.mark.thorough),
    ],
)
def test_where_the_next_double_has_another_motion_neither_is_verified(policy: str, borders: int) -> None:
    """Between two motions there is a clearance where round-off decides: bisection finds the two doubles beside it."""
    oscillator, omega = DEFAULT, 0.275

    def at(*clearances: float) -> dict[str, NDArray[np.generic]]:
        settings = {"policy": policy, "initial_conditions": 1, "seed": 3}
        return unfolding_map_tile(
            Plane.of(oscillator, np.array([omega]), np.array(clearances)), MapSettings(preview=True, **settings)
        )

    def label(tile: dict[str, NDArray[np.generic]], row: int) -> tuple[int, ...]:
        return tuple(int(tile[name][row, 0]) for name in ("kind", "period", "impacts_right", "impacts_left"))

    grid, checked = np.linspace(1.3, 2.0, 40), 0
    coarse = at(*grid)
    for k in [k for k in range(39) if label(coarse, k) != label(coarse, k + 1)][:borders]:
        low, high = float(grid[k]), float(grid[k + 1])
        while np.nextafter(low, high) < high:
            middle = 0.5 * (low + high)
            if label(at(middle), 0) == label(at(low), 0):
                low = middle
            else:
                high = middle
        pair = at(low, high)
        if (pair["kind"] == 1).all():  # not where one of them settles just after max_periods
            checked += 1
            assert not pair["verified"].any()
    assert checked > 0


def test_where_the_contact_rests_impacts_that_press_it_against_the_stop_do_not_count() -> None:
    forced = forced_oscillator(DEFAULT, 0.29, 1.6)
    problem = begin(forced, initial_state(forced, None, None, 0.0)).forced.free
    time, state = 0.3 * 2.0 * np.pi / 0.29, np.zeros((3, 2))  # as in the steady motion
    acceleration = float(reference_at(problem, 0, time)[2])
    away = -1.0 if acceleration > 0.0 else 1.0
    run = new_run(3, 1, 4)
    for row, (stop, velocity, kind) in enumerate(
        [(away, 0.1, IMPACT), (-away, 0.02, IMPACT), (away, 0.2, IMPACT), (-away, 0.01, CHATTER)]
    ):
        run.events[row, [TIME, STOP, VELOCITY, KIND]] = time, stop, stop * velocity, kind
        run.events[row, EVENT_COLUMNS:] = state.ravel()

    def steepest(rows: int, rests: bool) -> float:
        run.cursor[EVENT_COUNT] = rows
        return steepest_in_run(problem, run, 0, rests)

    assert steepest(4, True) == pytest.approx(2.0 * abs(acceleration) / 0.1**2, rel=1e-14)
    assert steepest(3, False) == pytest.approx(2.0 * abs(acceleration) / 0.02**2, rel=1e-14)
    assert steepest(4, False) == np.inf
    run.events[2, VELOCITY] = 0.0
    assert steepest(3, True) == np.inf

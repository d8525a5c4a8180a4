"""Trajectories that a map names after an orbit go to that orbit."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from grazemap_core.codes import NOT_CAPTURED, RESOLVED
from grazemap_core.contact.kernels import half_period
from grazemap_core.contact.kernels.runs import EVENT_COUNT, OK, new_run
from grazemap_core.contact.kernels.stops import Stops
from grazemap_core.maps.basins import Coordinate, basin_tile
from grazemap_core.maps.bifurcation_diagrams import sections
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import AtRest, MapSettings, RunSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.kernels.capture import _flight_ratio, _impact_ratio, _time_moved
from grazemap_core.orbits.kernels.verification import Guess, verify
from grazemap_core.simulation.start import forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.support.lines import line
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST

Floats = NDArray[np.float64]

# Between its impacts the verified orbit 3-2r-2l passes a stop at a distance of 1e-7; the trajectory from rest comes
# within 4e-4 of that orbit, touches the stop there, and leaves for 1-1r-1l.
BESIDE = 0.2604494382022472, 1.7718524462135552

# After 75 periods the trajectory from rest is close to an orbit 6-1r-6l, and goes to 4-1r-4l.
PASSING = 0.2601565557729941, 1.810958904109589

# After 30 periods it is close to an orbit 9-40r-40l, 4e-7 from a border, and leaves for 9-41r-41l.
BESIDE_ANOTHER = 0.2713332562143301, 1.3185876541199797

# After 30 periods it is close to an orbit 2-11r-10l, also beside a border, and leaves for 6-33r-30l.
BESIDE_A_THIRD = 0.27808839421168835, 1.3374087498632392

# Trajectories whose returns shrink by 0.4 % or less: within 1000 periods the orbit cannot be shown to capture them.
SLOW = [
    ((0.28136986301369865, 1.8589041095890413), [1, 1, 1]),
    ((0.274144474872202, 1.3638982951649), [1, 4, 4]),  # its leading multipliers are a complex pair
    ((0.26545234899272124, 1.3286643909943632), [3, 10, 10]),  # its leading multiplier is near -1, as that of the next
    ((0.279678436255464, 1.323553673257857), [1, 5, 7]),
]

SYSTEMS = {
    "default": (DEFAULT, (0.26, 0.30), (1.3, 2.0)),
    "low restitution": (
        Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.4),
        (0.26, 0.30),
        (1.0, 1.8),
    ),
    "light damping": (
        Oscillator.create([1.0, 2.0, 3.0], [2.0, 1.0, 1.0], 0.02, [1.0, 0.0, 0.0], 0.7),
        (0.7, 1.3),
        (0.3, 1.5),
    ),
}


@pytest.mark.parametrize("preview", [False, True])
@pytest.mark.parametrize(
    ("place", "motion"),
    [(BESIDE, [1, 1, 1]), (PASSING, [4, 1, 4]), (BESIDE_ANOTHER, [9, 41, 41]), (BESIDE_A_THIRD, [6, 33, 30])],
)
def test_a_trajectory_that_passes_an_orbit_is_named_after_where_it_goes(
    place: tuple[float, float], motion: list[int], preview: bool
) -> None:
    omega, clearance = place
    point = unfolding_map_tile(
        Plane.of(DEFAULT, np.array([omega]), np.array([clearance])), MapSettings(preview=preview)
    )
    assert point["verified"][0, 0]
    assert [int(point[name][0, 0]) for name in ("period", "impacts_right", "impacts_left")] == motion
    across, up = (Coordinate(quantity, 1, np.array([-0.1, 0.0])) for quantity in ("displacement", "velocity"))
    state = basin_tile(DEFAULT, omega, clearance, across, up)
    assert state["verified"][1, 1]
    assert [int(state[name][1, 1]) for name in ("period", "impacts_right", "impacts_left")] == motion
    section = next(sections(line(DEFAULT, "omega", [omega, omega + 0.01], clearance))).motion
    assert section.verified
    assert [section.period, section.impacts_right, section.impacts_left] == motion
    later = trajectory(DEFAULT, omega, clearance, transient_periods=3000, samples_per_period=1).motion
    assert [later.period, later.impacts_right, later.impacts_left] == motion


class Arrival(NamedTuple):
    """A verified orbit near a trajectory, and what is needed to verify it again."""

    runner: Runner
    forced: Any
    stops: Stops
    length: int
    count: int
    returns: int

    def ratio(self, change: Floats) -> float:
        """Of the trajectory that is moved by `change`."""
        scratch = self.runner._scratch["verification"]
        before = scratch.capture.arrival.copy()
        scratch.capture.arrival[...] += change
        guess = Guess(self.count, self.length, 1e6, 0.0)
        verdict = verify(self.forced.free, self.runner._blocks, self.stops, guess, scratch)
        scratch.capture.arrival[...] = before
        assert verdict.reason == RESOLVED
        return float(verdict.ratio)


def arrivals(name: str, number: int) -> list[Arrival]:
    oscillator, omegas, clearances = SYSTEMS[name]
    rng = np.random.default_rng(len(name))
    cases: list[Arrival] = []
    while len(cases) < number:
        omega, clearance = float(rng.uniform(*omegas)), float(rng.uniform(*clearances))
        runner = Runner(oscillator, RunSettings(1000, 32, linearised=False))
        forced = forced_oscillator(oscillator, omega, clearance)
        results = runner.run(forced.structure, np.array([clearance]), AtRest())
        codes, figures = (part[0, 0] for part in results)
        impacts = np.maximum(codes[lane_state.IMPACTS_RIGHT : lane_state.IMPACTS_LEFT + 1], 0).sum()
        if codes[lane_state.REASON] != RESOLVED or codes[lane_state.UNVERIFIED] != RESOLVED or impacts == 0:
            continue
        symmetric = bool(codes[lane_state.SYMMETRIC])
        length = int(codes[lane_state.PERIOD]) * (1 if symmetric else 2)
        over_return = np.log(figures[lane_state.MULTIPLIER]) / (2 if symmetric else 1)
        count, returns = int(impacts) // (2 if symmetric else 1), 200 + int(np.log(1e-4) / over_return)
        cases.append(Arrival(runner, forced.structure.kernels, forced.stops, length, count, returns))
    return cases


def after(arrival: Arrival, change: Floats, halves: int) -> tuple[Floats, list[int]]:
    """The state so many half periods later, and the impacts of every return."""
    begin = arrival.runner._scratch["verification"].capture.arrival + change
    run, impacts = new_run(len(begin), len(arrival.forced.held.orders), 4096), []
    run.u[:] = begin
    for half in range(halves):
        if half % arrival.length == 0:
            impacts.append(0)
        run.cursor[EVENT_COUNT] = 0
        assert half_period.run_half(arrival.forced, arrival.stops, run, half) == OK
        impacts[-1] += int(run.cursor[EVENT_COUNT])
    return run.u, impacts


@KERNELS_FIRST
@pytest.mark.parametrize("name", SYSTEMS)
def test_every_trajectory_inside_the_ball_goes_to_the_orbit(name: str) -> None:
    rng = np.random.default_rng(1)
    for arrival in arrivals(name, 8):
        halves = arrival.length * arrival.returns
        target, _ = after(arrival, np.zeros((1, 1)), halves)
        for _ in range(4):
            change = rng.normal(size=target.shape) * arrival.stops.unit
            low, high = 1e-12, 1.0  # the ratio at low is below 1
            for _ in range(30):
                middle = np.sqrt(low * high)
                low, high = (middle, high) if arrival.ratio(middle * change) < 1.0 else (low, middle)
            assert low > 1e-9
            reached, impacts = after(arrival, low * change, halves)
            assert set(impacts) == {arrival.count}
            assert np.max(np.abs(reached - target)) < 1e-3 * low * np.max(np.abs(change)) + 1e-11


def test_an_impact_whose_ratio_is_below_one_takes_place_and_moves_no_more_than_the_bound() -> None:
    rng = np.random.default_rng(3)
    latest = 0.0
    for _ in range(4000):
        speed, slower = 1.0, float(rng.uniform(0.0, 1.0))
        change, bent = (float(np.exp(rng.uniform(-8.0, 2.0))) for _ in range(2))
        if _impact_ratio.py_func(speed, bent, change, slower) < 1.0:
            # the first time at which change - (speed - slower) t + bent t^2/2 is 0
            times = np.roots([0.5 * bent, slower - speed, change])
            assert np.all(times.imag == 0.0)
            moved = _time_moved.py_func(speed, bent, change, slower)
            assert np.min(times.real) <= moved * (1.0 + 1e-9)
            latest = max(latest, np.min(times.real) * speed / change)
    assert 1.9 < latest < 2.0  # of change/speed


def test_a_flight_whose_ratio_is_below_one_touches_no_stop() -> None:
    """On the way from a stop the distance is that of the orbit but for `reach`, and its rate but for `slower`."""
    rng = np.random.default_rng(4)
    closest = 1.0
    for _ in range(4000):
        slower, reach, acceleration = (float(np.exp(rng.uniform(-6.0, 1.0))) for _ in range(3))
        ratio = _flight_ratio.py_func(1.0, acceleration, 0.0, reach, slower)
        if ratio < 1.0:
            until = 2.0 * reach  # from then on the orbit is farther away than `reach`, up to the middle of its flight
            assert until - 0.5 * acceleration * until**2 >= reach * (1.0 - 1e-12)
            assert 1.0 - acceleration * until >= slower * (1.0 - 1e-12)
            closest = min(closest, 1.0 - ratio)
    assert closest < 0.01


def test_what_is_not_captured_says_so() -> None:
    """With few periods, trajectories on the way to an orbit are named after it, without being verified."""
    omega, clearance = np.linspace(0.26, 0.30, 6), np.linspace(1.3, 2.0, 48)
    early = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance), MapSettings(max_periods=45))
    late = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance))
    slow = early["reason"] == NOT_CAPTURED
    assert np.any(slow)
    assert not np.any(early["verified"][slow])
    both = slow & late["verified"]
    for name in ("period", "impacts_right", "impacts_left"):
        assert np.array_equal(early[name][both], late[name][both])


@pytest.mark.parametrize(("place", "motion"), SLOW)
def test_a_slow_approach_is_named_after_the_orbit_that_was_verified(
    place: tuple[float, float], motion: list[int]
) -> None:
    point = unfolding_map_tile(Plane.of(DEFAULT, *(np.array([number]) for number in place)))
    assert point["reason"][0, 0] == NOT_CAPTURED
    assert not point["verified"][0, 0]
    assert [int(point[name][0, 0]) for name in ("period", "impacts_right", "impacts_left")] == motion

"""Points whose motion double precision does not decide, against exact runs by code that shares nothing with these."""

from __future__ import annotations

import math
import sys

import mpmath
import numpy as np
import pytest
from flint import arb, ctx

from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.contact.stops import both_clearances
from grazemap_core.errors import ParameterError
from grazemap_core.maps import unfolding
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import MapSettings, RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.sensitive_points import Resolver, resolution, resolve_grid
from grazemap_core.maps.tolerances import RESOLVING_GUARD_BITS
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.multiprecision import (
    MultiprecisionRun,
    PreciseImpact,
    known_bits,
    same_impacts,
)
from grazemap_core.simulation.multiprecision_modes import MotionEquations
from grazemap_core.simulation.tolerances import LONGEST_ANGLE, SHORTEST_FLIGHT, SUM_ROUNDING
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.slow.resolved_points import ONE_MASS, SENSITIVE, exact_label, general_points, late_points, resolved_point
from tests.slow.verified_points import DEFAULT, Point
from tests.support.random_systems import random_system
from tests.support.thorough import KERNELS_FIRST, the_first

CHAOTIC, OMEGA, CLEARANCE = ONE_MASS[:3]

CHAINS = [
    (CHAOTIC, OMEGA, CLEARANCE, [[0.1], [-0.3]], 0.5),
    (
        Oscillator.create([1.0, 2.5, 0.7], [1.0, 3.0, 2.0], [0.05, 0.3, 0.01], [1.0, 0.0, -0.5], 0.95),
        0.7,
        0.6,
        None,
        0.0,
    ),
    # overdamped; light damping in SI
    (Oscillator.create([1.0, 0.5], [1.0, 0.6], [0.2, 1.9], [2.0, 1.0], 0.8), 0.9, 0.2, [[-0.2, 0.1], [0.4, 0.0]], -1.0),
    (Oscillator.create([2.0], [800.0], [0.5], [10.0], 0.9, "SI"), 18.0, 0.03, None, 2.0),
    (Oscillator.create([1.0, 2.0], [1.0, 4.0], 0.03, [1.0, 0.3], 0.9), 0.8, 0.5, None, 0.0),
]


def assert_as_exactly(run: MultiprecisionRun, exact: GeneralOracle, periods: int) -> tuple[int, int]:
    """Check all events and the state after so many periods; return the numbers of impacts and of rests."""
    run.run(periods)
    assert not run.ended
    with digits(exact.digits):
        exact.run(until=(2 * arb.pi() / arb(exact.omega) * periods).mid())
        names = ("times", "rests", "releases")
        events = sorted(
            ((time, name) for name in names for time in getattr(exact, name)), key=lambda event: float(event[0])
        )
        # of a chatter, only its end counts
        short = float(SHORTEST_FLIGHT * run.period)
        bounces = [float(b - a) < 1.001 * short for a, b in zip(exact.times, exact.times[1:], strict=False)]
        chatter = {float(b) for b, is_one in zip(exact.times[1:], bounces, strict=True) if is_one}
        counted = [time for time, name in events if name != "times" or float(time) not in chatter]
        for impact in run.impacts:
            assert min(abs(float(impact.time - time)) for time, _ in events) < 1e-25 * run.period
        for time in counted:
            assert min(abs(float(impact.time - time)) for impact in run.impacts) < 1e-25 * run.period
        apart = np.array(exact.state().floats()) - run.states[periods]
        assert np.abs(apart).max() < 1e-12 * np.abs(run.states[periods]).max()
    return len(exact.times), len(exact.rests)


@pytest.mark.parametrize(("oscillator", "omega", "clearance", "state", "phase"), CHAINS)
def test_impacts_are_those_of_the_series_of_the_equations(oscillator, omega, clearance, state, phase):
    """Damping per link and proportional, overdamped, from any state and phase."""
    start = None if state is None else np.array(state)
    run = MultiprecisionRun(oscillator, omega, clearance, start, phase, 192)
    vectors = [None, None] if state is None else start.tolist()
    initial = {"displacement": vectors[0], "velocity": vectors[1], "phase": phase}
    exact = GeneralOracle.of(oscillator, omega, clearance, clearance, digits=57, **initial)
    impacts, rests = assert_as_exactly(run, exact, 12)
    assert (impacts > 10, rests) == (True, 0)


QUICK = [(2, None), (3, None), (5, None), (9, None), (14, None), (14, 0.0), (21, 0.2), (45, None)]
LONG = [(seed, restitution) for seed in range(60) for restitution in (None, 0.0, 0.2, 1.0)]


@pytest.mark.parametrize(("seed", "restitution"), the_first(len(QUICK), [*QUICK, *LONG]))
def test_events_of_any_structure_between_any_stops_are_those_of_the_series(seed, restitution):
    """Dense and gyroscopic matrices, any row, several harmonics and phases, a bias, one stop or two that differ.

    Complete chatter, rest and release included.
    """
    system = random_system(seed, restitution=restitution)
    run = MultiprecisionRun(*system, None, 0.3, 256)
    exact = GeneralOracle.of(system.oscillator, system.omega, *both_clearances(system.clearance), digits=77, phase=0.3)
    _, rests = assert_as_exactly(run, exact, 8)
    assert rests > 0 or (seed, restitution) not in QUICK[4:]


def dense(stiffness, damping, row, force_row, restitution=0.8):
    """Masses of 1 with these matrices."""
    structure = Matrices.create(np.eye(len(stiffness)), np.array(stiffness), np.array(damping))
    return Oscillator.of_structure(structure, np.array(row), [force(1, np.array(force_row))], restitution)


def alike(size, damping, row, force_row, *, restitution=0.8):
    """Masses of 1 on springs of 1 that are not joined: every mode is there `size` times."""
    return dense(np.eye(size), damping * np.eye(size), row, force_row, restitution)


def nearly_critical(excess):
    """One mass of 1 on a spring of 1 whose damping is 2 (1 + excess)."""
    return Oscillator.create([1.0], [1.0], 1.0 + excess, [1.0], 0.95)


RING = [[3.0, -1.0, -1.0], [-1.0, 3.0, -1.0], [-1.0, -1.0, 3.0]]
FREE = [[1.0, -1.0], [-1.0, 1.0]]

EQUAL = {
    "critical": (nearly_critical(0.0), 4.0, 0.005),
    "overdamped by a rounding": (nearly_critical(2.0**-52), 4.0, 0.005),
    "underdamped by 1e-12": (nearly_critical(-1e-12), 4.0, 0.005),
    "overdamped by 1e-8": (nearly_critical(1e-8), 4.0, 0.005),
    "critical beside another mode": (dense(np.diag([1.0, 2.0]), np.diag([2.0, 0.1]), [1.0, 0.5], [1.0, 0.2]), 0.9, 0.2),
    "two equal masses": (alike(2, 0.1, [1.0, -1.0], [1.0, 0.0]), 0.9, 0.5),
    "two equal masses without damping": (alike(2, 0.0, [1.0, -1.0], [1.0, 0.3]), 0.7, 0.5),
    "two equal masses that rest": (alike(2, 0.1, [1.0, -1.0], [1.0, 0.0], restitution=0.2), 0.25, 0.5),
    "five critical masses": (alike(5, 2.0, [1.0, -1.0, 0.5, 0.3, 0.1], [1.0, 0.0, 0.2, 0.0, 0.0]), 1.9, 0.05),
    "ring": (dense(RING, 0.1 * np.eye(3), [1.0, 0.0, 0.0], [1.0, 0.0, 0.2]), 0.9, 0.3),
    "equal and critical, held too": (
        dense(np.eye(3), np.diag([2.0, 2.0, 0.1]), [1.0, -1.0, 0.7], [1.0, 0.0, 0.3], 0.0),
        0.25,
        0.3,
    ),
    "free mode": (dense(FREE, 0.1 * np.array(FREE), [1.0, -1.0], [1.0, -0.5]), 0.9, 0.3),
    "free mode that drifts": (dense(FREE, np.zeros((2, 2)), [1.0, -1.0], [1.0, 0.0]), 0.9, 0.3),
}


@pytest.mark.parametrize(("oscillator", "omega", "clearance"), EQUAL.values(), ids=EQUAL)
def test_events_of_equal_exponents_are_those_of_the_series(oscillator, omega, clearance):
    """Defective or not, of the free structure and of the held one, exactly equal or nearly; with fewer bits too."""
    run = MultiprecisionRun(oscillator, omega, clearance, None, 0.3, 192)
    run.run(3)
    run.reduce(160)
    exact = GeneralOracle.of(oscillator, omega, clearance, clearance, digits=57, phase=0.3)
    impacts, rests = assert_as_exactly(run, exact, 8)
    assert (impacts > 10, rests > 0) == (True, oscillator.restitution < 0.5)


def test_a_critical_mass_moves_as_in_the_closed_form():
    """From rest to the stop and on from the impact: steady motion and (a + b t) e^-t, by mpmath."""
    omega, clearance = 4.0, 0.005
    run = MultiprecisionRun(nearly_critical(0.0), omega, clearance, None, 0.0, 256)
    run.run(1)
    with mpmath.workdps(70), digits(70):
        w, stop = mpmath.mpf(omega), mpmath.mpf(clearance)
        amplitude = 1 / mpmath.mpc(1 - w * w, 2 * w)

        def free(place, velocity, since):
            """The motion after a state at a time, and its velocity."""
            turn = amplitude * mpmath.expj(w * since)
            a, steady = place - turn.imag, (1j * w * turn).imag
            b = velocity - steady + a

            def motion(t):
                turned = amplitude * mpmath.expj(w * t)
                decayed = mpmath.exp(since - t)
                moved = a + b * (t - since)
                return turned.imag + moved * decayed, (1j * w * turned).imag + (b - moved) * decayed

            return motion

        place, velocity, since = mpmath.mpf(0), mpmath.mpf(0), mpmath.mpf(0)
        for impact in run.impacts[:3]:
            motion = free(place, velocity, since)
            near = mpmath.mpf(float(impact.time))
            time = mpmath.findroot(lambda t: motion(t)[0] - impact.stop * stop, near)  # noqa: B023
            assert abs(float(impact.time - arb(mpmath.nstr(time, 70)))) < 1e-60
            place, velocity, since = impact.stop * stop, -mpmath.mpf(0.95) * motion(time)[1], time
    assert len(run.impacts) >= 3


@pytest.mark.parametrize("name", EQUAL)
def test_double_precision_shows_the_sums_of_equal_exponents(name):
    """From random states, up to the longest time: the rounding and the bounds that the search for contacts assumes."""
    oscillator, omega, _ = EQUAL[name]
    random = np.random.default_rng(0)
    with ctx.workprec(192):
        motion = MotionEquations(oscillator).free(arb(omega))
        longest = LONGEST_ANGLE / motion.fastest
        for _ in range(5):
            state = [arb(x) for x in random.normal(size=2 * oscillator.size).tolist()]
            amplitudes = motion.amplitudes(state, arb(0))
            terms = motion.terms(amplitudes, longest)
            bounds = motion.bounds(terms, longest)
            for time in (random.uniform(size=20) * longest).tolist():
                exact = [float(x.real) for x in (motion.outputs * motion.after(arb(time), amplitudes)).entries()]
                turned = np.exp(motion.rates * time)
                shown = sum(((term[:3] @ turned).real * time**power for power, term in enumerate(terms)), np.zeros(3))
                assert np.all(np.abs(exact - shown) <= SUM_ROUNDING * bounds[:3])
                assert np.all(np.abs(exact) <= bounds[:3])


@pytest.mark.parametrize("faster", [1e-9, 2.0**-44, 2.0**-52])
@pytest.mark.parametrize("stop", [1, -1])
def test_a_contact_that_double_precision_does_not_resolve_is_decided(faster, stop):
    """An undamped free mass from the middle reaches the stop with a velocity of 1, and misses it with a smaller one."""
    oscillator = Oscillator.create([1.0], [1.0], 0.0, [0.0], 0.9)
    for velocity, impacts in ((1.0 + faster, 1), (1.0 - faster, 0)):
        run = MultiprecisionRun(oscillator, 4.0, 1.0, np.array([[0.0], [stop * velocity]]), 0.0, 256)
        run.run(1)
        assert len(run.impacts) == impacts
        assert not run.ended
        if impacts:
            assert run.impacts[0].stop == stop
            assert float(run.impacts[0].time) == pytest.approx(np.arcsin(1.0 / velocity), rel=1e-7)


def counts(tile):
    """The motion of a map's only point."""
    return [tile[name][0, 0] for name in ("period", "impacts_right", "impacts_left")]


def resolved_as_exactly(point):
    """Check that a point has the motion of an exact run; return this and the bits that decided it."""
    resolved, reason, bits = resolved_point(point)
    assert not reason
    assert exact_label(resolved, bits) == resolved.label
    return resolved.label, bits


def resolved_in_map(point):
    """Check that the map of this point alone has its motion where sensitive points are resolved, and only there."""
    grid = np.array([point.omega]), np.array([point.clearance])
    before, after = (
        unfolding_map_tile(Plane.of(point.oscillator, *grid), resolve_sensitive=wanted) for wanted in (False, True)
    )
    assert before["reason"] == ROUNDING_DECIDES
    assert not before["verified"]
    assert after.keys() == before.keys() | {"resolved"}
    assert after["resolved"]
    assert after["verified"]
    assert after["reason"] == RESOLVED
    assert counts(after) == [point.period, point.right, point.left]


def test_a_sensitive_point_of_a_map_is_resolved_as_exactly():
    resolved_in_map(SENSITIVE)
    label, bits = resolved_as_exactly(SENSITIVE)
    assert label == SENSITIVE.label
    assert bits >= 512


@KERNELS_FIRST
def test_the_exact_motion_is_found_where_double_precision_finds_another():
    tile = unfolding_map_tile(Plane.of(CHAOTIC, np.array([OMEGA]), np.array([CLEARANCE])))
    assert counts(tile) != [3, 4, 4]
    label, bits = resolved_as_exactly(ONE_MASS)
    assert label == ONE_MASS.label
    assert bits >= 512


@pytest.mark.parametrize("seed", the_first(1, [104, 101, 102]))
def test_points_after_long_transients_are_resolved_as_exactly(seed):
    ((point, _, _),) = late_points(seed, 1)
    resolved_as_exactly(point)


@pytest.mark.parametrize(
    ("point", "multiplier"),
    [(SENSITIVE, 0.670477), pytest.param(ONE_MASS, 0.619644, marks=KERNELS_FIRST)],
    ids=["three masses", "one mass"],
)
def test_only_the_sensitive_trajectories_of_a_grid_are_replaced(point, multiplier):
    omega, clearance = np.array([0.5, 1.0]) * point.omega, np.array([1.0, 1.1]) * point.clearance
    task = RunSettings(1000, 32)
    before = PlaneRunner(Plane.of(point.oscillator, omega, clearance), task).grid()
    codes, figures = (part.copy() for part in before)
    sensitive = np.zeros((2, 2, 1), dtype=bool)
    sensitive[0, 1, 0] = True
    plane = Plane.of(point.oscillator, omega, clearance)
    resolved = resolve_grid(PlaneRunner(plane, task), sensitive, codes, figures)
    np.testing.assert_array_equal(resolved, sensitive)
    for after, was in zip((codes, figures), before, strict=True):
        np.testing.assert_array_equal(after[:, ~sensitive], was[:, ~sensitive])
    names = (lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT, lane_state.UNVERIFIED)
    assert [codes[name, 0, 1, 0] for name in names] == [point.period, point.right, point.left, RESOLVED]
    assert figures[lane_state.MULTIPLIER, 0, 1, 0] == pytest.approx(multiplier, abs=1e-6)
    assert codes[lane_state.HALVES_RUN, 0, 1, 0] == before[0][lane_state.HALVES_RUN, 0, 1, 0]


@pytest.fixture
def all_sensitive(monkeypatch):
    """Planted: every trajectory of a map counts as sensitive."""

    class Planted(PlaneRunner):
        def grid(self, down=False):
            codes, figures = super().grid(down)
            codes[lane_state.UNVERIFIED] = ROUNDING_DECIDES
            return codes, figures

    monkeypatch.setattr(unfolding, "PlaneRunner", Planted)


CRITICAL = Point(
    Oscillator.create([1.0], [1.0], 1.0, [1.0], 0.9),
    omega=4.0,
    clearance=0.028986107005616314,
    period=3,
    right=4,
    left=4,
    symmetric=True,
    settled_after=34,
    least_velocity=0.0,
    multiplier=0.0,
)


@KERNELS_FIRST
def test_a_sensitive_point_of_a_critically_damped_mass_is_resolved_as_exactly():
    resolved_in_map(CRITICAL)
    resolved_as_exactly(CRITICAL)


@KERNELS_FIRST
def test_a_map_has_the_motions_of_its_resolved_points(all_sensitive):
    resolved_in_map(ONE_MASS)


PLACES = [(DEFAULT, 0.29, 1.6), pytest.param(CHAOTIC, 1.4, CLEARANCE, marks=KERNELS_FIRST)]


@pytest.mark.parametrize(("oscillator", "omega", "clearance"), PLACES, ids=["three masses", "one mass"])
def test_the_trajectories_of_an_ensemble_are_resolved_before_the_most_frequent_motion_is_chosen(
    oscillator, omega, clearance, all_sensitive
):
    grid, settings = (np.array([omega]), np.array([clearance])), {"policy": "ensemble", "initial_conditions": 3}
    tile = unfolding_map_tile(Plane.of(oscillator, *grid), MapSettings(**settings), resolve_sensitive=True)
    assert tile["resolved"]
    assert tile["verified"]
    assert tile["share"] >= 1 / 3


def test_slow_transients_are_undecided():
    late = Resolver(DEFAULT, 0.28136986301369865, max_periods=4).resolve(1.8589041095890413)
    assert late.reason == "not captured within the periods simulated"
    assert len(late.codes) == 0


@pytest.mark.parametrize("seed", the_first(1, [8, 3, 7, 12, 18, 20, 37]))
def test_sensitive_points_of_general_systems_are_resolved_as_exactly(seed):
    """One mass and dense matrices, several harmonics, a bias, one stop or two, of different restitution."""
    points = general_points(seed, 1)
    assert points
    for point in points:
        resolved_as_exactly(point)


LOSSY = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.3)


def test_a_motion_that_rests_on_its_way_is_resolved_as_exactly():
    state = np.array([[1.7999, -6.0, 0.0], [0.001, 0.0, 0.0]])
    answer = Resolver(LOSSY, 0.29).resolve(1.8, state, 0.5)
    assert not answer.reason
    names = lane_state.PERIOD, lane_state.IMPACTS_RIGHT, lane_state.IMPACTS_LEFT
    assert [answer.codes[name] for name in names] == [1, 1, 1]
    initial = {"displacement": state[0].tolist(), "velocity": state[1].tolist(), "phase": 0.5}
    exact = GeneralOracle.of(LOSSY, 0.29, 1.8, 1.8, **initial)
    exact.run(until=80 * 2.0 * np.pi / 0.29)
    assert len(exact.rests) > 3
    assert float(exact.rests[-1]) < 20 * 2.0 * np.pi / 0.29
    late = np.array([float(time) for time in exact.times[-9:]])
    np.testing.assert_allclose(np.diff(late), np.pi / 0.29, rtol=1e-6)
    assert exact.stops[-3:] in ([1, -1, 1], [-1, 1, -1])


def test_a_motion_with_rests_is_undecided():
    answer = Resolver(LOSSY, 0.29).resolve(1.6)
    assert answer.reason == "the contact comes to rest on a stop again and again"
    assert len(answer.codes) == 0


def test_a_steady_motion_that_cancels_is_undecided():
    beside = Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.95)
    answer = Resolver(beside, 1.0 + 2.0**-40).resolve(1.0, np.zeros((2, 1)))
    assert answer.reason == "double precision does not locate the contacts, as near an undamped resonance"
    assert not MultiprecisionRun(beside, 1.01, 1.0, np.zeros((2, 1)), 0.0, 128).ended


def test_bits_below_the_error_are_not_needed():
    """A precise run shows the error of two others: that of the one that continues with fewer bits is not larger."""
    whole, fewer, exact = (MultiprecisionRun(*ONE_MASS[:3], np.zeros((2, 1)), 0.0, bits) for bits in (512, 512, 2048))
    for periods in range(20, ONE_MASS.settled_after, 20):
        for run in (whole, fewer, exact):
            run.run(periods)
        known = known_bits(fewer, exact)
        assert known > known_bits(whole, exact) - 2.0
        fewer.reduce(round(known) + RESOLVING_GUARD_BITS)
    assert known < 256
    assert fewer.work < 0.95 * whole.work
    assert known_bits(whole, whole) == math.inf


@pytest.mark.parametrize("velocity", [0.0, 0.5])
def test_a_start_against_a_stop_is_undecided(velocity):
    answer = Resolver(CHAOTIC, OMEGA).resolve(CLEARANCE, np.array([[CLEARANCE], [velocity]]))
    assert answer.reason == "the contact starts on a stop or beyond it"


def test_runs_that_never_have_the_same_impacts_end():
    """Planted: every run has another impact, so that no number of bits suffices."""

    class Planted:
        def __init__(self, bits: int) -> None:
            self.bits, self.period, self.ended, self.states = bits, 1.0, "", [np.zeros((2, 1))]
            self.impacts, self.work = [PreciseImpact(1, 1.0 / bits)], bits

        def run(self, periods: int) -> None:
            pass

    assert resolution(Planted, None, 16).reason == "the limit of the work is reached"


def test_runs_with_different_impacts_decide_nothing():
    """Planted: an impact is late by 2^-8 periods in 128 bits, by half as many digits in twice as many bits."""

    class Planted:
        def __init__(self, bits: int) -> None:
            self.bits, self.period, self.ended, self.states = bits, 1.0, "", [np.zeros((2, 1))] * 100
            self.impacts, self.work = [PreciseImpact(1, 2.0 ** (-bits // 16))], bits

        def run(self, periods: int) -> None:
            pass

    def captured(states):
        codes = np.zeros((len(states), lane_state.CODES), dtype=np.int64)
        codes[:, lane_state.PERIOD] = 1
        return codes, np.zeros((len(states), lane_state.FIGURES))

    assert resolution(Planted, captured, 16).bits == 2048
    assert same_impacts(Planted(1024), Planted(2048))
    assert not same_impacts(Planted(512), Planted(1024))
    other = Planted(2048)
    other.impacts = [PreciseImpact(-1, other.impacts[0].time)]
    assert not same_impacts(Planted(2048), other)


def test_a_sweep_is_not_resolved_nor_without_python_flint(monkeypatch):
    grid = np.array([0.29]), np.array([1.6])
    with pytest.raises(ParameterError, match="sweep"):
        unfolding_map_tile(Plane.of(CHAOTIC, *grid), MapSettings(policy="sweep-up"), resolve_sensitive=True)
    monkeypatch.delitem(sys.modules, "grazemap_core.maps.sensitive_points")
    monkeypatch.delitem(sys.modules, "grazemap_core.simulation.multiprecision")
    monkeypatch.setitem(sys.modules, "flint", None)
    with pytest.raises(ParameterError, match=r"resolve_sensitive: .*grazemap\[proofs\]"):
        unfolding_map_tile(Plane.of(CHAOTIC, *grid), resolve_sensitive=True)

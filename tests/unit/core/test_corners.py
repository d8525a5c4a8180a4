"""Limiting cases of the trajectory: rests that do not end, extreme restitutions and chains, starts on a stop.

Each has a defined answer, in the words of `assert_defined`; those with a closed form have that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from grazemap_core.errors import CoreError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS, REASONS
from grazemap_core.simulation.trajectories import Trajectory, trajectory
from grazemap_core.tolerances import EPSILON


def assert_defined(result: Trajectory, clearance: float, end: float, amplitude: float = 0.0) -> None:
    """Numbers are numbers, mass 1 is between the stops, times are in order and inside the record, the motion has a
    name or a reason, and a record that ends early says why.

    `amplitude` is that of the motion that states are relative to, which round-off is relative to.
    """
    for values in (result.time, result.displacement, result.velocity, result.impacts.time, result.impacts.velocity):
        assert np.all(np.isfinite(values))
    assert np.all(np.abs(result.displacement[0]) <= clearance + 32.0 * EPSILON * (clearance + amplitude))
    times = [result.impacts.time, np.stack([result.sticking.start, result.sticking.stop_time], axis=1).ravel()]
    for series in times:
        assert np.all(np.diff(series) >= 0.0)
        assert np.all((series >= 0.0) & (series <= end * (1.0 + 4.0 * EPSILON)))
    assert set(result.impacts.kind.tolist()) <= {"impact", "chatter", "graze"}
    assert np.all(result.impacts.velocity * result.impacts.stop >= 0.0)
    motion = result.motion
    assert motion.kind in KINDS
    assert (motion.reason in REASONS.values()) == (motion.kind == "unresolved")
    if len(result.time) == 0 or result.time[-1] < end * (1.0 - 4.0 * EPSILON):
        assert motion.kind == "unresolved"
        assert motion.reason not in (None, "", REASONS[1])


# --- rests that outlast the record --------------------------------------------------------------------------------


def held_second_mass(oscillator: Oscillator, clearance: float, x: float, v: float) -> tuple[Any, Any, Any, Any]:
    """The motion of mass 2 of 2 while mass 1 rests at +clearance, without forcing: x2(t) and the force on mass 1.

    Returns (x2, its velocity, pressing, exact clearance), functions of the time in 40 digits; overdamped chains only.
    """
    m = mp.mpf(float(oscillator.masses[1]))
    k1, k2 = (mp.mpf(float(k)) for k in oscillator.stiffnesses)
    if oscillator.gamma is None:
        c1, c2 = (mp.mpf(float(c)) for c in oscillator.link_damping)
    else:
        c1, c2 = (2 * mp.mpf(oscillator.gamma) * k for k in (k1, k2))
    b = mp.mpf(clearance)
    root = mp.sqrt((c1 + c2) ** 2 - 4 * m * (k1 + k2))
    slow, fast = (-(c1 + c2) + root) / (2 * m), (-(c1 + c2) - root) / (2 * m)
    place = k1 * b / (k1 + k2)
    first = (mp.mpf(v) - fast * (mp.mpf(x) - place)) / (slow - fast)
    second = mp.mpf(x) - place - first

    def position(t: Any) -> Any:
        return place + first * mp.exp(slow * t) + second * mp.exp(fast * t)

    def rate(t: Any) -> Any:
        return slow * first * mp.exp(slow * t) + fast * second * mp.exp(fast * t)

    def pressing(t: Any) -> Any:
        # k1 (place - b) is -k1 k2 b/(k1 + k2), which digits must not be lost of
        free = first * mp.exp(slow * t) * (k1 + c1 * slow) + second * mp.exp(fast * t) * (k1 + c1 * fast)
        return free - k1 * k2 * b / (k1 + k2)

    return position, rate, pressing, b


# mass 2 beyond the stop creeps back against its own damper, and lets go as it passes mass 1
CREEP = Oscillator.create([1.0, 1.0], [1.0, 1.0], [0.0, 25.0], [0.0, 0.0], 0.5)
# the pull to ground as good as none: the damper between the masses carries the push of mass 2, which dies out slowly
VANISHING = Oscillator.create([1.0, 1.0], [1.0, 1e-12], 2.0, [0.0, 0.0], 0.5)
FADING = Oscillator.create([1.0, 1.0], [1.0, 1e-30], 2.0, [0.0, 0.0], 0.5)
SLOW = 2.0 - math.sqrt(3.0)


@pytest.mark.parametrize(("oscillator", "x", "v", "periods", "guess"), [
    (CREEP, 3.0, 0.0, 5, None),
    (CREEP, 3.0, 0.0, 40, 40.0),
    (VANISHING, 0.5, 0.5 * SLOW, 10, None),
    (VANISHING, 0.5, 0.5 * SLOW, 100, 90.0),
    (FADING, 0.5, 0.5 * SLOW, 10, None),
])  # fmt: skip
@pytest.mark.parametrize("stop", [1, -1])
def test_a_rest_under_a_force_that_dies_out_lasts_as_long_as_the_force(
    oscillator: Oscillator, x: float, v: float, periods: int, guess: float | None, stop: int
) -> None:
    start = stop * np.array([1.0, x]), stop * np.array([0.0, v])
    result = trajectory(oscillator, 1.0, 1.0, *start, periods=periods, samples_per_period=4)
    end = 2.0 * math.pi * periods
    assert_defined(result, 1.0, end)
    assert len(result.impacts.time) == 0
    np.testing.assert_array_equal(result.sticking.stop, [stop])
    assert result.sticking.start[0] == 0.0
    with mp.workdps(50):
        position, rate, pressing, _ = held_second_mass(oscillator, 1.0, x, v)
        if guess is None:
            # to the end of the record, and the force is there to the end
            assert pressing(mp.mpf(end)) > 0
            released = end
            assert result.sticking.stop_time[0] == end
            assert result.motion.kind == "unresolved"
            assert result.motion.reason == REASONS[1]
        else:
            released = mp.findroot(pressing, guess)
            assert 0 < released < end
            assert result.sticking.stop_time[0] == pytest.approx(float(released), rel=1e-13)
        rested = result.time <= float(released)
        assert np.all(result.displacement[0, rested] == stop)
        assert np.all(result.velocity[0, rested] == 0.0)
        for values, exact in ((result.displacement, position), (result.velocity, rate)):
            expected = [float(stop * exact(mp.mpf(t))) for t in result.time[rested]]
            np.testing.assert_allclose(values[1, rested], expected, rtol=0, atol=1e-14)


def test_a_complete_chatter_may_lead_into_a_rest_that_outlasts_the_record() -> None:
    oscillator = Oscillator.create([1.0, 1.0], [1.0, 1e-6], [0.0, 5.0], [0.0, 0.0], 0.5)
    end = 40.0 * math.pi
    result = trajectory(oscillator, 1.0, 1.0, np.array([0.5, 3.0]), np.zeros(2), periods=20, samples_per_period=4)
    assert_defined(result, 1.0, end)
    assert result.impacts.kind.tolist().count("chatter") == 1
    assert result.impacts.kind[-1] == "chatter"
    assert result.impacts.time[-1] < result.sticking.start[0] < 3.0
    np.testing.assert_array_equal(result.sticking.stop_time, [end])
    assert np.all(result.displacement[0, result.time >= result.sticking.start[0]] == 1.0)


# --- everything else has an answer too ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Case:
    """A question, and what refuses it: nothing, or an error with these words.

    `slides`: an elastic mass 1 bounces without an end, and ever faster; `test_sticking` has that.
    """

    chain: tuple[list[float], list[float], float | list[float], list[float]]
    omega: float
    clearance: float
    refused: str = ""
    slides: bool = False


def links(first: float, second: float, third: float, damping: float | list[float]) -> tuple[Any, ...]:
    return [1.0, 10.0, 10.0], [first, 5.0 * second, 5.0 * third], damping, [1.0, 0.0, 0.0]


PER_LINK = [0.05, 0.05, 0.05]
CASES = {
    "undamped": Case(([1.0], [1.0], 0.0, [1.0]), 0.7, 1.0),
    "undamped chain": Case(links(1, 1, 1, 0.0), 0.29, 1.0),
    "undamped at rest": Case(([1.0], [1.0], 0.0, [0.0]), 1.0, 1.0),
    "undamped resonance": Case(([1.0], [1.0], 0.0, [1.0]), 1.0, 1.0),
    "beside an undamped resonance": Case(([1.0], [1.0], 0.0, [1.0]), 1.01, 1.0),
    "stops out of reach": Case(links(1, 1, 1, 0.05), 0.29, 1e6),
    "stops in the way": Case(links(1, 1, 1, 0.05), 0.29, 1e-3),
    "stiff chain": Case(links(1e6, 1e6, 1e6, 5e-5), 290.0, 1.6e-6),
    "stiff chain, slow forcing": Case(links(1e6, 1e6, 1e6, 5e-5), 0.29, 1e-6, slides=True),
    "soft chain": Case(links(1e-6, 1e-6, 1e-6, 50.0), 2.9e-4, 1.6e6),
    "soft chain, fast forcing": Case(links(1e-6, 1e-6, 1e-6, 50.0), 0.29, 1.6),
    "stiff first link": Case(links(1e6, 1, 1, PER_LINK), 0.29, 0.1),
    "stiff second link": Case(links(1, 1e6, 1, PER_LINK), 0.29, 0.1),
    "stiff last link": Case(links(1, 1, 1e6, PER_LINK), 0.29, 0.1),
    "stiff first link, strongly damped": Case(links(1e6, 1, 1, 0.05), 0.29, 0.1, "omega"),
    "soft first link": Case(links(1e-6, 1, 1, PER_LINK), 0.29, 0.1),
    "soft second link": Case(links(1, 1e-6, 1, PER_LINK), 0.29, 0.1),
    "soft last link": Case(links(1, 1, 1e-6, PER_LINK), 0.29, 0.1),
    "last link as good as none": Case(links(1, 1, 1e-30, PER_LINK), 0.29, 0.1, "slow"),
    "heavy first mass": Case(([1e6, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0]), 0.29, 1e-6),
    "light first mass": Case(([1e-6, 10.0, 10.0], [1.0, 5.0, 5.0], PER_LINK, [1.0, 0.0, 0.0]), 0.29, 0.1, "omega"),
    "overdamped": Case(links(1, 1, 1, 30.0), 0.29, 0.01, slides=True),
    "hardly a force": Case(([1.0], [1.0], 0.05, [1e-60]), 0.29, 1e-60),
}


@pytest.mark.parametrize(("name", "restitution"), [
    (name, restitution)
    for name, case in CASES.items()
    for restitution in (0.0, 1e-300, 0.5, 1.0)
    if not (case.slides and restitution == 1.0)
])  # fmt: skip
def test_every_limiting_case_has_a_defined_result(name: str, restitution: float) -> None:
    case = CASES[name]
    end = 6 * 2.0 * math.pi / case.omega
    oscillator = Oscillator.create(*case.chain, restitution)
    if case.refused:
        with pytest.raises(CoreError, match=case.refused):
            trajectory(oscillator, case.omega, case.clearance, periods=6)
        return
    result = trajectory(oscillator, case.omega, case.clearance, periods=6, samples_per_period=20)
    assert_defined(result, case.clearance, end, result.record.forced.free.steady_bound)
    # what stays on a stop was brought there, and what has left with no speed was pressed to it
    if restitution == 1.0:
        assert len(result.sticking.start) == 0
    if not len(result.impacts.time):
        assert len(result.sticking.start) == 0


@pytest.mark.parametrize("stop", [1, -1])
@pytest.mark.parametrize(("restitution", "pressed", "toward"), [
    (restitution, pressed, toward)
    for restitution in (0.0, 0.5, 1.0)
    for pressed in (True, False)
    for toward in (1.0, 1e-300, 0.0, -1e-300, -1.0)
    # bounces without an end: `test_sticking` has them
    if not (pressed and restitution == 1.0 and 0.0 < abs(toward) < 1.0)
])  # fmt: skip
def test_a_start_on_a_stop_is_an_impact_a_rest_or_a_flight(
    restitution: float, stop: int, pressed: bool, toward: float
) -> None:
    # the force on a resting mass is sin(t/10 + phase), less the spring's pull of 0.1
    oscillator, clearance, omega = Oscillator.create([1.0], [1.0], 0.0, [1.0], restitution), 0.1, 0.1
    phase = stop * (math.pi / 2) * (1 if pressed else -1)
    start = np.array([stop * clearance]), np.array([stop * toward])
    result = trajectory(oscillator, omega, clearance, *start, phase=phase, periods=1, samples_per_period=8)
    assert_defined(result, clearance, 2.0 * math.pi / omega)
    strikes = bool(len(result.impacts.time)) and result.impacts.time[0] == 0.0
    assert strikes == (toward > 0.0)
    if strikes:
        assert result.impacts.velocity[0] == stop * toward
        assert result.impacts.stop[0] == stop
        assert result.velocity[0, 0] == pytest.approx(-restitution * stop * toward, abs=1e-15)
    # a bounce of 1e-300 lasts 2.2e-300 under a force of 0.9, and all that follow R/(1 - R) times as long
    rests = bool(len(result.sticking.start)) and result.sticking.start[0] < 1e-290
    assert rests == (pressed and (abs(toward) < 1.0 or (restitution == 0.0 and toward > 0.0)))
    if rests and 0.0 < abs(toward) < 1.0:
        flights = (toward < 0.0) + restitution / (1.0 - restitution)
        assert result.sticking.start[0] == pytest.approx(flights * 2e-300 / 0.9, rel=1e-12)
    if rests:
        # until sin(t/10 + pi/2) = 0.1
        assert result.sticking.stop_time[0] == pytest.approx(10.0 * math.acos(0.1), rel=1e-13)
        assert result.sticking.stop[0] == stop
    if not rests and not strikes:
        # away at once: sin(t/10 + phase) over 1 - 1/100, and what swings freely
        with mp.workdps(40):
            w, b = mp.mpf(omega), mp.mpf(clearance)
            force, turn = 1 / (1 - w**2), mp.mpf(abs(phase)) * (1 if pressed else -1)
            x0, v0 = b - force * mp.sin(turn), toward - force * w * mp.cos(turn)

            def place(t: Any) -> Any:
                return x0 * mp.cos(t) + v0 * mp.sin(t) + force * mp.sin(w * t + turn)

            first = 0.3 if pressed else 0.2
            other = mp.findroot(lambda t: place(t) + b, first)
            assert other > 0
            assert min(place(other * k / 100) for k in range(1, 100)) > -b
        assert result.impacts.time[0] == pytest.approx(float(other), rel=1e-13)
        assert result.impacts.stop[0] == -stop


@pytest.mark.parametrize("stiffness", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_flights_between_the_stops_of_soft_and_stiff_springs_have_the_duration_of_the_closed_form(
    stiffness: float, restitution: float
) -> None:
    # between impacts x = +-(b cos(w t) - (v/w) sin(w t)), v the speed behind the impact: pi - 2 atan(...) in w t where
    # the energy suffices, else mass 1 falls back and strikes no more
    w = math.sqrt(stiffness)
    oscillator = Oscillator.create([1.0], [stiffness], 0.0, [0.0], restitution)
    speed = 3.0 * w
    result = trajectory(oscillator, w, 1.0, velocity=np.array([speed]), periods=2, samples_per_period=4)
    assert_defined(result, 1.0, 4.0 * math.pi / w)
    with mp.workdps(40):
        omega, amplitude = mp.sqrt(mp.mpf(stiffness)), mp.mpf(speed) / mp.sqrt(mp.mpf(stiffness))
        arrives = mp.sqrt(amplitude**2 - 1)  # in units of w b
        times, speeds = [mp.asin(1 / amplitude) / omega], [arrives * omega]
        while len(times) < 12:
            leaves = mp.mpf(restitution) * speeds[-1] / omega
            times.append(times[-1] + 2 * mp.atan(1 / leaves) / omega)
            speeds.append(mp.mpf(restitution) * speeds[-1])
        count = min(len(result.impacts.time), len(times))
        assert count >= (10 if restitution == 1.0 else 4)
        expected = np.array([float(t * w) for t in times[:count]])
        np.testing.assert_allclose(result.impacts.time[:count] * w, expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(np.abs(result.impacts.velocity[:count]) / w, [float(s / w) for s in speeds[:count]],
                                   rtol=0, atol=1e-12)  # fmt: skip


def test_without_rebound_an_undamped_mass_then_touches_both_stops_at_no_speed() -> None:
    # behind its one impact x = b cos(t - t0): -b and b again, half a turn later each time
    oscillator = Oscillator.create([1.0], [1.0], 0.0, [0.0], 0.0)
    result = trajectory(oscillator, 1.0, 1.0, velocity=np.array([math.sqrt(2.0)]), periods=3, samples_per_period=8)
    assert_defined(result, 1.0, 6.0 * math.pi)
    assert result.impacts.time[0] == pytest.approx(math.pi / 4, abs=1e-14)
    behind = result.time > result.impacts.time[0]
    exact = np.cos(result.time[behind] - math.pi / 4)
    np.testing.assert_allclose(result.displacement[0, behind], exact, rtol=0, atol=1e-13)
    # whether it touches is beyond round-off: what is listed is so slow, and there, as to change nothing
    np.testing.assert_allclose(result.impacts.velocity[1:], 0.0, rtol=0, atol=1e-7)
    turns = (result.impacts.time[1:] - math.pi / 4) / math.pi
    np.testing.assert_allclose(turns, np.round(turns), rtol=0, atol=1e-6)
    assert result.motion.kind == "unresolved"

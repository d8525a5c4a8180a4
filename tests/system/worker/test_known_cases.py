"""Motions from given initial states that others have published, asked for as a client asks for them.

The numbers of each case are printed where its test cites, or follow from the closed forms that the tests evaluate.
"""

from __future__ import annotations

import math
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from grazemap.wire import notes_on, parse_request
from grazemap_worker.processes.conversion import core_clearance, core_oscillator
from tests.oracles.general_oracle import GeneralOracle
from tests.support.computed import whole

DIGITS = 40


def asked(body: dict[str, Any]) -> dict[str, Any]:
    """Return the document of trajectories, of a request about which there is nothing to note."""
    assert notes_on(parse_request("trajectories", body)) == []
    return whole("trajectories", body)


def one_mass(**other: Any) -> dict[str, Any]:
    """Return x'' + x = 0, without damping and forces."""
    return {"masses": [1], "stiffnesses": [1], "damping": [0], "forcing": [0]} | other


def exact_run(body: dict[str, Any]) -> GeneralOracle:
    """Return the multi-precision simulation of a request with one initial state."""
    request: Any = parse_request("trajectories", body)
    state = request.states[0]
    start = {"displacement": state.displacement, "velocity": state.velocity, "phase": state.phase}
    stops = core_clearance(request.clearance)
    assert isinstance(stops, tuple)
    return GeneralOracle.of(core_oscillator(request.oscillator), request.omega, *stops, **start)


def test_a_mass_dropped_on_a_preloaded_floor_bounces_to_rest() -> None:
    """Siconos, siconos-tutorials: examples/mechanics/BouncingBallEventDriven/LinearOscillatorED, with its .ref.

    m x'' + k x = -m g above a floor at 0, from x = 1 m at rest. Between impacts the mass turns about its equilibrium,
    below the floor, so each flight lasts (2/w) atan2(v, w m g/k) if it begins at the speed v.
    """
    body = {
        "oscillator": one_mass(units="SI", masses=[1e-3], stiffnesses=[100], restitution=0.9, bias=[-9.81e-3]),
        "omega": 2.0 * math.pi,
        "clearance": {"right": None, "left": 0},
        "initial": {"displacement": [1]},
        "periods": 2,
        "samples_per_period": 20,
    }
    document = asked(body)
    impacts = document["impacts"]
    printed = [
        (0.004966983943888618, -316.2587864392096),
        (0.01490088290077536, -284.6329077952886),
        (0.02483470526778414, -256.1696170157578),
        (0.03476844253492885, -230.552655314182),
        (0.04470208524666863, -207.4973897827638),
        (0.05463562289684853, -186.7476508044874),
        (0.06456904381196302, -168.0728857240387),
    ]
    np.testing.assert_allclose(np.column_stack([impacts["time"], impacts["velocity"]])[:7], printed, rtol=1e-13)
    with mp.workdps(DIGITS):
        frequency = mp.sqrt(mp.mpf(100) / mp.mpf(1e-3))
        depth = mp.mpf(9.81e-3) / 100
        time = mp.acos(depth / (1 + depth)) / frequency
        speed = frequency * mp.sqrt((1 + depth) ** 2 - depth**2)
        times, speeds = [time], [speed]
        for _ in range(1500):
            speed *= mp.mpf(0.9)
            time += 2 * mp.atan2(speed, frequency * depth) / frequency
            times.append(time)
            speeds.append(speed)
    count = len(impacts["time"])
    assert impacts["kind"].tolist() == ["impact"] * (count - 1) + ["chatter"]
    assert count > 200
    np.testing.assert_allclose(impacts["time"], np.array(times[:count], float), rtol=1e-13)
    np.testing.assert_allclose(impacts["velocity"], -np.array(speeds[:count], float), rtol=1e-11)
    rest = document["sticking"]
    assert rest["start"] == pytest.approx([float(times[-1])], rel=1e-13)  # 0.9^1500 of the first flight is nothing
    assert rest["stop_time"] == pytest.approx([2.0], rel=1e-15)  # its weight holds it
    assert (document["final"]["displacement"], document["final"]["velocity"]) == ([0.0], [0.0])


FIRST = [
    (0.8628973305, -0.7687330612),
    (2.5970959798, -0.824639478),
    (3.784826047, -0.5358899194),
    (6.6134847918, -0.173447358),
    (7.2101893817, -0.1448532763),
    (7.5965692434, -0.0980372749),
]
SECOND = [(0.8676700703, -0.7547402397), (2.6436074171, -0.814914399), (3.9266986544, -0.4851614307)]


@pytest.mark.parametrize(
    ("omega", "forcing", "periods", "impacts", "first"),
    [
        (1.5, [0.5], 10, 22, FIRST),
        # 0.5 sin(1.5 t) + 0.2 sin(0.2 t): the orders 15 and 2 of one frequency
        (0.1, [{"amplitude": [0.5], "harmonic": 15}, {"amplitude": [0.2], "harmonic": 2}], 1, 25, SECOND),
    ],
)
def test_a_mass_that_is_pushed_against_a_wall_at_its_equilibrium(
    omega: float, forcing: Any, periods: int, impacts: int, first: list[tuple[float, float]]
) -> None:
    """flowcean, examples/hybrid_systems/benchmarks/impact_oscillator.py: x'' + 0.1 x' + 4 x = forces, x >= 0."""
    body = {
        "oscillator": {
            "matrices": {"mass": [[1]], "damping": [[0.1]], "stiffness": [[4]]},
            "forcing": forcing,
            "restitution": 0.7,
        },
        "omega": omega,
        "clearance": {"left": 0},
        "initial": {"displacement": [0.5]},
        "periods": periods,
        "times": [40.0],
    }
    document = asked(body)
    hits = document["impacts"]
    count = int(np.sum(hits["time"] <= 40.0))
    assert count == impacts
    pairs = np.column_stack([hits["time"], hits["velocity"]])
    np.testing.assert_allclose(pairs[: len(first)], first, atol=1e-9, rtol=0)
    end = document["displacement"][0, 0], document["velocity"][0, 0]
    if omega == 1.5:
        assert end == pytest.approx((0.12848981586, -0.25370276437), abs=1e-9)
    exact = exact_run(body)
    exact.run(until=40.0)
    np.testing.assert_allclose(hits["time"][:count], [float(t) for t in exact.times], atol=1e-11, rtol=0)
    np.testing.assert_allclose(hits["velocity"][:count], [float(v) for v in exact.speeds], atol=1e-11, rtol=0)
    np.testing.assert_allclose(end, np.ravel(exact.state().floats()), atol=1e-11, rtol=0)


def undamped(place: float, *phases: float) -> dict[str, Any]:
    """Return x'' + x = cos(2.5 t) with a stop on the right, from rest on it at some phases of the force."""
    return {
        "oscillator": one_mass(forcing={"amplitude": [1], "phase": [0.5 * math.pi]}, restitution=0.5),
        "omega": 2.5,
        "clearance": {"right": place},
        "initial": [{"displacement": [place], "phase": phase} for phase in phases],
        "periods": 8,
        "samples_per_period": 20,
    }


def test_a_mass_on_its_stop_is_held_while_the_force_presses_it() -> None:
    """F. Dux, impact-oscillator and imposcg: the sticking region of the undamped impact oscillator.

    On the stop at s the force that presses the mass is cos(phase) - s.
    """
    border = math.acos(0.4)
    assert border == pytest.approx(1.1592794807274085, rel=1e-15)
    inside, outside = (border - 1e-9, -border + 1e-9, 0.0, 0.7), (border + 1e-9, -border - 1e-9, 2.0, math.pi)
    for place, held, free in (
        (2.0, (), (0.0, 1e-3, -1e-3)),  # never
        (1.0, (), (0.0, 1e-3, -1e-3)),  # it is not pressed but for a moment
        (0.4, inside, outside),
    ):
        runs = asked(undamped(place, *held, *free))["trajectories"]
        at_once = [run["sticking"]["start"][:1].tolist() == [0.0] for run in runs]
        assert at_once == [True] * len(held) + [False] * len(free)
        for phase, run in zip(held, runs, strict=False):
            release = run["sticking"]["stop_time"][0]
            assert release == pytest.approx((border - phase) / 2.5, abs=1e-14)
    # it leaves the other stops, and this one never
    (run,) = asked(undamped(-1.4, 0.0))["trajectories"]
    assert (run["sticking"]["start"].tolist(), len(run["impacts"]["time"])) == ([0.0], 0)
    assert run["sticking"]["stop_time"][0] == run["time"][-1]


def test_a_mass_that_was_released_from_its_stop_returns_to_it() -> None:
    document = asked(undamped(0.4, 0.0))["trajectories"][0]
    assert document["sticking"]["stop_time"][0] == pytest.approx(0.463711792291, abs=1e-12)
    printed = [
        (5.375990119, 0.745120411),
        (9.788212028, 0.424256087),
        (10.610850707, 0.12039718),
        (15.361393332, 0.721293813),
    ]
    pairs = np.column_stack([document["impacts"]["time"], document["impacts"]["velocity"]])
    np.testing.assert_allclose(pairs[:4], printed, atol=1e-9, rtol=0)
    with mp.workdps(DIGITS):  # the first flight, and the second one
        w, place, restitution = mp.mpf("2.5"), mp.mpf(0.4), mp.mpf(0.5)
        begin, x, v = mp.acos(place) / w, place, mp.mpf(0)
        steady = 1 / (1 - w * w)
        for k in range(2):
            a, b = x - steady * mp.cos(w * begin), v + steady * w * mp.sin(w * begin)

            def at(t: Any, a: Any = a, b: Any = b, begin: Any = begin) -> Any:
                return a * mp.cos(t - begin) + b * mp.sin(t - begin) + steady * mp.cos(w * t)

            time = mp.findroot(lambda t: at(t) - place, mp.mpf(float(pairs[k, 0])))
            speed = mp.diff(at, time)
            assert pairs[k] == pytest.approx((float(time), float(speed)), abs=1e-13)
            begin, x, v = time, place, -restitution * speed


def test_impacts_at_the_resonance_of_an_elastic_wall_gain_the_same_speed_each_time() -> None:
    """A. V. Dyskin, E. Pasternak, E. Pelinovsky, Journal of Sound and Vibration 331 (2012) 2856-2873.

    x'' + x = F sin(2 t), x >= 0, R = 1: impacts at n pi, each faster by 4 F/3.
    """
    body = {
        "oscillator": one_mass(forcing=[1], restitution=1),
        "omega": 2.0,
        "clearance": {"left": 0},
        "initial": {"velocity": [1]},
        "periods": 20,
        "samples_per_period": 20,
    }
    impacts = asked(body)["impacts"]
    number = np.arange(1, 20)
    assert len(impacts["time"]) in (19, 20)  # round-off decides whether the record ends before the last one
    np.testing.assert_allclose(impacts["time"][:19], math.pi * number, rtol=1e-12)
    np.testing.assert_allclose(impacts["velocity"][:19], -(1.0 + 4.0 / 3.0 * number), rtol=1e-12)


def test_a_mass_between_two_walls_is_pinned_by_a_square_wave() -> None:
    """Julia Discourse, topic 44376: limit stops, with the first 20 harmonics of the square wave."""
    body = {
        "oscillator": {
            "units": "SI",
            "matrices": {"mass": [[1]], "damping": [[0.2]], "stiffness": [[1]]},
            "forcing": [{"amplitude": [-20.0 / (math.pi * k)], "harmonic": k} for k in range(1, 40, 2)],
            "restitution": 0,
        },
        "omega": 0.5 * math.pi,
        "clearance": {"right": 3, "left": 3},
        "initial": {"displacement": [1], "velocity": [1]},
        "periods": 2,
        "samples_per_period": 400,
    }
    document = asked(body)
    impacts, rests = document["impacts"], document["sticking"]
    assert impacts["stop"].tolist() == rests["stop"].tolist() == [-1, 1, -1, 1]
    printed = [(1.466709, -5.1665), (3.391534, 6.87341), (5.391534, -6.87341)]
    pairs = np.column_stack([impacts["time"], impacts["velocity"]])
    np.testing.assert_allclose(pairs[:3], printed, rtol=0, atol=1e-5)
    printed = [(1.466709, 1.984153), (3.391534, 3.984153)]
    np.testing.assert_allclose(np.column_stack([rests["start"], rests["stop_time"]])[:2], printed, rtol=0, atol=1e-5)
    exact = exact_run(body)
    exact.run(until=7.9)
    np.testing.assert_allclose(impacts["time"], [float(t) for t in exact.times], atol=1e-12, rtol=0)
    np.testing.assert_allclose(impacts["velocity"], [float(v) for v in exact.speeds], atol=1e-12, rtol=0)
    np.testing.assert_allclose(rests["stop_time"][:3], [float(t) for t in exact.releases[:3]], atol=1e-12, rtol=0)


@pytest.mark.parametrize("omega", [7.0, 0.55, 333.0])
def test_a_mass_thrown_from_an_elastic_stop_at_its_equilibrium_returns_forever(omega: float) -> None:
    """The rigid limit of Code_Aster's SDND101 (V5.01.101): m = 100 kg, k = 1e4 N/m, 1 m/s, no forces."""
    body = {
        "oscillator": one_mass(units="SI", masses=[100], stiffnesses=[1e4], restitution=1),
        "omega": omega,
        "clearance": {"left": 0},
        "initial": {"velocity": [1]},
        "periods": max(1, round(10.0 * omega / 7.0)),
        "samples_per_period": 20,
        "observables": ["impulse", "impulse_left", "dissipated_power", "mean_impact_speed_left"],
    }
    document = asked(body)
    impacts = document["impacts"]
    number = int(body["periods"] * 2.0 * math.pi / omega / (0.1 * math.pi))
    assert number > 10
    np.testing.assert_allclose(impacts["time"], 0.1 * math.pi * np.arange(1, number + 1), rtol=1e-13)
    np.testing.assert_allclose(impacts["velocity"], -np.ones(number), rtol=1e-13)
    assert document["impulse"] == document["impulse_left"] == pytest.approx(200.0 * number / body["periods"], rel=1e-13)
    assert document["mean_impact_speed_left"] == pytest.approx(1.0, rel=1e-13)
    assert document["dissipated_power"] == pytest.approx(0.0, abs=1e-12)


def test_an_elastic_mass_between_two_stops_keeps_its_speed() -> None:
    """The rigid limit of the compliant stoppers of Mathematica Stack Exchange: stops at 1/2, 1 m/s from the middle."""
    body = {
        "oscillator": one_mass(restitution=1),
        "omega": 1.0,
        "clearance": 0.5,
        "initial": {"velocity": [1]},
        "periods": 3,
    }
    impacts = asked(body)["impacts"]
    # asin(1/2) from the middle to a stop; cos of it is the speed there
    times = math.pi / 6.0 * np.arange(1, 2 * len(impacts["time"]), 2)
    assert len(times) == 18
    np.testing.assert_allclose(impacts["time"], times, rtol=1e-13)
    np.testing.assert_allclose(impacts["velocity"], 0.5 * math.sqrt(3.0) * (-1.0) ** np.arange(18), rtol=1e-13)


@pytest.mark.parametrize("omega", [1.0, 0.37, 3.3])
def test_a_mass_on_a_spring_meets_another_one_and_stays_with_it(omega: float) -> None:
    """Masses 1 and 2 on springs 1 and 8 to ground, which touch in equilibrium; R = 0, no damping, no forces.

    Mass 1 is pulled back by 3 and meets mass 2 after a quarter of its period, at the speed 3. They go on together at
    the speed 1, with the frequency sqrt 3, for half a period: then mass 2 would turn back sooner. After another time of
    pi they meet where they parted, each at the speed 1, and part again at once. Each later meeting is as the last one,
    at a third of its speed.
    """
    body = {
        "oscillator": {
            "matrices": {"mass": [[1, 0], [0, 2]], "damping": [[0, 0], [0, 0]], "stiffness": [[1, 0], [0, 8]]},
            "contact": [1, 2],
            "forcing": [0, 0],
            "restitution": 0,
        },
        "omega": omega,
        "clearance": {"right": 0},
        "initial": {"displacement": [-3, 0]},
        "periods": math.ceil(14.0 * omega / (2.0 * math.pi)),
        "times": [0.5 * math.pi + 0.5],
    }
    document = asked(body)
    impacts, rests = document["impacts"], document["sticking"]
    together = math.pi / math.sqrt(3.0)
    number = len(impacts["time"])
    assert number >= 4
    times = np.append(0.5 * math.pi, 0.5 * math.pi + together + math.pi * np.arange(1, number))
    np.testing.assert_allclose(impacts["time"], times, rtol=1e-13)
    np.testing.assert_allclose(impacts["velocity"], np.append(3.0, 2.0 / 3.0 ** np.arange(number - 1)), rtol=1e-12)
    assert rests["start"] == pytest.approx([0.5 * math.pi], rel=1e-14)
    assert rests["stop_time"] == pytest.approx([0.5 * math.pi + together], rel=1e-14)
    place, speed = math.sin(0.5 * math.sqrt(3.0)) / math.sqrt(3.0), math.cos(0.5 * math.sqrt(3.0))
    np.testing.assert_allclose(document["displacement"][:, 0], [place, place], rtol=1e-13)
    np.testing.assert_allclose(document["velocity"][:, 0], [speed, speed], rtol=1e-13)
    assert document["undecided"] == 0

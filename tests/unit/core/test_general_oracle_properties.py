"""The multi-precision simulator of any structure: balances, symmetries, closed forms and near grazes."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flint import arb

from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.series_roots import Precision, Undecided, first_fall, power_of_ten
from tests.support.general_figures import assert_equal_to, decimal_chain, number


def random_system(seed: int, restitution: tuple[float, float] = (0.8, 0.6), gap: float = 0.3) -> GeneralOracle:
    """Return a dense system with a gyroscopic, not proportional C, two harmonics and a bias."""
    random = np.random.default_rng(seed)
    size = int(random.integers(2, 5))
    mass, stiffness, damping = (
        root @ root.T + 0.3 * size * np.eye(size) for root in random.normal(size=(3, size, size))
    )
    turn = random.normal(size=(size, size))
    forces = random.normal(size=(2, size)) + 1j * random.normal(size=(2, size))
    return GeneralOracle(
        mass=(0.5 * (mass + mass.T)).tolist(),
        damping=(0.05 * (damping + damping.T) + turn - turn.T).tolist(),
        stiffness=(0.5 * (stiffness + stiffness.T)).tolist(),
        contact=random.normal(size=size).tolist(),
        harmonics=[(1, forces[0].tolist()), (3, forces[1].tolist())],
        bias=(0.1 * random.normal(size=size)).tolist(),
        restitution=restitution,
        gaps=(gap, 1.5 * gap),
        omega=float(random.uniform(0.2, 0.6)),
        phase=float(random.uniform(0.0, 6.0)),
    )


@pytest.mark.parametrize(
    ("seed", "restitution", "rests"),
    [(0, (0.8, 0.9), False), (3, (0.9, 0.7), False), (0, (0.2, 0.3), True), (11, (0.0, 0.4), True)],
)
def test_energy_and_momentum_balance(seed: int, restitution: tuple[float, float], rests: bool) -> None:
    run, end = random_system(seed, restitution), 12.0
    walk = replace(run)
    start = walk.state().floats()
    run.run(until=end)
    assert len(run.times) > 5
    assert bool(run.rests) == rests
    mass, damping, stiffness = map(np.array, (run.mass, run.damping, run.stiffness))
    h, bias = np.array(run.contact), np.array(run.bias)
    amplitudes = {order: np.array(forces) for order, forces in run.harmonics}

    def forcing(time: float) -> np.ndarray:
        angle = run.omega * time + run.phase
        return bias + sum((f * np.exp(1j * k * angle)).imag for k, f in amplitudes.items())

    # impulses and work by quadrature between events
    nodes, weights = np.polynomial.legendre.leggauss(10)
    borders = [0.0, *(float(t) for t in sorted([*run.times, *run.rests, *run.releases])), end]
    pieces = [np.linspace(a, b, 2 + int(4 * (b - a))) for a, b in itertools.pairwise(borders) if b > a]
    impulse, work = np.zeros(len(h)), 0.0
    for piece in pieces:
        for a, b in itertools.pairwise(piece):
            for node, weight in zip(nodes, weights, strict=True):
                time = 0.5 * (a + b + (b - a) * node)
                walk.run(until=time)
                x, v = walk.state().floats()
                share = 0.5 * (b - a) * weight
                impulse += share * (forcing(time) - stiffness @ x - damping @ v)
                work += share * v @ (forcing(time) - bias - damping @ v)
    walk.run(until=end)
    x, v = walk.state().floats()
    # what is left of the change of momentum is along h
    change = mass @ (v - start[1]) - impulse
    along = h @ change / (h @ h)
    assert np.abs(change - along * h).max() < 1e-11
    effective_mass = 1.0 / (h @ np.linalg.solve(mass, h))
    factors = [restitution[0] if stop > 0 else restitution[1] for stop in run.stops]
    speeds = [float(speed) for speed in run.speeds]
    if not rests:
        kicks = [(1 + r) * effective_mass * u for r, u in zip(factors, speeds, strict=True)]
        assert along == pytest.approx(-sum(kicks), rel=1e-11)

    def energy(x: np.ndarray, v: np.ndarray) -> float:
        return float(0.5 * v @ mass @ v + 0.5 * x @ stiffness @ x - bias @ x)

    lost = sum(0.5 * effective_mass * (1 - r**2) * u**2 for r, u in zip(factors, speeds, strict=True))
    assert lost > 0.0
    assert energy(x, v) - energy(*start) == pytest.approx(work - lost, abs=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_mirror_images_and_twice_the_contact_row_and_gaps_change_no_time(seed: int) -> None:
    run = random_system(seed, (0.2, 0.7))
    mirrored = replace(
        run,
        harmonics=[(order, [-f for f in forces]) for order, forces in run.harmonics],
        bias=[-s for s in run.bias or []],
        restitution=run.restitution[::-1],
        gaps=run.gaps[::-1],
    )
    doubled = replace(run, contact=[2 * h for h in run.contact], gaps=tuple(2 * gap for gap in run.gaps))
    for oracle in (run, mirrored, doubled):
        oracle.run(60, 30.0)
    assert len(run.times) > 8
    for image, side, speeds in ((mirrored, -1, -1), (doubled, 1, 2)):
        assert image.stops == [side * stop for stop in run.stops]
        assert image.held_on == [side * stop for stop in run.held_on]
        for name in ("times", "rests", "releases"):
            assert_equal_to(getattr(image, name), getattr(run, name), 1e-40)
        with digits(60):
            expected = [speeds * speed for speed in run.speeds]
        assert_equal_to(image.speeds, expected, 1e-40)


def free_mass(gap: Any, velocity: float, **other: Any) -> GeneralOracle:
    """Return x'' + x = 0 without damping, from x = 0."""
    numbers = {
        "mass": [[1]],
        "damping": [[0]],
        "stiffness": [[1]],
        "contact": [1],
        "harmonics": [],
        "restitution": (1.0, 1.0),
        "gaps": (gap, None),
        "omega": 1.0,
        "displacement": [0.0],
        "velocity": [velocity],
    }
    return GeneralOracle(**(numbers | other))


def test_a_near_graze_is_decided_by_thirty_digits() -> None:
    with digits(60):
        small = arb(10) ** -30
        inside, outside = (1 - small).mid(), (1 + small).mid()
        angle = inside.asin().mid()
    run = free_mass(inside, 1.0)
    run.run(2, 40.0)
    with digits(60):
        # thrown back elastically, the mass needs 2 pi - 2 (pi/2 - angle) to come again
        expected = [angle, (arb.pi() + 3 * angle).mid()]
    assert_equal_to(run.times, expected, 1e-40)
    run = free_mass(outside, 1.0)
    run.run(1, 100.0)
    assert run.times == []
    with pytest.raises(Undecided):
        free_mass(1.0, 1.0).run(1, 10.0)


def test_a_ball_that_bounces_to_rest_is_that_of_the_closed_form() -> None:
    # from the height 1/2 under the acceleration 1: impacts at 1, and R^k 2 later each; at rest for ever
    ball = free_mass(
        None, 0.0, stiffness=[[0]], gaps=(None, 0.0), restitution=(0.5, 0.5), bias=[-1.0], displacement=[0.5]
    )
    ball.run(until=20.0)
    with digits(60):
        expected, time = [arb(1)], arb(1)
        for k in range(1, len(ball.times)):
            time = time + 2 * arb(2) ** -k
            expected.append(time)
    assert len(ball.times) > 60
    assert_equal_to(ball.times, expected, 1e-50)
    assert_equal_to(ball.rests, [arb(3)], 1e-50)
    assert ball.releases == []
    assert ball.state().floats()[0].tolist() == [0.0]


def test_a_preloaded_stop_holds_the_structure_from_the_start() -> None:
    run = decimal_chain(("-0.05", None), "0.29", "0.8", bias=[number("0.05"), 0, 0], harmonics=[])
    run.run(until=50.0)
    assert (run.times, run.releases, run.held_on) == ([], [], [1])
    x = run.state().displacement
    with digits(60):
        # masses 2 and 3 in equilibrium, mass 1 on the stop
        assert_equal_to(
            [6 * x[1] - x[0] - 5 * x[2], 10 * x[2] - 5 * x[1], x[0]], [arb(0), arb(0), number("-0.05")], 1e-45
        )
    # a force that pulls takes it off the stop, again and again
    moved = replace(run, harmonics=[(1, [number("0.2"), 0, 0])])
    moved.run(until=100.0)
    assert len(moved.releases) >= 4


def test_a_start_on_a_stop_is_an_impact_or_none() -> None:
    toward, away = (free_mass(1.0, sign, displacement=[1.0], restitution=(0.5, 0.5)) for sign in (1.0, -1.0))
    toward.run(1)
    assert (toward.times, toward.stops) == ([0], [1])
    away.run(1)
    with digits(60):
        assert_equal_to(away.times, [(3 * arb.pi() / 2).mid()], 1e-45)
    without = free_mass(np.inf, 1.0)
    without.run(until=10.0)
    assert without.times == []
    with pytest.raises(ValueError, match="beyond"):
        free_mass(1.0, 0.0, displacement=[1.5]).run(1)


def test_pieces_of_a_run_are_the_run() -> None:
    whole, pieces = (decimal_chain(("1.2", "1.3"), "0.1", "0.3") for _ in range(2))
    whole.run(until=60.0)
    for end in np.linspace(0.0, 60.0, 101)[1:]:
        pieces.run(until=float(end))
    assert len(whole.times) > 20
    assert len(whole.rests) >= 1
    assert pieces.stops == whole.stops
    for name in ("times", "rests", "releases"):
        assert_equal_to(getattr(pieces, name), getattr(whole, name), 1e-40)
    assert_equal_to(pieces.state().velocity, whole.state().velocity, 1e-40)


@pytest.mark.parametrize("depth", [1e-8, -1e-8, 1e-20, -1e-20])
def test_a_lowest_value_decides_whether_a_series_falls_to_zero(depth: float) -> None:
    with digits(50):
        a, d = arb(0.3), arb(depth)
        fall = first_fall([a * a + d, -2 * a, arb(1)], 1.0, Precision(50, arb(1e-45)))
        expected = None if depth > 0 else a - (-d).sqrt()
        assert (fall is None) == (expected is None)
        if fall is not None:
            assert abs(fall - expected) < 1e-30
        with pytest.raises(Undecided):
            first_fall([a * a, -2 * a, arb(1)], 1.0, Precision(50, arb(1e-45)))


def test_a_zero_is_found_to_more_digits_than_a_float_has_exponents() -> None:
    with digits(1000):
        root = arb(2).sqrt().mid() - 1  # of 1 - 2 t - t^2
        fall = first_fall([arb(1), arb(-2), arb(-1)], 1.0, Precision(1000, power_of_ten(-1000)))
        assert fall is not None
        assert abs(fall - root) < power_of_ten(-990)


def test_a_contact_is_known_to_more_digits_than_a_float_has_exponents() -> None:
    run = free_mass(0.5, 1.0, digits=1000)
    run.run(1)
    with digits(1000):
        (time,) = run.times
        assert abs(time - arb.pi() / 6) < power_of_ten(-990)

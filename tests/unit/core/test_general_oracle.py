"""The multi-precision simulator of any structure against printed figures and the simulator of a chain."""

from __future__ import annotations

from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest
from flint import acb, arb, arb_mat

from grazemap_core.model.drive import base_in_space, force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.event_oracle import EventOracle
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.support.general_figures import (
    FIGURES,
    after_periods,
    assert_equal_to,
    assert_printed,
    decimal_chain,
    decimal_mass,
    number,
)
from tests.support.oscillators import DEFAULT

T = [[2, 1, -1], [1, 3, 0], [-1, 1, 2]]  # an invertible matrix with exact numbers


def test_a_trajectory_between_unequal_stops_has_all_printed_digits() -> None:
    figure = FIGURES["unequal-stops/trajectory"]
    run = decimal_chain(("1.6", "1.75"), "0.29", "0.8")
    run.run(until=after_periods(200, "0.29"))
    assert [len(run.times), run.stops.count(1), run.stops.count(-1)] == [
        figure[name] for name in ("impacts", "right", "left")
    ]
    listed = len(figure["first_times"])
    assert run.stops[:listed] == figure["first_stops"]
    assert_printed(run.times[:listed], figure["first_times"])
    assert_printed(run.speeds[:listed], figure["first_velocities"])
    assert_printed(run.state().displacement, figure["final_displacement"])
    assert_printed(run.state().velocity, figure["final_velocity"])
    assert not run.rests


def test_an_error_of_the_first_displacement_grows_as_printed() -> None:
    run = decimal_chain(("1.6", "1.75"), "0.29", "0.8")
    run.run(40)
    growth = run.growth([1, 0, 0])
    assert max(growth.times) == pytest.approx(float(FIGURES["unequal-stops/trajectory"]["error_growth"][0]), abs=5e-4)
    # the derivative does not depend on the size of the change
    finer = replace(run, digits=70)
    finer.run(40)
    assert finer.growth([1, 0, 0]).times == pytest.approx(growth.times, rel=1e-12)


def test_a_contact_between_two_masses_has_all_printed_digits() -> None:
    figure = FIGURES["relative/first_impact"]
    run = decimal_chain(("0.8", "1.1"), "0.29", "0.8", contact=[1, -1, 0])
    run.run(1)
    assert_printed([*run.times, *run.speeds], [figure["first_impact_time"], figure["first_impact_velocity"]])


@pytest.mark.parametrize(
    ("name", "run", "omega"),
    [
        ("stick/chain-one-stop", decimal_chain(("1.2", None), "0.1", "0.3"), "0.1"),
        ("stick/coco-like", decimal_mass("0.6", "0.3", "0.3"), "0.3"),
    ],
)
def test_chatter_and_release_have_all_printed_digits(name: str, run: GeneralOracle, omega: str) -> None:
    figure = FIGURES[name]
    run.run(until=after_periods(6, omega))
    for kind, times in (("accumulation", run.rests), ("release", run.releases)):
        assert_printed(times, [time for which, time, _ in figure["events"] if which == kind])
    assert run.held_on == [stop for which, _, stop in figure["events"] if which == "accumulation"]
    first = figure["first_impacts"]
    assert_printed(run.times[: len(first)], [time for time, _, _ in first])
    assert_printed(run.speeds[: len(first)], [speed for _, _, speed in first])
    assert_printed(run.state().displacement, figure["final_displacement"])
    assert_printed(run.state().velocity, figure["final_velocity"])


def test_printed_orbits_repeat() -> None:
    orbits = [orbit | {"gap": orbit["effective_gap"]} for orbit in FIGURES["coco/orbits"]]
    book = FIGURES["coco/book_orbit"]
    of_book = {"omega": "1", "n": 1, "v": book["v_before"], "gap": "1", "impact_phase_wt": book["impact_time_mod_2pi"]}
    for orbit in [*orbits, of_book]:
        with digits(60):
            start = {"displacement": [number(orbit["gap"])], "velocity": [-(number("0.8") * number(orbit["v"])).mid()]}
        run = decimal_mass(orbit["gap"], orbit["omega"], "0.8", **start, phase=number(orbit["impact_phase_wt"]))
        run.run(2)
        assert_equal_to(run.times, [after_periods(orbit["n"] * k, orbit["omega"]) for k in (1, 2)], 1e-21)
        assert_printed(run.speeds, [orbit["v"]] * 2, 1e-21)


def steady_amplitude(run: GeneralOracle, contact: list[int]) -> arb:
    """Return the amplitude after so many periods that nothing else is left: from q and q' at one moment."""
    run.run(until=after_periods(700, "0.29"))
    state = run.state()
    with digits(60):
        q, rate = (
            sum((h * x for h, x in zip(contact, part, strict=True)), arb(0))
            for part in (state.displacement, state.velocity)
        )
        return (q**2 + (rate / number("0.29")) ** 2).sqrt().mid()


@pytest.mark.parametrize(
    ("name", "contact", "on_ground"),
    [
        ("A_stops_in_space", [1, 0, 0], False),
        ("A_stops_on_ground", [1, 0, 0], True),
        ("A_between_1_and_2", [1, -1, 0], False),
    ],
)
def test_a_moving_base_has_all_printed_digits(name: str, contact: list[int], on_ground: bool) -> None:
    with digits(60):
        w = number("0.29")
        forces = [w**2 * m for m in (1, 10, 10)] if on_ground else [arb(0), arb(0), acb(5, number("0.5") * w)]
    run = decimal_chain((None, None), "0.29", "0.8", contact=contact, harmonics=[(1, forces)])
    assert_printed([steady_amplitude(run, contact)], [FIGURES["base/amplitudes"][name]])


def test_a_bias_moves_the_stops_as_printed() -> None:
    figure = FIGURES["bias/equivalent"]
    biased = decimal_chain(("1.65", "1.65"), "0.29", "0.8", bias=[number("0.05"), 0, 0])
    plain = decimal_chain((figure["effective_right"], figure["effective_left"]), "0.29", "0.8")
    for run in (biased, plain):
        run.run(20)
    assert biased.stops == plain.stops
    assert_equal_to(biased.times, plain.times, 1e-45)
    with digits(60):
        moved = biased.state().displacement[0] - plain.state().displacement[0]
        assert abs(moved - number(figure["q_e"])) < 1e-45


def test_a_chain_moves_as_in_its_own_simulator() -> None:
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], [0.1, 0.5, 0.4], [1.0, 0.0, 0.0], 0.8)
    event = EventOracle.of(chain, 0.29, 1.6)
    event.run(20)
    general = GeneralOracle.between(chain, 0.29, 1.6)
    general.run(20)
    assert general.stops == event.stops
    for values, expected in ((general.times, event.times), (general.speeds, event.speeds)):
        with mp.workdps(50):
            assert all(abs(mp.mpf(a.str(50, radius=False)) - b) < 1e-36 for a, b in zip(values, expected, strict=True))


def test_a_chain_and_its_matrices_move_alike() -> None:
    chain = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.0625, [1.0, 0.0, 0.0], 0.5)
    dense = Oscillator.of_structure(
        Matrices.create(chain.mass_matrix, chain.stiffness_matrix, chain.damping_matrix), [1, 0, 0], chain.drive, 0.5
    )
    runs = [GeneralOracle.of(oscillator, 0.29, 1.6, 1.6) for oscillator in (chain, dense)]
    for run in runs:
        run.run(30)
    assert_equal_to(runs[0].times, runs[1].times, 1e-50)


@pytest.mark.parametrize("contact", [[1, 0, 0], [0, 0, 1]])
def test_sticking_of_a_chain_is_the_same_in_any_coordinates(contact: list[int]) -> None:
    # x = T z: the same motion with full matrices and a full contact row
    oscillator = Oscillator.create([1.0, 2.0, 3.0], [1.0, 0.5, 2.0], [0.1, 0.05, 0.2], [1.0, 0.25, -0.5], 0.5)
    plain = GeneralOracle.of(oscillator, 0.125, 0.25, 0.25)
    with digits(60):
        turn = arb_mat(T) if contact == [1, 0, 0] else arb_mat([T[1], T[2], T[0]]).transpose()
        of_mass, of_rate, of_place = (
            (turn.transpose() * arb_mat(rows) * turn).mid().tolist()
            for rows in (plain.mass, plain.damping, plain.stiffness)
        )
        row = (arb_mat([[1, 0, 0]]) * turn).entries()
        forces = (turn.transpose() * arb_mat([[f.real] for f in plain.harmonics[0][1]])).entries()
    turned = GeneralOracle(of_mass, of_rate, of_place, row, [(1, forces)], (0.5, 0.5), (0.25, 0.25), 0.125)
    for run in (plain, turned):
        run.run(until=1000.0, releases=2)
    assert (turned.stops, turned.held_on) == (plain.stops, plain.held_on)
    assert_equal_to(turned.rests, plain.rests, 1e-25)
    assert_equal_to(turned.times, plain.times, 1e-40)
    assert_equal_to(turned.releases, plain.releases, 1e-40)


def test_orders_and_phases_are_those_of_the_forcing() -> None:
    once = decimal_mass("0.6", "0.5", "0.8", phase=number("0.25"))
    twice = replace(once, harmonics=[(2, [1j])], omega=number("0.25"), phase=number("0.125"))
    with digits(60):
        turned = replace(once, harmonics=[(1, [acb(0, 1) * acb(0, number("0.25")).exp()])], phase=0.0)
    for run in (once, twice, turned):
        run.run(12)
    for run in (twice, turned):
        assert_equal_to(run.times, once.times, 1e-40)


def test_laws_of_forces_are_evaluated_in_multi_precision() -> None:
    chain = DEFAULT.structure
    drive = [base_in_space(0.5, *chain.ground_forces(np.ones(3))), force(2, np.array([0.3, 0.0, 0.1]), unbalance=True)]
    run = GeneralOracle.of(Oscillator.of_structure(chain, [1.0, 0.0, -1.0], drive, 0.8, None, 0.7), 0.29, 1.0, None)
    assert (run.restitution, run.gaps, run.contact) == ((0.8, 0.7), (1.0, None), [1.0, 0.0, -1.0])
    with digits(60):
        w, (stiffness, rate) = arb(0.29), chain.ground_forces(np.ones(3))
        expected = [acb(0.5 * stiffness[2], w * arb(0.5 * rate[2])), 4 * w * w * arb(0.3)]
        amplitudes = [run.harmonics[0][1][2], run.harmonics[1][1][0]]
        assert all(abs(a - b) < 1e-55 for a, b in zip(amplitudes, expected, strict=True))
    assert [order for order, _ in run.harmonics] == [1, 2]

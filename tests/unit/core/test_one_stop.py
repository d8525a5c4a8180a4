"""Grazes of one stop: double grazes against 50 digits and a dense search, recurrences and margins against sums.

The sums of the impulse response are added up term by term.
"""

from __future__ import annotations

import numpy as np
import pytest
from flint import acb, acb_mat, acb_poly, arb
from scipy.optimize import minimize_scalar

from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.coincident_grazes import Coincidence, vanishing_margins
from grazemap_core.grazing.grazing_curve import VariedStop, grazing_curve, stop_grazes
from grazemap_core.model.drive import base_in_space, force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import contact_response
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.tolerances import EPSILON
from tests.oracles.fifty_digits import digits
from tests.support.general_systems import positive
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import the_first

BIASED = Oscillator.of_structure(DEFAULT.structure, DEFAULT.contact, DEFAULT.drive, 0.8, [0.05, 0.0, 0.0])


def random_oscillator(seed: int) -> Oscillator:
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 6))
    mass, stiffness, damping = (positive(random, size) for _ in range(3))
    structure = Matrices.create(mass, stiffness, 0.05 * damping)
    law = [force(1, random.normal(size=size), random.normal(size=size), unbalance=seed % 3 == 1)]
    if seed % 3 == 2:
        law = [base_in_space(0.7, *structure.ground_forces(random.normal(size=size)))]
    return Oscillator.of_structure(structure, random.normal(size=size), law, 0.8, random.normal(size=size))


def double_grazes(oscillator: Oscillator, gap: float, start: float, stop: float) -> list[Coincidence]:
    """Where the amplitude is `gap`: the other stop has that gap from the equilibrium."""
    return vanishing_margins(oscillator, VariedStop(1, gap - contact_equilibrium(oscillator)), start, stop)


@pytest.mark.parametrize("seed", the_first(1, range(100)))
def test_every_double_graze_is_found(seed: int) -> None:
    oscillator, omega = random_oscillator(seed), np.linspace(0.05, 4.0, 40_000)
    amplitude = np.abs(contact_response(oscillator, omega)[:, 0])
    for share in (0.02, 0.2, 0.7):
        gap = amplitude.min() + share * (amplitude.max() - amplitude.min())
        before = np.flatnonzero(np.diff(np.sign(amplitude - gap)))
        places = np.array([graze.omega for graze in double_grazes(oscillator, float(gap), 0.05, 4.0)])
        assert len(places) == len(before)
        assert np.all((omega[before] <= places) & (places <= omega[before + 1]))
        assert np.abs(contact_response(oscillator, places)[:, 0]) == pytest.approx(gap, rel=1e-13)


def through(places: list[acb], values: list[acb]) -> acb_poly:
    """Return the polynomial with these values."""
    total = acb_poly([0])
    for place, value in zip(places, values, strict=True):
        others = [other for other in places if other is not place]
        term = acb_poly([value])
        for other in others:
            term = term * acb_poly([-other, 1]) * (1 / (place - other))
        total += term
    return total


def exact_double_grazes(oscillator: Oscillator, gap: float) -> list[float]:
    """Return all omega with |X| = gap: the real zeros of |N|^2 - gap^2 |D|^2, where X = N/D, polynomials of omega."""
    size, (force_on_all,) = oscillator.size, oscillator.drive[0].amplitudes(np.ones(1))
    parts = oscillator.stiffness_matrix, 1j * oscillator.damping_matrix, -oscillator.mass_matrix
    places, numerator, denominator = [acb(k) / size for k in range(2 * size + 1)], [], []
    for omega in places:
        dynamic = acb_mat(size, size)
        for power, matrix in enumerate(parts):
            dynamic += acb_mat([[acb(x.real, x.imag) for x in row] for row in matrix.tolist()]) * omega**power
        forces = acb_mat([[acb(x.real, x.imag)] for x in force_on_all.tolist()])
        row = acb_mat([[acb(x) for x in oscillator.contact.tolist()]])
        denominator.append(dynamic.det())
        numerator.append((row * dynamic.solve(forces))[0, 0] * denominator[-1])
    squares = [
        each * acb_poly([x.conjugate() for x in each.coeffs()])
        for each in (through(places, numerator), through(places, denominator))
    ]
    coefficients = [x.real.mid() for x in (squares[0] - acb(gap) ** 2 * squares[1]).coeffs()]
    zeros = acb_poly([acb(x) for x in coefficients]).roots(tol=arb(10) ** -40, maxprec=4000)
    return sorted(float(zero.real.mid()) for zero in zeros if abs(float(zero.imag.mid())) < 1e-25)


@pytest.mark.parametrize("seed", the_first(4, range(0, 120, 3)))
def test_the_double_grazes_are_all_those_of_fifty_digits(seed: int) -> None:
    oscillator, omega = random_oscillator(seed), np.linspace(0.05, 4.0, 4001)
    amplitude = np.abs(contact_response(oscillator, omega)[:, 0])
    peaks = amplitude[1:-1][(amplitude[1:-1] > amplitude[:-2]) & (amplitude[1:-1] > amplitude[2:])]
    shares = amplitude.min() + np.array([0.02, 0.2, 0.7]) * (amplitude.max() - amplitude.min())
    for gap in [*shares.tolist(), *(peaks[:2] * (1.0 - 1e-9)).tolist()]:
        with digits():
            exact = [place for place in exact_double_grazes(oscillator, gap) if 0.05 <= place <= 4.0]
        grazes = double_grazes(oscillator, gap, 0.05, 4.0)
        assert all(graze.simple for graze in grazes)
        assert len(grazes) == len(exact)
        for graze, place in zip(grazes, exact, strict=True):
            assert abs(graze.omega - place) <= graze.error + EPSILON * place


@pytest.mark.thorough
def test_an_amplitude_that_only_touches_the_gap_is_a_double_graze() -> None:
    """Marked where round-off hides whether it reaches it; where it does not, both or none."""
    for low, high in ((0.05, 0.5), (0.5, 1.2)):
        minimum = minimize_scalar(
            lambda w: -np.abs(contact_response(DEFAULT, np.array([w]))[0, 0]),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 1e-12},
        )
        place, top = float(minimum.x), -float(minimum.fun)
        assert low + 0.01 < place < high - 0.01
        every = codimension_two_points(DEFAULT, low, high, 1, 0, VariedStop(1, top))
        touched = [p for p in every if p.kind == "double-graze"]
        assert "near-double" in {p.status for p in touched}
        assert [p.omega for p in touched] == pytest.approx([place] * len(touched), rel=1e-6)
        for share, number in ((1.0 - 1e-9, 2), (1.0 + 1e-9, 0), (1.0 - 1e-11, 2), (1.0 + 1e-11, 0)):
            points = codimension_two_points(DEFAULT, low, high, 1, 0, VariedStop(1, share * top))
            assert [p.status for p in points if p.kind == "double-graze"] == ["simple"] * number


def test_there_is_none_where_the_other_stop_is_too_far_or_absent() -> None:
    assert double_grazes(DEFAULT, 50.0, 0.05, 2.0) == []
    points = codimension_two_points(DEFAULT, 0.25, 0.35, 2, 1, VariedStop(1))
    assert "double-graze" not in {point.kind for point in points}
    assert {point.margin for point in points} == {None}


def test_a_graze_is_virtual_beyond_a_double_graze() -> None:
    double = double_grazes(DEFAULT, 1.5, 0.05, 0.3)[0].omega
    grazes = stop_grazes(DEFAULT, double * np.array([0.999, 1.001]), VariedStop(1, 1.5))
    assert grazes.virtual.tolist() == [False, True]
    assert stop_grazes(BIASED, [0.29], VariedStop(1, together=True)).margin[0] == pytest.approx(0.14)
    assert stop_grazes(BIASED, [0.29], VariedStop(-1, together=True)).virtual.tolist() == [True]


def test_the_phase_is_that_of_the_contact() -> None:
    omega = np.linspace(0.05, 2.5, 50)
    response = contact_response(BIASED, omega)[:, 0]
    for stop in (1, -1):
        grazes = stop_grazes(BIASED, omega, VariedStop(stop))
        at_contact = response * np.exp(1j * grazes.phase)
        assert 0.07 + at_contact.imag == pytest.approx(stop * grazes.clearance, rel=1e-14)
        assert at_contact.real == pytest.approx(0.0, abs=1e-14)
        assert np.all((grazes.phase > -np.pi) & (grazes.phase <= np.pi))


def test_impacts_recur_after_whole_periods_where_g_is_negative() -> None:
    omega = np.linspace(0.2, 1.5, 300)
    response = impulse_response(modal_model(DEFAULT))
    recurrence = stop_grazes(DEFAULT, omega, VariedStop(1), max_order=12).first_recurrence
    expected = np.zeros(len(omega), dtype=int)
    for n in range(6, 0, -1):
        expected[evaluate(response, n * 2.0 * np.pi / omega)[0] < 0.0] = 2 * n
    assert np.array_equal(recurrence, expected)
    assert np.count_nonzero(recurrence != grazing_curve(DEFAULT, omega, 12).first_recurrence) > 100


def test_recurrences_of_one_stop_are_active_where_no_smaller_number_of_periods_recurs() -> None:
    response = impulse_response(modal_model(DEFAULT))
    points = [p for p in codimension_two_points(DEFAULT, 0.2, 1.5, 8, 0, VariedStop(1)) if p.kind == "recurrence"]
    assert {point.order for point in points} == {2, 4, 6, 8}
    for point in points:
        assert point.order is not None
        returns = np.arange(1, point.order // 2) * 2.0 * np.pi / point.omega
        assert point.active == bool(np.all(evaluate(response, returns)[0] >= 0.0)) if len(returns) else point.active


def test_motions_of_one_stop_are_admissible_where_whole_periods_are_clear() -> None:
    response = impulse_response(modal_model(DEFAULT))
    points = [p for p in codimension_two_points(DEFAULT, 0.2, 1.5, 2, 4, VariedStop(1)) if p.kind == "resonant"]
    verdicts = set()
    for point in points:
        assert point.multiple is not None
        period, impulses = 2.0 * np.pi / point.omega, np.arange(400) * point.multiple
        before = np.sum(evaluate(response, impulses[1:] * period)[0])  # H(1)
        returns = [np.sum(evaluate(response, (j + impulses) * period)[0]) for j in range(1, point.multiple)]
        assert point.unfolding is not None
        if min(returns, default=np.inf) == pytest.approx(before, abs=1e-8):
            continue
        assert point.unfolding.admissible == all(other > before for other in returns), point
        verdicts.add((point.multiple, point.unfolding.admissible))
    assert {(1, True), (2, True), (2, False)} <= verdicts


def test_motions_on_stops_of_two_restitutions_unfold_differently_and_none_is_symmetric() -> None:
    both = Oscillator.of_structure(DEFAULT.structure, DEFAULT.contact, DEFAULT.drive, 0.8, None, 0.5)
    other = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.5)
    resonances = [p for p in codimension_two_points(both, 0.25, 0.35, 2, 1) if p.kind == "resonant"]
    assert not any(point.symmetric for point in resonances)
    for stop, alone in ((1, DEFAULT), (-1, other)):
        ours = [(p.omega, p.unfolding) for p in resonances if p.stop == stop]
        equal = codimension_two_points(alone, 0.25, 0.35, 2, 1)
        assert ours == [(p.omega, p.unfolding) for p in equal if p.kind == "resonant" and not p.symmetric]


def test_an_equilibrium_beyond_the_fixed_stop_is_refused() -> None:
    with refused("clearance"):
        stop_grazes(BIASED, [0.29], VariedStop(1, -0.08))

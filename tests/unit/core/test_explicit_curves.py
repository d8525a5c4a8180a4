"""Curves of motions with one impact between any stops, against orbits in 50 digits and the closed forms of one stop."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from flint import arb

from grazemap_core.grazing.grazing_curve import VariedStop, stop_grazes
from grazemap_core.grazing.kernels.periodic_impulses import UNDECIDED
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.kernels.admissibility import GIVEN_UP, MEETS, NO_FURTHER_CONTACT, TOUCHES
from grazemap_core.orbits.kernels.harmonics import within_turn, zeros_near
from grazemap_core.orbits.kernels.one_impact_contacts import StopGap
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.single_impact import special_orbits
from grazemap_core.orbits.single_impact.harmonics import Harmonics, Places, bracketed_zero
from grazemap_core.orbits.single_impact.special_orbits import (
    ABSENT,
    AdmissibleFrom,
    SpecialOrbit,
    StopMotions,
)
from grazemap_core.orbits.single_impact.window_curves import BOTH_STOPS, CurvePiece, window_curves
from tests.oracles.fifty_digits import digits
from tests.oracles.impact_orbit_oracle import OneImpact
from tests.support.general_systems import random_oscillator
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused


@functools.cache
def dense() -> Oscillator:
    """Four masses, dense matrices, harmonics 1 and 3, a bias, two restitutions."""
    return random_oscillator(np.random.default_rng(15), 15)


def pieces(stop: int, other: float | None = None) -> list[CurvePiece]:
    return window_curves(dense(), (0.5, 1.5), (0.1, 1.0), 2, 60, VariedStop(stop, other))


@pytest.mark.parametrize("stop", [1, -1])
def test_curves_of_one_stop_of_a_dense_structure_are_orbits_with_a_multiplier_of_1_or_minus_1(stop: int) -> None:
    """Each to 1e-11 of the orbit in 50 digits whose multiplier is exactly that."""
    compared = {"SN": 0, "PD": 0}
    for piece in pieces(stop):
        if piece.type not in compared or compared[piece.type] >= 3:
            continue
        assert (piece.impacts_right, piece.impacts_left) == ((1, -1) if stop > 0 else (-1, 1))
        middle = len(piece.omega) // 2
        with digits():
            known = OneImpact(dense(), arb(float(piece.omega[middle])), 2 * piece.period, stop=stop)
            phase = known.special(1 if piece.type == "SN" else -1, nearest(dense(), piece, middle, stop)[1].phase)
            assert abs(known.gap(phase) - float(piece.value[middle])) < 1e-11
            assert abs(known.speed(phase) - float(piece.impact_velocity[middle])) < 1e-11
        compared[piece.type] += 1
    assert min(compared.values()) >= 1
    assert sum(compared.values()) >= 4


def nearest(
    oscillator: Oscillator, piece: CurvePiece, place: int, stop: int, other: StopGap = ABSENT
) -> tuple[StopMotions, SpecialOrbit]:
    """Of all orbits at the frequency of a point of a piece, the special one with this speed."""
    family = OrbitFamily.of(oscillator, piece.period, piece.symmetric)
    here = StopMotions([family.at(float(piece.omega[place]))], stop, other)
    return here, min(here.special(piece.type), key=lambda special: abs(special.speed - piece.impact_velocity[place]))


@pytest.mark.thorough
def test_a_stretch_that_the_other_stop_spoils_is_not_admissible() -> None:
    """Where the orbit, alone with its stop, would reach beyond the other one: and there only."""
    other, place = 0.8, contact_equilibrium(dense())
    alone = {(p.type, p.period, float(p.omega[len(p.omega) // 2])): p for p in pieces(1) if p.impacts_right == 1}
    seen = set()
    for piece in pieces(1, other):
        if piece.type not in ("SN", "PD") or piece.impacts_right != 1 or piece.period > 1:
            continue
        middle = len(piece.omega) // 2
        here, special = nearest(dense(), piece, middle, 1)
        with digits():
            reach = OneImpact(dense(), arb(float(piece.omega[middle])), 2).reach(arb(special.phase))
        assert here.reach(Places.of(special.phase))[0] - place == pytest.approx(reach, abs=1e-3)
        if abs(reach - other) > 2e-3:
            assert piece.admissible == (special.admissible and reach < other)
            seen.add(piece.admissible)
    assert seen == {True, False}
    assert alone


@pytest.mark.thorough
def test_lines_of_a_fixed_stop_are_its_curves_at_its_clearance() -> None:
    """At the frequencies of the lines the fixed stop's own curve has this clearance, and the varied one is clear of it
    above the line's admissible end, in the orbit itself."""
    other, compared = 0.8, 0
    place = contact_equilibrium(dense())
    for piece in pieces(1, other):
        if piece.impacts_left != 1 or piece.type not in ("SN", "PD") or not piece.admissible:
            continue
        omega = float(piece.omega[0])
        assert np.all(piece.omega == omega)
        here, special = nearest(dense(), piece, 0, -1)
        assert special.gap - place == pytest.approx(other, rel=1e-12)
        for share, clear in ((1.001, True), (0.999, False)):
            near = piece.value[0] * share
            orbit = periodic_orbit(dense(), omega, (near, other), here.orbits.impacts(special.phase))
            assert (orbit.excess < 0.0) == clear
        compared += 1
    assert compared >= 2


def test_curves_of_symmetric_motions_under_several_harmonics_are_orbits_with_half_multipliers_of_1_or_minus_1() -> None:
    drive = [force(1, np.array([1.0, 0.0, 0.0])), force(3, np.array([0.2, 0.0, 0.0]))]
    oscillator = Oscillator.of_structure(DEFAULT.structure, DEFAULT.contact, drive, 0.8)
    curves = window_curves(oscillator, (0.26, 0.3), (1.3, 2.05), 1, 40)
    kinds = {(piece.type, piece.symmetric) for piece in curves}
    assert {("SN", True), ("SB", True), ("GR", True), ("SN", False), ("PD", False)} <= kinds
    for piece in curves:
        if not piece.symmetric:
            continue
        middle = len(piece.omega) // 2
        omega, clearance = float(piece.omega[middle]), float(piece.value[middle])
        here, special = nearest(oscillator, piece, middle, 1, StopGap(0.0, 1.0))
        orbit = periodic_orbit(oscillator, omega, clearance, here.orbits.impacts(special.phase))
        if piece.type == "GR":
            assert abs(orbit.excess) < 1e-10
            continue
        assert orbit.half_multipliers is not None
        target = 1.0 if piece.type == "SN" else -1.0
        assert np.min(np.abs(orbit.half_multipliers - target)) < 1e-6
        assert orbit.admissible == piece.admissible


def test_grazing_curves_of_unlike_stops_are_pieces_and_virtual_ones_are_not_admissible() -> None:
    biased = dataclasses.replace(DEFAULT, bias=np.array([0.04, 0.0, 0.0]))
    assert not [p for p in window_curves(DEFAULT, (0.26, 0.3), (1.3, 2.05), 1, 20) if p.impacts_right == -1]
    both = [p for p in window_curves(biased, (0.26, 0.3), (1.3, 2.05), 1, 20) if p.impacts_right == p.impacts_left]
    assert [(p.stop, p.admissible) for p in both] == [(1, True), (-1, False)]
    for piece in both:
        grazes = stop_grazes(biased, piece.omega, VariedStop(piece.stop, together=True))
        np.testing.assert_array_equal(grazes.clearance, piece.value)
    fixed = [
        p
        for p in window_curves(DEFAULT, (0.26, 0.3), (1.3, 2.05), 1, 20, VariedStop(1, 1.9))
        if not p.impact_velocity.any()
    ]
    lines = [p for p in fixed if p.stop == -1]
    assert [p.admissible for p in lines] == [False, True]
    omega = float(lines[0].omega[0])
    amplitude = stop_grazes(DEFAULT, [omega], VariedStop(-1)).clearance[0]
    assert amplitude == pytest.approx(1.9, rel=1e-13)
    assert lines[1].value[0] == pytest.approx(1.9, rel=1e-13)
    assert {p.admissible for p in fixed if p.stop == 1} == {True, False}


def test_a_preloaded_stop_has_curves_of_impacting_motions() -> None:
    """The equilibrium is beyond the right stop at the lower clearances: no graze there, and negative gaps."""
    pushed = dataclasses.replace(DEFAULT, bias=np.array([3.0, 0.0, 0.0]))
    place = contact_equilibrium(pushed)
    curves = window_curves(pushed, (0.26, 0.3), (0.2, place + 2.2), 1, 40, VariedStop(1))
    below = [p for p in curves if np.all(p.value < place)]
    assert {p.type for p in below} >= {"SN", "PD"}
    for piece in below:
        omega, clearance = float(piece.omega[0]), float(piece.value[0])
        here, special = nearest(pushed, piece, 0, 1)
        orbit = periodic_orbit(pushed, omega, (clearance, None), here.orbits.impacts(special.phase))
        assert orbit.converged
        assert special.gap < 0.0


def test_both_stops_of_unlike_restitutions_have_their_own_curves() -> None:
    unlike = dataclasses.replace(DEFAULT, restitution_left=0.6)
    curves = window_curves(unlike, (0.26, 0.3), (1.3, 2.05), 1, 30, BOTH_STOPS)
    for stop, alike in ((1, DEFAULT), (-1, dataclasses.replace(DEFAULT, restitution=0.6))):
        known = [p for p in window_curves(alike, (0.26, 0.3), (1.3, 2.05), 1, 30) if p.type == "SN" and not p.symmetric]
        ours = [p for p in curves if p.type == "SN" and (p.impacts_right if stop > 0 else p.impacts_left) == 1]
        assert len(ours) == len(known) == 1
        np.testing.assert_allclose(ours[0].value, known[0].value, rtol=1e-11)
    assert not any(piece.symmetric for piece in curves)


def test_zeros_of_a_polynomial_are_given_once_within_a_turn() -> None:
    """Also where one is at the end of the turn, and round-off puts it on either side."""
    for place in (0.0, -1e-17, 1e-17, -3e-16, 3e-16, 1.0):
        sine = complex(np.exp(-1j * place))
        # sin(t - place) times its distance from another constant: simple zeros at place and place + pi
        for factor in (1.0, 3.7, -0.2):
            zeros, _ = Harmonics(np.array([1.0, 2.0]), np.array([[factor * sine, 0.0]]), np.zeros(1)).zeros()
            assert len(zeros) == 2
            assert all(0.0 <= zero < 2.0 * np.pi for zero in zeros)
    assert within_turn(-1e-17) == 0.0
    assert within_turn(-1.0) == pytest.approx(2.0 * np.pi - 1.0)
    below = np.nextafter(2.0 * np.pi, 0.0)
    assert zeros_of_nothing([below, 0.0, 1.0]) == [1.0, below]
    assert zeros_of_nothing([2e-15, 1.0, 0.0]) == [0.0, 1.0]
    assert zeros_of_nothing([0.5]) == [0.5]
    assert zeros_of_nothing([0.5, 0.5 + 1e-15]) == [0.5]
    assert zeros_of_nothing([]) == []


def zeros_of_nothing(near: list[float]) -> list[float]:
    """What is left of phases of which the polynomial 0 has each as a zero."""
    zeros, counts = np.empty((1, len(near))), np.empty(1, dtype=np.int64)
    zeros_near(np.ones(1), np.zeros((1, 1), dtype=np.complex128), np.zeros(1), np.array([near]), zeros, counts)
    kept: list[float] = zeros[0, : counts[0]].tolist()
    return kept


def test_a_function_that_is_not_a_number_is_not_taken_as_one_without_zero() -> None:
    assert bracketed_zero(lambda x: x - 0.25, 0.0, 1.0, 1e-13) == pytest.approx(0.25)
    assert bracketed_zero(lambda x: x + 0.25, 0.0, 1.0, 1e-13) is None
    with pytest.raises(ValueError, match="NaN"):
        bracketed_zero(lambda x: x - 0.25 if x in (0.0, 1.0) else np.nan, 0.0, 1.0, 1e-13)


WINDOW = (0.262, 0.298), (1.3, 2.05), 1, 9


def test_curves_are_decided_where_round_off_hides_the_slow_orbits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Orbits of vanishing speed say nothing of the others, one of which decides."""
    known = window_curves(DEFAULT, *WINDOW)
    assert {(piece.type, piece.admissible) for piece in known} >= {(kind, True) for kind in ("SN", "PD", "SB", "GR")}
    monkeypatch.setattr(special_orbits, "contact_margin", lambda *arguments: (0.0, UNDECIDED))
    curves = window_curves(DEFAULT, *WINDOW)
    assert [(piece.type, piece.symmetric, piece.admissible, piece.ends) for piece in curves] == [
        (piece.type, piece.symmetric, piece.admissible, piece.ends) for piece in known
    ]
    for ours, theirs in zip(curves, known, strict=True):
        np.testing.assert_array_equal(ours.value, theirs.value)


def test_a_curve_ends_where_round_off_hides_whether_its_orbits_are_admissible(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not continued as one of orbits that are not admissible."""
    low, high = np.linspace(*WINDOW[0], WINDOW[3])[3:5] + np.array([-0.001, 0.0013])
    admissible_from = StopMotions.__dict__["admissible_from"].func

    def hidden(motions: StopMotions) -> list[AdmissibleFrom]:
        begins: list[AdmissibleFrom] = admissible_from(motions)
        each = zip(motions.orbits.omega, begins, strict=True)
        return [begin._replace(any=None) if low < omega < high else begin for omega, begin in each]

    def grazes() -> list[CurvePiece]:
        return [piece for piece in window_curves(DEFAULT, *WINDOW) if piece.type == "GR" and not piece.symmetric]

    known = grazes()
    assert any(piece.omega[0] < low and high < piece.omega[-1] for piece in known)
    monkeypatch.setattr(StopMotions, "admissible_from", property(hidden))
    cut = grazes()
    assert all(piece.admissible for piece in [*known, *cut])
    (before,) = [piece for piece in cut if piece.omega[-1] <= low]
    (after,) = [piece for piece in cut if piece.omega[0] >= high]
    assert (before.ends[1], after.ends[0]) == ("undecided", "undecided")
    assert (before.omega[-1], after.omega[0]) == pytest.approx((low, high), rel=1e-9)


def test_a_special_orbit_whose_contact_is_hidden_is_neither_admissible_nor_not() -> None:
    """Where the motions that do not decide are touched to within round-off."""
    assert [special_orbits._verdict(status) for status in (NO_FURTHER_CONTACT, MEETS, TOUCHES)] == [True, False, None]


def test_a_search_that_is_given_up_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """It does not say that the orbit is not admissible."""
    here = StopMotions([OrbitFamily.of(dense(), 1, False).at(0.9)], 1, ABSENT)

    def given_up(motions, phases, rows, floor, contacts, scratch):
        contacts.status[:] = GIVEN_UP

    monkeypatch.setattr(special_orbits, "contacts_at", given_up)
    with refused("omega"):
        here.orbits_at(Places.of(1.0))

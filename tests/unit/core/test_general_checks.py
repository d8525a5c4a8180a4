"""The checks of `make general`, on a case or two of three masses, and that each of them notices a planted error."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from grazemap_core.contact.stops import both_clearances
from tests.oracles.near_grazing import outcome_of, passage
from tests.slow.general_checks import borders, branches, families, images, labels, near_grazing, resonances, transients
from tests.slow.general_checks.table import Row, part, written
from tests.slow.resonance import compare, exact_impacts
from tests.slow.verified_points import EQUAL, OTHER, impacts_in_fifty_digits, verdict
from tests.support.random_systems import random_system


def test_maps_of_images_are_the_same_and_a_changed_bit_is_noticed() -> None:
    assert images.images_of(2) == ([], [])
    plain = images.map_of(random_system(2))
    changed = plain | {"multiplier": np.nextafter(plain["multiplier"], 2.0)}
    assert images.differences(plain, changed, {}, 1.0) == ["multiplier"]
    assert "impacts_right" in images.differences(plain, images.map_of(random_system(8)), {}, 1.0)


def test_pixels_have_their_labels_and_a_wrong_one_is_noticed() -> None:
    points = labels.verified_pixels(2, 2)
    assert len(points) == 2
    for point in points:
        impacts = impacts_in_fifty_digits(point)
        assert verdict(point, impacts) == EQUAL
        # between unlike stops the mirror image is another motion
        assert verdict(point._replace(right=point.left, left=point.right), impacts) == OTHER


def test_windows_have_their_only_stop_on_the_right() -> None:
    for seed in range(12):
        window = borders.window(seed)
        assert window.clearance[0] < window.clearance[1] < np.inf
        right, left = window.clearances(np.array([window.clearance[0]]))[0]
        assert right == window.clearance[0]
        assert right + left > 0.0
    systems = {seed: random_system(seed, restitution=borders.RESTITUTION) for seed in range(12)}
    alone = [seed for seed, system in systems.items() if both_clearances(system.clearance)[0] == np.inf]
    assert alone
    for seed in alone:
        assert borders.window(seed).oscillator.contact.tolist() == (-systems[seed].oscillator.contact).tolist()


def test_impacts_at_resonance_are_exact_and_another_restitution_is_noticed() -> None:
    case = resonances.random_case(2)
    exact = exact_impacts(case)
    outcome = compare(case, False, *exact)
    assert (outcome.wrong, outcome.grazes) == (0, 0)
    assert outcome.compared >= 20
    left = case.oscillator.restitution_of(-1) * (1.0 + 1e-9)
    other = dataclasses.replace(case.oscillator, restitution_left=left)
    assert compare(case._replace(oscillator=other), False, *exact).wrong > 0


def test_a_graze_at_another_height_is_noticed() -> None:
    system = near_grazing.SYSTEMS["relative, shaken base"]
    graze = next(candidate for w in system.omegas(20) if (candidate := passage(system.oscillator, w, system.stop)))
    assert outcome_of(graze, other=True)[:3] == (6, 0, 0)
    higher = graze._replace(height=graze.height * (1.0 - 1e-11))
    assert outcome_of(higher, other=True).false > 0
    larger = graze._replace(harmonics=[(order, x * (1.0 + 1e-11)) for order, x in graze.harmonics])
    assert outcome_of(larger, other=True).error > 1.0


def test_orbits_of_two_impacts_are_exact() -> None:
    outcomes = [families.two_impact_orbits(seed) for seed in (2, 6)]
    assert sum(outcome.compared for outcome in outcomes) >= 3
    assert sum(outcome.wrong for outcome in outcomes) == 0


@pytest.mark.parametrize("seed", range(3))
def test_columns_have_stops_on_both_sides_of_the_equilibrium(seed: int) -> None:
    points = transients.random_column(np.random.default_rng(seed))
    assert points.oscillator.restitution >= 0.9
    assert np.all(np.sum(points.clearances, axis=1) > 0.0)


def test_the_table_has_a_line_for_each_row() -> None:
    assert part(200, 0.01) == 2
    assert part(20, 0.001) == 1
    lines = written([Row("a", 3, 0, "fine"), Row("b", 2, 1)]).splitlines()
    assert [line.split()[0] for line in lines] == ["compared", "a", "b"]


def test_branches_from_two_starts_have_the_same_special_points(monkeypatch: pytest.MonkeyPatch) -> None:
    comparison = branches.compare(20, True)
    assert comparison is not None
    assert (comparison.points, comparison.apart, comparison.coincide) == (8, 0, 0)
    assert max(comparison.errors) < branches.ACCURACY
    exact = branches.solved

    def moved(oscillator, omega, clearance, impacts):  # type: ignore[no-untyped-def]
        both = clearance if isinstance(clearance, tuple) else (clearance, clearance)
        return exact(oscillator, omega * (1.0 + 1e-8), both, impacts)

    monkeypatch.setattr(branches, "solved", moved)
    wrong = branches.compare(20, True)
    assert wrong is not None
    assert not max(wrong.errors) < branches.ACCURACY


@pytest.mark.thorough
def test_a_complex_pair_is_found_beside_a_real_one_of_product_one() -> None:
    """On the branch of this system both pass the unit circle within a step, so the test function has one sign."""
    comparison = branches.compare(11, False)
    assert comparison is not None
    assert comparison.points > 10
    assert comparison.apart == 0

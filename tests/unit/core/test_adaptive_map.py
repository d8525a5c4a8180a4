"""Adaptive maps compared with full ones: computed points have the same bytes, inferred points are not verified."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from grazemap_core.errors import ParameterError
from grazemap_core.maps import refinement
from grazemap_core.maps.adaptive_map import LABEL, NOT_COMPUTED, adaptive_map_tile, complete_map
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.tolerances import INFERRED_SAMPLE
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.simulation.motion import KINDS
from tests.support.oscillators import DEFAULT

PERIODIC, UNRESOLVED = KINDS.index("periodic"), KINDS.index("unresolved")
# two wide regions, crooked borders between them, and mirror images that alternate
OMEGA, CLEARANCE = np.linspace(0.272, 0.29, 41), np.linspace(1.84, 1.99, 60)
MOTIONS = ("kind", "period", "impacts_right", "impacts_left", "symmetric", "sticking")
Arrays = dict[str, NDArray[Any]]


@pytest.fixture(scope="module")
def full() -> Arrays:
    return unfolding_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE), MapSettings(100))


@pytest.fixture(scope="module")
def adaptive() -> Arrays:
    return adaptive_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE), MapSettings(max_periods=100))


def beside_another(arrays: Arrays) -> NDArray[np.bool_]:
    """Points that have another label than one of the eight around them."""
    label = np.stack([arrays[name].astype(np.int64) for name in MOTIONS])
    beside = np.zeros(label.shape[1:], dtype=np.bool_)
    for i, j in ((0, 1), (1, 0), (1, 1), (1, -1)):
        there = np.roll(label, (-i, -j), axis=(1, 2))
        differ = np.any(label != there, axis=0)
        differ[label.shape[1] - i :] = False
        if j:
            differ[:, -1 if j > 0 else 0] = False
        beside |= differ | np.roll(differ, (i, j), axis=(0, 1))
    return beside


def test_computed_points_have_the_bytes_of_the_full_map(full: Arrays, adaptive: Arrays) -> None:
    computed = adaptive["computed"]
    assert 0.1 < computed.mean() < 0.6
    assert adaptive.keys() == full.keys() | {"computed"}
    for name, array in full.items():
        assert adaptive[name].dtype == array.dtype
        assert adaptive[name][computed].tobytes() == array[computed].tobytes(), name


def test_inferred_points_have_a_label_and_nothing_else(full: Arrays, adaptive: Arrays) -> None:
    inferred = ~adaptive["computed"]
    same = np.all([adaptive[name] == full[name] for name in MOTIONS], axis=0)
    unresolved = adaptive["kind"] == UNRESOLVED
    assert (same | unresolved)[inferred].mean() > 0.99
    assert (adaptive["reason"][inferred] == NOT_COMPUTED).all()
    assert not adaptive["verified"][inferred].any()
    assert adaptive["verified"][adaptive["computed"]].mean() > 0.5
    assert (adaptive["settled_after"][inferred] == -1).all()
    for name in ("multiplier", "lyapunov", "least_impact_velocity"):
        assert np.isnan(adaptive[name][inferred]).all()
    assert not (inferred & (adaptive["kind"] == PERIODIC) & beside_another(adaptive)).any()


def test_tiles_are_joined_without_contradictions_along_their_seams(full: Arrays) -> None:
    rows, columns = [0, 24, 60], [0, 16, 32, 41]
    whole = {name: np.empty_like(full[name]) for name in (*LABEL, "sensitive")}
    whole["computed"] = np.empty(full["kind"].shape, np.bool_)
    for top, bottom in pairwise(rows):
        for left, right in pairwise(columns):
            tile = adaptive_map_tile(
                Plane.of(DEFAULT, OMEGA[left:right], CLEARANCE[top:bottom]), MapSettings(max_periods=100)
            )
            for name in whole:
                whole[name][top:bottom, left:right] = tile[name]
    before = whole["computed"].copy()
    doubtful = ~before & (whole["kind"] == PERIODIC) & beside_another(whole)
    assert doubtful.any()
    row, column, figures, _ = complete_map(
        Plane.of(DEFAULT, OMEGA, CLEARANCE), whole, rows[1:-1], columns[1:-1], MapSettings(max_periods=100)
    )
    assert whole["computed"][doubtful].all()
    assert not (~whole["computed"] & (whole["kind"] == PERIODIC) & beside_another(whole)).any()
    new = np.zeros_like(before)
    new[row, column] = True
    assert (new == (whole["computed"] & ~before)).all()
    for name in full:
        assert figures[name].tobytes() == full[name][row, column].tobytes(), name
    for name in LABEL:
        assert (whole[name][row, column] == full[name][row, column]).all()


def test_a_map_without_contradictions_at_its_seams_changes_at_the_sample_only(full: Arrays, adaptive: Arrays) -> None:
    whole = {name: array.copy() for name, array in adaptive.items()}
    rows, columns, _, check = complete_map(
        Plane.of(DEFAULT, OMEGA, CLEARANCE), whole, [30], [7, 21], MapSettings(max_periods=100)
    )
    named = ~adaptive["computed"] & (adaptive["kind"] != UNRESOLVED)
    assert check is not None
    wrong = named & (full["sensitive"] | np.any([adaptive[name] != full[name] for name in MOTIONS], axis=0))
    assert check.inferred == named.sum()
    assert check.sampled == np.ceil(INFERRED_SAMPLE * adaptive["computed"].sum())
    assert check.sampled <= len(rows) <= check.sampled + 8 * wrong.sum()
    assert named[rows, columns].all()
    assert check.wrong <= wrong[rows, columns].sum()
    assert check.low <= wrong.sum() / named.sum() <= check.high
    expected = {name: array.copy() for name, array in adaptive.items()}
    for name in expected.keys() & full.keys():
        expected[name][rows, columns] = full[name][rows, columns]
    expected["computed"][rows, columns] = True
    assert all(whole[name].tobytes() == expected[name].tobytes() for name in whole)


def test_wrong_points_of_the_sample_are_counted_and_the_map_is_closed_around_them(
    full: Arrays, adaptive: Arrays, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(refinement, "INFERRED_SAMPLE", 1.0)
    whole = {name: array.copy() for name, array in adaptive.items()}
    # in the lower half all inferred points have another motion
    inside = ~whole["computed"] & (whole["kind"] == PERIODIC) & (CLEARANCE < 1.915)[:, None]
    whole["period"][inside] = 7
    row, column, figures, check = complete_map(
        Plane.of(DEFAULT, OMEGA, CLEARANCE), whole, [], [], MapSettings(max_periods=100)
    )
    assert check is not None
    assert check.sampled == adaptive["computed"].sum() < check.inferred
    assert 0.0 < check.low < check.wrong / check.sampled < check.high
    assert abs(check.wrong / check.sampled - inside.sum() / check.inferred) < 0.1
    assert (whole["period"] != 7)[inside].all()
    assert figures["period"].tobytes() == full["period"][row, column].tobytes()


def test_an_ensemble_is_inferred_up_to_mirror_images() -> None:
    # one-sided motions, for the most part
    omega, clearance = np.linspace(0.285, 0.297, 33), np.linspace(1.84, 1.91, 33)
    settings = MapSettings(max_periods=60, max_period=8, policy="ensemble", initial_conditions=1, seed=3)
    full = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance), settings)
    adaptive = adaptive_map_tile(Plane.of(DEFAULT, omega, clearance), settings)
    computed = adaptive["computed"]
    for name, array in full.items():
        assert adaptive[name][computed].tobytes() == array[computed].tobytes(), name
    assert np.isnan(adaptive["share"][~computed]).all()
    assert (adaptive["motions_found"][~computed] == -1).all()
    few, many = (np.sort([full[name] for name in ("impacts_right", "impacts_left")], axis=0)[k] for k in (0, 1))
    mirrored = full["impacts_right"] != adaptive["impacts_right"]
    inferred = ~computed & (adaptive["kind"] == PERIODIC) & (full["kind"] == PERIODIC)
    for choose, expected in ((np.minimum, few), (np.maximum, many)):
        pair = choose(adaptive["impacts_right"], adaptive["impacts_left"])
        assert (pair == expected)[inferred].mean() > 0.95
    assert (mirrored & inferred).any()


def test_computed_points_of_a_preview_are_those_of_the_full_preview() -> None:
    full = unfolding_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE), MapSettings(100, preview=True))
    adaptive = adaptive_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE), MapSettings(max_periods=100, preview=True))
    computed = adaptive.pop("computed")
    assert adaptive.keys() == full.keys()
    assert 0.1 < computed.mean() < 0.9
    for name, values in full.items():
        np.testing.assert_array_equal(adaptive[name][computed], values[computed], err_msg=name)


@pytest.mark.parametrize("policy", ["sweep-up", "sweep-down", "none"])
def test_a_sweep_has_to_compute_every_point(policy: str) -> None:
    with pytest.raises(ParameterError, match="policy"):
        adaptive_map_tile(Plane.of(DEFAULT, OMEGA, CLEARANCE), MapSettings(policy=policy))


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (1, 30), (9, 1), (2, 2)])
def test_grids_of_any_size_are_computed(columns: int, rows: int) -> None:
    grid = (DEFAULT, OMEGA[:columns], CLEARANCE[:rows])
    full, adaptive = (
        unfolding_map_tile(Plane.of(*grid), MapSettings(60)),
        adaptive_map_tile(Plane.of(*grid), MapSettings(max_periods=60)),
    )
    computed = adaptive["computed"]
    assert computed[[0, 0, -1, -1], [0, -1, 0, -1]].all()
    assert all((adaptive[name] == full[name])[computed].all() for name in LABEL)

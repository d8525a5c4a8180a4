"""The program that computes the numbers of the page on adaptive maps."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import adaptive_maps
from benchmarks.adaptive_maps import WINDOWS, _compared
from grazemap_core.maps.adaptive_map import NOT_COMPUTED


def compared() -> np.ndarray:
    _, oscillator, omega, clearance = WINDOWS[1]
    return _compared(oscillator, np.linspace(*omega, 24), np.linspace(*clearance, 24))


def test_inferred_points_are_compared_by_their_motions() -> None:
    computed, seconds, motion, another, chaos, left, wrong, low, high = compared()
    assert 0.0 < computed < 0.7
    assert seconds > 0.0
    assert motion == another == chaos == left == wrong == low == 0.0 < high < 1.0


def test_a_wrong_inference_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    honest = adaptive_maps.adaptive_map_tile

    def planted(*args: object, **settings: object) -> dict[str, np.ndarray]:
        arrays = honest(*args, **settings)  # type: ignore[arg-type]
        i, j = np.argwhere(arrays["reason"] == NOT_COMPUTED)[0]
        arrays["period"][i, j] += 1
        return arrays

    monkeypatch.setattr(adaptive_maps, "adaptive_map_tile", planted)
    computed, _, motion, another, _, _, wrong, *_ = compared()
    assert motion == another == pytest.approx(1 / 24**2)
    assert motion < wrong < motion / (1.0 - computed) * 1.5

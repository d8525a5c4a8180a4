"""The check of `make tolerance-sizes`, on a few systems, and that it notices sizes that are too large or too small."""

from __future__ import annotations

import pytest

from grazemap_core.orbits import two_impact_orbits
from grazemap_core.orbits.single_impact import special_orbits
from tests.slow import tolerance_sizes


def test_a_coarse_grid_of_phases_misses_grazes(monkeypatch: pytest.MonkeyPatch) -> None:
    measured = tolerance_sizes.graze_phases(3)
    assert (measured.cases > 20, measured.missed) == (True, 0)
    monkeypatch.setattr(special_orbits, "GRAZE_PHASES", 2)
    assert tolerance_sizes.graze_phases(3).missed > 0


def test_a_coarse_grid_of_lags_misses_orbits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tolerance_sizes, "FREQUENCIES", (1.0,))
    assert tolerance_sizes.lag_steps(2).missed == 0
    monkeypatch.setattr(two_impact_orbits, "LAG_STEPS", 4)
    assert tolerance_sizes.lag_steps(2).missed > 0


def test_long_steps_leave_a_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    assert tolerance_sizes.border_step(2).missed == 0
    monkeypatch.setattr(tolerance_sizes, "BORDER_STEP", 100.0)
    monkeypatch.setattr(tolerance_sizes, "BORDER_BRANCH_STEP", 1.0)
    monkeypatch.setattr(tolerance_sizes, "SHORTER", 100)
    assert tolerance_sizes.border_step(2).missed > 0


def test_more_is_missed_than_is_stated(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    check = {"HALF": (lambda systems: tolerance_sizes.Measured(2 * systems, systems, "a figure"), 0.5)}
    monkeypatch.setattr(tolerance_sizes, "CHECKS", check)
    assert tolerance_sizes.main(3, []) == 0
    assert capsys.readouterr().out == "HALF: 3 of 6 missed in 3 systems; a figure\n"
    monkeypatch.setattr(tolerance_sizes, "CHECKS", {"HALF": (check["HALF"][0], 0.49)})
    assert tolerance_sizes.main(3, []) == 1

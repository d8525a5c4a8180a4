"""The description of an oscillator: what means the same has the same text, and what is left out its default."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap import Oscillator
from grazemap.wire import parse_request
from grazemap.wire.structure import varied_stop

MATRICES = {"mass": [[2.0, 0.0], [0.0, 1.0]], "damping": {"modal": 0.02}, "stiffness": [[2.0, -1.0], [-1.0, 1.0]]}
ONES = [1.0, 1.0, 1.0]


def text(**fields: Any) -> dict[str, Any]:
    described: dict[str, Any] = parse_request("structures", {"oscillator": fields}).canonical()["oscillator"]
    return described


@pytest.mark.parametrize(
    ("fields", "other"),
    [
        ({}, {"contact": 1}),
        ({}, {"contact": {"row": [1, 0, 0]}}),
        ({"contact": [1, 2]}, {"contact": {"row": [1, -1, 0]}}),
        ({"contact": [3, 1]}, {"contact": {"row": [-1, 0, 1]}}),
        ({}, {"forcing": [1, 0, 0]}),
        ({}, {"forcing": {"amplitude": [1, 0, 0]}}),
        ({}, {"forcing": [{"amplitude": [1, 0, 0], "phase": [0, 0, 0], "law": "constant", "harmonic": 1}]}),
        ({"masses": [1, 2], "stiffnesses": [1, 1]}, {"masses": [1, 2], "stiffnesses": [1, 1], "forcing": [1, 0]}),
        ({}, {"restitution": {"right": 0.8, "left": 0.8}}),
        ({}, {"bias": [0, 0, 0]}),
        ({}, {"base": None, "matrices": None}),
        (
            {"base": {"amplitude": 1, "stops_move": True}},
            {"base": {"amplitude": 1, "phase": 0, "stops_move": True, "influence": ONES}, "forcing": [0, 0, 0]},
        ),
        ({"matrices": MATRICES, "forcing": [0, 1]}, {"matrices": MATRICES, "forcing": {"amplitude": [0, 1]}}),
    ],
)
def test_what_means_the_same_has_the_same_text(fields: dict[str, Any], other: dict[str, Any]) -> None:
    assert text(**fields) == text(**other)


def test_the_text_of_a_chain_with_equal_stops_has_no_other_fields() -> None:
    assert set(text()) == {"units", "masses", "stiffnesses", "damping", "forcing", "restitution"}


@pytest.mark.parametrize(
    "change",
    [
        {"contact": 2},
        {"contact": [2, 1]},
        {"contact": {"row": [2, 0, 0]}},
        {"forcing": {"amplitude": [1, 0, 0], "phase": [0.1, 0, 0]}},
        {"forcing": {"amplitude": [1, 0, 0], "law": "unbalance"}},
        {"forcing": {"amplitude": [1, 0, 0], "harmonic": 2}},
        {"restitution": {"right": 0.8, "left": 0.7}},
        {"base": {"amplitude": 1, "stops_move": True}},
        {"base": {"amplitude": 1, "stops_move": False}},
        {"bias": [0.1, 0, 0]},
    ],
)
def test_what_means_something_else_has_another_text(change: dict[str, Any]) -> None:
    assert text(**change) != text()
    assert text(**text(**change)) == text(**change)
    assert Oscillator(**change).beyond_the_chain() == next(iter(change))


@pytest.mark.parametrize(
    ("clearance", "text"),
    [({"right": 1.6, "left": 1.6}, 1.6), (1.6, 1.6), ({"right": 1.6}, {"right": 1.6, "left": None})],
)
def test_two_equal_stops_are_one_number_and_an_absent_one_stays_absent(clearance: Any, text: Any) -> None:
    assert parse_request("structures", {"clearance": clearance}).canonical()["clearance"] == text


@pytest.mark.parametrize(
    ("clearance", "text", "varied", "other"),
    [
        ({"left": 1.2}, {"left": 1.2}, 1, 1.2),
        ({"left": 1.2, "right": None}, {"left": 1.2}, 1, 1.2),
        ({"right": 1.2}, {"right": 1.2}, -1, 1.2),
        ({"left": None}, {"left": None}, 1, None),
        ({"right": None}, {"right": None}, -1, None),
    ],
)
def test_a_fixed_stop_leaves_the_other_one(clearance: Any, text: Any, varied: int, other: float | None) -> None:
    request = parse_request("grazing-curves", {"omega": [0.2, 0.3], "clearance": clearance})
    assert request.canonical()["clearance"] == text
    again = parse_request("grazing-curves", request.canonical())
    assert varied_stop(again.clearance) == (varied, other)  # type: ignore[attr-defined]


def test_a_question_without_a_fixed_stop_has_the_text_of_before() -> None:
    assert set(parse_request("grazing-curves", {"omega": [0.2, 0.3]}).canonical()) == {
        "oscillator",
        "axis",
        "max_order",
        "sequence",
    }


def test_from_matrices_takes_arrays_and_other_fields() -> None:
    oscillator = Oscillator.from_matrices(
        mass=np.diag([2.0, 1.0]),
        damping={"modal": 0.02},
        stiffness=np.array([[2.0, -1.0], [-1.0, 1.0]]),
        contact=[1, 2],
        forcing=np.array([0.0, 1.0]),
    )
    assert oscillator.model_dump()["matrices"] == MATRICES
    assert oscillator.size == 2
    assert oscillator.natural_frequencies == pytest.approx(np.sqrt(1.0 + np.array([-1.0, 1.0]) * np.sqrt(0.5)))
    assert oscillator.damping_ratios == pytest.approx([0.02, 0.02])


def test_an_oscillator_of_matrices_does_not_show_the_chain_that_it_is_not():
    shown = repr(Oscillator.from_matrices(mass=[[1.0]], damping=[[0.1]], stiffness=[[4.0]], forcing=[1.0]))
    assert "matrices=" in shown
    assert "stiffnesses" not in shown
    assert "stiffnesses=[1.0, 5.0, 5.0]" in repr(Oscillator())

"""Other starts in results: what is seen, the request that shows it, the note, and when nothing is tried."""

from __future__ import annotations

from typing import Any

import pytest

from grazemap.wire import parse_request
from grazemap.wire.notes import OTHER_MOTIONS, OTHER_MOTIONS_IN_MAP
from grazemap_worker.processes import kernels_of
from tests.support.computed import as_job, whole
from tests.support.thorough import KERNELS_FIRST

# a hammer beside one stop, which it hits from rest; the steady motion stays clear of the stop
HAMMER = {"masses": [1.0], "stiffnesses": [1.0], "damping": 0.04, "forcing": [1.0], "restitution": 0.8}
POINT = {"oscillator": HAMMER, "omega": 1.5, "clearance": {"right": 1.1, "left": None}}
PATH = POINT | {"periods": 2, "transient_periods": 300}
MAP = {
    "oscillator": HAMMER,
    "omega": {"start": 1.45, "stop": 1.55, "points": 64},
    "clearance": {"right": {"start": 1.05, "stop": 1.2, "points": 64}, "left": None},
    "max_periods": 400,
}


def computed(process: str, body: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    return as_job(parse_request(process, body))


def codes(meta: dict[str, Any]) -> list[str]:
    return [note["code"] for note in meta["notes"]]


@pytest.mark.parametrize(("process", "body"), [("trajectories", PATH), ("periodic-orbits", POINT)])
def test_the_request_of_another_motion_shows_it(process: str, body: dict[str, Any]) -> None:
    document, meta = computed(process, body | {"other_starts": 64})
    record = document["other_starts"]
    assert (record["starts"], document["motion"]["label"]) == (64, "1-1r-(-1)l")
    (other,) = record["motions"]
    assert (other["label"], 0 < other["starts"] < record["settled"]) == ("1-(-1)r-(-1)l", True)
    shown = whole("trajectories", parse_request("trajectories", other["request"]).canonical())
    assert shown["motion"]["label"] == other["label"]
    assert len(shown["impacts"]["time"]) == 0
    assert codes(meta) == [OTHER_MOTIONS]
    assert other["label"] in meta["notes"][0]["detail"]


def test_without_other_starts_the_request_and_the_result_are_as_before() -> None:
    document, meta = computed("trajectories", PATH)
    asked, _ = computed("trajectories", PATH | {"other_starts": 16})
    assert "other_starts" not in document
    assert "other_starts" not in meta["request"]
    assert asked.keys() - document.keys() == {"other_starts"}
    assert asked["final"]["displacement"] == document["final"]["displacement"]
    assert codes(meta) == []


@KERNELS_FIRST
def test_a_map_from_rest_samples_other_starts_unless_it_is_told_not_to() -> None:
    document, meta = computed("unfolding-maps", MAP | {"other_starts": 32})
    record = document["other_starts"]
    assert (record["starts"], record["points"]) == (32, 2)
    assert record["with_others"] > 0
    assert OTHER_MOTIONS_IN_MAP in codes(meta)
    for seen in record["motions"]:
        shown = whole("trajectories", parse_request("trajectories", seen["request"]).canonical())
        assert shown["motion"]["label"] == seen["label"] != seen["from_rest"]
    without, _ = computed("unfolding-maps", MAP | {"other_starts": 0})
    assert document.keys() - without.keys() == {"other_starts"}
    assert all((document[name] == without[name]).all() for name in ("period", "impacts_right", "verified"))
    for changes in ({"policy": "sweep-up"}, {"preview": True}):
        request = parse_request("unfolding-maps", MAP | changes | {"other_starts": 32})
        assert "other_starts" not in request.canonical()
        assert "other_starts" not in computed("unfolding-maps", MAP | changes)[0]


def test_trajectories_with_other_starts_need_the_kernels_of_maps() -> None:
    kernels = [kernels_of("trajectories", parse_request("trajectories", PATH | {"other_starts": k})) for k in (0, 8)]
    assert kernels == ["trajectories", "diagrams"]
    observed = parse_request("trajectories", PATH | {"other_starts": 8, "observables": ["impulse"]})
    assert kernels_of("trajectories", observed) == "map_observables"


@pytest.mark.parametrize(
    ("process", "body"),
    [
        ("trajectories", PATH | {"initial": [{}, {}]}),
        ("periodic-orbits", POINT | {"motion": {"period": 1, "stops": [1]}}),
    ],
)
def test_other_starts_are_refused_where_no_single_start_is_given(process: str, body: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="other_starts are compared"):
        parse_request(process, body | {"other_starts": 8})

"""Branches, orbits beyond their special points, curves of motions, and motions with rests, as documents."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.results.orbits import CLOSED
from grazemap.wire import Oscillator
from grazemap_core.continuation import special_points
from grazemap_worker.processes.conversion import core_oscillator
from tests.oracles.closed_form import one_impact_branch
from tests.support.computed import whole

ORBIT = {"omega": 0.27, "clearance": 1.85}
ONE = {"motion": {"period": 1, "stops": [1]}}
SYMMETRIC = {"omega": 0.27, "clearance": 1.75, "motion": {"period": 1, "stops": [1, -1]}}
WINDOW = {"omega": {"start": 0.265, "stop": 0.295}, "clearance": {"start": 1.5, "stop": 2.0}}


def special(document: dict[str, Any], kind: str, near: float) -> dict[str, Any]:
    nearest: dict[str, Any] = min(
        (point for point in document["special_points"] if point["type"] == kind),
        key=lambda point: abs(point["parameter"] - near),
    )
    assert nearest["parameter"] == pytest.approx(near, abs=1e-4)
    return nearest


@pytest.mark.parametrize(
    ("body", "window", "kind", "near", "labels"),
    [
        ({"omega": 0.285, "clearance": 1.93, **ONE}, (1.85, 1.95), "PD", 1.94075, ["2-2r-(-1)l"]),
        (SYMMETRIC, (1.6, 1.85), "SB", 1.82271, ["1-1r-1l"]),
        (SYMMETRIC, (1.6, 1.85), "GR", 1.62527, ["1-2r-2l", "1-2r-1l"]),
        ({**ORBIT, **ONE}, (1.8, 1.9), "GR", 1.84424, ["1-1r-1l"]),
        ({**ORBIT, **ONE}, (1.8, 1.9), "SN", 1.86834, []),
    ],
)
def test_an_orbit_beyond_a_special_point_is_a_request(
    body: dict[str, Any], window: tuple[float, float], kind: str, near: float, labels: list[str]
) -> None:
    bounds = {"range": dict(zip(("start", "stop"), window, strict=True))}
    point = special(whole("orbit-branches", {**body, **bounds}), kind, near)
    assert point["restitution"] == 0.8
    assert len(point["beyond"]) == len(labels)
    for beyond, label in zip(point["beyond"], labels, strict=True):
        asked = beyond["request"]
        orbit = whole("periodic-orbits", asked)
        assert (orbit["motion"]["label"], orbit["found_by"]) == (label, "equations")
        assert orbit["isolated"]
        assert (orbit["admissible"], beyond["admissible"]) == (True, True)
        assert abs(asked["clearance"] - near) < 1e-2
        # the same with a range is its branch, which passes through the point
        branch = whole("orbit-branches", {**asked, **bounds})
        assert branch["stops"].tolist() == orbit["stops"].tolist()
        assert any(abs(other["parameter"] - point["parameter"]) < 1e-9 for other in branch["special_points"])


def test_a_closed_branch_says_so_in_the_words_that_pictures_know() -> None:
    branch = whole(
        "orbit-branches",
        {"omega": 0.318, "clearance": 2.0125, "motion": {"period": 1, "stops": [1, -1]}}
        | {"vary": "omega", "range": {"start": 0.15, "stop": 0.5}},
    )
    assert set(branch["ends"]) == {CLOSED}
    steps = np.abs(np.diff(branch["parameter"]))
    assert abs(branch["parameter"][0] - branch["parameter"][-1]) < 2.0 * steps[-1]


def test_a_special_point_that_is_a_guess_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    body = {**ORBIT, **ONE, "range": {"start": 1.84, "stop": 1.87}}
    for point in whole("orbit-branches", body)["special_points"]:
        assert (point["status"], point["reason"]) == ("converged", None)
    monkeypatch.setattr(special_points, "SPECIAL_POINT_RESIDUAL", -1.0)
    for point in whole("orbit-branches", body)["special_points"]:
        assert (point["status"], point["reason"]) == ("guess", special_points.NOT_ZERO)


def test_a_branch_over_restitution_is_the_closed_form_s() -> None:
    body = {"omega": 0.27, "clearance": 1.866, **ONE, "vary": "restitution", "range": {"start": 0.0, "stop": 1.0}}
    document = whole("orbit-branches", body)
    np.testing.assert_array_equal(document["parameter"], document["restitution"])
    assert set(document["ends"].tolist()) == {"a parameter reaches the end of its range"}
    (turn,) = [point for point in document["special_points"] if point["type"] == "SN"]
    known = one_impact_branch(core_oscillator(Oscillator(restitution=turn["parameter"])), 0.27)
    (same,) = [point for point in known.special_points if point.type == "SN"]
    assert same.clearance == pytest.approx(1.866, rel=1e-10)


def test_an_orbit_beyond_a_point_of_a_branch_over_restitution_has_its_own_restitution() -> None:
    body = {**SYMMETRIC, "clearance": 1.63, "vary": "restitution", "range": {"start": 0.0, "stop": 1.0}}
    (graze,) = [point for point in whole("orbit-branches", body)["special_points"] if point["type"] == "GR"]
    for beyond in graze["beyond"]:
        asked = beyond["request"]
        assert 0.0 < abs(asked["oscillator"]["restitution"] - graze["restitution"]) < 1e-2
        assert (asked["omega"], asked["clearance"]) == (0.27, 1.63)
        orbit = whole("periodic-orbits", asked)
        assert (orbit["isolated"], orbit["admissible"]) == (True, True)


def test_a_branch_that_leaves_the_range_at_once_has_its_orbit_and_its_ends() -> None:
    body = {**ORBIT, **ONE, "range": {"start": 1.85, "stop": 1.851}}
    document = whole("orbit-branches", body)
    assert len(document["parameter"]) >= 1
    assert document["parameter"].min() == 1.85
    assert set(document["ends"].tolist()) == {"a parameter reaches the end of its range"}
    assert document["special_points"] == []


def test_curves_of_motions_are_pieces_whose_points_are_orbits() -> None:
    motions = [{"period": 1, "stops": [1], "omega": 0.27, "clearance": 1.85}, {"period": 1, "stops": [1, 1, 1]}]
    document = whole("bifurcation-curves", {**WINDOW, "motions": motions})
    motion, lost = document["motions"]
    assert (motion["label"], motion["omega"], motion["clearance"], motion["reason"]) == ("1-1r-(-1)l", 0.27, 1.85, None)
    assert (lost["label"], lost["omega"]) == (None, None)
    assert "no motion" in lost["reason"]
    curves = document["curves"]
    assert {curve["type"] for curve in curves} == {"SN", "PD", "GR"}
    assert all(curve["of_motion"] == 0 for curve in curves)
    # closed forms of the same window have the same places
    closed = whole("bifurcation-curves", {**WINDOW, "max_multiple": 1, "points": 200})
    assert closed["motions"] == []
    compared = set()
    for curve in curves:
        assert set(curve["ends"]) <= {"window", "admissible"}
        assert curve["motion"] == "1-1r-(-1)l"
        if curve["impact"] is not None:
            assert curve["velocities"].shape == (len(curve["omega"]), 1)
            continue
        if curve["admissible"]:
            (same,) = [
                piece
                for piece in closed["curves"]
                if (piece["type"], piece["motion"], piece["admissible"]) == (curve["type"], curve["motion"], True)
            ]
            theirs = np.interp(curve["omega"], same["omega"], same["clearance"])
            inside = (same["omega"][0] < curve["omega"]) & (curve["omega"] < same["omega"][-1])
            assert np.max(np.abs(theirs - curve["clearance"])[inside]) < 2e-4  # of the interpolation
            compared.add(curve["type"])
        middle = len(curve["omega"]) // 2
        orbit = whole(
            "periodic-orbits",
            {
                "omega": float(curve["omega"][middle]),
                "clearance": float(curve["clearance"][middle]),
                "motion": {
                    "period": curve["period"],
                    "stops": np.array(curve["stops"]).tolist(),
                    "phases": curve["phases"][middle].tolist(),
                    "velocities": curve["velocities"][middle].tolist(),
                },
            },
        )
        if curve["type"] != "SN":  # Newton's method has nothing to hold on to there
            assert orbit["converged"]
        if curve["type"] == "GR":
            assert abs(orbit["excess"]) < 1e-9
            assert orbit["excess_stop"] == curve["stop"]
        if curve["type"] == "PD":
            assert np.min(np.hypot(orbit["multipliers"][:, 0] + 1.0, orbit["multipliers"][:, 1])) < 1e-7
    assert compared == {"SN", "PD", "GR"}


def test_without_convergence_or_without_the_motion_in_the_window_the_result_is_empty_with_a_reason() -> None:
    nowhere = {"period": 1, "stops": [1, 1], "phases": [0.1, 3.0], "velocities": [5.0, 0.01]}
    motions = [{**nowhere, "omega": 0.27, "clearance": 1.85}, {"period": 1, "stops": [1]}]
    window = {"omega": {"start": 0.265, "stop": 0.275}, "clearance": {"start": 2.2, "stop": 2.3}}
    document = whole("bifurcation-curves", {**window, "clearance": {"start": 1.8, "stop": 1.9}, "motions": motions[:1]})
    assert document["curves"] == []
    assert document["motions"][0]["reason"]
    document = whole("bifurcation-curves", {**window, "motions": motions[1:]})
    assert document["curves"] == []
    assert "no motion" in document["motions"][0]["reason"]
    # one that is found and is no motion says so, and its curves are no borders
    virtual = whole("periodic-orbits", {"omega": 0.27, "clearance": 1.78, **ONE})
    assert (virtual["converged"], virtual["admissible"]) == (True, False)
    assert virtual["motion"]["kind"] == "unresolved"


def test_a_motion_with_rests_is_found_by_simulation() -> None:
    slow = {
        "oscillator": {"masses": [1.0], "stiffnesses": [1.0], "forcing": [1.0]},
        "omega": 0.2,
        "clearance": 0.3,
        "transient_periods": 200,
    }
    document = whole("periodic-orbits", {**slow, "initial": {"phase": 0.5}})
    assert (document["converged"], document["found_by"], document["verified"]) == (True, "simulation", False)
    assert "simulation" in document["reason"]
    motion = document["motion"]
    assert (motion["kind"], motion["label"], motion["verified"]) == ("periodic", "1-∞r-∞l", False)
    assert (motion["period"], motion["sticking"], document["period"]) == (1, True, 1)
    assert document["residual"] < 1e-12
    assert np.isnan(document["kantorovich"])
    # a single mass that rests has nothing left: superstable
    assert np.max(np.abs(document["multipliers"])) < 1e-12
    assert len(document["sticking"]["start"]) == 2
    # from its start the trajectory has these contacts
    start = {name: np.array(value).tolist() for name, value in document["start"].items()}
    bare = {name: value for name, value in slow.items() if name != "transient_periods"}
    run = whole("trajectories", {**bare, "initial": start, "periods": 1})
    np.testing.assert_allclose(run["impacts"]["time"], document["times"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(run["sticking"]["stop_time"], document["sticking"]["stop_time"], rtol=0, atol=1e-12)
    # and there is no branch of it
    branch = whole("orbit-branches", {**slow, "range": {"start": 0.2, "stop": 0.4}})
    assert branch["parameter"].size == 0
    assert "no sequence of impacts" in branch["reason"]

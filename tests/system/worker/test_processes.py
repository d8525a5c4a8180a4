"""Processes on the real core: the documents that clients decode, and tiles that fit together to the last bit."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from flint import acb, acb_mat, ctx

from grazemap.checker import check
from grazemap.codec import decode_npz, encode_npz
from grazemap.wire import Oscillator, canonical_id, parse_request
from grazemap_core.errors import CoreError
from grazemap_worker.planning import Plan
from grazemap_worker.processes import IMPLEMENTATIONS
from grazemap_worker.processes.conversion import core_oscillator, request_pointer
from grazemap_worker.processes.time_limit import run_limited
from grazemap_worker.processes.trajectories import NOT_VERIFIED
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbits_at_clearance
from tests.slow.proven_points import proofs_of
from tests.support.computed import silent, tiled, whole
from tests.support.thorough import KERNELS_FIRST

ORBIT = {"omega": 0.27, "clearance": 1.85}
MAP = {
    "omega": {"start": 0.28, "stop": 0.29, "points": 4},
    "clearance": {"start": 1.5, "stop": 1.9, "points": 3},
    "max_periods": 300,
}


def test_linear_properties_of_a_general_structure_have_every_field() -> None:
    oscillator = {
        "matrices": {"mass": [[2, 0], [0, 1]], "damping": {"rayleigh": [0.1, 0.01]}, "stiffness": [[2, -1], [-1, 1]]},
        "contact": [1, 2],
        "forcing": [{"amplitude": [1, 0]}, {"amplitude": [0, 1], "law": "unbalance", "harmonic": 2}],
        "bias": [0.1, 0.0],
    }
    body = {"oscillator": oscillator, "omega": [0.5, 0.7], "times": [0.0, 1.0], "clearance": {"left": 0.4}}
    document = whole("structures", body)
    assert "amplitude" not in document  # there are two harmonics
    assert [harmonic["harmonic"] for harmonic in document["harmonics"]] == [1, 2]
    assert all(harmonic["amplitude"].shape == (2,) for harmonic in document["harmonics"])
    assert document["gaps"] == {"right": None, "left": pytest.approx(0.4 + document["contact_equilibrium"])}
    assert document["impulse_response"][0] == 0.0


@pytest.mark.parametrize(("order", "alike"), [(2, False), (3, True)])
def test_grazes_of_two_harmonics_have_every_field(order: int, alike: bool) -> None:
    second = {"amplitude": [0.7, 0, 0], "phase": [0.3, 0, 0], "harmonic": order}
    oscillator = {"forcing": [{"amplitude": [1, 0, 0]}, second]}
    curve = whole("grazing-curves", {"oscillator": oscillator, "omega": {"start": 0.2, "stop": 0.6, "points": 50}})
    assert ("clearance" in curve) == alike
    assert ("clearance_left" in curve) == (not alike)
    kinds = {point["kind"] for point in curve["points"]}
    assert kinds == {"recurrence", "resonant", "corner"} | (set() if alike else {"double-graze"})
    corners = [point for point in curve["points"] if point["kind"] == "corner"]
    assert all(point["corner"]["slope_before"] < point["corner"]["slope_after"] for point in corners)
    assert all(("stop" in point) == (not alike) for point in corners)
    body = {"oscillator": oscillator, "omega": {"start": 0.2, "stop": 0.6}, "clearance": {"left": 3.0}}
    points = whole("codimension-two-points", body)["points"]
    assert {"corner", "double-graze"} <= {point["kind"] for point in points}


def test_an_error_of_a_general_structure_has_its_pointer() -> None:
    request = parse_request("structures", {"oscillator": {"bias": [1.0, 0.0, 0.0]}})
    assert request_pointer(request, "bias") == "/oscillator/bias"
    matrices = {"mass": [[1]], "damping": [[0]], "stiffness": [[1]]}
    dense = parse_request("structures", {"oscillator": {"matrices": matrices, "forcing": [1]}})
    assert request_pointer(dense, "damping") == "/oscillator/matrices/damping"


def test_a_grazing_curve_has_its_arrays_and_the_points_on_it() -> None:
    document = whole("grazing-curves", {"omega": {"start": 0.275, "stop": 0.285, "points": 11}, "max_order": 4})
    assert {name: value.shape for name, value in document.items() if name != "points"} == dict.fromkeys(
        ("omega", "clearance", "phase", "first_recurrence", "recurrence_stop"), (11,)
    )
    assert document["first_recurrence"].dtype == document["recurrence_stop"].dtype == np.int64
    kinds = {point["kind"] for point in document["points"]}
    assert kinds == {"recurrence", "resonant"}
    assert all(0.275 <= point["omega"] <= 0.285 for point in document["points"])


def test_codimension_two_points_are_records_of_plain_values() -> None:
    points = whole("codimension-two-points", {"omega": {"start": 0.275, "stop": 0.285}})["points"]
    recurrence = next(point for point in points if point["kind"] == "recurrence" and point["order"] == 2)
    assert recurrence["omega"] == pytest.approx(0.282469586635, abs=1e-11)
    assert recurrence["families"]
    assert set(recurrence["families"][0]) == {"case", "n"}
    resonant = [point for point in points if point["kind"] == "resonant" and point["multiple"] == 1]
    assert {point["bifurcation"] for point in resonant} >= {"SN", "PD"}


def test_a_resonant_point_has_the_curve_that_leaves_the_grazing_curve_there() -> None:
    points = whole("codimension-two-points", {"omega": {"start": 0.275, "stop": 0.285}, "max_multiple": 1})["points"]
    unfoldings = {point["bifurcation"]: point["unfolding"] for point in points if point["kind"] == "resonant"}
    assert unfoldings["SN"]["quadratic"] == pytest.approx(122.4553, abs=1e-4)
    assert unfoldings["PD"]["slope"] == pytest.approx(0.49347, abs=1e-5)
    assert {point.get("unfolding") for point in points if point["kind"] == "recurrence"} == {None}


def test_a_grazing_curve_has_the_sequence_where_it_is_requested() -> None:
    body = {"omega": {"start": 0.275, "stop": 0.285, "points": 5}, "max_order": 3}
    document = whole("grazing-curves", {**body, "sequence": True})
    recurs = (-1.0) ** np.arange(1, 4) * document["xi"] < 0.0
    np.testing.assert_array_equal(
        np.where(recurs.any(axis=1), 1 + recurs.argmax(axis=1), 0), document["first_recurrence"]
    )
    plain = whole("grazing-curves", body)
    assert "xi" not in plain
    np.testing.assert_array_equal(plain["clearance"], document["clearance"])


@pytest.mark.thorough
def test_a_statement_is_proven_with_the_decimals_of_the_request() -> None:
    statement = {"kind": "attraction", "omega": 0.29, "clearance": 1.6, "label": "1-2r-2l"}
    document = whole("proofs", {"statement": statement})
    certificate = json.loads(document["certificate"])
    assert (document["verdict"], document["reason"]) == ("proven", None)
    assert check(certificate).accepted
    asked = certificate["statement"]
    assert (asked["omega"], asked["clearance"]["left"], asked["displacement"]) == ("0.29", "1.6", ["0.0"] * 3)
    assert asked["label"] == "1-2r-2l"
    assert json.loads(document["shown"])["label"] == "1-2r-2l"


def test_a_proof_ends_at_its_limit_of_processor_time_within_a_long_step() -> None:
    def endless() -> Iterator[str]:
        yield "first"  # and then for days
        matrix = acb_mat([[acb(i + j) for j in range(200)] for i in range(200)])
        with ctx.workprec(100_000):
            matrix.exp()
        yield "second"

    steps, ended = run_limited(0.5, endless)
    assert (steps, ended) == (["first"], True)
    assert run_limited(60.0, lambda: iter(["first", "second"])) == (["first", "second"], False)
    with pytest.raises(RuntimeError):
        run_limited(60.0, lambda: iter([1 // 0]))


def test_an_undecided_proof_says_why() -> None:
    attraction = {"kind": "attraction", "omega": 0.29, "clearance": 1.6}
    document = whole("proofs", {"statement": attraction, "time_limit": 0.2})
    assert document["verdict"] == "undecided"
    assert "0.2 s" in document["reason"]
    assert "theorem" not in json.loads(document["certificate"])


def test_a_proof_whose_limit_ends_before_its_first_step_is_undecided() -> None:
    count = 64  # it takes a while to write the numbers of full matrices as decimals
    full = (np.eye(count) + 0.01 * np.random.default_rng(0).uniform(size=(count, count))).tolist()
    symmetric = (0.5 * (np.array(full) + np.array(full).T)).tolist()
    matrices = {"mass": np.eye(count).tolist(), "damping": symmetric, "stiffness": symmetric}
    oscillator = {"matrices": matrices, "forcing": [1.0] * count}
    statement = {
        "kind": "codimension-two",
        "type": "g",
        "order": 2,
        "axis": {"vary": "omega", "values": {"start": 0.5, "stop": 1.5}},
    }
    document = whole("proofs", {"oscillator": oscillator, "statement": statement, "time_limit": 0.005})
    assert document["verdict"] == "undecided"
    assert document["limited"]


@pytest.mark.parametrize("stop", ["right", "C"])
def test_a_discontinuity_mapping_has_its_errors_and_the_returns_of_the_motion(stop: str) -> None:
    body = {"omega": 0.29, "overshoot": [1e-4, 1e-6, 1e-8], "stop": stop, "returns": 4}
    exact = whole("discontinuity-mappings", body)
    leading = whole("discontinuity-mappings", {**body, "order": "leading"})
    side = 1 if stop == "right" else -1
    assert exact["stop"] == side
    assert exact["clearance"] == abs(exact["grazing"]["state"][0])
    assert exact["fitted_order"] == pytest.approx(1.0, abs=0.01)
    assert exact["fitted_order_of_second"] == pytest.approx(1.5, abs=0.01)
    np.testing.assert_allclose(side * (exact["state"][:, 0] - exact["grazing"]["state"][0]), body["overshoot"])
    np.testing.assert_array_equal(exact["mapped"], exact["state"] + exact["displacement"])
    # the same error, once as it is reported and once from the two answers
    apart = np.abs(exact["displacement"] - leading["displacement"])
    units = np.array([1.0, 1.0 / 0.29] * 3 + [exact["clearance"]]) / exact["clearance"]
    np.testing.assert_allclose((apart * units).max(axis=1), exact["error"], rtol=1e-6)
    # the field is taken to zero by the half-period maps, equations (49) and (50)
    field = exact["grazing"]["vector_field"]
    np.testing.assert_allclose(exact["jacobian"] @ field, 0.0, atol=1e-15)
    # the exact map is the motion; the leading one is as far off as the overshoot
    assert np.nanmax(exact["returns"]["error"]) < 1e-12
    assert 1e-5 < leading["returns"]["error"][0, 1] < 1e-3
    assert exact["returns"]["mapped"].shape == (3, 5, 7)
    # what was predicted of the next contact is what the motion does, at the stop that was said
    order = exact["next_contact"]["order"][2]
    seen = exact["returns"]["simulated_overshoot"][2]
    assert np.all(seen[1:order] < 0.0)
    assert seen[order] > 0.0
    assert exact["next_contact"]["stop"][2] == side * (-1) ** order
    assert exact["first_recurrence"] == order
    assert exact["recurrence_stop"] == exact["next_contact"]["stop"][2]


def test_a_discontinuity_mapping_of_one_stop_returns_after_whole_periods() -> None:
    oscillator = {"contact": [1, 2], "restitution": {"right": 0.6, "left": 0.9}, "bias": [0.1, 0.0, 0.0]}
    body = {"oscillator": oscillator, "omega": 0.29, "overshoot": [1e-4, 1e-6, 1e-8], "stop": "C", "returns": 3}
    curve = whole("grazing-curves", {"oscillator": oscillator, "omega": [0.29, 0.3], "clearance": {"right": 9.0}})
    for other in (9.0, None):
        mapping = whole("discontinuity-mappings", {**body, "clearance": {"right": other}})
        assert mapping["clearance"] == pytest.approx(curve["clearance_left"][0], rel=1e-14)
        assert ("margin" in mapping) == (other is not None)
        assert mapping["fitted_order"] == pytest.approx(1.0, abs=0.01)
        assert mapping["fitted_order_of_second"] == pytest.approx(1.5, abs=0.01)
        assert np.nanmax(mapping["returns"]["error"]) < 1e-11
    assert mapping["first_recurrence"] == curve["first_recurrence_left"][0] // 2
    # without the other stop's clearance both are moved together, to a clearance at which the bias grazes one
    together = whole("discontinuity-mappings", {**body, "stop": "A"})
    assert together["margin"] > 0.0
    with pytest.raises(CoreError, match="other stop"):
        whole("discontinuity-mappings", body)


def test_an_overshoot_beyond_the_domain_is_an_error_that_names_its_end() -> None:
    with pytest.raises(CoreError, match=r"must be at most 1\.777") as caught:
        whole("discontinuity-mappings", {"omega": 0.29, "overshoot": [1e-4, 5.0]})
    assert getattr(caught.value, "name", None) == "overshoot"


def test_a_bifurcation_diagram_has_its_sections_in_the_order_of_the_parameter() -> None:
    body = {"vary": "clearance", "range": [1.6, 1.99, 2.1], "omega": 0.29, "periods": 12}
    for policy in ("rest", "sweep-down"):
        document = whole("bifurcation-diagrams", {**body, "policy": policy})
        assert document["parameter"].tolist() == [1.6, 1.99, 2.1]
        labels = [section["motion"]["label"] for section in document["sections"]]
        assert labels[::2] == ["1-2r-2l", "1-(-1)r-(-1)l"]
        assert [len(section["displacement"]) for section in document["sections"]] == [12] * 3
        assert [len(section["impact_velocity"]) for section in document["sections"]][::2] == [48, 0]


@pytest.mark.parametrize(
    "beginning",
    [
        {"motion": {"period": 1, "stops": [1]}},
        {"motion": {"period": 1, "stops": [1], "phases": [1.29], "velocities": [0.18]}},
        {"initial": {"displacement": [1.0, 0.0, 0.0]}},
        {},
    ],
)
def test_a_periodic_orbit_is_the_same_from_every_kind_of_guess(beginning: dict[str, Any]) -> None:
    document = whole("periodic-orbits", {**ORBIT, **beginning})
    assert document["converged"]
    assert document["isolated"]
    assert document["admissible"]
    assert document["verified"]
    assert document["motion"]["verified"]
    # the mirror image counts as the same
    assert document["motion"]["label"] in ("1-1r-(-1)l", "1-(-1)r-1l")
    side = document["stops"][0]
    closed_form = orbits_at_clearance(one_impact_branch(core_oscillator(Oscillator()), 0.27), 1.85)[-1]
    assert document["velocities"] * side == pytest.approx(closed_form.impact_velocity, rel=1e-12)
    assert document["residual"] < 1e-12
    assert document["multipliers"].shape == (6, 2)
    assert document["stable"]
    run = whole(
        "trajectories",
        {
            **ORBIT,
            "initial": {name: np.array(value).tolist() for name, value in document["start"].items()},
            "periods": 3,
        },
    )
    np.testing.assert_allclose(np.abs(run["impacts"]["velocity"]), np.abs(document["velocities"][0]), rtol=1e-9)


def test_an_orbit_that_does_not_exist_has_a_reason() -> None:
    for motion, reason in (
        ({"period": 1, "stops": [1, 1, 1]}, "no motion with these stops"),
        ({"period": 1, "stops": [1, 1], "phases": [0.1, 3.0], "velocities": [5.0, 0.01]}, ""),
    ):
        document = whole("periodic-orbits", {**ORBIT, "motion": motion})
        assert not document["converged"]
        assert reason in document["reason"]
        assert document["motion"]["kind"] == "unresolved"
        branch = whole("orbit-branches", {**ORBIT, "motion": motion, "range": {"start": 1.8, "stop": 1.9}})
        assert branch["parameter"].size == 0
        assert reason in branch["reason"]
    document = whole("periodic-orbits", {"omega": 0.29, "clearance": 2.1})
    assert "trajectory" in document["reason"]  # it settles to the motion without impacts
    moving = {"omega": 0.29, "clearance": 1.6, "transient_periods": 0, "max_period": 1}
    assert "may be chaotic" in whole("periodic-orbits", moving)["reason"]


def test_a_branch_ends_in_its_saddle_node_and_its_graze() -> None:
    body = {**ORBIT, "motion": {"period": 1, "stops": [1]}, "range": {"start": 1.8, "stop": 1.9}}
    document = whole("orbit-branches", body)
    special = {point["type"]: point for point in document["special_points"]}
    assert special["SN"]["parameter"] == pytest.approx(1.868341055125, abs=1e-10)
    grazes = [point["parameter"] for point in document["special_points"] if point["type"] == "GR"]
    assert min(abs(place - 1.844237331292) for place in grazes) < 1e-9
    assert min(abs(place - 1.854989818434) for place in grazes) < 1e-9  # where the impact itself vanishes
    rows = len(document["parameter"])
    assert document["velocities"].shape == (rows, 1)
    assert document["multipliers"].shape == (rows, 6, 2)
    # a row of a symmetric branch is a whole motion, which leads back to itself
    symmetric = {"omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}}
    branch = whole("orbit-branches", {**symmetric, "range": {"start": 1.55, "stop": 1.65}})
    row = 1
    motion = {name: branch[name][row].tolist() for name in ("phases", "velocities")}
    again = whole(
        "periodic-orbits",
        {
            "omega": 0.29,
            "clearance": float(branch["clearance"][row]),
            "motion": {"period": 1, "stops": branch["stops"].tolist(), **motion},
        },
    )
    assert again["motion"]["label"] == "1-2r-2l"
    assert again["admissible"] == branch["admissible"][row]
    np.testing.assert_allclose(again["velocities"], branch["velocities"][row], rtol=1e-10)
    along = whole("orbit-branches", {**body, "vary": "omega", "range": {"start": 0.265, "stop": 0.275}})
    turn = next(point for point in along["special_points"] if point["type"] == "SN")
    assert along["parameter"].min() == pytest.approx(turn["omega"], abs=1e-4)
    assert turn["clearance"] == 1.85


def test_bifurcation_curves_are_records_of_pieces() -> None:
    window = {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}
    curves = whole("bifurcation-curves", {**window, "max_multiple": 1, "points": 100})["curves"]
    assert {(curve["type"], curve["motion"]) for curve in curves} >= {("SN", "1-1r-(-1)l"), ("SB", "1-1r-1l")}
    for curve in curves:
        assert curve["omega"].shape == curve["clearance"].shape == curve["impact_velocity"].shape
        assert set(curve["ends"]) <= {"window", "grazing", "admissible", "undecided", "none"}


def test_basins_are_the_same_however_they_are_cut() -> None:
    body = {
        "omega": 0.29,
        "clearance": 1.9927,
        "horizontal": {"quantity": "displacement", "values": {"start": -1.9, "stop": 1.9, "points": 9}},
        "vertical": {"quantity": "velocity", "values": {"start": -1.0, "stop": 1.0, "points": 6}},
        "initial": {"displacement": [0.0, 0.1, 0.0], "phase": 0.5},
    }
    single, many = (tiled("basins", body, *tile) for tile in ((6, 9), (4, 5)))
    assert encode_npz(single, {}) == encode_npz(many, {})
    named = [(attractor["label"], attractor["states"]) for attractor in single["attractors"]]
    assert {label for label, _ in named} == {"1-(-1)r-(-1)l", "3-1r-1l"}
    assert sum(count for _, count in named) == 54
    np.testing.assert_array_equal(np.bincount(single["label"].ravel()), [count for _, count in named])
    assert (single["horizontal"][0], single["vertical"][-1]) == (-1.9, 1.0)
    assert (single["basin_entropy"]["boxes"], single["basin_entropy"]["fractal"]) == (1, False)
    assert "uncertainty" not in single  # of a small rectangle
    planned = IMPLEMENTATIONS["basins"].plan(parse_request("basins", body))
    assert (planned.rows, planned.columns) == (6, 9)
    assert planned.estimate.seconds > 0.0


def test_larger_basins_have_an_uncertainty_exponent_unless_their_values_are_uneven() -> None:
    values = np.linspace(-1.9, 1.9, 64)
    body = {
        "omega": 0.29,
        "clearance": 1.9927,
        "horizontal": {"quantity": "displacement", "values": values.tolist()},
        "vertical": {"quantity": "velocity", "values": {"start": -1.0, "stop": 1.0, "points": 64}},
    }
    basins = tiled("basins", body)
    assert basins["uncertainty"]["distance"].tolist() == [1, 2, 4]
    assert 0.0 < basins["uncertainty"]["exponent"] < 1.1
    assert decode_npz(encode_npz(basins, {}))[0]["uncertainty"]["share"].shape == (3,)
    values[3] += 0.01
    body["horizontal"]["values"] = values.tolist()
    assert {"basin_entropy", "uncertainty"}.isdisjoint(tiled("basins", body))


def test_basin_fractions_are_the_same_however_they_are_cut() -> None:
    body = {
        "vary": "clearance",
        "range": {"start": 1.99, "stop": 1.999, "points": 4},
        "omega": 0.29,
        "states": 30,
        "displacement": [{"start": -2.2, "stop": 1.9}, {"start": 0, "stop": 0}, {"start": 0, "stop": 0}],
        "phase": 0.5,
    }
    single, many = (tiled("basin-fractions", body, *tile) for tile in ((4, 30), (3, 7)))
    assert encode_npz(single, {}) == encode_npz(many, {})
    assert {attractor["label"] for attractor in single["attractors"]} >= {"1-(-1)r-(-1)l", "3-1r-1l"}
    assert single["states"].sum(axis=0).tolist() == [30] * 4
    assert single["displacement"].tolist() == [[-2.2, 1.9], [0.0, 0.0], [0.0, 0.0]]
    np.testing.assert_allclose(single["velocity"], np.tile([-0.29 * 1.99, 0.29 * 1.99], (3, 1)))
    planned = IMPLEMENTATIONS["basin-fractions"].plan(parse_request("basin-fractions", body))
    assert (planned.rows, planned.columns) == (4, 30)


def test_a_diagram_has_the_results_of_its_parts_and_explains_its_borders() -> None:
    body = {
        "omega": {"start": 0.27, "stop": 0.272, "points": 4},
        "clearance": {"start": 1.84, "stop": 1.87, "points": 6},
        "max_multiple": 1,
        "borders": True,
    }
    request = parse_request("unfolding-diagrams", body)
    single, many = (tiled("unfolding-diagrams", body, *tile) for tile in ((6, 4), (4, 3)))
    assert encode_npz(single, {}) == encode_npz(many, {})
    alone = tiled("unfolding-maps", request.unfolding_map.canonical(), 6, 4)
    assert encode_npz(single["unfolding_map"], {}) == encode_npz(alone, {})
    curves = IMPLEMENTATIONS["bifurcation-curves"].whole(request.bifurcation_curves, lambda done, total: None)
    assert encode_npz(single["bifurcation_curves"], {}) == encode_npz(curves, {})
    borders = single["borders"]
    assert len(borders["row"]) > 4
    told = set(borders["explanations"][borders["explanation"][borders["regular"]]].tolist())
    assert {"curve"} <= told <= {"curve", "coexistence"}
    for number, curve in enumerate(borders["curves"]):
        assert curve["pairs"] == np.count_nonzero(borders["curve"] == number)
        assert curve["omega"].shape == curve["clearance"].shape == curve["admissible"].shape
    assert {curve["motion"] for curve in borders["curves"] if curve["pairs"]} >= {"1-1r-(-1)l"}
    assert "borders" not in tiled("unfolding-diagrams", {**body, "borders": False})


def test_a_trajectory_has_samples_impacts_and_a_labelled_motion() -> None:
    document = whole("trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 200, "samples_per_period": 8})
    assert document["displacement"].shape == document["velocity"].shape == (3, len(document["time"]))
    assert len(document["impacts"]["time"]) == len(document["impacts"]["kind"]) == 798
    assert document["motion"]["label"] == "1-2r-2l"
    assert document["sticking"]["start"].shape == (0,)
    impacts = document["impacts"]
    time = impacts["period"] * (2 * np.pi / 0.29) + impacts["phase_time"]
    np.testing.assert_allclose(time, impacts["time"], rtol=1e-15)
    assert impacts["period"].dtype == np.int64
    assert document["undecided"] == 0
    assert document["final"]["displacement"].shape == document["final"]["velocity"].shape == (3,)
    assert document["final"]["phase"] == 0.0


@pytest.mark.parametrize(
    ("clearance", "periods", "restitution", "expected"),
    [(1.6, 400, 0.8, NOT_VERIFIED), (1.6, 3, 0.8, None), (1.2, 400, 0.0, "the contact rests on a stop")],
)
def test_a_periodic_trajectory_says_why_it_is_not_verified(clearance, periods, restitution, expected) -> None:
    body = {"omega": 0.29, "clearance": clearance, "periods": periods, "oscillator": {"restitution": restitution}}
    motion = whole("trajectories", body)["motion"]
    assert motion["verified"] is False
    assert motion["kind"] == ("unresolved" if expected is None else "periodic")
    assert motion["reason"].startswith(expected or "the stroboscopic orbit did not close")


def test_a_trajectory_continues_from_its_final_state_in_another_request() -> None:
    body = {"omega": 0.29, "clearance": 1.6, "periods": 3, "initial": {"phase": 2.0}, "samples_per_period": 8}
    end = whole("trajectories", body)["final"]
    again = whole("trajectories", {**body, "initial": {name: np.asarray(end[name]).tolist() for name in end}})
    both = whole("trajectories", {**body, "periods": 6})
    np.testing.assert_allclose(again["displacement"], both["displacement"][:, 24:], rtol=0, atol=1e-12)


def test_times_are_sampled_exactly_as_given() -> None:
    body = {"omega": 0.29, "clearance": 1.6, "periods": 2}
    document = whole("trajectories", {**body, "times": [0.0, 0.1, 2 * np.pi / 0.29]})
    assert document["time"].tolist() == [0.0, 0.1, 2 * np.pi / 0.29]
    even = whole("trajectories", {**body, "samples_per_period": 1})
    np.testing.assert_allclose(document["displacement"][:, [0, 2]], even["displacement"][:, :2], rtol=0, atol=1e-14)


def test_a_list_of_states_has_a_record_for_each_as_alone() -> None:
    body = {"omega": 0.29, "clearance": 1.6, "periods": 3, "samples_per_period": 8}
    states = [{}, {"phase": 1.0}, {"displacement": [1.6, 0.0, 0.0], "velocity": [0.5, 0.0, 0.0]}]
    request = parse_request("trajectories", {**body, "initial": states})
    compute, seen = IMPLEMENTATIONS["trajectories"].whole, []
    assert compute is not None
    records = decode_npz(encode_npz(compute(request, lambda *step: seen.append(step)), {}))[0]["trajectories"]
    assert seen == [(0, 3), (1, 3), (2, 3)]
    for state, record in zip(states, records, strict=True):
        alone = whole("trajectories", {**body, "initial": state})
        assert set(record) == set(alone)
        for name in ("time", "displacement", "velocity"):
            np.testing.assert_array_equal(record[name], alone[name])
        for name, values in alone["impacts"].items():
            np.testing.assert_array_equal(record["impacts"][name], values)
        assert record["motion"] == alone["motion"]
        np.testing.assert_array_equal(record["final"]["velocity"], alone["final"]["velocity"])


def test_an_error_of_the_core_has_a_pointer_to_the_state_concerned() -> None:
    request = parse_request("trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 3, "initial": [{}, {}]})
    assert request_pointer(request, "states[1].velocity") == "/initial/1/velocity"
    assert request_pointer(request, "times") == "/times"
    assert request_pointer(request, "states") is None
    assert request_pointer(request, None) is None


def test_any_cut_of_a_map_gives_the_same_bytes() -> None:
    uncut = tiled("unfolding-maps", MAP, 3, 4)
    for tile in ((2, 3), (1, 1)):
        assert encode_npz(tiled("unfolding-maps", MAP, *tile), {}) == encode_npz(uncut, {})
    assert uncut["kind"].shape == (3, 4)
    assert uncut["kind"].dtype == np.int8
    assert set(uncut["kinds"]) >= {"periodic", "unresolved"}
    assert uncut["symmetric"].dtype == np.bool_
    assert uncut["least_impact_velocity"].dtype == np.float64


CHAIN = {
    "masses": [1.0, 2.0, 2.0],
    "stiffnesses": [1.0, 2.0, 2.0],
    "damping": 0.02,
    "forcing": [1.0, 0.0, 0.0],
    "restitution": 0.95,
}
LIGHT = {"masses": [1.0], "stiffnesses": [1.0], "damping": 0.01, "forcing": [1.0], "restitution": 0.9}


@pytest.mark.parametrize(
    "oscillator", [CHAIN, pytest.param(LIGHT, marks=KERNELS_FIRST)], ids=["three masses", "one mass"]
)
@pytest.mark.parametrize("policy", ["rest", "sweep-down"])
def test_a_chaotic_map_has_a_chance_to_settle_that_does_not_depend_on_its_cut(
    policy: str, oscillator: dict[str, Any]
) -> None:
    body = {"omega": {"start": 0.7, "stop": 1.5, "points": 6}, "clearance": {"start": 0.2, "stop": 0.6, "points": 4}}
    body |= {"oscillator": oscillator, "policy": policy, "max_periods": 100}
    single, many = (tiled("unfolding-maps", body, 4, columns) for columns in (6, 2))
    assert encode_npz(single, {}) == encode_npz(many, {})
    chance = single["chance_to_settle"]
    chaotic = np.count_nonzero(single["kind"] == single["kinds"].tolist().index("chaotic"))
    assert (chance["watched"], chance["run_on"], chance["chaotic"]) == (100, 1000, chaotic)
    assert chance["low"] <= chance["chance"] <= chance["high"]


@pytest.mark.parametrize(
    ("chaos", "clearance", "calm"),
    [
        ({"oscillator": CHAIN, "omega": 1.1}, 0.3, 5.0),
        pytest.param(
            {"oscillator": {**LIGHT, "damping": 0.02, "restitution": 0.8}, "omega": 0.9545},
            6.2047,
            11.0,
            marks=KERNELS_FIRST,
        ),
    ],
    ids=["three masses", "one mass"],
)
def test_basins_and_diagrams_with_chaos_have_a_chance_to_settle(
    chaos: dict[str, Any], clearance: float, calm: float
) -> None:
    along = {"vary": "clearance", "range": [clearance, calm], "periods": 10, "transient_periods": 90}
    diagram = whole("bifurcation-diagrams", {**chaos, **along, "policy": "sweep-down"})
    assert diagram["sections"][0]["motion"]["kind"] == "chaotic"
    expected = {"watched": 600, "run_on": 6000, "chaotic": 1, "sampled": 1, "settled": 0, "chance": 0.0, "low": 0.0}
    assert diagram["chance_to_settle"].items() >= expected.items()
    body = {
        "clearance": clearance,
        "horizontal": {"quantity": "displacement", "values": [-0.5 * clearance, 0.5 * clearance]},
        "vertical": {"quantity": "velocity", "values": [0.0, 0.1]},
        "max_periods": 100,
    }
    basins = tiled("basins", {**chaos, **body}, 1, 2)
    assert [attractor["kind"] for attractor in basins["attractors"]] == ["chaotic"]
    assert (basins["chance_to_settle"]["sampled"], basins["chance_to_settle"]["settled"]) == (4, 0)


def test_an_adaptive_map_is_joined_from_strips_and_has_figures_where_it_was_computed() -> None:
    body = {
        "omega": {"start": 0.272, "stop": 0.29, "points": 40},
        "clearance": {"start": 1.84, "stop": 1.99, "points": 60},
        "max_periods": 100,
    }
    adaptive = {**body, "adaptive": True}
    request, cut = parse_request("unfolding-maps", adaptive), Plan(rows=60, columns=40, tile_rows=30, tile_columns=16)
    document = decode_npz(encode_npz(tiled("unfolding-maps", adaptive, 30, 16), {}))[0]
    full = tiled("unfolding-maps", body)
    computed, figures = document["computed"], document["at_computed"]
    assert document.keys() | figures.keys() == full.keys() | {"computed", "at_computed", "inferred_wrong"}
    for name in ("kind", "reason", "period", "impacts_right", "impacts_left", "symmetric", "sticking"):
        assert document[name].dtype == full[name].dtype
        assert document[name][computed].tobytes() == full[name][computed].tobytes(), name
    for name, array in figures.items():
        assert array.tobytes() == full[name][computed].tobytes(), name
    reasons = document["reasons"][document["reason"][~computed]]
    assert (reasons != "").all()
    assert figures["verified"].any()
    # closing the seams has computed more than the tiles had, and the sample
    process = IMPLEMENTATIONS["unfolding-maps"]
    assert process.tile is not None
    assert process.assembled is not None
    tiles, stated = [process.tile(request, tile) for tile in cut.tiles], document["inferred_wrong"]
    assert computed.sum() > stated["sampled"] + sum(tile["computed"].sum() for tile in tiles)
    assert computed.mean() < 0.7
    assert stated["low"] <= stated["wrong"] / stated["sampled"] <= stated["high"]
    # the sample is the same when the map is assembled again
    assert process.assembled(request, cut, tiles, silent)["inferred_wrong"] == stated


def test_the_remedy_for_a_sensitive_point_is_one_that_its_result_has() -> None:
    def remedy(process: str, body: dict[str, Any]) -> str:
        reasons = tiled(process, body)["reasons"].tolist()
        (sensitive,) = (reason for reason in reasons if reason.startswith("sensitive: "))
        return str(sensitive).partition("Remedy: ")[2]

    few = {"omega": [0.3, 0.31], "clearance": [1.9, 1.95], "max_periods": 10}
    assert remedy("unfolding-maps", few).startswith("an unfolding map with resolve_sensitive")
    assert remedy("unfolding-maps", {**few, "resolve_sensitive": True}).startswith("simulate more periods")
    assert remedy("unfolding-maps", {**few, "policy": "sweep-up"}).startswith("a map from rest with resolve_sensitive")
    assert "not adaptive, with resolve_sensitive" in remedy("unfolding-maps", {**few, "adaptive": True})
    rectangle = {name: {"quantity": name, "values": [0.0, 0.1]} for name in ("displacement", "velocity")}
    basins = {"horizontal": rectangle["displacement"], "vertical": rectangle["velocity"], "max_periods": 10}
    assert "proofs" in remedy("basins", {"omega": 0.3, "clearance": 1.9, **basins})


@pytest.mark.parametrize("policy", ["sweep-up", "sweep-down", "ensemble"])
def test_every_policy_is_cut_so_that_the_bytes_stay_the_same(policy: str) -> None:
    body = {**MAP, "policy": policy, "initial_conditions": 5, "seed": 3}
    planned = IMPLEMENTATIONS["unfolding-maps"].plan(parse_request("unfolding-maps", body))
    uncut = tiled("unfolding-maps", body, 3, 4)
    assert planned.tile_rows == 3 or policy == "ensemble"
    for tile in ((), (3, 1)):
        assert encode_npz(tiled("unfolding-maps", body, *tile), {}) == encode_npz(uncut, {})
    assert ("share" in uncut) == ("motions_found" in uncut) == (policy == "ensemble")
    again = tiled("unfolding-maps", {**body, "seed": 4})
    assert (encode_npz(again, {}) == encode_npz(uncut, {})) == (policy != "ensemble")


def test_options_set_to_false_do_not_change_the_id_of_a_map() -> None:
    def asked(**changes: object) -> str:
        return canonical_id("unfolding-maps", parse_request("unfolding-maps", {**MAP, **changes}).canonical(), "1.0")

    # nothing of it is in the question's text, so ids of questions from before maps could be so are the same
    for name in ("adaptive", "preview", "resolve_sensitive"):
        assert name not in parse_request("unfolding-maps", {**MAP, name: False}).canonical()
        assert asked() == asked(**{name: False}) != asked(**{name: True})


@pytest.mark.parametrize("adaptive", [False, True])
def test_a_preview_has_names_and_no_figures_of_small_changes(adaptive: bool) -> None:
    body = {"omega": {"start": 0.26, "stop": 0.3, "points": 8}, "clearance": {"start": 1.3, "stop": 2.0, "points": 12}}
    whole, preview = (
        tiled("unfolding-maps", {**body, "adaptive": adaptive, "preview": asked}) for asked in (False, True)
    )
    left_out = {"multiplier", "lyapunov", "lyapunov_error"}
    assert whole.keys() == preview.keys() | {"chance_to_settle"} | (set() if adaptive else left_out)
    if adaptive:
        assert whole["at_computed"].keys() == preview["at_computed"].keys() | left_out


@pytest.mark.parametrize("policy", ["rest", "ensemble"])
def test_a_map_says_which_points_it_has_resolved(policy: str) -> None:
    body = {"omega": [0.28, 0.29], "clearance": [1.5, 1.6, 1.7], "policy": policy, "initial_conditions": 2}
    as_it_is, resolved = (tiled("unfolding-maps", {**body, "resolve_sensitive": asked}) for asked in (False, True))
    assert resolved.keys() == as_it_is.keys() | {"resolved"}
    assert resolved["resolved"].shape == (3, 2)
    assert resolved["verified"][resolved["resolved"]].all()


def test_the_fields_of_an_ensemble_are_part_of_its_request_only() -> None:
    def asked(**changes: object) -> str:
        return canonical_id("unfolding-maps", parse_request("unfolding-maps", {**MAP, **changes}).canonical(), "1.0")

    assert asked() == asked(policy="rest", seed=7, initial_conditions=3)
    assert asked(policy="sweep-up") == asked(policy="sweep-up", seed=7)
    assert asked(policy="ensemble") == asked(policy="ensemble", seed=0, initial_conditions=16)
    assert len({asked(policy=policy) for policy in ("rest", "sweep-up", "sweep-down", "ensemble")}) == 4
    assert (
        asked(policy="ensemble", seed=1) != asked(policy="ensemble") != asked(policy="ensemble", initial_conditions=3)
    )


@pytest.mark.parametrize(
    ("process", "body"),
    [
        ("trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 300}),
        (
            "bifurcation-diagrams",
            {"vary": "clearance", "range": {"start": 1.5, "stop": 1.6, "points": 4}, "omega": 0.29, "periods": 300},
        ),
    ],
)
def test_impacts_beyond_the_bytes_of_a_result_are_refused_with_the_field_that_decides(
    monkeypatch: pytest.MonkeyPatch, process: str, body: dict[str, Any]
) -> None:
    monkeypatch.setattr(f"grazemap_worker.processes.{process.replace('-', '_')}.MAX_RESULT_BYTES", 61_000)
    with pytest.raises(CoreError, match=r"more than 1000 impacts.*at most 61000 bytes") as caught:
        whole(process, body)
    assert request_pointer(parse_request(process, body), caught.value.name) == "/periods"  # type: ignore[attr-defined]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_points_are_proven_from_their_records(seed: int) -> None:
    divisor, proofs = proofs_of(seed)
    counts = Counter(proof["verdict"] for proof in proofs)
    assert divisor == 1 + seed
    assert counts["disproven"] == 0
    assert counts["proven"] >= 0.9 * len(proofs) > 0, [proof["reason"] for proof in proofs]

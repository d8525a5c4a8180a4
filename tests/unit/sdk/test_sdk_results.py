"""Results: arrays and records, saved and loaded without losing anything."""

import dataclasses
import inspect
import io
import json
import random
import re
import time
import tracemalloc
import warnings
import zipfile

import numpy as np
import pytest

import grazemap
from grazemap import Event
from grazemap.checker import Verdict
from grazemap.client.process_methods import METHODS
from grazemap.codec import CodecError, decode_npz, encode_npz, iter_json
from grazemap.errors import ResultFormatError
from grazemap.results import Border, ChanceToSettle, Family, InferredWrong, UnfoldingMap, decode_result, load
from grazemap.results.motions import motions_of
from grazemap.results.stretches import Stretch
from grazemap.results.structures import Mode
from grazemap.results.unfolding import MapPoint
from grazemap.wire import motion_label
from grazemap.wire.planes import Plane
from tests.support.sdk_documents import ADAPTIVE, CHANCE, INFERRED_WRONG, MANY, POINTS, REQUESTS, document, npz

EVERY_PROCESS = pytest.mark.parametrize("process", list(REQUESTS))


@EVERY_PROCESS
def test_saving_gives_the_bytes_that_the_service_sent(process, tmp_path):
    data = npz(process)
    path = decode_result(data).save(tmp_path / "result.npz")
    assert path.read_bytes() == data


@EVERY_PROCESS
def test_fields_of_a_newer_service_are_kept(process, tmp_path):
    data = npz(process, {"lyapunov": np.array([0.5]), "novelty": {"deep": [{"a": 1}]}})
    assert decode_result(data).save(tmp_path / "result.npz").read_bytes() == data


def same(one, other):
    """Check that two values are equal through all their fields, arrays to their kind; a document's may differ."""
    assert type(other) is type(one)
    if isinstance(one, np.ndarray):
        assert other.dtype.kind == one.dtype.kind
        np.testing.assert_array_equal(one, other)
    elif isinstance(one, tuple):
        for a, b in zip(one, other, strict=True):
            same(a, b)
    elif dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            if field.name != "_document":
                same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, float):
        np.testing.assert_equal(one, other)  # NaN is NaN
    else:
        assert one == other


@EVERY_PROCESS
def test_json_and_npz_load_to_the_same_result(process, tmp_path):
    result = decode_result(npz(process))
    loaded = grazemap.load(result.save(tmp_path / "result.json"))
    assert type(loaded) is type(result)
    same(result, loaded)
    # and what came from JSON can be saved as npz again
    again = loaded.save(tmp_path / "again.npz")
    same(result, grazemap.load(again))
    assert set(decode_npz(again.read_bytes())[0]) == set(decode_npz(npz(process))[0])


def test_json_is_strict_and_writes_nan_as_null(tmp_path):
    path = decode_result(npz("unfolding-maps")).save(tmp_path / "map.json")
    values = json.loads(path.read_text(), parse_constant=pytest.fail)["least_impact_velocity"]
    assert values == [[0.1, 0.2, 0.3], [0.4, None, None]]


def test_points_are_frozen_records_with_none_for_fields_of_other_kinds():
    recurrence, resonant = decode_result(npz("codimension-two-points")).points
    assert recurrence.families == (Family(1, 1), Family(4, 0))
    assert (recurrence.order, recurrence.active, recurrence.multiple, recurrence.bifurcation) == (2, True, None, None)
    assert (resonant.order, resonant.families, resonant.multiple, resonant.symmetric) == (None, (), 1, False)
    assert recurrence.unfolding is None
    assert (resonant.unfolding.contact, resonant.unfolding.quadratic) == ("tangent", 120.0)
    with pytest.raises(dataclasses.FrozenInstanceError):
        recurrence.omega = 1.0


def test_a_discontinuity_mapping_has_its_graze_its_errors_and_its_returns(tmp_path):
    path = decode_result(npz("discontinuity-mappings")).save(tmp_path / "mapping.json")
    for result in (decode_result(npz("discontinuity-mappings")), load(path)):
        assert (result.stop, result.clearance, result.grazing.acceleration) == (-1, 1.99, 0.17)
        assert result.mapped.shape == result.displacement.shape == (2, 7)
        assert result.returns.mapped.shape == (2, 3, 7)
        assert result.next_contact.order.tolist() == [2, 0]
        np.testing.assert_array_equal(result.returns.error[0], [1e-4, 1e-5, np.nan])


def test_a_periodic_orbit_has_complex_multipliers_and_a_state_to_start_from(tmp_path):
    path = decode_result(npz("periodic-orbits")).save(tmp_path / "orbit.json")
    for result in (decode_result(npz("periodic-orbits")), load(path)):
        assert result.multipliers.tolist() == [0.5 + 0.25j, 0.5 - 0.25j, -1.5]
        assert (result.motion.label, result.stable, result.isolated) == ("1-1r-1l", False, True)
        assert (result.admissible, result.verified, result.motion.verified) == (True, False, False)
        assert result.start.velocity.tolist() == [0.1, 0.2, 0.3]
        assert result.stops.tolist() == [1, -1]


def test_an_orbit_that_was_not_found_has_a_reason(tmp_path):
    unknown = dict.fromkeys(("residual", "kantorovich", "radius", "excess", "excess_phase"), np.nan)
    lost = {"converged": False, "reason": "no motion with these stops", **unknown, "stops": np.zeros(0, dtype=int)}
    path = decode_result(npz("periodic-orbits", lost)).save(tmp_path / "orbit.json")
    for result in (decode_result(npz("periodic-orbits", lost)), load(path)):
        assert np.isnan(result.residual)
        assert "no motion with these stops" in repr(result)


def test_a_motion_with_rests_is_marked_as_found_by_simulation(tmp_path):
    path = decode_result(npz("periodic-orbits by simulation")).save(tmp_path / "orbit.json")
    for result in (decode_result(npz("periodic-orbits by simulation")), load(path)):
        assert (result.found_by, result.verified, result.reason) == ("simulation", False, "found by simulation")
        assert result.sticking.start.tolist() == [3.0, 14.0]
        assert result.sticking.stop.tolist() == [1, -1]
        assert repr(result) == "<PeriodicOrbit: 1-1r-1l, stable, by simulation>"
        assert result.to_xarray()["sticking_stop_time"].values.tolist() == [5.0, 16.0]
    assert len(decode_result(npz("periodic-orbits")).sticking) == 0


def test_orbits_beyond_a_special_point_are_requests(tmp_path):
    path = decode_result(npz("orbit-branches")).save(tmp_path / "branch.json")
    for result in (decode_result(npz("orbit-branches")), load(path)):
        saddle, graze = result.special_points
        assert saddle.beyond == ()
        assert [beyond.admissible for beyond in graze.beyond] == [True, False]
        asked, _ = METHODS["periodic_orbit"].asked(**graze.beyond[0].request)
        assert (asked.omega, asked.clearance, asked.motion.phases) == (0.27, 1.86, [0.5, 3.5])
        assert asked.oscillator.restitution == 0.8
        assert result.restitution.tolist() == [0.8] * 4
        assert graze.restitution == 0.8


def test_a_branch_has_its_special_points_and_its_ends(tmp_path):
    path = decode_result(npz("orbit-branches")).save(tmp_path / "branch.json")
    for result in (decode_result(npz("orbit-branches")), load(path)):
        saddle, graze = result.special_points
        assert (saddle.type, saddle.parameter, saddle.stop) == ("SN", 1.885, None)
        assert (saddle.status, saddle.reason) == ("guess", "it was not solved for")
        assert (graze.status, graze.reason) == ("converged", None)
        assert (graze.type, graze.stop, graze.phase, graze.impact) == ("GR", -1, 2.5, 0)
        assert graze.velocities.tolist() == [0.1, -0.1]
        assert result.multipliers.shape == (4, 6)
        assert result.velocities.shape == (4, 2)
        row = result.motion(1)
        assert (row["period"], row["stops"], row["velocities"]) == (1, [1, -1], [0.25, -0.25])
        assert result.ends[1] == "steps become too short"
    empty = {
        **dict.fromkeys(("parameter", "omega", "clearance", "restitution", "excess", "residual"), np.zeros(0)),
        **dict.fromkeys(("phases", "velocities"), np.zeros((0, 0))),
        **dict.fromkeys(("stable", "admissible"), np.zeros(0, dtype=bool)),
        "stops": np.zeros(0, dtype=int),
        "multipliers": np.zeros((0, 6, 2)),
        "special_points": [],
        "reason": "lost",
    }
    path = decode_result(npz("orbit-branches", empty)).save(tmp_path / "empty.json")
    for result in (decode_result(npz("orbit-branches", empty)), load(path)):
        assert repr(result) == "<OrbitBranch: no points: lost>"
        assert result.plot().get_title().startswith("Branch of period 1")
        assert result.plot_multipliers().get_title().startswith("Multipliers along a branch of period 1")


def test_bifurcation_curves_are_pieces_with_their_motion_and_ends(tmp_path):
    path = decode_result(npz("bifurcation-curves")).save(tmp_path / "curves.json")
    for result in (decode_result(npz("bifurcation-curves")), load(path)):
        first = result.curves[0]
        assert (first.type, first.motion, first.ends) == ("SN", "1-1r-(-1)l", ("window", "grazing"))
        assert first.omega.tolist() == [0.2, 0.25, 0.3]
        assert result.to_xarray()["point_curve"].values.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
        assert result.motions == ()
        with pytest.raises(ValueError, match="no phases"):
            first.orbit(0)
    nothing = decode_result(npz("bifurcation-curves", {"curves": []}))
    assert nothing.curves == ()
    assert nothing.to_xarray()["omega"].size == 0


def test_curves_of_motions_have_their_orbits_and_what_was_not_found(tmp_path):
    path = decode_result(npz("bifurcation-curves of motions")).save(tmp_path / "curves.json")
    for result in (decode_result(npz("bifurcation-curves of motions")), load(path)):
        turning, graze = result.curves
        assert (turning.type, turning.of_motion, turning.impact, turning.ends) == ("NS", 0, None, ("real", "window"))
        assert (graze.impact, graze.stop, graze.stops) == (1, 1, (1, 1, -1, -1))
        point = graze.orbit(1)
        assert (point["omega"], point["clearance"]) == (0.25, 1.55)
        assert point["motion"]["velocities"] == [0.1, 0.0, -0.1, 0.0]
        found, lost = result.motions
        assert (found.label, found.omega, found.reason) == ("1-2r-2l", 0.25, None)
        assert (lost.label, lost.omega, lost.stops, lost.reason) == (None, None, (1, 1, 1), "not met")
        assert repr(result) == "<BifurcationCurves: 2 pieces of curves, 1 motion not found>"


def test_a_bifurcation_diagram_has_a_section_for_every_value(tmp_path):
    path = decode_result(npz("bifurcation-diagrams")).save(tmp_path / "diagram.json")
    for result in (decode_result(npz("bifurcation-diagrams")), load(path)):
        assert (result.vary, result.labels()) == ("clearance", ("1-1r-0l", "unresolved"))
        assert result.sections[1].displacement.tolist() == [0.3, 0.4, 0.5]
        assert result.sections[1].impact_velocity.shape == (0,)
        assert result.sections[1].motion.reason == "not closed"
        assert [(section.sensitive, section.transient_growth) for section in result.sections] == [
            (True, 31.5),
            (False, None),
        ]
        assert repr(result) == "<BifurcationDiagram: 2 values of clearance, 1 sensitive>"
        place, value = result.points("impact_velocity")
        assert (place.tolist(), value.tolist()) == ([1.5] * 3, [0.5] * 3)
    made = result.to_xarray()
    assert made["point_parameter"].values.tolist() == [1.5] * 3 + [1.6] * 3
    np.testing.assert_array_equal(made["transient_growth"], [31.5, np.nan])
    assert made["sensitive"].values.tolist() == result.to_dataframe()["sensitive"].tolist() == [True, False]


def test_basins_have_attractors_with_their_known_properties(tmp_path):
    path = decode_result(npz("basins")).save(tmp_path / "basins.json")
    for result in (decode_result(npz("basins")), load(path)):
        assert result.label.tolist() == [[0, 0, 1], [2, -1, 0]]
        first, second, chaos = result.attractors
        assert (first.label, first.impacts_right, first.mean_position) == ("1-2r-1l", 2, 0.25)
        assert second.mean_position == -0.25
        assert (chaos.kind, chaos.label, chaos.period, chaos.lyapunov) == ("chaotic", None, None, 0.1)
        assert chaos.multiplier is None
        assert result.unresolved == pytest.approx(1 / 6)
    made = result.to_xarray()
    assert meanings(made["motion"].sel(vertical=0.5)) == ["chaotic", "unresolved", "1-2r-1l"]


def test_chaos_has_its_chance_to_settle_and_a_sample_may_be_empty(tmp_path):
    basins = decode_result(npz("basins"))
    assert basins.chance_to_settle == ChanceToSettle(**CHANCE)
    assert "1 of 4 chaotic motions settle within 10000 periods" in str(basins)
    empty = {**CHANCE, "sampled": 0, "settled": 0, "chance": np.nan, "low": 0.0, "high": 1.0}
    path = decode_result(npz("basins", {"chance_to_settle": empty})).save(tmp_path / "basins.json")
    assert json.loads(path.read_text())["chance_to_settle"]["chance"] is None
    assert np.isnan(load(path).chance_to_settle.chance)


@pytest.mark.parametrize("process", ["unfolding-maps", "basins", "unfolding-diagrams"])
def test_summaries_have_the_share_of_sensitive_points(process):
    sensitive = {"sensitive": np.array([[False, True, False], [False, False, False]])}
    of_map = process == "unfolding-diagrams"
    changed = {"unfolding_map": document("unfolding-maps") | sensitive} if of_map else sensitive
    new, old = decode_result(npz(process, changed)), decode_result(npz(process))
    said, said_of_old = (result.summary() if of_map else repr(result) for result in (new, old))
    assert "1 sensitive (16.67%)" in said
    assert "sensitive" not in said_of_old


def test_a_diagram_has_its_parts_and_the_explanation_of_every_border(tmp_path):
    path = decode_result(npz("unfolding-diagrams")).save(tmp_path / "diagram.json")
    for result in (decode_result(npz("unfolding-diagrams")), load(path)):
        assert result.unfolding_map.labels()[1].tolist() == ["1-2r-2l", "unresolved", "1-(-1)r-(-1)l"]
        assert result.unfolding_map.meta["process"] == "unfolding-maps"
        assert result.grazing_curve.meta["request"]["omega"]["points"] == 400
        assert len(result.codimension_two_points.points) == 2
        assert [curve.type for curve in result.bifurcation_curves.curves] == ["SN", "GR", "PD"]
        borders = result.borders
        assert len(borders) == 4
        assert [curve.pairs for curve in borders.curves] == [0, 1]
        assert borders.curves[1].admissible.tolist() == [True, False, True]
        assert borders.curves[1].ends == ("window", "window")
        rows, columns = borders.others()
        assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == [(1, 0), (1, 1), (0, 1), (1, 2)]
        counts = {name: borders.count(name) for name in borders.explanations}
        assert counts == {"unexplained": 1, "curve": 1, "coexistence": 1, "goes on": 0}
        assert borders.count("goes on", regular=False) == 1
        assert borders.count("no such word") == 0
    listed = {border.explanation: border for border in result.border_list()}
    assert listed["curve"].curve == "SN of 1-1r-(-1)l"
    assert listed["unexplained"].reason == "no orbit"
    assert listed["goes on"] == result.border_list()[-1]
    assert listed["goes on"].motions == ("1-(-1)r-(-1)l", "unresolved")
    said = result.summary()
    assert "2 of the 6 points that are not chaotic (33.33%)" in said
    assert "3 steps between points with two periodic motions: 1 curve, 1 coexistence, 0 goes on, 1 unexplained" in said
    assert "no orbit" in said
    made = result.to_xarray()
    assert meanings(made["border_explanation"]) == ["curve", "coexistence", "unexplained", "goes on"]
    assert made["kind"].dims == ("clearance", "omega")


def test_mirror_images_have_one_label_in_a_diagram_and_asymmetric_twins_another():
    document = npz("unfolding-diagrams")
    plain = decode_result(document)
    one_sided = decode_result(
        npz("unfolding-diagrams", {"unfolding_map": _with(plain, impacts_right=1, impacts_left=2)})
    )
    other = decode_result(npz("unfolding-diagrams", {"unfolding_map": _with(plain, impacts_right=2, impacts_left=1)}))
    assert [one.motions for one in one_sided.border_list()] == [one.motions for one in other.border_list()]
    twins = decode_result(npz("unfolding-diagrams", {"unfolding_map": _with(plain, symmetric=False)}))
    assert any("1-2r-2l asymmetric" in border.motions for border in twins.border_list())


def _with(diagram, **values):
    """Return the document of a diagram's map with some of its arrays filled with a value."""
    umap = diagram.unfolding_map
    names = ("omega", "clearance", "kind", "period", "impacts_right", "impacts_left", "symmetric", "sticking",
             "least_impact_velocity", "settled_after", "verified", "reason")  # fmt: skip
    arrays = {name: getattr(umap, name).copy() for name in names}
    for name, value in values.items():
        arrays[name][:] = value
    return {**arrays, "kinds": np.array(umap.kinds), "reasons": np.array(umap.reasons)}


def test_a_diagram_without_borders_has_no_fields_of_borders():
    whole = decode_result(npz("unfolding-diagrams"))
    bare = type(whole).from_document({k: v for k, v in whole._document.items() if k != "borders"}, whole.meta)
    assert bare.borders is None
    assert bare.border_list() == []
    assert "steps" not in bare.summary()


def test_the_sequence_of_a_grazing_curve_is_there_where_it_was_requested():
    assert decode_result(npz("grazing-curves")).xi is None
    curve = decode_result(npz("grazing-curves", {"xi": np.arange(6.0).reshape(3, 2)}))
    assert curve.xi.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
    assert curve.to_xarray()["xi"].dims == ("omega", "order")


def test_a_trajectory_has_its_impacts_and_motion():
    result = decode_result(npz("trajectories"))
    assert len(result.impacts) == 2
    assert len(result.sticking) == 0
    np.testing.assert_array_equal(result.impacts.stop, [1, -1])
    assert result.motion.symmetric is True
    assert result.displacement.shape == (3, 5)


def test_a_trajectory_has_its_final_state_and_the_number_of_undecided_events():
    result = decode_result(npz("trajectories"))
    np.testing.assert_array_equal(result.final.velocity, [1.0, 1.0, 1.0])
    assert (result.final.phase, result.undecided) == (0.0, 0)
    np.testing.assert_array_equal(result.impacts.phase_time, [5.0, 20.0])
    assert result.impacts.period.dtype == np.int64
    assert decode_result(npz("trajectories", {"final": None})).final is None


def test_many_trajectories_are_each_the_result_of_the_request_with_its_state_alone(tmp_path):
    result = decode_result(npz(MANY))
    assert repr(result) == "<Trajectories: 3 trajectories: 2 x unresolved, 1 x 1-1r-1l>"
    whole, early, none = result.trajectories
    single = decode_result(npz("trajectories"))
    same(whole, single)
    assert whole.save(tmp_path / "one.npz").read_bytes() == npz("trajectories")
    assert early.meta["request"]["initial"] == {"displacement": [0.0] * 3, "velocity": [0.0] * 3, "phase": 1.0}
    np.testing.assert_array_equal(early.displacement, [[0.1, 0.2], [0.3, 0.4], [0.5, np.nan]])
    assert [len(path.impacts) for path in result.trajectories] == [2, 1, 0]
    assert [len(path.sticking) for path in result.trajectories] == [0, 1, 0]
    assert early.motion.reason == "too stiff"
    assert none.final is None
    assert none.displacement.shape == (3, 0)
    for path in result.trajectories:
        same(path, grazemap.load(path.save(tmp_path / "one.json")))


def test_records_with_arrays_are_ragged_in_npz_and_readable_without_this_package():
    with np.load(io.BytesIO(npz(MANY)), allow_pickle=False) as archive:
        arrays = dict(archive)
    assert arrays["trajectories.count"] == 3
    records = document(MANY)["trajectories"]
    for name, pick in (
        ("time", lambda r: r["time"]),
        ("displacement", lambda r: r["displacement"]),
        ("impacts.kind", lambda r: r["impacts"]["kind"]),
    ):
        offsets, values = arrays[f"trajectories.{name}.offsets"], arrays[f"trajectories.{name}.values"]
        for i, one in enumerate(records):
            piece = values[offsets[i] : offsets[i + 1]]
            if f"trajectories.{name}.shape" in arrays:
                piece = piece.reshape(arrays[f"trajectories.{name}.shape"][i])
            np.testing.assert_array_equal(piece, pick(one))
    assert arrays["trajectories.undecided"].tolist() == [0, 2, 2]


@pytest.mark.parametrize(
    "records",
    [
        [{"a": np.arange(3), "b": {"c": np.zeros((2, 1)), "d": {"e": 1}}}, {"a": np.arange(2), "b": None}],
        [{"a": {"b": [{"c": np.array([1.5, np.inf])}, {"c": np.zeros(0)}], "n": None}}, {"a": {"b": [], "n": 3}}],
        [{"a": [[1, 2], [3]], "values": np.zeros(1), "offsets": {"values": 1, "shape": np.zeros((1, 1, 2))}}],
        [{"a": [[{"b": 1.0}], []]}, {"a": [[{"b": 2.0}, {"b": None}]]}],
        [{"a": {"count": 2, "b": "text"}, "f": True}, {"a": {"count": 3}, "f": None}],
        [{"a": [np.arange(2), np.arange(3)]}, {"a": []}],
    ],
)
def test_records_of_any_shape_are_read_back_unchanged(records):
    def equal(one, other):
        if isinstance(one, np.ndarray):
            assert isinstance(other, np.ndarray)
            assert (one.dtype, one.shape) == (other.dtype, other.shape)
            np.testing.assert_array_equal(one, other)
        elif isinstance(one, dict):
            # a field that is missing in some records is None there
            assert set(one) <= set(other)
            for key, value in other.items():
                equal(one.get(key), value)
        elif isinstance(one, list):
            for a, b in zip(one, other, strict=True):
                equal(a, b)
        else:
            assert type(one) is type(other)
            assert one == other

    data = encode_npz({"items": records}, {"x": 1})
    found, meta = decode_npz(data)
    equal(records, found["items"])
    assert meta == {"x": 1}
    assert encode_npz(found, meta) == data


def test_records_that_npz_cannot_distinguish_are_not_written():
    for records in ([{"count": 1}], [{"a": {}}]):
        with pytest.raises(ValueError, match=r"count|without fields"):
            encode_npz({"items": records}, {})


def test_long_lists_of_records_are_written_as_json_in_short_pieces():
    records = [{"a": np.arange(3000.0), "b": None}] * 4
    pieces = list(iter_json({"items": records}, {"m": 1}))
    assert max(map(len, pieces)) < 20_000
    expected = {"items": [{"a": list(range(3000)), "b": None}] * 4, "meta": {"m": 1}}
    assert json.loads(b"".join(pieces)) == expected


def test_a_map_counts_its_motions_and_never_gives_the_unresolved_a_label():
    umap = decode_result(npz("unfolding-maps"))
    motions = umap.motions()
    assert [(motion.label, motion.pixels) for motion in motions] == [
        ("1-2r-2l", 2),
        ("unresolved", 2),
        ("1-(-1)r-(-1)l", 1),
        ("3-4r-4l", 1),
    ]
    assert sum(motion.share for motion in motions) == pytest.approx(1)
    assert motions[1].period is None
    assert umap.labels().tolist() == [["1-2r-2l", "unresolved", "3-4r-4l"], ["1-2r-2l", "unresolved", "1-(-1)r-(-1)l"]]


def test_the_motions_of_a_million_points_without_regions_are_counted_in_a_second():
    shape, rng = (1000, 1000), np.random.default_rng(0)
    counts = {"period": (1, 33), "impacts_right": (-2, 9), "impacts_left": (-2, 9)}
    document = {name: rng.integers(*bounds, shape, np.int32) for name, bounds in counts.items()}
    document |= {"kind": rng.integers(0, 2, shape, np.int8), "kinds": np.array(["chaotic", "periodic"])}
    began = time.thread_time()
    motions, places = motions_of(document)
    assert time.thread_time() - began < 1.5
    assert [one["pixels"] for one in motions] == np.bincount(places.ravel()).tolist()
    for point in [(0, 0), (17, 3), (999, 999), (500, 1)]:
        one, here = motions[places[point]], {name: int(document[name][point]) for name in counts}
        periodic = document["kind"][point] == 1
        assert one["label"] == (motion_label(*here.values()) if periodic else "chaotic")
        assert {name: one[name] for name in counts} == (here if periodic else dict.fromkeys(counts))


@pytest.mark.parametrize("preview", [False, True])
def test_a_preview_is_marked_as_one(preview):
    whole, meta = decode_npz(npz("unfolding-maps"))
    umap = UnfoldingMap.from_document(whole, {**meta, "request": {**meta["request"], "preview": preview}})
    assert umap.preview is preview
    assert ("a preview" in repr(umap)) is preview
    assert "verified" in repr(umap)
    assert umap.plot().get_title().startswith("Preview" if preview else "Unfolding map")


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_an_adaptive_map_has_the_arrays_of_a_full_one_and_no_invented_numbers(ending, tmp_path):
    full = decode_result(npz("unfolding-maps"))
    umap = grazemap.load(decode_result(npz(ADAPTIVE)).save(tmp_path / f"map{ending}"))
    assert full.computed is None
    assert umap.computed.tolist() == [[True, True, True], [False, False, True]]
    for name in ("kind", "period", "impacts_right", "impacts_left", "symmetric", "sticking"):
        np.testing.assert_array_equal(getattr(umap, name), getattr(full, name))
    for name, nothing in (("settled_after", -1), ("least_impact_velocity", np.nan)):
        expected = np.where(umap.computed, getattr(full, name), nothing)
        np.testing.assert_array_equal(getattr(umap, name), expected)
    np.testing.assert_array_equal(umap.multiplier, [[0.5, np.nan, 0.6], [np.nan, np.nan, 0.7]])
    assert umap.lyapunov is None
    assert umap.period.dtype.itemsize <= 4
    assert [(motion.label, motion.pixels) for motion in umap.motions()] == [
        (motion.label, motion.pixels) for motion in full.motions()
    ]
    assert "66.7% computed" in repr(umap)
    assert umap.inferred.tolist() == [[False, False, False], [True, True, False]]
    assert umap.inferred_wrong == InferredWrong(**INFERRED_WRONG)
    assert "1 of 2 inferred points in a sample wrong (1.26% to 98.74%)" in repr(umap)
    assert not full.inferred.any()
    assert full.inferred_wrong is None
    assert not any(word in repr(full) for word in ("computed", "inferred"))
    assert umap.to_xarray()["computed"].sel(omega=0.25, clearance=1.6).item() is False
    assert "computed" not in full.to_xarray()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"hello",
        b"{}",
        b"{",
        b"[1]",
        b'{"meta": {}}',
        b'{"meta": {"process": "grazing-curves"}, "omega": [1]}',
        b'{"meta": [], "points": 3}',
        encode_npz({"omega": np.zeros(2)}, {"process": "grazing-curves", "request": {}}),
        encode_npz({}, {"process": "something-else"}),
        npz("trajectories")[:500],
        b"{" + b'"a":[' * 100_000,
        b'{"meta": {"process": []}}',
        b'{"meta": {"process": "trajectories"}, "impacts": [1], "sticking": {}}',
        b'{"meta": {"process": "codimension-two-points"}, "points": []}',
        encode_npz({}, {"process": "grazing-curves", "x": 1})[:-30],
    ],
)
def test_a_file_that_is_no_result_is_refused(content, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(ResultFormatError, match=re.escape(str(path))):
        grazemap.load(path)


@pytest.mark.parametrize("ending", [".npz", ".json"])
@EVERY_PROCESS
def test_a_damaged_file_is_a_result_or_refused(process, ending, tmp_path):
    path = decode_result(npz(process)).save(tmp_path / f"file{ending}")
    whole, draw, refused = path.read_bytes(), random.Random(1), 0
    for _ in range(200):
        content = bytearray(whole)
        content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # zipfile and numpy also warn of some damages
            try:
                grazemap.load(path)
            except ResultFormatError:
                refused += 1
    assert refused > 100


def test_npz_whose_structure_is_wrong_is_refused():
    document = {"points": [{"kind": "recurrence", "families": [{"case": 1, "n": 2}]}, {"kind": "resonant"}]}
    with np.load(io.BytesIO(encode_npz(document, {}))) as archive:
        arrays = dict(archive)
    meta = json.loads(str(arrays["meta"]))
    for structure in ([], None, {**meta["structure"], "points": "scalar"}, {"points": 3}, {"none": "records"}):
        changed = {**arrays, "meta": np.array(json.dumps({"structure": structure}))}
        buffer = io.BytesIO()
        np.savez(buffer, **changed)
        with pytest.raises(CodecError):
            decode_npz(buffer.getvalue())
    # a plain column that is gone altogether is a field that no record has
    for name in set(arrays) - {"meta", "points.kind", "points.families.values.case", "points.families.values.n"}:
        buffer = io.BytesIO()
        np.savez(buffer, **{other: array for other, array in arrays.items() if other != name})
        with pytest.raises(CodecError):
            decode_npz(buffer.getvalue())


def forged(shape: tuple[int, ...], descr: str = "<f8", content: bytes = bytes(80), name: str = "omega") -> bytes:
    """The npz of a result with an array whose header says something else than the bytes that follow."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": descr, "fortran_order": False, "shape": shape})
    result = io.BytesIO()
    process = "codimension-two-points" if "." in name else "grazing-curves"
    with zipfile.ZipFile(io.BytesIO(npz(process))) as whole, zipfile.ZipFile(result, "w") as archive:
        for member in whole.namelist():
            data = header.getvalue() + content if member == f"{name}.npy" else whole.read(member)
            archive.writestr(member, data)
    return result.getvalue()


@pytest.mark.parametrize(
    "data",
    [
        forged((1 << 28,)),
        forged((1 << 20, 1 << 20)),
        forged((-10,)),
        forged((1 << 40, 0), content=b""),
        forged((1 << 40,), "|V0", content=b""),
        forged((10,), "|O"),
        forged((1,), f"<U{1 << 28}"),
        forged((), "<i8", (1 << 40).to_bytes(8, "little"), "points.count"),
        forged((4,), "<i8", np.array([0, 2, 0, 2]).tobytes(), "points.families.offsets"),
    ],
    ids=["long", "square", "negative", "rows of nothing", "elements of nothing", "object", "text", "count", "offsets"],
)
def test_a_forged_array_is_refused_before_memory_is_taken_for_it(data):
    tracemalloc.start()
    try:
        with pytest.raises(ResultFormatError, match="not a grazemap result"):
            decode_result(data)
        assert tracemalloc.get_traced_memory()[1] < 4 << 20
    finally:
        tracemalloc.stop()


def test_a_zip_bomb_is_refused_before_it_is_unpacked():
    result = io.BytesIO()
    with zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("omega.npy", "w") as stream:
        np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (8 << 20,)})
        for _ in range(64):
            stream.write(bytes(1 << 20))
    small = result.getvalue()
    # 64 MB, and a directory that says more than deflate can pack into so few bytes
    assert len(small) < 1 << 17
    place = small.rindex(b"PK\x01\x02") + 24
    lying = small[:place] + (1 << 31).to_bytes(4, "little") + small[place + 4 :]
    tracemalloc.start()
    try:
        with pytest.raises(ResultFormatError):
            decode_result(lying)
        assert tracemalloc.get_traced_memory()[1] < 4 << 20
    finally:
        tracemalloc.stop()


def test_pickles_are_never_loaded(tmp_path):
    path = tmp_path / "evil.npz"
    np.savez(path, meta=np.array([object()], dtype=object))
    with pytest.raises(ResultFormatError):
        grazemap.load(path)


def test_a_trajectory_without_impacts_is_the_same_from_json(tmp_path):
    empty = {
        "time": [],
        "period": np.zeros(0, np.int64),
        "phase_time": [],
        "stop": np.zeros(0, np.int8),
        "velocity": [],
        "kind": np.array([], dtype="<U6"),
    }
    impacts = {name: np.asarray(values) for name, values in empty.items()}
    result = decode_result(npz("trajectories", {"impacts": impacts}))
    loaded = grazemap.load(result.save(tmp_path / "none.json"))
    for one in (result, loaded):
        assert len(one.impacts) == 0
        assert one.impacts.kind.dtype.kind == "U"
        assert one.impacts.stop.dtype == np.int64


def test_only_known_file_endings_are_written(tmp_path):
    with pytest.raises(ValueError, match=r"\.npz or \.json"):
        decode_result(npz("grazing-curves")).save(tmp_path / "curve.csv")


@EVERY_PROCESS
def test_every_result_becomes_a_dataset(process):
    made = decode_result(npz(process)).to_xarray()
    assert json.loads(made.attrs["request"]) == decode_result(npz(process)).meta["request"]
    assert made.attrs["process"] == process.split()[0]


def meaning(value) -> str:
    return meanings(value.expand_dims("one"))[0]


def meanings(values) -> list[str]:
    names = [word.replace("_", " ").strip() for word in values.attrs["flag_meanings"].split()]
    assert values.attrs["flag_values"].tolist() == list(range(len(names)))
    return [names[code] for code in values.values.tolist()]


def test_a_dataset_keeps_none_apart_from_zero():
    made = decode_result(npz("codimension-two-points")).to_xarray()
    found = decode_result(npz("codimension-two-points")).points
    for name in ("order", "multiple", "active"):
        expected = [np.nan if getattr(point, name) is None else float(getattr(point, name)) for point in found]
        np.testing.assert_array_equal(made[name], expected, err_msg=name)
    assert np.isnan(made["order"]).any()


def test_a_dataset_has_coordinates_units_and_labels():
    made = decode_result(npz("unfolding-maps")).to_xarray()
    assert meaning(made["label"].sel(omega=0.25, clearance=1.6)) == "unresolved"
    assert made["label"].dtype.itemsize == made["kind"].dtype.itemsize == made["reason"].dtype.itemsize == 1
    assert meaning(made["kind"].sel(omega=0.25, clearance=1.6)) == "unresolved"
    assert made["omega"].attrs["units"] == "nondimensional"
    assert made["settled_after"].attrs["units"] == "forcing periods"
    assert meaning(made["reason"].sel(omega=0.25, clearance=1.6)) == "not closed"
    assert meaning(made["reason"].sel(omega=0.3, clearance=1.6)) == "rests"
    assert made["verified"].values.tolist() == [[True, False, True], [True, False, False]]
    assert decode_result(npz("trajectories")).to_xarray()["velocity"].sel(mass=2, time=10.0) == 1.0


def test_a_dataset_of_a_trajectory_has_its_sticking_and_its_motion():
    intervals = {"start": np.array([1.0]), "stop_time": np.array([3.5]), "stop": np.array([-1], dtype=np.int8)}
    made = decode_result(npz("trajectories", {"sticking": intervals})).to_xarray()
    assert [made[name].item() for name in ("sticking_start", "sticking_stop_time", "sticking_stop")] == [1.0, 3.5, -1]
    assert made["sticking_start"].dims == ("interval",)
    assert made["sticking_start"].attrs["units"] == "nondimensional"
    assert json.loads(made.attrs["motion"])["label"] == "1-1r-1l"


def test_a_dataset_of_a_trajectory_has_its_final_state():
    made = decode_result(npz("trajectories")).to_xarray()
    assert made["final_velocity"].sel(mass=3) == 1.0
    assert (made["final_phase"].item(), made["undecided"].item()) == (0.0, 0)
    assert made["impact_phase_time"].values.tolist() == [5.0, 20.0]
    assert (made["impact_period"].attrs["units"], made["final_phase"].attrs["units"]) == ("forcing periods", "rad")


def test_a_dataset_of_many_trajectories_pads_samples_and_gives_the_trajectory_of_each_event():
    made = decode_result(npz(MANY)).to_xarray()
    assert made["velocity"].dims == ("trajectory", "mass", "time")
    assert made["velocity"].sel(mass=1).notnull().sum("time").values.tolist() == [5, 2, 0]
    assert made["impact_trajectory"].values.tolist() == [0, 0, 1]
    assert made["impact_time"].values.tolist() == [5.0, 20.0, 5.0]
    assert made["interval_trajectory"].values.tolist() == [1]
    assert made["undecided"].values.tolist() == [0, 2, 2]
    np.testing.assert_array_equal(made["final_phase"], [0.0, 0.0, np.nan])
    assert [motion["label"] for motion in json.loads(made.attrs["motion"])] == ["1-1r-1l", None, None]


def test_a_dataset_of_codimension_two_points_has_families_and_status():
    points = [{**POINTS[0], "omega_error": 1e-15, "status": "near-double"}, POINTS[1]]
    made = decode_result(npz("codimension-two-points", {"points": points})).to_xarray()
    assert made["status"].values.tolist() == ["near-double", "simple"]
    np.testing.assert_array_equal(made["omega_error"], [1e-15, np.nan])
    np.testing.assert_array_equal(made["unfolding_quadratic"], [np.nan, 120.0])
    # one entry for each family, with the place of its point
    families = [made[name].values.tolist() for name in ("family_point", "family_case", "family_n")]
    assert families == [[0, 0], [1, 4], [1, 0]]


def test_a_dataset_of_no_points_has_every_column_empty_and_of_its_kind():
    made = decode_result(npz("codimension-two-points", {"points": []})).to_xarray()
    full = decode_result(npz("codimension-two-points")).to_xarray()
    assert {name: made[name].size for name in made.variables} == dict.fromkeys(full.variables, 0)
    assert {name: made[name].dtype.kind for name in made.variables} == {
        name: full[name].dtype.kind for name in full.variables
    }


def test_a_place_in_a_map_has_the_label_of_the_nearest_point_and_a_request_for_its_orbit(client, service):
    umap = decode_result(npz("unfolding-maps"))
    point = umap.at(0.21, 1.58)
    assert (point.omega, point.clearance, point.label, point.verified, point.reason) == (0.2, 1.6, "1-2r-2l", True, "")
    assert (point.horizontal_offset, point.vertical_offset) == (pytest.approx(-0.01), pytest.approx(0.02))
    client.periodic_orbit(**point.request, progress=False)
    (job,) = service.jobs.values()
    assert job["process"] == "periodic-orbits"
    assert (job["request"]["omega"], job["request"]["clearance"]) == (0.2, 1.6)
    assert job["request"]["transient_periods"] == 1000
    unresolved = umap.at(0.25, 1.5)
    assert (unresolved.label, unresolved.reason, unresolved.request) == ("unresolved", "not closed", None)
    free = umap.at(0.3, 1.6)  # it has no impacts that an orbit could be solved from
    assert (free.label, free.request) == ("1-(-1)r-(-1)l", None)
    with pytest.raises(ValueError, match=r"omega = 0\.4 is outside the map, which has 0\.2 to 0\.3"):
        umap.at(0.4, 1.5)
    oscillator = {**umap.meta["request"]["oscillator"], "units": "SI"}
    umap.meta["request"] = {**umap.meta["request"], "oscillator": oscillator}
    with pytest.raises(ValueError, match=r"omega = 0\.4 rad/s .* has 0\.2 to 0\.3 rad/s, 0\.0318\d* to 0\.0477\d* Hz"):
        umap.at(0.4, 1.5)
    with pytest.raises(ValueError, match=r"clearance = 2 m is outside the map, .* 1\.5 to 1\.6 m, 1500 to 1600 mm"):
        umap.at(0.2, 2.0)


def test_a_part_of_a_map_is_asked_for_with_the_settings_of_the_map(client, service):
    umap = decode_result(npz("unfolding-maps"))
    client.unfolding_map(**umap.zoom((0.22, 0.24), (1.52, 1.7)), progress=False)
    (job,) = service.jobs.values()
    assert job["request"]["omega"] == {"start": 0.22, "stop": 0.24, "points": 3}
    assert job["request"]["clearance"] == {"start": 1.52, "stop": 1.7, "points": 2}
    kept = ("oscillator", "policy", "max_periods", "max_period")
    assert all(job["request"][name] == umap.meta["request"][name] for name in kept)


def test_a_motion_of_a_map_is_found_by_its_label():
    umap = decode_result(npz("unfolding-maps"))
    assert umap.mask("1-2r-2l").tolist() == [[True, False, False], [True, False, False]]
    assert umap.mask("unresolved").tolist() == [[False, True, False], [False, True, False]]
    with pytest.raises(ValueError, match="no motion '1-1r-1l'; it has 1-2r-2l"):
        umap.mask("1-1r-1l")


def test_the_grazing_curve_is_known_at_every_frequency():
    curve = decode_result(npz("grazing-curves"))
    omega = np.array([[0.2, 0.21], [0.29, 0.3]])
    assert curve.at(omega).shape == (2, 2)
    assert curve.at(0.29) == pytest.approx(curve.at(omega)[1, 0], rel=1e-15)


def test_basins_say_how_mixed_and_how_uncertain_they_are(tmp_path):
    path = decode_result(npz("basins")).save(tmp_path / "basins.json")
    for result in (decode_result(npz("basins")), load(path)):
        assert (result.basin_entropy.box, result.basin_entropy.boundary_entropy) == (5, 0.8)
        assert result.uncertainty.share.tolist() == [0.1, 0.2, 0.4]
        assert "basin entropy 0.2, on the boundary 0.8, above log 2: a fractal boundary" in repr(result)
        assert "uncertainty exponent 1.000 ± 0.000" in repr(result)
    made = result.to_xarray()
    assert made["uncertainty_share"].values.tolist() == [0.1, 0.2, 0.4]
    assert float(made["entropy_boundary_entropy"]) == 0.8
    none = {**document("basins")["uncertainty"], "exponent": np.nan, "boundary_dimension": np.nan}
    unmixed = {**document("basins")["basin_entropy"], "boundary_boxes": 0, "boundary_entropy": np.nan}
    alone = decode_result(npz("basins", {"uncertainty": none, "basin_entropy": unmixed}))
    assert "no box on a boundary, no uncertainty exponent" in repr(alone)


def test_basin_fractions_have_the_shares_of_attractors_along_the_parameter(tmp_path):
    path = decode_result(npz("basin-fractions")).save(tmp_path / "fractions.json")
    for result in (decode_result(npz("basin-fractions")), load(path)):
        assert result.vary == "clearance"
        assert [(one.label, one.first, one.found) for one in result.attractors] == [
            ("1-2r-1l", 1.5, 2),
            ("1-2r-1l", 1.6, 1),
            (None, 1.6, 1),
        ]
        assert result.states.tolist() == [[8, 4], [0, 2], [0, 1]]
        assert [motion.share for motion in result.motions()] == [0.75, 0.125, 0.0625]
        assert np.isnan(result.multiplier[1, 0])
        assert "2 values of clearance, 3 attractors, 1 of 4 chaotic motions settle" in repr(result)
    made = result.to_xarray()
    assert made["share"].sel(parameter=1.6).values.tolist() == [0.5, 0.25, 0.125]
    assert meanings(made["attractor_motion"]) == ["1-2r-1l", "1-2r-1l", "chaotic"]


@pytest.mark.parametrize("kind", [Border, Event, MapPoint, Mode, Plane, Stretch, Verdict])
def test_help_lists_every_field_of_a_class_with_its_description(kind):
    shown = inspect.getdoc(kind)
    for name in kind.__annotations__:
        assert re.search(rf"^{name} : .+\n    \S", shown, re.MULTILINE)

"""Results: arrays and records, saved and loaded without losing anything."""

import dataclasses
import inspect
import io
import json
import os
import re
import threading
import time

import numpy as np
import pytest

import grazemap
from grazemap import Event
from grazemap.checker import Verdict
from grazemap.client.process_methods import METHODS
from grazemap.codec import decode_npz, encode_json, encode_npz, iter_json
from grazemap.plots import save_picture
from grazemap.results import Border, Impacts, InferredWrong, UnfoldingMap, decode_result, load, schema_of
from grazemap.results.fields import RecordSchema
from grazemap.results.motions import motions_of
from grazemap.results.stretches import Stretch
from grazemap.results.structures import Mode
from grazemap.results.unfolding import MapPoint
from grazemap.wire import motion_label
from grazemap.wire.job import INFINITE
from grazemap.wire.planes import Plane
from tests.support.sdk_documents import (
    ADAPTIVE,
    CHANCE,
    INFERRED_WRONG,
    MANY,
    MOTIONS,
    POINTS,
    REQUESTS,
    RESTED,
    document,
    example,
    npz,
    result_like,
    result_of,
)

EVERY_PROCESS = pytest.mark.parametrize("process", list(REQUESTS))


@EVERY_PROCESS
@pytest.mark.parametrize("newer", [{}, {"lyapunov": np.array([0.5]), "novelty": {"deep": [{"a": 1}]}}])
def test_saving_gives_the_bytes_that_the_service_sent(process, newer, tmp_path):
    data = npz(process, newer)
    assert decode_result(data).save(tmp_path / "result.npz").read_bytes() == data


def same(value, other):
    """Check that two values are equal through all their fields, arrays to their kind; a document's may differ."""
    assert type(other) is type(value)
    if isinstance(value, np.ndarray):
        assert other.dtype.kind == value.dtype.kind
        np.testing.assert_array_equal(value, other)
    elif isinstance(value, tuple):
        for a, b in zip(value, other, strict=True):
            same(a, b)
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            if field.name != "_document":
                same(getattr(value, field.name), getattr(other, field.name))
    elif isinstance(value, float):
        np.testing.assert_equal(value, other)  # NaN is NaN
    else:
        assert value == other


@EVERY_PROCESS
def test_json_and_npz_load_to_the_same_result(process, tmp_path):
    result = result_of(process)
    loaded = grazemap.load(result.save(tmp_path / "result.json"))
    assert type(loaded) is type(result)
    same(result, loaded)
    # and what came from JSON can be saved as npz again
    again = loaded.save(tmp_path / "again.npz")
    same(result, grazemap.load(again))
    assert set(decode_npz(again.read_bytes())[0]) == set(decode_npz(npz(process))[0])


def check_fields(record, document, made):
    """Check that an object has the values of its document, None or nothing where the document has none."""
    for field in record:
        if field.stored_only:
            assert not hasattr(made, field.name)
            continue
        expected, value = document.get(field.name), getattr(made, field.name)
        if expected is None:
            other_name = field.name in ("omega", "clearance", "horizontal", "vertical")  # of an axis of a map
            assert other_name or value is None or value == () or np.isnan(value)
        elif isinstance(field.type, RecordSchema):
            for item, inner in zip(
                expected if field.dims else [expected], value if field.dims else [value], strict=True
            ):
                check_fields(field.type, item, inner)
        elif field.type == "complex":
            np.testing.assert_array_equal(np.stack([value.real, value.imag], axis=-1), expected)
        else:
            np.testing.assert_array_equal(value, expected)
            assert not field.dims or isinstance(value, tuple if field.is_tuple else np.ndarray)


@pytest.mark.parametrize("process", [name for name in REQUESTS if name != ADAPTIVE])
def test_a_result_has_the_fields_of_its_document(process):
    whole = document(process)
    check_fields(schema_of(process.split()[0], whole), whole, result_of(process))


def test_json_is_strict_and_writes_nan_as_null(tmp_path):
    path = result_of("unfolding-maps").save(tmp_path / "map.json")
    values = json.loads(path.read_text(), parse_constant=pytest.fail)["least_impact_velocity"]
    assert values == [[0.1, 0.2, 0.3], [0.4, None, None]]


@pytest.mark.parametrize(
    ("process", "changes", "text"),
    [
        ("periodic-orbits", {"converged": False, "reason": "no motion with these stops"}, "no motion with these stops"),
        (RESTED, {}, "<PeriodicOrbit: 1-1r-1l, stable, by simulation>"),
        ("unfolding-maps", {}, "2 unresolved (33.33%)"),
        (MOTIONS, {}, "<BifurcationCurves: 2 pieces of curves, 1 motion not found>"),
        (MANY, {}, "<Trajectories: 3 trajectories: 2 x unresolved, 1 x 1-1r-1l>"),
        ("bifurcation-diagrams", {}, "<BifurcationDiagram: 2 values of clearance, 1 sensitive>"),
        ("basin-fractions", {}, "2 values of clearance, 3 attractors, 1 of 4 chaotic motions settle"),
        ("basins", {}, "1 of 4 chaotic motions settle within 10000 periods"),
        ("basins", {}, "basin entropy 0.2, on the boundary 0.8, above log 2: a fractal boundary"),
        ("basins", {}, "uncertainty exponent 1.000 ± 0.000"),
        (
            "basins",
            {
                "uncertainty": {**document("basins")["uncertainty"], "exponent": np.nan},
                "basin_entropy": {**document("basins")["basin_entropy"], "boundary_boxes": 0},
            },
            "no box on a boundary, no uncertainty exponent",
        ),
    ],
)
def test_a_summary_has_the_numbers_of_the_result(process, changes, text):
    assert text in repr(result_of(process, changes))


def test_orbits_beyond_a_special_point_are_requests():
    saddle, graze = result_of("orbit-branches").special_points
    assert saddle.beyond == ()
    asked, *_ = METHODS["periodic_orbit"].request_for(**graze.beyond[0].request)
    assert (asked.omega, asked.clearance, asked.motion.phases) == (0.27, 1.86, [0.5, 3.5])
    assert asked.oscillator.restitution == 0.8


def test_a_point_of_a_branch_is_a_motion_and_a_branch_may_have_none(tmp_path):
    row = result_of("orbit-branches").motion(1)
    assert (row["period"], row["stops"], row["velocities"]) == (1, [1, -1], [0.25, -0.25])
    sizes = {"point": 0, "impact": 0, "multiplier": 6, "end": 0}
    empty = result_like("OrbitBranch", sizes, special_points=[], reason="lost")
    for result in (empty, load(empty.save(tmp_path / "empty.json"))):
        assert repr(result) == "<OrbitBranch: no points: lost>"
        assert result.plot().get_title().startswith("Branch of period 1")
        assert result.plot_multipliers().get_title().startswith("Multipliers along a branch of period 1")


def test_a_dataset_of_curves_has_the_curve_of_each_point_and_may_be_empty():
    result = result_of("bifurcation-curves")
    assert result.to_xarray()["point_curve"].values.tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]
    nothing = result_of("bifurcation-curves", {"curves": []})
    assert nothing.curves == ()
    assert nothing.to_xarray()["omega"].size == 0


def test_a_point_of_a_continued_curve_is_an_orbit():
    point = result_of(MOTIONS).curves[1].orbit(1)
    assert (point["omega"], point["clearance"]) == (0.25, 1.55)
    assert point["motion"]["velocities"] == [0.1, 0.0, -0.1, 0.0]
    with pytest.raises(ValueError, match="no phases"):
        result_of("bifurcation-curves").curves[0].orbit(0)


def test_a_bifurcation_diagram_has_a_section_for_every_value():
    result = result_of("bifurcation-diagrams")
    assert (result.vary, result.labels()) == ("clearance", ("1-1r-0l", "unresolved"))
    place, value = result.points("impact_velocity")
    assert (place.tolist(), value.tolist()) == ([1.5] * 3, [0.5] * 3)
    made = result.to_xarray()
    assert made["point_parameter"].values.tolist() == [1.5] * 3 + [1.6] * 3
    np.testing.assert_array_equal(made["transient_growth"], [31.5, np.nan])
    assert made["sensitive"].values.tolist() == result.to_dataframe()["sensitive"].tolist() == [True, False]


def test_a_dataset_of_basins_has_the_motion_of_each_point_and_their_uncertainty():
    result = result_of("basins")
    assert result.unresolved == pytest.approx(1 / 6)
    made = result.to_xarray()
    assert meanings(made["motion"].sel(vertical=0.5)) == ["chaotic", "unresolved", "1-2r-1l"]
    assert made["uncertainty_share"].values.tolist() == [0.1, 0.2, 0.4]
    assert float(made["entropy_boundary_entropy"]) == 0.8


def test_a_sample_of_chaotic_motions_may_be_empty(tmp_path):
    empty = {**CHANCE, "sampled": 0, "settled": 0, "chance": np.nan, "low": 0.0, "high": 1.0}
    path = result_of("basins", {"chance_to_settle": empty}).save(tmp_path / "basins.json")
    assert json.loads(path.read_text())["chance_to_settle"]["chance"] is None
    assert np.isnan(load(path).chance_to_settle.chance)


@pytest.mark.parametrize("process", ["unfolding-maps", "basins", "unfolding-diagrams"])
def test_summaries_have_the_share_of_sensitive_points(process):
    sensitive = {"sensitive": np.array([[False, True, False], [False, False, False]])}
    of_diagram = process == "unfolding-diagrams"
    changed = {"unfolding_map": document("unfolding-maps") | sensitive} if of_diagram else sensitive
    results = (result_of(process, fields) for fields in (changed, {}))
    with_it, without = (result.summary() if of_diagram else repr(result) for result in results)
    assert "1 sensitive (16.67%)" in with_it
    assert "0 sensitive (0.00%)" in without


def test_a_diagram_has_its_parts_and_the_explanation_of_every_border():
    result = result_of("unfolding-diagrams")
    assert result.unfolding_map.labels()[1].tolist() == ["1-2r-2l", "unresolved", "1-(-1)r-(-1)l"]
    assert result.unfolding_map.meta["process"] == "unfolding-maps"
    assert result.grazing_curve.meta["request"]["axis"]["values"]["points"] == 400
    borders = result.borders
    assert len(borders) == 4
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
    for part in ("2 of the 6 points", "1 curve, 1 coexistence, 0 goes on, 1 unexplained", "no orbit"):
        assert part in result.summary()
    made = result.to_xarray()
    assert meanings(made["border_explanation"]) == ["curve", "coexistence", "unexplained", "goes on"]
    assert made["kind"].dims == ("clearance", "omega")


def test_mirror_images_have_one_label_in_a_diagram_and_asymmetric_twins_another():
    def motions(**everywhere):
        umap = document("unfolding-maps")
        for name, value in everywhere.items():
            umap[name][:] = value
        diagram = result_of("unfolding-diagrams", {"unfolding_map": umap})
        return [border.motions for border in diagram.border_list()]

    assert motions(impacts_right=1, impacts_left=2) == motions(impacts_right=2, impacts_left=1)
    names = {name for names in motions(impacts_right=3, impacts_left=INFINITE) for name in names}
    assert any("∞r-3l" in name for name in names)
    assert not any("∞l" in name for name in names)
    assert any("1-2r-2l asymmetric" in names for names in motions(symmetric=False))


def test_a_diagram_without_borders_has_no_fields_of_borders():
    whole = result_of("unfolding-diagrams")
    bare = type(whole).from_document({k: v for k, v in whole._document.items() if k != "borders"}, whole.meta)
    assert bare.borders is None
    assert bare.border_list() == []
    assert "pairs" not in bare.summary()


def test_the_sequence_of_a_grazing_curve_is_there_where_it_was_requested():
    assert result_of("grazing-curves").xi is None
    curve = result_of("grazing-curves", {"xi": np.arange(6.0).reshape(3, 2)})
    assert curve.xi.tolist() == [[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]]
    assert curve.to_xarray()["xi"].dims == ("omega", "order")


def test_many_trajectories_are_each_the_result_of_the_request_with_its_state_alone(tmp_path):
    result = result_of(MANY)
    whole, early, _ = result.trajectories
    same(whole, result_of("trajectories"))
    assert whole.save(tmp_path / "one.npz").read_bytes() == npz("trajectories")
    assert early.meta["request"]["initial"] == {"displacement": [0.0] * 3, "velocity": [0.0] * 3, "phase": 1.0}
    for path in result.trajectories:
        same(path, grazemap.load(path.save(tmp_path / "one.json")))


@EVERY_PROCESS
def test_a_reader_of_numbers_alone_reads_every_array_of_npz(process):
    with np.load(io.BytesIO(npz(process)), allow_pickle=False) as archive:
        arrays = dict(archive)
    assert {array.dtype.kind for array in arrays.values()} <= set("biuf")
    meta = json.loads(arrays.pop("meta").tobytes())
    for name, texts in meta["texts"].items():
        assert arrays[name].dtype.kind == "u"
        assert {*np.unique(arrays[name])} == {*range(len(texts))}
    for name, unit in meta["array_units"].items():
        assert unit
        assert any(f"{array}.".replace(".values.", ".").startswith(f"{name}.") for array in arrays)


def test_records_with_arrays_are_ragged_in_npz_and_readable_without_this_package():
    with np.load(io.BytesIO(npz(MANY)), allow_pickle=False) as archive:
        arrays = dict(archive)
    assert {array.dtype.kind for array in arrays.values()} <= set("biuf")
    texts = json.loads(arrays["meta"].tobytes())["texts"]
    assert arrays["trajectories.count"] == 3
    records = document(MANY)["trajectories"]
    for name, pick in (
        ("time", lambda r: r["time"]),
        ("displacement", lambda r: r["displacement"]),
        ("impacts.kind", lambda r: r["impacts"]["kind"]),
    ):
        offsets, values = arrays[f"trajectories.{name}.offsets"], arrays[f"trajectories.{name}.values"]
        for i, record in enumerate(records):
            piece = values[offsets[i] : offsets[i + 1]]
            if f"trajectories.{name}.values" in texts:
                piece = np.array(texts[f"trajectories.{name}.values"])[piece]
            if f"trajectories.{name}.shape" in arrays:
                piece = piece.reshape(arrays[f"trajectories.{name}.shape"][i])
            np.testing.assert_array_equal(piece, pick(record))
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
    def equal(item, other):
        if isinstance(item, np.ndarray):
            assert isinstance(other, np.ndarray)
            assert (item.dtype, item.shape) == (other.dtype, other.shape)
            np.testing.assert_array_equal(item, other)
        elif isinstance(item, dict):
            # a field that is missing in some records is None there
            assert set(item) <= set(other)
            for key, value in other.items():
                equal(item.get(key), value)
        elif isinstance(item, list):
            for a, b in zip(item, other, strict=True):
                equal(a, b)
        else:
            assert type(item) is type(other)
            assert item == other

    data = encode_npz({"items": records}, {"x": 1})
    content, meta = decode_npz(data)
    equal(records, content["items"])
    assert meta == {"x": 1}
    assert encode_npz(content, meta) == data


def test_records_that_npz_cannot_distinguish_are_not_written():
    for records in ([{"count": 1}], [{"a": {}}]):
        with pytest.raises(ValueError, match=r"count|without fields"):
            encode_npz({"items": records}, {})


def test_large_json_is_made_in_short_pieces():
    # one long call of the encoder would keep every other request waiting
    whole = {
        "grid": np.arange(40_000.0).reshape(100, 400),
        "tall": np.arange(6.0).reshape(3, 2),
        "deep": np.arange(8_000).reshape(2, 2, 2000),
        "line": np.where(np.arange(5000) % 7, np.arange(5000.0), np.nan),
        "empty": np.zeros((0, 3)),
        "inner": {"flags": np.ones(3000, bool), "names": np.array(["a", "b"])},
        "points": [{"kind": "x", "order": None}],
        "items": [{"a": np.arange(3000.0), "b": None}] * 4,
    }
    pieces = list(iter_json(whole, {"process": "unfolding-maps"}))
    assert max(len(piece) for piece in pieces) < 20_000
    data = b"".join(pieces)
    assert data == encode_json(whole, {"process": "unfolding-maps"})
    parsed = json.loads(data)
    assert parsed.pop("meta") == {"process": "unfolding-maps"}
    np.testing.assert_array_equal(np.array(parsed["line"], dtype=float), whole["line"])
    for name in ("grid", "tall", "deep", "empty"):
        assert parsed[name] == whole[name].tolist()
    assert parsed["items"] == [{"a": list(range(3000)), "b": None}] * 4
    assert parsed["inner"] == {"flags": [True] * 3000, "names": ["a", "b"]}
    assert parsed["points"] == whole["points"]


def test_a_map_counts_its_motions_and_never_gives_the_unresolved_a_label():
    umap = result_of("unfolding-maps")
    motions = umap.motions()
    counted = {motion.label: motion.pixels for motion in motions}
    assert list(counted.items()) == [("1-2r-2l", 2), ("unresolved", 2), ("1-(-1)r-(-1)l", 1), ("3-4r-4l", 1)]
    assert sum(motion.share for motion in motions) == pytest.approx(1)
    assert motions[1].period is None
    assert umap.labels().tolist() == [["1-2r-2l", "unresolved", "3-4r-4l"], ["1-2r-2l", "unresolved", "1-(-1)r-(-1)l"]]
    for label in counted:
        np.testing.assert_array_equal(umap.mask(label), umap.labels() == label)
    with pytest.raises(ValueError, match="no motion '1-1r-1l'; it has 1-2r-2l"):
        umap.mask("1-1r-1l")


def test_the_motions_of_a_million_points_without_regions_are_counted_in_a_second():
    shape, rng = (1000, 1000), np.random.default_rng(0)
    counts = {"period": (1, 33), "impacts_right": (-2, 9), "impacts_left": (-2, 9)}
    document = {name: rng.integers(*bounds, shape, np.int32) for name, bounds in counts.items()}
    document |= {"kind": rng.integers(0, 2, shape, np.int8), "kinds": np.array(["chaotic", "periodic"])}
    began = time.thread_time()
    motions, places = motions_of(document)
    assert time.thread_time() - began < 1.5
    assert [motion["pixels"] for motion in motions] == np.bincount(places.ravel()).tolist()
    for point in [(0, 0), (17, 3), (999, 999), (500, 1)]:
        motion, here = motions[places[point]], {name: int(document[name][point]) for name in counts}
        periodic = document["kind"][point] == 1
        assert motion["label"] == (motion_label(*here.values()) if periodic else "chaotic")
        assert {name: motion[name] for name in counts} == (here if periodic else dict.fromkeys(counts))


@pytest.mark.parametrize("preview", [False, True])
def test_a_preview_is_marked_as_one(preview):
    whole, meta = decode_npz(npz("unfolding-maps"))
    umap = UnfoldingMap.from_document(whole, {**meta, "request": {**meta["request"], "preview": preview}})
    assert umap.preview is preview
    assert ("a preview" in repr(umap)) is preview
    assert umap.plot().get_title().startswith("Preview" if preview else "Unfolding map")


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_an_adaptive_map_has_the_arrays_of_a_full_one_and_no_invented_numbers(ending, tmp_path):
    full = result_of("unfolding-maps")
    umap = grazemap.load(result_of(ADAPTIVE).save(tmp_path / f"map{ending}"))
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


def test_a_trajectory_without_impacts_is_the_same_from_json(tmp_path):
    result = result_of("trajectories", {"impacts": example(Impacts.schema, {"impact": 0})})
    loaded = grazemap.load(result.save(tmp_path / "none.json"))
    for trajectory in (result, loaded):
        assert len(trajectory.impacts) == 0
        assert trajectory.impacts.kind.dtype.kind == "U"
        assert trajectory.impacts.stop.dtype == np.int64


def test_only_known_file_endings_are_written(tmp_path):
    with pytest.raises(ValueError, match=r"\.npz, \.json"):
        result_of("grazing-curves").save(tmp_path / "curve.txt")


ENDINGS = ["npz", "json", "csv", "xlsx", "parquet", "png", "svg"]


def write(result, path):
    save_picture(result, path) if path.suffix in (".png", ".svg") else result.save(path)


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_file_is_replaced_by_a_whole_one_or_stays(ending, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    result, path = result_of("grazing-curves"), tmp_path / f"curve.{ending}"
    path.write_text("earlier")
    with monkeypatch.context() as patch:
        for target in ("pandas.DataFrame.to_parquet", "pathlib.Path.write_bytes"):
            patch.setattr(target, interrupted)
        patch.setattr("grazemap.results.tables._written", interrupted)
        patch.setattr("matplotlib.backends.backend_agg.FigureCanvasAgg.print_png", interrupted)
        patch.setattr("matplotlib.backends.backend_svg.FigureCanvasSVG.print_svg", interrupted)
        with pytest.raises(KeyboardInterrupt):
            write(result, path)
    assert path.read_text() == "earlier"
    write(result, path)
    assert path.read_bytes() != b"earlier"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_written_file_has_the_permissions_and_the_place_of_an_opened_one(ending, tmp_path):
    result, opened, path = result_of("grazing-curves"), tmp_path / "opened", tmp_path / f"curve.{ending}"
    opened.touch()
    write(result, path)
    assert path.stat().st_mode == opened.stat().st_mode
    path.chmod(0o640)
    link = tmp_path / f"link.{ending}"
    link.symlink_to(path)
    write(result, link)
    assert link.is_symlink()
    assert path.stat().st_mode & 0o777 == 0o640


def test_a_result_is_written_into_a_pipe(tmp_path):
    path = tmp_path / "pipe.csv"
    os.mkfifo(path)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(path.read_text()))
    reader.start()
    result_of("grazing-curves").save(path)
    reader.join(10.0)
    assert read[0].startswith("omega,")


@EVERY_PROCESS
def test_every_result_becomes_a_dataset(process):
    made = result_of(process).to_xarray()
    assert json.loads(made.attrs["request"]) == result_of(process).meta["request"]
    assert made.attrs["process"] == process.split()[0]


def meaning(value) -> str:
    return meanings(value.expand_dims("one"))[0]


def meanings(values) -> list[str]:
    names = [word.replace("_", " ").strip() for word in values.attrs["flag_meanings"].split()]
    assert values.attrs["flag_values"].tolist() == list(range(len(names)))
    return [names[code] for code in values.values.tolist()]


def test_a_dataset_keeps_none_apart_from_zero():
    made = result_of("codimension-two-points").to_xarray()
    points = result_of("codimension-two-points").points
    for name in ("order", "multiple", "active"):
        expected = [np.nan if getattr(point, name) is None else float(getattr(point, name)) for point in points]
        np.testing.assert_array_equal(made[name], expected, err_msg=name)
    assert np.isnan(made["order"]).any()


def test_a_dataset_has_coordinates_units_and_labels():
    made = result_of("unfolding-maps").to_xarray()
    assert meaning(made["label"].sel(omega=0.25, clearance=1.6)) == "unresolved"
    assert made["label"].dtype.itemsize == made["kind"].dtype.itemsize == made["reason"].dtype.itemsize == 1
    assert meaning(made["kind"].sel(omega=0.25, clearance=1.6)) == "unresolved"
    assert made["omega"].attrs["units"] == "nondimensional"
    assert made["settled_after"].attrs["units"] == "forcing periods"
    assert meaning(made["reason"].sel(omega=0.25, clearance=1.6)) == "not closed"
    assert meaning(made["reason"].sel(omega=0.3, clearance=1.6)) == "rests"
    assert made["verified"].values.tolist() == [[True, False, True], [True, False, False]]
    assert result_of("trajectories").to_xarray()["velocity"].sel(mass=2, time=10.0) == 1.0


def test_a_dataset_of_a_trajectory_has_its_sticking_its_motion_and_its_final_state():
    intervals = {"start": np.array([1.0]), "stop_time": np.array([3.5]), "stop": np.array([-1], dtype=np.int8)}
    made = result_of("trajectories", {"sticking": intervals}).to_xarray()
    assert [made[name].item() for name in ("sticking_start", "sticking_stop_time", "sticking_stop")] == [1.0, 3.5, -1]
    assert made["sticking_start"].dims == ("interval",)
    assert made["sticking_start"].attrs["units"] == "nondimensional"
    assert json.loads(made.attrs["motion"])["label"] == "1-1r-1l"
    assert made["final_velocity"].sel(mass=3) == 1.0
    assert (made["final_phase"].item(), made["undecided"].item()) == (0.0, 0)
    assert made["impact_phase_time"].values.tolist() == [5.0, 20.0]
    assert (made["impact_period"].attrs["units"], made["final_phase"].attrs["units"]) == ("forcing periods", "rad")


def test_a_dataset_of_many_trajectories_pads_samples_and_gives_the_trajectory_of_each_event():
    made = result_of(MANY).to_xarray()
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
    made = result_of("codimension-two-points", {"points": points}).to_xarray()
    assert made["status"].values.tolist() == ["near-double", "simple"]
    np.testing.assert_array_equal(made["omega_error"], [1e-15, np.nan])
    np.testing.assert_array_equal(made["unfolding_quadratic"], [np.nan, 120.0])
    # one entry for each family, with the place of its point
    families = [made[name].values.tolist() for name in ("family_point", "family_case", "family_n")]
    assert families == [[0, 0], [1, 4], [1, 0]]


def test_a_dataset_of_no_points_has_every_column_empty_and_of_its_kind():
    made = result_of("codimension-two-points", {"points": []}).to_xarray()
    full = result_of("codimension-two-points").to_xarray()
    assert {name: made[name].size for name in made.variables} == dict.fromkeys(full.variables, 0)
    assert {name: made[name].dtype.kind for name in made.variables} == {
        name: full[name].dtype.kind for name in full.variables
    }


def test_a_place_in_a_map_has_the_label_of_the_nearest_point_and_a_request_for_its_orbit(client, service):
    umap = result_of("unfolding-maps")
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
    in_si(umap)
    with pytest.raises(ValueError, match=r"omega = 0\.4 rad/s .* has 0\.2 to 0\.3 rad/s, 0\.0318\d* to 0\.0477\d* Hz"):
        umap.at(0.4, 1.5)
    with pytest.raises(ValueError, match=r"clearance = 2 m is outside the map, .* 1\.5 to 1\.6 m, 1500 to 1600 mm"):
        umap.at(0.2, 2.0)


def in_si(result):
    """Return a result as if its machine were in SI."""
    request = result.meta["request"]
    result.meta["request"] = {**request, "oscillator": {**request["oscillator"], "units": "SI"}}
    return result


@pytest.mark.parametrize("right", [1, INFINITE])
def test_a_point_that_touches_one_stop_alone_has_a_request_for_its_orbit(right):
    impacts = {"impacts_right": np.full((2, 3), right, np.int16), "impacts_left": np.full((2, 3), -1, np.int16)}
    kinds = document("unfolding-maps")["kinds"].tolist()
    periodic = {"kind": np.full((2, 3), kinds.index("periodic"), np.uint8), **impacts}
    umap = result_of("unfolding-maps", periodic)
    assert umap.at(0.25, 1.5).request is not None
    still = result_of("unfolding-maps", periodic | {"impacts_right": impacts["impacts_left"]})
    assert still.at(0.25, 1.5).request is None


# a machine of 0.4 rad/s whose stops are 1.5 m apart is not one in SI
@pytest.mark.filterwarnings("ignore::grazemap.errors.RequestWarning")
def test_places_of_a_map_in_si_are_texts_with_units_as_in_a_request(client, service):
    umap = in_si(result_of("unfolding-maps"))
    hertz, millimetres = f"{0.21 / (2.0 * np.pi)!r} Hz", "1580 mm"
    named, point = umap.at(hertz, millimetres), umap.at(0.21, 1.58)
    assert (named.omega, named.clearance, named.label) == (point.omega, point.clearance, point.label)
    assert named.horizontal_offset == pytest.approx(point.horizontal_offset, abs=1e-15)
    client.unfolding_map(**umap.zoom((hertz, "0.24 rad/s"), ("1520 mm", "1.7 m")), progress=False)
    (job,) = service.jobs.values()
    assert job["request"]["horizontal"]["values"]["start"] == pytest.approx(0.21, rel=1e-15)
    assert job["request"]["vertical"]["values"] == {"start": 1.52, "stop": 1.7, "points": 2}
    for place, named in (((hertz, "5 Hz"), "clearance"), (("fast", 1.6), "omega")):
        with pytest.raises(ValueError, match=f"^{named}: "):
            umap.at(*place)
    with pytest.raises(ValueError, match="nondimensional"):
        result_of("unfolding-maps").at(hertz, 1.6)


def test_frequencies_of_a_curve_in_si_are_texts_with_units_as_in_a_request():
    curve = in_si(result_of("grazing-curves"))
    texts = [f"{omega / (2.0 * np.pi)!r} Hz" for omega in (0.2000001, 0.29)]
    np.testing.assert_allclose(curve.at(texts), curve.at([0.2000001, 0.29]), rtol=1e-12)
    np.testing.assert_array_equal(curve.at(np.array(texts)), curve.at(texts))
    assert curve.at(texts[1]).shape == ()
    for omega in ([texts[0], 0.29], "5 mm", "fast"):
        with pytest.raises(ValueError, match=r"^omega: "):
            curve.at(omega)
    points = in_si(result_of("codimension-two-points"))
    drawn = [points.plot_unfolding(omega=omega).get_xlim() for omega in (texts, (0.2000001, 0.29))]
    assert drawn[0] == pytest.approx(drawn[1])


@pytest.mark.parametrize(("multiplier", "closed"), [(0.5, 0), (0.995, 4600), (1.0 - 1e-9, 1e5), (np.nan, 0), (1.01, 0)])
def test_the_orbit_of_a_point_is_looked_for_when_its_trajectory_has_closed(multiplier, closed):
    umap = result_of("unfolding-maps", {"multiplier": np.full((2, 3), multiplier)})
    periods = umap.at(0.2, 1.6).request["transient_periods"]
    assert periods >= max(1000, closed)
    assert multiplier**periods <= 1e-10 or closed in (0, periods)


def test_a_part_of_a_map_is_asked_for_with_the_settings_of_the_map(client, service):
    umap = result_of("unfolding-maps")
    client.unfolding_map(**umap.zoom((0.22, 0.24), (1.52, 1.7)), progress=False)
    (job,) = service.jobs.values()
    assert job["request"]["horizontal"]["values"] == {"start": 0.22, "stop": 0.24, "points": 3}
    assert job["request"]["vertical"]["values"] == {"start": 1.52, "stop": 1.7, "points": 2}
    kept = ("oscillator", "policy", "max_periods", "max_period")
    assert all(job["request"][name] == umap.meta["request"][name] for name in kept)


def test_the_grazing_curve_is_known_at_every_frequency():
    curve = result_of("grazing-curves")
    omega = np.array([[0.2, 0.21], [0.29, 0.3]])
    assert curve.at(omega).shape == (2, 2)
    assert curve.at(0.29) == pytest.approx(curve.at(omega)[1, 0], rel=1e-15)


def test_basin_fractions_have_the_shares_of_attractors_along_the_parameter():
    result = result_of("basin-fractions")
    assert result.vary == "clearance"
    assert [motion.share for motion in result.motions()] == [0.75, 0.125, 0.0625]
    made = result.to_xarray()
    assert made["share"].sel(parameter=1.6).values.tolist() == [0.5, 0.25, 0.125]
    assert meanings(made["attractor_motion"]) == ["1-2r-1l", "1-2r-1l", "chaotic"]


@pytest.mark.parametrize("kind", [Border, Event, MapPoint, Mode, Plane, Stretch, Verdict])
def test_help_lists_every_field_of_a_class_with_its_description(kind):
    shown = inspect.getdoc(kind)
    for name in kind.__annotations__:
        assert re.search(rf"^{name} : .+\n    \S", shown, re.MULTILINE)

"""Results: arrays and records, saved and loaded without losing anything."""

import dataclasses
import io
import json
import random
import warnings

import numpy as np
import pytest
from sdk_documents import POINTS, REQUESTS, npz

import grazemap
from grazemap.codec import CodecError, decode_npz, encode_npz
from grazemap.errors import ResultFormatError
from grazemap.results import Family, decode_result

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


@EVERY_PROCESS
def test_json_and_npz_load_to_the_same_result(process, tmp_path):
    result = decode_result(npz(process))
    loaded = grazemap.load(result.save(tmp_path / "result.json"))
    assert type(loaded) is type(result)
    for field in dataclasses.fields(result):
        one, other = getattr(result, field.name), getattr(loaded, field.name)
        if isinstance(one, np.ndarray):
            assert other.dtype == one.dtype
            np.testing.assert_array_equal(one, other)
        elif field.name not in ("_document", "impacts", "sticking"):
            assert one == other
    # and what came from JSON can be saved as npz again
    again = grazemap.load(loaded.save(tmp_path / "again.npz"))
    assert repr(again) == repr(result)


def test_json_is_strict_and_writes_nan_as_null(tmp_path):
    path = decode_result(npz("unfolding-maps")).save(tmp_path / "map.json")
    values = json.loads(path.read_text(), parse_constant=pytest.fail)["least_impact_velocity"]
    assert values == [[0.1, 0.2, 0.3], [0.4, None, None]]


def test_points_are_frozen_records_with_none_for_what_their_kind_has_not():
    recurrence, resonant = decode_result(npz("codimension-two-points")).points
    assert recurrence.families == (Family(1, 1), Family(4, 0))
    assert (recurrence.order, recurrence.active, recurrence.multiple, recurrence.bifurcation) == (2, True, None, None)
    assert (resonant.order, resonant.families, resonant.multiple, resonant.symmetric) == (None, (), 1, False)
    with pytest.raises(dataclasses.FrozenInstanceError):
        recurrence.omega = 1.0


def test_a_trajectory_has_its_impacts_and_motion():
    result = decode_result(npz("trajectories"))
    assert len(result.impacts) == 2
    assert len(result.sticking) == 0
    np.testing.assert_array_equal(result.impacts.stop, [1, -1])
    assert result.motion.symmetric is True
    assert result.displacement.shape == (3, 5)


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
def test_what_is_no_result_is_refused(content, tmp_path):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(ResultFormatError):
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


def test_pickles_are_never_loaded(tmp_path):
    path = tmp_path / "evil.npz"
    np.savez(path, meta=np.array([object()], dtype=object))
    with pytest.raises(ResultFormatError):
        grazemap.load(path)


def test_a_trajectory_without_impacts_is_the_same_from_json(tmp_path):
    empty = {"time": [], "stop": np.zeros(0, np.int8), "velocity": [], "kind": np.array([], dtype="<U6")}
    impacts = {name: np.asarray(values) for name, values in empty.items()}
    result = decode_result(npz("trajectories", {"impacts": impacts}))
    loaded = grazemap.load(result.save(tmp_path / "none.json"))
    for one in (result, loaded):
        assert len(one.impacts) == 0
        assert one.impacts.kind.dtype.kind == "U"
        assert one.impacts.stop.dtype == np.int64


def test_only_known_endings_are_written(tmp_path):
    with pytest.raises(ValueError, match=r"\.npz or \.json"):
        decode_result(npz("grazing-curves")).save(tmp_path / "curve.csv")


@EVERY_PROCESS
def test_every_result_becomes_a_dataset(process):
    made = decode_result(npz(process)).to_xarray()
    assert json.loads(made.attrs["request"]) == decode_result(npz(process)).meta["request"]
    assert made.attrs["process"] == process


def test_a_dataset_has_coordinates_units_and_labels():
    made = decode_result(npz("unfolding-maps")).to_xarray()
    assert made["label"].sel(omega=0.25, clearance=1.6).item() == "unresolved"
    assert made["omega"].attrs["units"] == "nondimensional"
    assert made["settled_after"].attrs["units"] == "forcing periods"
    assert made["reason"].sel(omega=0.25, clearance=1.6).item() == "not closed"
    assert made["reason"].sel(omega=0.3, clearance=1.6).item() == ""
    assert decode_result(npz("trajectories")).to_xarray()["velocity"].sel(mass=2, time=10.0) == 1.0


def test_a_dataset_of_a_trajectory_has_its_sticking_and_its_motion():
    intervals = {"start": np.array([1.0]), "stop_time": np.array([3.5]), "stop": np.array([-1], dtype=np.int8)}
    made = decode_result(npz("trajectories", {"sticking": intervals})).to_xarray()
    assert [made[name].item() for name in ("sticking_start", "sticking_stop_time", "sticking_stop")] == [1.0, 3.5, -1]
    assert made["sticking_start"].dims == ("interval",)
    assert made["sticking_start"].attrs["units"] == "nondimensional"
    assert json.loads(made.attrs["motion"])["label"] == "1-1r-1l"


def test_a_dataset_of_codimension_two_points_has_families_and_certainty():
    points = [{**POINTS[0], "omega_error": 1e-15, "status": "near-double"}, POINTS[1]]
    made = decode_result(npz("codimension-two-points", {"points": points})).to_xarray()
    assert made["status"].values.tolist() == ["near-double", "simple"]
    np.testing.assert_array_equal(made["omega_error"], [1e-15, np.nan])
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

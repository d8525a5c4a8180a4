"""Results: arrays and records, saved and loaded without losing anything."""

import dataclasses
import io
import json
import random
import warnings

import numpy as np
import pytest
from sdk_documents import REQUESTS, npz

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
    assert decode_result(npz("trajectories")).to_xarray()["velocity"].sel(mass=2, time=10.0) == 1.0

"""Files that say more than they have: what `load` allocates is bounded by the bytes of the file."""

from __future__ import annotations

import io
import json
import struct
import tracemalloc
import zipfile
from collections.abc import Callable

import numpy as np
import pytest

import grazemap
from grazemap import npz
from grazemap.codec import decode_npz, encode_npz
from grazemap.errors import ResultFormatError
from tests.support.sdk_documents import npz as sample

# Deflate makes its input at most 1032 times as long: a member and the array that is copied from it.
MOST_BYTES_OF_A_BYTE = 2 * 1032
# What a file may take that is not for its bytes: the text of its meta, and the modules that read it.
MOST_BYTES_BESIDES = 64 << 20
MILLIONS = 3_000_000
PROCESS = "codimension-two-points"  # its result has records, lists of records in them, and texts


def parts() -> tuple[dict[str, np.ndarray], dict]:
    """The arrays and the meta of a true result."""
    arrays = npz.unpacked(sample(PROCESS))
    return arrays, json.loads(str(arrays.pop("meta")))


def file_of(arrays: dict[str, np.ndarray], meta: object) -> bytes:
    return npz.packed({**arrays, "meta": np.array(meta if isinstance(meta, str) else json.dumps(meta))})


def without_points(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: array for name, array in arrays.items() if not name.startswith("points.")}


def counted_records() -> bytes:
    """Records without fields, of which there is nothing but the number."""
    arrays, meta = parts()
    meta["structure"] = {"points": "records"}
    return file_of({**without_points(arrays), "points.count": np.array(MILLIONS)}, meta)


def equal_records() -> bytes:
    """Records of one field, whose values are packed into nothing."""
    arrays, meta = parts()
    meta["structure"] = {"points": "records"}
    column = {"points.count": np.array(MILLIONS), "points.order": np.zeros(MILLIONS, np.bool_)}
    return file_of({**without_points(arrays), **column}, meta)


def records_in_a_record() -> bytes:
    """One record with a list of records."""
    arrays, meta = parts()
    meta["structure"] = {"points": "records", "points.families": "list", "points.families.values": "records"}
    column = {
        "points.count": np.array(1),
        "points.families.offsets": np.array([0, MILLIONS]),
        "points.families.values.count": np.array(MILLIONS),
    }
    return file_of({**without_points(arrays), **column}, meta)


def rows_of_nothing() -> bytes:
    """A field of records with empty lists, which take no bytes."""
    arrays, meta = parts()
    meta["structure"] = {"points": "records"}
    column = {"points.count": np.array(1), "points.order": np.zeros((MILLIONS, 0))}
    return file_of({**without_points(arrays), **column}, meta)


def lists_in_a_record() -> bytes:
    """One record with a list of lists."""
    arrays, meta = parts()
    meta["structure"] = {"points": "records", "points.a": "list", "points.a.values": "list"}
    column = {
        "points.count": np.array(1),
        "points.a.offsets": np.array([0, MILLIONS]),
        "points.a.values.offsets": np.zeros(MILLIONS, np.int64),
        "points.a.values.values": np.zeros(1),
    }
    return file_of({**without_points(arrays), **column}, meta)


def a_long_name() -> bytes:
    """A name of the structure that has a million documents within each other."""
    arrays, meta = parts()
    meta["structure"][".".join("a" * 1_000_000)] = "none"
    return file_of(arrays, meta)


def many_names() -> bytes:
    """Names of the structure, each with documents of its own."""
    arrays, meta = parts()
    meta["structure"] |= {f"{number}.a.a.a.a.a.a.a.a": "none" for number in range(100_000)}
    return file_of(arrays, meta)


def a_long_meta() -> bytes:
    """A meta of empty lists."""
    arrays, meta = parts()
    return file_of(arrays, {**meta, "x": [[]] * MILLIONS})


def many_texts() -> bytes:
    """A list of texts that is an array of flags."""
    data = npz.unpacked(sample("unfolding-maps"))
    return npz.packed({**data, "reasons": np.zeros(MILLIONS, np.bool_)})


def overlapping_members() -> bytes:
    """A directory that names the same bytes again and again."""
    whole = sample(PROCESS)
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        start, members = archive.start_dir, archive.infolist()
    array = io.BytesIO()
    np.lib.format.write_array(array, np.zeros(1 << 17))
    large = io.BytesIO()
    with zipfile.ZipFile(large, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x.npy", array.getvalue())
    extra = large.getvalue()
    with zipfile.ZipFile(io.BytesIO(extra)) as archive:
        end = archive.start_dir
    listed = bytearray(extra[end : extra.rindex(b"PK\5\6")])
    struct.pack_into("<L", listed, 42, start)
    directory = whole[start : whole.rindex(b"PK\5\6")] + bytes(listed) * 500
    count = len(members) + 500
    position = start + end
    tail = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, count, count, len(directory), position, 0)
    return whole[:start] + extra[:end] + directory + tail


def many_members() -> bytes:
    """More arrays than any result has."""
    arrays, meta = parts()
    return file_of(arrays | {f"a{number}": np.zeros(0) for number in range(20_000)}, meta)


@pytest.mark.parametrize(
    "made",
    [
        counted_records,
        equal_records,
        records_in_a_record,
        rows_of_nothing,
        lists_in_a_record,
        a_long_name,
        many_names,
        a_long_meta,
        many_texts,
        overlapping_members,
        many_members,
    ],
    ids=lambda made: made.__name__,
)
def test_what_a_file_takes_is_bounded_by_its_bytes(made: Callable[[], bytes], tmp_path) -> None:
    data = made()
    path = tmp_path / "hostile.npz"
    path.write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(ResultFormatError):
            grazemap.load(path)
        assert tracemalloc.get_traced_memory()[1] < MOST_BYTES_BESIDES + MOST_BYTES_OF_A_BYTE * len(data)
    finally:
        tracemalloc.stop()


def test_true_results_are_far_below_the_bounds(tmp_path) -> None:
    """Ten thousand records that differ in one number only are read."""
    families = [{"case": 1, "n": 3}]
    records = [{"kind": "resonant", "order": 2, "families": families, "omega": n / 7} for n in range(10_000)]
    data = encode_npz({"points": records, "none": None}, {"process": PROCESS})
    assert decode_npz(data)[0]["points"] == records

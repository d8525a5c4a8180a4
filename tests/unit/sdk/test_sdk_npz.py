"""Npz files: the bytes of numpy and zipfile, read and written faster."""

from __future__ import annotations

import io
import zipfile

import numpy as np
import pytest

from grazemap import npz
from tests.support.sdk_documents import REQUESTS
from tests.support.sdk_documents import npz as sample

ARRAYS = {
    "empty": np.zeros((0, 3)),
    "number": np.array(1.5),
    "text": np.array("motion 1-2r-2l"),
    "words": np.array(["a", "stück"]),
    "flags": np.array([[True, False]]),
    "columns": np.asfortranarray(np.arange(12.0).reshape(3, 4)),
    "complex": np.array([1j, 2.0]),
    "bytes": np.arange(200_000, dtype=np.uint8),
    "größe": np.array([1], dtype=np.int16),
}


def by_zipfile(arrays):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name in sorted(arrays):
            member = zipfile.ZipInfo(name + ".npy", date_time=(1980, 1, 1, 0, 0, 0))
            member.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(member, "w") as stream:
                np.lib.format.write_array(stream, np.asanyarray(arrays[name], order="C"), allow_pickle=False)
    return buffer.getvalue()


def assert_equal(arrays, expected):
    assert arrays.keys() == expected.keys()
    for name, array in expected.items():
        assert arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(arrays[name], array, strict=True)
        assert arrays[name].flags.writeable


def test_the_bytes_are_those_of_zipfile_and_numpy():
    assert npz.packed(ARRAYS) == by_zipfile(ARRAYS)
    for process in REQUESTS:
        data = sample(process)
        with np.load(io.BytesIO(data)) as archive:
            assert by_zipfile(dict(archive)) == data


def test_files_of_numpy_are_read():
    assert_equal(npz.unpacked(npz.packed(ARRAYS)), ARRAYS)
    for save in (np.savez, np.savez_compressed):
        buffer = io.BytesIO()
        save(buffer, **ARRAYS)
        assert_equal(npz.unpacked(buffer.getvalue()), ARRAYS)


def test_objects_are_neither_written_nor_read():
    pickled = np.array([{}], dtype=object)
    with pytest.raises(ValueError, match="objects"):
        npz.packed({"a": pickled})
    buffer = io.BytesIO()
    np.savez(buffer, a=pickled)
    with pytest.raises(ValueError, match="objects"):
        npz.unpacked(buffer.getvalue())

"""Npz files: the bytes of numpy and zipfile, read and written faster, and nothing forged is believed."""

from __future__ import annotations

import io
import struct
import tracemalloc
import zipfile

import numpy as np
import pytest

from grazemap import npz
from grazemap.codec import CodecError, decode_npz, encode_npz
from grazemap.results import decode_result
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


def assert_equal(found, expected):
    assert found.keys() == expected.keys()
    for name, array in expected.items():
        assert found[name].dtype == array.dtype
        np.testing.assert_array_equal(found[name], array, strict=True)
        assert found[name].flags.writeable


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


def forged(header: str, data: bytes = b"\0" * 8) -> bytes:
    """An npz with one array whose header says anything."""
    text = header.encode()
    content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.npy", content)
    return buffer.getvalue()


def test_a_header_is_believed_no_further_than_the_bytes_go():
    good = "{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }\n"
    assert npz.unpacked(forged(good))["a"] == [0.0]
    tracemalloc.start()
    for shape in ("(1000000000000,)", "(2,)", "(0,)", "(-1, 2)", "(1 << 62, 4)"):
        with pytest.raises(CodecError):
            decode_npz(forged(good.replace("(1,)", shape)))
    for header in ("", "{}", good.replace("<f8", "|O"), good.replace("<f8", "<U1000000000"), good[:-10], "[" * 9000):
        with pytest.raises(CodecError):
            decode_npz(forged(header))
    assert tracemalloc.get_traced_memory()[1] < 4_000_000
    tracemalloc.stop()


def test_a_member_is_unpacked_no_further_than_the_directory_says():
    data = forged("{'descr': '|u1', 'fortran_order': False, 'shape': (100000000,), }\n", b"\0" * 100_000_000)
    position = data.rindex(b"PK\1\2") + 24
    assert struct.unpack_from("<L", data, position)[0] > 100_000_000
    small = data[:position] + struct.pack("<L", 1000) + data[position + 4 :]
    tracemalloc.start()
    with pytest.raises(CodecError):
        decode_npz(small)
    assert tracemalloc.get_traced_memory()[1] < 4_000_000
    tracemalloc.stop()


@pytest.mark.parametrize("process", ["grazing-curves", "unfolding-maps"])
def test_every_changed_byte_is_noticed_or_harmless(process):
    data = bytearray(sample(process))
    whole = encode_npz(*decode_npz(bytes(data)))
    for position in range(0, len(data), 7):
        data[position] ^= 0x40
        try:
            again = decode_result(bytes(data))
        except ValueError:  # ResultFormatError is one
            again = None
        if again is not None:  # in a date, say
            assert encode_npz(*decode_npz(bytes(data))) == whole
        data[position] ^= 0x40

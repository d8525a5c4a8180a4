"""Npz files: named arrays in a zip archive. The same arrays give the same bytes.

numpy and zipfile write and read the same files. For the many small arrays of a result, however, writing takes four and
reading ten times as long, mostly because the same headers are formatted and parsed again for every array.
"""

from __future__ import annotations

import io
import math
import struct
import zipfile
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

_LEVEL = 6
_VERSION = 20
_DEFLATED = 8
_UNIX = 3
_READABLE = 0o600 << 16
# 1980-01-01, the first day of zip archives
_DATE = 33
_UTF8 = 0x800
_ENCRYPTED = 1
# version to extract, flags, method, time, date, checksum, packed and whole size, length of the name, extra length
_MEMBER = struct.Struct("<HHHHHLLLHH")
# signature, two numbers of disks, members twice, size and place of the directory, length of a comment
_END = struct.Struct("<4s4H2LH")
_HEADER_LENGTH = struct.Struct("<H")
# Maximum bytes of all arrays of a file; no result has more. Maximum ratio of compression, that of deflate.
_MAX_UNPACKED = 2 << 30
_MAX_RATIO = 1032
# Maximum number of elements of an array without data, such as one of rows without columns.
_MAX_EMPTY = 1 << 24
# Maximum number of arrays in a file; no result has so many.
MAX_MEMBERS = 1 << 13
# Maximum bytes of an array whose compressed form is cached. The whole cache takes some megabytes.
_SMALL = 512
# Positions in the header of a member: of the lengths of its name and its extra field, and of the name.
_LENGTHS, _NAME = 26, 30


def packed(arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """Return arrays as an npz file, in the order of their names. Raises ValueError for arrays of objects."""
    members: list[bytes] = []
    directory: list[bytes] = []
    position = 0
    for name in sorted(arrays):
        array = np.asanyarray(arrays[name])
        whole = _header(array.dtype.str, array.shape) + array.tobytes()
        content = (_small_deflated if len(whole) <= _SMALL else _deflated)(whole)
        path = f"{name}.npy".encode()
        flags = 0 if path.isascii() else _UTF8
        about = _MEMBER.pack(
            _VERSION, flags, _DEFLATED, 0, _DATE, zlib.crc32(whole), len(content), len(whole), len(path), 0
        )
        members += [b"PK\3\4", about, path, content]
        directory.append(
            b"PK\1\2" + bytes((_VERSION, _UNIX)) + about + struct.pack("<HHHLL", 0, 0, 0, _READABLE, position) + path
        )
        position += _NAME + len(path) + len(content)
    listed = b"".join(directory)
    count = len(directory)
    return b"".join([*members, listed, _END.pack(b"PK\5\6", 0, 0, count, count, len(listed), position, 0)])


def unpacked(data: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays of an npz file, which share no memory with it.

    Raises
    ------
    ValueError, zipfile.BadZipFile, zlib.error, struct.error
        The bytes are not such a file, a checksum is wrong, or the size of an array is not that of its data.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
    # a damaged directory may hide its last members; a file with a comment, which `packed` never writes, ends otherwise
    end = data[-_END.size :]
    if end.startswith(b"PK\5\6") and _END.unpack(end)[4] != len(members):
        raise ValueError("the directory has another number of members than the file says")
    if len(members) > MAX_MEMBERS or len({member.filename for member in members}) < len(members):
        raise ValueError("the members are too many, or several have one name")
    # members that overlap would be unpacked from the same bytes
    if sum(member.compress_size for member in members) > len(data):
        raise ValueError("the members are longer than the file")
    if sum(member.file_size for member in members) > _MAX_UNPACKED:
        raise ValueError("the arrays are too large")
    return {member.filename.removesuffix(".npy"): _array(_content(data, member)) for member in members}


def unpacked_size(data: bytes) -> int:
    """Return the bytes of the arrays in an npz file, as its directory says."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return sum(member.file_size for member in archive.infolist())


def _content(data: bytes, member: zipfile.ZipInfo) -> bytes:
    """Return a member's bytes, at most as many as the directory says."""
    name = member.header_offset + _NAME
    length, extra = struct.unpack_from("<HH", data, member.header_offset + _LENGTHS)
    start = name + length + extra
    content = data[start : start + member.compress_size]
    path = member.orig_filename
    if data[name : name + length] != path.encode("utf-8" if member.flag_bits & _UTF8 or path.isascii() else "cp437"):
        raise ValueError("a member has another name than in the directory")
    if member.flag_bits & _ENCRYPTED or member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise ValueError("a member is encrypted or compressed in another way")
    if member.file_size > _MAX_RATIO * member.compress_size:
        raise ValueError("a length is not possible")
    if member.compress_type == zipfile.ZIP_DEFLATED:
        content = zlib.decompressobj(-zlib.MAX_WBITS).decompress(content, member.file_size + 1)
    if len(content) != member.file_size or zlib.crc32(content) != member.CRC:
        raise ValueError("a member has another size or checksum than the directory says")
    return content


def _array(content: bytes) -> NDArray[Any]:
    version = content[:8]
    if version != b"\x93NUMPY\x01\x00":
        raise ValueError("a member is not an array")
    (length,) = _HEADER_LENGTH.unpack_from(content, len(version))
    start = len(version) + _HEADER_LENGTH.size + length
    dtype, shape, fortran = _described(content[:start])
    if start == len(content) and math.prod(side or 1 for side in shape) > _MAX_EMPTY:
        raise ValueError("an empty array is too long")
    # the number of elements follows from the bytes, not from the shape
    array = np.frombuffer(content, dtype, offset=start).copy()
    return array.reshape(shape, order="F" if fortran else "C")


def _deflated(whole: bytes) -> bytes:
    compressor = zlib.compressobj(_LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
    return compressor.compress(whole) + compressor.flush()


# Many small arrays, as flags and names, are the same in result after result.
_small_deflated = lru_cache(maxsize=4096)(_deflated)


@lru_cache(maxsize=4096)
def _header(descr: str, shape: tuple[int, ...]) -> bytes:
    if np.dtype(descr).hasobject:
        raise ValueError("arrays of objects cannot be stored")
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": descr, "fortran_order": False, "shape": shape})
    return stream.getvalue()


@lru_cache(maxsize=4096)
def _described(header: bytes) -> tuple[np.dtype[Any], tuple[int, ...], bool]:
    """Return the type and the shape of an array, and whether its first index varies fastest."""
    stream = io.BytesIO(header)
    np.lib.format.read_magic(stream)
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
    if dtype.hasobject:
        raise ValueError("arrays of objects are not read")
    if min(shape, default=0) < 0:  # numpy takes it for a length that follows from the others
        raise ValueError("a length of an array is negative")
    return dtype, shape, fortran

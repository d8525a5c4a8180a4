"""The formats of a result: one nested document of arrays and records, as npz or as JSON.

A document is a dict with string keys. A value is a numpy array, a plain scalar (bool, int, float, str, None), a nested
document, or a list of records. Records are documents of one kind; a field may be missing in some of them, and its value
may also be a list of scalars or a list of lists. Elsewhere a list of scalars is a numpy array.

npz: nested names are joined by dots. A list of records is stored by columns; a field that is missing in some
records, or is a list or an array, is ragged: ``name.values`` and ``name.offsets``, the entries of record i being
``values[offsets[i]:offsets[i + 1]]``. Arrays of several dimensions are laid out in C order, and ``name.shape`` has
their shapes, one row for each record that has the field. All arrays are numbers, so that any reader of numbers reads
them: an array of texts is one of codes, positions in the list of its name in ``texts`` of the meta. ``meta`` is JSON in
UTF-8, as bytes. The same document gives the same bytes.
JSON: NaN and infinities are null. The process and the version of the layout, from the meta, come first.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Set
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap import npz

Document = dict[str, Any]
# Number of elements of an array that are encoded at once; so many take less than a millisecond.
_PIECE = 1024
# Maximum number of Python objects for each byte of a file. Every record becomes an object of at least a hundred bytes,
# and so does every element of its fields, except that an array stays one array. Results have at most one object for
# every five bytes of the file, but a hostile file can pack many equal records into a few bytes.
_MAX_ENTRIES_PER_BYTE = 4
# Maximum number of characters of the meta, the larger of two: twice the length of the longest request that services
# take by default, and a number for each byte of the file.
_MAX_META = 2 << 20
_MAX_META_PER_BYTE = 16
# Characters of an array of texts for each byte of the file: those of few texts are packed into almost nothing.
_MAX_TEXT_PER_BYTE = 256


class CodecError(ValueError):
    """The bytes are not a result that this version can read."""


def encode_npz(document: Mapping[str, Any], meta: Mapping[str, Any]) -> bytes:
    """Return a document and its meta as the bytes of a compressed npz file (no pickles in it)."""
    arrays: dict[str, NDArray[Any]] = {}
    # the kind of each name that is not a plain array: scalar, optional, list, array, document, records or none
    shape: dict[str, str] = {}
    for key, value in document.items():
        _flatten(key, value, arrays, shape)
    texts = {name: _coded(name, arrays) for name, array in arrays.items() if array.dtype.kind == "U"}
    full = {**meta, "structure": shape, "texts": texts}
    text = json.dumps(full, sort_keys=True, separators=(",", ":"), allow_nan=False)
    arrays["meta"] = np.frombuffer(text.encode(), np.uint8)
    return npz.packed(arrays)


def _coded(name: str, arrays: dict[str, NDArray[Any]]) -> list[str]:
    """Replace an array of texts by their codes; return the texts in the order of the codes."""
    array = arrays[name]
    texts, codes = np.unique(array, return_inverse=True)
    arrays[name] = codes.reshape(array.shape).astype(np.min_scalar_type(len(texts)))
    words: list[str] = texts.tolist()
    return words


def decode_npz(data: bytes) -> tuple[Document, dict[str, Any]]:
    """Return (document, meta) from the bytes that `encode_npz` made. Raises CodecError.

    The memory that is used is bounded by the length of the data: no array is larger than its bytes, and the number of
    records, of elements of their fields and of names is limited for each byte.
    """
    try:
        return _decoded(data)
    except (CodecError, MemoryError):  # it says what is wrong; and not an error of the bytes
        raise
    # For damaged bytes zipfile, numpy and json raise many kinds of errors, some of them undocumented.
    except Exception as error:
        raise CodecError("not a grazemap result") from error


def unpacked(data: bytes) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    """Return the arrays of an npz file, with texts in place of their codes, and its meta with the structure.

    Raises many kinds of errors for damaged bytes.
    """
    arrays = npz.unpacked(data)
    text = arrays.pop("meta")
    if text.nbytes > max(_MAX_META, _MAX_META_PER_BYTE * len(data)):
        raise CodecError("the meta is too long")
    meta: dict[str, Any] = json.loads(text.tobytes())
    if "texts" not in meta:
        raise CodecError("the file has no table of texts: another version of grazemap wrote it")
    for name, texts in meta.pop("texts").items():
        codes = arrays[name]
        if codes.size * max(map(len, texts), default=0) > max(_MAX_META, _MAX_TEXT_PER_BYTE * len(data)):
            raise CodecError("the texts are too long")
        arrays[name] = np.array(texts, dtype=np.str_)[codes]
    return arrays, meta


def _decoded(data: bytes) -> tuple[Document, dict[str, Any]]:
    arrays, meta = unpacked(data)
    shape: dict[str, str] = meta.pop("structure")
    if len(shape) > npz.MAX_MEMBERS or sum(map(len, shape)) > len(data):
        raise CodecError("the structure has too many names")
    records = tuple(f"{name}." for name, kind in shape.items() if kind == "records")
    # the entries of arrays in records, and the shapes of these arrays, become no objects
    whole = {f"{name}.{part}" for name, kind in shape.items() if kind == "array" for part in ("values", "shape")}
    counted = (name for name in arrays if name.startswith(records) and name not in whole)
    if sum(_entries(name, arrays[name]) for name in counted) > _MAX_ENTRIES_PER_BYTE * len(data):
        raise CodecError("there are too many records")
    document: Document = {}
    for name in sorted({*arrays, *shape}):
        if not name.startswith(records):
            _place(document, name, _unflatten(name, arrays, shape))
    return document, meta


def _entries(name: str, array: NDArray[Any]) -> int:
    """Return how many Python objects an array of a list of records becomes; a count of records is their number."""
    count = int(array) if name.endswith(".count") and not array.ndim else 0
    return max(count, math.prod(side or 1 for side in array.shape))


def encode_json(document: Mapping[str, Any], meta: Mapping[str, Any]) -> bytes:
    """Return a document and its meta as one JSON object."""
    return b"".join(iter_json(document, meta))


def iter_json(document: Mapping[str, Any], meta: Mapping[str, Any]) -> Iterator[bytes]:
    """Yield the bytes of `encode_json` in short pieces, so that other threads can run in between."""
    head = {name: meta[name] for name in ("process", "schema") if name in meta}
    for piece in _pieces({**head, **document, "meta": meta}):
        yield piece.encode()


def _pieces(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        yield "{"
        for place, (key, item) in enumerate(value.items()):
            yield f"{',' if place else ''}{json.dumps(key)}:"
            yield from _pieces(item)
        yield "}"
    elif isinstance(value, np.ndarray) and value.size > _PIECE:
        yield "["
        if value.ndim == 1:
            for start in range(0, value.size, _PIECE):
                yield ("," if start else "") + _json(value[start : start + _PIECE])[1:-1]
        else:
            for place, row in enumerate(value):
                yield "," if place else ""
                yield from _pieces(row)
        yield "]"
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        yield "["
        for place, item in enumerate(value):
            yield "," if place else ""
            yield from _pieces(item)
        yield "]"
    else:
        yield _json(value)


def _json(value: Any) -> str:
    return json.dumps(_jsonable(value), separators=(",", ":"), allow_nan=False)


def _flatten(name: str, value: Any, arrays: dict[str, NDArray[Any]], shape: dict[str, str]) -> None:
    if isinstance(value, np.ndarray):
        arrays[name] = value
    elif isinstance(value, Mapping):
        for key, item in value.items():
            _flatten(f"{name}.{key}", item, arrays, shape)
    elif isinstance(value, list):
        _flatten_records(name, value, arrays, shape)
    elif value is None:
        shape[name] = "none"
    else:
        shape[name] = "scalar"
        arrays[name] = np.array(value)


def _flatten_records(
    name: str, records: list[Any], arrays: dict[str, NDArray[Any]], shape: dict[str, str], kind: str = "records"
) -> None:
    keys = sorted({key for record in records for key in record})
    if kind == "document" and not keys:
        raise ValueError("records without fields cannot be stored in npz")
    shape[name] = kind
    if kind == "records":
        if "count" in keys:
            raise ValueError("no field of a record may be named count: npz has the number of records there")
        arrays[f"{name}.count"] = np.array(len(records))
    for key in keys:
        _flatten_column(f"{name}.{key}", [record.get(key) for record in records], arrays, shape)


def _flatten_column(name: str, column: list[Any], arrays: dict[str, NDArray[Any]], shape: dict[str, str]) -> None:
    kinds = set(map(type, column))
    if any(issubclass(kind, list) for kind in kinds):
        rows = [item or [] for item in column]
        shape[name] = "list"
    elif type(None) in kinds:
        rows = [[] if item is None else [item] for item in column]
        shape[name] = "optional"
    elif kinds and all(issubclass(kind, np.ndarray) for kind in kinds):
        _flatten_arrays(name, column, arrays, shape)
        return
    elif kinds and all(issubclass(kind, Mapping) for kind in kinds):
        _flatten_records(name, column, arrays, shape, "document")
        return
    else:
        arrays[name] = np.array(column)
        return
    arrays[f"{name}.offsets"] = _offsets(len(row) for row in rows)
    values = [item for row in rows for item in row]
    if values and isinstance(values[0], Mapping):
        _flatten(f"{name}.values", values, arrays, shape)
    else:
        _flatten_column(f"{name}.values", values, arrays, shape)


def _flatten_arrays(
    name: str, column: list[NDArray[Any]], arrays: dict[str, NDArray[Any]], shape: dict[str, str]
) -> None:
    shape[name] = "array"
    arrays[f"{name}.offsets"] = _offsets(item.size for item in column)
    arrays[f"{name}.values"] = np.concatenate([item.ravel() for item in column])
    if any(item.ndim != 1 for item in column):
        arrays[f"{name}.shape"] = np.array([item.shape for item in column], dtype=np.int64)


def _offsets(lengths: Iterable[int]) -> NDArray[np.int64]:
    return np.array([*accumulate(lengths, initial=0)], dtype=np.int64)


def _unflatten(name: str, arrays: Mapping[str, NDArray[Any]], shape: Mapping[str, str]) -> Any:
    kind = shape.get(name)
    if kind is None:
        return arrays[name]
    if kind == "none":
        return None
    if kind == "scalar":
        return arrays[name].item()
    if kind == "records":
        return _records(name, arrays, shape)
    raise CodecError(f"unknown structure {kind!r}")


def _records(name: str, arrays: Mapping[str, NDArray[Any]], shape: Mapping[str, str]) -> list[dict[str, Any]]:
    columns, count = _columns(name, arrays, shape, {"count"}), int(arrays[f"{name}.count"])
    if columns and count > min(map(len, columns.values())):
        raise CodecError("there are fewer records than are counted")
    return [{field: columns[field][i] for field in columns} for i in range(count)]


def _columns(
    name: str, arrays: Mapping[str, NDArray[Any]], shape: Mapping[str, str], excluded: Set[str] = frozenset()
) -> dict[str, list[Any]]:
    prefix = name + "."
    keys = [key for names in (arrays, shape) for key in names if key.startswith(prefix)]
    fields = {key[len(prefix) :].partition(".")[0] for key in keys} - excluded
    return {field: _column(prefix + field, arrays, shape) for field in sorted(fields)}


def _column(name: str, arrays: Mapping[str, NDArray[Any]], shape: Mapping[str, str]) -> list[Any]:
    kind = shape.get(name)
    if kind is None:
        plain: list[Any] = arrays[name].tolist()
        return plain
    if kind == "records":
        return _records(name, arrays, shape)
    if kind == "document":
        columns = _columns(name, arrays, shape)
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    offsets = arrays[f"{name}.offsets"]
    if np.any(offsets[1:] < offsets[:-1]):
        raise CodecError("offsets must increase")
    if kind == "array":
        pieces = [arrays[f"{name}.values"][a:b] for a, b in pairwise(offsets)]
        if f"{name}.shape" not in arrays:
            return pieces
        return [piece.reshape(sides) for piece, sides in zip(pieces, arrays[f"{name}.shape"], strict=True)]
    values = _column(f"{name}.values", arrays, shape)
    rows = [values[a:b] for a, b in pairwise(offsets)]
    if kind == "optional":
        return [row[0] if row else None for row in rows]
    if kind != "list":
        raise CodecError(f"unknown structure {kind!r}")
    return rows


def _place(document: Document, name: str, value: Any) -> None:
    *parents, leaf = name.split(".")
    for parent in parents:
        document = document.setdefault(parent, {})
    document[leaf] = value


def _jsonable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            return _jsonable(value.tolist())
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: _jsonable(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_jsonable(item) for item in value]
    if isinstance(value, np.generic):
        return _jsonable(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value

"""The record of what results are to the last bit: tests/data/digests.json, and values beside it.

The record has a digest for each field of each result, by process, result and name, and of each field a few values, in
digests.npz, which say by how much it has changed. It is of the instructions of x86-64-v3 (`tests.support.narrow`), so
every processor of that level reproduces it, with the libraries of the lock.
"""

from __future__ import annotations

import hashlib
import json
import math
import platform
import re
from collections.abc import Iterator
from importlib.metadata import version
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap import npz
from tests.support.digests.documents import ROOT, Field, Results

DIGESTS = ROOT / "tests" / "data" / "digests.json"
VALUES = DIGESTS.with_suffix(".npz")
LIBRARIES = ("numba", "llvmlite", "numpy", "scipy", "python-flint")

RENAMED: dict[str, dict[str, str]] = {}
"""By process: names in the record, or beginnings of them, and what they are called now. A renaming is no change."""
GONE = {"certified"}
"""Fields of the record, by the last part of their names, that results no longer have."""

# Values of a field that are recorded, evenly spaced: of numbers, and of labels and flags, which take less space.
_NUMBERS, _LABELS = 32, 256
_DIGITS = 16  # of a digest
_DECIMAL = re.compile(r"-?\d+(?:\.\d+(?:e[+-]?\d+)?|e[+-]?\d+)")
_OF_VALUES = {"f": "floats", "i": "integers", "u": "integers", "b": "integers", "U": "texts"}

Digests = dict[str, dict[str, dict[str, str]]]


class Change(NamedTuple):
    """A field that is not as it was, and what is different."""

    process: str
    result: str
    field: str
    what: str

    def __str__(self) -> str:
        return f"{self.process}, {self.result}: {self.field} {self.what}"


class Record(NamedTuple):
    """What is recorded: the version of the core, versions of libraries, digests, and some values of each field."""

    version: str
    libraries: dict[str, str]
    digests: Digests
    values: Results


def core_version() -> str:
    """Return the version of pyproject.toml."""
    match = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE)
    assert match is not None
    return match[1]


def digest(field: Field) -> str:
    """Return how a document has a field, its type and shape, and the start of the sha256 of its bytes."""
    if field.values is None:
        return field.kind
    content = hashlib.sha256(np.ascontiguousarray(field.values).tobytes()).hexdigest()
    return f"{field.kind} {field.values.dtype.str} {field.values.shape} {content[:_DIGITS]}"


def digests(results: Results) -> Digests:
    """Return the digests of results."""
    return {
        process: {
            name: {field: digest(values) for field, values in fields.items()} for name, fields in sorted(named.items())
        }
        for process, named in sorted(results.items())
    }


def libraries() -> dict[str, str]:
    """Return the versions of the libraries that results depend on, and of the C library."""
    return {name: version(name) for name in LIBRARIES} | {"libc": " ".join(platform.libc_ver())}


def write(results: Results) -> None:
    """Record results of this version, in place of what is recorded."""
    document = {"version": core_version(), "libraries": libraries(), "digests": digests(results)}
    DIGESTS.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n", "utf-8")
    parts: dict[str, list[NDArray[Any]]] = {name: [] for name in _OF_VALUES.values()}
    for field in _in_order(results):
        if field.values is not None and field.values.size:
            parts[_OF_VALUES[field.values.dtype.kind]].append(_some(field.values))
    VALUES.write_bytes(npz.packed({name: np.concatenate(part) for name, part in parts.items()}))


def read() -> Record:
    """Return what is recorded, with names as they are now."""
    document, arrays = json.loads(DIGESTS.read_text("utf-8")), npz.unpacked(VALUES.read_bytes())
    used = dict.fromkeys(arrays, 0)
    known: Digests = {}
    values: Results = {}
    for process, named in document["digests"].items():
        for name, fields in named.items():
            for old, text in fields.items():
                field = _recorded(text, arrays, used)
                if old.rpartition(".")[2] in GONE:
                    continue
                known.setdefault(process, {}).setdefault(name, {})[renamed(process, old)] = text
                values.setdefault(process, {}).setdefault(name, {})[renamed(process, old)] = field
    return Record(document["version"], document["libraries"], known, values)


def renamed(process: str, name: str) -> str:
    """Return what a field of the record is called now."""
    for old, new in RENAMED.get(process, {}).items():
        if name == old or name.startswith(f"{old}."):
            return new + name.removeprefix(old)
    return name


def changes(record: Record, results: Results) -> Iterator[Change]:
    """Yield what of results is not as recorded, and by how much; fields that are new or gone too."""
    for process, named in results.items():
        for name, fields in named.items():
            known = record.digests.get(process, {}).get(name, {})
            for field in sorted({*known, *fields}):
                if field not in fields:
                    yield Change(process, name, field, "is gone")
                elif field not in known:
                    yield Change(process, name, field, "is new")
                elif known[field] != digest(_as_wide(fields[field], known[field])):
                    what = _by_how_much(record.values[process][name][field], known[field], fields[field])
                    yield Change(process, name, field, what)


def disagreements(results: Results, others: Results) -> tuple[list[Change], list[tuple[float, Change]]]:
    """Return labels and flags (all but floating-point numbers) that differ, and the differences of numbers by size.

    The size of a difference is relative to the largest number of the field. Decimals in texts, as certificates have
    them, are numbers.
    """
    labels: list[Change] = []
    numbers: list[tuple[float, Change]] = []
    for process, named in results.items():
        for name, fields in named.items():
            other = others[process][name]
            for field in sorted({*fields, *other}):
                size = _difference(fields.get(field), other.get(field))
                if size is None:
                    labels.append(Change(process, name, field, "is another one"))
                elif size > 0.0:
                    numbers.append((size, Change(process, name, field, f"differs by {size:.1e} of its largest number")))
    return labels, sorted(numbers, reverse=True)


def is_unreleased() -> bool:
    """Return whether CHANGELOG.md has no section of this version."""
    return f"\n## {core_version()}" not in (ROOT / "CHANGELOG.md").read_text("utf-8")


def _as_wide(field: Field, known: str) -> Field:
    """Return a field with texts of the width of those of a digest, if these are wider: the width is no content."""
    _, _, rest = known.partition(" ")
    if not rest or field.values is None or field.values.dtype.kind != "U":
        return field
    dtype = np.dtype(rest.partition(" ")[0])
    wider = dtype.kind == "U" and dtype.itemsize > field.values.dtype.itemsize
    return Field(field.kind, field.values.astype(dtype)) if wider else field


def _in_order(results: Results) -> Iterator[Field]:
    for _, named in sorted(results.items()):
        for _, fields in sorted(named.items()):
            for _, field in sorted(fields.items()):
                yield field


def _some(values: NDArray[Any]) -> NDArray[Any]:
    """Return the values of a field that are recorded."""
    flat, most = values.ravel(), _most(values.dtype)
    few = flat if flat.size <= most else flat[np.linspace(0, flat.size - 1, most).astype(int)]
    return few.astype(np.int64) if few.dtype.kind in ("b", "u") else few


def _most(dtype: np.dtype[Any]) -> int:
    return _NUMBERS if dtype.kind == "f" else _LABELS


def _recorded(text: str, arrays: dict[str, NDArray[Any]], used: dict[str, int]) -> Field:
    """Return the recorded values of the field that has this digest, and count them as used."""
    kind, _, rest = text.partition(" ")
    if not rest:
        return Field(kind, None)
    dtype, sizes = np.dtype(rest.partition(" ")[0]), re.findall(r"\d+", rest[rest.index("(") : rest.index(")")])
    count, part = min(_most(dtype), math.prod(map(int, sizes))), _OF_VALUES[dtype.kind]
    used[part] += count
    return Field(kind, arrays[part][used[part] - count : used[part]].astype(dtype))


def _by_how_much(before: Field, digest_before: str, now: Field) -> str:
    about, about_before = (text.rpartition(" ")[0] for text in (digest(now), digest_before))
    if now.values is None or before.values is None or about != about_before:
        return f"is {about or digest(now)}, and was {about_before or digest_before}"
    few = _some(now.values).astype(now.values.dtype)
    size = _difference(before, Field(now.kind, few))
    if size is None:
        which = few != before.values
        return f"has other values: {few[which][0]!s} was {before.values[which][0]!s}, {which.sum()} of {few.size}"
    if size == 0.0:
        return f"changed by less than {few.size} recorded values show"
    return f"changed by {size:.1e} of its largest number"


def _difference(field: Field | None, other: Field | None) -> float | None:
    """Return the largest difference of numbers, relative to the largest one; None where anything else differs."""
    if field is None or other is None or field.kind != other.kind:
        return None
    if field.values is None or other.values is None:
        return 0.0 if field.values is other.values else None
    a, b = field.values, other.values
    if a.shape != b.shape or a.dtype.kind != b.dtype.kind:
        return None
    if np.array_equal(a, b, equal_nan=a.dtype.kind == "f"):
        return 0.0
    if a.dtype.kind == "U" and [_DECIMAL.sub("", text) for text in a.flat] == [
        _DECIMAL.sub("", text) for text in b.flat
    ]:
        a, b = (np.array(_DECIMAL.findall(" ".join(texts.flat)), dtype=np.float64) for texts in (a, b))
    if a.dtype.kind != "f" or not np.array_equal(np.isfinite(a), np.isfinite(b)):
        return None
    a, b = a[np.isfinite(a)], b[np.isfinite(b)]
    return float(np.max(np.abs(a - b)) / max(np.max(np.abs(a)), np.max(np.abs(b))))

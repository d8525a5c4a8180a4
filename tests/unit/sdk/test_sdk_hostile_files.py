"""Files that are damaged or forged: refused, and what `load` allocates is bounded by the bytes of the file."""

from __future__ import annotations

import contextlib
import io
import json
import random
import re
import struct
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import grazemap
from grazemap import npz
from grazemap.codec import CodecError, decode_npz, encode_npz
from grazemap.errors import ResultFormatError
from grazemap.results import VERSION, decode_result, load
from tests.support.sdk_documents import REQUESTS, result_of
from tests.support.sdk_documents import npz as sample

# Deflate makes its input at most 1032 times as long: a member and the array that is copied from it.
MOST_BYTES_OF_A_BYTE = 2 * 1032
# What a file may take that is not for its bytes: the text of its meta, and the modules that read it.
MOST_BYTES_BESIDES = 64 << 20
MILLIONS = 3_000_000
PROCESS = "codimension-two-points"  # its result has records, lists of records in them, and texts


@contextlib.contextmanager
def at_most(size: int) -> Iterator[None]:
    """Check that no more memory is taken at a time."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < size
    finally:
        tracemalloc.stop()


def parts() -> tuple[dict[str, np.ndarray], dict]:
    """The arrays and the meta of a true result."""
    arrays = npz.unpacked(sample(PROCESS))
    return arrays, json.loads(arrays.pop("meta").tobytes())


def file_of(arrays: dict[str, np.ndarray], meta: object) -> bytes:
    text = meta if isinstance(meta, str) else json.dumps(meta)
    return npz.packed({**arrays, "meta": np.frombuffer(text.encode(), np.uint8)})


def records(structure: dict[str, str], **columns: np.ndarray | int) -> bytes:
    """A result whose records have another structure and other columns, some with dots in place of underscores."""
    arrays, meta = parts()
    others = {name: array for name, array in arrays.items() if not name.startswith("points.")}
    named = {f"points.{name.replace('_', '.')}": np.array(values) for name, values in columns.items()}
    return file_of(others | named, {**meta, "structure": {"points": "records", **structure}})


def records_in_a_record() -> bytes:
    inner = {"points.families": "list", "points.families.values": "records"}
    return records(inner, count=1, families_offsets=np.array([0, MILLIONS]), families_values_count=MILLIONS)


def lists_in_a_record() -> bytes:
    ends = {"a_offsets": np.array([0, MILLIONS]), "a_values_offsets": np.zeros(MILLIONS, np.int64)}
    return records({"points.a": "list", "points.a.values": "list"}, count=1, **ends, a_values_values=np.zeros(1))


def arrays_in_records() -> bytes:
    """Many short arrays, each of which is an object."""
    return records({"points.a": "array"}, count=1, a_offsets=np.zeros(MILLIONS, np.int64), a_values=np.zeros(0))


def texts_in_records() -> bytes:
    """Lists of texts, in records, that are arrays of flags."""
    arrays = npz.unpacked(sample("bifurcation-curves"))
    meta = json.loads(arrays.pop("meta").tobytes())
    count = int(arrays["curves.count"])
    per_curve = 60_000
    ends = {
        "curves.ends.offsets": np.arange(count + 1) * per_curve,
        "curves.ends.values": np.full(count * per_curve, 77, np.uint8),
    }
    assert meta["texts"].pop("curves.ends.values")
    return file_of(arrays | ends, meta)


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
    return npz.packed({**data, "reasons": np.zeros(MILLIONS, np.uint8)})


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
    return file_of(arrays | {f"a{number}": np.zeros(0) for number in range(npz.MAX_MEMBERS + 1)}, meta)


@pytest.mark.parametrize(
    "made",
    [
        pytest.param(lambda: records({}, count=MILLIONS), id="records without fields"),
        pytest.param(lambda: records({}, count=MILLIONS, order=np.zeros(MILLIONS, np.bool_)), id="equal records"),
        pytest.param(lambda: records({}, count=1, order=np.zeros((MILLIONS, 0))), id="rows of nothing"),
        records_in_a_record,
        lists_in_a_record,
        arrays_in_records,
        texts_in_records,
        a_long_name,
        many_names,
        a_long_meta,
        many_texts,
        overlapping_members,
        many_members,
    ],
)
def test_what_a_file_takes_is_bounded_by_its_bytes(made: Callable[[], bytes], tmp_path) -> None:
    data = made()
    path = tmp_path / "hostile.npz"
    path.write_bytes(data)
    with at_most(MOST_BYTES_BESIDES + MOST_BYTES_OF_A_BYTE * len(data)), pytest.raises(ResultFormatError):
        grazemap.load(path)


def test_true_results_are_far_below_the_bounds(tmp_path) -> None:
    """Ten thousand records that differ in one number only are read."""
    families = [{"case": 1, "n": 3}]
    records = [{"kind": "resonant", "order": 2, "families": families, "omega": n / 7} for n in range(10_000)]
    data = encode_npz({"points": records, "none": None}, {"process": PROCESS})
    assert decode_npz(data)[0]["points"] == records


def test_equal_records_with_arrays_are_read_however_few_bytes_they_take() -> None:
    """As equal trajectories from many initial states, and equal sections of a diagram."""
    samples = np.linspace(0.0, 1.0, 201) ** 2
    records = [{"time": samples, "state": np.stack([samples, -samples]), "stops": [1, -1]} for _ in range(400)]
    data = encode_npz({"trajectories": records}, {"process": "trajectories"})
    read = decode_npz(data)[0]["trajectories"]
    assert len(data) < len(records) * samples.size / 4
    assert all(np.array_equal(record["state"], records[0]["state"]) for record in read)


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
        sample("trajectories")[:500],
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
@pytest.mark.parametrize("process", list(REQUESTS))
def test_a_damaged_file_is_the_same_result_or_refused(process, ending, tmp_path):
    """A change of JSON may be another number."""
    path = decode_result(sample(process)).save(tmp_path / f"file{ending}")
    whole, draw, refused = path.read_bytes(), random.Random(1), 0
    for _ in range(80):
        content = bytearray(whole)
        content[draw.randrange(len(content))] = draw.randrange(256)
        path.write_bytes(content)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # zipfile and numpy also warn of some damages
            try:
                result = grazemap.load(path)
            except ResultFormatError:
                refused += 1
            else:
                assert ending == ".json" or result.save(tmp_path / "again.npz").read_bytes() == whole
    assert refused > 40


def test_a_directory_that_hides_members_is_refused():
    """As where the last member, a field that may be absent, is the comment of the one before it."""
    content = sample("grazing-curves of one stop")
    whole = bytearray(content)
    last, before = whole.rfind(b"PK\1\2"), whole.rfind(b"PK\1\2", 0, whole.rfind(b"PK\1\2"))
    whole[before + 32 : before + 34] = (whole.rfind(b"PK\5\6") - last).to_bytes(2, "little")
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        assert archive.namelist() == zipfile.ZipFile(io.BytesIO(content)).namelist()[:-1]
    with pytest.raises(ResultFormatError):
        decode_result(bytes(whole))


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_a_result_of_another_layout_is_refused_as_such(tmp_path, ending):
    result = result_of("grazing-curves")
    result.meta["schema"] = VERSION - 1
    with pytest.raises(ResultFormatError, match=f"layout {VERSION - 1}.* layout {VERSION}"):
        load(result.save(tmp_path / f"result.{ending}"))


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_a_result_of_another_layout_is_refused_as_such_where_it_cannot_be_decoded(tmp_path, ending):
    """In JSON the version is known before the fields are read, and in npz the codes of texts show it."""
    path = result_of("grazing-curves").save(tmp_path / f"result.{ending}")
    if ending == "json":
        document = json.loads(path.read_bytes())
        document["meta"] |= {"schema": VERSION - 1, "process": "renamed-since"}
        path.write_text(json.dumps(document))
    else:
        arrays = npz.unpacked(path.read_bytes())
        meta = json.loads(arrays.pop("meta").tobytes())
        path.write_bytes(file_of(arrays, {name: value for name, value in meta.items() if name != "texts"}))
    with pytest.raises(ResultFormatError, match="version of grazemap"):
        load(path)


def test_npz_whose_structure_is_wrong_is_refused():
    document = {"points": [{"kind": "recurrence", "families": [{"case": 1, "n": 2}]}, {"kind": "resonant"}]}
    with np.load(io.BytesIO(encode_npz(document, {}))) as archive:
        arrays = dict(archive)
    meta = json.loads(arrays["meta"].tobytes())
    for structure in ([], None, {**meta["structure"], "points": "scalar"}, {"points": 3}, {"none": "records"}):
        text = json.dumps({"structure": structure, "texts": meta["texts"]})
        changed = {**arrays, "meta": np.frombuffer(text.encode(), np.uint8)}
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


def forged(header: str, content: bytes = bytes(80), name: str = "omega") -> bytes:
    """The npz of a result with an array whose header says something else than the bytes that follow."""
    text = f"{header}\n".encode()
    lying = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + content
    result = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(sample(PROCESS if "." in name else "grazing-curves"))) as whole,
        zipfile.ZipFile(result, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for member in whole.namelist():
            archive.writestr(member, lying if member == f"{name}.npy" else whole.read(member))
    return result.getvalue()


def header(shape: str, descr: str = "<f8") -> str:
    return f"{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}"


@pytest.mark.parametrize(
    "data",
    [
        forged(header("(1000000000000,)")),
        forged(header("(1048576, 1048576)")),
        forged(header("(1 << 62, 4)")),
        forged(header("(11,)")),
        forged(header("(0,)")),
        forged(header("(-10,)")),
        forged(header("(-1, 2)")),
        forged(header(f"({1 << 40}, 0)"), b""),
        forged(header(f"({1 << 40},)", "|V0"), b""),
        forged(header("(10,)", "|O")),
        forged(header("(1,)", "<U1000000000")),
        forged(header("()", "<i8"), (1 << 40).to_bytes(8, "little"), "points.count"),
        forged(header("(4,)", "<i8"), np.array([0, 2, 0, 2]).tobytes(), "points.families.offsets"),
        forged(""),
        forged("{}"),
        forged(header("(10,)")[:-10]),
        forged("[" * 9000),
    ],
)
def test_a_forged_array_is_refused_before_memory_is_taken_for_it(data):
    with at_most(4 << 20), pytest.raises(ResultFormatError):
        decode_result(data)


def test_a_header_that_is_true_is_read():
    assert decode_result(forged(header("(3,)"), np.arange(3.0).tobytes())).omega.tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("size", [1000, 1 << 31])
def test_a_zip_bomb_is_refused_before_it_is_unpacked(size):
    """A member of 64 MB, and a directory that says less, or more than deflate can pack into so few bytes."""
    small = forged(header(f"({64 << 20},)", "|u1"), bytes(64 << 20))
    assert len(small) < 1 << 17
    place = small.index(b"omega.npy", small.index(b"PK\1\2")) - 46 + 24
    lying = small[:place] + struct.pack("<L", size) + small[place + 4 :]
    with at_most(4 << 20), pytest.raises(ResultFormatError):
        decode_result(lying)


def test_pickles_are_never_loaded(tmp_path):
    path = tmp_path / "evil.npz"
    np.savez(path, meta=np.array([object()], dtype=object))
    with pytest.raises(ResultFormatError):
        grazemap.load(path)

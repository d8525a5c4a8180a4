"""The bytes of results do not change without a change of version, and labels do not depend on the processor."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from grazemap.codec import encode_npz
from grazemap_core.compiled_ahead import has_level_3
from tests.support.digests import record
from tests.support.digests.documents import Results, at_the_level, fields, here
from tests.support.digests.planted import PLANTS
from tests.support.digests.requests import TIERS
from tests.support.narrow import SETTINGS

OF_THE_LEVEL = pytest.mark.skipif(not has_level_3(), reason="the processor is not of the level x86-64-v3")


@pytest.fixture(scope="module")
def recorded() -> record.Record:
    return record.read()


@pytest.fixture(scope="module")
def quick(tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The quick results with the instructions of x86-64-v3."""
    return at_the_level(tmp_path_factory.mktemp("results"), "--tiers", "quick")


@pytest.fixture
def known(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Results:
    """Two results of one process that are recorded, in a place of its own."""
    monkeypatch.setattr(record, "DIGESTS", tmp_path / "digests.json")
    monkeypatch.setattr(record, "VALUES", tmp_path / "digests.npz")
    results = {"trajectories": {"one": result(), "other": result()}}
    record.write(results)
    return results


def result(**changes: object) -> dict[str, record.Field]:
    document = {
        "displacement": np.arange(1.0, 101.0),
        "velocity": np.arange(101.0, 201.0),
        "impacts": [{"time": 0.1, "stop": 1}, {"time": 0.1, "stop": 1}, {"time": 0.5, "stop": -1}],
        "label": "1-2r-2l",
        "verified": True,
        "reason": None,
    }
    return fields(encode_npz({**document, **changes}, {}))


def changed(**changes: object) -> list[str]:
    """The fields of a result that are not as recorded."""
    differing = list(record.changes(record.read(), {"trajectories": {"one": result(**changes)}}))
    assert {(change.process, change.result) for change in differing} <= {("trajectories", "one")}
    return [change.field for change in differing]


def test_the_width_of_texts_is_no_change(known: Results) -> None:
    def of(*texts: str, width: int) -> Results:
        return {"trajectories": {"one": result() | {"kinds": record.Field("array", np.array(texts, f"U{width}"))}}}

    record.write(of("graze", "hit", width=9))
    assert list(record.changes(record.read(), of("graze", "hit", width=5))) == []
    assert len(list(record.changes(record.read(), of("graze", "bit", width=5)))) == 1
    assert len(list(record.changes(record.read(), of("graze", "hit longer", width=10)))) == 1


@OF_THE_LEVEL
def test_bytes_change_only_with_the_version(quick: Results, recorded: record.Record) -> None:
    """With other libraries than those of the record, which round otherwise: labels and flags alone."""
    changes = list(record.changes(recorded, quick))
    if record.libraries() != recorded.libraries:
        changes = of_labels(changes, quick)
    where = f"recorded with {recorded.libraries}, computed with {record.libraries()}"
    assert [*map(str, changes)] == [], (
        f"the bytes changed: change the version in pyproject.toml, then make digests; {where}"
    )


def of_labels(changes: Iterable[record.Change], results: Results) -> list[record.Change]:
    """The changes of fields that are no floating-point numbers."""
    return [
        change
        for change in changes
        if (field := results[change.process][change.result].get(change.field)) is None
        or field.values is None
        or field.values.dtype.kind != "f"
    ]


@OF_THE_LEVEL
def test_this_processor_s_own_instructions_give_the_same_labels_and_flags(quick: Results) -> None:
    labels, numbers = record.disagreements(quick, here("quick"))
    print("the largest other difference:", *(str(change) for _, change in numbers[:1]))
    assert [str(change) for change in labels] == []


def test_maps_have_the_recorded_labels_and_flags_on_every_processor(recorded: record.Record) -> None:
    results = here("maps")
    assert [*map(str, of_labels(record.changes(recorded, results), results))] == []


def test_the_record_is_of_this_version_and_has_every_result(recorded: record.Record) -> None:
    assert recorded.version == record.core_version(), "make digests"
    every: dict[str, set[str]] = {}
    for requests in TIERS.values():
        for process, bodies in requests.items():
            assert every.setdefault(process, set()).isdisjoint(bodies), process
            every[process] |= bodies.keys()
    assert {process: named.keys() for process, named in recorded.digests.items()} == every


def test_the_settings_are_honoured_by_numba_numpy_and_both_libraries_of_linear_algebra() -> None:
    """On a processor without AVX-512 this shows less: what is switched off is not there."""
    code = """
import ctypes, json
import scipy.linalg
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from grazemap_core.maps.kernels.first_pass import VECTOR
libraries = {line.split(maxsplit=5)[5].strip() for line in open("/proc/self/maps") if "openblas" in line}
def core(path):
    library = ctypes.CDLL(path)
    names = ("scipy_openblas_get_corename64_", "scipy_openblas_get_corename")
    function = next(getattr(library, name) for name in names if hasattr(library, name))
    function.restype = ctypes.c_char_p
    return function().decode()
print(json.dumps({
    "numba": cpu_target.target_context.codegen().magic_tuple()[1:],
    "numpy": [name for name in __cpu_dispatch__ if __cpu_features__[name]],
    "cores": [core(path) for path in libraries],
    "vector": VECTOR,
}))
"""
    answer = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | SETTINGS, capture_output=True, timeout=120, check=True
    )
    honoured = json.loads(answer.stdout)
    assert honoured == {"numba": ["x86-64-v3", ""], "numpy": ["X86_V3"], "cores": ["Haswell"] * 2, "vector": 4}


def test_a_result_as_recorded_has_no_changes(known: Results) -> None:
    assert changed() == []


def test_one_rounding_is_a_change_and_its_size_is_said(known: Results) -> None:
    values = np.arange(1.0, 101.0)
    values[-1] = np.nextafter(100.0, 101.0)
    (change,) = record.changes(record.read(), {"trajectories": {"one": result(displacement=values)}})
    assert change.field == "displacement"
    assert "1.4e-16" in change.what
    values = np.arange(1.0, 101.0)
    values[1] = np.nextafter(2.0, 3.0)  # not among the values that are recorded
    assert changed(displacement=values) == ["displacement"]


def test_swapped_fields_order_and_multiplicity_are_changes(known: Results) -> None:
    values, other = np.arange(1.0, 101.0), np.arange(101.0, 201.0)
    assert changed(displacement=other, velocity=values) == ["displacement", "velocity"]
    assert changed(displacement=values[::-1]) == ["displacement"]
    twice, once = {"time": 0.1, "stop": 1}, {"time": 0.5, "stop": -1}
    assert changed(impacts=[once, twice, twice]) == ["impacts.stop", "impacts.time"]
    assert changed(impacts=[twice, once]) == ["impacts.count", "impacts.stop", "impacts.time"]


def test_types_shapes_and_fields_are_part_of_the_record(known: Results) -> None:
    assert changed(displacement=np.arange(1, 101)) == ["displacement"]
    assert changed(displacement=np.arange(1.0, 101.0).reshape(2, 50)) == ["displacement"]
    assert changed(verified=np.array([True])) == ["verified"]
    assert changed(label="1-2r-1l") == ["label"]
    assert changed(reason="none") == ["reason"]
    assert changed(more=1.0) == ["more"]


def test_a_name_in_the_table_is_no_change(known: Results, monkeypatch: pytest.MonkeyPatch) -> None:
    renamed = {name.replace("impacts", "contacts"): field for name, field in result().items()}
    assert len(list(record.changes(record.read(), {"trajectories": {"one": renamed}}))) == 8
    monkeypatch.setitem(record.RENAMED, "trajectories", {"impacts": "contacts"})
    assert list(record.changes(record.read(), {"trajectories": {"one": renamed}})) == []


def test_labels_disagree_and_numbers_differ() -> None:
    near = np.arange(1.0, 101.0) * (1.0 + 1e-12)
    results, other = ({"trajectories": {"one": fields_}} for fields_ in (result(), result(displacement=near)))
    labels, ((size, change),) = record.disagreements(results, other)
    assert labels == []
    assert change.field == "displacement"
    assert size == pytest.approx(1e-12, rel=1e-3)
    for changes in ({"label": "1-1r-2l"}, {"verified": False}, {"displacement": near[:-1]}, {"reason": "why"}):
        labels, _ = record.disagreements(results, {"trajectories": {"one": result(**changes)}})
        assert [label.field for label in labels] == [*changes]


def test_numbers_of_a_certificate_are_numbers_and_its_words_are_labels() -> None:
    def certificate(**theorem: object) -> Results:
        text = json.dumps({"statement": {"kind": "orbit", "range": ["0.282", "0.283"]}, "theorem": theorem})
        return {"proofs": {"one": fields(encode_npz({"certificate": text}, {}))}}

    original = certificate(name="newton", box=["[0.25 +/- 1e-30]", "1e-30"])
    other = certificate(name="newton", box=["[0.2500000001 +/- 2e-30]", "1e-30"])
    labels, numbers = record.disagreements(original, other)
    assert labels == []
    assert [change.field for _, change in numbers] == ["certificate.theorem.box"]
    labels, _ = record.disagreements(original, certificate(name="krawczyk", box=["[0.25 +/- 1e-30]", "1e-30"]))
    assert [change.field for change in labels] == ["certificate.theorem.name"]


@OF_THE_LEVEL
@pytest.mark.thorough
@pytest.mark.parametrize("name", PLANTS)
def test_a_planted_error_is_seen(name: str, tmp_path: Path, recorded: record.Record) -> None:
    """One rounding in each package of the core, two swapped fields, two swapped sides."""
    error = PLANTS[name]
    options = ("--tiers", error.tier, "--only", error.process)
    assert list(record.changes(recorded, at_the_level(tmp_path / "right", *options))) == []
    changes = list(record.changes(recorded, at_the_level(tmp_path / "wrong", *options, "--plant", name)))
    assert changes
    print(f"{name}: {len(changes)} fields, such as {changes[0]}")

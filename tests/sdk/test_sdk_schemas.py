"""The schemas of results: the classes and the documents have their fields, and what differs is found."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from sdk_documents import REQUESTS, document, with_deprecated

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import RESULTS
from grazemap.results.records import RECORDS
from grazemap.schema import SCHEMAS, Record, schema_of
from grazemap.schema.fields import deprecated
from grazemap.wire import PROCESSES
from tests.document_problems import problems


def records(record: Record) -> list[Record]:
    inside = [one.type for one in record if isinstance(one.type, Record)]
    return [record, *(deeper for one in inside for deeper in records(one))]


def test_every_process_has_a_schema_and_every_schema_a_class() -> None:
    assert {schema.process for schema in SCHEMAS} == set(PROCESSES)
    assert {schema.name for schema in SCHEMAS} == set(RESULTS)


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.name)
def test_classes_have_the_fields_of_their_schemas(schema: Record) -> None:
    for record in records(schema):
        kind = RESULTS.get(record.name) or RECORDS.get(record.name)
        if kind in (None, dict):  # of the figures of adaptive maps, and of trajectories in a list
            assert record.name in ("FiguresAtComputedPoints", "TrajectoryRecord")
            continue
        assert dataclasses.is_dataclass(kind)
        own = {field.name for field in dataclasses.fields(kind)} - {"meta", "_document", "_oscillator"}
        assert own == {one.name for one in record if not one.replaces} - {"at_computed"}
        assert all(f"\n{name} : " in (kind.__doc__ or "") for name in own)


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.name)
def test_every_field_is_described(schema: Record) -> None:
    for record in records(schema):
        names = [one.name for one in record]
        assert len(set(names)) == len(names)
        for one in record:
            assert one.description.endswith("."), f"{record.name}.{one.name}"
            assert not one.index_of or one.index_of in names
            assert not one.replaces or one.replaces in names


@pytest.mark.parametrize("process", list(REQUESTS))
def test_documents_are_checked_field_by_field(process: str) -> None:
    whole = document(process)
    schema = schema_of(process.split()[0], whole)
    assert problems(schema, whole) == []
    assert problems(schema, with_deprecated(schema, whole)) == []
    assert problems(schema, decode_npz(encode_npz(whole, {}))[0]) == []
    for one in schema:
        if one.name not in whole:
            continue
        lacking = {name: value for name, value in whole.items() if name != one.name}
        assert bool(problems(schema, lacking)) is not one.optional
        if one.dims and isinstance(whole[one.name], np.ndarray):
            deeper = {**whole, one.name: whole[one.name][None]}
            assert any("dimensions" in problem for problem in problems(schema, deeper))
            other = {**whole, one.name: whole[one.name].astype(np.complex64 if one.type != "str" else "S")}
            assert any(f"{one.name} is " in problem for problem in problems(schema, other))
    assert "not declared" in problems(schema, {**whole, "novelty": 1})[0]


def test_values_that_are_not_numbers_or_not_allowed_are_found() -> None:
    curve = document("grazing-curves")
    schema = schema_of("grazing-curves", curve)
    assert problems(schema, {**curve, "phase": curve["phase"] * np.nan}) == ["GrazingCurve.phase is not finite"]
    (said,) = problems(schema, {**curve, "phase": curve["phase"][1:]})
    assert "2 along omega, where others have 3" in said
    orbit: dict[str, Any] = document("periodic-orbits")
    (said,) = problems(schema_of("periodic-orbits", orbit), {**orbit, "found_by": "chance"})
    assert "other values" in said
    (said,) = problems(schema_of("periodic-orbits", orbit), {**orbit, "period": 1.5})
    assert "not a int" in said or "not an int" in said


def test_deprecated_names_stand_beside_what_replaces_them() -> None:
    for process in ("unfolding-maps", "unfolding-maps of computed points", "unfolding-diagrams"):
        whole = document(process)
        full = with_deprecated(schema_of(process.split()[0], whole), whole)
        inside = full.get("at_computed") or full.get("unfolding_map") or full
        np.testing.assert_array_equal(inside["certified"], inside["verified"])
    orbit = with_deprecated(schema_of("periodic-orbits", {}), document("periodic-orbits"))
    assert (orbit["certified"], orbit["motion"]["certified"]) == (False, False)
    named = [one.name for schema in SCHEMAS for record in records(schema) for one in record if one.replaces]
    assert set(named) == {"certified"}
    assert deprecated("old", SCHEMAS[0]["omega"]).replaces == "omega"

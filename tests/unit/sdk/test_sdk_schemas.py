"""The schemas of results: the classes and the documents have their fields, and what differs is found."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import RESULTS, SCHEMAS, Family, Motion, PeriodicOrbit, schema_of
from grazemap.results.documents import document_of
from grazemap.results.fields import RecordSchema
from grazemap.results.record import FloatArray, Record, field, stored
from grazemap.wire import PROCESSES
from tests.support.document_problems import problems
from tests.support.sdk_documents import REQUESTS, document


def records(record: RecordSchema) -> list[RecordSchema]:
    inside = [entry.type for entry in record if isinstance(entry.type, RecordSchema)]
    return [record, *(deeper for nested in inside for deeper in records(nested))]


def test_every_process_has_a_class_of_its_result() -> None:
    assert {schema.process for schema in SCHEMAS} == set(PROCESSES)
    assert {schema.name for schema in SCHEMAS} == set(RESULTS)


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.name)
def test_objects_have_the_attributes_of_their_schemas(schema: RecordSchema) -> None:
    for record in records(schema):
        assert dataclasses.is_dataclass(record.kind)
        of_the_client = {"meta", "_document", "_oscillator", "_service", "_shown_units"}
        own = {attribute.name for attribute in dataclasses.fields(record.kind)} - of_the_client
        assert own == {entry.name for entry in record if not entry.stored_only}
        assert all(f"\n{name} : " in (record.kind.__doc__ or "") for name in own)


class Sample(Record):
    """A record with one field of each kind.

    It is of this test.
    """

    number: float = field("A number.", unit="m")
    name: str | None = field("A name.")
    array: FloatArray | None = field("An array.", "time", "s", when="sometimes")
    families: tuple[Family, ...] = field("Families.", "family", when="sometimes")
    texts: tuple[str, ...] = field("Texts.", "text")
    aside = stored("Figures.", type=Family.schema, when="sometimes")
    shown: ClassVar[int] = 3
    _own: int = 1


class Other(Record):
    """A record that varies a field of another one."""

    number: FloatArray = field(Sample, "time", null=True)
    label: str = field("A label.", default="none")


def test_a_field_has_its_name_and_its_type_from_the_attribute() -> None:
    """It is written once: no name, type or need is given beside the attribute's own."""
    described = {
        entry.name: (entry.type, entry.dims, entry.null, entry.optional, entry.is_tuple) for entry in Sample.schema
    }
    assert described == {
        "number": ("float", (), False, False, False),
        "name": ("str", (), True, False, False),
        "array": ("float", ("time",), False, True, False),
        "families": (Family.schema, ("family",), False, True, False),
        "texts": ("str", ("text",), False, False, True),
        "aside": (Family.schema, (), False, True, False),
    }
    assert Sample.schema.description == "A record with one field of each kind. It is of this test."
    varied, original = Other.schema["number"], Sample.schema["number"]
    assert varied == original.varied(dims=("time",), null=True)
    assert not hasattr(Sample, "aside")
    with pytest.raises(TypeError, match="dimensions"):
        type("Wrong", (Record,), {"__annotations__": {"x": FloatArray}, "x": field("An array.")})
    with pytest.raises(TypeError, match="dimensions"):
        type("Wrong", (Record,), {"__annotations__": {"x": float}, "x": field("A number.", "time")})


def test_objects_are_frozen_and_are_made_as_dataclasses_are() -> None:
    made = Sample(1.0, "x", texts=())
    assert (made.number, made.array, made.families, made._own) == (1.0, None, (), 1)
    assert dataclasses.replace(made, number=2.0).number == 2.0
    assert Other(np.zeros(1)).label == "none"
    for wrong in ((), (1.0, "x", None, (), (), 1, 2)):
        with pytest.raises(TypeError, match="Sample"):
            Sample(*wrong)
    for wrong in ({"texts": (), "more": 1}, {"texts": (), "number": 1.0}):
        with pytest.raises(TypeError, match="Sample"):
            Sample(1.0, None, **wrong)
    with pytest.raises(dataclasses.FrozenInstanceError):
        made.number = 2.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        del made.number
    # what has arrays is not compared by its values
    assert Sample(1.0, "x", texts=()) != made
    assert Family(1, 2) == Family(case=1, n=2)
    assert Family(1, 2) != Family(1, 3)
    assert len({Family(1, 2), Family(1, 2), Family(2, 2)}) == 2
    assert repr(Family(1, 2)) == "Family(case=1, n=2)"
    motion = Motion("chaotic", verified=False)
    assert pickle.loads(pickle.dumps(motion)) == copy.deepcopy(motion) == motion


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda schema: schema.name)
def test_every_field_is_described(schema: RecordSchema) -> None:
    for record in records(schema):
        names = [entry.name for entry in record]
        assert len(set(names)) == len(names)
        for entry in record:
            assert entry.description.endswith("."), f"{record.name}.{entry.name}"
            assert not entry.index_of or entry.index_of in names


@pytest.mark.parametrize("process", list(REQUESTS))
def test_documents_are_checked_field_by_field(process: str) -> None:
    whole = document(process)
    schema = schema_of(process.split()[0], whole)
    assert problems(schema, whole) == []
    assert problems(schema, document_of(schema.kind, **whole)) == []
    assert problems(schema, decode_npz(encode_npz(whole, {}))[0]) == []
    for entry in schema:
        if entry.name not in whole:
            continue
        lacking = {name: value for name, value in whole.items() if name != entry.name}
        assert bool(problems(schema, lacking)) is not entry.optional
        if entry.dims and isinstance(whole[entry.name], np.ndarray):
            deeper = {**whole, entry.name: whole[entry.name][None]}
            assert any("dimensions" in problem for problem in problems(schema, deeper))
            other = {**whole, entry.name: whole[entry.name].astype(np.complex64 if entry.type != "str" else "S")}
            assert any(f"{entry.name} is " in problem for problem in problems(schema, other))
    assert "not declared" in problems(schema, {**whole, "novelty": 1})[0]


def test_a_document_is_made_of_objects_and_values() -> None:
    number = SimpleNamespace(number=1.0, array=None, families=None, of_no_field=2)
    made = document_of(Sample, number, name=None, texts=["x"], aside=SimpleNamespace(case=1, n=2))
    assert made == {"number": 1.0, "name": None, "texts": ["x"], "aside": {"case": 1, "n": 2}}
    made = document_of(Sample, number=1.0, name="x", texts=[], array=None, families=[{"case": 1, "n": 2}, Family(2, 3)])
    assert made["array"] is None
    assert made["families"] == [{"case": 1, "n": 2}, {"case": 2, "n": 3}]
    orbit = document("periodic-orbits") | {"multipliers": np.array([1.0 + 2.0j])}
    np.testing.assert_array_equal(document_of(PeriodicOrbit, **orbit)["multipliers"], [[1.0, 2.0]])


def test_a_wrong_or_a_missing_name_fails_where_a_document_is_made() -> None:
    values: dict[str, Any] = {"number": 1.0, "name": "x", "texts": []}
    for wrong, named in (
        ({"numbers": 1.0}, "Sample have no numbers"),
        ({"families": [{"case": 1}]}, "Family lacks n"),
        ({"aside": {"case": 1, "n": 2, "m": 3}}, "Family have no m"),
    ):
        with pytest.raises(TypeError, match=named):
            document_of(Sample, **values, **wrong)
    for name in values:
        with pytest.raises(TypeError, match=f"Sample lacks {name}"):
            document_of(Sample, **{other: value for other, value in values.items() if other != name})


def test_values_that_are_not_numbers_or_not_allowed_are_found() -> None:
    curve = document("grazing-curves")
    schema = schema_of("grazing-curves", curve)
    assert problems(schema, {**curve, "phase": curve["phase"] * np.nan}) == ["GrazingCurve.phase is not finite"]
    (problem,) = problems(schema, {**curve, "phase": curve["phase"][1:]})
    assert "2 along omega, where others have 3" in problem
    orbit: dict[str, Any] = document("periodic-orbits")
    (problem,) = problems(schema_of("periodic-orbits", orbit), {**orbit, "found_by": "chance"})
    assert "other values" in problem
    (problem,) = problems(schema_of("periodic-orbits", orbit), {**orbit, "period": 1.5})
    assert "not a int" in problem or "not an int" in problem

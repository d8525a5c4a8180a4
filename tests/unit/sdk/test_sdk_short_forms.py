"""Requests in their short and in their one form: the same question, and errors at the fields as they were written."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from typing import Any

import pytest
from pydantic import ValidationError

from benchmarks.random_requests import KINDS, drawn
from grazemap.wire import (
    PROCESSES,
    BasinCoordinate,
    Interval,
    Range,
    StructuresRequest,
    canonical_id,
    parse_request,
)
from grazemap.wire.planes import AXES

SIZES = (1.0, 3.0)
LONG = ("axis", *AXES)


def one_form(process: str, body: dict[str, Any]) -> dict[str, Any]:
    """The body of a request with axes, nothing else changed."""
    return dict(PROCESSES[process].long_form(body)[0])


def short_form(process: str, body: dict[str, Any]) -> dict[str, Any]:
    """The body of a request in its short form, as people write it."""
    return PROCESSES[process].short_form(body)


def is_same_question(process: str, body: dict[str, Any]) -> bool:
    """Whether a body is a request. Its forms are then one question, whose text stays when it is parsed again."""
    try:
        asked = parse_request(process, body).canonical()
    except ValidationError:
        with pytest.raises(ValidationError):
            parse_request(process, one_form(process, body))
        return False
    identity = canonical_id(process, asked, "0")
    for written in (one_form(process, body), asked, short_form(process, asked)):
        again = parse_request(process, written).canonical()
        assert again == asked, body
        assert canonical_id(process, again, "0") == identity
    assert not asked.keys() & {"vary", "range"}
    varied = [asked[axis]["vary"] for axis in LONG if axis in asked]
    # a branch also has the values at its orbit
    assert process == "orbit-branches" or not {*varied} & asked.keys()
    return True


def check(process: str, seeds: range) -> None:
    """Random requests are the same questions in all forms; nearly all of them are requests."""
    bodies = [drawn(process, seed)(size) for seed in seeds for size in SIZES]
    asked = [is_same_question(process, body) for body in bodies]
    assert sum(asked) > 0.9 * len(asked)


@pytest.mark.parametrize("process", KINDS)
def test_both_forms_are_the_same_question(process: str) -> None:
    check(process, range(25))


@pytest.mark.thorough
@pytest.mark.parametrize("process", KINDS)
def test_both_forms_of_many_requests_are_the_same_question(process: str) -> None:
    """Some ten thousand requests in all."""
    check(process, range(1000, 1370))


RANGE = {"start": 0.2, "stop": 0.3, "points": 4}
ROWS = {"start": 1.5, "stop": 1.6, "points": 3}
WRONG = {"start": 0.3, "stop": 0.2, "points": 4}


@pytest.mark.parametrize(
    ("process", "body", "pointer"),
    [
        ("grazing-curves", {"omega": WRONG}, "/omega"),
        ("grazing-curves", {"axis": {"vary": "omega", "values": WRONG}}, "/axis/values"),
        ("grazing-curves", {"omega": {**RANGE, "start": -1}}, "/omega/start"),
        ("unfolding-maps", {"omega": RANGE, "clearance": {**ROWS, "start": -1}}, "/clearance/start"),
        ("unfolding-maps", {"omega": RANGE, "clearance": {"right": [2.0, 1.0]}}, "/clearance/right"),
        (
            "unfolding-maps",
            {"horizontal": {"vary": "omega", "values": RANGE}, "vertical": {"vary": "clearance", "values": [2.0, 1.0]}},
            "/vertical/values",
        ),
        ("bifurcation-diagrams", {"omega": WRONG, "clearance": 1.6}, "/omega"),
        ("bifurcation-diagrams", {"vary": "omega", "range": WRONG, "clearance": 1.6}, "/range"),
        ("bifurcation-diagrams", {"vary": "speed", "range": RANGE, "clearance": 1.6}, "/vary"),
        ("bifurcation-diagrams", {"axis": {"vary": "speed", "values": RANGE}, "clearance": 1.6}, "/axis/vary"),
        (
            "basins",
            {
                "omega": 0.29,
                "clearance": 1.6,
                "horizontal": {"quantity": "displacement", "mass": 9, "values": [0.0, 0.1]},
                "vertical": {"vary": "velocity[1]", "values": [0.0, 0.1]},
            },
            "/horizontal/mass",
        ),
        (
            "basins",
            {
                "omega": 0.29,
                "clearance": 1.6,
                "horizontal": {"quantity": "displacement", "mass": "1", "values": [0.0, 0.1]},
                "vertical": {"vary": "velocity[1]", "values": [0.0, 0.1]},
            },
            "/horizontal/mass",
        ),
        (
            "proofs",
            {"statement": {"kind": "codimension-two", "type": "g", "order": 2, "range": WRONG}},
            "/statement/range",
        ),
    ],
)
def test_an_error_is_at_the_field_as_it_was_written(process: str, body: dict[str, Any], pointer: str) -> None:
    before = deepcopy(body)
    with pytest.raises(ValidationError) as caught:
        parse_request(process, body)
    places = {"".join(f"/{part}" for part in error["loc"]) for error in caught.value.errors()}
    assert any(place == pointer or place.startswith(f"{pointer}/") for place in places), places
    assert body == before


def leaves(value: Any, *at: str | int) -> Iterator[tuple[str | int, ...]]:
    """Yield the places of all values of a body that have no parts; of a list, those of the first one."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from leaves(part, *at, name)
    elif isinstance(value, list) and value:
        yield from leaves(value[0], *at, 0)
    else:
        yield at


def with_text(body: dict[str, Any], at: tuple[str | int, ...]) -> dict[str, Any]:
    """A body with a text at a place where there is no such text."""
    changed: dict[str, Any] = deepcopy(body)
    part: Any = changed
    for name in at[:-1]:
        part = part[name]
    part[at[-1]] = "no value"
    return changed


@pytest.mark.parametrize("process", KINDS)
def test_a_wrong_value_is_named_wherever_it_is_written(process: str) -> None:
    for seed in range(6):
        asked = parse_request(process, drawn(process, seed)(1.0)).canonical()
        for body in (asked, short_form(process, asked)):
            for place in leaves(body):
                with pytest.raises(ValidationError) as caught:
                    parse_request(process, with_text(body, place))
                written = tuple(map(str, place))
                named = [tuple(map(str, error["loc"])) for error in caught.value.errors()]
                assert any(path and path == written[: len(path)] for path in named), (body, place, named)


def test_the_documented_form_of_a_request_has_axes_alone() -> None:
    for model in PROCESSES.values():
        fields = model.model_json_schema()["properties"]
        assert "vary" not in fields
        assert "range" not in fields
    assert set(BasinCoordinate.model_fields) == {"vary", "values"}


OF_RESTITUTION = {
    "horizontal": {"vary": "omega", "values": {"start": 0.2, "stop": 0.3}},
    "vertical": {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9}},
    "clearance": 1.6,
}
PROVEN = {"kind": "orbit", "omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}}


@pytest.mark.parametrize(
    ("process", "body", "nulls"),
    [
        ("unfolding-maps", {"omega": RANGE, "clearance": ROWS}, {"horizontal": None, "vertical": None}),
        ("bifurcation-diagrams", {"omega": RANGE, "clearance": 1.6}, {"axis": None, "vary": None, "range": None}),
        ("bifurcation-diagrams", {"axis": {"vary": "omega", "values": RANGE}, "clearance": 1.6}, {"range": None}),
        ("proofs", {"statement": PROVEN}, {"statement": {**PROVEN, "vary": None, "range": None}}),
        (
            "bifurcation-curves",
            {**OF_RESTITUTION, "motions": [{"period": 1, "stops": [1], "horizontal": 0.28, "vertical": 0.5}]},
            {
                "motions": [
                    {"period": 1, "stops": [1], "omega": None, "clearance": None, "horizontal": 0.28, "vertical": 0.5}
                ]
            },
        ),
    ],
)
def test_what_is_null_is_not_there(process: str, body: dict[str, Any], nulls: dict[str, Any]) -> None:
    """As programs write it that were generated from the API's document."""
    asked = parse_request(process, body).canonical()
    assert parse_request(process, {**body, **nulls}).canonical() == asked


def test_a_short_form_beside_its_axis_is_unknown_and_no_name_is_suggested() -> None:
    body = {"axis": {"vary": "omega", "values": RANGE}, "clearance": 1.6, "range": RANGE}
    with pytest.raises(ValidationError) as caught:
        parse_request("bifurcation-diagrams", body)
    (error,) = caught.value.errors()
    assert error["loc"] == ("range",)
    assert error["ctx"]["hint"] == ""
    assert "axis" in error["ctx"]["allowed"]


def test_a_statement_without_an_axis_has_no_short_form_of_it() -> None:
    with pytest.raises(ValidationError) as caught:
        parse_request("proofs", {"statement": {**PROVEN, "vary": "omega"}})
    (error,) = caught.value.errors()
    assert error["loc"] == ("statement", "vary")


def test_ranges_of_any_values_are_ranges_of_positive_values_too() -> None:
    by_class = parse_request("grazing-curves", {"omega": Range(**RANGE)})
    assert by_class == parse_request("grazing-curves", {"omega": RANGE})
    points = parse_request("codimension-two-points", {"omega": Interval(start=0.2, stop=0.3)})
    assert points == parse_request("codimension-two-points", {"omega": {"start": 0.2, "stop": 0.3}})
    assert StructuresRequest(omega=Range(**RANGE)) == parse_request("structures", {"omega": RANGE})
    with pytest.raises(ValidationError):
        parse_request("grazing-curves", {"omega": Range(**{**RANGE, "start": -1.0})})


@pytest.mark.parametrize("given", [{"left": None}, {"left": 1.7}])
def test_where_the_clearance_of_one_stop_is_given_that_of_the_other_varies(given: dict[str, Any]) -> None:
    values = {"start": 1.5, "stop": 1.9, "points": 4}
    along = parse_request("basin-fractions", {"omega": 0.29, "vary": "clearance", "range": values, "clearance": given})
    assert along == parse_request(
        "basin-fractions", {"omega": 0.29, "axis": {"vary": "clearance_right", "values": values}, "clearance": given}
    )
    plane = {"horizontal": {"vary": "omega", "values": [0.2, 0.3]}, "clearance": given}
    over = parse_request("unfolding-maps", plane | {"vertical": {"vary": "clearance", "values": values}})
    assert over == parse_request("unfolding-maps", plane | {"vertical": {"vary": "clearance_right", "values": values}})


def test_a_branch_has_the_clearances_of_its_orbit() -> None:
    body = {"omega": 0.29, "clearance": {"right": 1.6}, "motion": {"period": 1, "stops": [1]}}
    with pytest.raises(ValueError, match="clearance_right or clearance_left"):
        parse_request("orbit-branches", body | {"range": {"start": 1.5, "stop": 1.9}})

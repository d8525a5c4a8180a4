"""The OpenAPI document describes the service, and its examples work."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from starlette.testclient import TestClient

from grazemap.wire import PROCESSES, Oscillator, parse_request
from grazemap.wire.problems import KINDS
from grazemap_service import app, openapi
from grazemap_service.problems import MEDIA_TYPE
from grazemap_service.redis_server import RedisServer
from grazemap_worker.store import Store
from tests.support.api_document import looked_up, operations
from tests.support.service_running import client_of
from tests.support.watching import until

# Of the compressed document, which a page loads before it shows anything.
MAX_SENT_BYTES = 200_000
REFERENCE = Path(__file__).parents[3] / "docs" / "reference"
GUIDE = REFERENCE / "http.md"


@pytest.fixture
def document(described: dict[str, Any]) -> dict[str, Any]:
    return described


def test_the_document_is_made_at_the_start_and_once(redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[bool] = []
    whole = openapi.document

    def document(app: Any, *, keys: bool, masses: int) -> dict[str, Any]:
        made.append(keys)
        return whole(app, keys=keys, masses=masses)

    monkeypatch.setattr(openapi, "document", document)
    monkeypatch.setattr(openapi, "_MADE", {})
    monkeypatch.setattr(app, "_DOCUMENT_AFTER_SECONDS", 0.0)
    with client_of(redis_server) as client:
        until(lambda: made)
        answers = [client.get("/openapi.json") for _ in range(2)]
    assert made == [False]
    assert answers[0].json() == answers[1].json()


def test_the_document_is_compressed(client: TestClient) -> None:
    with client.stream("GET", "/openapi.json", headers={"Accept-Encoding": "gzip"}) as answer:
        sent = sum(map(len, answer.iter_raw()))
        assert answer.headers["content-encoding"] == "gzip"
    assert sent < MAX_SENT_BYTES


def test_what_several_operations_have_in_common_stands_once(document: dict[str, Any]) -> None:
    texts = [
        json.dumps(part)
        for operations in document["paths"].values()
        for operation in operations.values()
        for part in (*operation["responses"].values(), *operation.get("parameters", ()))
        if "in" in part or MEDIA_TYPE in part.get("content", ())
    ]
    assert len(texts) == len(set(texts))


def test_every_operation_has_its_own_id_a_summary_and_a_description(document: dict[str, Any]) -> None:
    all_operations = operations(document)
    ids = [operation["operationId"] for _, _, operation in all_operations]
    assert len(ids) == len(set(ids)) == 13 + 2 * len(PROCESSES)
    assert {f"/v1/{process}" for process in PROCESSES} <= set(document["paths"])
    for _, _, operation in all_operations:
        assert operation["summary"]
        assert operation["description"]


def test_errors_are_documented_as_problems(document: dict[str, Any]) -> None:
    for _, path, operation in operations(document):
        errors = {status: reply for status, reply in operation["responses"].items() if status >= "400"}
        for reply in errors.values():
            (media_type,) = reply["content"]
            assert media_type == "application/problem+json"
            assert reply["content"][media_type]["schema"] == {"$ref": "#/components/schemas/Problem"}
        if path.startswith("/v1"):
            assert {"401", "500", "503"} <= set(errors)
        if "{job_id}" in path:
            assert "404" in errors
    for process in PROCESSES:
        responses = document["paths"][f"/v1/{process}"]["post"]["responses"]
        assert {"200", "201", "400", "413", "415", "422", "429", "503"} <= set(responses)
    assert "HTTPValidationError" not in str(document)


def test_references_lead_somewhere(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    references = set(re.findall(r"#/components/schemas/(\w+)", str(document)))
    assert references <= set(schemas)
    assert set(schemas) <= references
    for kind in ("parameters", "responses"):
        assert set(re.findall(rf"#/components/{kind}/([\w-]+)", str(document))) == set(document["components"][kind])


def test_a_discriminator_leads_to_objects_with_its_property(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    unions = [schema for schema in schemas.values() if "discriminator" in schema]
    assert len(unions) == 4
    for union in unions:
        for process, target in union["discriminator"]["mapping"].items():
            member = looked_up(document, {"$ref": target})
            assert member["type"] == "object"
            assert member["properties"]["process"]["const"] == process
            assert "process" in member["required"]


def test_every_field_of_a_request_and_every_group_is_described(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    waiting = [f"{process.__name__}" for process in PROCESSES.values()]
    seen = set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        waiting += re.findall(r"#/components/schemas/(\w+)", str(schemas[name]))
        for field, schema in schemas[name]["properties"].items():
            described = schema.get("description", "")
            assert described.endswith("."), f"{name}.{field}"
            assert "\n" not in described
    assert {"Oscillator", "InitialState", "Range", "OrbitMotion", "BasinCoordinate"} <= seen
    used = {tag for _, _, operation in operations(document) for tag in operation["tags"]}
    assert used == {tag["name"] for tag in document["tags"] if tag["description"]}


def test_descriptions_are_plain_text_that_is_shown_whole(document: dict[str, Any]) -> None:
    assert "Parameters" not in document["components"]["schemas"]["Oscillator"]["description"]
    # a page takes <key> for an element, unless it is code
    texts = [document["info"]["description"], *re.findall(r"'description': ['\"](.*?)['\"][,}]", str(document))]
    texts += [line for page in REFERENCE.glob("*.md") for line in page.read_text("utf-8").splitlines()]
    assert not [text for text in texts if re.search(r"<\w+>", re.sub(r"`[^`]*`", "", text))]


def test_the_guide_has_every_field_of_the_oscillator_with_its_default() -> None:
    section = (REFERENCE / "oscillator.md").read_text("utf-8")
    chain, *others = (
        dict(re.findall(r"^\| `(\w+)` \|([^|]*)\|", part, re.MULTILINE)) for part in section.split("\n## ")
    )
    assert {name: json.loads(text.strip(" `")) for name, text in chain.items()} == Oscillator().model_dump()
    assert {*chain, *(name for part in others for name in part)} == {*Oscillator.model_fields}
    (body,) = re.findall(r"-d '\n(\{.*?)'\n", section, re.DOTALL)
    assert parse_request("grazing-curves", json.loads(body)).oscillator.size == 2


def test_bounds_of_numbers_lists_and_parameters_are_documented(document: dict[str, Any]) -> None:
    schemas = document["components"]["schemas"]
    masses = schemas["Oscillator"]["properties"]["masses"]
    assert (masses["minItems"], masses["maxItems"]) == (1, 64)
    assert (masses["items"]["minimum"], masses["items"]["maximum"]) == (1e-60, 1e60)
    (number, _) = schemas["Oscillator"]["properties"]["restitution"]["oneOf"]
    assert (number["minimum"], number["maximum"]) == (0, 1)
    phase = Draft202012Validator(schemas["InitialState"]["properties"]["phase"])
    assert [x for x in (0, 1e-60, -1e60, 5e-324, -5e-324, 1e61, -1e61) if phase.is_valid(x)] == [0, 1e-60, -1e60]
    for method, path, operation in operations(document):
        parameters = operation.get("parameters", [])
        assert all("anyOf" not in parameter["schema"] for parameter in parameters), path
        if any(parameter["in"] != "path" for parameter in parameters):
            assert "422" in operation["responses"], (method, path)


def test_the_pattern_of_the_priority_is_that_of_the_service(client: TestClient, document: dict[str, Any]) -> None:
    parameter = document["components"]["parameters"]["priority"]
    right, wrong = ["0", "u=3", "i"], ["", "10", "x"]
    for value in (*right, *wrong):
        answer = client.get(f"/v1/jobs/{'0' * 64}", headers={"priority": value})
        assert answer.status_code == (404 if value in right else 422)
        assert bool(re.search(parameter["schema"]["pattern"], value)) == (value in right)


def test_errors_of_an_estimate_say_what_is_allowed(client: TestClient) -> None:
    answer = client.post("/v1/grazing-curves/estimate", json={"omega": {"start": 1, "stop": 2, "points": 2.5}})
    assert answer.json()["errors"][0]["allowed"] == "an integer >= 2"


@pytest.mark.parametrize("process", PROCESSES)
def test_examples_can_be_posted(client: TestClient, document: dict[str, Any], process: str) -> None:
    content = document["paths"][f"/v1/{process}"]["post"]["requestBody"]["content"]["application/json"]
    assert content["examples"]
    for example in content["examples"].values():
        parse_request(process, example["value"])
        answer = client.post(f"/v1/{process}", json=example["value"])
        assert answer.status_code == 201
        assert answer.json()["estimate"]["seconds"] < 5


@pytest.mark.parametrize("process", PROCESSES)
def test_the_answers_that_are_shown_are_those_to_the_first_example(
    client: TestClient, document: dict[str, Any], process: str
) -> None:
    def shown(path: str, status: str = "200") -> Any:
        return document["paths"][path]["post"]["responses"][status]["content"]["application/json"]["example"]

    path = f"/v1/{process}"
    body = next(iter(PROCESSES[process].operation.examples.values()))
    (example, *_) = document["paths"][path]["post"]["requestBody"]["content"]["application/json"]["examples"].values()
    assert example == {"value": body}
    job = client.post(path, json=body).json()
    moment = {"created": job["created"], "waiting_for": job["waiting_for"]}
    assert shown(path, "201") | moment == shown(path, "202") | moment == job
    assert shown(f"{path}/estimate") == {**job["estimate"], "notes": job["notes"]}
    done = shown(path)
    assert done["progress"]["done"] == done["progress"]["total"]
    assert {link["rel"] for link in done["links"]} > {link["rel"] for link in job["links"]} - {"cancel"}


def test_shown_answers_are_as_described(document: dict[str, Any]) -> None:
    shown = 0
    for _, path, operation in operations(document):
        for status, answer in operation["responses"].items():
            content = answer.get("content", {}).get("application/json", {})
            if "example" in content:
                described = Draft202012Validator({**content["schema"], "components": document["components"]})
                assert described.is_valid(content["example"]), (path, status)
                shown += 1
    assert shown == 4 * len(PROCESSES) + 3


def test_a_request_of_a_batch_is_described_by_its_process(document: dict[str, Any]) -> None:
    items = document["components"]["schemas"]["Batch"]["properties"]["requests"]["items"]
    item = Draft202012Validator({**items, "components": document["components"]})
    for process, model in PROCESSES.items():
        for request in model.operation.examples.values():
            assert item.is_valid({"process": process, "request": request})
            assert not item.is_valid({"process": process, "request": {**request, "unknown": 1}})
        assert not item.is_valid({"process": process})
    assert not item.is_valid({"process": "basins", "request": {}})
    body = document["paths"]["/v1/batches"]["post"]["requestBody"]["content"]["application/json"]
    (example,) = body["examples"].values()
    assert all(map(item.is_valid, example["value"]["requests"]))
    assert not item.is_valid({"process": "unknown", "request": {}})


def test_events_are_described_without_a_type(document: dict[str, Any]) -> None:
    """OpenAPI 3.1 has a schema for the whole of a stream or for each event, as one reads it."""
    (content,) = document["paths"]["/v1/jobs/{job_id}/events"]["get"]["responses"]["200"]["content"].values()
    assert content == {"schema": {"description": "Server-sent events."}}


def test_keys_are_documented_where_they_are_required(client: TestClient, serve: Any) -> None:
    assert "securitySchemes" not in client.get("/openapi.json").json()["components"]
    document = serve(api_keys="0123456789-of-the-tests-KEY").get("/openapi.json").json()
    assert document["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    secured = {path for _, path, operation in operations(document) if "security" in operation}
    assert secured == set(document["paths"]) - {"/healthz", "/readyz"}


def test_the_guide_lists_every_metric(client: TestClient, store: Store) -> None:
    store.set_budget()
    client.get("/v1")
    shown = re.findall(r"^# TYPE (\w+) (\w+)$", client.get("/metrics").text, re.MULTILINE)
    names = {name for name, _ in shown if not name.endswith("_created")}
    rows = re.findall(r"^\| (`grazemap_\w+`.*?) \|", GUIDE.read_text("utf-8"), re.MULTILINE)
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == names


def test_the_guide_lists_every_problem() -> None:
    rows = re.findall(r"^\| `urn:grazemap:problem:([a-z-]+)` \| (\d+) \|", GUIDE.read_text("utf-8"), re.MULTILINE)
    assert {name: int(status) for name, status in rows} == {name: kind.status for name, kind in KINDS.items()}

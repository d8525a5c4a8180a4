"""Many requests in one: a line for each, whatever becomes of it."""

from __future__ import annotations

import base64
import json
import threading
import time
from typing import Any

import httpx2
import pytest
from starlette.testclient import TestClient

from grazemap_service.routers import batches
from grazemap_worker.store import Store

CURVES = [
    {"process": "grazing-curves", "request": {"omega": {"start": 0.1, "stop": 1.0, "points": 5 + k}}} for k in range(6)
]


def lines_of(answer: Any) -> list[dict[str, Any]]:
    assert answer.headers["content-type"].startswith("application/x-ndjson")
    lines = [json.loads(line) for line in answer.text.split("\n") if line]
    return sorted(lines, key=lambda line: line["index"])


def test_each_request_has_its_own_job_and_a_line_when_it_has_ended(live_url: str, store: Store, worker: Any) -> None:
    known = httpx2.post(f"{live_url}/v1/grazing-curves", json=CURVES[0]["request"]).json()["id"]
    worker.finish(known)
    answers: list[dict[str, Any]] = []

    def ask() -> None:
        with httpx2.stream("POST", f"{live_url}/v1/batches?f=npz", json={"requests": [*CURVES, CURVES[3]]}) as answer:
            answers.extend(json.loads(line) for line in answer.iter_lines() if line)

    asking = threading.Thread(target=ask)
    asking.start()
    end = time.monotonic() + 10
    while len(answers) < 1 or len(store.jobs.page()[0]) < 6:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert [line["index"] for line in answers] == [0]  # what is ready is sent at once
    ids = {job.request["axis"]["values"]["points"]: job.id for job in store.jobs.page()[0]}
    data = [worker.finish(ids[5 + k]) for k in (5, 4, 3, 2)]
    store.jobs.dismiss(ids[6], "", everyone=True)
    asking.join(10)
    assert not asking.is_alive()
    lines = sorted(answers, key=lambda line: line["index"])
    assert [line["index"] for line in lines] == list(range(7))
    assert [line["id"] for line in lines] == [known, *(ids[5 + k] for k in (1, 2, 3, 4, 5, 3))]
    assert [line["status"] for line in lines] == ["successful", "dismissed", *["successful"] * 5]
    assert (
        base64.b64decode(lines[5]["npz"]) == data[1] == httpx2.get(f"{live_url}/v1/jobs/{ids[9]}/result?f=npz").content
    )


def test_json_of_a_line_is_that_of_the_result_and_a_large_result_is_linked(
    client: TestClient, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = client.post("/v1/grazing-curves", json=CURVES[0]["request"]).json()["id"]
    worker.finish(job)
    (line,) = lines_of(client.post("/v1/batches", json={"requests": CURVES[:1]}))
    assert line == {
        "index": 0,
        "id": job,
        "status": "successful",
        "result": client.get(f"/v1/jobs/{job}/result").json(),
    }
    as_text = client.post("/v1/batches", json={"requests": CURVES[:1]}, headers={"Accept": "text/plain"})
    assert as_text.headers["content-type"].startswith("text/plain")
    assert json.loads(as_text.text) == line
    monkeypatch.setattr(batches, "LARGE_BYTES", 10)
    (line,) = lines_of(client.post("/v1/batches", json={"requests": CURVES[:1]}))
    assert line == {"index": 0, "id": job, "status": "successful", "href": f"/v1/jobs/{job}/result"}
    (line,) = lines_of(client.post("/v1/batches?f=npz", json={"requests": CURVES[:1]}))
    assert client.get(line["href"]).headers["content-type"] == "application/x-npz"


def test_a_line_has_the_notes_on_what_its_request_leaves_out(client: TestClient, worker: Any) -> None:
    machine = {"units": "SI", "masses": [2.0], "stiffnesses": [800.0], "damping": [1.6], "forcing": [12.0]}
    given = machine | {"restitution": 0.8}
    bodies = [{"oscillator": oscillator, "omega": [15.0, 20.0, 25.0]} for oscillator in (machine, given)]
    worker.finish(client.post("/v1/grazing-curves", json=bodies[0]).json()["id"])
    requests = [{"process": "grazing-curves", "request": body} for body in bodies]
    lines = lines_of(client.post("/v1/batches", json={"requests": requests}))
    assert lines[0].pop("notes") == client.post("/v1/grazing-curves", json=bodies[0]).json()["notes"]
    assert lines[0].pop("index") == 0
    assert lines[0] | {"index": 1} == lines[1]


def test_a_job_that_ends_while_it_is_looked_at_has_its_result_in_the_line(
    client: TestClient, store: Store, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = client.post("/v1/grazing-curves", json=CURVES[0]["request"]).json()["id"]
    worker.finish(job)
    results = type(store.results)
    original, seen = results.each_info, []

    def late(self: Any, ids: list[str], most: int) -> list[Any]:
        seen.append(ids)
        return [None] * len(ids) if len(seen) == 1 else original(self, ids, most)

    monkeypatch.setattr(results, "each_info", late)
    (line,) = lines_of(client.post("/v1/batches", json={"requests": CURVES[:1]}))
    assert line["result"] == client.get(f"/v1/jobs/{job}/result").json()
    assert len(seen) == 2


@pytest.mark.parametrize(
    ("item", "pointer"),
    [
        ({"process": "none", "request": {}}, "/requests/1/process"),
        ({"process": "grazing-curves", "request": {"omega": [-1]}}, "/requests/1/request/omega/0"),
        ({"process": "grazing-curves", "request": {"omega": [1], "more": 1}}, "/requests/1/request"),
        ({"process": "grazing-curves"}, "/requests/1/request"),
        (
            {"process": "trajectories", "request": {"omega": 1, "clearance": 1, "periods": 999_999_999}},
            "/requests/1/request",
        ),
    ],
)
def test_a_wrong_request_is_named_and_nothing_is_submitted(
    client: TestClient, store: Store, item: dict[str, Any], pointer: str
) -> None:
    answer = client.post("/v1/batches", json={"requests": [CURVES[0], item]})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"].startswith(pointer)
    assert store.jobs.page() == ([], None)


@pytest.mark.parametrize("count", [0, 1001])
def test_a_batch_has_one_to_a_thousand_requests(client: TestClient, store: Store, count: int) -> None:
    answer = client.post("/v1/batches", json={"requests": CURVES[:1] * count})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["pointer"] == "/requests"
    assert error["allowed"]


def test_what_the_queue_does_not_take_has_a_problem_in_its_line(serve: Any, worker: Any) -> None:
    client = serve(max_pending_tiles=2)
    job = client.post("/v1/grazing-curves", json=CURVES[0]["request"]).json()["id"]
    worker.finish(job)
    client.post("/v1/grazing-curves", json=CURVES[1]["request"])
    client.post("/v1/grazing-curves", json=CURVES[2]["request"])
    lines = lines_of(client.post("/v1/batches", json={"requests": [CURVES[0], CURVES[3]]}))
    assert lines[0]["status"] == "successful"
    assert lines[1]["problem"]["type"] == "urn:grazemap:problem:queue-full"
    assert set(lines[1]) == {"index", "problem"}

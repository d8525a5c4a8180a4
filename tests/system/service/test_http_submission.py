"""The same request is one job, in any form and at any number of repetitions."""

from __future__ import annotations

import json
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Thread
from typing import Any

import httpx2
import pytest
from starlette.testclient import TestClient

from grazemap.wire import PROCESSES, Oscillator, UnfoldingDiagramsRequest, parse_request
from grazemap_service.request_body import JsonRequest
from grazemap_worker.queue import wake_ups
from grazemap_worker.store import Store, WorkerInfo, core_version, jobs
from grazemap_worker.store.jobs import Jobs
from grazemap_worker.store.keys import EVENTS_CHANNEL, job_key
from tests.support import parsing
from tests.support.sdk_documents import REQUESTS
from tests.support.service_running import CURVE, MAP, PlayedWorker, problem_of

ORBIT = {"omega": 0.27, "clearance": 1.85, "motion": {"period": 1, "stops": [1]}}
PATH = {"omega": 0.29, "clearance": 1.6, "periods": 5}


@pytest.mark.parametrize("process", PROCESSES)
def test_a_new_request_is_201_with_its_job(client: TestClient, process: str) -> None:
    body = MAP if process == "unfolding-diagrams" else REQUESTS[process]  # of several tiles
    answer = client.post(f"/v1/{process}", json=body)
    assert answer.status_code == 201
    job = answer.json()
    assert answer.headers["location"] == f"/v1/jobs/{job['id']}"
    assert (job["process"], job["status"]) == (process, "accepted")
    assert job["progress"]["done"] == 0
    has_steps_after_tiles = process == "unfolding-diagrams"
    assert (job["progress"]["total"] > job["estimate"]["tiles"]) == has_steps_after_tiles
    assert job["progress"]["unit"] == ("steps" if has_steps_after_tiles else "tiles")
    assert {"self", "monitor", "cancel"} <= {link["rel"] for link in job["links"]}
    assert client.get(answer.headers["location"]).json() == job


ZEROS = [0, 0.0, -0.0]


@pytest.mark.parametrize(
    ("process", "forms", "other"),
    [
        (
            "grazing-curves",
            [
                json.dumps({**CURVE, "oscillator": Oscillator().model_dump(), "max_order": 8}),
                '{"max_order": 8, "omega": {"points": 5, "stop": 35e-2, "start": 0.25}, "oscillator": {"contact": 1}}',
                '{"omega":{"start":0.25,"stop":0.35,"points":5},"oscillator":{"forcing":[1,-0.0,0]}}',
            ],
            {**CURVE, "max_order": 9},
        ),
        (
            "trajectories",
            [
                json.dumps({**PATH, **initial})
                for initial in ({}, {"initial": {}}, {"initial": {"phase": 0}}, {"initial": {"displacement": ZEROS}})
            ],
            {**PATH, "initial": {"phase": 1}},
        ),
    ],
)
def test_the_same_request_in_another_form_is_the_same_job(
    client: TestClient, process: str, forms: list[str], other: dict[str, Any]
) -> None:
    headers = {"Content-Type": "application/json"}
    answers = [client.post(f"/v1/{process}", content=body, headers=headers) for body in forms]
    assert [answer.status_code for answer in answers] == [201] + [200] * (len(forms) - 1)
    assert len({answer.json()["id"] for answer in answers}) == 1
    assert client.post(f"/v1/{process}", json=other).status_code == 201


def test_fifty_at_once_are_one_computation(live_url: str, store: Store, worker: Any) -> None:
    # one client for all: each would spend 20 ms on its certificates, in the process of this service
    every = httpx2.Client(timeout=30, limits=httpx2.Limits(max_connections=50))
    with every, ThreadPoolExecutor(50) as pool:
        answers = list(pool.map(lambda _: every.post(f"{live_url}/v1/unfolding-maps", json=MAP), range(50)))
    assert sorted(answer.status_code for answer in answers) == [200] * 49 + [201]
    assert len({answer.json()["id"] for answer in answers}) == 1
    tiles = answers[0].json()["estimate"]["tiles"]
    assert tiles > 1
    assert store.counts().pending_tiles == tiles
    assert len(store.jobs.page()[0]) == 1


def test_a_job_has_notes_on_what_is_probably_not_meant(client: TestClient) -> None:
    body = MAP | {"clearance": {"start": 9.0, "stop": 10.0, "points": 64}}
    submitted = client.post("/v1/unfolding-maps", json=body).json()
    (note,) = submitted["notes"]
    assert note["code"] == "above-grazing-curve"
    assert "the grazing curve, which lies between" in note["detail"]
    assert client.get(f"/v1/jobs/{submitted['id']}").json()["notes"] == submitted["notes"]
    waited = client.post("/v1/unfolding-maps", json=body, headers={"prefer": "wait=1"}).json()
    assert waited["notes"] == submitted["notes"]
    assert client.post("/v1/unfolding-maps", json=MAP).json()["notes"] == []


@pytest.mark.parametrize(("given", "code"), [({"units": "SI"}, "default-restitution"), ({}, "units-left-out")])
def test_notes_on_what_a_request_leaves_out_are_in_the_answer_to_it_alone(
    client: TestClient, given: dict[str, str], code: str
) -> None:
    machine = {"masses": [2.0], "stiffnesses": [800.0], "damping": [1.6], "forcing": [12.0]}
    body = {"oscillator": machine | given, "omega": [15.0, 20.0, 25.0]}

    def noted(body: Any, path: str = "", **headers: str) -> list[str]:
        answer = client.post(f"/v1/grazing-curves{path}", json=body, headers=headers).json()
        return [note["code"] for note in answer["notes"]]

    assert noted(body, "/estimate") == [code]
    # new, known, and waited for
    assert noted(body) == noted(body) == noted(body, prefer="wait=1, return=representation") == [code]
    (job,) = client.get("/v1/jobs").json()["jobs"]
    assert client.get(f"/v1/jobs/{job['id']}").json()["notes"] == []
    # a client that says them itself sends the defaults
    assert noted(parse_request("grazing-curves", body).canonical()) == []


def test_a_job_waits_unbound_until_there_is_a_worker_and_is_queued_for_it(client: TestClient, store: Store) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    assert store.redis.hget(job_key(job["id"]), "fingerprint") == b""
    assert not store.redis.keys("rq:queue:*")
    PlayedWorker(store).register()
    job = client.post("/v1/grazing-curves", json={**CURVE, "max_order": 9}).json()
    assert store.redis.hget(job_key(job["id"]), "fingerprint") == b"f00d"
    assert set(store.tiles.waiting("f00d")) == {("small", "curves")}
    assert wake_ups.queue(store.redis, "f00d", small=True).count == 1
    client.post("/v1/unfolding-maps", json=MAP)
    assert wake_ups.queue(store.redis, "f00d", small=False).count == 1


def test_the_result_itself_is_the_answer_where_it_is_preferred(client: TestClient, worker: Any) -> None:
    path = client.post("/v1/grazing-curves", json=CURVE).headers["location"]
    data = worker.finish(path.rpartition("/")[2])
    prefer = {"Prefer": "return=representation, wait=5"}
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={**prefer, "Accept": "application/x-npz"})
    assert (answer.status_code, answer.content) == (200, data)
    assert answer.headers["preference-applied"] == "wait=5, return=representation"
    assert (answer.headers["location"], answer.headers["content-location"]) == (path, f"{path}/result")
    answer = client.post("/v1/grazing-curves", json=CURVE, headers=prefer)
    assert answer.json() == client.get(f"{path}/result").json()


def test_without_a_result_in_time_the_job_is_the_answer(client: TestClient, worker: Any) -> None:
    answer = client.post("/v1/unfolding-maps", json=MAP, headers={"Prefer": "return=representation, wait=0"})
    assert (answer.status_code, answer.json()["status"]) == (201, "accepted")
    assert answer.headers["preference-applied"] == "wait=0"


@pytest.mark.parametrize(("priority", "status"), [("0", 201), ("9", 200), ("10", 422), ("-1", 422), ("high", 422)])
def test_a_priority_is_no_part_of_the_id(client: TestClient, worker: Any, priority: str, status: int) -> None:
    if status == 200:
        client.post("/v1/grazing-curves", json=CURVE)
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={"Priority": priority})
    assert answer.status_code == status
    if status == 422:
        (error,) = answer.json()["errors"]
        assert (error["pointer"], error["allowed"]) == ("?priority", "0 to 9")


def test_the_priority_that_browsers_send_is_ignored(client: TestClient) -> None:
    assert client.post("/v1/grazing-curves", json=CURVE, headers={"Priority": "u=1, i"}).status_code == 201


def test_prefer_wait_answers_at_the_end(client: TestClient, worker: Any) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    finisher = Thread(target=lambda: (time.sleep(0.2), worker.finish(job["id"])))
    finisher.start()
    began = time.monotonic()
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={"Prefer": "respond-async, wait=20"})
    finisher.join()
    assert 0.1 < time.monotonic() - began < 15
    assert answer.json()["status"] == "successful"
    assert answer.headers["preference-applied"] == "wait=20"


def test_a_job_that_is_removed_during_the_wait_has_its_last_status(
    client: TestClient, worker: Any, store: Store
) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()

    def end_and_remove() -> None:
        time.sleep(0.2)
        pipeline = store.redis.pipeline()  # in one step, so that the service cannot read the record between them
        message = "\n".join((job["id"], "", "done", json.dumps({"status": "failed"})))
        pipeline.publish(EVENTS_CHANNEL, message).delete(job_key(job["id"])).execute()

    remover = Thread(target=end_and_remove)
    remover.start()
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={"Prefer": "wait=20"})
    remover.join()
    assert answer.json()["status"] == "failed"


def test_prefer_wait_gives_up_after_its_time_and_does_not_read_the_request_repeatedly(
    client: TestClient, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    reads = []
    whole = Jobs.get
    monkeypatch.setattr(Jobs, "get", lambda self, *asked: reads.append(asked) or whole(self, *asked))
    began = time.monotonic()
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={"Prefer": "wait=1"})
    assert 0.9 < time.monotonic() - began < 10
    assert (answer.status_code, answer.json()["status"]) == (201, "accepted")
    assert answer.headers["preference-applied"] == "wait=1"
    assert len(reads) <= 2  # once as submitted, once at the end; it was 100 times in this second


def test_prefer_is_bounded_ignored_when_strange_and_may_be_repeated(serve: Any) -> None:
    client = serve(max_wait_seconds=0)
    for prefer, applied in (
        (["wait=3600"], "wait=0"),
        (["wait=x"], None),
        (["waiting=5"], None),
        (["respond-async", "wait=7"], "wait=0"),
    ):
        answer = client.post(
            "/v1/grazing-curves", json=CURVE, headers=[("Prefer", preference) for preference in prefer]
        )
        assert answer.status_code in (200, 201)
        assert answer.headers.get("preference-applied") == applied


def test_a_full_queue_is_429_and_leaves_nothing(serve: Any, store: Store) -> None:
    client = serve(max_pending_tiles=4)
    assert client.post("/v1/grazing-curves", json=CURVE).status_code == 201
    answer = client.post("/v1/unfolding-maps", json=MAP)
    problem_of(answer, 429, "queue-full")
    assert int(answer.headers["retry-after"]) >= 1
    assert len(store.jobs.page()[0]) == 1
    # what is there already is still answered
    assert client.post("/v1/grazing-curves", json=CURVE).status_code == 200


def test_a_finished_request_is_200_with_its_result(client: TestClient, worker: Any) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    worker.finish(job["id"])
    answer = client.post("/v1/grazing-curves", json=CURVE)
    assert (answer.status_code, answer.json()["status"]) == (200, "successful")
    results = [link for link in answer.json()["links"] if link["rel"].endswith("/results")]
    assert {client.get(link["href"]).headers["content-type"] for link in results} == {link["type"] for link in results}


def test_a_dismissed_request_is_started_again(client: TestClient) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    assert client.delete(f"/v1/jobs/{job['id']}").json()["status"] == "dismissed"
    answer = client.post("/v1/grazing-curves", json=CURVE)
    assert (answer.status_code, answer.json()["status"]) == (201, "accepted")
    assert answer.json()["id"] == job["id"]


def test_logs_carry_request_and_job(client: TestClient, logs: list[Any]) -> None:
    answer = client.post("/v1/grazing-curves", json=CURVE, headers={"X-Request-Id": "mine-42"})
    assert answer.headers["x-request-id"] == "mine-42"
    for event in ("job accepted", "request"):
        (entry,) = [entry for entry in logs if entry["event"] == event]
        assert entry["request_id"] == "mine-42"
    (entry,) = [entry for entry in logs if entry["event"] == "job accepted"]
    assert entry["job_id"] == answer.json()["id"]


@pytest.mark.parametrize("sent", ["a b", "x" * 65, "<script>", ""])
def test_a_strange_request_id_is_replaced(client: TestClient, sent: str) -> None:
    request_id = client.get("/healthz", headers={"X-Request-Id": sent}).headers["x-request-id"]
    assert request_id != sent
    assert len(request_id) == 16


def test_a_request_is_parsed_canonicalised_and_hashed_once(client: TestClient, monkeypatch: pytest.MonkeyPatch) -> None:
    bodies, hashes = [], []
    read, hashed = JsonRequest.json, jobs.canonical_id
    monkeypatch.setattr(JsonRequest, "json", lambda self: bodies.append(1) or read(self))
    monkeypatch.setattr(jobs, "canonical_id", lambda *arguments: hashes.append(1) or hashed(*arguments))
    counts = parsing.count(monkeypatch)
    assert client.post("/v1/unfolding-diagrams", json=MAP).status_code == 201
    assert counts == {"parsed": 0, "canonicalised": 1}  # the body is parsed by the route
    assert (len(bodies), len(hashes)) == (1, 1)


def test_the_parts_of_a_diagrams_request_are_made_once() -> None:
    request = UnfoldingDiagramsRequest.model_validate(MAP)
    for name in ("unfolding_map", "grazing_curve", "codimension_two_points", "bifurcation_curves"):
        assert getattr(request, name) is getattr(request, name)
    assert request.canonical() == UnfoldingDiagramsRequest.model_validate(MAP).canonical()
    assert request == UnfoldingDiagramsRequest.model_validate(MAP)


def test_an_estimate_says_that_kernels_are_compiled_first(client: TestClient, store: Store) -> None:
    chain = {"masses": [1, 2], "stiffnesses": [1, 2], "forcing": [1, 0]}
    observed = MAP | {"observables": ["rms_displacement"]}

    def noted(process: str, body: dict[str, Any]) -> list[str]:
        notes = client.post(f"/v1/{process}/estimate", json=body).json()["notes"]
        return [note["detail"] for note in notes if note["code"] == "compiles-first"]

    store.workers.renew(WorkerInfo("w", "f00d", core_version(), frozenset({"curves", "maps"})), 60)
    store.workers.set_waits({"map_observables": 48.3, "orbits": 1.0})
    (detail,) = noted("unfolding-maps", observed)
    assert detail.startswith("kernels are compiled first, usually in about 48 s")
    assert noted("unfolding-maps", MAP) == []
    assert noted("unfolding-maps", MAP | {"oscillator": chain}) == []
    assert noted("grazing-curves", CURVE | {"oscillator": chain}) == []
    assert noted("periodic-orbits", ORBIT) == []  # they are loaded by now
    store.workers.renew(WorkerInfo("w", "f00d", core_version(), frozenset({"curves", "maps", "map_observables"})), 60)
    assert noted("unfolding-maps", observed) == []


def test_an_estimate_is_that_of_the_job_and_submits_nothing(client: TestClient) -> None:
    body = MAP | {"clearance": {"start": 9.0, "stop": 10.0, "points": 64}}
    forecast = client.post("/v1/unfolding-maps/estimate", json=body)
    assert forecast.status_code == 200
    assert client.get("/v1/jobs").json()["jobs"] == []
    job = client.post("/v1/unfolding-maps", json=body).json()
    assert forecast.json() == {**job["estimate"], "notes": job["notes"]}
    refused = client.post("/v1/unfolding-maps/estimate", json=MAP | {"max_periods": 0})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/max_periods"
    huge = MAP | {"omega": {"start": 0.2, "stop": 0.3, "points": 10**9}}
    assert client.post("/v1/unfolding-maps/estimate", json=huge).json()["type"].endswith("too-much-work")

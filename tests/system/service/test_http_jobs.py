"""The job list, dismissal, and the events of a job."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack
from threading import Thread
from typing import Any

import httpx2
import numpy as np
import pytest
from starlette.testclient import TestClient

from grazemap.codec import encode_npz
from grazemap_service.routers import events as events_router
from grazemap_worker.store import ASSEMBLY, Store, WorkerInfo, core_version
from grazemap_worker.store.keys import PREFIX
from tests.support.service_running import CURVE, FINGERPRINT, MAP


def post(client: TestClient, points: int) -> str:
    body = {"omega": {"start": 0.25, "stop": 0.35, "points": points}}
    job_id: str = client.post("/v1/grazing-curves", json=body).json()["id"]
    return job_id


def test_jobs_are_listed_newest_first_in_pages(client: TestClient) -> None:
    ids = [post(client, points) for points in range(2, 9)]
    seen, path, pages = [], "/v1/jobs?limit=3", 0
    while path:
        page = client.get(path).json()
        pages += 1
        seen += [job["id"] for job in page["jobs"]]
        path = next((link["href"] for link in page["links"] if link["rel"] == "next"), "")
    assert (seen, pages) == (ids[::-1], 3)


def test_the_list_can_be_filtered(client: TestClient, worker: Any) -> None:
    curve, other = post(client, 2), post(client, 3)
    whole = client.post("/v1/unfolding-maps", json=MAP).json()["id"]
    worker.finish(curve)

    def listed(query: str) -> list[str]:
        return [job["id"] for job in client.get(f"/v1/jobs?{query}").json()["jobs"]]

    assert listed("status=successful") == [curve]
    assert listed("status=accepted") == [whole, other]
    assert listed("process=unfolding-maps") == [whole]
    assert listed("process=trajectories") == []


def test_dismissing_frees_the_queue_and_is_idempotent(client: TestClient, store: Store, worker: Any) -> None:
    job = client.post("/v1/unfolding-maps", json=MAP).json()
    assert set(store.tiles.waiting("f00d")) == {("short", "maps")}
    for _ in range(2):
        answer = client.delete(f"/v1/jobs/{job['id']}")
        assert (answer.status_code, answer.json()["status"]) == (200, "dismissed")
    assert set(store.tiles.waiting("f00d")) == set()
    assert store.counts().pending_tiles == 0


def test_a_job_goes_on_for_others_who_asked_for_it(client: TestClient, worker: Any) -> None:
    for requester in ("one", "two"):
        path = client.post("/v1/unfolding-maps", json=MAP, headers={"Grazemap-Client": requester}).headers["location"]
    left = client.delete(path, headers={"Grazemap-Client": "one"}).json()
    assert left["status"] == "accepted"
    assert [note["code"] for note in left["notes"]] == ["goes-on"]
    assert client.delete(path, headers={"Grazemap-Client": "two"}).json()["status"] == "dismissed"
    client.post("/v1/unfolding-maps", json=MAP, headers={"Grazemap-Client": "one"})
    assert client.delete(f"{path}?for=all", headers={"Grazemap-Client": "two"}).json()["status"] == "dismissed"


def test_lists_of_jobs_select_groups_and_classes(client: TestClient, worker: Any) -> None:
    def ids(**selected: Any) -> list[str]:
        return [job["id"] for job in client.get("/v1/jobs", params=selected).json()["jobs"]]

    in_group = {"Grazemap-Group": "night"}
    map_job = client.post("/v1/unfolding-maps", json=MAP, headers=in_group).json()
    assert map_job["groups"] == ["night"]
    curves = [post(client, points) for points in range(3, 63)]
    assert map_job["id"] not in ids()
    assert ids(small=False) == ids(group="night") == [map_job["id"]]
    assert len(ids(small=True, limit=500)) == 60
    assert ids(group="nigh") == []
    # it belongs to all that asked for it, also when it is finished
    worker.finish(curves[0])
    client.post("/v1/grazing-curves", json={"omega": {**CURVE["omega"], "points": 3}}, headers=in_group)
    assert ids(group="night") == [curves[0], map_job["id"]]
    for number in range(12):
        job = client.post("/v1/unfolding-maps", json=MAP, headers={"Grazemap-Group": f"g{number}"}).json()
    assert job["groups"] == [f"g{number}" for number in range(4, 12)]
    client.delete(f"/v1/jobs/{job['id']}?for=all")
    again = client.post("/v1/unfolding-maps", json=MAP, headers=in_group).json()
    assert (again["status"], again["groups"][-1]) == ("accepted", "night")
    page = client.get("/v1/jobs", params={"small": True, "limit": 10}).json()
    following = next(link["href"] for link in page["links"] if link["rel"] == "next")
    assert "small=true" in following
    assert client.get(following).json()["jobs"][0]["id"] == curves[-11]
    assert client.get("/v1/jobs?group=a b").status_code == 422


def test_an_unreadable_record_hides_no_other_job(client: TestClient, store: Store) -> None:
    good, bad = post(client, 2), post(client, 3)
    store.redis.hset(f"{PREFIX}job:{bad}", "estimate", "not an estimate")
    assert [job["id"] for job in client.get("/v1/jobs").json()["jobs"]] == [good]
    assert client.get(f"/v1/jobs/{bad}").status_code == 404
    assert 'grazemap_events_total{kind="poisoned:records"} 1.0' in client.get("/metrics").text
    assert post(client, 3) == bad
    assert client.get(f"/v1/jobs/{bad}").json()["status"] == "accepted"


def test_a_long_stream_is_sent_whole(client: TestClient, store: Store) -> None:
    job = post(client, 3)
    for number in range(1200):
        store.redis.xadd(f"{PREFIX}job:{job}:events", {"name": "tile", "data": f'{{"index":{number}}}'})
    client.delete(f"/v1/jobs/{job}")
    lines = client.get(f"/v1/jobs/{job}/events").text.splitlines()
    assert [line for line in lines if "index" in line] == [f'data: {{"index":{number}}}' for number in range(1200)]
    assert lines.count("event: done") == 1


def test_one_reader_of_redis_feeds_all_streams(live_url: str, store: Store, worker: Any) -> None:
    job = httpx2.post(f"{live_url}/v1/unfolding-maps", json=MAP).json()
    with ExitStack() as stack:
        client = stack.enter_context(httpx2.Client(timeout=20, limits=httpx2.Limits(max_connections=100)))
        streams = [
            stack.enter_context(client.stream("GET", f"{live_url}/v1/jobs/{job['id']}/events")) for _ in range(30)
        ]
        readers = [stream.iter_lines() for stream in streams]
        for reader in readers:
            next(reader)
        store.redis.config_resetstat()
        worker.commit(job["id"], b"", 0)
        for reader in readers:
            assert any(line == "event: tile" for line in reader)
        assert store.redis.info("commandstats").get("cmdstat_xrange", {"calls": 0})["calls"] < 30
        httpx2.delete(f"{live_url}/v1/jobs/{job['id']}")
        assert all("event: done" in list(reader) for reader in readers)


def test_a_finished_job_is_left_as_it_is(client: TestClient, worker: Any) -> None:
    job_id = post(client, 2)
    worker.finish(job_id)
    answer = client.delete(f"/v1/jobs/{job_id}")
    assert (answer.status_code, answer.json()["status"]) == (200, "successful")
    assert client.get(f"/v1/jobs/{job_id}/result").status_code == 200


Events = list[tuple[str, str, dict[str, Any]]]


def parse(text: str) -> Events:
    """Return (id, name, data) of each event."""
    events = []
    for block in text.strip().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if not line.startswith(":"))
        if fields:
            events.append((fields.get("id", ""), fields["event"], json.loads(fields["data"])))
    return events


def test_events_follow_a_map_to_its_end(client: TestClient, store: Store, worker: Any) -> None:
    job = client.post("/v1/unfolding-maps", json=MAP).json()
    path, total = f"/v1/jobs/{job['id']}/events", job["estimate"]["tiles"]
    data = encode_npz({"kind": np.zeros((2, 2), np.int8)}, {})

    def work() -> None:
        for tile in range(total):
            time.sleep(0.002)
            worker.commit(job["id"], data, tile)
        worker.commit(job["id"], data, ASSEMBLY)

    thread = Thread(target=work)
    thread.start()
    answer = client.get(path)
    thread.join()
    assert answer.headers["content-type"].startswith("text/event-stream")
    events = parse(answer.text)
    assert [event[2]["index"] for event in events if event[1] == "tile"] == list(range(total))
    done = [event[2]["done"] for event in events if event[1] == "progress"]
    assert done == sorted(done)
    assert done[-1] == total
    assert events[-1][1:] == ("done", {"status": "successful"})
    assert [event[1] for event in events].count("done") == 1

    # resumed anywhere, the rest comes
    for place in (0, len(events) // 2, len(events) - 2):
        resumed = client.get(path, headers={"Last-Event-ID": events[place][0]})
        assert parse(resumed.text) == events[place + 1 :]
    # after the last one there is only the end to tell
    again = parse(client.get(path, headers={"Last-Event-ID": events[-1][0]}).text)
    assert [event[1:] for event in again] == [("done", {"status": "successful"})]


def waiting_for(client: TestClient, job_id: str) -> str | None:
    text: str | None = client.get(f"/v1/jobs/{job_id}").json()["waiting_for"]
    return text


def test_an_unfinished_job_says_what_it_waits_for(client: TestClient, store: Store, worker: Any) -> None:
    first, second, third = (post(client, points) for points in (2, 3, 4))
    assert waiting_for(client, first) == "a worker; none is ready"  # it takes no small jobs
    store.workers.renew(WorkerInfo("small", FINGERPRINT, core_version(), small=True), 60)
    assert waiting_for(client, first) == "a free worker; 2 other jobs are unfinished"
    assert waiting_for(client, second) == "a free worker; 2 other jobs are unfinished"
    worker.begin(first)
    assert waiting_for(client, first) is None
    store.workers.set_compiling("curves", "kernels, compiling for 4 s")
    assert waiting_for(client, third) == "kernels, compiling for 4 s"
    store.workers.set_compiling("curves", "")
    worker.finish(first)
    assert waiting_for(client, first) is None
    assert waiting_for(client, second) == "a free worker; 1 other job is unfinished"


def test_a_job_without_workers_says_so(client: TestClient, store: Store) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    assert job["waiting_for"] == "a worker; none is ready"
    store.workers.set_starting("compiling kernels, step 2 of 4, about 30 s")
    expected = "a worker; none is ready: compiling kernels, step 2 of 4, about 30 s"
    assert waiting_for(client, job["id"]) == expected
    store.workers.set_starting("")
    client.delete(f"/v1/jobs/{job['id']}")
    assert waiting_for(client, job["id"]) is None


def test_what_a_job_waits_for_is_an_event_without_an_id(
    live_url: str, store: Store, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(events_router, "_LOOK_SECONDS", 0.01)
    job = httpx2.post(f"{live_url}/v1/unfolding-maps", json=MAP).json()
    reasons = []
    with httpx2.stream("GET", f"{live_url}/v1/jobs/{job['id']}/events", timeout=10) as stream:
        store.workers.set_compiling("maps", "the compilation")
        for line in stream.iter_lines():
            if line.startswith("data:") and "waiting_for" in line:
                reasons.append(json.loads(line.removeprefix("data:"))["waiting_for"])
                store.workers.set_compiling("maps", "")
            if len(reasons) == 2:
                break
    assert reasons == ["the compilation", None]
    httpx2.delete(f"{live_url}/v1/jobs/{job['id']}")
    names = {event[1] for event in parse(httpx2.get(f"{live_url}/v1/jobs/{job['id']}/events").text)}
    assert names == {"progress", "done"}


def test_events_end_when_the_job_is_dismissed(live_url: str) -> None:
    job = httpx2.post(f"{live_url}/v1/unfolding-maps", json=MAP).json()
    with httpx2.stream("GET", f"{live_url}/v1/jobs/{job['id']}/events", timeout=10) as stream:
        lines = stream.iter_lines()
        first = next(line for line in lines if line.startswith("event:"))
        assert first == "event: progress"  # it is there before the job has begun
        httpx2.delete(f"{live_url}/v1/jobs/{job['id']}")
        rest = list(lines)  # it does not wait for its timeout
    assert "event: done" in rest
    assert 'data: {"status":"dismissed"}' in rest


def test_a_broken_stream_does_no_harm(live_url: str) -> None:
    job = httpx2.post(f"{live_url}/v1/grazing-curves", json=CURVE).json()
    for _ in range(5):
        with httpx2.stream("GET", f"{live_url}/v1/jobs/{job['id']}/events", timeout=10) as stream:
            next(stream.iter_lines())
    assert httpx2.get(f"{live_url}/healthz").status_code == 200


@pytest.mark.parametrize("sent", ["x", "1-2-3", "-1", "9" * 25, "1-" + "9" * 25, "18446744073709551616-0"])
def test_a_strange_last_event_id_is_422(client: TestClient, sent: str) -> None:
    job_id = post(client, 2)
    answer = client.get(f"/v1/jobs/{job_id}/events", headers={"Last-Event-ID": sent})
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert sent not in answer.text.replace("problem", "")

"""A data folder of version 0.1.0: its jobs are listed, and computed again when they are fetched."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from grazemap_service.app import create_app
from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import Settings
from grazemap_worker.numerics import Numerics
from grazemap_worker.store import Store, connect, core_version, keys
from grazemap_worker.supervision.reconciler import Reconciler
from tests.older_data import BEGUN, DISMISSED, FINISHED, PREFIX, QUEUED, unpack
from tests.service.conftest import PlayedWorker

NEW = keys.PREFIX
NUMERICS = Numerics("0", "0", "0", "0", "planted", "none", "f00d")


@pytest.fixture
def older_server(tmp_path: Path) -> Iterator[RedisServer]:
    """A Redis on the data of version 0.1.0."""
    with RedisServer(unpack(tmp_path) / "redis") as server:
        yield server


@pytest.fixture
def older(older_server: RedisServer) -> Store:
    """The store on it."""
    return Store(connect(older_server.url))


@pytest.fixture
def client_of_older(older_server: RedisServer, older: Store) -> Iterator[TestClient]:
    """A client of a service on it, after the first round of the workers' reconciler."""
    Reconciler(older, NUMERICS, "one").reconcile()
    settings = Settings(redis_url=older_server.url)
    with TestClient(create_app(settings), base_url="http://127.0.0.1", client=("127.0.0.1", 50000)) as client:
        yield client


def test_its_jobs_are_listed(client_of_older: TestClient) -> None:
    jobs = client_of_older.get("/v1/jobs").json()["jobs"]
    assert [(job["id"], job["status"]) for job in jobs] == [
        (DISMISSED, "dismissed"),
        (BEGUN, "failed"),
        (QUEUED, "failed"),
        (FINISHED, "successful"),
    ]
    assert {job["core_version"] for job in jobs} == {"0.1.0"}
    for job in jobs[1:3]:
        assert job["problem"]["type"] == "urn:grazemap:problem:core-outdated"
        assert "post its request again" in job["problem"]["detail"]
        assert job["finished"] is not None
    finished = jobs[3]
    assert finished["cpu_seconds"] == 0.125
    assert finished["request"]["omega"]["points"] == 200
    assert finished["progress"] == {"done": 1, "total": 1, "unit": "tiles", "eta_seconds": None}
    assert client_of_older.get(f"/v1/jobs/{FINISHED}").json()["created"] == finished["created"]
    assert "event: done" in client_of_older.get(f"/v1/jobs/{FINISHED}/events").text


def test_its_result_is_computed_anew(
    client_of_older: TestClient, older: Store, logs: list[MutableMapping[str, Any]]
) -> None:
    path = f"/v1/jobs/{FINISHED}/result"
    assert client_of_older.head(path).status_code == 202
    assert older.counts().pending_tiles == 0
    answer = client_of_older.get(path, headers={"If-None-Match": "*"})
    assert answer.status_code == 202
    anew = answer.json()
    assert anew["id"] != FINISHED
    assert answer.headers["location"] == f"/v1/jobs/{anew['id']}"
    assert (anew["core_version"], anew["status"]) == (core_version(), "accepted")
    assert any(entry.get("outdated_job") == FINISHED for entry in logs)
    worker = PlayedWorker(older)
    worker.register()
    data = worker.finish(anew["id"])
    assert client_of_older.get(f"/v1/jobs/{anew['id']}/result?f=npz").content == data
    assert client_of_older.get(path).json()["id"] == anew["id"]


def test_an_unfinished_job_is_computed_anew_when_it_is_posted_again(client_of_older: TestClient) -> None:
    job = client_of_older.get(f"/v1/jobs/{QUEUED}").json()
    answer = client_of_older.post("/v1/unfolding-maps", json=job["request"])
    assert answer.status_code == 201
    assert answer.json()["core_version"] == core_version()
    assert answer.json()["id"] != QUEUED


def test_a_request_that_is_no_longer_accepted_is_a_problem_of_its_own(
    client_of_older: TestClient, older: Store
) -> None:
    older.redis.hset(f"{NEW}job:{FINISHED}", "request", '{"a field of then": 1}')
    answer = client_of_older.get(f"/v1/jobs/{FINISHED}/result")
    assert answer.status_code == 409
    assert answer.json()["type"] == "urn:grazemap:problem:outdated-job"


def test_nothing_else_of_it_remains(older: Store, logs: list[MutableMapping[str, Any]]) -> None:
    assert older.redis.llen("rq:queue:grazemap:7d5d23b1059f40d0") == 2
    assert Reconciler(older, NUMERICS, "one").reconcile() == set()
    found = [key.decode() for key in older.redis.scan_iter("*")]
    assert [key for key in found if not key.startswith(NEW) and not key.startswith("rq:")] == []
    assert [key for key in found if "7d5d23b1059f40d0" in key or key.startswith("rq:job:")] == []
    taken_over = [entry for entry in logs if "taken over" in entry["event"]]
    assert [(entry["jobs"], entry["unfinished"]) for entry in taken_over] == [(4, 2)]
    assert older.counts().results == older.counts().pending_tiles == 0
    assert Reconciler(older, NUMERICS, "one").reconcile() == set()
    assert len(older.jobs.page()[0]) == 4


def test_it_is_left_alone_while_one_of_its_workers_is_alive(older: Store) -> None:
    older.redis.hset(f"{PREFIX}workers", "old", "{}")
    older.redis.set(f"{PREFIX}worker:old", "7d5d23b1059f40d0")
    before = sorted(older.redis.scan_iter(f"{PREFIX}[a-z]*"))
    Reconciler(older, NUMERICS, "one").reconcile()
    assert sorted(older.redis.scan_iter(f"{PREFIX}[a-z]*")) == before
    assert older.jobs.page()[0] == []
    older.redis.delete(f"{PREFIX}worker:old")
    Reconciler(older, NUMERICS, "one").reconcile()
    assert len(older.jobs.page()[0]) == 4


def test_taking_over_can_be_interrupted(older: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.store.older_layouts._JOBS_A_SCRIPT", 1)
    scripts = older.older_layouts._scripts
    assert scripts.run("adopt", old=PREFIX, most=1, problem="{}") == [1, 0, 3]
    assert older.older_layouts.abandoned() == [PREFIX]
    assert older.older_layouts.adopt(PREFIX) == (3, 2)
    assert older.older_layouts.abandoned() == []
    assert [job.id for job in older.jobs.page()[0]] == [DISMISSED, BEGUN, QUEUED, FINISHED]

"""Operating the service: health, readiness, metrics, Redis that goes and comes back, start and refusal to start."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest
import redis.exceptions
from starlette.testclient import TestClient

from grazemap.codec import encode_npz
from grazemap.wire import PROCESSES
from grazemap_service import __main__ as service_program
from grazemap_service.redis_server import RedisServer
from grazemap_service.routers.docs import GUIDE
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store, WorkerInfo, core_version
from grazemap_worker.store.keys import PREFIX
from grazemap_worker.system import not_kept
from tests.support.service_running import CURVE, MAP, problem_of, running


def test_ready_says_how_many_workers_there_are_and_what_those_do_that_are_not(client: TestClient, worker: Any) -> None:
    assert client.get("/healthz").json() == {"status": "ok"}
    assert client.head("/healthz").status_code == 200
    assert client.get("/readyz").json() == {"status": "ready", "workers": 1, "detail": "", "not_kept": not_kept()}
    worker.store.redis.flushall()
    nobody = {"status": "ready", "workers": 0, "detail": "No worker is alive yet.", "not_kept": not_kept()}
    assert client.get("/readyz").json() == nobody
    worker.store.workers.set_starting("compiling kernels, step 2 of 4, about 9 s")
    assert client.get("/readyz").json()["detail"] == "Compiling kernels, step 2 of 4, about 9 s."
    worker.store.workers.set_starting("")
    worker.store.workers.renew(WorkerInfo("of another release", "f", "another"), 60)
    assert client.get("/readyz").json() == nobody
    worker.store.workers.renew(WorkerInfo("for small tiles", "f", core_version(), small=True), 60)
    answer = client.get("/readyz").json()
    assert answer["workers"] == 0
    assert answer["detail"] != nobody["detail"]


@pytest.mark.parametrize("is_built", [True, False])
def test_the_root_describes_the_service(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, is_built: bool
) -> None:
    (tmp_path / "index.html").touch()
    folder = tmp_path if is_built else tmp_path / "none"
    monkeypatch.setattr(GUIDE, "directory", folder)
    monkeypatch.setattr(GUIDE, "all_directories", [folder])
    described = client.get("/v1").json()
    assert described["name"] == "grazemap"
    assert [process["href"] for process in described["processes"]] == [f"/v1/{process}" for process in PROCESSES]
    assert described["limits"]["masses"] == 64
    assert any(link["rel"] == "help" for link in described["links"]) is is_built
    for link in described["links"]:
        assert client.get(link["href"]).status_code == 200


def test_metrics_count_by_route(fresh_client: TestClient, worker: Any) -> None:
    client = fresh_client
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    for _ in range(3):
        client.get(f"/v1/jobs/{job['id']}")
    client.get("/nothing/here")
    text = client.get("/metrics").text
    assert 'grazemap_http_requests_total{method="GET",route="/v1/jobs/{job_id}",status="200"} 3.0' in text
    assert 'grazemap_http_requests_total{method="GET",route="unmatched",status="404"} 1.0' in text
    assert 'grazemap_jobs{status="accepted"} 1.0' in text
    assert "grazemap_pending_tiles 1.0" in text
    assert "grazemap_workers 1.0" in text
    assert "grazemap_store_up 1.0" in text
    assert re.search(r'grazemap_http_request_seconds_count\{method="POST",route="/v1/grazing-curves"\} 1.0', text)
    assert job["id"] not in text


def metric(client: TestClient, name: str) -> float:
    match = re.search(rf"^{re.escape(name)} (\S+)$", client.get("/metrics").text, re.MULTILINE)
    assert match, name
    return float(match[1])


def test_metrics_say_how_long_tiles_wait_and_are_held(client: TestClient, store: Store) -> None:
    def age(job_id: str, seconds: float) -> None:
        store.redis.zincrby(f"{PREFIX}waiting:short", -seconds, job_id)

    job_id = client.post("/v1/unfolding-maps", json=MAP).json()["id"]  # there is no worker yet
    age(job_id, 100.0)
    assert metric(client, 'grazemap_waiting_jobs{lane="short"}') == 1
    assert metric(client, 'grazemap_waiting_seconds{lane="short"}') == pytest.approx(100, abs=10)
    worker = WorkerInfo("w", "f", core_version(), frozenset({"curves", "maps"}))
    store.workers.renew(worker, 60)
    store.jobs.bind("f", core_version(), [job_id])
    assert metric(client, 'grazemap_waiting_seconds{lane="short"}') == pytest.approx(100, abs=10)
    claims, _ = store.tiles.claim_next(worker, 60)
    assert [claim.job_id for claim in claims] == [job_id]
    assert metric(client, 'grazemap_waiting_seconds{lane="short"}') < 10  # one of its tiles was taken
    claim = f"{PREFIX}job:{job_id}:claims"
    holder, since = (store.redis.hget(claim, "0") or b"").decode().split("|")  # type: ignore[union-attr]
    store.redis.hset(claim, "0", f"{holder}|{float(since) - 50}")
    assert metric(client, "grazemap_claimed_seconds") == pytest.approx(50, abs=10)
    computes = client.get("/v1/status").json()["workers"][0]["computes"]
    assert (computes["job"], computes["process"], computes["tile"]) == (job_id, "unfolding-maps", 0)
    client.delete(f"/v1/jobs/{job_id}")
    assert metric(client, 'grazemap_waiting_jobs{lane="short"}') == 0
    assert metric(client, "grazemap_claimed_seconds") == 0


def test_metrics_say_what_redis_says_of_its_disk_and_memory(client: TestClient, store: Store) -> None:
    assert metric(client, 'grazemap_store_writes_ok{kind="file"}') == 1
    assert metric(client, "grazemap_store_memory_bytes") > 100_000
    assert metric(client, 'grazemap_events_total{kind="ended:redis"}') == 0  # before there was one
    store.count("ended:redis")
    assert metric(client, 'grazemap_events_total{kind="ended:redis"}') == 1
    assert client.get("/v1/status").json()["events"]["ended:redis"] == 1
    assert "grazemap_result_budget_bytes" not in client.get("/metrics").text
    store.set_budget()
    assert metric(client, "grazemap_result_budget_bytes") == 2 << 30


def test_every_address_that_accepts_get_accepts_head(client: TestClient, worker: Any, store: Store) -> None:
    job = client.post("/v1/unfolding-maps", json=MAP).json()
    path = f"/v1/jobs/{job['id']}"
    worker.commit(job["id"], encode_npz({"kind": np.zeros((2, 2))}, {"tile": {}}), 1)
    jobs = ("/v1/jobs", path, f"{path}/result/tiles", f"{path}/result/tiles/1")
    for address in ("/v1", *jobs, "/metrics", "/healthz", "/v1/status"):
        whole, head = client.get(address), client.head(address)
        assert (whole.status_code, head.status_code, head.content) == (200, 200, b""), address
        assert head.headers["content-type"] == whole.headers["content-type"]
    events = client.head(f"{path}/events")  # the stream of a job that goes on would not end
    assert (events.status_code, events.content) == (200, b"")
    assert events.headers["content-type"].startswith("text/event-stream")
    assert client.head("/v1/jobs/" + "0" * 64 + "/events").status_code == 404


AOF = "MISCONF Errors writing to the AOF file"
RDB = "MISCONF Redis is configured to save RDB snapshots, but it is currently not able to persist on disk."


WRONG_TYPE = "WRONGTYPE Operation against a key holding the wrong kind of value"


@pytest.mark.parametrize(
    ("error", "status", "kind"),
    [
        *(
            (redis.exceptions.ResponseError(f"{code} of some reason"), 503, "store-unavailable")
            for code in ("MISCONF", "LOADING", "READONLY", "BUSY")
        ),
        (redis.exceptions.ResponseError(f"{AOF}: Input/output error"), 503, "store-unavailable"),
        (
            redis.exceptions.ResponseError(f"{AOF}: No space left on device script: 1f, on @user_script:1."),
            507,
            "storage-full",
        ),
        (redis.exceptions.ResponseError(f"{AOF}: Disk quota exceeded"), 507, "storage-full"),
        (redis.exceptions.ResponseError(RDB), 507, "storage-full"),
        (redis.exceptions.ResponseError("ERR Error running script: @x:1: -OOM of some reason"), 507, "storage-full"),
        (redis.exceptions.ResponseError(WRONG_TYPE), 500, "internal-error"),
        (redis.exceptions.AuthenticationError("WRONGPASS"), 503, "store-unavailable"),
    ],
    ids=str,
)
def test_an_error_of_redis_is_the_problem_that_it_means(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, logs: list[Any], error: Exception, status: int, kind: str
) -> None:
    def refuse(*_: object) -> None:
        raise error

    monkeypatch.setattr(client.app.state.context.store.jobs, "submit", refuse)  # type: ignore[attr-defined]
    answer = client.post("/v1/grazing-curves", json=CURVE)
    problem_of(answer, status, kind)
    refused = isinstance(error, redis.exceptions.AuthenticationError)
    assert ("Redis refuses the password" in [entry["event"] for entry in logs]) is refused


def test_a_redis_that_hangs_is_503_and_keeps_no_page_waiting(own_redis_server: RedisServer) -> None:
    # one client for all: each would spend 20 ms on its certificates, in the process of this service
    every = httpx2.Client(timeout=30, limits=httpx2.Limits(max_connections=200))
    with running(ServiceSettings(redis_url=own_redis_server.url)) as url, every, ThreadPoolExecutor(120) as pool:
        every.get(f"{url}/v1/jobs")
        assert own_redis_server.pid is not None
        os.kill(own_redis_server.pid, signal.SIGSTOP)
        try:
            waiting = [pool.submit(every.get, f"{url}/v1/jobs") for _ in range(120)]
            time.sleep(0.5)
            began = time.monotonic()
            assert every.get(f"{url}/docs").status_code == 200
            assert time.monotonic() - began < 2  # it would wait for others that wait for Redis
            assert {future.result().status_code for future in waiting} == {503}
        finally:
            os.kill(own_redis_server.pid, signal.SIGCONT)


def test_the_service_recovers_when_redis_returns(serve: Any, own_redis_server: RedisServer) -> None:
    client = serve(redis_url=own_redis_server.url)
    before = client.post("/v1/grazing-curves", json=CURVE)
    assert before.status_code == 201
    path = before.headers["location"]

    own_redis_server.stop()
    other = {"omega": [0.1, 0.2]}
    began = time.monotonic()
    answers = [
        client.post("/v1/grazing-curves", json=other),
        client.get(path),
        client.get(f"{path}/events"),
        client.get(f"{path}/result"),
        client.delete(path),
        client.get("/v1/jobs"),
        client.get("/readyz"),
    ]
    assert time.monotonic() - began < 10
    for answer in answers:
        problem_of(answer, 503, "store-unavailable")
        assert int(answer.headers["retry-after"]) >= 1
    assert client.get("/healthz").status_code == 200
    assert "grazemap_store_up 0.0" in client.get("/metrics").text
    # bad input is still told from an unavailable store
    assert client.post("/v1/grazing-curves", json={}).status_code == 422

    own_redis_server.start()
    own_redis_server.wait()
    assert client.get(path).status_code == 200  # kept by its append-only file
    assert [job["id"] for job in client.get("/v1/jobs").json()["jobs"]] == [before.json()["id"]]
    assert client.post("/v1/grazing-curves", json=other).status_code == 201


def test_the_service_loads_no_numerics() -> None:
    code = (
        "import sys; from grazemap_service.app import create_app; create_app().openapi(); "
        "print([name for name in ('numba', 'llvmlite', 'scipy', 'matplotlib', 'xarray', 'pandas', "
        "'grazemap_core', 'grazemap_worker.tasks') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "[]"


@contextmanager
def process(environment: dict[str, str], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """``python -m grazemap_service`` with an environment of its own."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("GRAZEMAP_")}
    with subprocess.Popen(
        [sys.executable, "-m", "grazemap_service"],
        env={**clean, **environment},
        stderr=subprocess.PIPE,
        text=True,
        **options,
    ) as started:
        try:
            yield started
        finally:
            started.kill()


def wait_for(url: str, started: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and started.poll() is None:
        try:
            if httpx2.get(url, timeout=1).status_code == 200:
                return
        except httpx2.TransportError:
            time.sleep(0.01)
    raise AssertionError("the service did not answer")


def spent(started: subprocess.Popen[Any]) -> float:
    """Wait for a process, and return its processor time."""
    _, status, usage = os.wait4(started.pid, 0)
    started.returncode = os.waitstatus_to_exitcode(status)
    return usage.ru_utime + usage.ru_stime


def test_it_starts_on_an_inherited_socket_for_little_and_stops_in_order(redis_server: RedisServer) -> None:
    """Processor time until the first answer, beside that of importing the libraries which it needs, in the same run."""
    libraries = "import fastapi, httpx2, numpy, prometheus_client, pydantic_settings, redis, rq, structlog, uvicorn"
    starting, importing = [], []
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}/healthz"
        environment = {"GRAZEMAP_FD": str(listener.fileno()), "GRAZEMAP_REDIS_URL": redis_server.url}
        # a second process takes the same socket over; more of them are measured if other programs disturb the first two
        while len(starting) < 2 or (len(starting) < 5 and sum(starting) >= 2.0 * sum(importing)):
            with process(environment, pass_fds=[listener.fileno()]) as started:
                wait_for(url, started)
                started.terminate()
                assert started.stderr is not None
                lines = [json.loads(line) for line in started.stderr.read().splitlines()]
                assert {"listening", "Application startup complete."} <= {line["event"] for line in lines}
                starting.append(spent(started))
                assert started.returncode in {0, -15}
            with subprocess.Popen([sys.executable, "-c", libraries]) as libraries_alone:
                importing.append(spent(libraries_alone))
    assert sum(starting) < 2.0 * sum(importing)


@dataclass
class PlayedServer:
    """What would serve on a listener."""

    listener: socket.socket
    started: bool = True

    def run(self, sockets: list[socket.socket]) -> None:
        assert sockets == [self.listener]


@pytest.fixture
def servers() -> Iterator[list[PlayedServer]]:
    """What would serve, of the services that `start` has started."""
    made: list[PlayedServer] = []
    yield made
    for server in made:
        server.listener.close()


@pytest.fixture
def start(monkeypatch: pytest.MonkeyPatch, servers: list[PlayedServer]) -> Callable[..., int]:
    """Start the service with an environment of its own, but for serving; return its exit status."""
    for name in [name for name in os.environ if name.upper().startswith("GRAZEMAP_")]:
        monkeypatch.delenv(name)

    def played(_app: object, listener: socket.socket) -> PlayedServer:
        servers.append(PlayedServer(listener))
        return servers[-1]

    monkeypatch.setattr(service_program, "configure", lambda _level: None)
    monkeypatch.setattr(service_program, "bounded_server", played)

    def run(**environment: str) -> int:
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        return service_program.main([])

    return run


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({"GRAZEMAP_HOST": "0.0.0.0"}, "GRAZEMAP_API_KEYS"),
        ({"GRAZEMAP_PORT": "high"}, "GRAZEMAP_PORT"),
        ({"GRAZEMAP_ALLOWED_HOSTS": "maps.example.org"}, "GRAZEMAP_ALLOWED_HOSTS"),
        ({"GRAZEMAP_API_KEYS": "short"}, "GRAZEMAP_API_KEYS"),
        ({"GRAZEMAP_API_KEYS_FILE": "/nowhere/keys"}, "GRAZEMAP_API_KEYS_FILE"),
        ({"GRAZEMAP_LOG_LEVEL": "loud"}, "GRAZEMAP_LOG_LEVEL"),
        ({"GRAZEMAP_CORS_ORIGINS": "localhost:8181"}, "GRAZEMAP_CORS_ORIGINS"),
        ({"GRAZEMAP_CORS_ORIGINS": "http://localhost:8181/page"}, "GRAZEMAP_CORS_ORIGINS"),
    ],
)
def test_it_refuses_to_start_with_bad_settings(
    start: Callable[..., int], capsys: pytest.CaptureFixture[str], environment: dict[str, str], message: str
) -> None:
    assert start(**environment) == 2
    assert message in capsys.readouterr().err


def test_it_refuses_an_exposed_inherited_socket_without_keys() -> None:
    with (
        socket.create_server(("0.0.0.0", 0)) as listener,
        process({"GRAZEMAP_FD": str(listener.fileno())}, pass_fds=[listener.fileno()]) as started,
    ):
        assert started.wait(30) == 2
        assert started.stderr is not None
        assert started.stderr.read().startswith("grazemap_service: refusing to listen on 0.0.0.0")


def test_it_refuses_arguments_and_names_the_command_of_the_stack(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as refused:
        service_program.main(["up"])
    assert refused.value.code == 2
    with pytest.raises(SystemExit):
        service_program.main(["--help"])
    assert "grazemap up" in capsys.readouterr().out


def test_a_port_in_use_is_reported(start: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        assert start(GRAZEMAP_PORT=str(listener.getsockname()[1])) == 1
    assert "cannot listen" in capsys.readouterr().err


def test_small_answers_on_a_kept_connection_do_not_wait_for_acknowledgements(
    start: Callable[..., int], servers: list[PlayedServer]
) -> None:
    """`make latency` measures it: without TCP_NODELAY each answer after the first takes 40 ms."""
    assert start(GRAZEMAP_PORT="0") == 0
    (server,) = servers
    with socket.create_connection(server.listener.getsockname()), server.listener.accept()[0] as accepted:
        assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)

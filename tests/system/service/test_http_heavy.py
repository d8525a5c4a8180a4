"""Large requests, large results, slow clients: the service continues to answer, and its memory is bounded."""

from __future__ import annotations

import contextlib
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx2
import numpy as np
import psutil
import pytest
from starlette.testclient import TestClient

from grazemap.codec import encode_npz
from grazemap.wire import Job
from grazemap_service import representations
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store
from grazemap_worker.store.jobs import Jobs
from tests.support.service_running import CURVE, connect_to, is_closed, running, stalled_reader
from tests.support.watching import until


def long_list(number: int) -> dict[str, Any]:
    return {"omega": [number + 1.0 + place / 4096 for place in range(4000)]}


PLAYED = {"process": "grazing-curves"}


def test_lists_of_jobs_leave_out_long_requests(client: TestClient) -> None:
    for number in range(5):
        assert client.post("/v1/grazing-curves", json=long_list(number)).status_code == 201
    short = client.post("/v1/grazing-curves", json=CURVE).json()
    answer = client.get("/v1/jobs")
    assert len(answer.content) < 12_000
    jobs = answer.json()["jobs"]
    assert [job["request"] is None for job in jobs] == [False, True, True, True, True, True]
    assert jobs[0] == {**short, "waiting_for": None}
    assert len(client.get(f"/v1/jobs/{jobs[1]['id']}").json()["request"]["axis"]["values"]) == 4000


def test_an_event_stream_does_not_read_the_request_repeatedly(
    serve: Any, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = serve()
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    reads = []
    whole = Jobs.get

    def get(self: Jobs, identity: str, requester: str = "", *, with_request: bool = True) -> Job | None:
        if with_request:
            reads.append(identity)
        return whole(self, identity, requester, with_request=with_request)

    monkeypatch.setattr(Jobs, "get", get)
    finisher = threading.Thread(target=lambda: (time.sleep(0.5), worker.finish(job["id"])))
    finisher.start()
    assert "event: done" in client.get(f"/v1/jobs/{job['id']}/events").text
    finisher.join()
    assert len(reads) == 1


def test_simultaneous_requests_share_one_rendering(
    fresh_client: TestClient, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = fresh_client
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    worker.finish(job["id"])
    rendered = []
    render = representations.render

    def slow(npz: bytes, name: str, table: str) -> bytes:
        rendered.append(name)
        time.sleep(0.1)
        return render(npz, name, table)

    monkeypatch.setattr(representations, "render", slow)
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: client.get(f"/v1/jobs/{job['id']}/result"), range(8)))
    assert {answer.status_code for answer in answers} == {200}
    assert len({answer.content for answer in answers}) == 1
    assert rendered == ["json"]


def test_a_large_result_is_streamed_as_json(client: TestClient, worker: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    path, plain = f"/v1/jobs/{job['id']}/result", {"Accept-Encoding": "identity"}
    worker.finish(job["id"], {"omega": np.random.default_rng(1).random(20_000)})
    small = client.get(path, headers=plain)
    assert "content-length" in small.headers
    monkeypatch.setattr(representations, "LARGE_BYTES", 10_000)
    client.app.state.context.representations._entries.clear()  # type: ignore[attr-defined]
    large = client.get(path, headers=plain)
    assert "content-length" not in large.headers
    assert large.content == small.content
    assert large.headers["etag"] == small.headers["etag"]
    assert client.get(path, headers={"If-None-Match": large.headers["etag"]}).status_code == 304


def test_fetching_a_result_delays_its_eviction(client: TestClient, worker: Any) -> None:
    small = Store(worker.store.redis, result_bytes=2500)
    ids = []
    for points in (5, 6, 7):
        body = {"omega": {"start": 0.1, "stop": 1.0, "points": points}}
        ids.append(client.post("/v1/grazing-curves", json=body).json()["id"])
    data = [encode_npz({"omega": np.random.default_rng(seed).random(100)}, PLAYED) for seed in range(3)]
    assert 2500 / 3 < min(map(len, data)) <= max(map(len, data)) < 2500 / 2

    def finish(place: int) -> None:
        worker.commit(ids[place], data[place], 0, whole=True, store=small)

    finish(0)
    finish(1)
    etag = client.get(f"/v1/jobs/{ids[0]}/result").headers["etag"]
    assert client.get(f"/v1/jobs/{ids[1]}/result").status_code == 200
    # from now on only a condition, a HEAD or the service's own copy: still it is used
    assert client.get(f"/v1/jobs/{ids[0]}/result", headers={"If-None-Match": etag}).status_code == 304
    finish(2)
    assert [small.results.data(identity) is not None for identity in ids] == [True, False, True]


@pytest.mark.parametrize("path", ["/v1/grazing-curves", "/v1/no-such-process"])
def test_a_body_that_does_not_end_is_answered_and_closed(impatient_url: str, path: str) -> None:
    """Whether the answer needs the body or not."""
    head = f"POST {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{{"
    connection = connect_to(impatient_url)
    connection.settimeout(0.2)
    began, answer = time.monotonic(), b""
    with connection, contextlib.suppress(ConnectionError):
        connection.sendall(head.encode())
        while time.monotonic() - began < 10:
            try:
                piece = connection.recv(65536)
            except TimeoutError:
                connection.sendall(b" ")  # slowly
                continue
            if not piece:
                break
            answer += piece
    assert 0.5 < time.monotonic() - began < 8
    assert answer.split()[1] == (b"400" if path == "/v1/grazing-curves" else b"404")
    assert b"connection: close" in answer.lower()


def test_an_answer_before_the_body_is_read_closes_the_connection_and_another_one_keeps_it(live_url: str) -> None:
    with httpx2.Client(base_url=live_url, timeout=20) as kept:
        answer = kept.post("/v1/no-such-process", json=CURVE)
        assert (answer.status_code, answer.headers.get("connection")) == (404, "close")
        for _ in range(2):
            assert "connection" not in kept.post("/v1/grazing-curves", json=CURVE).headers


def test_a_slow_answer_is_not_an_unfinished_request(impatient_url: str) -> None:
    with httpx2.Client(base_url=impatient_url, timeout=20) as kept:
        assert kept.post("/v1/grazing-curves", json=CURVE, headers={"Prefer": "wait=2"}).status_code == 201
        for _ in range(4):  # one connection, longer than one request may take
            assert kept.get("/healthz").status_code == 200
            time.sleep(0.4)


def test_requests_over_the_limit_of_connections_are_refused_and_closed(impatient_url: str) -> None:
    request = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with contextlib.ExitStack() as stack:
        kept = [stack.enter_context(connect_to(impatient_url)) for _ in range(19)]
        for connection in kept:
            connection.sendall(request)
            assert connection.recv(4096).startswith(b"HTTP/1.1 200")
        for _ in range(10):
            with connect_to(impatient_url) as over:
                over.sendall(request)
                assert over.recv(4096).startswith(b"HTTP/1.1 503")
                time.sleep(0.05)
                assert is_closed(over)
    until(lambda: httpx2.get(f"{impatient_url}/healthz").status_code == 200, 5)


def test_a_connection_is_kept_for_longer_than_clients_wait(impatient_url: str) -> None:
    with connect_to(impatient_url) as kept:
        for seconds in (5.5, 0.0):  # uvicorn's own limit is five
            kept.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            assert kept.recv(4096).startswith(b"HTTP/1.1 200")
            time.sleep(seconds)
            assert not is_closed(kept)
            kept.setblocking(True)


def connected(service: psutil.Process, ports: set[int]) -> list[Any]:
    """The connections of a service to clients at these ports that are open."""
    opened = (each for each in service.net_connections("tcp") if each.status == psutil.CONN_ESTABLISHED)
    return [each for each in opened if each.raddr and each.raddr.port in ports]


@pytest.mark.parametrize(
    ("form", "results"), [("npz", 6), *(pytest.param(form, 1, marks=pytest.mark.thorough) for form in ("npz", "json"))]
)
def test_clients_that_do_not_read_hold_little_and_are_disconnected(
    redis_server: Any, worker: Any, client: TestClient, form: str, results: int
) -> None:
    npz_bytes, paths = 6 << 20, []
    for number in range(results):
        body = {"omega": {"start": 0.1, "stop": 1.0, "points": 5 + number}}
        job = client.post("/v1/grazing-curves", json=body).json()
        values = np.random.default_rng(number).integers(0, 256, npz_bytes, dtype=np.uint8)
        worker.finish(job["id"], {"omega": values.view(np.uint64)})
        paths.append(f"/v1/jobs/{job['id']}/result?f={form}")
    own, settings = psutil.Process(), ServiceSettings(redis_url=redis_server.url, hot_bytes=0, sent_bytes=npz_bytes + 1)
    with (
        running(settings, send_seconds=1.0) as url,
        httpx2.Client(timeout=60) as reader,
        contextlib.ExitStack() as stack,
    ):
        lengths = [len(reader.get(f"{url}{path}").content) for path in paths]
        before = own.memory_info().rss  # with what the first answers leave in the allocator
        stalled = [stack.enter_context(stalled_reader(url, paths[k % results])) for k in range(24)]
        most, end = 0, time.monotonic() + 0.8
        while time.monotonic() < end:
            most = max(most, own.memory_info().rss - before)
            time.sleep(0.02)
        assert most < 3 * (npz_bytes + max(lengths))  # two are sent at a time, and the allocator keeps some
        assert len(reader.get(f"{url}{paths[-1]}").content) == lengths[-1]
        readers = {client.getsockname()[1] for client in stalled}
        until(lambda: not connected(own, readers), 60)  # two results at a time, a second each
        for connection in stalled:
            received = 0
            with contextlib.suppress(ConnectionError):
                while piece := connection.recv(1 << 20):
                    received += len(piece)
            assert received < min(lengths)


def test_results_do_not_wait_for_pictures(
    fresh_client: TestClient, worker: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    client, go_on = fresh_client, threading.Event()
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    worker.finish(job["id"])
    path = f"/v1/jobs/{job['id']}/result"

    def slow(npz: bytes, form: str, table: str) -> bytes:
        assert go_on.wait(30.0)
        return form.encode()

    monkeypatch.setattr(representations, "rendered", slow)
    with ThreadPoolExecutor(3) as pool:
        drawn = [pool.submit(client.get, f"{path}?f={form}") for form in ("png", "svg", "pdf")]
        time.sleep(0.5)
        began = time.monotonic()
        assert client.get(path).status_code == 200
        assert time.monotonic() - began < 10.0
        go_on.set()
        assert [future.result().content for future in drawn] == [b"png", b"svg", b"pdf"]

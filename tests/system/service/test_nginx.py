"""docs/nginx.conf, with Debian's nginx in front of the service: what only a proxy can bound, and what must pass."""

from __future__ import annotations

import contextlib
import json
import shutil
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import numpy as np
import pytest
import yaml

from grazemap.wire.problems import KINDS, make_problem
from grazemap_service.settings import ServiceSettings
from tests.support.service_running import CURVE, connect_to, is_closed, running, stalled_reader
from tests.support.watching import until

ROOT = Path(__file__).parents[3]
CONFIGURATION = (ROOT / "docs" / "nginx.conf").read_text("utf-8")
NGINX = shutil.which("nginx", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
HEAD = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n"

needs_nginx = pytest.mark.skipif(NGINX is None, reason="nginx is not installed")


def configured(folder: Path, service: str, port: int, connections: int) -> Path:
    """Write the configuration for a service elsewhere, with a second in place of thirty, and few connections."""
    text = CONFIGURATION
    for old, new in (
        ("/tmp/", f"{folder}/"),
        ("service:8000", service),
        ("listen 8080;", f"listen 127.0.0.1:{port};"),
        (" 30s;", " 1s;"),
        ("worker_connections 2048;", f"worker_connections {connections};"),
    ):
        assert old in text
        text = text.replace(old, new)
    (folder / "nginx.conf").write_text(text, "utf-8")
    return folder / "nginx.conf"


@contextlib.contextmanager
def proxied(folder: Path, url: str, connections: int = 2048) -> Iterator[str]:
    """A proxy in front of a service."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    file = configured(folder, urlsplit(url).netloc, port, connections)
    process = subprocess.Popen([str(NGINX), "-c", str(file), "-e", "stderr"])
    try:

        def answers() -> bool:
            with contextlib.suppress(OSError):
                socket.create_connection(("127.0.0.1", port), timeout=1).close()
                return True
            return False

        until(answers, 10)
        yield f"http://127.0.0.1:{port}"
    finally:
        process.terminate()
        process.wait(10)


@pytest.fixture
def proxy(tmp_path: Path, live_url: str) -> Iterator[str]:
    with proxied(tmp_path, live_url) as url:
        yield url


@needs_nginx
def test_requests_whose_heads_do_not_arrive_are_closed(proxy: str) -> None:
    pieces = [b"", HEAD, HEAD + b"X: " + b"a" * 4000]
    connections = [connect_to(proxy) for _ in pieces]
    began = time.monotonic()
    for connection, piece in zip(connections, pieces, strict=True):
        connection.sendall(piece)
    trickling = connect_to(proxy)  # a byte now and then is no head either
    trickling.sendall(HEAD)
    closed = False
    while not closed and time.monotonic() - began < 10:
        time.sleep(0.2)
        with contextlib.suppress(ConnectionError):
            trickling.sendall(b"a")
        closed = is_closed(trickling)
    assert closed
    for connection in (*connections, trickling):
        with connection, contextlib.suppress(ConnectionResetError):
            while connection.recv(65536):
                pass
    assert time.monotonic() - began > 0.5


@needs_nginx
def test_a_body_that_does_not_arrive_is_not_seen_by_the_service(proxy: str, logs: list[Any]) -> None:
    post = b"POST /v1/grazing-curves HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
    with connect_to(proxy) as connection, contextlib.suppress(ConnectionResetError):
        connection.sendall(post + b"Content-Length: 100\r\n\r\n{")
        while connection.recv(65536):
            pass
    assert [entry for entry in logs if entry["event"] == "request"] == []


@needs_nginx
@pytest.mark.parametrize(
    ("request_bytes", "kind"),
    [
        (b"\x16\x03\x01\x02\x00\r\n\r\n", "bad-request"),
        (HEAD + b"X: " + b"a" * 40_000 + b"\r\n\r\n", "bad-request"),
        (b"GET /" + b"a" * 40_000 + b" HTTP/1.1\r\n\r\n", "bad-request"),
        (HEAD.replace(b"GET", b"POST") + b"Content-Length: 2000000\r\n\r\n", "body-too-large"),
        (HEAD + b"Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n", "bad-request"),
    ],
)
def test_what_it_refuses_itself_is_the_problem_of_the_service(proxy: str, request_bytes: bytes, kind: str) -> None:
    answer = b""
    with connect_to(proxy) as connection, contextlib.suppress(ConnectionError):
        connection.sendall(request_bytes)
        while piece := connection.recv(65536):
            answer += piece
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.split()[1] == str(KINDS[kind].status).encode()
    assert b"content-type: application/problem+json" in head.lower()
    assert json.loads(body) == make_problem(kind).model_dump(mode="json")


@needs_nginx
def test_many_idle_connections_keep_nobody_out(tmp_path: Path, live_url: str) -> None:
    with proxied(tmp_path, live_url, connections=64) as url, contextlib.ExitStack() as stack:
        kept = []
        for _ in range(100):
            kept.append(stack.enter_context(connect_to(url)))
            kept[-1].sendall(HEAD + b"\r\n")
            assert kept[-1].recv(4096).startswith(b"HTTP/1.1 200")
        time.sleep(0.3)
        closed = [is_closed(connection) for connection in kept]
    assert closed == sorted(closed, reverse=True)  # those that have been idle for longest
    assert 36 < sum(closed) < 100


@needs_nginx
def test_a_client_that_does_not_read_is_closed(tmp_path: Path, redis_server: Any, worker: Any, client: Any) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    worker.finish(job["id"], {"omega": np.random.default_rng(0).random(1_500_000)})
    path = f"/v1/jobs/{job['id']}/result?f=npz"
    with running(ServiceSettings(redis_url=redis_server.url)) as url, proxied(tmp_path, url) as front:
        length = len(httpx2.get(f"{front}{path}", timeout=60).content)
        with stalled_reader(front, path) as stalled:
            time.sleep(3.0)
            stalled.settimeout(10)
            received = 0
            with contextlib.suppress(ConnectionError):
                while piece := stalled.recv(1 << 20):
                    received += len(piece)
        assert received < length


@needs_nginx
def test_events_pass_as_they_come(proxy: str, worker: Any) -> None:
    with httpx2.Client(base_url=proxy, timeout=20) as http:
        job = http.post("/v1/grazing-curves", json=CURVE).json()
        with http.stream("GET", f"/v1/jobs/{job['id']}/events") as events:
            lines = events.iter_lines()
            assert next(lines).startswith("event: ")  # although the stream has not ended
            threading.Timer(0.2, worker.finish, (job["id"],)).start()
            assert "event: done" in list(lines)
        assert http.get(f"/v1/jobs/{job['id']}/result").status_code == 200


@needs_nginx
def test_a_service_that_is_away_is_a_problem(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"http://127.0.0.1:{taken.getsockname()[1]}"
    with proxied(tmp_path, address) as url:
        answer = httpx2.get(f"{url}/healthz")
    assert (answer.status_code, answer.headers["retry-after"]) == (503, "2")
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["status"] == 503


def test_the_containers_run_it() -> None:
    services = yaml.safe_load((ROOT / "docker-compose.yml").read_text("utf-8"))["services"]
    (volume,) = services["proxy"]["volumes"]
    source, target, mode = volume.split(":")
    assert (ROOT / source).resolve() == ROOT / "docs" / "nginx.conf"
    assert mode == "ro"
    assert target in services["proxy"]["command"]
    (published,) = services["proxy"]["ports"]
    assert published.endswith(":8080")
    assert "ports" not in services["service"]

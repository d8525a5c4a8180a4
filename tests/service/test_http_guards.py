"""Access control: hosts, origins, limits of bodies, and the headers for browsers."""

from __future__ import annotations

import json
import socket
import time
from typing import Any
from urllib.parse import urlsplit

import pytest
from starlette.testclient import TestClient

from grazemap_service.app import create_app
from grazemap_service.settings import Settings
from grazemap_worker.store import Store

CURVE = {"omega": {"start": 0.1, "stop": 1.0, "points": 5}}
KEY = "0123456789-of-the-tests-KEY"


def test_without_keys_only_this_machine_is_served(redis_server: Any, store: Store) -> None:
    app = create_app(Settings(redis_url=redis_server.url, allowed_hosts="*"))
    with TestClient(app, base_url="http://192.0.2.7:8000") as client:  # the address that was connected to
        assert client.get("/v1").status_code == 401
        assert client.get("/healthz").status_code == 200
    with TestClient(app, base_url="http://[::1]:8000") as client:
        assert client.get("/v1").status_code == 200


def test_a_comma_list_in_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAZEMAP_ALLOWED_HOSTS", "a.example, *.b.example,")
    assert Settings().allowed_hosts == ("a.example", "*.b.example")


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1", 200),
        ("localhost:8000", 200),
        ("LOCALHOST", 200),
        ("[::1]:80", 200),
        ("evil.example", 400),
        ("localhost.evil.example", 400),
        ("evil.example:127.0.0.1", 400),
        ("", 400),
    ],
)
def test_foreign_hosts_are_refused(client: TestClient, host: str, status: int) -> None:
    answer = client.get("/healthz", headers={"Host": host})
    assert answer.status_code == status
    if status == 400:
        assert answer.json()["type"] == "urn:grazemap:problem:host-not-allowed"
        assert "evil" not in answer.text


def test_hosts_can_be_allowed_by_pattern(serve: Any) -> None:
    client = serve(allowed_hosts="*.lab.example")
    for host, status in (("a.lab.example", 200), ("lab.example", 400), ("alab.example", 400)):
        assert client.get("/healthz", headers={"Host": host}).status_code == status


def test_no_origin_is_allowed_unless_set(client: TestClient, serve: Any) -> None:
    origin = {"Origin": "https://app.example"}
    assert "access-control-allow-origin" not in client.get("/v1", headers=origin).headers
    opened = serve(cors_origins="https://app.example", api_keys=KEY)
    preflight = opened.options(
        "/v1/grazing-curves",
        headers={**origin, "Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization"},
    )
    assert preflight.status_code == 200
    assert preflight.headers["access-control-allow-origin"] == "https://app.example"
    other = opened.get("/v1", headers={"Origin": "https://other.example", "Authorization": f"Bearer {KEY}"})
    assert "access-control-allow-origin" not in other.headers


def test_a_refused_preflight_is_a_problem(serve: Any) -> None:
    client = serve(cors_origins="https://app.example")
    answer = client.options(
        "/v1/grazing-curves", headers={"Origin": "https://evil.example", "Access-Control-Request-Method": "POST"}
    )
    assert answer.status_code == 400
    assert answer.headers["content-type"] == "application/problem+json"
    assert "access-control-allow-origin" not in answer.headers
    assert "evil" not in answer.text


def test_answers_are_not_pages(client: TestClient) -> None:
    for path in ("/v1", "/no-such-path", "/openapi.json"):
        headers = client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["content-security-policy"].startswith("default-src 'none'; frame-ancestors")
    for path in ("/", "/docs"):
        policy = client.get(path).headers["content-security-policy"]
        assert "script-src 'self'; style-src 'self'" in policy
        assert "unsafe" not in policy


class RawAnswer:
    """The answer to bytes written to a socket."""

    def __init__(self, url: str, *pieces: bytes, timeout: float = 5.0) -> None:
        address = urlsplit(url)
        assert address.hostname is not None
        began = time.monotonic()
        with socket.create_connection((address.hostname, address.port or 80), timeout=timeout) as connection:
            for piece in pieces:
                try:
                    connection.sendall(piece)
                except (BrokenPipeError, ConnectionResetError):
                    break  # answered and closed before everything was sent
            data = b""
            while b"\r\n\r\n" not in data or len(data.split(b"\r\n\r\n", 1)[1]) < self._length(data):
                chunk = connection.recv(65536)
                if not chunk:
                    break
                data += chunk
        self.seconds = time.monotonic() - began
        head, self.body = data.split(b"\r\n\r\n", 1)
        self.status = int(head.split()[1])

    @staticmethod
    def _length(data: bytes) -> int:
        head = data.lower().split(b"\r\n\r\n", 1)[0]
        return int(head.split(b"content-length:")[1].split()[0])


HEAD = b"POST /v1/grazing-curves HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"


def test_a_declared_large_body_is_413_before_it_is_sent(live_url: str, store: Store) -> None:
    answer = RawAnswer(live_url, HEAD + b"Content-Length: 999999999999\r\n\r\n")
    assert answer.status == 413
    assert json.loads(answer.body)["type"] == "urn:grazemap:problem:body-too-large"
    assert answer.seconds < 1
    assert store.jobs.page() == ([], None)


def test_a_chunked_large_body_is_413_as_soon_as_it_is_too_large(live_url: str, store: Store) -> None:
    chunk = b"%x\r\n" % 65536 + b" " * 65536 + b"\r\n"
    answer = RawAnswer(live_url, HEAD + b"Transfer-Encoding: chunked\r\n\r\n", *[chunk] * 17)  # no last chunk
    assert answer.status == 413
    assert json.loads(answer.body)["status"] == 413
    assert answer.seconds < 1
    assert store.jobs.page() == ([], None)


def test_a_body_at_the_limit_is_read(serve: Any) -> None:
    body = json.dumps(CURVE).encode()
    headers = {"Content-Type": "application/json"}
    client = serve(max_body_bytes=len(body))
    assert client.post("/v1/grazing-curves", content=body, headers=headers).status_code == 201
    assert client.post("/v1/grazing-curves", content=body + b" ", headers=headers).status_code == 413


def test_deep_json_over_a_socket_is_400_and_the_service_lives(live_url: str) -> None:
    body = b"[" * 500_000 + b"]" * 500_000
    answer = RawAnswer(live_url, HEAD + b"Content-Length: %d\r\n\r\n" % len(body), body)
    assert answer.status == 400
    assert json.loads(answer.body)["type"] == "urn:grazemap:problem:malformed-json"
    assert answer.seconds < 1
    assert RawAnswer(live_url, b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").status == 200

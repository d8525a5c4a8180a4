"""Access control: hosts, origins, limits of bodies, and the headers for browsers."""

from __future__ import annotations

import contextlib
import http.client
import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import pytest
from starlette.testclient import TestClient

from grazemap_service import request_body
from grazemap_service.app import create_app
from grazemap_service.problems import ProblemException
from grazemap_service.request_body import parse_json
from grazemap_service.routers.docs import GUIDE
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store import Store
from tests.support.api_document import operations
from tests.support.service_running import CURVE, connect_to

KEY = "0123456789-of-the-tests-KEY"


def test_without_keys_only_this_machine_is_served(redis_server: Any, store: Store) -> None:
    app = create_app(ServiceSettings(redis_url=redis_server.url, allowed_hosts="*"))
    with TestClient(app, base_url="http://192.0.2.7:8000") as client:  # the address that was connected to
        assert client.get("/v1").status_code == 401
        assert client.get("/healthz").status_code == 200
    with TestClient(app, base_url="http://[::1]:8000") as client:
        assert client.get("/v1").status_code == 200


def test_a_comma_list_in_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAZEMAP_ALLOWED_HOSTS", "a.example, *.b.example,")
    assert ServiceSettings().allowed_hosts == ("a.example", "*.b.example")


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


def test_every_described_header_is_allowed_to_pages_of_an_allowed_origin(serve: Any, described: dict[str, Any]) -> None:
    client = serve(cors_origins="https://app.example")
    named = [parameter for _, _, operation in operations(described) for parameter in operation["parameters"]]
    headers = {parameter["name"].lower() for parameter in named if parameter["in"] == "header"}
    assert {"priority", "grazemap-group", "grazemap-client", "prefer", "last-event-id"} <= headers
    for header in [*headers, "authorization", "content-type"]:
        asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": header}
        preflight = client.options("/v1/grazing-curves", headers={"Origin": "https://app.example", **asked})
        assert preflight.status_code == 200, header


@pytest.mark.parametrize("allowed", ["", "https://app.example"])
def test_a_refused_preflight_is_a_problem_that_names_its_cause(serve: Any, allowed: str) -> None:
    client = serve(cors_origins=allowed)

    def refused(origin: str, header: str) -> str:
        asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": header}
        answer = client.options("/v1/grazing-curves", headers={"Origin": origin, **asked})
        assert answer.status_code == 400
        assert answer.headers["content-type"] == "application/problem+json"
        assert "evil" not in answer.text
        return str(answer.json()["detail"])

    assert "GRAZEMAP_CORS_ORIGINS" in refused("https://evil.example", "content-type")
    if allowed:
        assert "GRAZEMAP_CORS_ORIGINS" not in refused(allowed, "x-evil")


@pytest.mark.parametrize("written", ["http://localhost:8181/", "HTTP://Localhost:8181", "http://localhost:8181"])
def test_an_allowed_origin_is_compared_as_browsers_send_it(serve: Any, written: str) -> None:
    origin = "http://localhost:8181"
    answer = serve(cors_origins=f"https://[::1]:1, {written}").get("/v1", headers={"Origin": origin})
    assert answer.headers["access-control-allow-origin"] == origin


def framing(client: TestClient, path: str) -> tuple[list[str], str | None]:
    """Return who may show a page in a frame: what its policy says, and what the older header does."""
    headers = client.get(path).headers
    policy = dict(part.strip().partition(" ")[::2] for part in headers["content-security-policy"].split(";"))
    return policy["frame-ancestors"].split(), headers.get("x-frame-options")


def test_only_the_explorer_is_shown_in_frames_of_this_machine(client: TestClient) -> None:
    for path in ("/docs", "/v1", "/static/explorer/main.js", "/no-such-path"):
        assert framing(client, path) == (["'none'"], "DENY")
    sources, older = framing(client, "/")
    assert older is None
    assert sources[0] == "'self'"
    hosts = {source.partition("://")[2] for source in sources[1:]}
    assert hosts == {"localhost:*", "127.0.0.1:*"}


def test_a_setting_names_who_may_show_the_explorer_in_a_frame(serve: Any) -> None:
    course = serve(frame_origins="https://Course.example/, https://*.lab.example:8443")
    assert framing(course, "/") == (["'self'", "https://course.example", "https://*.lab.example:8443"], None)
    assert framing(serve(frame_origins=","), "/") == (["'self'"], None)
    assert framing(serve(frame_origins="*"), "/") == (["'self'", "*"], None)


@pytest.mark.parametrize(
    "wrong", ["course.example", "https://a.example/page", "https://a.example;script-src *", "'none'", "https://*"]
)
def test_nothing_but_origins_enters_the_policy_of_the_explorer(wrong: str) -> None:
    with pytest.raises(ValueError, match="frame_origins"):
        ServiceSettings(frame_origins=wrong)


def test_answers_are_not_pages(client: TestClient) -> None:
    for path in ("/v1", "/no-such-path", "/openapi.json"):
        headers = client.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["content-security-policy"].startswith("default-src 'none'; frame-ancestors")
    for path in ("/", "/docs"):
        policy = client.get(path).headers["content-security-policy"]
        assert "script-src 'self'; style-src 'self'" in policy
        assert "unsafe" not in policy


def test_the_guide_is_shown_where_it_was_built(
    client: TestClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(GUIDE, "directory", tmp_path / "none")
    missing = client.get("/guide/")
    assert missing.status_code == 404
    assert missing.json()["type"] == "urn:grazemap:problem:not-found"
    (tmp_path / "index.html").write_text("<p>a guide")
    (tmp_path / "page.js").write_text("1")
    monkeypatch.setattr(GUIDE, "directory", tmp_path)
    monkeypatch.setattr(GUIDE, "all_directories", [tmp_path])
    assert client.get("/guide", follow_redirects=False).headers["location"] == "/guide/"
    shown = client.get("/guide")
    assert shown.text == "<p>a guide"
    assert "default-src 'none'" in shown.headers["content-security-policy"]
    assert client.get("/guide/page.js").text == "1"
    assert client.get("/guide/none.html").status_code == 404


class RawAnswer:
    """The answer to bytes written to a socket."""

    def __init__(self, url: str, *pieces: bytes) -> None:
        with connect_to(url) as connection:
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
        head, body = data.split(b"\r\n\r\n", 1)
        self.status, self.body = int(head.split()[1]), body

    @staticmethod
    def _length(data: bytes) -> int:
        head = data.lower().split(b"\r\n\r\n", 1)[0]
        return int(head.split(b"content-length:")[1].split()[0])


HEAD = b"POST /v1/grazing-curves HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"


CHUNK = b"%x\r\n" % 65536 + b" " * 65536 + b"\r\n"


@pytest.mark.parametrize(
    "pieces",
    [[b"Content-Length: 999999999999\r\n\r\n"], [b"Transfer-Encoding: chunked\r\n\r\n", *[CHUNK] * 17]],
    ids=["declared", "chunked"],
)
def test_a_large_body_is_413_before_it_is_sent_whole(live_url: str, store: Store, pieces: list[bytes]) -> None:
    answer = RawAnswer(live_url, HEAD + pieces[0], *pieces[1:])  # no last chunk
    assert answer.status == json.loads(answer.body)["status"] == 413
    assert json.loads(answer.body)["type"] == "urn:grazemap:problem:body-too-large"
    assert store.jobs.page() == ([], None)


@pytest.mark.parametrize(
    ("text", "allowed"), [("[[]]", True), ('[{"a": 1}]', True), ("[[[]]]", False), ("[[{}]]", False)]
)
def test_empty_lists_and_objects_have_a_depth_too(text: str, allowed: bool) -> None:
    with nullcontext() if allowed else pytest.raises(ProblemException):
        parse_json(text.encode(), 2)


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
    assert RawAnswer(live_url, b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").status == 200


def test_content_length_with_transfer_encoding_is_refused_and_closed(live_url: str, store: Store) -> None:
    body = json.dumps(CURVE).encode()
    both = HEAD + b"Content-Length: %d\r\nTransfer-Encoding: chunked\r\n\r\n" % len(body)
    hidden = b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    with connect_to(live_url) as connection:
        connection.sendall(both + b"%x\r\n%s\r\n0\r\n\r\n" % (len(body), body) + hidden)
        answers = b"".join(iter(lambda: connection.recv(65536), b""))  # until it is closed
    assert answers.count(b"HTTP/1.1") == 1
    head, content = answers.split(b"\r\n\r\n", 1)
    assert head.startswith(b"HTTP/1.1 400 ")
    assert json.loads(content)["type"] == "urn:grazemap:problem:bad-request"
    assert b"Content-Length and Transfer-Encoding" in content
    assert store.jobs.page() == ([], None)


def test_what_is_not_http_is_400_and_closed(live_url: str) -> None:
    """The server's own answer; that of the proxy is a problem."""
    for line in (b"\x16\x03\x01\x02\x00\r\n\r\n", b"GET  / HTTP/1.1\r\n\r\n", HEAD + b"Content-Length: x\r\n\r\n"):
        with connect_to(live_url) as connection:
            connection.sendall(line)
            assert b"".join(iter(lambda: connection.recv(65536), b"")).startswith(b"HTTP/1.1 400 ")


def _with_http_client(url: str, body: bytes) -> int:
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.hostname or "", address.port, timeout=30)
    connection.request("POST", address.path, body, {"Content-Type": "application/json"})
    status = connection.getresponse().status
    connection.close()
    return status


def _with_urllib(url: str, body: bytes) -> int:
    with pytest.raises(urllib.error.HTTPError) as caught:
        urllib.request.urlopen(urllib.request.Request(url, body, {"Content-Type": "application/json"}), timeout=30)
    caught.value.close()
    return caught.value.code


def _with_httpx(url: str, body: bytes) -> int:
    return httpx2.post(url, content=body, headers={"Content-Type": "application/json"}, timeout=30).status_code


def _with_httpx_in_chunks(url: str, body: bytes) -> int:
    pieces = (body[start : start + 65536] for start in range(0, len(body), 65536))
    return httpx2.post(url, content=pieces, headers={"Content-Type": "application/json"}, timeout=30).status_code


def _with_curl(url: str, body: bytes) -> int:
    command = ["curl", "-sS", "-o", "/dev/null", "-w", "%{http_code}", "-H", "Expect:", "--data-binary", "@-", url]
    return int(subprocess.run(command, input=body, capture_output=True, check=True, timeout=30).stdout)


@pytest.mark.parametrize("post", [_with_http_client, _with_urllib, _with_httpx, _with_httpx_in_chunks, _with_curl])
def test_ordinary_clients_read_the_answer_to_a_large_body(live_url: str, post: Callable[[str, bytes], int]) -> None:
    if post is _with_curl and shutil.which("curl") is None:
        pytest.skip("curl is not installed")
    for _ in range(3):
        assert post(f"{live_url}/v1/grazing-curves", b" " * 5_000_000) == 413


def test_the_rest_of_a_body_is_read_for_a_while_only(live_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(request_body, "_MAX_REST_BYTES", 1 << 20)
    monkeypatch.setattr(request_body, "_REST_SECONDS", 1.0)
    for piece in (b"", b" " * 65536):  # one that sends nothing more, and one that never ends
        with connect_to(live_url) as connection:
            connection.sendall(HEAD + b"Content-Length: 100000000000\r\n\r\n")
            began = time.monotonic()
            with contextlib.suppress(ConnectionError):
                while piece:
                    connection.sendall(piece)
                while connection.recv(65536):
                    pass
            assert time.monotonic() - began < 20


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "/static/none", {}, 404),
        ("GET", "/static/swagger/%00", {}, 404),
        ("POST", "/static/docs.js", {}, 405),
        ("PUT", "/static/palette.json", {}, 405),
        ("GET", "/static/docs.js", {"Range": "bytes=5-2"}, 200),
        ("GET", "/static/palette.json", {"Range": "bytes=9999999-"}, 200),
        ("GET", "/docs", {"Range": "pages=1"}, 200),
    ],
)
def test_errors_of_static_files_are_problems(
    client: TestClient, method: str, path: str, headers: dict[str, str], status: int
) -> None:
    answer = client.request(method, path, headers=headers)
    assert answer.status_code == status
    if status == 200:
        assert answer.content == client.get(path).content
    else:
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.headers.get("allow") == ("GET, HEAD" if status == 405 else None)


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/docs",
        "/static/palette.json",
        "/static/observables.json",
        "/static/explorer/main.js",
        "/static/swagger/swagger-ui.css",
    ],
)
def test_files_of_pages_are_asked_for_again(client: TestClient, path: str) -> None:
    """After an update modules of two versions do not meet; what has not changed is not sent again."""
    answer = client.get(path)
    assert answer.status_code == 200
    assert answer.headers["cache-control"] == "no-cache"
    if "/static/explorer" in path or "/static/swagger" in path:
        again = client.get(path, headers={"If-None-Match": answer.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")

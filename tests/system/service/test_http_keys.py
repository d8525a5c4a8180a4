"""Keys: which are accepted, from where, what they grant, and that none is repeated."""

from __future__ import annotations

import os
import secrets
import string
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError
from starlette.testclient import TestClient

from grazemap_service import keys
from grazemap_service.context import CurrentKey
from grazemap_service.keys import Key, Keys
from grazemap_service.settings import ServiceSettings, SettingsError
from grazemap_worker.store import Store
from tests.support.service_running import CURVE

OPEN = ["/", "/docs", "/openapi.json", "/healthz", "/readyz", "/static/docs.js", "/static/swagger/swagger-ui.css"]
FIRST, SECOND = "first-Key_0123456789-abc", "c2Vjb25kLUtleS0wMTIzNDU2Nw=="
KeyFile = Callable[..., Path]


@pytest.fixture
def key_file(tmp_path: Path) -> KeyFile:
    """Write a file of keys, each time with another time of modification."""
    times = iter(range(1, 100))

    def write(*lines: str) -> Path:
        path = tmp_path / "keys"
        path.write_text("\n".join(lines))
        os.utime(path, (next(times),) * 2)
        return path

    return write


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def test_with_keys_only_open_paths_need_none(serve: Any, worker: Any, store: Store) -> None:
    client = serve(api_keys=f"{FIRST}, {SECOND}")
    for path in OPEN:
        assert client.get(path).status_code == 200, path
    refused = [client.get(path) for path in ("/v1", "/v1/jobs", "/metrics", "/no-such-path", "/docs/more", "/static")]
    refused.append(client.post("/v1/grazing-curves", json=CURVE))
    wrong = ("Bearer wrong", "Bearer", f"Bearer {FIRST}2", f"Basic {FIRST}", FIRST, "Bearer \xe9")
    refused += [client.get("/v1", headers={"Authorization": header.encode("latin-1")}) for header in wrong]
    for answer in refused:
        assert answer.status_code == 401
        assert answer.headers["www-authenticate"] == "Bearer"
        assert answer.json()["type"] == "urn:grazemap:problem:key-required"
    assert store.jobs.page() == ([], None)
    for key in (FIRST, SECOND):
        answer = client.post("/v1/grazing-curves", json=CURVE, headers={"Authorization": f"bearer {key}"})
        assert answer.status_code in {200, 201}


@pytest.mark.parametrize("count", [16, 24])
def test_random_keys_of_128_bits_are_strong(count: int) -> None:
    for _ in range(200):
        assert keys.is_strong(secrets.token_urlsafe(count))
        assert keys.is_strong(secrets.token_hex(count))


@pytest.mark.parametrize(
    "key",
    [
        pytest.param("", id="nothing"),
        pytest.param("sesame", id="a word"),
        pytest.param(secrets.token_urlsafe(15), id="120 bits"),
        pytest.param("a" * 64, id="one letter"),
        pytest.param("abcdefg" * 10, id="letters that repeat"),
        pytest.param("aB3-aB3-aB3-aB3-aB3-aB3-", id="signs that repeat"),
        pytest.param("".join(secrets.choice(string.hexdigits[:16]) for _ in range(31)), id="31 hexadecimal digits"),
        pytest.param("".join(secrets.choice(string.digits) for _ in range(38)), id="38 digits"),
        pytest.param("".join(secrets.choice(string.ascii_lowercase) for _ in range(24)), id="24 small letters"),
        pytest.param("with a space and 01234567890", id="spaces"),
        pytest.param("ünïcödé-01234567890-abcdef", id="other letters"),
        pytest.param("=" * 30, id="padding"),
    ],
)
def test_weak_keys_are_refused_and_not_repeated(key: str) -> None:
    assert not keys.is_strong(key)
    with pytest.raises(ValidationError, match=r"too weak: a key has 22") as caught:
        ServiceSettings(api_keys=(f"named={key}",))
    assert "api_keys" in str(caught.value)
    assert len(key) < 6 or key not in str(caught.value)


def test_keys_are_not_shown_by_settings() -> None:
    assert FIRST not in repr(ServiceSettings(api_keys=(FIRST,)))


def test_keys_have_names_and_files_weights_and_quotas(key_file: KeyFile) -> None:
    path = key_file("# of the laboratory", f"anna {FIRST} 2.5 400", "", f"bert {SECOND} # and no more")
    third = secrets.token_urlsafe(24)
    accepted = Keys(ServiceSettings(api_keys=f"{secrets.token_hex(16)},carl={third}").api_keys, path)
    assert accepted.find(FIRST.encode()) == Key("anna", 2.5, 400)
    assert accepted.find(SECOND.encode()) == Key("bert", 1.0, None)
    assert accepted.find(third.encode()) == Key("carl")
    assert accepted.find(b"") is None
    assert Keys(ServiceSettings(api_keys=SECOND).api_keys).find(SECOND.encode()) == Key("key-1")


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "no key"),
        (["# none"], "no key"),
        ([FIRST], "line 1 is not: name key"),
        (["", f"anna {FIRST} 1 2 3"], "line 2 is not: name key"),
        ([f"an/na {FIRST}"], "name of line 1"),
        ([f"anna {FIRST} 0"], "line 1: weight"),
        ([f"anna {FIRST} nan"], "line 1: weight"),
        ([f"anna {FIRST} 1 0"], "line 1: weight"),
        ([f"anna {FIRST} 1 2.5"], "line 1: weight"),
        (["anna sesame"], "line 1 is too weak"),
        ([f"anna {FIRST}", f"bert {FIRST}"], "line 2 repeats"),
        ([f"anna {FIRST}", f"anna {SECOND} 2"], "line 2: another key of this name"),
    ],
)
def test_a_wrong_file_is_refused_by_line(key_file: KeyFile, lines: list[str], message: str) -> None:
    with pytest.raises(ValidationError, match=message) as caught:
        ServiceSettings(api_keys_file=key_file(*lines))
    assert "api_keys_file" in str(caught.value)
    assert FIRST not in str(caught.value)


def test_a_file_that_is_missing_or_not_text_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValidationError, match="cannot be read: No such file"):
        ServiceSettings(api_keys_file=tmp_path / "none")
    (tmp_path / "keys").write_bytes(b"\xff\xfe")
    with pytest.raises(ValidationError, match="not UTF-8"):
        ServiceSettings(api_keys_file=tmp_path / "keys")


def test_keys_of_a_file_are_replaced_while_the_service_runs(
    serve: Any, key_file: KeyFile, monkeypatch: pytest.MonkeyPatch, logs: list[Any]
) -> None:
    monkeypatch.setattr(keys, "_LOOK_SECONDS", 0.0)
    client = serve(api_keys_file=key_file(f"anna {FIRST}"))

    def statuses() -> list[int]:
        return [client.get("/v1", headers=bearer(key)).status_code for key in (FIRST, SECOND)]

    assert statuses() == [200, 401]
    key_file(f"anna {SECOND}")
    assert statuses() == [401, 200]
    errors = [entry for entry in logs if entry["log_level"] == "error"]
    assert errors == []
    for bad in (["anna short"], []):  # the good keys stay; an empty file does not open the service
        path = key_file(*bad)
        assert statuses() == [401, 200]
        errors = [entry for entry in logs if entry["log_level"] == "error"]
        assert "GRAZEMAP_API_KEYS_FILE" in errors[-1]["event"]
    assert len(errors) == 2  # once for each change, not for each request
    path.unlink()
    assert statuses() == [401, 200]


def test_a_file_that_is_too_long_is_refused_not_cut(key_file: KeyFile) -> None:
    path = key_file(f"anna {FIRST} #" + "." * (1 << 20), f"bert {SECOND}")
    with pytest.raises(ValueError, match="1 MiB"):
        keys.file_keys(path)


def test_a_change_that_keeps_time_and_size_is_seen(key_file: KeyFile, monkeypatch: pytest.MonkeyPatch) -> None:
    """As when a file that could not be read gets other permissions."""
    monkeypatch.setattr(keys, "_LOOK_SECONDS", 0.0)
    path = key_file(f"anna {FIRST}")
    accepted = Keys((), path)
    path.write_text(f"bert {FIRST}")
    os.utime(path, (1, 1))
    assert accepted.find(FIRST.encode()) == Key("bert")


def test_the_file_is_looked_at_once_a_second_at_most(key_file: KeyFile, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(keys.time, "monotonic", lambda: now[0])
    accepted = Keys((), key_file(f"anna {FIRST}"))
    key_file(f"anna {SECOND}")
    now[0] += 0.9
    assert accepted.find(SECOND.encode()) is None
    now[0] += 0.2
    assert accepted.find(SECOND.encode()) == Key("anna")


def test_routes_and_logs_have_the_name_and_never_the_key(serve: Any, key_file: KeyFile, logs: list[Any]) -> None:
    client = serve(api_keys_file=key_file(f"anna {FIRST} 2 7"))
    seen = []

    async def route(key: CurrentKey) -> None:
        seen.append(key)

    client.app.add_api_route("/own", route)
    assert client.get("/own", headers=bearer(FIRST)).status_code == 200
    assert seen == [Key("anna", 2.0, 7)]
    assert client.get("/own", headers=bearer(SECOND)).status_code == 401
    requests = [entry for entry in logs if entry["event"] == "request"]
    assert [entry.get("key") for entry in requests] == ["anna", None]
    assert FIRST not in repr(logs)
    assert SECOND not in repr(logs)
    counted = client.get("/metrics", headers=bearer(FIRST)).text
    assert 'grazemap_http_key_requests_total{key="anna"} 1.0' in counted


def test_without_keys_a_route_gets_none(fresh_client: TestClient) -> None:
    seen = []

    async def route(key: CurrentKey) -> None:
        seen.append(key)

    fresh_client.app.add_api_route("/own", route)  # type: ignore[attr-defined]
    assert fresh_client.get("/own", headers=bearer(FIRST)).status_code == 200
    assert seen == [None]


PUBLIC = ["*", "maps.example.org", "*.lab.example", "192.0.2.7"]


@pytest.mark.parametrize(
    ("host", "names"),
    [
        *((host, "localhost") for host in ("0.0.0.0", "::", "192.0.2.7", "example.org", "")),
        *(("127.0.0.1", f"localhost,{name}") for name in PUBLIC),
    ],
)
def test_an_exposed_address_or_a_public_host_name_needs_keys(host: str, names: str, key_file: KeyFile) -> None:
    with pytest.raises(SettingsError, match="GRAZEMAP_API_KEYS") as caught:
        ServiceSettings(allowed_hosts=names).check_exposed(host)
    assert ("GRAZEMAP_ALLOWED_HOSTS" in str(caught.value)) is (host == "127.0.0.1")
    ServiceSettings(allowed_hosts=names, api_keys=(FIRST,)).check_exposed(host)
    ServiceSettings(allowed_hosts=names, api_keys_file=key_file(f"anna {FIRST}")).check_exposed(host)


@pytest.mark.parametrize("host", ["127.0.0.1", "127.3.2.1", "::1", "[::1]", "localhost"])
def test_loopback_needs_none(host: str) -> None:
    ServiceSettings().check_exposed(host)
    ServiceSettings(allowed_hosts="LOCALHOST,127.0.0.2").check_exposed(host)


def test_the_quota_of_a_key_is_its_own(serve: Any, tmp_path: Path) -> None:
    file = tmp_path / "keys"
    keys = {name: secrets.token_urlsafe(24) for name in ("one", "two")}
    file.write_text(f"one {keys['one']} 1 2\ntwo {keys['two']}\n")
    client = serve(api_keys_file=file)

    def post(name: str, points: int) -> Any:
        body = {"omega": {"start": 0.1, "stop": 1.0, "points": points}}
        return client.post("/v1/grazing-curves", json=body, headers={"Authorization": f"Bearer {keys[name]}"})

    assert [post("one", points).status_code for points in (2, 3, 4)] == [201, 201, 429]
    assert post("one", 4).json()["detail"] == "This key has its quota of unfinished tiles."
    assert int(post("one", 4).headers["retry-after"]) >= 1
    assert post("two", 4).status_code == 201
    assert post("one", 4).status_code == 200  # there already

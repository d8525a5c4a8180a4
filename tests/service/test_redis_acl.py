"""docs/redis.acl: the users that it defines can do what the service and the workers do, and nothing else."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
import redis
import redis.exceptions
from starlette.testclient import TestClient
from watching import until

from grazemap_service.app import create_app
from grazemap_service.redis_server import find_redis_server
from grazemap_service.settings import Settings
from grazemap_worker.store.keys import EVENTS_CHANNEL

ACL = Path(__file__).parents[2] / "docs" / "redis.acl"
USERS = ("service", "worker")
PLANTED = Path(__file__).parents[1] / "worker" / "planted.py"
CURVE = {"omega": {"start": 0.1, "stop": 1.0, "points": 5}}
MAP = {"omega": {"start": 1, "stop": 2, "points": 200}, "clearance": {"start": 1, "stop": 3, "points": 200}}


def password(user: str) -> str:
    return f"{user.upper()}_PASSWORD"


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    """The socket of a Redis with the users of the file."""
    path = tmp_path / "r.sock"
    program = [str(find_redis_server()), "--port", "0", "--unixsocket", str(path), "--aclfile", str(ACL)]
    with subprocess.Popen([*program, "--dir", str(tmp_path), "--save", ""], stdout=subprocess.DEVNULL) as server:
        until(path.exists, 10)
        yield str(path)
        server.terminate()


def client_of(address: str, user: str) -> redis.Redis:
    return redis.Redis(unix_socket_path=address, username=user, password=password(user))


def settings_of(address: str, user: str) -> dict[str, str]:
    return {"redis_url": f"unix://{user}@{quote(address)}", "redis_password": password(user)}


def refusals(address: str) -> list[Any]:
    """What Redis has refused: who asked, and for what."""
    return [(one["username"], one["reason"], one["object"]) for one in client_of(address, "admin").acl_log()]


def test_service_and_workers_need_no_more(address: str) -> None:
    """A map of several tiles, and a job that is dismissed; nothing is compiled, as the tiles are planted."""
    environment = os.environ | {"GRAZEMAP_REDIS_PASSWORD": password("worker")}
    settings = settings_of(address, "worker")
    workers = subprocess.Popen([sys.executable, str(PLANTED), settings["redis_url"], "1", "fast"], env=environment)
    try:
        service = create_app(Settings(**settings_of(address, "service")))
        with TestClient(service, base_url="http://127.0.0.1") as client:
            dismissed = client.post("/v1/grazing-curves", json=CURVE).headers["location"]
            assert client.delete(dismissed).json()["status"] == "dismissed"
            path = client.post("/v1/unfolding-maps", json=MAP).headers["location"]
            until(lambda: client.get(path).json()["status"] == "successful", 30)
            assert client.get(f"{path}/result?f=npz").status_code == 200
            assert "event: done" in client.get(f"{path}/events").text
            for page in ("/readyz", "/metrics", "/v1/jobs"):
                assert client.get(page).status_code == 200
    finally:
        workers.terminate()
        workers.wait(30)
    assert refusals(address) == []


@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize(
    "command",
    [
        ("FLUSHALL",),
        ("FLUSHDB",),
        ("CONFIG", "GET", "dir"),
        ("KEYS", "*"),
        ("SHUTDOWN",),
        ("ACL", "LIST"),
        ("CLIENT", "KILL", "TYPE", "normal"),
        ("SCRIPT", "FLUSH"),
        ("REPLICAOF", "NO", "ONE"),
        ("MIGRATE", "h", "1", "k", "0", "1"),
        ("GET", "of another program"),
        ("EVAL", "return redis.call('GET', 'of another program')", "0"),
        ("EVAL", "return redis.call('FLUSHALL')", "0"),
        ("PUBLISH", "channel of another program", "x"),
    ],
    ids=" ".join,
)
def test_they_can_do_nothing_else(address: str, user: str, command: tuple[str, ...]) -> None:
    with pytest.raises(redis.exceptions.ResponseError, match=r"(?i)permission"):
        client_of(address, user).execute_command(*command)


def test_events_are_heard_by_the_service_alone(address: str) -> None:
    channel = client_of(address, "service").pubsub()
    channel.subscribe(EVENTS_CHANNEL)
    assert channel.get_message(timeout=5)["type"] == "subscribe"
    refused = client_of(address, "worker").pubsub()
    refused.subscribe(EVENTS_CHANNEL)
    with pytest.raises(redis.exceptions.NoPermissionError):
        refused.get_message(timeout=5)
    with pytest.raises(redis.exceptions.AuthenticationError):
        redis.Redis(unix_socket_path=address).ping()

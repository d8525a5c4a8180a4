"""docs/redis.acl: the users that it defines can do what the service and the workers do, and nothing else."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
import redis
import redis.exceptions
from starlette.testclient import TestClient

from grazemap_service.app import create_app
from grazemap_service.redis_server import find_redis_server
from grazemap_service.settings import ServiceSettings
from grazemap_worker.store.connection import script_text
from grazemap_worker.store.keys import EVENTS_CHANNEL
from tests.support.service_running import CURVE
from tests.support.watching import until

ACL = Path(__file__).parents[3] / "docs" / "redis.acl"
USERS = ("service", "worker")
PLANTED = Path(__file__).parents[2] / "support" / "planted.py"


MAP = {"omega": {"start": 1, "stop": 2, "points": 200}, "clearance": {"start": 1, "stop": 3, "points": 200}}


FUNCTION = "#!lua name=of_others\nredis.register_function('f', function() return redis.call('KEYS', '*') end)"
# What is neither about keys nor about channels, and why a user may have it: all other commands name what they touch.
WITHOUT_KEYS = {
    *("auth", "hello", "quit", "reset"),  # which everybody has
    *("ping", "select", "unsubscribe"),  # a connection of its own
    *("client|info", "client|setinfo", "client|setname"),  # and its name
    *("multi", "exec", "discard", "unwatch"),
    *("eval", "evalsha", "script|load"),  # a script runs with the rights of who calls it
    *("info", "time"),
}


CLASSES = (
    *("admin", "bitmap", "blocking", "connection", "dangerous", "fast", "geo", "hash", "hyperloglog", "keyspace"),
    *("list", "pubsub", "read", "scripting", "set", "slow", "sortedset", "stream", "string", "transaction", "write"),
)
NEVER = ("admin", "bitmap", "dangerous", "geo", "hyperloglog")


def script_names() -> list[str]:
    """The store's scripts."""
    folder = files("grazemap_worker.store").joinpath("lua")
    return sorted(path.name.removesuffix(".lua") for path in folder.iterdir() if path.name != "prelude.lua")


def password(user: str) -> str:
    return f"{user.upper()}_PASSWORD"


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The socket of a Redis with the users of the file."""
    folder = tmp_path_factory.mktemp("acl")
    path = folder / "r.sock"
    program = [str(find_redis_server()), "--port", "0", "--unixsocket", str(path), "--aclfile", str(ACL)]
    with subprocess.Popen([*program, "--dir", str(folder), "--save", ""], stdout=subprocess.DEVNULL) as server:
        until(path.exists, 10)
        yield str(path)
        server.terminate()


def client_of(address: str, user: str) -> redis.Redis:
    return redis.Redis(unix_socket_path=address, username=user, password=password(user))


def settings_of(address: str, user: str) -> dict[str, str]:
    return {"redis_url": f"unix://{user}@{quote(address)}", "redis_password": password(user)}


def refusals(address: str) -> list[Any]:
    """What Redis has refused: who asked, and for what."""
    return [(entry["username"], entry["reason"], entry["object"]) for entry in client_of(address, "admin").acl_log()]


def test_service_and_workers_need_no_more(address: str) -> None:
    """A map of several tiles, and a job that is dismissed; nothing is compiled, as the tiles are planted."""
    client_of(address, "admin").acl_log_reset()
    environment = os.environ | {"GRAZEMAP_REDIS_PASSWORD": password("worker")}
    settings = settings_of(address, "worker")
    workers = subprocess.Popen([sys.executable, str(PLANTED), settings["redis_url"], "1", "fast"], env=environment)
    try:
        service = create_app(ServiceSettings(**settings_of(address, "service")))
        with TestClient(service, base_url="http://127.0.0.1") as client:
            dismissed = client.post("/v1/grazing-curves", json=CURVE).headers["location"]
            assert client.delete(dismissed).json()["status"] == "dismissed"
            path = client.post("/v1/unfolding-maps", json=MAP).headers["location"]
            until(lambda: client.get(path).json()["status"] == "successful" or refusals(address), 120)
            assert refusals(address) == []
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
        ("SCAN", "0"),
        ("EVAL", "return redis.call('SCAN', '0')", "0"),
        ("FUNCTION", "LOAD", "REPLACE", FUNCTION),
        ("EVAL", "return redis.call('COPY', 'grazemap:x', 'of another program')", "0"),
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


def leaves(server: redis.Redis, *name: bytes) -> list[list[Any]]:
    """The descriptions of all commands of a server, or of some, with their subcommands in place of them."""
    server.response_callbacks.clear()
    described = server.execute_command("COMMAND", "INFO", *(name or server.execute_command("COMMAND", "LIST")))
    return [leaf for command in described if command for leaf in command[9] or [command]]


def verdict(server: redis.Redis, user: str, *command: str) -> str:
    """What the server says of a command of a user, which it does not run."""
    try:
        answer: bytes = server.execute_command("ACL", "DRYRUN", user, *command)
    except redis.exceptions.ResponseError:  # not a command that can be run at all
        return "wrong"
    match = re.search(rb"(OK|run|key|channel)\b(?!.*\b(?:run|key|channel)\b)", answer)
    assert match is not None, answer
    return match[1].decode()


@pytest.mark.parametrize("user", USERS)
@pytest.mark.parametrize("kind", CLASSES)
def test_of_every_class_only_commands_that_name_their_keys_are_theirs(address: str, user: str, kind: str) -> None:
    server = client_of(address, "admin")
    of_kind = [leaf for leaf in leaves(server) if f"@{kind}".encode() in leaf[6]]
    assert of_kind
    for name, arity, _, first, last, *_ in of_kind:
        words = name.decode().split("|")
        arguments = ["of another program"] * (abs(arity) - len(words))
        verdicts = {verdict(server, user, *words, *arguments)}
        if last != first:  # one key of theirs, and one that is not
            more = ["of another program"] if arity < 0 else []
            verdicts.add(verdict(server, user, *words, "grazemap:x", *arguments[1:], *more))
        if name.decode() not in WITHOUT_KEYS:
            assert verdicts <= {"run", "key", "channel"}, name
        if kind in NEVER and name != b"info":
            assert verdicts == {"run"}, name


def test_the_classes_are_those_of_the_server(address: str) -> None:
    assert {kind.decode() for kind in client_of(address, "admin").execute_command("ACL", "CAT")} == {*CLASSES}


@pytest.mark.parametrize("user", USERS)
def test_every_command_of_a_script_is_theirs(address: str, user: str) -> None:
    server = client_of(address, "admin")
    scripts = "\n".join(map(script_text, script_names()))
    called = sorted(set(re.findall(r"redis\.p?call\(\s*'(\w+)'", scripts)))
    assert len(called) > 30
    for name, arity, _, first, *_ in leaves(server, *(name.encode() for name in called)):
        channel_or_key = ["grazemap:x"] if first or name == b"publish" else []
        arguments = [*channel_or_key, *["1"] * (abs(arity) - 1 - len(channel_or_key))]
        assert verdict(server, user, name.decode(), *arguments) == "OK", name


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

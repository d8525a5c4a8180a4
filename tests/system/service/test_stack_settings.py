"""The stack reads its settings in any case of letters, forks no thread, and fits into the memory of the machine."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from threading import active_count
from typing import Any

import pytest

from grazemap_service import stack as stack_module
from grazemap_service.children import PythonChild
from grazemap_service.redis_server import RedisServer
from grazemap_service.settings import StackSettings
from grazemap_service.stack import ServiceStack, run

GIB = 1 << 30


@pytest.fixture
def made(tmp_path: Path) -> Iterator[Any]:
    """Make a stack that is not started."""
    stacks: list[ServiceStack] = []

    def make() -> ServiceStack:
        stacks.append(ServiceStack("127.0.0.1", 0, tmp_path / "data"))
        return stacks[-1]

    yield make
    for stack in stacks:
        stack.stop()


def environment_of(stack: ServiceStack, name: str) -> dict[str, str]:
    (child,) = (child for child in stack._children if child.name == name)
    assert isinstance(child, PythonChild)
    return child._environment


def test_a_redis_that_is_named_in_lower_case_is_used(
    made: Any, monkeypatch: pytest.MonkeyPatch, redis_server: RedisServer
) -> None:
    monkeypatch.delenv("GRAZEMAP_REDIS_URL", raising=False)
    monkeypatch.setenv("grazemap_redis_url", redis_server.url)
    stack = made()
    assert [child.name for child in stack._children] == ["service", "workers"]
    assert environment_of(stack, "workers")["GRAZEMAP_REDIS_URL"] == redis_server.url
    assert "grazemap_redis_url" not in environment_of(stack, "workers")


def test_keys_in_lower_case_are_for_the_service_alone(made: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("grazemap_api_keys", "4Jm0bVw1nY7Qz2xTRkc5uHe9PaLsDf3G")
    stack = made()
    assert environment_of(stack, "service")["GRAZEMAP_API_KEYS"]
    assert not [name for name in environment_of(stack, "workers") if "API_KEY" in name.upper()]


@pytest.mark.parametrize("name", ["GRAZEMAP_ALLOWED_HOSTS", "grazemap_allowed_hosts"])
def test_it_asks_its_service_for_a_host_that_is_allowed(made: Any, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setenv(name, "lab.example, b.example")
    asked: list[dict[str, str]] = []

    class Connection(stack_module.http.client.HTTPConnection):
        def request(self, method: str, url: str, *arguments: Any, **keywords: Any) -> None:
            asked.append(keywords["headers"])
            raise OSError

    monkeypatch.setattr(stack_module.http.client, "HTTPConnection", Connection)
    stack = made()
    assert not stack.ready()
    assert not asked, "a service that is not up yet would keep the request waiting"
    stack._service.has_answered = True
    assert not stack.ready()
    assert asked == [{"Host": "lab.example"}]


def test_no_other_thread_runs_while_it_forks(
    made: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A lock that another thread holds at the fork stays held in the child."""
    stack, threads = made(), []
    before = active_count()
    monkeypatch.setattr(ServiceStack, "look_after", lambda _stack: None)
    monkeypatch.setattr(ServiceStack, "ready", lambda _stack: False)
    for child in stack._children:
        monkeypatch.setattr(child, "start", lambda: threads.append(active_count()))
    ends = time.monotonic() + 1.5
    run(stack, lambda _: time.monotonic() > ends, None, talks=True)
    assert threads == [before] * len(stack._children)
    messages = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert len(messages) == 2  # at once, and after a second
    assert all(line["starting"] for line in messages)


@pytest.mark.parametrize(("gib", "results", "redis"), [(64, 2 * GIB, 3 * GIB), (4, GIB, GIB + GIB // 2)])
def test_its_redis_fits_into_the_memory(
    monkeypatch: pytest.MonkeyPatch, made: Any, gib: int, results: int, redis: int
) -> None:
    monkeypatch.setattr("grazemap_service.settings.machine_memory", lambda: gib * GIB)
    assert StackSettings().result_bytes == results
    assert StackSettings().max_redis_bytes == redis
    assert StackSettings(result_bytes=5 * GIB).result_bytes == 5 * GIB
    assert environment_of(made(), "workers")["GRAZEMAP_RESULT_BYTES"] == str(results)

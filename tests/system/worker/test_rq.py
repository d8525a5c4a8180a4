"""RQ as it is installed: the methods that the worker overrides, the keys that RQ uses, and what remains in Redis."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from redis import Redis
from rq import Worker

from grazemap_service.redis_server import RedisServer
from grazemap_worker.queue import leftovers
from grazemap_worker.queue.drainer import Drainer
from grazemap_worker.store import Store
from tests.support.planted import INFO


def shape(method: Any) -> list[str]:
    """A method's arguments as far as a caller can see: names, kinds and defaults."""
    arguments = inspect.signature(method).parameters.values()
    return [f"{argument.kind.name} {argument.replace(annotation=argument.empty)}" for argument in arguments]


def overridden(ours: type, theirs: type) -> list[str]:
    """Names of the methods of a class that its base has too."""
    return sorted(name for name, value in vars(ours).items() if inspect.isfunction(value) and hasattr(theirs, name))


def differences(ours: type, theirs: type) -> list[str]:
    """What a base class would call otherwise than our overriding methods expect."""
    names = [name for name in overridden(ours, theirs) if name != "__init__"]
    pairs = {name: (shape(getattr(ours, name)), shape(getattr(theirs, name))) for name in names}
    return [f"{name}: RQ has {their}, ours {our}" for name, (our, their) in pairs.items() if our != their]


def test_rq_calls_the_overridden_methods_of_the_worker_with_their_signatures() -> None:
    assert overridden(Drainer, Worker) == [
        "__init__",
        "dequeue_job_and_maintain_ttl",
        "execute_job",
        "heartbeat",
        "request_stop",
        "run_maintenance_tasks",
        "subscribe",
        "teardown",
        "unsubscribe",
    ]
    assert differences(Drainer, Worker) == []
    assert isinstance(vars(Worker.__mro__[1])["should_run_maintenance_tasks"], property)


def test_another_argument_of_rq_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    def execute_job(self: Worker, job: object, queue: object, planted: object) -> None:
        """As a later RQ might have it."""

    monkeypatch.setattr(Worker, "execute_job", execute_job)
    (found,) = differences(Drainer, Worker)
    assert found.startswith("execute_job: RQ has [")
    assert "planted" in found.partition(", ours")[0]


def test_a_removed_worker_leaves_nothing(store: Store) -> None:
    worker = Drainer(store, INFO, lambda: None)
    worker.register_birth()  # type: ignore[no-untyped-call]
    assert store.redis.exists("rq:worker:w") == 1
    leftovers.forget_worker(store.redis, "w", INFO.fingerprint)
    assert [key for key in keys_of(store.redis) if "worker" in key] == []


PREFIXED = """
import sys
sys.path.insert(0, {folder!r})
from tests.support.planted import INFO
from grazemap_worker.queue import bells, leftovers
from grazemap_worker.queue.drainer import Drainer
from grazemap_worker.store import Store, connect

store = Store(connect({url!r}))
for fingerprint in (INFO.fingerprint, "gone"):
    bells.ring(store.redis, fingerprint, small=False)
worker = Drainer(store, INFO, lambda: None)
worker.register_birth()
print(*sorted(key.decode() for key in store.redis.scan_iter()), sep="\\n")
leftovers.Leftovers(INFO.fingerprint).sweep(store.redis)
leftovers.forget_worker(store.redis, "w", INFO.fingerprint)
"""


def keys_of(redis: Redis) -> list[str]:
    return sorted(key.decode() for key in redis.scan_iter())


def test_the_prefix_of_rqs_keys_is_rqs_setting(store: Store, redis_server: RedisServer) -> None:
    code = PREFIXED.format(folder=str(Path(__file__).parents[3]), url=redis_server.url)
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "RQ_KEY_PREFIX": "another"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "another:worker:w" in done.stdout.split()
    assert [key for key in done.stdout.split() if key.startswith("rq:")] == []
    left = keys_of(store.redis)
    assert [key for key in left if key.startswith("rq:")] == []
    assert [key for key in left if "gone" in key or ":w" in key.removeprefix("another:wip")] == []

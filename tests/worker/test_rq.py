"""RQ as it is installed: the methods that the worker overrides, the keys that RQ uses, and what remains in Redis."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from typing import Any

import pytest
from planted import NUMERICS
from redis import Redis
from rq import Worker

from grazemap_service.redis_server import RedisServer
from grazemap_worker.queue import entries, leftovers
from grazemap_worker.queue.leased_worker import LeasedWorker
from grazemap_worker.store import Store

ID = "a" * 64


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
    assert overridden(LeasedWorker, Worker) == [
        "__init__",
        "execute_job",
        "heartbeat",
        "kill_horse",
        "main_work_horse",
        "maintain_heartbeats",
        "run_maintenance_tasks",
        "teardown",
    ]
    assert differences(LeasedWorker, Worker) == []


def test_another_argument_of_rq_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    def maintain_heartbeats(self: Worker, job: object, execution: object, planted: object) -> None:
        """As a later RQ might have it."""

    monkeypatch.setattr(Worker, "maintain_heartbeats", maintain_heartbeats)
    (found,) = differences(LeasedWorker, Worker)
    assert found.startswith("maintain_heartbeats: RQ has [")
    assert "planted" in found.partition(", ours")[0]


def test_a_removed_worker_leaves_nothing(store: Store) -> None:
    worker = LeasedWorker(store, NUMERICS, "w")
    worker.register_birth()  # type: ignore[no-untyped-call]
    queue = entries.queue(store.redis, NUMERICS.fingerprint)
    entry = queue.enqueue(entries.RUN_TILE, args=(ID, 0))
    worker.prepare_execution(entry)
    assert store.redis.exists("rq:worker:w", "rq:worker:w:executions") == 2
    leftovers.forget_worker(store.redis, "w", NUMERICS.fingerprint)
    assert [key for key in keys_of(store.redis) if "worker" in key] == []


def test_an_execution_that_is_not_renewed_is_removed(store: Store) -> None:
    worker = LeasedWorker(store, NUMERICS, "w")
    queue = entries.queue(store.redis, NUMERICS.fingerprint)
    entry = queue.enqueue(entries.RUN_TILE, args=(ID, 0))
    execution = worker.prepare_execution(entry)
    entries.drop(store.redis, str(queue.pop_job_id()), NUMERICS.fingerprint)
    leftovers.sweep(store.redis, NUMERICS.fingerprint)
    assert queue.started_job_registry.get_job_ids(cleanup=False) == [entry.id]
    store.redis.zadd(queue.started_job_registry.key, {execution.composite_key: 1})
    leftovers.sweep(store.redis, NUMERICS.fingerprint)
    assert [key for key in keys_of(store.redis) if entry.id in key or "wip" in key] == []


def test_without_a_work_horse_nothing_is_killed(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    """RQ's own method would kill the group of this process."""
    killed: list[tuple[int, int]] = []
    monkeypatch.setattr(os, "killpg", lambda *what: killed.append(what))
    worker = LeasedWorker(store, NUMERICS, "w")
    worker.kill_horse()
    assert killed == []
    worker._horse_pid = os.getpid()
    worker.kill_horse()
    assert len(killed) == 1


PREFIXED = """
import sys
sys.path.insert(0, {folder!r})
from planted import NUMERICS
from grazemap_worker.queue import entries, leftovers
from grazemap_worker.queue.leased_worker import LeasedWorker
from grazemap_worker.store import Store, connect

store = Store(connect({url!r}))
entries.enqueue(store.redis, "a" * 64, range(3), NUMERICS.fingerprint)
entries.enqueue(store.redis, "a" * 64, range(3), "gone")
worker = LeasedWorker(store, NUMERICS, "w")
worker.register_birth()
(job, *_) = entries.queue(store.redis, NUMERICS.fingerprint).get_jobs()
worker.prepare_execution(job)
print(*sorted(key.decode() for key in store.redis.scan_iter()), sep="\\n")
store.redis.zadd("{prefix}:wip:grazemap:planted", {{f"{{job.id}}:old": 1}})
leftovers.sweep(store.redis, NUMERICS.fingerprint)
entries.cancel(store.redis, "a" * 64, NUMERICS.fingerprint)
leftovers.forget_worker(store.redis, "w", NUMERICS.fingerprint)
"""


def keys_of(redis: Redis) -> list[str]:
    return sorted(key.decode() for key in redis.scan_iter())


def test_the_prefix_of_rqs_keys_is_rqs_setting(store: Store, redis_server: RedisServer) -> None:
    code = PREFIXED.format(folder=os.path.dirname(__file__), url=redis_server.url, prefix="another")
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "RQ_KEY_PREFIX": "another"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "another:worker:w:executions" in done.stdout.split()
    assert [key for key in done.stdout.split() if key.startswith("rq:")] == []
    left = keys_of(store.redis)
    assert [key for key in left if key.startswith("rq:")] == []
    assert [key for key in left if "gone" in key or ":w" in key.removeprefix("another:wip")] == []

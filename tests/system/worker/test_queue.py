"""The queues, in RQ as it is installed: wake-ups and their clean-up, refused entries, and what of RQ is overridden."""

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
from rq.exceptions import StopRequested
from rq.job import Job
from rq.serializers import JSONSerializer
from rq.webhook import Webhook

from grazemap_service.redis_server import RedisServer
from grazemap_worker.queue import clean_up, tile_worker, wake_ups
from grazemap_worker.queue.refusal import refusal
from grazemap_worker.queue.tile_worker import TileWorker
from grazemap_worker.store import Store, WaitingJob
from tests.support.hostile import ACTING, hostile_entries
from tests.support.planted import INFO, WAITING


def test_a_few_wake_ups_wait_at_a_time(store: Store) -> None:
    for _ in range(10):
        wake_ups.wake_worker(store.redis, "f", WAITING, small=False)
    assert wake_ups.queue(store.redis, "f", small=False).count == wake_ups.MAX_WAITING
    assert wake_ups.queue(store.redis, "f", small=True).count == 0


def test_the_cleanup_removes_what_killed_workers_took(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    queue = wake_ups.queue(store.redis, "f", small=True)
    for _ in range(2):
        wake_ups.wake_worker(store.redis, "f", WAITING, small=True)
    _, waiting = queue.get_job_ids()
    store.redis.lmove(queue.key, queue.intermediate_queue_key, "LEFT", "RIGHT")
    store.redis.lpush(queue.intermediate_queue_key, b"\xff\xfe")
    swept = clean_up.QueueCleanUp("f")
    swept.sweep(store.redis)
    assert store.redis.llen(queue.intermediate_queue_key) == 2  # a worker may be about to drop it
    monkeypatch.setattr(clean_up, "TAKEN_SECONDS", -1.0)
    swept.sweep(store.redis)
    assert store.redis.llen(queue.intermediate_queue_key) == 0
    assert queue.get_job_ids() == [waiting]
    assert len(list(store.redis.scan_iter("rq:job:*"))) == 1


@pytest.mark.parametrize("entry", [b"\xff\xfe", b"", b"of another program", b"a" * 100_000])
def test_entries_that_are_no_wake_ups_end_no_worker(store: Store, entry: bytes) -> None:
    calls: list[int] = []

    def compute_tiles() -> None:
        calls.append(os.getpid())
        raise StopRequested

    queue = wake_ups.queue(store.redis, INFO.fingerprint, small=False)
    store.redis.rpush(queue.key, entry)
    wake_ups.wake_worker(store.redis, INFO.fingerprint, WAITING, small=False)
    TileWorker(store, INFO, compute_tiles).work(logging_level=None, burst=True)
    assert len(calls) == 1
    assert store.redis.llen(queue.key) == 0
    assert store.workers.live() == []


def rq_info(store: Store) -> str:
    """What RQ's own command prints of the queues and workers."""
    done = subprocess.run(
        [sys.executable, "-m", "rq.cli", "info", "--raw", "--url", redis_url(store.redis)],
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout


def redis_url(redis: Redis) -> str:
    settings = redis.connection_pool.connection_kwargs
    return f"unix://{settings['path']}" if "path" in settings else f"redis://{settings['host']}:{settings['port']}"


def test_rq_shows_the_job_whose_tiles_a_worker_computes(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []

    def compute_tiles() -> None:
        worker.stay_shown()
        (theirs,) = Worker.all(store.redis, serializer=JSONSerializer)
        assert theirs.get_current_job() is None  # in the first moment
        monkeypatch.setattr(tile_worker, "_SHOWN_AFTER_SECONDS", 0)
        for waiting in (WAITING, WaitingJob("trajectories", "b2")):
            worker.show(waiting)
            worker.stay_shown()
            (theirs,) = Worker.all(store.redis, serializer=JSONSerializer)
            current = theirs.get_current_job()
            assert current is not None
            shown.append(f"{theirs.get_state()} {current.description} {current.get_status().value}")
        shown.append(rq_info(store))

    wake_ups.wake_worker(store.redis, INFO.fingerprint, WAITING, small=False)
    (waiting,) = wake_ups.queue(store.redis, INFO.fingerprint, small=False).get_jobs()
    assert waiting.args == list(WAITING)
    worker = TileWorker(store, INFO, compute_tiles)
    worker.work(logging_level=None, burst=True)
    assert shown[:2] == ["busy unfolding-maps a1 started", "busy trajectories b2 started"]
    assert "1 executing, 0 finished, 0 failed" in shown[2]
    assert f"worker {INFO.name} " in shown[2]
    assert " busy " in shown[2]
    assert [key for key in keys_of(store.redis) if "job" in key or "execution" in key] == []


def test_what_a_killed_worker_was_shown_with_expires(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    class Killed(BaseException):
        """As if the worker ended here."""

    def compute_tiles() -> None:
        worker.stay_shown()
        worker.stay_shown()
        raise Killed

    monkeypatch.setattr(TileWorker, "_end", lambda *_: None)
    monkeypatch.setattr(tile_worker, "_SHOWN_SECONDS", 0)
    monkeypatch.setattr(tile_worker, "_SHOWN_AFTER_SECONDS", 0)
    wake_ups.wake_worker(store.redis, INFO.fingerprint, WAITING, small=False)
    worker = TileWorker(store, INFO, compute_tiles)
    worker.work(logging_level=None, burst=True)
    left = [key for key in keys_of(store.redis) if "job" in key or "execution" in key]
    assert len(left) == 3
    assert all(0 < store.redis.ttl(key) < 200 for key in left)
    (registry,) = store.redis.scan_iter("rq:wip:*")
    ((member, _),) = store.redis.zrange(registry, 0, -1, withscores=True)
    store.redis.zadd(registry, {member: 1.0})
    clean_up.QueueCleanUp(INFO.fingerprint).sweep(store.redis)
    assert store.redis.exists(registry) == 0


def test_an_entry_that_cannot_be_read_is_counted(store: Store) -> None:
    store.redis.rpush(wake_ups.queue(store.redis, INFO.fingerprint, small=False).key, b"\xff\xfe")
    TileWorker(store, INFO, lambda: None).work(logging_level=None, burst=True)
    assert store.counts().events == {"poisoned:entries": 1}


# What an entry tells of itself and nothing acts on: its call and name, its times, its limits (each tested), its worker.
INERT = {
    *("_id", "created_at", "connection", "serializer", "log", "redis_server_version"),
    *("_data", "_func_name", "_instance", "_args", "_kwargs", "description", "origin"),
    *("enqueued_at", "started_at", "ended_at", "last_heartbeat", "worker_name", "_status"),
    *("timeout", "result_ttl"),
    *("_result", "_exc_info", "_cached_result", "_unreadable_meta"),
    *(f"_{kind}_callback" for kind in ("success", "failure", "stopped")),
    *(f"_{kind}_callback_timeout" for kind in ("success", "failure", "stopped")),
}


def test_entries_that_the_service_enqueues_are_executed(store: Store) -> None:
    for _ in range(2):
        wake_ups.wake_worker(store.redis, "f", WAITING, small=True)
    jobs = wake_ups.queue(store.redis, "f", small=True).get_jobs()
    assert [refusal(job) for job in jobs] == [None] * 2


def test_each_hostile_entry_is_refused_with_its_reason(store: Store, tmp_path: Path) -> None:
    queue = wake_ups.queue(store.redis, "f", small=False)
    hostile = hostile_entries(tmp_path, queue)
    for entry, _ in hostile:
        queue.enqueue_job(entry)
    fetched = [Job.fetch(entry.id, store.redis, serializer=queue.serializer) for entry, _ in hostile]
    assert [refusal(entry) for entry in fetched] == [reason for _, reason in hostile]


def test_every_attribute_of_an_rq_job_is_known(store: Store) -> None:
    """A version of RQ with another attribute fails here: it acts, and belongs in `ACTING`, or it is inert."""
    job = wake_ups.queue(store.redis, "f", small=False).create_job(wake_ups.WAKE_UP_FUNCTION, args=WAITING, timeout=-1)
    acting = {name for changes, _ in ACTING for name in changes}
    assert set(vars(job)) - INERT == acting


def test_a_field_of_a_later_rq_is_refused(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    written = Job.to_dict
    monkeypatch.setattr(Job, "to_dict", lambda job: {**written(job), "planted": 1})
    job = wake_ups.queue(store.redis, "f", small=False).create_job(wake_ups.WAKE_UP_FUNCTION, args=WAITING, timeout=-1)
    assert refusal(job) == "carries planted"


def test_several_fields_are_all_named(store: Store) -> None:
    job = wake_ups.queue(store.redis, "f", small=False).create_job(wake_ups.WAKE_UP_FUNCTION, args=WAITING, timeout=-1)
    job.webhooks, job.repeats_left = [Webhook("http://127.0.0.1:9/", "finished")], 1
    assert refusal(job) == "carries repeats_left, webhooks"


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
    assert overridden(TileWorker, Worker) == [
        "__init__",
        "dequeue_job_and_maintain_ttl",
        "execute_job",
        "heartbeat",
        "request_stop",
        "run_maintenance_tasks",
        "subscribe",
        "teardown",
    ]
    assert differences(TileWorker, Worker) == []


def test_another_argument_of_rq_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    def execute_job(self: Worker, job: object, queue: object, planted: object) -> None:
        """As a later RQ might have it."""

    monkeypatch.setattr(Worker, "execute_job", execute_job)
    (difference,) = differences(TileWorker, Worker)
    assert difference.startswith("execute_job: RQ has [")
    assert "planted" in difference.partition(", ours")[0]


def test_a_removed_worker_leaves_nothing(store: Store) -> None:
    worker = TileWorker(store, INFO, lambda: None)
    worker.register_birth()  # type: ignore[no-untyped-call]
    assert store.redis.exists("rq:worker:w") == 1
    clean_up.forget_worker(store.redis, "w", INFO.fingerprint)
    assert [key for key in keys_of(store.redis) if "worker" in key] == []


PREFIXED = """
import sys
sys.path.insert(0, {folder!r})
from tests.support.planted import INFO, WAITING
from grazemap_worker.queue import clean_up, wake_ups
from grazemap_worker.queue.tile_worker import TileWorker
from grazemap_worker.store import Store, connect

store = Store(connect({url!r}))
for fingerprint in (INFO.fingerprint, "gone"):
    wake_ups.wake_worker(store.redis, fingerprint, WAITING, small=False)
worker = TileWorker(store, INFO, lambda: None)
worker.register_birth()
print(*sorted(key.decode() for key in store.redis.scan_iter()), sep="\\n")
clean_up.QueueCleanUp(INFO.fingerprint).sweep(store.redis)
clean_up.forget_worker(store.redis, "w", INFO.fingerprint)
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
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "another:worker:w" in done.stdout.split()
    assert [key for key in done.stdout.split() if key.startswith("rq:")] == []
    left = keys_of(store.redis)
    assert [key for key in left if key.startswith("rq:")] == []
    assert [key for key in left if "gone" in key or ":w" in key.removeprefix("another:wip")] == []

"""The whole stack as a person starts it: killed processes are restarted, and the bytes of a map do not change."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
import redis.exceptions

from grazemap_service.redis_server import NoRedisError, RedisServer
from grazemap_service.settings import StackSettings
from grazemap_worker import liveness
from grazemap_worker.store import connect
from tests.support.running_stack import MAP, RunningStack
from tests.support.watching import living, until

# minutes of two cores
LARGER_MAP = {**MAP, "omega": {"start": 0.26, "stop": 0.30, "points": 4000}}


@pytest.fixture(scope="module")
def stack(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningStack]:
    """One stack for the module, its data folder given and empty."""
    running = RunningStack("--data", str(tmp_path_factory.mktemp("data")))
    yield running
    running.stop()


@pytest.fixture(scope="module")
def undisturbed(stack: RunningStack) -> bytes:
    """The map as it is computed when nothing is killed or stopped, and forgotten again."""
    data = stack.wait_for(stack.request("/v1/unfolding-maps", MAP)["id"], 300)
    with contextlib.closing(connect(f"unix://{stack.redis_socket()}")) as redis:
        redis.flushall()
    return data


@pytest.fixture
def start() -> Iterator[Callable[..., RunningStack]]:
    """Start stacks of a test's own, which end with it, whatever becomes of it."""
    started: list[RunningStack] = []

    def begin(*options: str) -> RunningStack:
        started.append(RunningStack(*options))
        return started[-1]

    yield begin
    for running in started:
        if running.popen.poll() is None:
            running.stop()


def test_a_map_survives_every_kill_with_the_same_bytes(stack: RunningStack, undisturbed: bytes) -> None:
    identity = stack.request("/v1/unfolding-maps", MAP)["id"]

    def a_compute_process_is_killed() -> bool:
        with contextlib.suppress(psutil.NoSuchProcess):  # its tile may end before
            stack.a_busy_worker()[1].kill()
            return True
        return False

    until(a_compute_process_is_killed)

    worker, process = stack.a_busy_worker()
    worker.kill()
    until(lambda: not living([process]))

    until(lambda: stack.job(identity)["progress"]["done"] > 0)
    assert stack.job(identity)["status"] == "running", "the map was whole before everything was killed"
    for name in ("-m grazemap_service", "unixsocket:"):
        stack.child(name).kill()
    assert stack.wait_for(identity, 300) == undisturbed  # at the same address
    until(lambda: stack.request("/v1/status")["events"]["ended:redis"] == 1)
    events = stack.request("/v1/status")["events"]
    assert events["ended:service"] == 1
    assert events["ended:worker"] >= 1
    stack.request(f"/v1/jobs/{identity}", method="DELETE")


@pytest.mark.thorough
def test_a_stopped_service_and_supervisor_are_replaced(stack: RunningStack, undisturbed: bytes) -> None:
    """All workers are stopped with their supervisor, and the map is left to those that follow."""
    with contextlib.closing(connect(f"unix://{stack.redis_socket()}")) as redis:
        redis.flushall()
    identity = stack.request("/v1/unfolding-maps", MAP)["id"]
    stack.a_busy_worker()
    kept = stack.child("unixsocket:")
    service, supervisor = stack.child("-m grazemap_service"), stack.child("-m grazemap_worker")
    everything = [service, supervisor, *supervisor.children(recursive=True)]
    signalled(everything, psutil.Process.suspend)
    time.sleep(3)
    signalled(everything, psutil.Process.resume)  # in time
    until(lambda: stack.job(identity)["progress"]["done"] > 0)
    assert living([service, supervisor]) == [service, supervisor]
    assert stack.job(identity)["status"] == "running", "the map was whole before everything was stopped"

    everything = [service, supervisor, *supervisor.children(recursive=True)]
    signalled(everything, psutil.Process.suspend)
    until(lambda: not living(everything))
    assert stack.wait_for(identity, 300) == undisturbed
    assert {stack.child("-m grazemap_service"), stack.child("-m grazemap_worker")}.isdisjoint(everything)
    assert stack.child("unixsocket:") == kept


def signalled(processes: list[psutil.Process], signal_of: Callable[[psutil.Process], None]) -> None:
    """Stop or continue processes, of which some may have ended."""
    for process in processes:
        with contextlib.suppress(psutil.NoSuchProcess):
            signal_of(process)


def test_the_memory_of_its_redis_is_limited(stack: RunningStack) -> None:
    with contextlib.closing(connect(f"unix://{stack.redis_socket()}")) as redis:
        assert redis.config_get("maxmemory") == {"maxmemory": str(StackSettings().max_redis_bytes)}


@pytest.mark.parametrize("answered", [True, False], ids=["once up", "before it was asked"])
def test_a_redis_that_hangs_is_replaced_and_keeps_its_data(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answered: bool
) -> None:
    monkeypatch.setattr(liveness, "HUNG_SECONDS", 60.0 if answered else 2.0)
    server = RedisServer(tmp_path, silent_seconds=4.0)
    server.start()
    try:
        server.wait()
        connect(server.url).set("kept", "yes")
        assert server.has_loaded
        assert not answered or not server.look()
        time.sleep(1.1)  # the append-only file is written once a second
        hung = server.pid
        assert hung is not None
        psutil.Process(hung).suspend()
        until(server.look)
        until(lambda: server.look() or server.pid != hung)
        server.wait()
        assert connect(server.url).get("kept") == b"yes"
    finally:
        server.close()


def test_a_redis_that_loads_its_data_lives_but_may_still_refuse_them(tmp_path: Path) -> None:
    server = RedisServer(tmp_path)

    def answer() -> None:
        with listener.accept()[0] as connection:
            connection.recv(100)
            connection.sendall(b"-LOADING data\r\n")

    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(server.socket))
        listener.listen()
        answering = threading.Thread(target=answer)
        answering.start()
        assert server.heard()
        answering.join()
    assert not server.has_loaded
    server.close()


def test_a_redis_that_answers_is_not_restarted(tmp_path: Path) -> None:
    with RedisServer(tmp_path) as server:
        client = connect(server.url)
        client.config_set("maxclients", 1)
        assert server.answers(10.0)  # that it has no room
        client.config_set("maxclients", 100)
        script = connect(server.url, socket_timeout=0.2)
        client.config_set("lua-time-limit", 100)
        with contextlib.suppress(redis.exceptions.TimeoutError):
            script.eval("while true do end", 0)
        until(lambda: server.answers(0.5))  # that it is busy
        client.script_kill()
        pid = server.pid
        assert pid is not None
        psutil.Process(pid).suspend()
        assert not server.answers(0.5)
        psutil.Process(pid).resume()
        until(lambda: server.answers(0.5))


def test_data_of_a_newer_redis_are_not_ignored(tmp_path: Path) -> None:
    older = tmp_path / "redis-server"
    older.write_text("#!/bin/sh\necho Redis server v=6.2.14 sha=0\n")
    older.chmod(0o755)
    (tmp_path / "data" / "appendonlydir").mkdir(parents=True)
    with pytest.raises(NoRedisError, match=r"Redis 7\.0 or newer wrote .*data"), RedisServer(tmp_path / "data", older):
        pass


def test_deleting_a_job_stops_its_work_soon(stack: RunningStack) -> None:
    identity = stack.request("/v1/unfolding-maps", LARGER_MAP)["id"]
    stack.a_busy_worker()
    assert stack.request(f"/v1/jobs/{identity}", method="DELETE")["status"] == "dismissed"
    until(lambda: not stack.busy_workers(), 20)  # a map of minutes
    assert len(living(stack.child("grazemap_worker").children())) == 4  # two for small tiles


@pytest.mark.thorough
def test_nothing_outlives_a_killed_stack(start: Callable[..., RunningStack], tmp_path: Path) -> None:
    running = start("--data", str(tmp_path / "data"), "--ready-file", str(tmp_path / "ready"))
    assert json.loads((tmp_path / "ready").read_text())["url"] == running.url
    running.request("/v1/unfolding-maps", LARGER_MAP)
    running.a_busy_worker()
    everything = running.process.children(recursive=True)
    assert len(everything) >= 6  # Redis, service, supervisor, two workers, a compute process
    # no TCP port but the service's, and the socket is for this user alone
    redis = running.child("unixsocket:")
    assert [entry for entry in redis.net_connections("tcp") if entry.status == psutil.CONN_LISTEN] == []
    socket = running.redis_socket()
    assert socket.stat().st_mode & 0o777 == 0o600
    assert socket.parent.stat().st_mode & 0o777 == 0o700
    running.process.kill()
    running.popen.wait()
    until(lambda: not living(everything))

    # and the next one on the same data goes on where it was
    again = start("--data", str(tmp_path / "data"))
    jobs = again.request("/v1/jobs")["jobs"]
    assert [job["status"] for job in jobs] in (["accepted"], ["running"])
    with pytest.raises(subprocess.CalledProcessError) as caught:
        subprocess.run(
            [sys.executable, "-m", "grazemap_service.stack", "--data", str(tmp_path / "data")],
            check=True,
            capture_output=True,
            timeout=120,
        )
    assert b"another stack" in caught.value.stderr
    again.request(f"/v1/jobs/{jobs[0]['id']}", method="DELETE")
    again.stop()


@pytest.mark.thorough
def test_there_is_never_a_second_redis_on_the_same_data(start: Callable[..., RunningStack], tmp_path: Path) -> None:
    options = ["--data", str(tmp_path / "data")]
    running = start(*options)
    redis = running.child("unixsocket:")
    redis.suspend()  # so that it cannot end with its parent
    running.process.kill()
    running.popen.wait()
    command = [sys.executable, "-m", "grazemap_service.stack", "--workers", "1", *options]
    try:
        refused = subprocess.run(command, capture_output=True, timeout=120, check=False)
        assert refused.returncode == 1
        assert b"another stack" in refused.stderr
        again = subprocess.Popen(command, stdout=subprocess.PIPE)
        time.sleep(1)
        assert again.poll() is None
        redis.resume()
        assert again.stdout is not None
        assert json.loads(again.stdout.readline())["url"]
        assert not living([redis])
        again.terminate()
        assert again.wait(60) == 0
        again.stdout.close()
    finally:
        if redis.is_running():
            redis.kill()


def test_a_stack_says_that_it_waits_for_another_one_on_its_data(tmp_path: Path) -> None:
    ready = tmp_path / "ready"
    ready.touch()  # of the other one
    command = [sys.executable, "-m", "grazemap_service.stack", "--talk", "--data", str(tmp_path)]
    with (tmp_path / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        refused = subprocess.run([*command, "--ready-file", str(ready)], capture_output=True, timeout=120, check=False)
    messages = [json.loads(line)["starting"] for line in refused.stdout.splitlines()]
    assert messages.count(f"waiting for another stack that uses {tmp_path}") >= 3
    assert refused.returncode == 1
    assert ready.exists()


def test_a_folder_that_cannot_be_created_is_reported(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for folder in ("/proc/grazemap", str(tmp_path / "file" / "below")):
        answer = subprocess.run(
            [sys.executable, "-m", "grazemap_service.stack", "--data", folder],
            capture_output=True,
            timeout=120,
            check=False,
        )
        assert answer.returncode == 1
        assert folder.encode() in answer.stderr
        assert b"Traceback" not in answer.stderr


@pytest.mark.thorough
def test_a_stack_that_starts_slowly_reports_what_it_waits_for(tmp_path: Path) -> None:
    # nobody answers at this address of Redis
    environment = {**os.environ, "GRAZEMAP_REDIS_URL": f"unix://{tmp_path}/none"}
    stack = subprocess.Popen(
        [sys.executable, "-m", "grazemap_service.stack", "--data", str(tmp_path / "data"), "--workers", "1"],
        env=environment,
        stderr=subprocess.PIPE,
    )
    try:
        assert stack.stderr is not None
        line = json.loads(stack.stderr.readline())
        assert line["level"] == "warning"
        assert line["reason"].startswith("Redis is unavailable")
    finally:
        stack.terminate()
        assert stack.wait(60) == 0
        assert stack.stderr is not None
        stack.stderr.close()


@pytest.mark.thorough
def test_a_stack_that_cannot_start_reports_the_reason(tmp_path: Path) -> None:
    for options, environment, words in (
        (["--host", "0.0.0.0"], {}, b"without keys"),
        ([], {"GRAZEMAP_MAX_BODY_BYTES": "many"}, b"GRAZEMAP_MAX_BODY_BYTES"),
    ):
        answer = subprocess.run(
            [sys.executable, "-m", "grazemap_service.stack", "--data", str(tmp_path / "data"), *options],
            env={**os.environ, **environment},
            capture_output=True,
            timeout=120,
            check=False,
        )
        assert answer.returncode == 1
        assert words in answer.stderr, answer.stderr
        assert answer.stdout == b""

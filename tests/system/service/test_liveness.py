"""A child of the stack that hangs is noticed; one that is busy, or starts slowly, is left alone."""

from __future__ import annotations

import os
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from grazemap_service import children
from grazemap_service.children import PythonChild
from grazemap_worker import liveness, restarts, system, watchdog
from grazemap_worker.liveness import Liveness, Stopwatch
from grazemap_worker.restarts import Restarts
from grazemap_worker.watchdog import WatchdogSocket
from tests.support.watching import until

BEATS = "import time\nfrom grazemap_worker.watchdog import beat\n"

Start = Callable[[str], PythonChild]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Start a child that runs a program; it hangs after fewer seconds than usual."""
    monkeypatch.setattr(children, "SILENT_SECONDS", 1.0)
    monkeypatch.setattr(liveness, "HUNG_SECONDS", 1.0)
    started: list[PythonChild] = []
    with tempfile.TemporaryDirectory() as folder:  # with a short name

        def begin(program: str) -> PythonChild:
            watched = WatchdogSocket(Path(folder) / f"{len(started)}")
            command = [sys.executable, "-c", program]
            started.append(PythonChild("child", command, os.environ, tmp_path / "log", watched))
            started[-1].start()
            return started[-1]

        yield begin
        for child in started:
            child.end(0)


def looked_after(child: PythonChild, seconds: float) -> bool:
    """Look after a child for so long; return whether it ended."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if child.look():
            return True
        time.sleep(0.05)
    return False


def test_a_child_that_is_silent_after_it_has_spoken_is_replaced(start: Start) -> None:
    child = start(BEATS + "beat()\ntime.sleep(60)")
    first = child.pid
    assert looked_after(child, 20)
    until(lambda: child.look() or child.pid != first, 5)
    assert child.running


def test_a_child_that_is_stopped_is_replaced_even_before_it_has_spoken(start: Start) -> None:
    child = start("import time\ntime.sleep(60)")
    assert not looked_after(child, 2.5)
    psutil.Process(child.pid).suspend()
    assert looked_after(child, 5)


def test_a_child_that_goes_on_is_left_alone(start: Start) -> None:
    child = start(BEATS + "while True:\n    beat()\n    time.sleep(0.3)")
    assert not looked_after(child, 4)


def test_a_pause_of_the_watcher_is_not_one_of_the_watched(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(liveness.time, "monotonic", lambda: now[0])
    stopwatch = Stopwatch()
    now[0] += 3600.0
    assert stopwatch.look(reset=False) < children.SILENT_SECONDS / 2
    for _ in range(100):
        now[0] += 0.1
        seconds = stopwatch.look(reset=False)
    assert seconds == pytest.approx(13.0)
    assert stopwatch.look(reset=True) == 0.0


def test_silence_counts_from_the_last_sign_and_is_longer_at_first(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(liveness.time, "monotonic", lambda: now[0])
    watched = Liveness(os.getpid(), silent_seconds=5.0, first_seconds=20.0)

    def seconds_until_it_hangs() -> float:
        began = now[0]
        while not watched.hangs():
            now[0] += 0.1
        return now[0] - began

    assert seconds_until_it_hangs() == pytest.approx(20.0, abs=0.2)
    assert not watched.hangs(heard=True)
    assert seconds_until_it_hangs() == pytest.approx(5.0, abs=0.2)


def test_one_that_ends_again_and_again_is_started_after_pauses(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(restarts.time, "monotonic", lambda: now[0])
    ends = Restarts()

    def pause(lived: float, *, blameless: bool = False) -> float:
        ends.started()
        now[0] += lived
        ends.ended(blameless=blameless)
        began = now[0]
        while not ends.due:
            now[0] += 0.01
        return now[0] - began

    assert pause(1.0) == 0.0  # the first time at once
    assert [pause(1.0) for _ in range(6)] == pytest.approx([0.4, 0.8, 1.6, 3.2, 5.0, 5.0], abs=0.02)
    assert ends.deaths == 7
    assert pause(1.0, blameless=True) == 0.0
    assert pause(1.0) == pytest.approx(0.4, abs=0.02)
    assert pause(11.0) == 0.0
    assert ends.deaths == 1


@pytest.fixture
def heard(monkeypatch: pytest.MonkeyPatch) -> Iterator[socket.socket]:
    """The socket on which this process is heard."""
    with tempfile.TemporaryDirectory() as folder, socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as receiver:
        receiver.bind(f"{folder}/socket")
        receiver.settimeout(5)
        monkeypatch.setenv("NOTIFY_SOCKET", f"{folder}/socket")
        yield receiver


@pytest.mark.skipif(not system.LINUX, reason="threads have no clock of their own on every system")
def test_a_main_thread_that_waits_is_not_said_to_go_on(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watchdog, "INTERVAL_SECONDS", 0.1)
    others = threading.enumerate()  # such as that of a service which other tests share, and which beats too
    beats: list[float] = []

    def beat() -> None:
        if threading.current_thread() not in others:
            beats.append(time.monotonic())

    monkeypatch.setattr(watchdog, "beat", beat)
    with watchdog.beating():
        # the thread that is woken uses processor time too, and on a busy machine an interval lasts longer
        for _ in range(10):
            beats.clear()
            threading.Event().wait(1.0)
            if len(beats) <= 1:
                break
        assert len(beats) <= 1
        beats.clear()
        deadline = time.monotonic() + 1.0
        while time.monotonic() < deadline:
            pass
        assert len(beats) >= 3


def test_a_watcher_that_does_not_read_is_not_waited_for(heard: socket.socket) -> None:
    began = time.monotonic()
    for _ in range(1000):
        watchdog.beat()
    assert time.monotonic() - began < 20
    assert heard.recv(100) == b"WATCHDOG=1"

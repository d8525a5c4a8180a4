"""What a tile may allocate follows from the memory of the machine; and what processes give back when they rest."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from grazemap_worker import system
from grazemap_worker.settings import WorkerSettings, default_memory
from grazemap_worker.system import machine_memory

GIB = 1 << 30
UNLIMITED = str(0x7FFFFFFFFFFFF000)


def write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def machine(tmp_path: Path) -> Path:
    """A machine of 8 GiB without control groups."""
    write(tmp_path / "proc/meminfo", "MemTotal:        8388608 kB\nMemFree: 1 kB\n")
    return tmp_path


def memory(machine: Path) -> int | None:
    return machine_memory(machine / "proc", machine / "cgroup")


@pytest.mark.skipif(not system.LINUX, reason="control groups are of Linux")
def test_of_a_machine_without_control_groups(machine: Path) -> None:
    assert memory(machine) == 8 * GIB


@pytest.mark.skipif(not system.LINUX, reason="control groups are of Linux")
@pytest.mark.parametrize(
    ("listed", "limits", "expected"),
    [
        ("0::/a/b\n", {"a/b/memory.max": "max", "a/memory.max": str(3 * GIB)}, 3 * GIB),
        ("0::/a/b\n", {"a/b/memory.max": str(GIB), "a/memory.max": str(3 * GIB)}, GIB),
        ("0::/../of/the/host\n", {"memory.max": str(GIB)}, GIB),
        ("0::/\n", {"memory.max": "max\n"}, 8 * GIB),
        ("4:memory:/a\n1:cpu:/a\n0::/\n", {"memory/a/memory.limit_in_bytes": f"{GIB}\n"}, GIB),
        ("4:cpu,memory:/docker/x\n", {"memory/memory.limit_in_bytes": str(GIB)}, GIB),
        ("4:memory:/a\n", {"memory/a/memory.limit_in_bytes": UNLIMITED}, 8 * GIB),
        ("1:cpu:/a\n", {"memory/a/memory.limit_in_bytes": str(GIB)}, 8 * GIB),
    ],
    ids=["2, above", "2, own", "2, of a host", "2, none", "1", "1, of a host", "1, none", "of another controller"],
)
def test_of_a_control_group(machine: Path, listed: str, limits: dict[str, str], expected: int) -> None:
    write(machine / "proc/self/cgroup", listed)
    for name, text in limits.items():
        write(machine / "cgroup" / name, text)
    assert memory(machine) == expected


def test_where_nothing_is_known(tmp_path: Path) -> None:
    assert not system.LINUX or memory(tmp_path) is None
    assert default_memory(4, None) == 2 * GIB


@pytest.mark.parametrize(
    ("workers", "gib", "expected"), [(2, 64, 2 * GIB), (2, 4, GIB), (14, 4, GIB // 4), (1022, 1, 1 << 26)]
)
def test_the_workers_share_the_memory(workers: int, gib: int, expected: int) -> None:
    assert default_memory(workers, gib * GIB) == expected


def test_it_is_the_default_of_the_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("grazemap_worker.settings.machine_memory", lambda: 4 * GIB)
    assert WorkerSettings(workers=2).memory_bytes == GIB
    monkeypatch.setenv("GRAZEMAP_WORKERS", "6")
    assert WorkerSettings().memory_bytes == GIB // 2
    assert WorkerSettings(memory_bytes=3 * GIB).memory_bytes == 3 * GIB


SMAPS = """\
7f00-7f10 r-xp 00000000 fe:00 1    /usr/lib/libone.so
Size:                 64 kB
Anonymous:             0 kB
7f10-7f20 r--p 00000000 fe:00 1    /usr/lib/relocated.so
Anonymous:             4 kB
7f20-7f30 rw-p 00000000 fe:00 1    /usr/lib/written.so
Anonymous:             0 kB
7f30-7f40 r--s 00000000 fe:00 1    /dev/shared
Anonymous:             0 kB
7f40-7f50 r-xp 00000000 00:00 0    [vdso]
Anonymous:             0 kB
7f50-7f60 r--p 00000000 00:00 0
Anonymous:             0 kB
"""


def test_only_pages_that_are_those_of_a_file_are_given_back() -> None:
    assert list(system._clean_mappings(SMAPS)) == [(0x7F00, 0x7F10)]


@pytest.mark.skipif(not system.LINUX, reason="other systems do not give memory back")
def test_a_process_has_less_memory_after_a_release_and_goes_on() -> None:
    code = (
        "import psutil, numpy, scipy.linalg, numba; from grazemap_worker.system import release_memory;"
        "before = psutil.Process().memory_info().rss; release_memory(); after = psutil.Process().memory_info().rss;"
        "assert after < 0.8 * before, (before, after);"
        "assert scipy.linalg.solve(numpy.eye(2), numpy.ones(2)).tolist() == [1.0, 1.0];"
        "assert numba.njit(lambda x: x + 1)(1) == 2"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


def test_memory_is_released_once_after_work_and_rest(monkeypatch: pytest.MonkeyPatch) -> None:
    now, spent, released = [0.0], [0.0], []
    monkeypatch.setattr(system.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(system.time, "process_time", lambda: spent[0])
    monkeypatch.setattr(system, "release_memory", lambda: released.append(now[0]))
    idle = system.IdleMemory()

    def pass_time(seconds: float, share: float) -> None:
        for _ in range(int(seconds)):
            now[0], spent[0] = now[0] + 1.0, spent[0] + share
            idle.look()

    pass_time(30.0, 0.5)
    assert released == []
    pass_time(100.0, 0.001)
    assert released == [46.0]
    pass_time(2.0, 0.5)
    pass_time(100.0, 0.001)
    assert released == [46.0, 148.0]


WATCHED = """
import subprocess, sys, time
from grazemap_worker import watchdog
if sys.argv[1:]:
    while True:
        watchdog.beat()
        time.sleep(0.05)
child = subprocess.Popen([sys.executable, *sys.orig_argv[1:], "child"])
print(child.pid, flush=True)
time.sleep(60)
"""


def test_elsewhere_a_watched_process_ends_soon_after_a_killed_parent(tmp_path: Path) -> None:
    environment = os.environ | {"GRAZEMAP_SYSTEM": "portable", "NOTIFY_SOCKET": str(tmp_path / "socket")}
    command = [sys.executable, "-c", WATCHED]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        child = psutil.Process(int(parent.stdout.readline()))
        time.sleep(1.0)
        assert child.is_running()
        parent.kill()
    psutil.wait_procs([child], timeout=10)
    assert not child.is_running() or child.status() == psutil.STATUS_ZOMBIE


def test_elsewhere_processes_are_looked_at_as_on_linux() -> None:
    code = (
        "import os, signal, subprocess, sys; from grazemap_worker import system as s;"
        "assert not s.LINUX; assert s.process_stat(1 << 22) is None; assert s.machine_memory() > 1 << 28;"
        "child = subprocess.Popen([sys.executable, '-c', 'while True: pass']);"
        "import time; time.sleep(1.0);"
        "assert s.children_seconds(os.getpid()) > 0.1 and s.process_stat(child.pid).state != 'T';"
        "child.send_signal(signal.SIGSTOP); time.sleep(0.2);"
        "assert s.process_stat(child.pid).state == 'T'; child.kill()"
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, timeout=60, env=os.environ | {"GRAZEMAP_SYSTEM": "portable"}
    )

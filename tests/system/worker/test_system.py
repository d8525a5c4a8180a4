"""What a tile may allocate follows from the memory of the machine and of its control groups, of both versions."""

from __future__ import annotations

from pathlib import Path

import pytest

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


def test_of_a_machine_without_control_groups(machine: Path) -> None:
    assert memory(machine) == 8 * GIB


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
    assert memory(tmp_path) is None
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

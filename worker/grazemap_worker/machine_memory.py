"""The memory of this machine, or what its control groups (versions 1 and 2) leave to this process; Linux."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PROC = Path("/proc")
_CONTROL_GROUPS = Path("/sys/fs/cgroup")


def machine_memory(proc: Path = _PROC, control_groups: Path = _CONTROL_GROUPS) -> int | None:
    """Return the bytes of memory that the processes of this control group may have together; None: not known."""
    found = [*_of_machine(proc / "meminfo"), *_of_control_groups(proc / "self" / "cgroup", control_groups)]
    return min(found, default=None)


def _of_machine(meminfo: Path) -> Iterator[int]:
    for line in _lines(meminfo):
        name, _, value = line.partition(":")
        if name == "MemTotal":
            yield int(value.split()[0]) * 1024


def _of_control_groups(listed: Path, mounted: Path) -> Iterator[int]:
    """Yield the limits of a process's control groups, and of those that contain them."""
    for line in _lines(listed):
        _, controllers, path = line.split(":", 2)
        if controllers == "":  # version 2
            folder, name = mounted, "memory.max"
        elif "memory" in controllers.split(","):
            folder, name = mounted / "memory", "memory.limit_in_bytes"
        else:
            continue
        # in a container the path may be one of the host, of which only the root is there
        group = folder / path.lstrip("/")
        for one in (group, *group.parents):
            for text in _lines(one / name):
                if text.strip().isdigit():  # or "max"
                    yield int(text)
            if one == folder:
                break


def _lines(path: Path) -> list[str]:
    with suppress(OSError, UnicodeDecodeError):
        return path.read_text("ascii").splitlines()
    return []

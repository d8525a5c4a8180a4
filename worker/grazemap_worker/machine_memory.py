"""The memory of this machine, or the limit of this process's control groups (versions 1 and 2); Linux."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PROC = Path("/proc")
_CONTROL_GROUPS = Path("/sys/fs/cgroup")


def machine_memory(proc: Path = _PROC, control_groups: Path = _CONTROL_GROUPS) -> int | None:
    """Return the bytes of memory that the processes of this control group may use together; None: not known."""
    limits = [*_installed_bytes(proc / "meminfo"), *_group_limits(proc / "self" / "cgroup", control_groups)]
    return min(limits, default=None)


def _installed_bytes(meminfo: Path) -> Iterator[int]:
    for line in _lines(meminfo):
        name, _, value = line.partition(":")
        if name == "MemTotal":
            yield int(value.split()[0]) * 1024


def _group_limits(cgroup: Path, mounted: Path) -> Iterator[int]:
    """Yield the limits of a process's control groups and of the groups that contain them."""
    for line in _lines(cgroup):
        _, controllers, path = line.split(":", 2)
        if controllers == "":  # version 2
            folder, name = mounted, "memory.max"
        elif "memory" in controllers.split(","):
            folder, name = mounted / "memory", "memory.limit_in_bytes"
        else:
            continue
        # in a container the path may be that of the host, and only the root of it is mounted
        group = folder / path.lstrip("/")
        for ancestor in (group, *group.parents):
            for text in _lines(ancestor / name):
                if text.strip().isdigit():  # or "max"
                    yield int(text)
            if ancestor == folder:
                break


def _lines(path: Path) -> list[str]:
    with suppress(OSError, UnicodeDecodeError):
        return path.read_text("ascii").splitlines()
    return []

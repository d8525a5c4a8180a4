"""A stack in 4 GiB: `python -m tests.slow.small_machine`, or `make small-machine`, as root on Linux.

`grazemap up` starts in a control group of that size, of version 1 or 2, with an empty folder of kernels. While it
compiles them, every example of every process is asked, and after them a map of 512 x 512 points with observables. All
have to succeed, and the system must not have killed a process for want of memory. The peak is printed.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from grazemap import Client
from grazemap.errors import GrazemapError
from grazemap.module_command import module_command
from grazemap.wire import PROCESSES
from tools.first_start import started

BYTES = 4 << 30
_MOUNTED = Path("/sys/fs/cgroup")
_MAP = {
    "omega": {"start": 0.26, "stop": 0.3, "points": 512},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 512},
    "observables": ["rms_displacement", "dissipated_power"],
}


class ControlGroup(NamedTuple):
    """A control group that limits memory: its folder, and the names of its files in its version."""

    folder: Path
    limit: str
    peak: str
    events: str

    def read(self, name: str) -> str:
        """Return the text of a file."""
        return (self.folder / name).read_text("ascii")

    @property
    def killed(self) -> int:
        """How many of its processes the system has killed for want of memory."""
        return int(dict(line.split() for line in self.read(self.events).splitlines()).get("oom_kill", 0))


@contextmanager
def control_group() -> Iterator[ControlGroup]:
    """Make a control group of `BYTES`, and remove it at the end. Raises OSError where that is not allowed."""
    controllers = _MOUNTED / "cgroup.controllers"
    if controllers.exists() and "memory" in controllers.read_text("ascii").split():
        group = ControlGroup(_MOUNTED / "grazemap-small", "memory.max", "memory.peak", "memory.events")
    else:
        folder = _MOUNTED / "memory/grazemap-small"
        group = ControlGroup(folder, "memory.limit_in_bytes", "memory.max_usage_in_bytes", "memory.oom_control")
    group.folder.mkdir()
    try:
        (group.folder / group.limit).write_text(str(BYTES), "ascii")
        yield group
    finally:
        group.folder.rmdir()


def main() -> int:
    """Run everything; return 1 if a job fails or a process was killed."""
    failed = 0
    with control_group() as group, tempfile.TemporaryDirectory() as folder:
        # a shell that joins the group becomes the stack, and its children are in the group too
        join = f'echo $$ > {group.folder}/cgroup.procs && exec "$@"'
        command = ["sh", "-c", join, "sh", *module_command("grazemap.cli", "up", "--port", "0")]
        environment = os.environ | {"GRAZEMAP_CACHE_DIR": f"{folder}/kernels"}
        with started(command, environment, Path(folder)) as stack, Client(stack.url) as client:
            asked = [
                (f"{name}: {title}", client.submit(name, example))
                for name, process in PROCESSES.items()
                for title, example in process.operation.examples.items()
            ]
            asked.append(("unfolding-maps: 512 x 512 with observables", client.submit("unfolding-maps", _MAP)))
            for title, job in asked:
                try:
                    job.wait(timeout=1200.0)
                except GrazemapError as error:
                    failed += 1
                    print(f"{title}: {error}", flush=True)
        peak, killed = int(group.read(group.peak)) / 2**30, group.killed
        print(f"{len(asked)} jobs in {BYTES >> 30} GiB ({group.limit}): {failed} failed, peak {peak:.2f} GiB", end="")
        print(f" with files, {killed} processes killed")
    return 1 if failed or killed else 0


if __name__ == "__main__":
    sys.exit(main())

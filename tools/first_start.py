"""The first start of `grazemap up`: what a user sees of it, and when.

`python -m tools.first_start` (`make first-start`) installs the wheel with the newest dependencies for every Python
below. With a fresh user folder each time it starts `grazemap up`, once on an idle machine and once on a busy one, and
prints when the first line was written, the longest time without a line, and when it answered. It exits with 1 when a
start was silent for too long or did not answer. The limits are for the reference machine of `tools.pace`, idle or
beside as many busy processes; on a slower one they are longer in proportion, which is said first. A Python that is not
on this machine is named in the table.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tomllib
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from tools.pace import pace

ROOT = Path(__file__).parents[1]
_PYTHON = "Programming Language :: Python :: "
_DECLARED = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["classifiers"]
PYTHONS = tuple(entry.removeprefix(_PYTHON) for entry in _DECLARED if entry.startswith(_PYTHON))
"""The versions of Python that the package declares, the oldest first."""
LOADS = {"idle": 0, "4 busy processes": 4}
_REFERENCE_CORES = 2
FIRST_WORD_SECONDS = 1.0
# A line every second, and a quarter for its way through three processes that wait for a processor.
SILENCE_SECONDS = 1.25
ANSWER_SECONDS = 600.0
STOP_SECONDS = 15.0
_ANSWERS = re.compile(r"explorer +(http://\S+)/\n")
# Settings of the person who runs this, which a new user does not have.
_NOT_INHERITED = re.compile(r"(GRAZEMAP|NUMBA|XDG|PYTHON|VIRTUAL_ENV)", re.IGNORECASE)


class Start(NamedTuple):
    """A start of `grazemap up`: the seconds after which each of its lines was written, and its address."""

    seconds: list[float]
    url: str

    @property
    def silence(self) -> float:
        """The longest time between two lines, in seconds."""
        return max((later - earlier for earlier, later in pairwise(self.seconds)), default=0.0)


@contextmanager
def started(command: Sequence[str], environment: Mapping[str, str], folder: Path) -> Iterator[Start]:
    """Start `grazemap up`; it runs until the end of the block.

    Raises
    ------
    RuntimeError
        It did not answer in time; the message holds its lines.
    subprocess.SubprocessError
        It did not end in time, or not in order.
    """
    began = time.monotonic()
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
        env=environment,
        cwd=folder,
    ) as up:
        assert up.stdout is not None
        limit = threading.Timer(ANSWER_SECONDS, os.killpg, (up.pid, signal.SIGKILL))
        limit.start()
        lines: list[str] = []
        seconds: list[float] = []
        try:
            for line in up.stdout:
                lines.append(line)
                seconds.append(time.monotonic() - began)
                if answer := _ANSWERS.fullmatch(line):
                    yield Start(seconds, answer[1])
                    break
            else:
                raise RuntimeError(f"it did not answer:\n{''.join(lines)}")
        finally:
            limit.cancel()
            if up.poll() is None:
                os.killpg(up.pid, signal.SIGINT)
            code = up.wait(STOP_SECONDS)
    if code != 0:
        raise subprocess.CalledProcessError(code, command)


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """Keep so many processes busy within the block."""
    running = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for process in running:
            process.kill()
            process.wait()


def interpreter(version: str) -> Path | None:
    """Return a Python of a version on this machine; None where there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    on_path = shutil.which(f"python{version}")
    for python in (*([Path(on_path)] if on_path else []), *sorted(pyenv.glob(f"{version}.*/bin/python{version}"))):
        # a shim of pyenv may stand for a version that is not chosen
        if subprocess.run([python, "-c", ""], capture_output=True, check=False).returncode == 0:
            return python
    return None


def installed(python: Path, wheel: Path, folder: Path) -> Path:
    """Install the wheel with the newest dependencies into a new environment and return the command `grazemap`."""
    subprocess.run([python, "-m", "venv", folder], check=True)
    command = [str(folder / "bin" / "python"), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    subprocess.run([*command, f"{wheel}[server]"], check=True)
    return folder / "bin" / "grazemap"


def user(home: str) -> dict[str, str]:
    """Return the environment of a new user with this folder."""
    return {name: value for name, value in os.environ.items() if not _NOT_INHERITED.match(name)} | {"HOME": home}


def first_start(grazemap: Path, processes: int) -> Start:
    """Start `grazemap up` with a fresh user folder beside some busy processes, and stop it when it has answered."""
    with (
        tempfile.TemporaryDirectory() as home,
        busy(processes),
        started([str(grazemap), "up", "--port", "0"], user(home), Path(home)) as start,
    ):
        with urllib.request.urlopen(f"{start.url}/readyz", timeout=10) as answer:
            answer.read()
        return start


def main() -> int:
    """Measure every start and print the table; return the exit status."""
    failed = False
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", name]
        subprocess.run(build, cwd=ROOT, check=True)
        (wheel,) = folder.glob("*.whl")
        slower = {}
        for load, processes in LOADS.items():
            with busy(processes):
                of_busy_reference = max(1.0, (processes + 1) / _REFERENCE_CORES)
                slower[load] = max(1.0, pace() / of_busy_reference)
            print(f"{load}: limits {slower[load]:.2f} times those of the reference", flush=True)
        print(f"{'Python':<8}{'load':<18}{'first line':>12}{'longest silence':>17}{'answers':>10}", flush=True)
        for version in PYTHONS:
            python = interpreter(version)
            if python is None:
                print(f"{version:<8}not on this machine", flush=True)
                continue
            grazemap = installed(python, wheel, folder / version)
            for load, processes in LOADS.items():
                start = first_start(grazemap, processes)
                first, answers = start.seconds[0], start.seconds[-1]
                times = slower[load]
                wrong = first > FIRST_WORD_SECONDS * times or start.silence > SILENCE_SECONDS * times
                failed |= wrong
                figures = f"{first:>10.2f} s{start.silence:>15.2f} s{answers:>8.1f} s"
                print(f"{version:<8}{load:<18}{figures}{'  too long' if wrong else ''}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

"""The command `status`: what a running service does, what waits, what is stored, and what has failed."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from grazemap import constants
from grazemap.cli.exit_codes import DONE, FAILED, printing, say
from grazemap.errors import GrazemapError

if TYPE_CHECKING:
    from grazemap.client import Client
    from grazemap.client.client import JobHandle
    from grazemap.wire import ServiceStatus, Status

# Seconds between two requests of `--watch`.
_REFRESH_SECONDS = 2.0
# Maximum number of jobs of each status that are listed.
_MAX_LISTED: dict[Status, int] = {"running": 20, "accepted": 5, "failed": 3}
_CLEAR = "\x1b[H\x1b[J"


def add_arguments(status: argparse.ArgumentParser, _: str) -> None:
    """Add the arguments of the command to its parser."""
    status.add_argument(
        "--url", help=f"address of a running service (default: GRAZEMAP_URL, else {constants.DEFAULT_BASE_URL})"
    )
    status.add_argument("--json", action="store_true", help="print the service's own answer, for programs")
    status.add_argument("--watch", action="store_true", help="show it again every two seconds, until Ctrl-C")
    status.set_defaults(command=_status)


def _status(options: argparse.Namespace) -> int:
    from grazemap.cli.clients import client_of  # with the client

    with client_of(options.url, retries=0) as client:
        if options.watch:
            with printing():
                _watch(client, options.json)
            return DONE
        text, ready = _shown(client, options.json)
        with printing():
            print(text)
    return DONE if ready else FAILED


def _watch(client: Client, as_json: bool) -> None:
    """Show the service until Ctrl-C. A failure is shown in its place, but not among lines of JSON."""
    while True:
        try:
            text = _shown(client, as_json)[0]
            print(text if as_json else _CLEAR + text, flush=True)
        except GrazemapError as error:
            text = f"{client.base_url}: {error}"
            if as_json:
                say(text)
            else:
                print(_CLEAR + text, flush=True)
        time.sleep(_REFRESH_SECONDS)


def _shown(client: Client, as_json: bool) -> tuple[str, bool]:
    """Return the text, and whether the service is ready."""
    status = client.status()
    if as_json:
        return json.dumps(status.model_dump(mode="json")), status.ready
    lines = [f"service   {client.base_url}, version {status.version}", *_lines(status)]
    for name, most in _MAX_LISTED.items():
        jobs = client.jobs(status=name, limit=most) if status.jobs.get(name) else []
        lines += [f"{name:<10}{_job(job)}" for job in jobs]
        if status.jobs.get(name, 0) > len(jobs):
            lines.append(f"{'':<10}and {status.jobs[name] - len(jobs)} other {name} jobs")
    return "\n".join(lines), status.ready


def _lines(status: ServiceStatus) -> Iterator[str]:
    state = "ready" if status.ready else "not ready"
    yield f"state     {state}: {status.detail}" if status.detail else f"state     {state}"
    ordinary, small = (
        [worker for worker in status.workers if worker.small == small_jobs] for small_jobs in (False, True)
    )
    busy = sum(worker.computes is not None for worker in status.workers)
    yield f"workers   {len(ordinary)}, and {len(small)} for small jobs; {busy} compute"
    for work in (worker.computes for worker in ordinary):
        if work is not None:
            tile = "joins the tiles" if work.tile < 0 else f"tile {work.tile}"
            yield f"          {work.process} {work.job[:12]}, {tile}, for {_time(work.seconds)}"
    yield f"queue     {status.pending_tiles} unfinished tiles; the longest in work for {_time(status.claimed_seconds)}"
    for lane, waiting in status.waiting.items():
        if waiting.jobs:
            yield f"          {waiting.jobs} {lane} jobs wait, one for {_time(waiting.seconds)}"
    stored = sum(size for kind, size in status.stored_bytes.items() if kind != "requests")
    budget = "" if status.budget_bytes is None else f" of {_size(status.budget_bytes)}"
    yield f"store     {_size(stored)}{budget}, requests {_size(status.stored_bytes.get('requests', 0))}"
    text = ", ".join(f"{kind} {number}" for kind, number in status.events.items() if number)
    yield f"failures  {text or 'none'}"


def _job(job: JobHandle) -> str:
    """Return a line about a job."""
    progress = job.progress
    text = f"{progress.done}/{progress.total} {progress.unit}"
    if job.status == "running" and progress.eta_seconds is not None:
        text += f", about {_time(progress.eta_seconds)} left"
    if job.problem is not None:
        text = f"{job.problem.title}: {job.problem.detail}"
    return f"{job.id}  {job.process:<22}  {text}"


def _time(seconds: float) -> str:
    return _scaled(seconds, (("s", 1.0), ("min", 60.0), ("h", 3600.0)), 2.0)


def _size(size: float) -> str:
    return _scaled(size, (("B", 1.0), ("kB", 1e3), ("MB", 1e6), ("GB", 1e9)), 1.0)


def _scaled(value: float, units: Sequence[tuple[str, float]], least: float) -> str:
    """Return a number in the largest unit of which it is at least `least` times the size, else in the first unit."""
    name, size = next((unit for unit in reversed(units) if value >= least * unit[1]), units[0])
    return f"{value / size:.3g} {name}"

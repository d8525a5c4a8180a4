"""Compare the estimates of `planning` with the processor time on one core: `make estimates`.

Random requests, five of each process (`random_requests`), are computed as a worker does, each in a child process.
The size of each is raised until it takes LEAST_SECONDS; kernels are loaded before. These are replaced by others: what
the request or the core refuses, what takes less at any size, and what was estimated to take long and is given up. A
line for each says the processor time over the estimate. The program fails if fewer than nine in ten lie within WITHIN,
or if one is over MOST; where borders are explained BORDERS_WITHIN stands for both. Arguments: the number of requests of
each process, the first seed, names of processes.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import time
from typing import Any, NamedTuple

from grazemap_worker.environment import one_thread

if __name__ == "__main__":
    # Not where tests import this: numba, when it compiles after a variable of its own has changed, reads all of them
    # again, and forgets where the compiled kernels are.
    one_thread()

from pydantic import ValidationError

from benchmarks.random_requests import KINDS, drawn
from grazemap.wire import ProcessRequest, parse_request
from grazemap_core import warmup
from grazemap_core.errors import CoreError
from grazemap_worker.planning.kernel_steps import FIRST_STEPS, components_of
from grazemap_worker.processes import IMPLEMENTATIONS

REQUESTS = 5
LEAST_SECONDS = 0.05
GOAL_SECONDS = 0.3
# A size may grow so much at once, and so often.
FASTEST_GROWTH = 8.0
GROWTHS = 10
# Of processor time, after which a request is given up; it then took at least as long.
GIVEN_UP_SECONDS = 20
LOADING_SECONDS = 150
WITHIN = (0.2, 5.0)
MOST = 20.0
BORDERS_WITHIN = (0.1, 10.0)


class Measured(NamedTuple):
    """A request, its processor time and its estimate in seconds; `whole`: it was not given up."""

    process: str
    body: dict[str, Any]
    seconds: float
    estimate: float
    whole: bool

    @property
    def ratio(self) -> float:
        """Its processor time over the estimate."""
        return self.seconds / self.estimate

    @property
    def borders(self) -> bool:
        """Whether borders are explained, whose number is unknown before."""
        return bool(self.body.get("borders"))

    @property
    def true(self) -> bool:
        """Whether the estimate is as good as nine in ten should be."""
        least, most = BORDERS_WITHIN if self.borders else WITHIN
        return least <= self.ratio <= most

    @property
    def over(self) -> bool:
        """Whether the time is over the limit of every request."""
        return self.ratio > (BORDERS_WITHIN[1] if self.borders else MOST)

    @property
    def line(self) -> str:
        """What is printed."""
        request = parse_request(self.process, self.body)
        described, body = dict(self.body.get("oscillator", {})), dict(self.body)
        body.pop("oscillator", None)
        named = {"matrices": "dense"} if "matrices" in described else {"damping": described.get("damping")}
        named |= {name: described[name] for name in ("restitution", "contact", "bias") if name in described}
        description = f"N {request.oscillator.size}, {short(named)}, {short(body)}"
        mark = "" if self.whole else ">"
        times = f"{mark}{self.seconds:.3f} s, estimate {self.estimate:.3g} s"
        return f"{self.process:<23}{mark}{self.ratio:8.2f}  {times}; {description}"


def short(value: Any) -> str:
    """Return a body as a short text."""
    text = json.dumps(json.loads(json.dumps(value), parse_float=lambda number: float(f"{float(number):.4g}")))
    return text.replace('"', "") if len(text) < 220 else f"{text[:200]}...".replace('"', "")


def compute(process: str, request: ProcessRequest) -> None:
    """Compute a request as a worker does, tile by tile. Raises CoreError."""
    planned, how = IMPLEMENTATIONS[process].plan(request), IMPLEMENTATIONS[process]
    if how.whole is not None:
        how.whole(request, silent)
    elif how.tile is not None and how.assembled is not None:
        how.assembled(request, planned, [how.tile(request, tile) for tile in planned.tiles], silent)


def silent(done: int, total: int) -> None:
    """Nobody waits."""


def seconds_of(process: str, body: dict[str, Any]) -> float:
    """Return the processor time of a request. Raises CoreError."""
    request = parse_request(process, body)
    began = processor_seconds()
    compute(process, request)
    return processor_seconds() - began


def processor_seconds() -> float:
    """Return the processor time of this process and of those that it has waited for, as proofs are computed in one."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def end_after(seconds: int) -> None:
    """Let the system end this process after so much more processor time."""
    limit = int(time.process_time()) + seconds
    resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


def sized(process: str, seed: int, pipe: int) -> None:
    """Measure a request with a size at which it takes long enough; tell each size and its time to a pipe."""
    end_after(LOADING_SECONDS)
    request, size, last = drawn(process, seed), 1.0, None
    for growth in range(GROWTHS):
        body = request(size)
        if body == last:
            return
        last = body
        os.write(pipe, f"{json.dumps([body, None])}\n".encode())
        if growth == 0:
            seconds_of(process, body)  # loads the kernels, or compiles them
            end_after(GIVEN_UP_SECONDS)
        took = seconds_of(process, body)
        if took > WITHIN[1] * IMPLEMENTATIONS[process].plan(parse_request(process, body)).estimate.seconds:
            took = min(took, seconds_of(process, body))  # a larger size may be the first that needs some kernels
        os.write(pipe, f"{json.dumps([body, took])}\n".encode())
        if took > 0.5 * GOAL_SECONDS:
            return
        size *= min(FASTEST_GROWTH, max(1.5, GOAL_SECONDS / max(took, 1e-6)))


def measured(process: str, seed: int) -> Measured | None:
    """Return the measurement of a random request, or None where the core refuses it or it never takes long."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        try:
            sized(process, seed, writing)
        except (CoreError, ValidationError):
            os._exit(1)
        except RuntimeError as error:
            # given up, where a process of the work has met the limit of `end_after`
            if not str(error).endswith(f" {-signal.SIGXCPU}"):
                raise
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as lines:
        told = [json.loads(line) for line in lines]
    _, status = os.waitpid(child, 0)
    if not told or (os.WIFEXITED(status) and os.WEXITSTATUS(status)):
        return None
    body, seconds = told[-1]
    whole = seconds is not None
    spent = seconds if whole else float(GIVEN_UP_SECONDS)
    if spent < LEAST_SECONDS:
        return None
    estimate = IMPLEMENTATIONS[process].plan(parse_request(process, body)).estimate.seconds
    # one that was given up, and was estimated to take so long or longer, is too large to be compared
    return Measured(process, body, spent, estimate, whole) if whole or spent > WITHIN[1] * estimate else None


def main() -> int:
    """Print a line for each request, and a summary; return 1 if the estimates are not true."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else REQUESTS
    for step in FIRST_STEPS:
        warmup.load(components_of(step))
    measurements: list[Measured] = []
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    for process in sys.argv[3:] or KINDS:
        seed, enough = first, len(measurements) + count
        while len(measurements) < enough and seed < first + 20 * count:
            measurement = measured(process, seed)
            seed += 1
            if measurement is not None:
                measurements.append(measurement)
                print(f"{seed - 1:3} {measurement.line}", flush=True)
    within = sum(measurement.true for measurement in measurements)
    over = sum(measurement.over for measurement in measurements)
    print(f"{within} of {len(measurements)} between {WITHIN[0]} and {WITHIN[1]}, {over} over their limit")
    return 0 if within >= 0.9 * len(measurements) and not over else 1


if __name__ == "__main__":
    sys.exit(main())

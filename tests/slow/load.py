"""A stack under load: `python -m tests.slow.load [STREAMS [CLIENTS [SECONDS]]]`, or `make load`.

While 500 clients follow the events of one map (STREAMS), the median of a GET has to stay under 20 ms, and every client
has to receive every event that the service has stored. Then 1,000 clients (CLIENTS) ask for curves of a fixed set for
60 s (SECONDS), two times, after a first round that is not measured. The results of the set do not all fit into the
store, so many are computed again. The memory of the service, the workers and Redis then has to be within 20 % of what
it was before the two rounds, every accepted job has to have ended, and no answer is a 5xx.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import random
import resource
import statistics
import sys
import time
from collections import Counter
from typing import Any

import httpx2
import psutil

import grazemap

LIMIT_SECONDS = 0.020
MORE_MEMORY = 1.2
QUESTIONS = 3000
# Less than the results of all questions.
RESULT_BYTES = 6_000_000
# Seconds after a round in which jobs end and memory is given back.
REST_SECONDS = 60.0
MAP = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 320},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 160},
}
Event = tuple[str, str, str]


async def followed(http: httpx2.AsyncClient, job_id: str) -> list[Event]:
    """Return the stored events of a job, as a client receives them that follows it to its end."""
    events, fields = [], {}
    async with http.stream("GET", f"/v1/jobs/{job_id}/events") as answer:
        answer.raise_for_status()
        async for line in answer.aiter_lines():
            name, _, value = line.partition(": ")
            if line:
                fields[name] = value
                continue
            if "id" in fields:
                events.append((fields["id"], fields["event"], fields["data"]))
            fields = {}
    return events


def client_of(url: str, connections: int) -> httpx2.AsyncClient:
    """Return a client with so many connections."""
    limits = httpx2.Limits(max_connections=connections, max_keepalive_connections=connections)
    return httpx2.AsyncClient(base_url=url, timeout=120, limits=limits, trust_env=False)


def follow(url: str, job_id: str, streams: int, lost: Any) -> None:
    """Follow a job with many clients, in a process of its own; put how many of them have missed an event."""

    async def run() -> int:
        async with client_of(url, streams) as http:
            event_lists = await asyncio.gather(*(followed(http, job_id) for _ in range(streams)))
            stored = await followed(http, job_id)
        return sum(events != stored for events in event_lists)

    lost.put(asyncio.run(run()))


def streamed(url: str, streams: int) -> bool:
    """Time GET while many clients follow a map; print a line, and return whether it held."""
    with httpx2.Client(base_url=url, timeout=60, trust_env=False) as http:
        job = http.post("/v1/grazing-curves", json=question(0), headers={"Prefer": "wait=20"}).json()
        map_id = http.post("/v1/unfolding-maps", json=MAP).json()["id"]
        lost: Any = multiprocessing.Queue()
        followers = multiprocessing.Process(target=follow, args=(url, map_id, streams, lost))
        followers.start()
        time.sleep(3.0)
        took = []
        while http.get(f"/v1/jobs/{map_id}").json()["status"] in ("accepted", "running"):
            for _ in range(20):
                began = time.perf_counter()
                http.get(f"/v1/jobs/{job['id']}").raise_for_status()
                took.append(time.perf_counter() - began)
                time.sleep(0.01)
        missed = lost.get(timeout=120)
        followers.join()
    median = statistics.median(took) if took else float("inf")
    print(f"{streams} streams: GET {1000 * median:.1f} ms (median of {len(took)}), {missed} of them lost an event")
    return median < LIMIT_SECONDS and missed == 0


def question(number: int) -> dict[str, Any]:
    """Return the request of a curve of the fixed set."""
    return {"omega": {"start": 0.27, "stop": 0.28 + 1e-9 * number, "points": 100}}


async def asked(url: str, clients: int, seconds: float) -> Counter[int]:
    """Let many clients ask at once; return how often each status was answered (0: none was)."""
    statuses: Counter[int] = Counter()
    end = time.monotonic() + seconds

    async def ask(http: httpx2.AsyncClient, seed: int) -> None:
        chosen = random.Random(seed)
        while time.monotonic() < end:
            body, headers = question(chosen.randrange(QUESTIONS)), {"Prefer": "wait=5, return=representation"}
            try:
                answer = await http.post("/v1/grazing-curves", json=body, headers=headers)
                statuses[answer.status_code] += 1
            except httpx2.RequestError:
                statuses[0] += 1

    async with client_of(url, clients) as http:
        await asyncio.gather(*(ask(http, seed) for seed in range(clients)))
    return statuses


def rested(url: str) -> int:
    """Wait until jobs have ended; return how many have not, and fail where some have failed."""
    deadline = time.monotonic() + REST_SECONDS
    with httpx2.Client(base_url=url, timeout=60, trust_env=False) as http:
        while True:
            jobs = http.get("/v1/status").json()["jobs"]
            unfinished = jobs["accepted"] + jobs["running"] + jobs["failed"]
            if time.monotonic() > deadline:
                return int(unfinished)
            time.sleep(1.0)


def memory() -> dict[str, float]:
    """Return the megabytes of the processes of the stack, by what they are."""
    megabytes: dict[str, float] = {}
    for process in psutil.Process().children(recursive=True):
        line = " ".join(process.cmdline())
        for name, word in (
            ("service", "-m grazemap_service"),
            ("workers", "-m grazemap_worker"),
            ("Redis", "unixsocket"),
        ):
            if word in line and "grazemap_service.stack" not in line:
                megabytes[name] = megabytes.get(name, 0.0) + process.memory_info().rss / 1e6
    return megabytes


def loaded(url: str, clients: int, seconds: float) -> bool:
    """Run a round that is not measured and two more; print the memory, and return whether all held."""
    statuses: Counter[int] = Counter()
    before: dict[str, float] = {}
    unfinished = 0
    for number in range(3):
        answered = asyncio.run(asked(url, clients, seconds))
        unfinished = rested(url)
        now = memory()
        text = ", ".join(f"{name} {size:.0f} MB" for name, size in now.items())
        print(f"round {number}: {dict(answered)}, {unfinished} jobs have not ended; {text}", flush=True)
        before = before or now
        statuses += answered
    shares = {name: now[name] / before[name] for name in before}
    print("memory after two rounds: " + ", ".join(f"{name} {share:.0%}" for name, share in shares.items()))
    failed = sum(number for status, number in statuses.items() if status == 0 or status >= 500)
    print(f"{failed} of {sum(statuses.values())} requests failed")
    return max(shares.values()) <= MORE_MEMORY and not failed and not unfinished


def main() -> int:
    """Run both parts; return 1 if one fails."""
    streams, clients, seconds = (int(text) for text in (sys.argv[1:] + ["500", "1000", "60"][len(sys.argv) - 1 :]))
    most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
    os.environ["GRAZEMAP_RESULT_BYTES"] = str(RESULT_BYTES)
    with grazemap.local() as client:
        held = streamed(client.base_url, streams)
        return 0 if loaded(client.base_url, clients, float(seconds)) and held else 1


if __name__ == "__main__":
    sys.exit(main())

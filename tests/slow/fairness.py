"""Shares of a busy stack: `python -m tests.slow.fairness [MAPS [SMALL]]`, or `make fairness`.

51 maps of 1000 x 1000 points of one client are queued (MAPS). A map of eight tiles of another client has to be done
within 30 s, a curve within 1.5 s. Of two clients that ask for one map one leaves, and the map is computed for the
other. Then three maps are computed, and 10,500 small jobs after them (SMALL), 500 more than are kept: the results of
the maps are still there, with the same bytes.

Then, with one worker and with two, three sweeps queue, each of whose tiles takes longer than a minute. A short map of
another client, asked twenty times at random moments, begins within 2 s and takes at most three times as long as on the
idle stack.
"""

from __future__ import annotations

import math
import random
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from typing import Any

import httpx2

import grazemap

MAP_SECONDS, CURVE_SECONDS = 30.0, 1.5
# Seconds for all small jobs together, at a rate far below that of an idle machine.
SMALL_SECONDS = 1800.0
CONNECTIONS = 8
# A short map beside tiles of minutes: seconds until it begins, and its time over that on an idle stack.
BEGINS_SECONDS, TIMES_IDLE = 2.0, 3.0
SHORT_MAPS = 20
MAPS = "/v1/unfolding-maps"
CURVES = "/v1/grazing-curves"


def grid(points: int, start: float = 0.26) -> dict[str, Any]:
    """Return the request of a map of points x points; another `start` makes it another one."""
    return {
        "omega": {"start": start, "stop": 0.30, "points": points},
        "clearance": {"start": 1.3, "stop": 2.0, "points": points},
    }


def curve(number: int) -> dict[str, Any]:
    """Return the request of a small curve, one for each number."""
    return {"omega": {"start": 0.27, "stop": 0.28 + 1e-9 * number, "points": 10}}


class Requester:
    """A client with a name of its own."""

    def __init__(self, url: str, name: str) -> None:
        headers = {"Grazemap-Client": name}
        self.http = httpx2.Client(base_url=url, headers=headers, timeout=120, trust_env=False)

    def post(self, path: str, body: dict[str, Any], wait: int = 0) -> dict[str, Any]:
        """Return the job of a request, after waiting for its end."""
        answer = self.http.post(path, json=body, headers={"Prefer": f"wait={wait}"})
        answer.raise_for_status()
        job: dict[str, Any] = answer.json()
        return job

    def job(self, job_id: str) -> dict[str, Any]:
        """Return a job."""
        job: dict[str, Any] = self.http.get(f"/v1/jobs/{job_id}").json()
        return job

    def seconds(self, path: str, body: dict[str, Any], limit: float) -> float:
        """Return the seconds until the result of a new request is there; infinite after several times the limit."""
        began = time.perf_counter()
        job = self.post(path, body, 1)
        while job["status"] in ("accepted", "running"):
            if time.perf_counter() - began > 5 * limit:
                return float("inf")
            time.sleep(0.05)
            job = self.job(job["id"])
        self.http.get(f"/v1/jobs/{job['id']}/result?f=npz").raise_for_status()
        return time.perf_counter() - began


def points_of(requester: Requester, tiles: int) -> int:
    """Return the points on a side of a map with so many tiles."""
    for points in range(40, 400, 2):
        if requester.http.post(f"{MAPS}/estimate", json=grid(points)).json()["tiles"] >= tiles:
            return points
    raise ValueError("no map has so many tiles")


def beside_maps(first: Requester, other: Requester, maps: int) -> bool:
    """Queue maps, and time what another client asks meanwhile; dismiss them."""
    queued = [first.post(MAPS, grid(1000, 0.26 + 1e-5 * number))["id"] for number in range(maps)]
    while not any(first.job(job_id)["progress"]["done"] for job_id in queued):
        time.sleep(0.5)
    points = points_of(other, 8)
    tiles = other.http.post(f"{MAPS}/estimate", json=grid(points)).json()["tiles"]
    took = other.seconds(MAPS, grid(points, 0.259), MAP_SECONDS)
    print(f"beside {maps} maps: a map of {tiles} tiles in {took:.1f} s (limit {MAP_SECONDS:.0f})", flush=True)
    curves = sorted(other.seconds(CURVES, curve(-1 - number), CURVE_SECONDS) for number in range(20))
    print(f"20 curves: median {curves[10]:.3f} s, most {curves[-1]:.3f} s (limit {CURVE_SECONDS})", flush=True)
    shared = grid(points, 0.258)
    job_id = first.post(MAPS, shared)["id"]
    same = other.post(MAPS, shared)["id"] == job_id
    left = first.http.delete(f"/v1/jobs/{job_id}").json()
    other.seconds(MAPS, shared, MAP_SECONDS)
    ended = other.job(job_id)["status"]
    print(f"two ask for one map, one leaves: it is {left['status']}, then {ended}", flush=True)
    advanced = sum(first.job(job_id)["progress"]["done"] > 0 for job_id in queued)
    print(f"{advanced} of {maps} maps have advanced meanwhile", flush=True)
    for job_id in queued:
        first.http.delete(f"/v1/jobs/{job_id}?for=all").raise_for_status()
    return took <= MAP_SECONDS and curves[-1] <= CURVE_SECONDS and same and ended == "successful"


def after_small_jobs(first: Requester, other: Requester, small: int) -> bool:
    """Compute three maps and then small jobs; return whether the results of the maps are there."""
    bodies = [grid(100, 0.25 + 1e-3 * number) for number in range(3)]
    maps = [first.post(MAPS, body) for body in bodies]
    for body in bodies:
        first.seconds(MAPS, body, 60.0)
    paths = [f"/v1/jobs/{job['id']}/result?f=npz" for job in maps]
    before = [first.http.get(path).content for path in paths]
    began = time.perf_counter()
    with ThreadPoolExecutor(CONNECTIONS) as pool:
        jobs = list(pool.map(lambda number: other.post(CURVES, curve(number), 30), range(small)))
    unfinished = {job["id"] for job in jobs if job["status"] != "successful"}
    while unfinished and time.perf_counter() - began < SMALL_SECONDS:
        unfinished = {job_id for job_id in unfinished if other.job(job_id).get("status") in ("accepted", "running")}
    took = time.perf_counter() - began
    print(f"{small} small jobs in {took:.0f} s, {small / took:.0f} a second; {len(unfinished)} unfinished", flush=True)
    forgotten = sum("id" not in other.job(job["id"]) for job in jobs[: small // 20])
    after = [first.http.get(path) for path in paths]
    kept = sum(answer.status_code == 200 and answer.content == data for answer, data in zip(after, before, strict=True))
    print(f"{kept} of 3 maps are still there; of the first {small // 20} small jobs {forgotten} are forgotten")
    return kept == 3 and not unfinished


def beside_long_tiles(first: Requester, other: Requester, workers: int) -> bool:
    """Time short maps on an idle stack and while sweeps of minutes are computed; dismiss these."""
    chance = random.Random(workers)
    starts = (0.26 + 1e-7 * (1000 * workers + number) for number in count())
    idle = sorted(_begin_and_end(other, grid(80, next(starts))) for _ in range(5))[2][1]
    window = {"clearance": {"start": 1.2, "stop": 2.2, "points": 3000}, "policy": "sweep-up", "max_periods": 10_000}
    omegas = ({"start": 0.2 + 1e-7 * number, "stop": 0.35, "points": 8} for number in range(3))
    queued = [first.post(MAPS, window | {"omega": omega})["id"] for omega in omegas]
    while not any(first.job(job_id)["progress"]["done"] for job_id in queued):
        time.sleep(0.5)
    times = []
    for _ in range(SHORT_MAPS):
        time.sleep(chance.uniform(0.0, 5.0))
        times.append(_begin_and_end(other, grid(80, next(starts))))
    for job_id in queued:
        first.http.delete(f"/v1/jobs/{job_id}?for=all").raise_for_status()
    begins, ratio = max(began for began, _ in times), max(ended for _, ended in times) / idle
    print(
        f"{workers} workers, {SHORT_MAPS} short maps beside tiles of minutes: all begin within {begins:.2f} s"
        f" (limit {BEGINS_SECONDS}), and take at most {ratio:.2f} times {idle:.2f} s (limit {TIMES_IDLE:.0f})",
        flush=True,
    )
    return begins <= BEGINS_SECONDS and ratio <= TIMES_IDLE


def _begin_and_end(requester: Requester, body: dict[str, Any]) -> tuple[float, float]:
    """Return the seconds until a map's first tile is done, and until the map is."""
    asked, began = time.perf_counter(), math.inf
    job = requester.post(MAPS, body)
    while True:
        seconds = time.perf_counter() - asked
        if job["status"] == "successful":
            return min(began, seconds), seconds
        if job["progress"]["done"]:
            began = min(began, seconds)
        time.sleep(0.02)
        job = requester.job(job["id"])


def main() -> int:
    """Run all parts; return 1 if one fails."""
    maps, small = (int(text) for text in (sys.argv[1:] + ["51", "10500"][len(sys.argv) - 1 :]))
    with grazemap.local() as client:
        first, other = Requester(client.base_url, "first"), Requester(client.base_url, "other")
        fair = beside_maps(first, other, maps)
        fair &= after_small_jobs(first, other, small)
    for workers in (1, 2):
        with grazemap.local(workers=workers) as client:
            first, other = Requester(client.base_url, "first"), Requester(client.base_url, "other")
            fair &= beside_long_tiles(first, other, workers)
    return 0 if fair else 1


if __name__ == "__main__":
    sys.exit(main())

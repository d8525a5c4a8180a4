"""What one asker's requests do to others: `python -m tests.slow.unfair_askers`, or `make unfair`.

A batch of twenty questions about dense zeros, of 5 kB, is asked, and small questions of another client meanwhile: each
has to be answered within QUESTION_SECONDS. Then two trajectories of 64 masses, each of minutes, are asked from stacks
of two workers and of one, and a small map of another client: it has to begin within BEGIN_SECONDS, and the trajectories
go on.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import grazemap
from tests.slow.fairness import CURVES, MAPS, Requester, curve, grid

QUESTION_SECONDS, BEGIN_SECONDS = 10.0, 5.0
QUESTIONS = 14
ENDS = ("successful", "failed", "dismissed")


def dense() -> list[dict[str, Any]]:
    """Return the questions of the batch."""
    orders = {"oscillator": {"damping": 0.001}, "max_order": 200, "max_multiple": 100}
    ends = [{"start": 0.003, "stop": 0.003135 + 1e-7 * k} for k in range(20)]
    return [{"process": "codimension-two-points", "request": {**orders, "omega": omega}} for omega in ends]


def trajectory(number: int) -> dict[str, Any]:
    """Return the request of a trajectory of minutes."""
    lists = {"masses": [1.0] * 64, "stiffnesses": [1.0] * 64, "forcing": [1.0] + [0.0] * 63}
    oscillator = {**lists, "damping": 0.05, "restitution": 0.8}
    point = {"oscillator": oscillator, "omega": 0.29, "clearance": 0.1 + 1e-6 * number}
    return {**point, "periods": 1000, "transient_periods": 900_000, "samples_per_period": 1}


def beside_dense_zeros(url: str) -> bool:
    """Ask the batch, and small questions of another client; return whether these were answered in time."""
    unfair, fair = Requester(url, "unfair"), Requester(url, "fair")
    fair.seconds(CURVES, curve(-100), 10 * QUESTION_SECONDS)
    with unfair.http.stream("POST", "/v1/batches", json={"requests": dense()}) as answer:
        answer.raise_for_status()
        took = []
        for number in range(QUESTIONS):
            took.append(fair.seconds(CURVES, curve(number), QUESTION_SECONDS))
            time.sleep(1.0)
    median = sorted(took)[QUESTIONS // 2]
    print(f"beside 20 questions about dense zeros: median {median:.2f} s, most {max(took):.2f} s", flush=True)
    for job in unfair.http.get("/v1/jobs?process=codimension-two-points").json()["jobs"]:
        unfair.http.delete(f"/v1/jobs/{job['id']}?for=all").raise_for_status()
    return max(took) <= QUESTION_SECONDS


def beside_trajectories(url: str, workers: int) -> bool:
    """Ask long trajectories, and a map of another client; return whether it began in time, and they go on."""
    unfair, fair = Requester(url, "unfair"), Requester(url, "fair")
    fair.seconds(MAPS, grid(16, 0.27), 300.0)  # its kernels are there
    jobs = [unfair.post("/v1/trajectories", trajectory(number)) for number in range(2)]
    while unfair.job(jobs[0]["id"])["status"] == "accepted":
        time.sleep(0.1)
    time.sleep(5.0)
    asked = time.monotonic()
    small = fair.post(MAPS, grid(24, 0.275))
    while fair.job(small["id"])["status"] == "accepted" and time.monotonic() - asked < 120.0:
        time.sleep(0.05)
    began = time.monotonic() - asked
    while fair.job(small["id"])["status"] not in ENDS:
        time.sleep(0.1)
    took = time.monotonic() - asked
    print(f"beside trajectories, {workers} workers: a map began after {began:.1f} s, and took {took:.1f} s", flush=True)
    left = [unfair.job(job["id"])["status"] for job in jobs]
    for job in jobs:
        unfair.http.delete(f"/v1/jobs/{job['id']}?for=all").raise_for_status()
    return began <= BEGIN_SECONDS and "running" in left and "failed" not in left


def main() -> int:
    """Run all parts; return 1 if one fails."""
    passed = []
    with grazemap.local(workers=2) as client:
        passed += [beside_dense_zeros(client.base_url), beside_trajectories(client.base_url, 2)]
    with grazemap.local(workers=1) as client:
        passed.append(beside_trajectories(client.base_url, 1))
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())

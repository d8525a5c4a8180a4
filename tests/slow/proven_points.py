"""Codimension-two points proven from their own records: `python -m tests.slow.proven_points [SYSTEMS]`.

Random systems whose forces have the common divisor p = 1, 2, 3 or 4, with every law, a bias, equal stops or one stop.
Each point of order up to 6 is proven with the statement that its record has. Printed are the counts by p and verdict,
and the reasons of what is undecided. The status is 1 if a statement is disproven, or less than 90 % are proven.
"""

from __future__ import annotations

import sys
from collections import Counter
from typing import Any

import numpy as np

from grazemap.results import CodimensionTwoPoints
from grazemap.wire import parse_request
from grazemap_worker.processes import IMPLEMENTATIONS

ORDERS = {
    1: [[1], [1, 2], [2, 3], [1, 3]],
    2: [[2], [2, 4], [4, 6], [2, 6]],
    3: [[3], [3, 9], [6, 9], [3, 6]],
    4: [[4], [4, 12], [8, 12], [4, 8]],
}
MOST_ORDER = 6
MOST_POINTS = 12
NEEDED = 0.9


def machine(seed: int) -> tuple[int, dict[str, Any], dict[str, Any]]:
    """p, the oscillator, and the further fields of the request: none for equal stops."""
    rng = np.random.default_rng(seed)
    p = 1 + seed % 4
    orders = ORDERS[p][int(rng.integers(4))]
    size = int(rng.integers(1, 4))
    half = rng.normal(size=(3, size, size))
    mass, stiffness = (half[i] @ half[i].T + np.eye(size) for i in (0, 1))
    # proportional and gyroscopic damping, light enough for several zeros
    damping = 0.1 * mass + 0.05 * stiffness + 0.1 * (half[2] - half[2].T)
    oscillator: dict[str, Any] = {
        "matrices": {"mass": mass.tolist(), "damping": damping.tolist(), "stiffness": stiffness.tolist()},
        "contact": {"row": [1.0, *rng.normal(size=size - 1).tolist()]},
        "forcing": [
            {
                "amplitude": (rng.normal(size=size) / (1 + i)).tolist(),
                "phase": rng.uniform(-3.0, 3.0, size).tolist(),
                "harmonic": order,
                "law": "constant" if rng.random() < 0.6 else "unbalance",
            }
            for i, order in enumerate(orders)
        ],
    }
    if p == 1 and rng.random() < 0.3:
        oscillator["base"] = {"amplitude": 0.1, "stops_move": True, "influence": [1.0] * size}
    if rng.random() < 0.4:
        oscillator["bias"] = rng.normal(scale=0.1, size=size).tolist()
    symmetric = all(order // p % 2 for order in orders) and "bias" not in oscillator
    one_stop = not symmetric or rng.random() < 0.5
    return p, oscillator, {"clearance": {"left": None}} if one_stop else {}


def proofs_of(seed: int) -> tuple[int, list[dict[str, Any]]]:
    """p, and the documents of the proofs of a system's points."""
    p, oscillator, stops = machine(seed)
    body = {"oscillator": oscillator, "omega": {"start": 0.2 / p, "stop": 1.5 / p}, "max_order": MOST_ORDER, **stops}
    request = parse_request("codimension-two-points", {**body, "max_multiple": 2})
    document = IMPLEMENTATIONS["codimension-two-points"].whole(request, lambda done, total: None)
    result = CodimensionTwoPoints.from_document(document, {"request": request.canonical()})
    points = [point for point in result.points if point.kind in ("recurrence", "resonant")]
    proofs = []
    for point in points[:: max(1, len(points) // MOST_POINTS)]:
        stated = {"oscillator": point.oscillator, "statement": point.statement()}
        proofs.append(IMPLEMENTATIONS["proofs"].whole(parse_request("proofs", stated), lambda done, total: None))
    return p, proofs


def main(count: int) -> int:
    by_order: dict[int, Counter[str]] = {p: Counter() for p in ORDERS}
    reasons: Counter[str] = Counter()
    for seed in range(count):
        p, proofs = proofs_of(seed)
        by_order[p].update(proof["verdict"] for proof in proofs)
        reasons.update(proof["reason"] for proof in proofs if proof["verdict"] == "undecided")
    for p, verdicts in by_order.items():
        print(f"p = {p}: {dict(verdicts)}")
    for reason, number in reasons.most_common():
        print(f"undecided, {number}: {reason}")
    all_of = sum(by_order.values(), Counter[str]())
    print(f"{count} systems: {dict(all_of)}")
    return int(all_of["disproven"] > 0 or all_of["proven"] < NEEDED * all_of.total())


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 50))

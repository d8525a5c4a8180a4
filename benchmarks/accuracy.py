"""Errors of impact times, by 48-digit arithmetic: ``python benchmarks/accuracy.py [points] [--lockstep]``.

Random chains by the trajectory kernel, or, with ``--lockstep``, random points of the default oscillator's plane by the
kernel of maps. Prints one line for each point, the worst last. The method is that of
``tests/oracles/impact_accuracy.py``, which the tests use on some of the same points.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from itertools import islice

import numpy as np

from grazemap_core.model.oscillator import Oscillator
from tests.oracles.impact_accuracy import Accuracy, compare, compare_lockstep, plane_points, random_point

DEFAULT = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
CLEARANCES = 10
"""Points of the plane that share a frequency."""

Point = tuple[Oscillator, float, float, Accuracy]


def random_chains(points: int) -> Iterator[Point]:
    """Compare trajectories of random chains."""
    for seed in range(points):
        oscillator, omega, clearance = random_point(seed)
        yield oscillator, omega, clearance, compare(oscillator, omega, clearance)


def random_plane(points: int) -> Iterator[Point]:
    """Compare random points of the plane, in lockstep, with 48-digit arithmetic."""
    for omega, clearances in plane_points(DEFAULT, -(-points // CLEARANCES), CLEARANCES):
        for clearance in clearances:
            accuracies = compare_lockstep(DEFAULT, omega, np.array([clearance]))
            yield DEFAULT, omega, float(clearance), accuracies[0]


def main(points: int, lockstep: bool) -> None:
    """Print the table."""
    lines = []
    compared = islice(random_plane(points) if lockstep else random_chains(points), points)
    for number, (oscillator, omega, clearance, accuracy) in enumerate(compared):
        ratio = accuracy.error / accuracy.amplification
        k = int(np.argmax(ratio)) if len(ratio) else None
        worst = (
            "-" if k is None else f"{accuracy.error[k]:.1e}  {accuracy.amplification[k]:13.1e}  {accuracy.worst:19.1e}"
        )
        text = (
            f"{number:4d} {oscillator.size:2d}  {'links' if oscillator.gamma is None else 'gamma'}  "
            f"{oscillator.restitution:.3f}  {omega:.3f}  {clearance:.2e}  {len(accuracy.error):7d}  "
            f"{'yes' if accuracy.complete else 'NO':>9}  {worst}"
        )
        lines.append((accuracy.worst, text))
        print(f"\r{number + 1} of {points}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print("seed  N  damping  R     omega  clearance  impacts  all there  error    amplification  error/amplification")
    for _, text in sorted(lines):
        print(text)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("points", type=int, nargs="?", default=50)
    parser.add_argument("--lockstep", action="store_true", help="the kernel of maps")
    arguments = parser.parse_args()
    main(arguments.points, arguments.lockstep)

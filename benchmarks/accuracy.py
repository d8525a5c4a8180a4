"""Impact times at random points beside 48-digit arithmetic: ``python benchmarks/accuracy.py [points]``.

Prints one line a point, worst last; the method is that of ``tests/impact_accuracy.py``, which the tests use on some of
the same points.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from impact_accuracy import compare, random_point


def main(points: int) -> None:
    """Print the table."""
    lines = []
    for seed in range(points):
        oscillator, omega, clearance = random_point(seed)
        found = compare(oscillator, omega, clearance)
        k = int(np.argmax(found.error / found.amplification))
        text = (
            f"{seed:4d} {oscillator.size:2d}  {'links' if oscillator.gamma is None else 'gamma'}  "
            f"{oscillator.restitution:.3f}  {omega:.3f}  {clearance:.2e}  {len(found.error):7d}  "
            f"{'yes' if found.complete else 'NO':>9}  {found.error[k]:.1e}  {found.amplification[k]:13.1e}  "
            f"{found.worst:19.1e}"
        )
        lines.append((found.worst, text))
        print(f"\r{seed + 1} of {points}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print("seed  N  damping  R     omega  clearance  impacts  all there  error    amplification  error/amplification")
    for _, text in sorted(lines):
        print(text)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)

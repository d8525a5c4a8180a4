"""Solutions with many digits: Newton's method in the middles of balls, from double precision."""

from __future__ import annotations

from collections.abc import Callable

from flint import arb, arb_mat

from grazemap_core.proofs.certificates import Search, Undecided

MAX_STEPS = 30
"""Steps of Newton's method; from double precision it needs four or five."""
LARGEST_STEP = 0.2
"""Relative step above which Newton's method leaves its starting point."""


def refine(
    search: Search, start: list[arb], equations: Callable[[list[arb]], tuple[list[arb], list[list[arb]]]]
) -> list[arb]:
    """Return the solution near a start, accurate to more digits than the enclosures need."""
    size = float(max(abs(x).abs_upper() for x in start))
    target = 10.0 ** -(search.digits + 6) * size
    unknowns = [x.mid() for x in start]
    for _ in range(MAX_STEPS):
        search.go_on()
        residual, rows = equations(unknowns)
        try:
            step = arb_mat(rows).mid().solve(arb_mat([[x.mid()] for x in residual]), algorithm="approx").entries()
        except ZeroDivisionError:
            raise Undecided("the equations are singular near the starting point") from None
        unknowns = [(x - dx).mid() for x, dx in zip(unknowns, step, strict=True)]
        largest = float(max(abs(dx).abs_upper() for dx in step))
        if not largest < LARGEST_STEP * size:
            break
        if largest < target:
            return unknowns
    raise Undecided("Newton's method does not converge from the starting point")

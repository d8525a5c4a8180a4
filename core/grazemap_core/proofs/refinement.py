"""Solutions with many digits: Newton's method in the middles of balls, from double precision."""

from __future__ import annotations

from collections.abc import Callable

from flint import arb

from grazemap.checker.arithmetic import column, quotients
from grazemap_core.proofs.certificates import Document, ProofSearch, Undecided

MAX_STEPS = 30
"""Steps of Newton's method; from double precision it needs three or four."""
LARGEST_STEP = 0.2
"""Relative step above which Newton's method leaves its starting point."""

Equations = tuple[list[arb], Callable[[list[arb]], list[arb]]]
"""The unknowns at the start, and the function that vanishes."""


def radius_of(search: ProofSearch, unknowns: list[arb]) -> arb:
    """Return the radius of the box: that of the enclosures, relative to the largest unknown."""
    return arb(10) ** -search.digits * max(abs(x).abs_upper() for x in unknowns)


def refine(
    search: ProofSearch,
    theorem: Document,
    equations: Callable[[Document], Equations],
    renewed: Callable[[Document, list[arb]], Document],
) -> Document:
    """Return a theorem renewed with a solution that is accurate to more digits than the enclosures need."""
    for _ in range(MAX_STEPS):
        start, function = equations(theorem)
        radius = radius_of(search, start)
        values, rows = quotients(function, start, radius)
        try:
            step = rows.mid().solve(column(values).mid(), algorithm="approx").entries()
        except ZeroDivisionError:
            raise Undecided("the equations are singular near the starting point") from None
        theorem = renewed(theorem, [(x - dx).mid() for x, dx in zip(start, step, strict=True)])
        largest = max(abs(dx).abs_upper() for dx in step)
        if not largest < LARGEST_STEP * max(abs(x) for x in start):
            break
        if largest < radius * 1e-3:
            return theorem | {"radius": radius.str(1, radius=False)}
    raise Undecided("Newton's method does not converge from the starting point")

"""Theorems on codimension-two points of the grazing curve: simple zeros of the impulse response and of its sums."""

from __future__ import annotations

from flint import arb, ctx

from grazemap.checker.arithmetic import exact
from grazemap.checker.theorems import impulse
from grazemap_core.proofs.certificates import Document, Search, Undecided, decimals, inputs
from grazemap_core.proofs.refinement import refine

SAMPLES = 64
"""Parts of the range of frequencies in which a change of sign is looked for."""


def prove_codimension_two(search: Search, statement: Document) -> Document:
    """Return the theorem on the first zero that is found in the range of frequencies."""
    theorem = inputs(search, "1", "1") | {
        name: statement[name] for name in ("type", "order", "range", "stop") if name in statement
    }

    def function(unknowns: list[arb]) -> list[arb]:
        return [impulse(search.data, theorem, unknowns[0], statement["order"])]

    with ctx.workprec(search.bits):
        low, high = (exact(bound) for bound in statement["range"])
        places = [low + (high - low) * k / SAMPLES for k in range(SAMPLES + 1)]
        values = [function([place])[0] for place in places]
        changes = [k for k in range(SAMPLES) if values[k] * values[k + 1] < 0]
        if not changes:
            raise Undecided(f"no change of sign was found at {SAMPLES + 1} frequencies of the range")
        near, share = changes[0], values[changes[0]] / (values[changes[0]] - values[changes[0] + 1])
        theorem["value"] = decimals([places[near] + share * (high - low) / SAMPLES], 20)[0]
        return refine(
            search,
            theorem,
            lambda now: ([exact(now["value"])], function),
            lambda now, unknowns: now | {"value": decimals(unknowns, search.digits + 6)[0]},
        )

"""Theorems on codimension-two points of the grazing curve: simple zeros of the impulse response and of its sums."""

from __future__ import annotations

from flint import arb, ctx

from grazemap.checker.arithmetic import exact
from grazemap.checker.bifurcations import TWISTS, impulse
from grazemap_core.proofs.certificates import Document, Search, Undecided, decimals, inputs
from grazemap_core.proofs.refinement import refine

SAMPLES = 64
"""Parts of the range of frequencies in which a change of sign is looked for."""


def prove_codimension_two(search: Search, statement: Document) -> Document:
    """Return the theorem on the first zero that is found in the range of frequencies."""
    order, kind = statement["order"], statement["type"]
    theorem = inputs(search, "1", "1") | {"type": kind, "order": order, "range": statement["range"]}

    def function(omega: arb) -> tuple[arb, arb]:
        value, slope = impulse(search.data, theorem, omega, order, TWISTS[kind])
        return value, -slope * arb.pi() * order / (omega * omega)

    def equations(unknowns: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        value, slope = function(unknowns[0])
        return [value], [[slope]]

    with ctx.workprec(search.bits):
        low, high = (exact(bound) for bound in statement["range"])
        places = [low + (high - low) * k / SAMPLES for k in range(SAMPLES + 1)]
        values = [function(place)[0] for place in places]
        changes = [k for k in range(SAMPLES) if values[k] * values[k + 1] < 0]
        if not changes:
            raise Undecided(f"no change of sign was found at {SAMPLES + 1} frequencies of the range")
        near, share = changes[0], values[changes[0]] / (values[changes[0]] - values[changes[0] + 1])
        (omega,) = refine(search, [places[near] + share * (high - low) / SAMPLES], equations)
        radius = arb(10) ** -search.digits * omega
        ends = [omega - radius, omega + radius]
    return theorem | {"interval": decimals(ends, search.digits + 6)}

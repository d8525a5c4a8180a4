"""Theorems on codimension-two points of the grazing curve: simple zeros of the impulse response and of its sums."""

from __future__ import annotations

from flint import arb, ctx

from grazemap.checker.arithmetic import exact
from grazemap.checker.theorems import TWISTS, impulse
from grazemap_core.proofs.certificates import Document, Search, decimals, inputs
from grazemap_core.proofs.refinement import refine


def prove_codimension_two(search: Search, statement: Document) -> Document:
    """Return the theorem on the zero near the stated frequency."""
    order, kind = statement["order"], statement["type"]
    theorem = inputs(search, statement["near"], "1") | {"type": kind, "order": order}

    def equations(unknowns: list[arb]) -> tuple[list[arb], list[list[arb]]]:
        omega = unknowns[0]
        value, slope = impulse(search.data, theorem, omega, order, TWISTS[kind])
        return [value], [[-slope * arb.pi() * order / (omega * omega)]]

    with ctx.workprec(search.bits):
        (omega,) = refine(search, [exact(statement["near"])], equations)
        radius = arb(10) ** -search.digits * omega
        ends = [omega - radius, omega + radius]
    return theorem | {"interval": decimals(ends, search.digits + 6)}

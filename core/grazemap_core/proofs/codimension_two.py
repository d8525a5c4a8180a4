"""Theorems on codimension-two points of the grazing curve: simple zeros of the impulse response and of its sums."""

from __future__ import annotations

from collections.abc import Iterator

from flint import arb

from grazemap.checker.arithmetic import exact
from grazemap.checker.theorems import impulse
from grazemap_core.proofs.certificates import Attempt, Document, ProofSearch, Undecided, decimals
from grazemap_core.proofs.refinement import refine

SIGN_SAMPLES = 64
"""Parts of the range of frequencies in which a change of sign is looked for."""


def prove_codimension_two(search: ProofSearch, request: Document) -> Iterator[Attempt]:
    """Yield the theorem on the first zero that is found in the range of frequencies.

    Where the maxima of the steady motion are not distinguished, the second statement is on the zero alone.
    """
    statement: Document = {name: request[name] for name in ("type", "order", "range", "stop") if name in request}

    def function(unknowns: list[arb]) -> list[arb]:
        return [impulse(search.machine, request["type"], unknowns[0], request["order"])]

    low, high = (exact(bound) for bound in request["range"])
    places = [low + (high - low) * k / SIGN_SAMPLES for k in range(SIGN_SAMPLES + 1)]
    values = [function([place])[0] for place in places]
    changes = [k for k in range(SIGN_SAMPLES) if values[k] * values[k + 1] < 0]
    if not changes:
        raise Undecided(f"no change of sign was found at {SIGN_SAMPLES + 1} frequencies of the range")
    near, share = changes[0], values[changes[0]] / (values[changes[0]] - values[changes[0] + 1])
    start = decimals([places[near] + share * (high - low) / SIGN_SAMPLES], 20)[0]
    theorem = refine(
        search,
        {"value": start},
        lambda now: ([exact(now["value"])], function),
        lambda now, unknowns: now | {"value": decimals(unknowns, search.digits + 6)[0]},
    )
    yield Attempt(statement, "proven", theorem)
    if "stop" in statement:
        del statement["stop"]
        yield Attempt(statement, "proven", theorem)

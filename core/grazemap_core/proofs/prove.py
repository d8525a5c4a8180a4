"""The search for the proof, or the disproof, of a statement; a certificate says so only if the checker accepts it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from grazemap.checker import check
from grazemap.checker.arithmetic import Refused
from grazemap_core.errors import CoreError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.attraction import BITS_PER_IMPACT, prove_attraction
from grazemap_core.proofs.bifurcations import prove_bifurcation
from grazemap_core.proofs.certificates import Document, Search, Undecided, certificate_format, exact_oscillator
from grazemap_core.proofs.codimension_two import prove_codimension_two
from grazemap_core.proofs.orbits import prove_orbit

KINDS: dict[str, Callable[[Search, Document], Document]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}
ATTEMPTS = 3
"""Numbers of digits tried, each twice the one before."""


def prove(oscillator: Oscillator, statement: Document, digits: int = 30, time_limit: float = 60.0) -> Document:
    """Return a certificate of a statement, or of what contradicts it, or why it is undecided.

    Parameters
    ----------
    oscillator : Oscillator
        Its numbers stand for their shortest decimals.
    statement : dict
        `kind` and the numbers of the statement as in docs/api.md; decimals are strings.
    digits : int
        Digits of the enclosures; the radius of a box is 10^-digits of its largest number.
    time_limit : float
        Seconds after which the search ends.

    Returns
    -------
    dict
        `verdict` is "proven", "disproven" or "undecided", with a `reason`; `theorem` is what the checker verifies.
    """
    certificate: Document = {
        "format": "",
        "statement": statement,
        "verdict": "undecided",
        "reason": "",
        "oscillator": exact_oscillator(oscillator),
        "theorem": None,
        "enclosures": {},
        "bits": 0,
        "digits": digits,
        "time_limit": time_limit,
    }
    certificate["format"] = certificate_format(certificate)
    search = Search(oscillator, certificate["oscillator"], digits, time.monotonic() + time_limit)
    try:
        with search.limited():
            for attempt in range(ATTEMPTS):
                search = replace(search, digits=digits << attempt)
                proof = _attempted(search, certificate)
                if proof["verdict"] != "undecided":
                    return proof
        reason = proof["reason"]
    except (Undecided, Refused) as undecided:
        reason = str(undecided)
    except CoreError as error:
        reason = str(error)
    return certificate | {"reason": f"{reason} ({search.digits} digits, {time_limit:g} s)"}


def _attempted(search: Search, certificate: Document) -> Document:
    """Return a certificate with the theorem that is found, and the verdict that the checker accepts."""
    kind = certificate["statement"]["kind"]
    theorem = {"kind": kind} | KINDS[kind](search, certificate["statement"])
    bits = search.bits + BITS_PER_IMPACT * len(theorem.get("transient", {}).get("times", ()))
    certificate = certificate | {"theorem": theorem, "bits": bits}
    for verdict in ("proven", "disproven"):
        answer = check(certificate | {"verdict": verdict})
        if answer.accepted:
            return certificate | {"verdict": verdict, "enclosures": answer.enclosures}
        if "contradicts" not in answer.reason:
            break
    return certificate | {"reason": answer.reason}

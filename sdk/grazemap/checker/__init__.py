"""The checker of certificates: verifies them in ball arithmetic, with python-flint and the standard library alone.

It uses nothing of the core, whose search for certificates uses its equations. What it accepts is proven
(docs/theory.md, "Proofs").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from flint import ctx

from grazemap.checker import older
from grazemap.checker.arithmetic import Refused
from grazemap.checker.reading import FORMAT, certificate
from grazemap.checker.system import Machine
from grazemap.checker.theorems import prove_attraction, prove_bifurcation, prove_codimension_two, prove_orbit
from grazemap.described import described

__all__ = ["FORMAT", "Verdict", "check"]

THEOREMS: dict[str, Callable[[Machine, dict[str, Any], dict[str, Any], bool], dict[str, Any]]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}


@described
class Verdict(NamedTuple):
    """Whether a certificate is verified. What it says is empty if not."""

    accepted: bool
    """Whether it is verified."""
    reason: str
    """The mathematical reason why it is not; empty if it is."""
    verdict: str
    """"proven" or "disproven"."""
    statement: dict[str, Any]
    """The statement that was read and compared, as it stands in the certificate."""
    oscillator: dict[str, Any]
    """The oscillator, likewise."""
    enclosures: dict[str, Any]
    """What was shown besides."""


def check(document: Any) -> Verdict:
    """Verify a certificate: that its theorem proves or disproves its statement, and that it says nothing else."""
    try:
        if type(document) is dict and document.get("format") in older.FORMATS:
            document = older.translated(document)
        known = certificate(document)
        with ctx.workprec(known["bits"]):
            machine, proven = Machine(known["oscillator"]), known["verdict"] == "proven"
            shown = THEOREMS[known["kind"]](machine, known["statement"], known["theorem"], proven)
    except Refused as refused:
        return Verdict(False, str(refused), "", {}, {}, {})
    except ZeroDivisionError:
        return Verdict(False, "a matrix or a velocity is not shown to be regular", "", {}, {}, {})
    except (ArithmeticError, ValueError) as error:
        # numbers too large for the arithmetic; the text of such an error may have text of the certificate
        return Verdict(False, f"its numbers cannot be worked with ({type(error).__name__})", "", {}, {}, {})
    shown = {"T": f"2 pi/({machine.divisor} omega)", **shown}
    return Verdict(True, "", known["verdict"], document["statement"], document["oscillator"], shown)

"""The checker of certificates: verifies them in ball arithmetic, with python-flint and the standard library alone.

The checker imports nothing of the core. The core searches for certificates, and takes the equations for that from the
checker. The statement of a certificate that the checker accepts is proven (docs/theory.md, "Proofs").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from flint import ctx

from grazemap.checker import older_formats
from grazemap.checker.arithmetic import Refused
from grazemap.checker.reading import FORMAT, certificate
from grazemap.checker.system import Machine
from grazemap.checker.theorems import prove_attraction, prove_bifurcation, prove_codimension_two, prove_orbit
from grazemap.described import described

__all__ = ["FORMAT", "Verdict", "check"]

PROVERS: dict[str, Callable[[Machine, dict[str, Any], dict[str, Any], bool], dict[str, Any]]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}


@described
class Verdict(NamedTuple):
    """The outcome of a check. For a certificate that is not verified, all fields after `reason` are empty."""

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
    """Further quantities that are proven, by name."""


def check(document: Any) -> Verdict:
    """Verify a certificate: that its theorem proves or disproves its statement, and that it says nothing else."""
    try:
        if type(document) is dict and document.get("format") in older_formats.FORMATS:
            document = older_formats.translated(document)
        known = certificate(document)
        with ctx.workprec(known["bits"]):
            machine, proven = Machine(known["oscillator"]), known["verdict"] == "proven"
            shown = PROVERS[known["kind"]](machine, known["statement"], known["theorem"], proven)
    except Refused as refused:
        return Verdict(False, str(refused), "", {}, {}, {})
    except ZeroDivisionError:
        return Verdict(False, "a matrix or a velocity is not shown to be regular", "", {}, {}, {})
    except (ArithmeticError, ValueError) as error:
        # numbers too large for the arithmetic; the text of the error is not shown, as it may quote the certificate
        return Verdict(False, f"its numbers cannot be worked with ({type(error).__name__})", "", {}, {}, {})
    shown = {"T": f"2 pi/({machine.divisor} omega)", **shown}
    return Verdict(True, "", known["verdict"], document["statement"], document["oscillator"], shown)

"""The checker of certificates: verifies them in ball arithmetic, with python-flint and the standard library alone.

It uses nothing of the core, whose search for certificates uses its equations. What it accepts is proven
(docs/theory.md, "Proofs").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from flint import ctx

from grazemap.checker.arithmetic import Refused, require
from grazemap.checker.theorems import prove_attraction, prove_bifurcation, prove_codimension_two, prove_orbit

__all__ = ["Verdict", "check"]

FORMATS = ("grazemap-certificate-1", "grazemap-certificate-2")
"""The second one has a bias, harmonics with their laws, one gap or two, and the stop of a codimension-two point."""
MOST_BITS = 20_000
"""Precision above which a certificate is not verified."""
GIVEN = ("kind", "omega", "displacement", "velocity", "phase", "parameter", "type", "order", "range", "stop")
"""Names in a statement that its theorem must have too, digit for digit."""
CLAIMS = ("stable", "period", "symmetric", "impacts_right", "impacts_left", "stops")
"""Names in a statement that may turn out to be false."""


THEOREMS: dict[str, Callable[[dict[str, Any], dict[str, Any]], dict[str, Any]]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}


class Verdict(NamedTuple):
    """Whether a certificate's theorem is proven, the mathematical reason if not, and the enclosures computed."""

    accepted: bool
    reason: str
    enclosures: dict[str, Any]


def check(certificate: dict[str, Any]) -> Verdict:
    """Verify a certificate: its theorem, and that the theorem proves or disproves the statement."""
    try:
        require(certificate["format"] in FORMATS, f"its format is not {' or '.join(FORMATS)}")
        theorem, bits = certificate["theorem"], certificate["bits"]
        require(theorem is not None, "it contains no theorem")
        require(64 <= bits <= MOST_BITS, "its precision is out of range")
        with ctx.workprec(bits):
            found = THEOREMS[theorem["kind"]](certificate["oscillator"], theorem)
        _compare(certificate["statement"], certificate["verdict"], theorem, found)
    except Refused as refused:
        return Verdict(False, str(refused), {})
    except ZeroDivisionError:
        return Verdict(False, "a matrix or a velocity is not shown to be regular", {})
    except (KeyError, IndexError, TypeError, ValueError) as error:
        return Verdict(False, f"it is malformed: {error!r}", {})
    return Verdict(True, "", found)


def _compare(statement: dict[str, Any], verdict: str, theorem: dict[str, Any], found: dict[str, Any]) -> None:
    """Require that the theorem is about the statement's inputs, and says what the verdict says of the statement."""
    for name in GIVEN:
        if name in statement:
            require(theorem[name] == statement[name], f"the theorem's {name} is not that of the statement")
    if "clearance" in statement:
        both = statement["clearance"]
        gaps = [both["right"], both["left"]] if isinstance(both, dict) else [both] * 2
        require(theorem["gaps"] == gaps, "the theorem's gaps are not the statement's clearance")
    false = [name for name in CLAIMS if name in statement and not _same(name, statement[name], found)]
    if verdict == "proven":
        require(not false, f"the theorem contradicts the statement: {', '.join(false)}")
    else:
        # another orbit near by contradicts nothing; the same orbit with other multipliers, or another attractor, does
        deciding = {"stable"} if theorem["kind"] == "orbit" else {"period", "impacts_right", "impacts_left"}
        contradicts = bool(deciding & set(false)) and (theorem["kind"] == "attraction" or false == ["stable"])
        require(verdict == "disproven" and contradicts, "the theorem does not contradict the statement")


def _same(name: str, asked: Any, found: dict[str, Any]) -> bool:
    """Return whether a value agrees; stops are those of a period from any impact on, a graze counted as one or not."""
    if name == "symmetric":  # a theorem on an orbit that is not called symmetric does not show that it is not
        return bool(found[name]) or not asked
    if name == "stops":
        sequences = [found[name], found.get("stops_with_graze", [])]
        return any(stops[i:] + stops[:i] == asked for stops in sequences for i in range(len(stops)))
    return bool(asked == found[name])

"""The search for the proof, or the disproof, of a statement; a certificate says so only if the checker accepts it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from flint import ctx

from grazemap.checker import FORMAT, check
from grazemap.checker.arithmetic import Refused
from grazemap.checker.reading import OSCILLATOR
from grazemap.checker.system import Machine
from grazemap_core.errors import CoreError
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.attraction import prove_attraction
from grazemap_core.proofs.bifurcations import prove_bifurcation, prove_codimension_two
from grazemap_core.proofs.certificates import Attempt, Document, ProofSearch, Undecided, exact_oscillator
from grazemap_core.proofs.orbits import prove_orbit
from grazemap_core.proofs.tolerances import DOUBLINGS
from grazemap_core.records import NamedTuple

PROOF_ATTEMPTS: dict[str, Callable[[ProofSearch, Document], Iterator[Attempt]]] = {
    "orbit": prove_orbit,
    "attraction": prove_attraction,
    "bifurcation": prove_bifurcation,
    "codimension-two": prove_codimension_two,
}


class Proof(NamedTuple):
    """A certificate, or why there is none."""

    certificate: Document
    """The `verdict` is "proven", "disproven" or "undecided"; the `theorem` is what the checker verifies."""
    reason: str
    """Why it is undecided; empty if it is not."""
    enclosures: Document
    """What the checker shows besides the statement."""


def prove(oscillator: Oscillator, request: Document, digits: int = 30) -> Proof:
    """Return the certificate of a statement, or of what contradicts it, or why it is undecided.

    Parameters
    ----------
    oscillator : Oscillator
        Its numbers stand for their shortest decimals.
    request : dict
        What is to be proven, by `kind`; decimals are strings. orbit: `omega`, `clearance`, `period`, `stops`, `stable`,
        and `phases`, `velocities` and `radius` of its impacts, or none of these three. attraction: `omega`,
        `clearance`, `displacement`, `velocity`, `phase` and perhaps `label`. bifurcation: as an orbit, from which the
        bifurcation of a `type` over a `parameter` in a `range` is looked for. codimension-two: `type`, `order`, `range`
        and perhaps `stop`.
    digits : int
        Digits of the enclosures; the radius of a box is 10^-digits of its largest number.
    """
    *_, last = attempts(oscillator, request, digits)
    return last


def attempts(oscillator: Oscillator, request: Document, digits: int) -> Iterator[Proof]:
    """Yield what is known before the search, and then with more and more digits, until it is decided or given up."""
    undecided: Document = {
        "format": FORMAT,
        "statement": request,
        "verdict": "undecided",
        "oscillator": exact_oscillator(oscillator),
    }
    yield Proof(undecided, "no attempt was completed", {})
    try:
        machine = Machine(OSCILLATOR(undecided["oscillator"], "the oscillator"))
    except Refused as reason:
        yield Proof(undecided, str(reason), {})
        return
    for doubling in range(DOUBLINGS):
        search = ProofSearch(oscillator, machine, digits << doubling)
        try:
            with ctx.workprec(search.bits):
                proof = _decided(search, undecided, request)
        except (Undecided, Refused, CoreError) as reason:
            yield Proof(undecided, f"{reason} ({search.digits} digits)", {})
        except ZeroDivisionError:
            yield Proof(undecided, f"a response is infinite at a frequency that was tried ({search.digits} digits)", {})
        else:
            yield proof
            return


def _decided(search: ProofSearch, undecided: Document, request: Document) -> Proof:
    """Return the first proof that the checker accepts; raise Undecided with why it does not accept the first one."""
    reasons = []
    for attempt in PROOF_ATTEMPTS[request["kind"]](search, request):
        certificate = undecided | {
            "statement": {"kind": request["kind"], **attempt.statement},
            "verdict": attempt.verdict,
            "theorem": attempt.theorem,
            "bits": max(attempt.bits, search.bits),
        }
        answer = check(certificate)
        if answer.accepted:
            return Proof(certificate, "", answer.enclosures)
        reasons.append(answer.reason)
    raise Undecided(reasons[0] if reasons else "nothing was found to begin with")

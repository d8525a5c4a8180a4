"""The process proofs: searches for a certificate of a statement."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

from grazemap import results
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import ClearancePair, ProofsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.plan import SMALL_SECONDS
from grazemap_worker.processes.conversion import STOPS, core_oscillator
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.time_limit import run_limited


def _seconds(request: ProofsRequest) -> float:
    seconds = min(rates.PROOF_SECONDS[request.statement.kind], request.time_limit)
    # a proof runs in a forked process because of its time limit, so it is not a small job
    return max(SMALL_SECONDS, seconds)


def compute(request: ProofsRequest, report: Report) -> ClassDocument:
    """Return the certificate of a statement, or the reason why the statement is undecided."""
    from grazemap_core.errors import ParameterError

    try:
        from grazemap_core.proofs.prove import attempts
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        raise ParameterError(
            "statement", 'cannot be proven here, where python-flint is not installed: pip install "grazemap[proofs]"'
        ) from None

    oscillator, limit = core_oscillator(request.oscillator), request.time_limit
    search = partial(attempts, oscillator, statement(request), request.digits)
    steps, ended = run_limited(limit, search)
    proof = steps[-1] if steps else next(search())  # the limit may end before the first step
    reason = f"the limit of {limit:g} s of processor time is reached" if ended else proof.reason
    return document_of(
        results.Proof,
        kind=request.statement.kind,
        verdict=proof.certificate["verdict"],
        reason=reason or None,
        limited=ended,
        certificate=json.dumps(proof.certificate),
        shown=json.dumps(proof.enclosures),
    )


def statement(request: ProofsRequest) -> dict[str, Any]:
    """Return the statement to be proven as the core takes it: numbers are texts of decimals."""
    from grazemap.checker.reading import RADIUS
    from grazemap_core.proofs.certificates import text

    claim = request.statement
    names = ("kind", "type", "order", "label")
    values: dict[str, Any] = {name: getattr(claim, name) for name in names if getattr(claim, name) is not None}
    if claim.omega is not None:
        values["omega"] = text(claim.omega)
    if isinstance(claim.clearance, ClearancePair):
        sides = {"right": claim.clearance.right, "left": claim.clearance.left}
        values["clearance"] = {side: None if gap is None else text(gap) for side, gap in sides.items()}
    elif claim.clearance is not None:
        values["clearance"] = text(claim.clearance)
    if claim.kind == "codimension-two":
        values["stop"] = STOPS.get(claim.stop or "", 0)
    if claim.kind == "orbit":
        values["stable"] = claim.stable is not False
    if claim.motion is not None:
        values |= {"period": claim.motion.period, "stops": claim.motion.stops}
        if claim.motion.phases is not None and claim.motion.velocities is not None:
            values["phases"] = [text(x) for x in claim.motion.phases]
            values["velocities"] = [text(x) for x in claim.motion.velocities]
            values["radius"] = text(claim.radius or RADIUS)
    if claim.initial is not None:
        displacement, velocity = claim.initial.displacement, claim.initial.velocity or ()
        values["displacement"] = "equilibrium" if displacement is None else [text(x) for x in displacement]
        values["velocity"] = [text(x) for x in velocity]
        values["phase"] = text(claim.initial.phase)
    if claim.axis is not None:
        values |= {"parameter": claim.axis.vary} if claim.kind == "bifurcation" else {}
        values["range"] = [text(end) for end in claim.axis.ends]
    return values


PROCESS = Process(whole=compute, seconds=_seconds, kernels="orbits", lasting=lambda document: not document["limited"])

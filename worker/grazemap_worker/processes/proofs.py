"""The process proofs: the certificate of a statement."""

from __future__ import annotations

import json
from typing import Any

from grazemap import results
from grazemap.results.documents import ClassDocument, document_of
from grazemap.wire import ClearancePair, ProofsRequest
from grazemap_worker.planning import rates
from grazemap_worker.planning.plan import SMALL_SECONDS
from grazemap_worker.processes.conversion import STOPS, core_oscillator
from grazemap_worker.processes.process import Process, Report
from grazemap_worker.processes.time_limit import within


def _seconds(request: ProofsRequest) -> float:
    seconds = min(rates.PROOF_SECONDS[request.statement.kind], request.time_limit)
    # it has a process of its own for its limit of time, so it is not small
    return max(SMALL_SECONDS, seconds)


def compute(request: ProofsRequest, report: Report) -> ClassDocument:
    """Return the certificate of a statement, or why it is undecided."""
    from grazemap_core.errors import ParameterError

    try:
        from grazemap_core.proofs.prove import attempts
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        raise ParameterError("statement", "cannot be proven here, where python-flint is not installed") from None

    oscillator, limit = core_oscillator(request.oscillator), request.time_limit
    steps, ended = within(limit, lambda: attempts(oscillator, statement(request), request.digits))
    proof = steps[-1]
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
    """Return what is to be proven with decimals for numbers, as the core takes it."""
    from grazemap.checker.reading import RADIUS
    from grazemap_core.proofs.certificates import text

    asked = request.statement
    names = ("kind", "type", "order", "label")
    values: dict[str, Any] = {name: getattr(asked, name) for name in names if getattr(asked, name) is not None}
    if asked.omega is not None:
        values["omega"] = text(asked.omega)
    if isinstance(asked.clearance, ClearancePair):
        sides = {"right": asked.clearance.right, "left": asked.clearance.left}
        values["clearance"] = {side: None if gap is None else text(gap) for side, gap in sides.items()}
    elif asked.clearance is not None:
        values["clearance"] = text(asked.clearance)
    if asked.kind == "codimension-two":
        values["stop"] = STOPS.get(asked.stop or "", 0)
    if asked.kind == "orbit":
        values["stable"] = asked.stable is not False
    if asked.motion is not None:
        values |= {"period": asked.motion.period, "stops": asked.motion.stops}
        if asked.motion.phases is not None and asked.motion.velocities is not None:
            values["phases"] = [text(x) for x in asked.motion.phases]
            values["velocities"] = [text(x) for x in asked.motion.velocities]
            values["radius"] = text(asked.radius or RADIUS)
    if asked.initial is not None:
        place, rates = asked.initial.displacement, asked.initial.velocity or ()
        values["displacement"] = "equilibrium" if place is None else [text(x) for x in place]
        values["velocity"] = [text(x) for x in rates]
        values["phase"] = text(asked.initial.phase)
    if asked.vary is not None:
        values["parameter"] = asked.vary
    if asked.range is not None:
        values["range"] = [text(asked.range.start), text(asked.range.stop)]
    return values


PROCESS = Process(whole=compute, seconds=_seconds, kernels="orbits", lasting=lambda document: not document["limited"])

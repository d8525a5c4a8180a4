"""The process proofs: the certificate of a statement."""

from __future__ import annotations

import json
import re
from typing import Any

from grazemap.codec import Document
from grazemap.wire import ClearancePair, ProofsRequest
from grazemap_worker.processes.conversion import Report, core_oscillator
from grazemap_worker.processes.process import Process


def compute(request: ProofsRequest, report: Report) -> Document:
    """Return the certificate of a statement, or why it is undecided."""
    from grazemap_core.errors import ParameterError

    try:
        from grazemap_core.proofs.prove import prove
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        raise ParameterError("statement", "cannot be proven here, where python-flint is not installed") from None

    certificate = prove(core_oscillator(request.oscillator), statement(request), request.digits, request.time_limit)
    return {
        "kind": request.statement.kind,
        "verdict": certificate["verdict"],
        "reason": certificate["reason"] or None,
        "certificate": json.dumps(certificate),
    }


def statement(request: ProofsRequest) -> dict[str, Any]:
    """Return the statement with decimals for numbers."""
    from grazemap_core.proofs.certificates import text

    said = request.statement
    found: dict[str, Any] = {"kind": said.kind}
    if said.omega is not None:
        found["omega"] = text(said.omega)
    if isinstance(said.clearance, ClearancePair):
        sides = {"right": said.clearance.right, "left": said.clearance.left}
        found["clearance"] = {side: None if one is None else text(one) for side, one in sides.items()}
    elif said.clearance is not None:
        found["clearance"] = text(said.clearance)
    if said.stop is not None:
        found["stop"] = 1 if said.stop == "A" else -1
    if said.kind == "orbit":
        found["stable"] = said.stable is not False
    if said.motion is not None:
        found |= said.motion.model_dump(exclude_none=True)
    if said.initial is not None:
        state = said.initial
        place, rates = state.displacement, state.velocity or ()
        found["displacement"] = "equilibrium" if place is None else [text(x) for x in place]
        found["velocity"] = [text(x) for x in rates]
        found["phase"] = text(state.phase)
    if said.label is not None:
        period, right, left = (max(int(number), 0) for number in re.findall(r"-1(?=\))|\d+", said.label))
        found |= {"period": period, "impacts_right": right, "impacts_left": left}
    if said.range is not None:
        found["range"] = [text(said.range.start), text(said.range.stop)]
    given = {"type": said.type, "parameter": said.vary, "order": said.order}
    return found | {name: value for name, value in given.items() if value is not None}


PROCESS = Process(whole=compute)

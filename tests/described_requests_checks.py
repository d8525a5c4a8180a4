"""A check for schemathesis, in whose environment it runs: a request that its schema allows is refused for few reasons.

Those are relations between fields, which a JSON schema cannot say and which their descriptions do, and a job that is
over the limits of the server.
"""

from __future__ import annotations

import re
from typing import Any

import schemathesis  # type: ignore[import-not-found]

# Not known, not acceptable, unfinished or dismissed, too large for the queue: of the server's state, or of Accept.
_OF_STATE = {404, 406, 409, 429}
_RELATIONS = re.compile(
    "|".join(
        (
            "Input should be a valid integer",  # 2.0, which is one for a JSON schema
            "stop must be greater than start",
            "omega ends too far from where it starts",
            "the (values|times|phases) must increase.*",
            r"[\w.]+ has \d+ numbers and .*",
            r"[\w.]+ of mass 1 lies (outside the stops|on a stop)",
            r"\w+\.values of mass 1 reach the stops",
            r"\w+\.mass is no mass of the oscillator",
            "vertical is the same coordinate as horizontal",
            "both .* are given",
            ".* (is|are) given, and .* (is|are) missing",
            "a time lies after the end of the record",
            "the label does not agree with the period and the stops",
            "the range.* does not contain the .* of the orbit",
            "restitution is at most 1",
            "(clearance|omega) is greater than 0",
            "(clearance|omega) of a motion lies outside the window",
            "(clearance|omega) is missing: it is the parameter that does not vary",
            "(clearance|omega) varies: its values are the range",
            "a sweep (starts at rounded states|cannot be adaptive.*)",
            "an adaptive map is not resolved",
            ".* missing in a statement of the kind .*",
            "a statement of the kind .* has no .*",
            "damping has no default in SI units",
        )
    )
)


@schemathesis.check  # type: ignore[untyped-decorator]
def allowed_requests_are_refused_for_relations_only(_context: Any, response: Any, case: Any) -> None:
    """Raise AssertionError if a request that the schema allows is refused for another reason."""
    if case.meta is None or not case.meta.generation.mode.is_positive:
        return
    if response.status_code < 400 or response.status_code in _OF_STATE:
        return
    problem = response.json()
    if str(problem.get("type")).endswith(":too-much-work"):
        return
    reasons = [error["detail"] for error in problem.get("errors", ())]
    if not reasons or not all(map(_RELATIONS.fullmatch, reasons)):
        raise AssertionError(f"refused, though its schema allows it: {problem}")

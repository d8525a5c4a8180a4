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
RELATIONS = (
    "Input should be a valid integer",  # 2.0, which is one for a JSON schema
    "the number is too large or too small to compute with",  # of such digits
    # ranges and lists
    r"stop must (be greater|not be less) than start",
    "omega ends too far from where it starts",
    r"the (values|times|phases) must increase.*",
    r"(\S+|the row) has \S+ \S+ and .*",
    "a time lies after the end of the record",
    r"the range.* does not contain the \S+ of the orbit",
    # what is given beside what
    "radius is given, and motion has no phases and velocities",
    "both .* are given",
    r".* (is|are) given, and (so are matrices|\S+ (is|are) missing)",
    r"\S+ is missing(: it does not vary| in a statement of the kind \S+)?",
    "(stop|motions) (is|are) missing: .*",
    r"a statement of the kind \S+ has no .*",
    "the label does not agree with the period and the stops",
    "order is odd, and one stop is grazed after whole periods",
    "sequence is of two equal stops",
    "a sweep (starts at rounded states|cannot be adaptive.*)",
    "an adaptive map is not resolved",
    "other_starts are compared with .*",
    "observables and outputs are of motions that .*",
    "an observable is named twice",
    "an output has no row",
    "the name of an output is not an identifier",
    # the oscillator
    r"\S+ has no default (in SI units|where there are matrices)",
    r"contact (names mass \S+ and there are \S+|is between a mass and itself)",
    "contact sees a free mode of the structure, which this version does not cover",
    "bias pushes along a free mode, so there is no equilibrium",
    "stiffness has a free mode and is not symmetric, which this version does not cover",
    "damping acts on a free mode and is not diagonal in the modes, which this version does not cover",
    "contact.row is a row of zeros",
    "several contacts are not covered in this version",
    "these are the distances of both stops",
    r"\S+ is not (square|symmetric|positive definite)",
    "damping.modal is for a symmetric stiffness matrix: there are no real modes",
    "a free motion grows",
    # stops, and states between them
    "the stops leave no space between them",
    "both stops are absent",
    "an impact is on a stop that is absent",
    r"clearance fixes the \S+ stop, which is grazed",
    "one stop is fixed or absent, and the other one varies",
    "only one of the two clearances may vary",
    "only one parameter may vary",
    r"\S+ places the contact (on a stop( or beyond it)?|outside the stops)",
    r"\S+( and \S+)? places? the contact at \S+( to \S+)?, on a stop or beyond it",
    # parameters that vary
    "vertical is the same coordinate as horizontal",
    "both axes have the same parameter",
    r"\S+ and \S+ are not independent",
    r"\S+ varies: its values are (the range|those of an axis)",
    r"\S+ must be (greater than 0|at least 0|between 0 and 1)",
    r"\S+ of a motion lies outside the window",
    r"vary is \S+, and (the stops differ|there is no such stop)",
    "the (bias varies, and the oscillator has none|forces vary, and there are none)",
    r"\S+ (does not exist|are those of a chain)",
    "there is no such (parameter|coordinate)",
    "a codimension-two point is looked for over omega",
    "the values are negative",
    "dampings.* is one of a list of dampings, and the oscillator has one number for all links",
)
"""Reasons: the texts of `grazemap.wire.base.invalid` (test_described_requests compares them)."""
_RELATIONS = re.compile("|".join(RELATIONS))


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

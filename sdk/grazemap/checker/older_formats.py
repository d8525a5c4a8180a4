"""Translates certificates of the formats 1 and 2 to the present format.

A certificate of these formats repeats the inputs of the statement in the theorem; both have to agree. It counts periods
of 2 pi/omega, whatever the harmonics of the forces are. The statement of a bifurcation says on which branch of orbits
it lies, which no theorem shows, and does not name the orbit at the point: it is refused.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from flint import arb_mat

from grazemap.checker.arithmetic import require
from grazemap.checker.orbits import label
from grazemap.checker.reading import (
    FORMAT,
    MAX_IMPACTS,
    OSCILLATOR,
    POSITIVE_INTEGER,
    RADIUS,
    STATEMENTS,
    STOPS,
    anything,
    choice,
    either,
    fields,
    integer,
    number,
    sequence,
)
from grazemap.checker.system import Machine

FORMATS = ("grazemap-certificate-1", "grazemap-certificate-2")

_GAP = either(None, number)
_BOTH = sequence(_GAP, 2, 2)
_COUNT = integer(0, MAX_IMPACTS)
_PLACE = {"omega": number, "clearance": anything}
_POINT = {"type": anything, "range": anything}
_START = {"displacement": anything, "velocity": anything, "phase": number}
_GUESS = {"phases": anything, "velocities": anything}
_COUNTS = {"impacts_right": _COUNT, "impacts_left": _COUNT}
_STATEMENTS = {
    "orbit": fields({**_PLACE, "period": POSITIVE_INTEGER, "stable": anything}, {"stops": STOPS, **_COUNTS, **_GUESS}),
    "attraction": fields({**_PLACE, **_START}, {"period": POSITIVE_INTEGER, **_COUNTS}),
    "codimension-two": fields({**_POINT, "order": POSITIVE_INTEGER}, {"stop": choice(1, -1)}),
}
_INPUTS = {"omega": number, "gaps": _BOTH, "restitutions": sequence(number, 2, 2)}
_ORBIT = dict.fromkeys(("symmetric", "section", "times", "state", "radius"), anything)
_MOTION = {**_INPUTS, **_ORBIT, "period": POSITIVE_INTEGER, "stops": STOPS}
_THEOREMS = {
    "orbit": fields(_MOTION, {"unstable": anything, "direction": anything}),
    "attraction": fields(
        {**_MOTION, **_START, **dict.fromkeys(("norm", "size", "transient"), anything)}, {"direction": anything}
    ),
    "codimension-two": fields(
        {**_INPUTS, **_POINT, "order": anything, "value": anything, "radius": anything}, {"stop": anything}
    ),
}
_CERTIFICATE = fields(
    dict.fromkeys(("format", "statement", "verdict", "oscillator", "theorem", "bits"), anything),
    dict.fromkeys(("reason", "enclosures", "digits", "time_limit"), anything),
)


def translated(document: dict[str, Any]) -> dict[str, Any]:
    """Return a certificate of an older format in the present one; what it says is not changed."""
    _CERTIFICATE(document, "the certificate")
    oscillator, statement, theorem = document["oscillator"], document["statement"], document["theorem"]
    require(all(type(part) is dict for part in (oscillator, statement, theorem)), "a part has no names")
    kind = choice(*STATEMENTS)(statement.get("kind"), "the statement's kind")
    require(kind in _STATEMENTS, f"a {kind} of an older format does not name the orbit at the point")
    require(theorem.get("kind") == kind, "the theorem is of another kind than the statement")
    forcing = oscillator.get("forcing")
    if type(forcing) is dict:
        fields({"sine": anything, "cosine": anything})(forcing, "the forcing")
        forcing = [{"harmonic": 1, "powers": [[forcing["sine"], forcing["cosine"]]]}]
        oscillator = oscillator | {"forcing": forcing}
    machine = Machine(OSCILLATOR(oscillator, "the oscillator"))
    require(
        set(machine.forces) <= {1},
        "a certificate of an older format counts other periods where there are several harmonics",
    )
    words = {name: value for name, value in statement.items() if name != "kind"}
    read = _STATEMENTS[kind](words, "the statement")
    shown = _THEOREMS[kind]({name: value for name, value in theorem.items() if name != "kind"}, "the theorem")
    for name in ("type", "range", "order", "stop", "phase", "displacement", "velocity"):
        require(read.get(name) == shown.get(name), f"the theorem's {name} is not that of the statement")
    now = {name: statement[name] for name in ("type", "order", "range", *_START) if name in statement}
    used = {name: theorem[name] for name in ("value", "radius", *_ORBIT, "period", "stops") if name in theorem}
    used |= {name: theorem[name] for name in ("norm", "size", "transient") if name in theorem}
    if theorem.get("direction"):
        used["direction"] = theorem["direction"]
    if kind == "codimension-two":
        now["stop"] = statement.get("stop", 0)
    else:
        used["scale"] = _scale(machine)
        now |= _inputs(statement, theorem, shown)
    if kind == "orbit":
        now |= _motion(statement, read, theorem["stops"], bool(theorem["symmetric"]))
    elif kind == "attraction" and not {"period", *_COUNTS}.isdisjoint(statement):
        require({"period", *_COUNTS} <= statement.keys(), "the statement has a part of a label")
        stops = [1] * read["impacts_right"] + [-1] * read["impacts_left"]
        now["label"] = label(read["period"], stops)
    verdict, bits = document["verdict"], document["bits"]
    new = {"format": FORMAT, "verdict": verdict, "oscillator": oscillator, "bits": bits}
    return new | {"statement": {"kind": kind, **now}, "theorem": used}


def _scale(machine: Machine) -> str:
    """Return the scale W of velocities in the states of older formats, which is 1 beyond the range of doubles."""

    def exponent(matrix: arb_mat) -> int:
        return math.frexp(max(float(abs(x).real) for x in matrix.entries()))[1]

    inverse = arb_mat(machine.mass).inv()
    spring, drag = (exponent(inverse * arb_mat(matrix)) for matrix in (machine.stiffness, machine.damping))
    return str(Fraction(2) ** max((spring + 1) // 2, drag))


def _inputs(statement: dict[str, Any], theorem: dict[str, Any], shown: dict[str, Any]) -> dict[str, Any]:
    """Return frequency, clearances and restitutions."""
    both = statement["clearance"]
    if type(both) is dict:
        fields({"right": _GAP, "left": _GAP})(both, "the clearance")
        both = [both["right"], both["left"]]
    else:
        both = [both, both]
    same = shown["omega"] == number(statement["omega"], "omega") and shown["gaps"] == _BOTH(both, "the clearance")
    require(same, "the theorem's inputs are not those of the statement")
    pairs = {"clearance": both, "restitution": theorem["restitutions"]}
    return {"omega": statement["omega"]} | {
        name: dict(zip(("right", "left"), pair, strict=True)) for name, pair in pairs.items()
    }


def _motion(statement: dict[str, Any], read: dict[str, Any], half: list[int], symmetric: bool) -> dict[str, Any]:
    """Return the period and the stops of an orbit, and the box if it has phases."""
    stops = statement.get("stops")
    if stops is None:
        require(set(_COUNTS) <= statement.keys(), "the statement has neither stops nor numbers of impacts")
        stops = [*half, *(-stop for stop in half)] if symmetric else half
    counts = {"impacts_right": stops.count(1), "impacts_left": stops.count(-1)}
    same = all(read.get(name, count) == count for name, count in counts.items())
    require(same, "the orbit has other impacts than those of the statement")
    motion = {"period": statement["period"], "stops": stops}
    if "phases" in statement:
        numbers = {name: statement.get(name) for name in _GUESS}
        require(all(type(x) is list for x in numbers.values()), "phases or velocities are not a list")
        motion |= {name: [repr(x) if type(x) is float else x for x in values or ()] for name, values in numbers.items()}
        motion["radius"] = RADIUS
    return motion | {"stable": statement["stable"]}

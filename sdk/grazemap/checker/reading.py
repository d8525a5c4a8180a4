"""Reads certificates: every name is known and present once, every value has its form and size.

Nothing of a certificate is used, compared or printed that was not read here. Numbers are exact: decimals or quotients
of integers, as text.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Any

from grazemap.checker.arithmetic import Refused, require

FORMAT = "grazemap-certificate-3"
VARIED = "varied"
"""Stands for the number that varies, in the inputs of a statement about a parameter."""
RADIUS = "1e-6"
"""Radius of the box of an orbit, in radians and relative to the largest velocity, unless the certificate gives one."""
PARAMETERS = (
    "omega",
    "clearance",
    "clearance_right",
    "clearance_left",
    "restitution",
    "restitution_right",
    "restitution_left",
)
"""The parameters of bifurcations; without _right or _left, both stops have the same value."""

NUMBER = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]{1,4}|/[0-9]+)?")
LABEL = re.compile(r"[1-9][0-9]*-([1-9][0-9]*|\(-1\))r-([1-9][0-9]*|\(-1\))l")
BITS = 64, 20_000
"""Precisions at which certificates are verified."""
MAX_CHARACTERS = 10_000
"""Characters of a number."""
MAX_MASSES = 64
MAX_HARMONICS = 1_000
MAX_PERIODS = 10_000
"""Periods of an orbit, orders of harmonics and of codimension-two points."""
MAX_IMPACTS = 100_000
"""Impacts of a period, or of a transient."""

Reader = Callable[[Any, str], Any]
"""Takes a value, and its name for messages. Returns the value as the checker uses it, or raises Refused."""


def decoded(data: bytes | str) -> Any:
    """Return the JSON document in a text. Raises Refused, also where an object has a name twice."""

    def names(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        members = dict(pairs)
        require(len(members) == len(pairs), "a name is there twice")
        return members

    try:
        return json.loads(data, object_pairs_hook=names)
    except (ValueError, RecursionError):
        raise Refused("it is not JSON, or nested too deeply") from None


def number(value: Any, name: str) -> Fraction:
    """Return a rational number."""
    require(type(value) is str and len(value) <= MAX_CHARACTERS, f"{name} is not a number as text")
    require(NUMBER.fullmatch(value) is not None, f"{name} is not a decimal or a quotient")
    try:
        return Fraction(value)
    except (ValueError, ZeroDivisionError):
        raise Refused(f"{name} is not a number") from None


def integer(low: int, high: int) -> Reader:
    """Return the reader of an integer in a range."""

    def read(value: Any, name: str) -> int:
        require(type(value) is int and low <= value <= high, f"{name} is not an integer from {low} to {high}")
        return int(value)

    return read


def truth(value: Any, name: str) -> bool:
    """Return true or false."""
    require(type(value) is bool, f"{name} is not true or false")
    return bool(value)


def choice(*values: Any) -> Reader:
    """Return the reader that accepts these values only."""

    def read(value: Any, name: str) -> Any:
        same = [known for known in values if type(known) is type(value) and known == value]
        require(len(same) == 1, f"{name} is none of {', '.join(map(str, values))}")
        return same[0]

    return read


def either(first: Any, reader: Reader) -> Reader:
    """Return the reader that accepts one value, and passes all others to another reader."""

    def read(value: Any, name: str) -> Any:
        return first if type(value) is type(first) and value == first else reader(value, name)

    return read


def sequence(reader: Reader, most: int, least: int = 0) -> Reader:
    """Return the reader of a list."""

    def read(value: Any, name: str) -> list[Any]:
        require(type(value) is list and least <= len(value) <= most, f"{name} is not a list of at most {most}")
        return [reader(entry, name) for entry in value]

    return read


def fields(required: Mapping[str, Reader], optional: Mapping[str, Reader] | None = None) -> Reader:
    """Return the reader of an object that has these names and no others."""
    readers = {**required, **(optional or {})}

    def read(value: Any, name: str) -> dict[str, Any]:
        require(type(value) is dict, f"{name} has no names")
        missing = [known for known in required if known not in value]
        require(not missing, f"{name} lacks {', '.join(missing)}")
        require(all(known in readers for known in value), f"{name} has an unknown name")
        return {known: readers[known](value[known], f"{name}, {known}") for known in readers if known in value}

    return read


def anything(value: Any, _: str) -> Any:
    """Accept any value: it is neither used nor printed."""
    return value


def read_label(value: Any, name: str) -> str:
    """Return the name n-p_r-q_l of a motion."""
    require(type(value) is str and len(value) <= 64 and LABEL.fullmatch(value) is not None, f"{name} is no label")
    return str(value)


POSITIVE_INTEGER = integer(1, MAX_PERIODS)
ROW = sequence(number, MAX_MASSES, 1)
MATRIX = sequence(ROW, MAX_MASSES, 1)
NUMBERS = sequence(number, MAX_IMPACTS)
STOPS = sequence(choice(1, -1), MAX_IMPACTS)
PAIR = sequence(number, 2, 2)

OSCILLATOR = fields(
    {
        "mass": MATRIX,
        "damping": MATRIX,
        "stiffness": MATRIX,
        "contact": ROW,
        # amplitudes of sine and cosine by powers of k omega, at most two
        "forcing": sequence(
            fields({"harmonic": POSITIVE_INTEGER, "powers": sequence(sequence(ROW, 2, 2), 3, 1)}), MAX_HARMONICS
        ),
    },
    {"bias": ROW},
)
"""M, C, K, the contact row, the forces by harmonic, and the static force."""

_SIDES = ("left", "right")
INPUTS: dict[str, Reader] = {
    "omega": either(VARIED, number),
    "clearance": fields(dict.fromkeys(_SIDES, either(None, either(VARIED, number)))),
    "restitution": fields(dict.fromkeys(_SIDES, either(VARIED, number))),
}
BOX: dict[str, Reader] = {"phases": NUMBERS, "velocities": NUMBERS, "radius": number}
"""A box of motions: omega t at the contacts, the velocities before them, and how far a motion may be from these."""
_MOTION = {"period": POSITIVE_INTEGER, "stops": STOPS}

STATEMENTS: dict[str, Reader] = {
    "orbit": fields({**INPUTS, **_MOTION, "stable": truth}, BOX),
    "attraction": fields(
        {**INPUTS, "displacement": either("equilibrium", ROW), "velocity": ROW, "phase": number}, {"label": read_label}
    ),
    "bifurcation": fields(
        {
            **INPUTS,
            **_MOTION,
            "type": choice("SN", "PD", "SB", "GR"),
            "parameter": choice(*PARAMETERS),
            "range": PAIR,
        },
        BOX,
    ),
    "codimension-two": fields(
        {"type": choice("g", "h", "h_s"), "order": POSITIVE_INTEGER, "range": PAIR}, {"stop": choice(1, -1, 0)}
    ),
}
"""What a statement of each kind says, besides its kind. Stop 0 stands for both stops at once."""

_ORBIT: dict[str, Reader] = {
    **_MOTION,
    "symmetric": truth,
    "section": number,
    "scale": number,
    "times": NUMBERS,
    "state": sequence(number, 2 * MAX_MASSES, 2),
    "radius": number,
}
THEOREMS: dict[str, Reader] = {
    "orbit": fields(_ORBIT),
    "attraction": fields(
        {
            **_ORBIT,
            "norm": sequence(sequence(number, 2 * MAX_MASSES, 2), 2 * MAX_MASSES, 2),
            "size": number,
            "transient": fields({"stops": STOPS, "times": NUMBERS, "turns": integer(0, MAX_IMPACTS)}),
        }
    ),
    "bifurcation": fields(
        {**_ORBIT, "value": number},
        {"direction": sequence(number, 2 * MAX_MASSES, 2), "graze": choice(1, -1)},
    ),
    "codimension-two": fields({"value": number, "radius": number}),
}
"""The numbers with which the statement, or what contradicts it, is shown."""

_CERTIFICATE = fields(
    {
        "format": choice(FORMAT),
        "verdict": choice("proven", "disproven"),
        "oscillator": OSCILLATOR,
        "statement": anything,
        "theorem": anything,
        "bits": integer(*BITS),
    }
)


def certificate(document: Any) -> dict[str, Any]:
    """Return a certificate of the present format with its numbers, and its kind as `kind`."""
    known: dict[str, Any] = _CERTIFICATE(document, "the certificate")
    statement = document["statement"]
    require(type(statement) is dict and "kind" in statement, "the statement has no kind")
    kind = choice(*STATEMENTS)(statement["kind"], "the statement's kind")
    words = {name: value for name, value in statement.items() if name != "kind"}
    known |= {"kind": kind, "statement": STATEMENTS[kind](words, "the statement")}
    known["theorem"] = THEOREMS[kind](document["theorem"], "the theorem")
    _require_fitting(known["statement"])
    _require_sizes(known)
    return known


def _require_fitting(statement: dict[str, Any]) -> None:
    """Require that the values of a statement fit one another."""
    present = [name for name in BOX if name in statement]
    require(len(present) in (0, len(BOX)), f"the statement needs all of {', '.join(BOX)}, or none of them")
    if present:
        counts = {len(statement[name]) for name in ("stops", "phases", "velocities")}
        require(len(counts) == 1, "the statement has other numbers of stops, phases and velocities")
        require(statement["radius"] > 0, "the statement's radius is not positive")
    if "range" in statement:
        is_frequency = statement.get("parameter", "omega") == "omega"
        positive = not is_frequency or statement["range"][0] > 0
        require(positive, "the statement's range has frequencies that are not positive")
    if "omega" not in statement:
        return
    parameter = statement.get("parameter", "")
    inputs = {"omega": statement["omega"]}
    for name in ("clearance", "restitution"):
        inputs |= {f"{name}_{side}": statement[name][side] for side in _SIDES}
    for name, value in inputs.items():
        varies = parameter == name or (name != "omega" and parameter == name.rsplit("_", 1)[0])
        require((value == VARIED) == varies, f"the statement's {name} does not fit what varies")


def _require_sizes(known: dict[str, Any]) -> None:
    """Require that matrices and vectors belong to as many masses."""
    machine, statement, theorem = known["oscillator"], known["statement"], known["theorem"]
    size = len(machine["contact"])
    rows = [row for name in ("mass", "damping", "stiffness") for row in machine[name]]
    rows += [row for part in machine["forcing"] for pair in part["powers"] for row in pair]
    rows += [vector for vector in (machine.get("bias"), statement.get("velocity")) if vector is not None]
    rows += [statement["displacement"]] if statement.get("displacement", "equilibrium") != "equilibrium" else []
    square = all(len(machine[name]) == size for name in ("mass", "damping", "stiffness"))
    require(square and all(len(row) == size for row in rows), "its matrices and vectors are not of one size")
    states = [theorem[name] for name in ("state", "direction", "norm") if name in theorem]
    states += theorem.get("norm", [])
    require(all(len(row) == 2 * size for row in states), "the theorem's states are not of the oscillator's size")
    for part in (theorem, theorem.get("transient", {})):
        require(len(part.get("stops", ())) == len(part.get("times", ())), "a stop has no time, or a time no stop")

"""Changed certificates, and whether the checker is right about each: `make mutants [MUTANTS=COUNT]`.

True certificates of each kind are proven for the default oscillator and for random general ones. COUNT copies of each
kind are changed at random: every field, sign and unit, swaps, cuts, names of other kinds, numerals of many digits. A
judge that shares nothing with the checker (`certificate_judge`) decides which of the changed statements are true; those
that it does not decide are not counted. Printed are, by kind: false ones accepted, which must be none; true ones of
changes that keep the theorem's meaning and how many of them are accepted, which must be 95 %; and the malformed ones,
of which none may be accepted. Of COUNT, 0.35 must be false and 0.15 true.
"""

from __future__ import annotations

import json
import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from copy import deepcopy
from fractions import Fraction
from multiprocessing import get_context
from typing import Any

import numpy as np

from grazemap.checker import check
from grazemap.checker.orbits import label
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.prove import Proof, prove
from tests.oracles.certificate_judge import Undecided, decide
from tests.slow.proven_points import proofs_of
from tests.slow.proven_statements import DEFAULT, settled, statements

Certificate = dict[str, Any]
Change = Callable[[random.Random, Certificate], None]

DENSE = Oscillator.of_structure(
    Matrices.create([[2.0, 0.3], [0.3, 1.0]], [[3.0, -1.0], [-1.0, 2.0]], [[0.2, 0.05], [0.05, 0.1]]),
    [1.0, -1.0],
    [
        force(2, np.array([1.0, -0.4]), np.array([0.3, 0.0])),
        force(4, np.array([0.02, 0.0]), np.array([0.0, 0.5]), unbalance=True),
    ],
    0.7,
    [0.1, 0.0],
    0.5,
)
"""Two harmonics with the common divisor 2, a bias, two restitutions."""
ONE = {"kind": "orbit", "omega": "0.27", "clearance": "1.86", "period": 1, "stops": [1]}
REQUESTS: list[tuple[Oscillator, dict[str, Any]]] = [
    (DEFAULT, {**ONE, "stable": True, "phases": ["1.394395"], "velocities": ["0.154008"], "radius": "1e-5"}),
    (DEFAULT, {**ONE, "stable": False, "phases": ["1.394395"], "velocities": ["0.154008"], "radius": "1e-6"}),
    (DEFAULT, {**ONE, "stable": False}),
    (
        DEFAULT,
        {"kind": "orbit", "omega": "0.29", "clearance": "1.6", "period": 1, "stops": [1, 1, -1, -1], "stable": True},
    ),
    (
        DEFAULT,
        {
            "kind": "attraction",
            "omega": "0.29",
            "clearance": "1.6",
            "displacement": "equilibrium",
            "velocity": ["0"] * 3,
            "phase": "0",
            "label": "1-2r-2l",
        },
    ),
    (
        DEFAULT,
        {
            "kind": "attraction",
            "omega": "0.29",
            "clearance": "1.6",
            "displacement": ["0.1", "0", "0"],
            "velocity": ["0", "0.1", "0"],
            "phase": "0.5",
            "label": "1-1r-1l",
        },
    ),
    (
        DENSE,
        {
            "kind": "attraction",
            "omega": "0.35",
            "clearance": {"right": "0.3", "left": "0.4"},
            "displacement": "equilibrium",
            "velocity": ["0", "0"],
            "phase": "0",
        },
    ),
    (
        DEFAULT,
        {
            "kind": "bifurcation",
            "omega": "0.27",
            "clearance": "1.40",
            "period": 1,
            "stops": [1, 1, 1, -1, -1, -1],
            "type": "SB",
            "parameter": "clearance",
            "range": ["1.36", "1.41"],
        },
    ),
    (
        DEFAULT,
        {
            "kind": "bifurcation",
            "omega": "0.27",
            "clearance": "1.86",
            "period": 1,
            "stops": [1],
            "type": "SN",
            "parameter": "clearance",
            "range": ["1.8", "1.95"],
        },
    ),
    (
        DEFAULT,
        {
            "kind": "bifurcation",
            "omega": "0.27",
            "clearance": "1.86",
            "period": 1,
            "stops": [1],
            "type": "GR",
            "parameter": "clearance_right",
            "range": ["1.8", "1.95"],
        },
    ),
    (
        DENSE,
        {
            "kind": "bifurcation",
            "omega": "0.35",
            "clearance": {"right": "0.3", "left": "0.4"},
            "period": 1,
            "stops": [1, 1, -1],
            "type": "SN",
            "parameter": "clearance_right",
            "range": ["0.29", "0.34"],
        },
    ),
    (DEFAULT, {"kind": "codimension-two", "type": "g", "order": 2, "range": ["0.2824", "0.2825"], "stop": 0}),
    (DEFAULT, {"kind": "codimension-two", "type": "g", "order": 2, "range": ["0.2824", "0.2825"], "stop": -1}),
]


SEEDS = 6
"""Random points of which all statements are changed."""
MOST_IMPACTS = 6
"""Impacts of orbits that are changed: the judge's time grows with their third power."""
LONGEST = 250
"""Impacts of transients of attractions that are changed: the checker needs a second or two for these."""


def true_certificates() -> Iterator[Certificate]:
    """Certificates that the checker accepts, as the product makes them."""
    requests = list(REQUESTS)
    requests += [attraction(seed) for seed in range(SEEDS)]
    for oscillator, request in requests:
        proof = prove(oscillator, request)
        if proof.certificate["verdict"] == "undecided":
            print(f"undecided: {request['kind']}, {proof.reason}", flush=True)
        elif is_quick(proof):
            yield proof.certificate
    for seed in range(SEEDS):
        for kind, proof in statements(seed):
            if kind not in ("virtual", "beyond") and proof.certificate["verdict"] == "proven" and is_quick(proof):
                yield proof.certificate
        yield from (
            json.loads(proof["certificate"]) for proof in proofs_of(seed)[1][::4] if proof["verdict"] == "proven"
        )


def is_quick(proof: Proof) -> bool:
    """Whether the impacts of a statement's orbit and of a transient are few enough."""
    transient = proof.certificate["theorem"].get("transient", {"times": []})
    return len(proof.certificate["statement"].get("stops", ())) <= MOST_IMPACTS and len(transient["times"]) <= LONGEST


def attraction(seed: int) -> tuple[Oscillator, dict[str, Any]]:
    """The statement that a trajectory from equilibrium settles, with the label of its motion."""
    omega, clearance, sequence = settled(np.random.default_rng(seed))
    place = {"omega": repr(omega), "clearance": repr(clearance), "displacement": "equilibrium", "phase": "0"}
    name = label(sequence.period, sequence.whole.stops.tolist())
    return DEFAULT, {"kind": "attraction", **place, "velocity": ["0"] * 3, "label": name}


# changes that keep the theorem's meaning


def equal_numerals(rng: random.Random, new: Certificate) -> None:
    """Write some numbers in another way."""
    ways: list[Callable[[str], str]] = [
        lambda x: str(Fraction(x)),
        lambda x: f"{x}0" if "." in x and "e" not in x.lower() else x,
        lambda x: f"{x}e0" if "e" not in x.lower() and "/" not in x else x,
        lambda x: f"0{x}" if not x.startswith("-") else x,
    ]
    for holder, name in leaves(new):
        if is_number(holder[name]) and rng.random() < 0.3:
            holder[name] = rng.choice(ways)(holder[name])


def wider_range(rng: random.Random, new: Certificate) -> None:
    low, high = (Fraction(x) for x in new["statement"]["range"])
    grown = Fraction(rng.randint(1, 1000), 10_000) * (high - low)
    new["statement"]["range"] = [str(low - grown), str(high + grown)]


def wider_box(rng: random.Random, new: Certificate) -> None:
    radius = Fraction(new["statement"]["radius"])
    if new["verdict"] == "proven":
        new["statement"]["radius"] = str(radius * rng.randint(1, 50))


def other_theorem_box(rng: random.Random, new: Certificate) -> None:
    if new["verdict"] == "proven":
        radius = Fraction(new["theorem"]["radius"])
        new["theorem"]["radius"] = str(radius * Fraction(rng.randint(5, 500), 10))


def more_bits(rng: random.Random, new: Certificate) -> None:
    new["bits"] += rng.randint(1, 200)


def other_scale(rng: random.Random, new: Certificate) -> None:
    theorem, factor = new["theorem"], Fraction(rng.choice([2, 3]), 1)
    if "norm" in theorem or theorem.get("direction"):
        return
    theorem["scale"] = str(Fraction(theorem["scale"]) * factor)
    half = len(theorem["state"]) // 2
    theorem["state"] = [*theorem["state"][:half], *(str(Fraction(x) / factor) for x in theorem["state"][half:])]


def reversed_names(rng: random.Random, new: Certificate) -> None:
    for name in ("statement", "oscillator", "theorem"):
        new[name] = dict(reversed(new[name].items()))


def turned_stops(rng: random.Random, new: Certificate) -> None:
    statement = new["statement"]
    if "phases" in statement or new["verdict"] != "proven":
        return
    count = rng.randrange(len(statement["stops"]))
    statement["stops"] = statement["stops"][count:] + statement["stops"][:count]


KEEPING: dict[str, list[Change]] = {
    "orbit": [equal_numerals, wider_box, other_theorem_box, more_bits, other_scale, reversed_names, turned_stops],
    "attraction": [equal_numerals, more_bits, reversed_names],
    "bifurcation": [equal_numerals, wider_range, wider_box, more_bits, reversed_names],
    "codimension-two": [equal_numerals, wider_range, other_theorem_box, more_bits, reversed_names],
}


# changes of what is said


def moved_number(rng: random.Random, new: Certificate) -> None:
    """Change the size, the sign or the unit of one number of the statement or the oscillator."""
    places = [(h, n) for part in ("statement", "oscillator") for h, n in leaves(new[part]) if is_number(h[n])]
    holder, name = rng.choice(places)
    value = Fraction(holder[name])
    factor = rng.choice(
        [-1, 1000, Fraction(1, 1000), 2, 1 + Fraction(rng.randint(-(10**6), 10**6), 10 ** rng.randint(6, 9))]
    )
    holder[name] = str(value * factor if value else Fraction(rng.randint(-10, 10), 10))


def moved_integer(rng: random.Random, new: Certificate) -> None:
    places = [(h, n) for h, n in leaves(new["statement"]) if type(h[n]) is int]
    places += [(h, n) for h, n in leaves(new["oscillator"]) if type(h[n]) is int]
    if places:
        holder, name = rng.choice(places)
        holder[name] = rng.choice([-holder[name], holder[name] + 1, holder[name] + 2, 2 * holder[name]])


def turned_truth(rng: random.Random, new: Certificate) -> None:
    statement = new["statement"]
    if "stable" in statement and rng.random() < 0.5:
        statement["stable"] = not statement["stable"]
    else:
        new["verdict"] = {"proven": "disproven", "disproven": "proven"}[new["verdict"]]


def swapped(rng: random.Random, new: Certificate) -> None:
    """Swap the sides of a pair, or two entries of a list."""
    statement = new["statement"]
    pairs = [statement[name] for name in ("clearance", "restitution") if name in statement]
    lists = [h[n] for h, n in lists_of(new) if len(h[n]) > 1]
    if pairs and rng.random() < 0.5:
        pair = rng.choice(pairs)
        pair["right"], pair["left"] = pair["left"], pair["right"]
    elif lists:
        values = rng.choice(lists)
        i, j = rng.sample(range(len(values)), 2)
        values[i], values[j] = values[j], values[i]


def other_type(rng: random.Random, new: Certificate) -> None:
    statement = new["statement"]
    types = {"bifurcation": ("SN", "PD", "SB", "GR"), "codimension-two": ("g", "h", "h_s")}.get(statement["kind"])
    if types:
        statement["type"] = rng.choice(types)
    elif "label" in statement:
        statement["label"] = rng.choice(["1-1r-1l", "1-2r-1l", "2-2r-2l", "1-(-1)r-1l", "3-1r-1l"])


def smaller_box(rng: random.Random, new: Certificate) -> None:
    if "radius" in new["statement"]:
        new["statement"]["radius"] = str(Fraction(new["statement"]["radius"]) / 10 ** rng.randint(1, 12))


def narrower_range(rng: random.Random, new: Certificate) -> None:
    if "range" in new["statement"]:
        low, high = (Fraction(x) for x in new["statement"]["range"])
        share = Fraction(rng.randint(-2000, 2000), 1000)
        new["statement"]["range"] = [str(low + share * (high - low)), str(high + share * (high - low))]


ANY_SAYING: list[Change] = [
    moved_number,
    moved_number,
    moved_integer,
    turned_truth,
    turned_truth,
    swapped,
    other_type,
    other_type,
    smaller_box,
    narrower_range,
]
SAYING = dict.fromkeys(KEEPING, ANY_SAYING)
# a trajectory from a slightly changed oscillator mostly settles on the same type of motion
SAYING["attraction"] = [*ANY_SAYING, *[other_type] * 4, *[turned_truth] * 2]


# changes of the form


def cut(rng: random.Random, new: Certificate) -> None:
    # without its stop a statement is about the zero alone, and well-formed
    holder, name = rng.choice([(holder, name) for holder, name in members(new) if name != "stop"])
    del holder[name]


def foreign(rng: random.Random, new: Certificate) -> None:
    names = ["active", "stops", "parameter", "label", "unstable", "displacement", "clearance_right", "enclosures", "x"]
    holder = rng.choice([new, *(part for part in new.values() if isinstance(part, dict))])
    name = rng.choice([name for name in names if name not in holder])
    holder[name] = rng.choice(["1", 1, True, None, ["1"], {"right": "1", "left": "1"}])


def mistyped(rng: random.Random, new: Certificate) -> None:
    holder, name = rng.choice([place for place in leaves(new) if place[0] is not new])
    value = holder[name]
    holder[name] = rng.choice([[value], {"a": value}, "NaN", "1e99999", "9" * 10**6, "", "\u0663", "\x1b[2J", 10**6000])


SPOILING: list[Change] = [cut, foreign, mistyped]


def members(document: Any) -> list[tuple[Any, Any]]:
    pairs = [(document, name) for name in document] if isinstance(document, dict) else []
    for value in document.values() if isinstance(document, dict) else document if isinstance(document, list) else ():
        pairs += members(value)
    return pairs


def leaves(document: Any) -> list[tuple[Any, Any]]:
    keys = document if isinstance(document, dict) else range(len(document)) if isinstance(document, list) else ()
    pairs = []
    for key in keys:
        pairs += leaves(document[key]) if isinstance(document[key], dict | list) else [(document, key)]
    return pairs


def lists_of(document: Any) -> list[tuple[Any, Any]]:
    keys = document if isinstance(document, dict) else range(len(document)) if isinstance(document, list) else ()
    pairs = []
    for key in keys:
        if isinstance(document[key], list):
            pairs.append((document, key))
        if isinstance(document[key], dict | list):
            pairs += lists_of(document[key])
    return pairs


def is_number(value: Any) -> bool:
    try:
        return isinstance(value, str) and Fraction(value) is not None
    except (ValueError, ZeroDivisionError):
        return False


def judged(task: tuple[int, Certificate]) -> tuple[str, str, str, Certificate]:
    """Change a certificate; return its kind, what the change is, what came of it, and the changed certificate."""
    seed, true = task
    rng, new = random.Random(seed), deepcopy(true)
    kind = true["statement"]["kind"]
    group = rng.choices(["keeping", "saying", "spoiling"], [0.22, 0.7, 0.08])[0]
    changes = {"keeping": KEEPING[kind], "saying": SAYING[kind], "spoiling": SPOILING}[group]
    changes = [c for c in changes if "radius" in new["statement"] or c is not wider_box]
    made = rng.choices([1, 2], [0.6, 0.4])[0]
    names: list[str] = []
    while new == true or len(names) < made:
        before, change = deepcopy(new), rng.choice(changes)
        change(rng, new)
        names += [change.__name__] if new != before else []
        if len(names) > 1 and new == true:  # a change and its reverse
            names = []
    name = f"{group}: {', '.join(names)}"
    answer = check(new)
    outcome = "accepted" if answer.accepted else "refused"
    if group == "spoiling":
        return kind, name, f"malformed, {outcome}", new
    try:
        truth = decide(new)
    except (Undecided, ArithmeticError, ValueError, AssertionError, LookupError) as reason:
        return kind, name, f"not decided, {outcome}: {reason}", new
    word = "false" if not truth else "true" if group == "keeping" else "still true"
    return kind, name, f"{word}, {outcome}", new


def main(count: int, processes: int = 2) -> int:
    certificates = list(true_certificates())
    by_kind: dict[str, list[Certificate]] = {}
    for certificate in certificates:
        by_kind.setdefault(certificate["statement"]["kind"], []).append(certificate)
    tasks = [(seed, known[seed % len(known)]) for known in by_kind.values() for seed in range(count)]
    outcomes, reasons = ({kind: Counter() for kind in by_kind} for _ in range(2))
    wrong = 0
    with get_context("spawn").Pool(processes) as pool:
        for kind, name, outcome, new in pool.imap_unordered(judged, tasks, chunksize=4):
            outcomes[kind][outcome.partition(":")[0]] += 1
            reasons[kind][outcome.partition(":")[2]] += 1
            if outcome in ("false, accepted", "malformed, accepted") or outcome == "true, refused":
                wrong += outcome != "true, refused"
                print(f"{kind}: {name}: {outcome}: {check(new).reason}", flush=True)
                if outcome != "true, refused":
                    print(f"  {new}", flush=True)
    for kind, tally in outcomes.items():
        print(kind, dict(tally))
        print("  not decided:", {reason.strip(): count for reason, count in reasons[kind].most_common() if reason})
        true, kept = tally["true, accepted"] + tally["true, refused"], tally["true, accepted"]
        false = tally["false, accepted"] + tally["false, refused"]
        wrong += (kept < 0.95 * true) + (true < 0.15 * count) + (false < 0.35 * count)
    return wrong


if __name__ == "__main__":
    sys.exit(1 if main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000) else 0)

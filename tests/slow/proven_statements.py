"""Statements proven, and false ones refused: `python -m tests.slow.proven_statements [SHARE PROCESSES]`.

Orbits, attractions, bifurcations and codimension-two points are proven at random points and on the branches there, and
orbits and attractions of random general systems; certificates are then made false in seven ways. Printed are counts,
median times, and the reasons of refusals. SHARE = 1 takes the full counts.
"""

from __future__ import annotations

import random
import re
import statistics
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from copy import deepcopy
from fractions import Fraction
from multiprocessing import get_context
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from flint import ctx

from grazemap.checker import FORMAT, check
from grazemap.checker.arithmetic import Refused
from grazemap.checker.reading import OSCILLATOR, RADIUS, VARIED
from grazemap.checker.system import Machine
from grazemap_core.contact.stops import both_clearances
from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import OrbitBranch, orbit_branch
from grazemap_core.continuation.special_points import SpecialPoint
from grazemap_core.errors import CoreError
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.orbits.impact_sequences import ImpactSequence, impacts_of
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.proofs.bifurcations import bifurcation
from grazemap_core.proofs.certificates import Document, ProofSearch, Undecided, exact_inputs, exact_oscillator, inputs
from grazemap_core.proofs.orbits import orbit_theorem
from grazemap_core.proofs.prove import PROOF_ATTEMPTS, Proof, prove
from grazemap_core.simulation.trajectories import trajectory
from tests.support.general_systems import random_system
from tests.support.oscillators import DEFAULT

DIGITS = 30
MOST_IMPACTS = 12
SEVERAL = 3
COUNTS = {"orbit": 100, "attraction": 50, "SN": 20, "PD": 20, "SB": 20, "GR": 20, "general": 10}
WAYS = ("centre", "parameter", "stability", "virtual", "beyond", "left out", "structure")
FALSE = 200
TOLERANCE = 1e-13
PARAMETERS = ("clearance", "omega", "restitution")


class Timed(NamedTuple):
    """A proof, and the seconds that it took."""

    proof: Proof
    seconds: float

    @property
    def certificate(self) -> Document:
        """Its certificate."""
        return self.proof.certificate


def motion(sequence: ImpactSequence) -> Document:
    """Period, stops and the box of the impacts, as a statement has them."""
    whole = sequence.whole
    return {
        "period": sequence.period,
        "stops": whole.stops.tolist(),
        "phases": [repr(x) for x in whole.phases.tolist()],
        "velocities": [repr(x) for x in whole.velocities.tolist()],
        "radius": RADIUS,
    }


def settled(rng: np.random.Generator) -> tuple[float, float, ImpactSequence]:
    """A random point at which the trajectory from rest settles to a motion of few impacts."""
    while True:
        omega, clearance = round(float(rng.uniform(0.26, 0.32)), 6), round(float(rng.uniform(1.2, 2.1)), 6)
        try:
            sequence = impacts_of(trajectory(DEFAULT, omega, clearance, transient_periods=600, periods=64))
        except CoreError:
            continue
        if len(sequence.whole.stops) <= MOST_IMPACTS:
            return omega, clearance, sequence


def statements(seed: int) -> Iterator[tuple[str, Proof]]:
    """Certificates of the orbit at a random point and of what its branch has, by kind; false ones by their way."""
    rng = np.random.default_rng(seed)
    omega, clearance, sequence = settled(rng)
    place = {"omega": repr(omega), "clearance": repr(clearance)}
    yield "orbit", prove(DEFAULT, {"kind": "orbit", **place, **motion(sequence), "stable": True}, DIGITS)
    rest = {"displacement": ["0"] * 3, "velocity": ["0"] * 3, "phase": "0"}
    yield "attraction", prove(DEFAULT, {"kind": "attraction", **place, **rest}, DIGITS)
    yield from general_statements(seed)
    orbit = periodic_orbit(DEFAULT, omega, clearance, sequence)
    parameter = PARAMETERS[seed % len(PARAMETERS)]
    branch = orbit_branch(DEFAULT, orbit, *around(orbit, parameter, 0.3), parameter, max_points=300)
    yield from of_branch(branch)
    for point in branch.special_points:
        if point.type in ("SB", "PD") and point.status == "converged":
            for start in starts_beyond(DEFAULT, point, parameter):
                other = periodic_orbit(DEFAULT, start.omega, start.clearance, start.impacts)
                if other.converged:
                    bounds = around(other, parameter, 0.1)
                    yield from of_branch(orbit_branch(DEFAULT, other, *bounds, parameter, max_points=200))


def general_statements(seed: int) -> Iterator[tuple[str, Proof]]:
    """A certificate of the orbit to which a random general system settles, or that it does so from equilibrium."""
    system = random_system(seed)
    if system is None or len(system.impacts.whole.stops) > MOST_IMPACTS:
        return
    right, left = (None if np.isinf(gap) else repr(float(gap)) for gap in both_clearances(system.clearance))
    place = {"omega": repr(system.omega), "clearance": {"right": right, "left": left}}
    rest = {"displacement": "equilibrium", "velocity": ["0"] * system.oscillator.size, "phase": "0"}
    orbit = {"kind": "orbit", **motion(system.impacts), "stable": True}
    statement = place | (orbit if seed % 2 else {"kind": "attraction", **rest})
    yield "general", prove(system.oscillator, statement, DIGITS)


def around(orbit: PeriodicOrbit, parameter: str, share: float) -> tuple[float, float]:
    """An interval of a parameter around the value of an orbit."""
    if parameter == "restitution":
        return max(0.0, DEFAULT.restitution - share), min(1.0, DEFAULT.restitution + share)
    value = float(getattr(orbit, parameter))
    return (1.0 - share) * value, (1.0 + share) * value


def of_branch(branch: OrbitBranch) -> Iterator[tuple[str, Proof]]:
    """An unstable orbit, a solution with virtual impacts, the bifurcations, and an orbit beside a graze."""
    fixed = branch.restitution == DEFAULT.restitution
    unstable = np.flatnonzero(branch.admissible & branch.isolated & ~branch.stable & fixed)
    if len(unstable):
        yield "orbit", on_branch(branch, int(unstable[len(unstable) // 2]), False)
    virtual = np.any(branch.stops * branch.velocities < -1e-3, axis=1) & branch.isolated & fixed
    if np.any(virtual):
        with suppress(Undecided, Refused):  # many impacts, very unstable
            yield "virtual", unchecked(branch, int(np.flatnonzero(virtual)[0]))
    for point in branch.special_points:
        if not point.admissible or point.status != "converged" or point.type == "NS":
            continue
        yield point.type, of_point(point, branch.parameter)
        if point.type == "GR" and point.impact is None and branch.parameter != "restitution":
            with suppress(Undecided, Refused):
                false = beyond(point)
                if false is not None:
                    yield "beyond", false


def of_point(point: SpecialPoint, parameter: str) -> Proof:
    """The proof of a special point, or why it is undecided."""
    value = getattr(point, parameter)
    here = {"omega": repr(point.omega), "clearance": repr(point.clearance)}
    bounds = [repr(value * (1.0 - 1e-6)), repr(value * (1.0 + 1e-6))]
    stated = {"kind": "bifurcation", "type": point.type, "parameter": parameter, "range": bounds, **here}
    with patch.dict(PROOF_ATTEMPTS, bifurcation=lambda search, request: iter([bifurcation(search, request, point)])):
        return prove(DEFAULT, stated, DIGITS)


def on_branch(branch: OrbitBranch, place: int, stable: bool) -> Proof:
    at = {"omega": repr(float(branch.omega[place])), "clearance": repr(float(branch.clearance[place]))}
    return prove(DEFAULT, {"kind": "orbit", **at, **motion(sequence_of(branch, place)), "stable": stable}, DIGITS)


def sequence_of(branch: OrbitBranch, place: int) -> ImpactSequence:
    return ImpactSequence.create(
        branch.period, branch.stops, branch.phases[place], branch.velocities[place], branch.symmetric
    )


def unchecked(branch: OrbitBranch, place: int) -> Proof:
    """The certificate of a solution that is no motion: it has virtual impacts."""
    return solution(float(branch.omega[place]), float(branch.clearance[place]), sequence_of(branch, place))


def solution(omega: float, clearance: float, sequence: ImpactSequence) -> Proof:
    """A certificate that no checker has seen."""
    data = exact_oscillator(DEFAULT)
    search = ProofSearch(DEFAULT, Machine(OSCILLATOR(data, "the oscillator")), DIGITS)
    place = inputs(search, {"omega": repr(omega), "clearance": repr(clearance)})
    with ctx.workprec(search.bits):
        theorem = orbit_theorem(search, exact_inputs(place), omega, sequence)
    statement = {"kind": "orbit", **place, **motion(sequence), "stable": True}
    certificate = {"format": FORMAT, "verdict": "proven", "oscillator": data, "statement": statement}
    return Proof(certificate | {"theorem": theorem, "bits": search.bits}, "", {})


def beyond(point: SpecialPoint) -> Proof | None:
    """The certificate of an orbit beside a graze that passes the stop by 1e-9, or None where that is not found."""
    low, high = 0.0, 0.0
    for side in (1.0, -1.0):
        for step in (1e-8, 1e-7):
            orbit = periodic_orbit(DEFAULT, point.omega, point.clearance + side * step, point.impacts)
            if orbit.converged and orbit.excess > 1e-9:
                high = side * step
                break
        if high:
            break
    else:
        return None
    for _ in range(60):
        middle = 0.5 * (low + high)
        orbit = periodic_orbit(DEFAULT, point.omega, point.clearance + middle, point.impacts)
        if abs(orbit.excess - 1e-9) < TOLERANCE:
            break
        low, high = (low, middle) if orbit.excess > 1e-9 else (middle, high)
    return solution(point.omega, point.clearance + middle, orbit.impacts)


def falsified(true: Document, way: str) -> Document | None:
    """A certificate of a false statement, made of a true one; None where this way does not apply."""
    false = deepcopy(true)
    theorem, statement = false["theorem"], false["statement"]
    kind, transient = statement["kind"], theorem.get("transient", {"stops": [], "times": []})
    if way == "centre":
        numbers, name = (theorem["state"], 0) if "state" in theorem else (theorem, "value")
        numbers[name] = str(Fraction(numbers[name]) + 10 * Fraction(theorem["radius"]))
    elif way == "parameter":
        if statement.get("omega", VARIED) != VARIED:
            statement["omega"] = nearby(statement["omega"])
        elif "clearance" in statement:
            statement["clearance"] = {side: nearby(gap) for side, gap in statement["clearance"].items()}
        else:
            false["oscillator"]["mass"][0][0] = nearby(false["oscillator"]["mass"][0][0])
    elif way == "stability" and kind == "orbit":
        statement["stable"] = not statement["stable"]
    elif way == "structure":
        false["oscillator"]["damping"][0][0] = nearby(false["oscillator"]["damping"][0][0])
    elif way == "left out" and transient["times"]:
        for name in ("stops", "times"):
            transient[name].pop(len(transient[name]) // 2)
    elif way == "left out" and theorem.get("stops"):
        for name in ("stops", "times"):
            theorem[name].pop()
    else:
        return None
    return false


def nearby(number: str | None) -> str | None:
    return number if number is None else str(Fraction(number) * (1 + Fraction(1, 10**7)))


def worked(seed: int) -> list[tuple[str, Timed]]:
    return list(timed(statements(seed)))


def timed(items: Iterator[tuple[str, Proof]]) -> Iterator[tuple[str, Timed]]:
    while True:
        begun = time.monotonic()
        try:
            kind, proof = next(items)
        except StopIteration:
            return
        yield kind, Timed(proof, time.monotonic() - begun)


def points_of_the_paper() -> Iterator[Proof]:
    """The recurrence points up to order 8, and the resonant ones up to period 2, between 0.25 and 0.35."""
    points = codimension_two_points(DEFAULT, 0.25, 0.35, max_order=8, max_multiple=2)
    for kind, order, omega in codimension_two_statements(points):
        window = [repr(omega * (1.0 - 1e-6)), repr(omega * (1.0 + 1e-6))]
        yield prove(
            DEFAULT, {"kind": "codimension-two", "type": kind, "order": order, "range": window, "stop": 0}, DIGITS
        )


def codimension_two_statements(points: Any) -> Iterator[tuple[str, int, float]]:
    for point in points:
        if point.kind == "recurrence":
            yield "g", point.order, point.omega
        else:
            same = (point.bifurcation == "SN") != point.symmetric
            yield "h" if same else "h_s", point.multiple * (1 if point.symmetric else 2), point.omega


def main(share: float, processes: int) -> int:
    wanted = {kind: max(1, round(count * share)) for kind, count in COUNTS.items()}
    wanted |= dict.fromkeys(("virtual", "beyond"), -(-round(FALSE * share) // len(WAYS)))
    proven: dict[str, list[Timed]] = {kind: [] for kind in COUNTS}
    false: dict[str, list[Timed]] = {way: [] for way in ("virtual", "beyond")}
    undecided: Counter[str] = Counter()
    with get_context("spawn").Pool(processes) as pool:
        for batch in pool.imap_unordered(worked, range(100_000)):
            for kind, proof in batch:
                proofs = false[kind] if kind in false else proven[kind]
                if kind in proven and proof.certificate["verdict"] != "proven":
                    undecided[f"{kind}: {proof.proof.reason}"] += 1
                elif len(proofs) < wanted[kind] and (kind in false or needed(proof, proofs, wanted[kind])):
                    proofs.append(proof)
            counts = {kind: len(proofs) for kind, proofs in (proven | false).items()}
            print(f"{counts}, undecided {undecided.total()}", flush=True)
            if counts == wanted:
                break
        pool.terminate()
    proven["codimension-two"] = [proof for _, proof in timed(("", proof) for proof in points_of_the_paper())]
    for kind, proofs in proven.items():
        print(summary(kind, proofs))
    for reason, count in undecided.most_common():
        print(f"undecided, {count}: {reason}")
    open_points = sum(proof.certificate["verdict"] != "proven" for proof in proven["codimension-two"])
    return refuse(proven, false, wanted["virtual"]) + open_points


def impacts_of_period(proof: Timed) -> int:
    theorem = proof.certificate["theorem"]
    return len(theorem.get("stops", ())) * (2 if theorem.get("symmetric") else 1)


def needed(proof: Timed, proofs: list[Timed], wanted: int) -> bool:
    """Whether a proof is taken: at least half have several impacts."""
    few = sum(impacts_of_period(other) < SEVERAL for other in proofs)
    return impacts_of_period(proof) >= SEVERAL or few < wanted // 2


def summary(kind: str, proofs: list[Timed]) -> str:
    """The number of proofs, of those that the checker accepts once more, and the times."""
    impacts = [impacts_of_period(proof) for proof in proofs]
    begun = time.monotonic()
    accepted = sum(check(proof.certificate).accepted for proof in proofs)
    seconds = (time.monotonic() - begun) / max(len(proofs), 1)
    return (
        f"{kind}: {len(proofs)} proven, {accepted} accepted once more, {sum(n >= SEVERAL for n in impacts)} with "
        f"{SEVERAL} impacts or more, up to {max(impacts, default=0)}; median "
        f"{statistics.median(proof.seconds for proof in proofs):.2f} s, checked in {seconds:.2f} s on average"
    )


def refuse(proven: dict[str, list[Timed]], false: dict[str, list[Timed]], each: int) -> int:
    """Check certificates of false statements, as many of each way; return how many are accepted or missing."""
    true = [proof.certificate for proofs in proven.values() for proof in proofs]
    true = [certificate for certificate in true if certificate["verdict"] == "proven"]
    random.Random(0).shuffle(true)
    accepted = refused = 0
    for way in WAYS:
        made = [proof.certificate for proof in false.get(way, [])]
        made += [certificate for certificate in (falsified(item, way) for item in true) if certificate is not None]
        reasons: Counter[str] = Counter()
        for certificate in made[:each]:
            answer = check(certificate)
            accepted, refused = accepted + answer.accepted, refused + (not answer.accepted)
            reasons["ACCEPTED" if answer.accepted else re.sub(r"[-+]?\d[\d.e+-]*", "N", answer.reason)] += 1
        for reason, number in reasons.most_common():
            print(f"{way}, {number}: {reason}")
    print(f"{refused} certificates of false statements refused, {accepted} accepted")
    return accepted + max(0, each * len(WAYS) - refused)


if __name__ == "__main__":
    share, processes = (float(sys.argv[1]), int(sys.argv[2])) if len(sys.argv) > 2 else (1.0, 2)
    sys.exit(1 if main(share, processes) else 0)

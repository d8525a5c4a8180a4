"""Certificates: the exact inputs of oscillators and statements as decimals, and solutions with many digits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from grazemap.checker.arithmetic import column, quotients
from grazemap.checker.reading import INPUTS, VARIED, fields
from grazemap.checker.system import Inputs, Machine
from grazemap_core.arrays import Floats
from grazemap_core.contact.stops import Clearance
from grazemap_core.model.chain import Chain, matrix_of_links
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.tolerances import BITS_LOST, BITS_PER_DIGIT, LARGEST_STEP, LAST_STEP, NEWTON_STEPS
from grazemap_core.records import NamedTuple, dataclass

Document = dict[str, Any]

Equations = tuple[list[arb], Callable[[list[arb]], list[arb]]]
"""The unknowns at the start, and the function that vanishes."""


class Undecided(Exception):
    """The search found no proof; says why."""


@dataclass(frozen=True)
class ProofSearch:
    """Inputs of a search."""

    oscillator: Oscillator
    """The oscillator."""
    machine: Machine
    """The oscillator with exact numbers."""
    digits: int
    """Digits of the enclosures."""

    @property
    def bits(self) -> int:
        """Precision of the arithmetic: that of the enclosures, and what Newton's method and impacts lose."""
        return int(BITS_PER_DIGIT * self.digits) + BITS_LOST


class Attempt(NamedTuple):
    """What a search found."""

    statement: Document
    """The statement."""
    verdict: str
    """The verdict on it."""
    theorem: Document
    """The theorem that is to show the verdict."""
    bits: int = 0
    """The precision that it needs."""


def text(number: float | str) -> str:
    """Return a number as the decimal that was given: of a float, the shortest one that stands for it."""
    return number if isinstance(number, str) else repr(float(number))


def decimals(values: Iterable[arb], digits: int) -> list[str]:
    """Return the middles of balls as decimals."""
    return [value.mid().str(digits, radius=False) for value in values]


def exact_oscillator(oscillator: Oscillator) -> Document:
    """Return the matrices, contact row, forcing and bias of an oscillator as rational numbers.

    The numbers follow from the given ones of a chain, and else from the matrices and amplitudes in double precision.
    """
    mass, damping, stiffness = _matrices(oscillator)
    exact = {
        "mass": mass,
        "damping": damping,
        "stiffness": stiffness,
        "contact": _texts(oscillator.contact),
        "forcing": _forcing(oscillator),
    }
    return exact | ({"bias": _texts(oscillator.bias)} if np.any(oscillator.bias) else {})


def _matrices(oscillator: Oscillator) -> list[list[list[str]]]:
    structure = oscillator.structure
    if not isinstance(structure, Chain):
        matrices = structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix
        return [[_texts(row) for row in matrix] for matrix in matrices]
    stiffness = _fractions(structure.stiffnesses)
    if structure.gamma is not None:
        links = [2 * Fraction(text(structure.gamma)) * k for k in stiffness]
    elif oscillator.units == "SI":
        links = _fractions(structure.link_damping)
    else:
        links = [2 * zeta for zeta in _fractions(structure.link_damping / 2.0)]
    mass, size = _texts(structure.masses), structure.size
    diagonal = [[mass[i] if i == j else "0" for j in range(size)] for i in range(size)]
    chains = (matrix_of_links(np.array(part)).tolist() for part in (links, stiffness))
    return [diagonal, *([[str(entry) for entry in row] for row in chain] for chain in chains)]


def _forcing(oscillator: Oscillator) -> list[Document]:
    """Return the harmonics of the forces, with amplitudes of sine and cosine by powers of k omega."""
    harmonics = []
    for part in oscillator.forces:
        # constant + i s rate + s^2 quadratic, of which the imaginary part belongs to the cosine
        pairs = [
            (part.constant.real, part.constant.imag),
            (-part.rate.imag, part.rate.real),
            (part.quadratic.real, part.quadratic.imag),
        ]
        while len(pairs) > 1 and not np.any(pairs[-1]):
            pairs.pop()
        powers = [[_texts(row) for row in pair] for pair in pairs]
        harmonics.append({"harmonic": part.order, "powers": powers})
    return harmonics


def _texts(values: Floats) -> list[str]:
    return [str(number) for number in _fractions(values)]


def _fractions(values: Floats) -> list[Fraction]:
    return [Fraction(text(value)) for value in np.asarray(values).tolist()]


def inputs(search: ProofSearch, request: Document) -> Document:
    """Return frequency, clearances and restitutions of a statement; "varied" for the parameter of a bifurcation."""
    clearance, parameter = request["clearance"], request.get("parameter", "")
    sides = {"right": 1, "left": -1}
    both = clearance if isinstance(clearance, dict) else dict.fromkeys(sides, clearance)
    pairs: dict[str, Document] = {
        "clearance": {side: both[side] for side in sides},
        "restitution": {side: text(search.oscillator.restitution_of(stop)) for side, stop in sides.items()},
    }
    return {"omega": VARIED if parameter == "omega" else request["omega"]} | {
        name: {side: VARIED if parameter in (name, f"{name}_{side}") else x for side, x in pair.items()}
        for name, pair in pairs.items()
    }


def core_clearance(clearance: Any) -> Clearance:
    """Return the clearance of a request as orbits take it."""
    if not isinstance(clearance, dict):
        return float(clearance)
    right, left = (None if gap is None else float(gap) for gap in (clearance["right"], clearance["left"]))
    return right, left


def exact_inputs(statement: Document) -> Inputs:
    """Return frequency, clearances and restitutions of a statement as numbers."""
    return Inputs.of(fields(INPUTS)({name: statement[name] for name in INPUTS}, "the statement"))


def refine(
    search: ProofSearch,
    theorem: Document,
    equations: Callable[[Document], Equations],
    renewed: Callable[[Document, list[arb]], Document],
) -> Document:
    """Return a theorem renewed with a solution that is accurate to more digits than the enclosures need."""
    for _ in range(NEWTON_STEPS):
        start, function = equations(theorem)
        # of the box, relative to the largest unknown
        radius = arb(10) ** -search.digits * max(abs(x).abs_upper() for x in start)
        values, rows = quotients(function, start, radius)
        try:
            step = rows.mid().solve(column(values).mid(), algorithm="approx").entries()
        except ZeroDivisionError:
            raise Undecided("the equations are singular near the starting point") from None
        theorem = renewed(theorem, [(x - dx).mid() for x, dx in zip(start, step, strict=True)])
        largest = max(abs(dx).abs_upper() for dx in step)
        if not largest < LARGEST_STEP * max(abs(x) for x in start):
            break
        if largest < radius * LAST_STEP:
            return theorem | {"radius": radius.str(1, radius=False)}
    raise Undecided("Newton's method does not converge from the starting point")

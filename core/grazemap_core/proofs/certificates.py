"""Certificates: exact inputs as decimals, and what a statement and its theorem share."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb

from grazemap.checker import FORMATS
from grazemap_core.arrays import Floats
from grazemap_core.contact.cell_problem import Clearance
from grazemap_core.model.chain import Chain
from grazemap_core.model.oscillator import Oscillator

Document = dict[str, Any]
BETWEEN_TESTS = 0.1
"""Seconds of computing between two tests of the time limit."""


class Undecided(Exception):
    """The search found no proof; says why."""


@dataclass(frozen=True)
class Search:
    """Inputs of a search: the oscillator, exactly, the digits of the enclosures, and the time at which it ends."""

    oscillator: Oscillator
    data: Document
    digits: int
    end: float

    @property
    def bits(self) -> int:
        """Precision of the arithmetic: that of the enclosures, and what Newton's method and impacts lose."""
        return int(3.33 * self.digits) + 128

    def go_on(self, *_: object) -> None:
        """Raise Undecided when the time is up."""
        if time.monotonic() > self.end:
            raise Undecided("the time limit is reached")

    @contextmanager
    def limited(self) -> Iterator[None]:
        """Test the time within long steps too, by a signal; outside the main thread, only between steps."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = signal.signal(signal.SIGVTALRM, self.go_on)  # the queue uses SIGALRM
        signal.setitimer(signal.ITIMER_VIRTUAL, BETWEEN_TESTS, BETWEEN_TESTS)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
            signal.signal(signal.SIGVTALRM, before)


def text(number: float | str) -> str:
    """Return a number as the decimal that was given: of a float, the shortest one that stands for it."""
    return number if isinstance(number, str) else repr(float(number))


def decimals(values: Iterable[arb], digits: int) -> list[str]:
    """Return the middles of balls as decimals."""
    return [value.mid().str(digits, radius=False) for value in values]


def exact_oscillator(oscillator: Oscillator) -> Document:
    """Return the matrices, contact row, forcing and bias of an oscillator as rational numbers.

    They are those of the given numbers of a chain, and else of the matrices and amplitudes in double precision.
    """
    mass, damping, stiffness = _matrices(oscillator)
    found = {
        "mass": mass,
        "damping": damping,
        "stiffness": stiffness,
        "contact": _texts(oscillator.contact),
        "forcing": _forcing(oscillator),
    }
    return found | ({"bias": _texts(oscillator.bias)} if np.any(oscillator.bias) else {})


def certificate_format(certificate: Document) -> str:
    """Return the format of a certificate: the first one where it has all that the certificate says."""
    data, statement = certificate["oscillator"], certificate["statement"]
    plain = isinstance(data["forcing"], dict) and isinstance(statement.get("clearance", ""), str)
    return FORMATS[0] if plain and "bias" not in data and "stop" not in statement else FORMATS[1]


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
    return [diagonal, _chain_matrix(links), _chain_matrix(stiffness)]


def _forcing(oscillator: Oscillator) -> Any:
    """Return the amplitudes of sine and cosine, or harmonics with such amplitudes by powers of k omega."""
    found = []
    for one in oscillator.forces:
        # constant + i s rate + s^2 quadratic, of which the imaginary part belongs to the cosine
        pairs = [
            (one.constant.real, one.constant.imag),
            (-one.rate.imag, one.rate.real),
            (one.quadratic.real, one.quadratic.imag),
        ]
        while len(pairs) > 1 and not np.any(pairs[-1]):
            pairs.pop()
        found.append((one.order, [[_texts(row) for row in pair] for pair in pairs]))
    if len(found) == 1 and found[0][0] == 1 and len(found[0][1]) == 1:
        ((sine, cosine),) = found[0][1]
        return {"sine": sine, "cosine": cosine}
    return [{"harmonic": order, "powers": powers} for order, powers in found]


def _texts(values: Floats) -> list[str]:
    return [str(number) for number in _fractions(values)]


def _fractions(values: Floats) -> list[Fraction]:
    return [Fraction(text(value)) for value in np.asarray(values).tolist()]


def _chain_matrix(links: list[Fraction]) -> list[list[str]]:
    """Return the tridiagonal matrix of a chain whose last link goes to ground."""
    size = len(links)
    rows = [[Fraction(0)] * size for _ in range(size)]
    for i, link in enumerate(links):
        rows[i][i] += link
        if i + 1 < size:
            rows[i + 1][i + 1] += link
            rows[i][i + 1] = rows[i + 1][i] = -link
    return [[str(entry) for entry in row] for row in rows]


def inputs(search: Search, omega: str, clearance: Any) -> Document:
    """Return frequency, gaps and restitutions of a theorem; the clearance is that of both stops, or of each."""
    gaps = [clearance["right"], clearance["left"]] if isinstance(clearance, dict) else [clearance] * 2
    restitutions = [text(search.oscillator.restitution_of(stop)) for stop in (1, -1)]
    return {"omega": omega, "gaps": gaps, "restitutions": restitutions}


def core_clearance(clearance: Any) -> Clearance:
    """Return the clearance of a statement as orbits take it."""
    if not isinstance(clearance, dict):
        return float(clearance)
    right, left = (None if one is None else float(one) for one in (clearance["right"], clearance["left"]))
    return right, left

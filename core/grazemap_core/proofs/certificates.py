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

from flint import arb

from grazemap_core.arrays import Floats
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
    """Return the matrices, contact row and forcing of an oscillator as rational numbers."""
    stiffness = _fractions(oscillator.stiffnesses)
    if oscillator.gamma is not None:
        links = [2 * Fraction(text(oscillator.gamma)) * k for k in stiffness]
    elif oscillator.units == "SI":
        links = _fractions(oscillator.link_damping)
    else:
        links = [2 * zeta for zeta in _fractions(oscillator.link_damping / 2.0)]
    mass, size = _fractions(oscillator.masses), oscillator.size
    return {
        "mass": [[str(mass[i]) if i == j else "0" for j in range(size)] for i in range(size)],
        "damping": _chain_matrix(links),
        "stiffness": _chain_matrix(stiffness),
        "contact": ["1"] + ["0"] * (size - 1),
        "forcing": {"sine": [str(f) for f in _fractions(oscillator.forcing)], "cosine": ["0"] * size},
    }


def _fractions(values: Floats) -> list[Fraction]:
    return [Fraction(text(value)) for value in values.tolist()]


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


def inputs(search: Search, omega: str, clearance: str) -> Document:
    """Return frequency, gaps and restitutions of a theorem."""
    restitution = text(search.oscillator.restitution)
    return {"omega": omega, "gaps": [clearance, clearance], "restitutions": [restitution, restitution]}

"""The equations of motion of a structure and of its harmonic forces, as one linear system in multi-precision.

One of the coordinates is the contact coordinate q itself, so its place on a stop and its velocity after an impact are
exact. Nothing is imported from the core.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from flint import acb, arb, arb_mat, ctx

from tests.oracles.fifty_digits import digits
from tests.oracles.linear_flow import EXTRA_BITS, LinearFlow

Number = Any
"""A double or an integer, taken exactly, or the midpoint of a ball (arb; acb where complex numbers are meant)."""

Row = Sequence[Number]
Matrix = Sequence[Row]


class Structure(Protocol):
    """The numbers that the equations of motion need."""

    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    contact: Row
    harmonics: Sequence[tuple[int, Row]]
    omega: Number
    bias: Row | None
    digits: int


class ContactSystem:
    """A structure in coordinates ``y = T x``: the displacements, with q in the place of one of them.

    A *motion* consists of y, y', the sine and the cosine of every harmonic's angle, and 1: a column of P numbers whose
    rate is a matrix times it.

    Attributes
    ----------
    place : int
        Of q among the coordinates: that of the largest number of the contact row.
    jump : list of N numbers
        Change of y' by an impulse along the stop that changes q' by 1.
    """

    def __init__(self, structure: Structure) -> None:
        self._digits, self._orders = structure.digits, [order for order, _ in structure.harmonics]
        with digits(structure.digits):
            ctx.prec += EXTRA_BITS
            contact = [real(h) for h in structure.contact]
            self._count = count = len(contact)
            self.place = int(np.argmax([abs(float(h)) for h in contact]))
            self._to_contact, self._from_contact = identity(count), identity(count)
            for j, h in enumerate(contact):
                self._to_contact[self.place, j] = h
                self._from_contact[self.place, j] = (1 if j == self.place else -h) / contact[self.place]
            mass = matrix_of(structure.mass)

            def accelerations(columns: arb_mat) -> arb_mat:
                return self._to_contact * self._settled(mass.solve(columns))

            impulse = accelerations(arb_mat([[h] for h in contact]))
            self.jump = [(impulse[i, 0] / impulse[self.place, 0]).mid() for i in range(count)]
            columns = [
                accelerations(-1 * matrix_of(structure.stiffness)) * self._from_contact,
                accelerations(-1 * matrix_of(structure.damping)) * self._from_contact,
                accelerations(self._forces(structure)),
            ]
            self._matrix = self._of_motion(columns, real(structure.omega))
        rates = doubles(self._matrix)
        fastest = float(np.abs(np.linalg.eigvals(rates)).max())
        self._fastest = max(fastest, float(real(structure.omega)))
        self._acceleration_bound = np.abs(rates[count + self.place])

    def _settled(self, solution: arb_mat) -> arb_mat:
        """Return the midpoints of a solution, if all of them have the wanted digits."""
        entries = solution.entries()
        largest = max(abs(float(v)) for v in entries)
        if any(float(v.rad()) > 10.0 ** -(self._digits + 10) * largest for v in entries):
            raise ValueError("the mass matrix is too ill-conditioned for these digits")
        return solution.mid()

    def _forces(self, structure: Structure) -> arb_mat:
        """Return the forces by the sine and the cosine of every harmonic, and the bias, as columns."""
        columns = []
        for _, amplitudes in structure.harmonics:
            forces = [complex_of(f) for f in amplitudes]
            # Im(f e^{i angle}) = Re f sin + Im f cos
            columns += [[f.real.mid() for f in forces], [f.imag.mid() for f in forces]]
        columns.append([real(s) for s in structure.bias or [0] * self._count])
        return arb_mat(columns).transpose()

    def _of_motion(self, columns: list[arb_mat], omega: arb) -> arb_mat:
        """Return the matrix of the rates of a motion, from accelerations by coordinates, their rates and forces."""
        count = self._count
        size = 2 * count + columns[2].ncols()
        matrix = arb_mat(size, size)
        for i in range(count):
            matrix[i, count + i] = arb(1)
            row = [v.mid() for part in columns for v in part.tolist()[i]]
            for j, v in enumerate(row):
                matrix[count + i, j] = v
        for k, order in enumerate(self._orders):
            sine = 2 * count + 2 * k
            matrix[sine, sine + 1], matrix[sine + 1, sine] = order * omega, -order * omega
        return matrix

    def coordinates(self, displacements: Sequence[arb]) -> list[arb]:
        """Return coordinates y of displacements, or their rates of velocities."""
        return product(self._to_contact, displacements)

    def displacements(self, coordinates: Sequence[arb]) -> list[arb]:
        """Return displacements of coordinates y, or velocities of their rates."""
        return product(self._from_contact, coordinates)

    def motion(self, coordinates: Sequence[arb], rates: Sequence[arb], angle: arb) -> arb_mat:
        """Return a motion from its coordinates, and the angle of the forcing."""
        turns = [part.mid() for order in self._orders for part in (order * angle).sin_cos()]
        numbers = [*coordinates, *rates, *turns, arb(1)]
        return arb_mat(len(numbers), 1, numbers)

    def largest_acceleration(self, motion: arb_mat) -> float:
        """Return a bound of the contact acceleration."""
        return float(self._acceleration_bound @ [abs(float(v)) for v in motion.entries()])

    @cached_property
    def free(self) -> LinearFlow:
        """The motion between impacts, of which q is observed."""
        coordinate = identity(self._matrix.nrows()).tolist()[self.place]
        return LinearFlow(self._matrix, arb_mat([coordinate]), self._count, self._fastest, self._digits)

    @cached_property
    def held(self) -> LinearFlow:
        """The motion while q rests, of which the acceleration that q would have without the stop is observed.

        The force of the stop accelerates along the jump, so that q is not accelerated.
        """
        count, matrix = self._count, arb_mat(self._matrix)
        acceleration = matrix.tolist()[count + self.place]
        for i, a in enumerate(self.jump):
            for j, of_contact in enumerate(acceleration):
                matrix[count + i, j] = arb(0) if i == self.place else (matrix[count + i, j] - a * of_contact).mid()
        matrix[self.place, count + self.place] = arb(0)
        return LinearFlow(matrix, arb_mat([acceleration]), count, self._fastest, self._digits)


def real(value: Number) -> arb:
    """Return a number of arb."""
    return value.mid() if isinstance(value, arb) else arb(value if isinstance(value, int | str) else float(value)).mid()


def complex_of(value: Number) -> acb:
    """Return a number of acb."""
    return value if isinstance(value, acb) else acb(value) if isinstance(value, arb) else acb(complex(value))


def matrix_of(rows: Matrix) -> arb_mat:
    """Return a matrix of arb."""
    return arb_mat([[real(v) for v in row] for row in rows])


def identity(size: int) -> arb_mat:
    """Return the identity."""
    return arb_mat([[int(i == j) for j in range(size)] for i in range(size)])


def doubles(matrix: arb_mat) -> np.ndarray:
    """Return a matrix in double precision."""
    return np.array([[float(v) for v in row] for row in matrix.tolist()])


def product(matrix: arb_mat, vector: Sequence[arb]) -> list[arb]:
    """Return a matrix times a vector."""
    return list((matrix * arb_mat([[v] for v in vector])).mid().entries())

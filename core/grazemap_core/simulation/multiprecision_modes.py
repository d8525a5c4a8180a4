"""The equations of motion of an oscillator in multi-precision arithmetic, and their solutions in closed form.

Displacements are from the static equilibrium. All numbers are taken as they are stored, in binary; the matrices of a
chain are sums without rounding, and proportional damping is 2 gamma K.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx

from grazemap_core.arrays import Floats
from grazemap_core.model.chain import Chain
from grazemap_core.model.oscillator import Oscillator


class RunError(Exception):
    """A run cannot be started or continued; says why."""


class Equations:
    """``M x'' + C x' + K x = forces + bias``, at the precision of the context.

    Attributes
    ----------
    contact, jump : list of N arb
        h, and the change of velocities by an impulse that changes that of the contact coordinate by 1.
    equilibrium : list of N arb
        Static displacements; 0 without a bias.
    place : arb
        The contact coordinate in equilibrium.
    """

    def __init__(self, oscillator: Oscillator) -> None:
        """Take the numbers of an oscillator. Raises RunError if it has no single equilibrium."""
        self._oscillator = oscillator
        self._mass, self._damping, self._stiffness = _matrices(oscillator)
        self.contact = [arb(h) for h in oscillator.contact.tolist()]
        response = self._mass.solve(arb_mat([[h] for h in self.contact]))
        moved = self.contact_of(response.entries())
        self.jump = [x / moved for x in response.entries()]
        bias = oscillator.bias.tolist()
        self.equilibrium = [arb(0)] * len(bias)
        if any(bias):
            try:
                self.equilibrium = self._stiffness.solve(arb_mat([[arb(s)] for s in bias])).entries()
            except ZeroDivisionError:
                raise RunError("a free structure under a bias has no single equilibrium") from None
        self.place = self.contact_of(self.equilibrium)

    def contact_of(self, values: Sequence[Any]) -> Any:
        """Return the contact coordinate of N displacements, or its rate of N velocities, real or complex."""
        return sum((h * x for h, x in zip(self.contact, values, strict=True) if h != 0), 0 * values[0])

    def from_equilibrium(self, state: Floats | None) -> list[arb]:
        """Return displacements from the equilibrium, then velocities; None is the state of rest there."""
        if state is None:
            return [arb(0)] * (2 * len(self.contact))
        places, rates = ([arb(x) for x in row] for row in state.tolist())
        return [x - e for x, e in zip(places, self.equilibrium, strict=True)] + rates

    def free(self, omega: arb) -> ModalMotion:
        """Return the motion between the stops; q is observed. Raises RunError."""
        n = len(self.contact)
        whole = [[arb(int(i == j)) for j in range(n)] for i in range(n)]
        modes = _modes(self._mass, self._damping, self._stiffness)
        harmonics = [(order, column) for order, column, _ in self._harmonics(omega, arb_mat(whole))]
        return ModalMotion(modes, arb_mat(whole), list(range(n)), harmonics, omega, self._observe_contact, self.jump)

    def held(self, omega: arb, place: arb) -> ModalMotion:
        """Return the motion with the contact held at a place; minus the acceleration of q, if free, is observed.

        With ``x = a place + Z u`` and ``h^T Z = 0`` the mass matrix does not couple u to the contact. Raises RunError.
        """
        n = len(self.contact)
        pivot = max(range(n), key=lambda i: abs(float(self.contact[i])))
        others = [i for i in range(n) if i != pivot]
        basis = arb_mat(n, n - 1)
        for j, i in enumerate(others):
            basis[i, j], basis[pivot, j] = arb(1), -self.contact[i] / self.contact[pivot]
        across = basis.transpose()
        mass, damping, stiffness = (across * one * basis for one in (self._mass, self._damping, self._stiffness))
        modes = _modes(mass, damping, stiffness) if others else ([], acb_mat(0, 0))
        jump = arb_mat([[x] for x in self.jump])
        resting = jump * place
        if others:
            try:
                resting = resting - basis * stiffness.solve(across * (self._stiffness * jump)) * place
            except ZeroDivisionError:
                raise RunError("the held structure has no single equilibrium") from None
        steady = [(0, [acb(x) for x in resting.entries()] + [acb(0)] * n, [acb(0)] * n)]
        steady += self._harmonics(omega, basis)
        forces: dict[int | None, list[acb]] = {order: pushed for order, _, pushed in steady}
        row = self._mass.solve(arb_mat([[h] for h in self.contact])).transpose()
        spring, drag = (list((row * one).entries()) for one in (self._stiffness, self._damping))

        def observed(column: list[acb], order: int | None) -> acb:
            terms = zip((*spring, *drag), column, strict=True)
            force = zip(row.entries(), forces.get(order, ()), strict=order in forces)
            return sum((r * x for r, x in terms), acb(0)) - sum((r * f for r, f in force), acb(0))

        harmonics = [(order, column) for order, column, _ in steady]
        return ModalMotion(modes, basis, others, harmonics, omega, observed, None)

    def _observe_contact(self, column: list[acb], order: int | None) -> Any:
        return self.contact_of(column[: len(self.contact)])

    def _harmonics(self, omega: arb, basis: arb_mat) -> list[tuple[int, list[acb], list[acb]]]:
        """Return the order k of every harmonic, a state and forces, to be multiplied by e^{i k omega t}.

        Their real parts are the steady motion in the directions of the basis. Raises RunError.
        """
        across, found = basis.transpose(), []
        for one in self._oscillator.forces:
            s = one.order * omega
            parts = ([acb(x) for x in part.tolist()] for part in (one.constant, one.rate, one.quadratic))
            forces = [a + acb(0, 1) * s * b + s * s * c for a, b, c in zip(*parts, strict=True)]
            amplitudes = [acb(0)] * len(forces)
            if basis.ncols():
                mass, damping, stiffness = (across * m * basis for m in (self._mass, self._damping, self._stiffness))
                dynamic = acb_mat(stiffness) - acb_mat(mass) * (s * s) + acb_mat(damping) * acb(0, s)
                try:
                    solved = dynamic.solve(acb_mat(across) * acb_mat([[f] for f in forces]))
                except ZeroDivisionError:
                    raise RunError("there is no steady motion") from None
                amplitudes = list((acb_mat(basis) * solved).entries())
            column = [x * acb(0, -1) for x in amplitudes] + [x * s for x in amplitudes]
            found.append((one.order, column, [f * acb(0, -1) for f in forces]))
        return found


class ModalMotion:
    """A motion that is a sum of exponentials, one for every mode and every harmonic; a coordinate of it is observed.

    Of two complex conjugate modes the one with the positive imaginary part counts twice, and real parts are taken.

    Attributes
    ----------
    exponents : list of m acb
    vectors : (2 N, m)
        Displacements and velocities of every exponential.
    outputs : (3, m)
        The observed coordinate and its first two derivatives.
    kicks : list of m acb
        Change of the amplitudes by an impulse that changes the velocity of the contact by 1.
    rates, rows, fastest
        Exponents (m,) and outputs (3, m) in double precision, and the largest modulus of an exponent.
    """

    def __init__(
        self,
        modes: tuple[list[acb], acb_mat],
        basis: arb_mat,
        others: list[int],
        harmonics: list[tuple[int, list[acb]]],
        omega: arb,
        observed: Callable[[list[acb], int | None], acb],
        jump: list[arb] | None,
    ) -> None:
        """Take the modes of coordinates u, and harmonics of the whole state.

        Displacements move by ``basis u``, and u is the displacements `others`.
        """
        exponents, vectors = modes
        count, self._orders = len(others), [order for order, _ in harmonics]
        half = arb(2) ** (-ctx.prec // 2)
        real = [bool(abs(x.imag) < abs(x) * half) for x in exponents]
        chosen = [(j, 1 if real[j] else 2) for j, x in enumerate(exponents) if real[j] or x.imag > 0]
        inverse = vectors.inv() if count else vectors
        self._others = [*others, *(basis.nrows() + i for i in others)]
        self._inverse = acb_mat([[weight * inverse[j, i] for i in range(2 * count)] for j, weight in chosen])
        self._inverse = self._inverse.mid() if chosen else self._inverse
        columns = []
        for j, _ in chosen:
            parts = [acb_mat([[vectors[k + i, j]] for i in range(count)]) for k in (0, count)]
            columns.append([x for part in parts for x in (acb_mat(basis) * part).entries()])
        orders = [None] * len(chosen) + self._orders
        columns += [column for _, column in harmonics]
        self._steady = [column for _, column in harmonics]
        self.exponents = [exponents[j].mid() for j, _ in chosen] + [acb(0, order * omega) for order in self._orders]
        self.vectors = acb_mat(columns).transpose().mid()
        places = [observed(column, order) for column, order in zip(columns, orders, strict=True)]
        pairs = list(zip(places, self.exponents, strict=True))
        self.outputs = acb_mat([[place * x**order for place, x in pairs] for order in range(3)]).mid()
        self.kicks = []
        if jump is not None:
            self.kicks = self._of_modes([arb(0)] * len(jump) + jump) + [acb(0)] * len(harmonics)
        self.rates = np.array([complex(x) for x in self.exponents])
        self.fastest = float(np.abs(self.rates).max())
        self.rows = np.array([[complex(x) for x in row] for row in self.outputs.tolist()])

    def amplitudes(self, state: list[arb], angle: arb) -> list[acb]:
        """Return the amplitudes of the motion from a state, where omega t is an angle."""
        turns = [acb(0, order * angle).exp() for order in self._orders]
        rest = state
        for column, turn in zip(self._steady, turns, strict=True):
            rest = [x - (s * turn).real for x, s in zip(rest, column, strict=True)]
        return self._of_modes(rest) + [turn.mid() for turn in turns]

    def _of_modes(self, state: list[arb]) -> list[acb]:
        if not self._others:
            return []
        return [x.mid() for x in (self._inverse * acb_mat([[state[i]] for i in self._others])).entries()]

    def reduce(self) -> None:
        """Round all numbers to the precision of the context."""
        self.exponents, self.kicks = ([(+x).mid() for x in row] for row in (self.exponents, self.kicks))
        self.vectors, self.outputs = (
            acb_mat([[(+x).mid() for x in row] for row in table.tolist()]) for table in (self.vectors, self.outputs)
        )


def _modes(mass: arb_mat, damping: arb_mat, stiffness: arb_mat) -> tuple[list[acb], acb_mat]:
    """Return the exponents of the free motion, and the displacements and velocities of the modes in columns.

    Raises RunError.
    """
    n = mass.nrows()
    spring, drag = mass.solve(stiffness), mass.solve(damping)
    whole = acb_mat(2 * n, 2 * n)
    for i in range(n):
        whole[i, n + i] = 1
        for j in range(n):
            whole[n + i, j], whole[n + i, n + j] = -spring[i, j], -drag[i, j]
    try:
        exponents, vectors = whole.eig(right=True)
    except ValueError:
        raise RunError("two modes have the same exponent") from None
    return list(exponents), vectors


def _matrices(oscillator: Oscillator) -> tuple[arb_mat, arb_mat, arb_mat]:
    """Return mass, damping and stiffness matrix."""
    structure = oscillator.structure
    if not isinstance(structure, Chain):
        mass, damping, stiffness = (
            arb_mat([[arb(x) for x in row] for row in matrix.tolist()])
            for matrix in (structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix)
        )
        return mass, damping, stiffness
    links, dampers = ([arb(x) for x in part.tolist()] for part in (structure.stiffnesses, structure.link_damping))
    if structure.gamma is not None:
        dampers = [2 * arb(structure.gamma) * k for k in links]
    mass = arb_mat(len(links), len(links))
    for i, m in enumerate(structure.masses.tolist()):
        mass[i, i] = arb(m)
    return mass, _chain_matrix(dampers), _chain_matrix(links)


def _chain_matrix(links: Sequence[arb]) -> arb_mat:
    """Return the tridiagonal matrix of a chain whose last link goes to ground."""
    size = len(links)
    matrix = arb_mat(size, size)
    for i, link in enumerate(links):
        matrix[i, i] = matrix[i, i] + link
        if i + 1 < size:
            matrix[i + 1, i + 1] = link
            matrix[i, i + 1] = matrix[i + 1, i] = -link
    return matrix

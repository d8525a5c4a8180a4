"""The equations of motion of an oscillator in multi-precision arithmetic, and their solutions in closed form.

Displacements are from the static equilibrium. All numbers are taken as they are stored, in binary; the matrices of a
chain are sums without rounding, and proportional damping is 2 gamma K.

Equal or nearly equal exponents form a group. Their modes would be parallel, or nearly parallel and lose digits. So a
group has no modes but a basis X of the space of its motions, with ``A X = X (center + E)`` for the matrix A of the
equations. Its motions are ``X e^(center t) e^(E t) a``; the second exponential is hardly more than a polynomial of t.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from flint import acb, acb_mat, arb, arb_mat, ctx
from scipy.linalg import qr
from scipy.sparse.csgraph import connected_components

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.model.chain import Chain, matrix_of_links
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import NamedTuple
from grazemap_core.simulation.tolerances import (
    GROUP_SHIFT,
    NEAR_EXPONENTS,
    NEGLIGIBLE_TERM,
    VANISHING_EXPONENT,
)

DERIVATIVES = 5
"""Number of derivatives of what is observed for which there are bounds: those of orders 0 to 4."""

NO_MODES = "the modes cannot be separated with this number of bits"


class RunError(Exception):
    """A run cannot be started or continued; the message says why."""


class MotionEquations:
    """``M x'' + C x' + K x = forces + bias``, at the precision of the context.

    Attributes
    ----------
    contact : list of N arb
        The row h of the contact coordinate.
    jump : list of N arb
        Change of the velocities by an impulse that changes the velocity of the contact coordinate by 1.
    equilibrium : list of N arb
        Static displacements; 0 without a bias.
    contact_equilibrium : arb
        The contact coordinate in the equilibrium.
    """

    def __init__(self, oscillator: Oscillator) -> None:
        """Take the numbers of an oscillator. Raises RunError if it has no single equilibrium."""
        self._oscillator = oscillator
        self._mass, self._damping, self._stiffness = _matrices(oscillator)
        self.contact = [arb(h) for h in oscillator.contact.tolist()]
        self._response = self._mass.solve(arb_mat([self.contact]).transpose()).entries()
        contact_response = self.contact_of(self._response)
        self.jump = [x / contact_response for x in self._response]
        bias = oscillator.bias.tolist()
        self.equilibrium = [arb(0)] * len(bias)
        if any(bias):
            try:
                self.equilibrium = self._stiffness.solve(arb_mat([bias]).transpose()).entries()
            except ZeroDivisionError:
                raise RunError("a free structure under a bias has no single equilibrium") from None
        self.contact_equilibrium = self.contact_of(self.equilibrium)

    def contact_of(self, values: Sequence[Any]) -> Any:
        """Return the contact coordinate of N displacements, or its rate of N velocities, real or complex."""
        return sum((h * x for h, x in zip(self.contact, values, strict=True) if h != 0), 0 * values[0])

    def from_equilibrium(self, state: Floats | None) -> list[arb]:
        """Return displacements from the equilibrium, then velocities, of a state (2, N); None: at rest in it."""
        if state is None:
            return [arb(0)] * (2 * len(self.contact))
        places, rates = ([arb(x) for x in row] for row in state.tolist())
        return [x - e for x, e in zip(places, self.equilibrium, strict=True)] + rates

    def free(self, omega: arb) -> ModalMotion:
        """Return the motion between the stops; q is observed. Raises RunError."""
        n = len(self.contact)
        identity = arb_mat([[int(i == j) for j in range(n)] for i in range(n)])
        matrices = self._mass, self._damping, self._stiffness
        modes = _modes(*matrices)
        harmonics = [(order, column) for order, column, _ in self._harmonics(omega, identity, *matrices)]

        def output_of(column: list[acb], order: int | None) -> Any:
            return self.contact_of(column[:n])

        return ModalMotion(modes, identity, list(range(n)), harmonics, omega, output_of, self.jump)

    def held(self, omega: arb, held_at: arb) -> ModalMotion:
        """Return the motion with the contact held at a distance from the equilibrium.

        Minus the acceleration that q would have if it were released is observed. With the jump a,
        ``x = a held_at + Z u`` and ``h^T Z = 0``, the mass matrix does not couple u to the contact. Raises RunError.
        """
        n = len(self.contact)
        pivot = max(range(n), key=lambda i: abs(float(self.contact[i])))
        others = [i for i in range(n) if i != pivot]
        basis = arb_mat(n, n - 1)
        for j, i in enumerate(others):
            basis[i, j], basis[pivot, j] = arb(1), -self.contact[i] / self.contact[pivot]
        across = basis.transpose()
        mass, damping, stiffness = (across * matrix * basis for matrix in (self._mass, self._damping, self._stiffness))
        modes = _modes(mass, damping, stiffness)
        jump = arb_mat([self.jump]).transpose()
        resting = jump * held_at
        if others:
            try:
                resting = resting - basis * stiffness.solve(across * (self._stiffness * jump)) * held_at
            except ZeroDivisionError:
                raise RunError("the held structure has no single equilibrium") from None
        steady = [(0, [acb(x) for x in resting.entries()] + [acb(0)] * n, [acb(0)] * n)]
        steady += self._harmonics(omega, basis, mass, damping, stiffness)
        forces: dict[int | None, list[acb]] = {order: pushed for order, _, pushed in steady}
        row = arb_mat([self._response])
        spring, drag = ((row * matrix).entries() for matrix in (self._stiffness, self._damping))

        def output_of(column: list[acb], order: int | None) -> acb:
            terms = zip((*spring, *drag), column, strict=True)
            force = zip(self._response, forces.get(order, ()), strict=order in forces)
            return sum((r * x for r, x in terms), acb(0)) - sum((r * f for r, f in force), acb(0))

        harmonics = [(order, column) for order, column, _ in steady]
        return ModalMotion(modes, basis, others, harmonics, omega, output_of, None)

    def _harmonics(
        self, omega: arb, basis: arb_mat, mass: arb_mat, damping: arb_mat, stiffness: arb_mat
    ) -> list[tuple[int, list[acb], list[acb]]]:
        """Return order k, state and forces of every harmonic, to be multiplied by e^{i k omega t}.

        The real parts are the forces, and the steady motion of displacements in the space of the columns of `basis`, to
        which the matrices belong. Raises RunError.
        """
        across, harmonics = basis.transpose(), []
        for harmonic in self._oscillator.forces:
            s = harmonic.order * omega
            parts = ([acb(x) for x in part.tolist()] for part in (harmonic.constant, harmonic.rate, harmonic.quadratic))
            forces = [a + acb(0, 1) * s * b + s * s * c for a, b, c in zip(*parts, strict=True)]
            amplitudes = [acb(0)] * len(forces)
            if basis.ncols():
                dynamic = acb_mat(stiffness) - acb_mat(mass) * (s * s) + acb_mat(damping) * acb(0, s)
                try:
                    solved = dynamic.solve(acb_mat(across) * acb_mat([forces]).transpose())
                except ZeroDivisionError:
                    raise RunError("there is no steady motion") from None
                amplitudes = list((acb_mat(basis) * solved).entries())
            column = [x * acb(0, -1) for x in amplitudes] + [x * s for x in amplitudes]
            harmonics.append((harmonic.order, column, [f * acb(0, -1) for f in forces]))
        return harmonics


class _Modes(NamedTuple):
    """The groups of exponents of the free motion of n coordinates; most have one exponent."""

    groups: list[list[int]]
    """The columns of every group."""
    centers: list[acb]
    """One of every group, real if the group has the complex conjugates of its exponents."""
    couplings: list[acb_mat]
    """E of every group."""
    vectors: acb_mat
    """(2 n, 2 n) Displacements and velocities in columns."""
    inverse: acb_mat
    """(2 n, 2 n) Inverse of `vectors`: turns a state into amplitudes."""


class ModalMotion:
    """A motion that is a sum of exponentials, one for every mode and every harmonic; a coordinate of it is observed.

    The modes of a group have the same exponential, and amplitudes that change with time. Of two complex conjugate
    groups only the one with the positive imaginary part is kept; it counts twice, and the motion is the real part.

    Attributes
    ----------
    exponents : list of m acb
    vectors : (2 N, m)
        Displacements and velocities of every exponential.
    outputs : (3, m)
        The observed coordinate and its first two derivatives.
    kicks : list of m acb
        Change of the amplitudes by an impulse that changes the velocity of the contact by 1.
    rates, fastest
        Exponents (m,) in double precision, and the largest modulus among them.
    """

    def __init__(
        self,
        modes: _Modes,
        basis: arb_mat,
        others: list[int],
        harmonics: list[tuple[int, list[acb]]],
        omega: arb,
        output_of: Callable[[list[acb], int | None], acb],
        jump: list[arb] | None,
    ) -> None:
        """Take the modes of n coordinates u, and for every harmonic its order and the states of all masses.

        Displacements are ``basis u``, so those with the indices `others` are u. `output_of` returns what is observed of
        a state and, for a harmonic, its order.
        """
        count, self._orders = len(others), [order for order, _ in harmonics]
        chosen, self.exponents = list[tuple[int, int]](), list[acb]()
        self._couplings = list[tuple[list[int], acb_mat]]()
        for group, center, coupling in zip(modes.groups, modes.centers, modes.couplings, strict=True):
            if center.imag == 0 or center.imag > 0:
                if len(group) > 1:
                    self._couplings.append(([len(chosen) + i for i in range(len(group))], coupling))
                chosen += [(j, 1 if center.imag == 0 else 2) for j in group]
                self.exponents += [center] * len(group)
        self._others = [*others, *(basis.nrows() + i for i in others)]
        self._inverse = acb_mat([[weight * modes.inverse[j, i] for i in range(2 * count)] for j, weight in chosen])
        self._inverse = self._inverse.mid() if chosen else self._inverse
        columns = []
        for j, _ in chosen:
            parts = [acb_mat([[modes.vectors[k + i, j]] for i in range(count)]) for k in (0, count)]
            columns.append([x for part in parts for x in (acb_mat(basis) * part).entries()])
        orders = [None] * len(chosen) + self._orders
        columns += [column for _, column in harmonics]
        self._steady = [column for _, column in harmonics]
        self.exponents += [acb(0, order * omega) for order in self._orders]
        self.vectors = acb_mat(columns).transpose().mid()
        rows = [[output_of(column, order) for column, order in zip(columns, orders, strict=True)]]
        while len(rows) < DERIVATIVES:
            rows.append(self._derivative(rows[-1]))
        self.outputs = acb_mat(rows[:3]).mid()
        self.kicks = []
        if jump is not None:
            self.kicks = self._mode_amplitudes([arb(0)] * len(jump) + jump) + [acb(0)] * len(harmonics)
        self.rates = np.array([complex(x) for x in self.exponents])
        self.fastest = float(np.abs(self.rates).max())
        self._rows = np.array([[complex(x) for x in row] for row in rows])

    def amplitudes(self, state: list[arb], angle: arb) -> list[acb]:
        """Return the amplitudes of the motion from a state, at the moment when omega t = `angle`."""
        turns = [acb(0, order * angle).exp() for order in self._orders]
        rest = state
        for column, turn in zip(self._steady, turns, strict=True):
            rest = [x - (s * turn).real for x, s in zip(rest, column, strict=True)]
        return self._mode_amplitudes(rest) + [turn.mid() for turn in turns]

    def state(self, amplitudes: acb_mat) -> list[arb]:
        """Return displacements, then velocities, (2 N,), where the exponentials have the given amplitudes (m, 1)."""
        return [x.real.mid() for x in (self.vectors * amplitudes).entries()]

    def after(self, time: arb, amplitudes: list[acb]) -> acb_mat:
        """Return the amplitudes (m, 1) that the given ones become after a time."""
        values = amplitudes
        for columns, coupling in self._couplings:
            values = values.copy()
            turned = (coupling * time).exp() * acb_mat([[amplitudes[j] for j in columns]]).transpose()
            for j, value in zip(columns, turned.entries(), strict=True):
                values[j] = value
        return acb_mat([[((x * time).exp() * a).mid()] for x, a in zip(self.exponents, values, strict=True)])

    def terms(self, amplitudes: list[acb], longest: float) -> list[Complexes]:
        """Return terms T_0, T_1, .. (DERIVATIVES, m) of what is observed, one for every power of time.

        Derivative d of what is observed is the real part of ``sum_p t^p sum_j T_p[d, j] e^(rates[j] t)``. Powers that
        are negligible up to the time `longest` are left out.
        """
        values = amplitudes
        factors = [np.array([complex(a) for a in values])]
        largest = float(np.abs(factors[0]).max())
        while self._couplings:
            values = self._coupled(values, len(factors))
            factor = np.array([complex(a) for a in values])
            size = float(np.abs(factor).max()) * longest ** len(factors)
            if size <= NEGLIGIBLE_TERM * largest:
                break
            factors.append(factor)
            largest = max(largest, size)
        return [self._rows * factor for factor in factors]

    def bounds(self, terms: list[Complexes], longest: float) -> Floats:
        """Return bounds (DERIVATIVES,) of what is observed up to a longest time; the exponentials do not grow."""
        bounds: Floats = np.abs(terms[0]).sum(axis=1)
        for power, term in enumerate(terms[1:], 1):
            decay = np.maximum(-self.rates.real, 0.0)
            latest = power / np.maximum(decay, power / longest)  # where the power times the exponential is largest
            bounds = bounds + np.abs(term) @ (latest**power * np.exp(-decay * latest))
        return bounds

    def _coupled(self, values: list[acb], divisor: int) -> list[acb]:
        """Return E times amplitudes, over a divisor."""
        coupled = [acb(0)] * len(values)
        for columns, coupling in self._couplings:
            product = coupling * acb_mat([[values[j] for j in columns]]).transpose()
            for j, value in zip(columns, product.entries(), strict=True):
                coupled[j] = (value / divisor).mid()
        return coupled

    def _derivative(self, row: list[Any]) -> list[Any]:
        """Return the output row of the time derivative of a quantity with the output row `row`."""
        derivative = [x * entry for x, entry in zip(self.exponents, row, strict=True)]
        for columns, coupling in self._couplings:
            product = acb_mat([[row[j] for j in columns]]) * coupling
            for j, value in zip(columns, product.entries(), strict=True):
                derivative[j] += value
        return derivative

    def _mode_amplitudes(self, state: list[arb]) -> list[acb]:
        if not self._others:
            return []
        return [x.mid() for x in (self._inverse * acb_mat([[state[i] for i in self._others]]).transpose()).entries()]

    def reduce(self) -> None:
        """Round the numbers with which a motion goes on to the precision of the context.

        Those from which `amplitudes` computes, and those in double precision, stay as they are.
        """
        self.exponents, self.kicks = ([(+x).mid() for x in row] for row in (self.exponents, self.kicks))
        self._couplings = [
            (columns, acb_mat([[(+x).mid() for x in row] for row in coupling.tolist()]))
            for columns, coupling in self._couplings
        ]
        self.vectors, self.outputs = (
            acb_mat([[(+x).mid() for x in row] for row in table.tolist()]) for table in (self.vectors, self.outputs)
        )


def _modes(mass: arb_mat, damping: arb_mat, stiffness: arb_mat) -> _Modes:
    """Return the modes of the free motion. Raises RunError."""
    n = mass.nrows()
    if n == 0:
        return _Modes([], [], [], acb_mat(0, 0), acb_mat(0, 0))
    spring, drag = mass.solve(stiffness), mass.solve(damping)
    matrix = acb_mat(2 * n, 2 * n)
    for i in range(n):
        matrix[i, n + i] = 1
        for j in range(n):
            matrix[n + i, j], matrix[n + i, n + j] = -spring[i, j], -drag[i, j]
    matrix = matrix.mid()
    exponents, vectors = matrix.eig(right=True, algorithm="approx")
    values = np.array([complex(x) for x in exponents])
    apart, fastest = np.abs(values[:, None] - values), float(np.abs(values).max())
    near = NEAR_EXPONENTS * np.abs(values) + VANISHING_EXPONENT * fastest
    count, labels = connected_components(apart <= near)
    groups = [np.flatnonzero(labels == label).tolist() for label in range(count)]
    centers = []
    for label, group in enumerate(groups):
        center = (sum((exponents[j] for j in group), acb(0)) / len(group)).mid()
        if 2.0 * abs(complex(center).imag) <= near[group[0]]:  # the group has its own complex conjugates
            center = acb(center.real)
        centers.append(center)
        if len(group) > 1:
            gap = float(apart[group[0], labels != label].min(initial=math.inf))
            space = _space(matrix, center, len(group), gap)
            for k, j in enumerate(group):
                for i in range(2 * n):
                    vectors[i, j] = space[i, k]
    vectors = vectors.mid()
    try:
        inverse = vectors.inv()
    except ZeroDivisionError:
        raise RunError(NO_MODES) from None
    product = inverse * matrix * vectors
    couplings = []
    for group, center in zip(groups, centers, strict=True):
        for j in group:
            product[j, j] -= center
        couplings.append(acb_mat([[product[i, j] for j in group] for i in group]).mid())
    residual = np.abs([[complex(x) for x in row] for row in product.tolist()])
    is_coupling = (labels[:, None] == labels) & (np.bincount(labels)[labels] > 1)
    if not np.where(is_coupling, 0.0, residual).max() <= 2.0 ** -(ctx.prec // 2) * fastest:
        raise RunError(NO_MODES)
    return _Modes(groups, centers, couplings, vectors, inverse)


def _space(matrix: acb_mat, center: acb, count: int, gap: float) -> acb_mat:
    """Return a basis of the space of so many exponents around a center; the next exponent is about `gap` away.

    Inverse iteration begins with random columns, always the same. `count` rows of the basis form the identity. Raises
    RunError.
    """
    size, bits = matrix.nrows(), ctx.prec
    if count == size:
        return acb_mat([[acb(int(i == j)) for j in range(size)] for i in range(size)])
    columns = acb_mat(np.random.default_rng(0).normal(size=(size, count)).tolist())
    with ctx.workprec(2 * bits):
        largest = max(abs(x).mid() for x in matrix.entries())
        shifted, shift = acb_mat(matrix), center + GROUP_SHIFT * gap
        for i in range(size):
            shifted[i, i] -= shift
        for _ in range(bits):
            columns = shifted.solve(columns, algorithm="approx")
            basis = np.linalg.qr([[complex(x) for x in row] for row in columns.tolist()])[0]
            rows = qr(basis.T, pivoting=True, mode="r")[1][:count].tolist()
            columns = (columns * _rows_of(columns, rows).inv()).mid()
            moved = matrix * columns
            residual = (moved - columns * _rows_of(moved, rows)).entries()
            bound = largest * max(abs(x).mid() for x in columns.entries()) * arb(2) ** -bits
            if all(abs(x).mid() <= bound for x in residual):
                return columns
    raise RunError(NO_MODES)


def _rows_of(matrix: acb_mat, rows: list[int]) -> acb_mat:
    return acb_mat([[matrix[i, j] for j in range(matrix.ncols())] for i in rows])


def _matrices(oscillator: Oscillator) -> tuple[arb_mat, arb_mat, arb_mat]:
    """Return mass, damping and stiffness matrix."""
    structure = oscillator.structure
    if not isinstance(structure, Chain):
        matrices = (structure.mass_matrix, structure.damping_matrix, structure.stiffness_matrix)
        mass, damping, stiffness = (arb_mat(matrix.tolist()) for matrix in matrices)
        return mass, damping, stiffness
    links, dampers = ([arb(x) for x in part.tolist()] for part in (structure.stiffnesses, structure.link_damping))
    if structure.gamma is not None:
        dampers = [2 * arb(structure.gamma) * k for k in links]
    damping, stiffness = (arb_mat(matrix_of_links(np.array(part)).tolist()) for part in (dampers, links))
    return arb_mat(structure.mass_matrix.tolist()), damping, stiffness

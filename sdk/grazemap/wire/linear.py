"""The oscillator between its stops, a linear system: natural frequencies, damping ratios, steady motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from grazemap.constants import EPSILON
from grazemap.later import Later
from grazemap.wire.structure import Matrices, RayleighDamping, StopName

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from grazemap.wire.oscillator import Oscillator

    Floats = NDArray[np.float64]
    Complexes = NDArray[np.complex128]
else:
    np = Later("numpy")

_SOLVED_AT_ONCE = 1 << 21
"""Entries of the matrices that are solved together: 32 MiB."""

_SAMPLES = 16
"""Samples of a forcing period per order of the highest harmonic, in which no peak that counts is missed."""

_NEWTON_STEPS = 8
"""Newton steps from a sample to the peak beside it; five reach round-off but where the peak has no curvature."""

_ROUND_OFF = 1e-13
"""Error of an eigenvalue, relative to the largest one."""

FREE_MODE = 16.0 * EPSILON
"""Eigenvalue or singular value, over the largest one and N, up to which it is the rounding of 0; the core has the
same."""

GROWTH = EPSILON**0.5
"""Real part of an exponent, relative to the largest one, above which it is not the rounding of 0; the core has the
same."""


def matrices(oscillator: Oscillator) -> tuple[Floats, Floats, Floats]:
    """Return mass, damping and stiffness matrix, each of shape (N, N)."""
    if oscillator.matrices is not None:
        return _given(oscillator.matrices)
    stiffness = _of_links(np.array(oscillator.stiffnesses))
    damping = oscillator.damping
    if isinstance(damping, list):
        coefficients = np.array(damping) * (1.0 if oscillator.units == "SI" else 2.0)
        return np.diag(oscillator.masses), _of_links(coefficients), stiffness
    return np.diag(oscillator.masses), 2.0 * damping * stiffness, stiffness


def _given(described: Matrices) -> tuple[Floats, Floats, Floats]:
    mass, stiffness, damping = np.array(described.mass), np.array(described.stiffness), described.damping
    if isinstance(damping, list):
        return mass, np.array(damping), stiffness
    if isinstance(damping, RayleighDamping):
        return mass, damping.rayleigh[0] * mass + damping.rayleigh[1] * stiffness, stiffness
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    momentum = mass @ inverse.T @ vectors
    resisted = squares > FREE_MODE * len(mass) * np.abs(squares).max()
    rates = 2.0 * np.array(damping.modal) * np.sqrt(np.where(resisted, squares, 0.0))
    return mass, (momentum * rates) @ momentum.T, stiffness


def _of_links(coefficients: Floats) -> Floats:
    """Return the matrix of forces on the masses (N, N) from the coefficients of links (N,)."""
    matrix = np.diag(coefficients)
    matrix[1:, 1:] += np.diag(coefficients[:-1])
    matrix -= np.diag(coefficients[:-1], 1) + np.diag(coefficients[:-1], -1)
    return matrix


def natural_frequencies(oscillator: Oscillator) -> Floats:
    """Return the angular frequencies of the undamped structure without stops, increasing, shape (N,)."""
    if oscillator.matrices is not None:
        mass, _, stiffness = matrices(oscillator)
        squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)
        return np.asarray(np.sqrt(np.where(np.abs(squares) <= _ROUND_OFF * np.max(np.abs(squares)), 0.0, squares)))
    return _natural_frequencies(tuple(oscillator.masses), tuple(oscillator.stiffnesses)).copy()


@lru_cache(maxsize=16)
def _natural_frequencies(masses: tuple[float, ...], stiffnesses: tuple[float, ...]) -> Floats:
    roots = np.sqrt(masses)
    return np.asarray(np.sqrt(np.linalg.eigvalsh(_of_links(np.array(stiffnesses)) / np.outer(roots, roots))))


def fastest_exponent(oscillator: Oscillator) -> float:
    """Return the largest modulus of the exponents of the free motion."""
    return float(np.abs(_exponents(oscillator)).max())


def slowest_decay(oscillator: Oscillator) -> float:
    """Return the rate at which the free motion decays that does so most slowly; 0 where one does not."""
    if oscillator.matrices is None and not isinstance(oscillator.damping, list):
        frequency = natural_frequencies(oscillator)
        ratio = oscillator.damping * frequency
        return float((frequency * np.where(ratio < 1.0, ratio, 0.5 / np.fmax(ratio, 1.0))).min())
    return max(0.0, float(-_exponents(oscillator).real.max()))


def _exponents(oscillator: Oscillator) -> Complexes:
    mass, damping, stiffness = matrices(oscillator)
    count = len(mass)
    inner, viscous = np.linalg.solve(mass, stiffness), np.linalg.solve(mass, damping)
    return np.linalg.eigvals(np.block([[np.zeros((count, count)), np.eye(count)], [-inner, -viscous]]))


def contact_modes(oscillator: Oscillator) -> tuple[Floats, Floats, Floats]:
    """Return frequencies, decay rates and amplitudes of the modes in the impulse response of the contact, (N,) each.

    Coupling of the modes by dampers, and what of the stiffness is not symmetric, are left out. The frequency of a mode
    that does not oscillate is 0.
    """
    mass, damping, stiffness = matrices(oscillator)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    inner = inverse @ stiffness @ inverse.T
    squares, vectors = np.linalg.eigh(0.5 * (inner + inner.T))
    modes = inverse.T @ vectors
    rates = 0.5 * np.einsum("ij,ik,kj->j", modes, damping, modes)
    turning = np.maximum(squares, 0.0) - rates**2
    frequencies = np.sqrt(np.maximum(turning, 0.0))
    decays = rates - np.sqrt(np.maximum(-turning, 0.0))
    shares = (np.array(oscillator.contact_row) @ modes) ** 2
    least = _ROUND_OFF * max(np.abs(squares).max(), (rates**2).max())  # a mode that is critically damped has 0
    return frequencies, decays, shares / np.sqrt(np.maximum(np.abs(turning), least))


def growing(oscillator: Oscillator) -> str | None:
    """Return which of the matrices, "stiffness" or "damping", lets a free motion grow; None if none does."""
    mass, damping, stiffness = matrices(oscillator)
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    inner, viscous = inverse @ stiffness @ inverse.T, inverse @ damping @ inverse.T
    if np.array_equal(stiffness, stiffness.T):
        squares = np.linalg.eigvalsh(0.5 * (inner + inner.T))
        if squares[0] < -FREE_MODE * len(mass) * np.abs(squares).max():
            return "stiffness"
        if np.linalg.eigvalsh(0.5 * (viscous + viscous.T))[0] >= 0.0:  # gyroscopic forces do no work
            return None
    count = len(mass)
    values = np.linalg.eigvals(np.block([[np.zeros((count, count)), np.eye(count)], [-inner, -viscous]]))
    return "damping" if values.real.max() > GROWTH * np.abs(values).max() else None


class FreeModes(NamedTuple):
    """The displacements that no spring resists, or the forces that no displacement balances."""

    directions: Floats
    """(modes, N) Of length 1."""
    rounding: float
    """Bound of their errors."""

    def have_part_of(self, values: Sequence[float]) -> bool:
        """Return whether numbers (N,), those of a contact or of forces, have a part along one of them."""
        row = np.array(values)
        return bool(np.any(np.abs(self.directions @ row) > self.rounding * np.linalg.norm(row)))


def free_modes(stiffness: Floats) -> FreeModes:
    """Return the displacements that no spring resists; of the transposed matrix, the forces that nothing balances."""
    _, singular, right = np.linalg.svd(stiffness)
    least = FREE_MODE * len(right)
    free = singular <= least * singular[0]
    others = singular[~free]
    return FreeModes(right[free], least * float(singular[0] / others[-1]) if len(others) else least)


def are_damped(free: FreeModes, oscillator: Oscillator) -> bool:
    """Return whether dampers act on free modes of a structure whose damping is not diagonal in its modes."""
    mass, damping, stiffness = matrices(oscillator)
    forces = np.abs(np.concatenate((damping @ free.directions.T, damping.T @ free.directions.T)))
    if forces.max() <= free.rounding * np.abs(damping).max():
        return False
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    modes = inverse.T @ np.linalg.eigh(inverse @ stiffness @ inverse.T)[1]
    coupling = modes.T @ damping @ modes
    between = coupling - np.diag(np.diag(coupling))
    return bool(np.abs(between).max() > free.rounding * np.abs(coupling).max())


def antiresonances(oscillator: Oscillator) -> Floats:
    """Return the frequencies near which mass 1 hardly moves if it alone is forced: those of the chain without it."""
    mass, _, stiffness = matrices(oscillator)
    roots = np.sqrt(np.diag(mass)[1:])
    return np.asarray(np.sqrt(np.linalg.eigvalsh(stiffness[1:, 1:] / np.outer(roots, roots))))


def damping_ratios(oscillator: Oscillator) -> Floats:
    """Return the damping ratio of each mode, shape (N,); 1 or more: the mode does not oscillate.

    They are -(a + b) / (2 sqrt(a b)) of the pairs a, b of eigenvalues, in the order of their product. Where several
    modes do not oscillate their eigenvalues form no pairs unless the damping is one number: NaN, at the end. A ratio
    that the round-off of a much stronger damper hides is NaN.
    """
    mass, damping, stiffness = matrices(oscillator)
    if oscillator.matrices is None and not isinstance(oscillator.damping, list):
        return oscillator.damping * natural_frequencies(oscillator)
    count, inverse = oscillator.size, np.linalg.inv(mass)
    system = np.block([[np.zeros((count, count)), np.eye(count)], [-inverse @ stiffness, -inverse @ damping]])
    values = np.linalg.eigvals(system)
    upper, real = values[values.imag > 0.0], values[values.imag == 0.0].real
    size, ratio = np.abs(upper), -upper.real / np.abs(upper)
    if len(real) == 2:
        # the product is that of all, from the determinants: the smaller of two very different ones has no digits
        logarithm = np.linalg.slogdet(stiffness)[1] - np.linalg.slogdet(mass)[1]
        mean = np.exp(0.5 * (logarithm - 2.0 * np.log(size).sum()))
        size, ratio = np.append(size, mean), np.append(ratio, -real.sum() / (2.0 * mean))
    ratio = np.where(np.abs(values).max() * _ROUND_OFF > ratio * size, np.nan, ratio)
    ratio = ratio[np.argsort(size, kind="stable")]
    return np.append(ratio, np.full(count - len(ratio), np.nan))


def steady_amplitude(oscillator: Oscillator, omega: Floats, side: int = 1) -> Floats:
    """Return the largest displacement to one side of the contact coordinate in the steady motion without stops.

    It is measured from the equilibrium, at every omega (m,): with one harmonic the amplitude. `side` is 1 for the right
    and -1 for the left. It is infinite at the resonance of an undamped mode.
    """
    samples = _SAMPLES * max(oscillator.orders, default=1)
    chunk = max(1, _SOLVED_AT_ONCE // max(oscillator.size**2, samples))
    parts = [_amplitude(oscillator, omega[i : i + chunk], side) for i in range(0, len(omega), chunk)]
    return np.concatenate(parts) if parts else np.zeros(0)


def contact_equilibrium(oscillator: Oscillator) -> float:
    """Return the contact coordinate at the static equilibrium; a free mode, which it does not see, is left out."""
    if not any(oscillator.bias or ()):
        return 0.0
    place = np.linalg.lstsq(matrices(oscillator)[2], np.array(oscillator.bias), rcond=None)[0]
    return float(np.array(oscillator.contact_row) @ place)


def grazing_clearance(oscillator: Oscillator, omega: Floats, stop: StopName) -> Floats:
    """Return the clearance at which the steady motion without stops touches a stop, at omega (m,).

    It is the farthest that the contact coordinate goes to that side of 0, where no spring is stretched.
    """
    side = 1 if stop == "right" else -1
    return side * contact_equilibrium(oscillator) + steady_amplitude(oscillator, omega, side)


def _amplitude(oscillator: Oscillator, omega: Floats, side: int) -> Floats:
    orders = oscillator.orders or [1]
    try:
        responses = [side * _responses(oscillator, [order], order * omega)[:, 0] for order in orders]
    except np.linalg.LinAlgError:
        if len(omega) == 1:
            return np.full(1, np.inf)
        return np.concatenate([_amplitude(oscillator, frequency, side) for frequency in np.split(omega, len(omega))])
    return np.abs(responses[0]) if len(orders) == 1 else _largest(np.array(orders), np.stack(responses, axis=1))


def contact_forces(oscillator: Oscillator, omega: Floats, growth: float) -> tuple[Floats, Floats]:
    """Return the amplitudes of the force on the held contact and of the free contact, summed over harmonics, (m,) each.

    The forces grow by a factor e in 1/(growth omega), so that they are finite at a resonance, too.
    """
    mass, damping, stiffness = matrices(oscillator)
    row, forced, moved = np.array(oscillator.contact_row), np.zeros(len(omega)), np.zeros(len(omega))
    for order in oscillator.orders:
        rate = (omega * (1j * order + growth))[:, None, None]
        forces = _forces(oscillator, order, order * omega)
        both = np.stack([forces, np.broadcast_to(row, forces.shape)], axis=2)
        answers = np.einsum("i,mij->mj", row, np.linalg.solve(stiffness + rate * damping + rate**2 * mass, both))
        moved += np.abs(answers[:, 0])
        forced += np.abs(answers[:, 0] / answers[:, 1])
    return forced, moved


def contact_mass(oscillator: Oscillator) -> tuple[float, float]:
    """Return the mass that an impulse on the contact meets, and the rate at which damping alone slows it."""
    mass, damping, _ = matrices(oscillator)
    row = np.array(oscillator.contact_row)
    response = np.linalg.solve(mass, row)
    effective = 1.0 / float(row @ response)
    return effective, effective * float(response @ damping @ response)


def _largest(orders: NDArray[np.int64], responses: Complexes) -> Floats:
    """Return the maximum of ``sum_k Im(X_k e^{i k theta})`` over theta for responses (m, H), shape (m,).

    All local maxima of samples are polished by Newton's method.
    """
    count = _SAMPLES * int(orders[-1])
    theta = 2.0 * np.pi / count * np.arange(count)
    values = (responses @ np.exp(1j * np.outer(orders, theta))).imag
    peaks = (values >= np.roll(values, 1, axis=1)) & (values >= np.roll(values, -1, axis=1))
    row, column = np.nonzero(peaks)
    place, largest = theta[column], values.max(axis=1)
    for _ in range(_NEWTON_STEPS):
        turned = responses[row] * np.exp(1j * np.outer(place, orders))
        np.maximum.at(largest, row, turned.imag.sum(axis=1))
        slope, bend = turned.real @ orders, turned.imag @ orders**2
        step = np.divide(slope, bend, out=np.zeros_like(slope), where=bend > 0.0)
        place = place + np.clip(step, -theta[1], theta[1])
    return np.asarray(largest)


def _responses(oscillator: Oscillator, orders: Sequence[int], frequency: Floats) -> Complexes:
    """Return the complex amplitudes of the contact coordinate in harmonics at their frequencies (m,), (m, orders)."""
    mass, damping, stiffness = matrices(oscillator)
    systems = stiffness - frequency[:, None, None] ** 2 * mass + 1j * frequency[:, None, None] * damping
    forces = np.zeros((len(frequency), oscillator.size, len(orders)), dtype=np.complex128)
    for place, order in enumerate(orders):
        forces[:, :, place] = _forces(oscillator, order, frequency)
    return np.asarray(np.einsum("i,mij->mj", np.array(oscillator.contact_row), np.linalg.solve(systems, forces)))


def _forces(oscillator: Oscillator, order: int, frequency: Floats) -> Complexes:
    """Return the complex amplitudes of the forces in one harmonic at its frequencies (m,), shape (m, N)."""
    forces = np.zeros((len(frequency), oscillator.size), dtype=np.complex128)
    if not oscillator.harmonics and order == 1:
        forces += np.array(oscillator.amplitudes)
    for force in oscillator.harmonics:
        if force.harmonic == order:
            turn = np.exp(1j * np.array(force.phase)) if force.phase is not None else 1.0
            each = np.array(force.amplitude) * turn
            forces += frequency[:, None] ** 2 * each if force.law == "unbalance" else each
    base = oscillator.base
    if base is not None and order == 1:
        mass, damping, stiffness = matrices(oscillator)
        influence = np.ones(oscillator.size) if base.influence is None else np.array(base.influence)
        moved = frequency[:, None] ** 2 * (mass @ influence)
        if not base.stops_move:
            moved = stiffness @ influence + 1j * frequency[:, None] * (damping @ influence)
        forces += base.amplitude * np.exp(1j * base.phase) * moved
    return forces

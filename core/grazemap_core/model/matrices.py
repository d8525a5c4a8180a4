"""A structure given by its mass, damping and stiffness matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve, cholesky, eigh, solve_triangular

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.model.kernels.elements import Elements
from grazemap_core.model.structure import Structure
from grazemap_core.model.tolerances import ASYMMETRY, FLOOR_OF_WEIGHTS, FREE_MODE
from grazemap_core.numerics.kernels.double_double import exact, transformed
from grazemap_core.records import dataclass
from grazemap_core.tolerances import LARGEST_NUMBER, SMALLEST_NUMBER

Matrix = Sequence[Sequence[float]] | Floats


@dataclass(frozen=True, eq=False)
class Matrices(Structure):
    """A structure with dense matrices of shape (N, N); use `create`, which validates them."""

    mass: Floats
    """M, symmetric and positive definite."""
    damping: Floats
    """C, of any kind: a gyroscopic one is not symmetric."""
    stiffness: Floats
    """K, of any kind: that of follower forces is not symmetric."""
    ratios: Floats | None = None
    """(N,) The damping ratios of the modes, where C was given by them."""

    @classmethod
    def create(
        cls,
        mass: Matrix,
        stiffness: Matrix,
        damping: Matrix | None = None,
        *,
        modal: float | Sequence[float] | None = None,
        rayleigh: Sequence[float] | None = None,
    ) -> Matrices:
        """Return a structure with validated matrices.

        Parameters
        ----------
        mass, stiffness : N x N numbers
        damping : N x N numbers, optional
            C.
        modal : number >= 0, or N numbers >= 0, optional
            The damping ratio of every mode, in increasing frequency.
        rayleigh : two numbers, optional
            alpha and beta of ``C = alpha M + beta K``.

        Raises
        ------
        ParameterError
            A matrix is not square or not of the size of M, a number is out of its range, or M is not symmetric and
            positive definite.
        """
        m = _square("mass", mass, None)
        k = _square("stiffness", stiffness, len(m))
        if np.max(np.abs(m - m.T)) > ASYMMETRY * np.max(np.abs(m)):
            raise ParameterError("mass", "must be symmetric")
        m = 0.5 * (m + m.T)
        if np.max(np.abs(k - k.T)) <= ASYMMETRY * np.max(np.abs(k)):
            k = 0.5 * (k + k.T)
        try:
            cholesky(m)
        except np.linalg.LinAlgError:
            raise ParameterError("mass", "must be positive definite") from None
        if modal is not None:
            return cls._with_ratios(m, k, modal)
        if rayleigh is not None:
            alpha, beta = (float(value) for value in rayleigh)
            return cls(m, alpha * m + beta * k, k)
        return cls(m, np.zeros_like(m) if damping is None else _square("damping", damping, len(m)), k)

    @classmethod
    def _with_ratios(cls, mass: Floats, stiffness: Floats, modal: float | Sequence[float]) -> Matrices:
        count = len(mass)
        ratios = np.array(modal, dtype=np.float64)
        if ratios.ndim > 1 or (ratios.ndim == 1 and len(ratios) != count):
            raise ParameterError("damping", f"modal must be one number or {count}, one for every mode")
        if not np.all((ratios >= 0.0) & (ratios <= LARGEST_NUMBER)):
            raise ParameterError("damping", "every damping ratio must be 0 or greater")
        if not np.array_equal(stiffness, stiffness.T):
            raise ParameterError("damping", "modal is for a symmetric stiffness matrix: there are no real modes")
        squares, modes = real_modes(mass, stiffness)
        momentum = mass @ modes
        ratios = np.broadcast_to(ratios, count).copy()
        damping = (momentum * (2.0 * ratios * np.sqrt(np.maximum(squares, 0.0)))) @ momentum.T
        return cls(mass, 0.5 * (damping + damping.T), stiffness, ratios)

    @property
    def size(self) -> int:
        """Number of degrees of freedom N."""
        return len(self.mass)

    @property
    def mass_matrix(self) -> Floats:
        """M, shape (N, N)."""
        return self.mass

    @property
    def damping_matrix(self) -> Floats:
        """C, shape (N, N)."""
        return self.damping

    @property
    def stiffness_matrix(self) -> Floats:
        """K, shape (N, N)."""
        return self.stiffness

    @cached_property
    def elements(self) -> Elements:
        """Those of `elements_of`."""
        return elements_of(self.mass, self.damping, self.stiffness)

    @property
    def has_symmetric_stiffness(self) -> bool:
        """Whether K is symmetric, so that the structure without damping has real modes."""
        return bool(np.array_equal(self.stiffness, self.stiffness.T))

    def solve_mass(self, vectors: Floats) -> Floats:
        """Return ``M^-1 vectors``, shape (N,) or (N, m)."""
        return np.asarray(cho_solve(self._mass_factors, vectors))

    def ground_forces(self, influence: Floats) -> tuple[Floats, Floats]:
        """Return ``K r`` and ``C r``, as `Structure.ground_forces`, without the rounding of sums that cancel."""
        moved = exact(influence[:, None])
        return transformed(self.stiffness, moved).rounded[:, 0], transformed(self.damping, moved).rounded[:, 0]

    def undamped(self) -> Matrices:
        """Return the structure without damping."""
        return replace(self, damping=np.zeros_like(self.mass), ratios=None)

    @cached_property
    def _root_of_mass(self) -> Floats:
        """L^T of ``M = L L^T``."""
        return np.asarray(cholesky(self.mass))

    @cached_property
    def _root_of_stiffness(self) -> Floats:
        """W, such that ``|W x|^2`` is ``x^T K x`` where that is positive, and has its size elsewhere."""
        root = self._root_of_mass
        half = solve_triangular(root, self.stiffness, trans="T")
        inner = solve_triangular(root, half.T, trans="T")
        values, vectors = eigh(0.5 * (inner + inner.T))
        size = np.abs(values)
        largest = np.max(size)
        floor = FLOOR_OF_WEIGHTS * (largest if largest > 0.0 else 1.0)
        return np.asarray(np.sqrt(np.maximum(size, floor))[:, None] * (vectors.T @ root))

    @cached_property
    def _mass_factors(self) -> tuple[Floats, bool]:
        factors: tuple[Floats, bool] = cho_factor(self.mass)
        return factors

    def energy_matrix(self) -> Floats:
        """Return A of ``z' = A z``; z is ``W x`` and ``L^T v``, where ``M = L L^T``, and ``K = W^T W`` if possible."""
        root, weight = self._root_of_mass, self._root_of_stiffness
        inverse_root = solve_triangular(root, np.eye(self.size))
        inverse_weight = np.linalg.inv(weight)
        return np.block(
            [
                [np.zeros_like(root), weight @ inverse_root],
                [
                    -inverse_root.T @ self.stiffness @ inverse_weight,
                    -inverse_root.T @ self.damping @ inverse_root,
                ],
            ]
        )

    def from_energy(self) -> Floats:
        """Return the matrix that takes z of `energy_matrix` to displacements and velocities, shape (2N, 2N)."""
        count = self.size
        matrix = np.zeros((2 * count, 2 * count))
        matrix[:count, :count] = np.linalg.inv(self._root_of_stiffness)
        matrix[count:, count:] = solve_triangular(self._root_of_mass, np.eye(count))
        return matrix

    def weighted(self, columns: Floats) -> Floats:
        """Return displacements and velocities (2N, m) as z of `energy_matrix`."""
        count = self.size
        return np.concatenate((self._root_of_stiffness @ columns[:count], self._root_of_mass @ columns[count:]))

    def unweighted(self, columns: Floats) -> Floats:
        """Return the inverse of `weighted`."""
        count = self.size
        return np.concatenate(
            (
                np.linalg.solve(self._root_of_stiffness, columns[:count]),
                solve_triangular(self._root_of_mass, columns[count:]),
            )
        )

    def displacements(self, columns: Floats) -> Floats:
        """Return the displacements (N, m) of states (2N, m)."""
        return columns[: self.size]

    def rows_of_states(self, rows: Floats) -> Floats:
        """Return rows (m, 2N) that act on z of `energy_matrix` as rows that act on displacements and velocities."""
        count = self.size
        return np.concatenate((rows[:, :count] @ self._root_of_stiffness, rows[:, count:] @ self._root_of_mass), axis=1)


def real_modes(mass: Floats, stiffness: Floats) -> tuple[Floats, Floats]:
    """Return the squared frequencies (N,), 0 of a free mode, and the modes (N, N) of a structure with a symmetric K."""
    squares, modes = eigh(stiffness, mass)
    return np.where(np.abs(squares) <= FREE_MODE * len(mass) * np.max(np.abs(squares)), 0.0, squares), modes


def has_free_modes(stiffness: Floats) -> bool:
    """Return whether there are displacements that no spring resists."""
    singular = np.linalg.svd(stiffness, compute_uv=False)
    return bool(singular[-1] <= FREE_MODE * len(stiffness) * singular[0])


def elements_of(mass: Floats, damping: Floats, stiffness: Floats) -> Elements:
    """Return the elements of matrices (N, N): one for every entry that is not 0 in one of them."""
    rows, columns = np.nonzero((mass != 0.0) | (damping != 0.0) | (stiffness != 0.0))
    ground = np.full(len(rows), len(mass))
    return Elements(
        stretched_by=np.column_stack((columns, ground)),
        acts_on=np.column_stack((rows, ground)),
        mass=mass[rows, columns],
        damping=damping[rows, columns],
        stiffness=stiffness[rows, columns],
        reach=int(np.max(np.abs(rows - columns), initial=0)),
        elongations=False,
    )


def _square(name: str, values: Matrix, count: int | None) -> Floats:
    """Return the numbers as a new array of shape (N, N), or raise ParameterError."""
    array = np.array(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[0] != array.shape[1] or array.size == 0:
        raise ParameterError(name, "must be a square matrix, a list of N lists of N numbers")
    if count is not None and len(array) != count:
        raise ParameterError(name, f"has {len(array)} rows and mass has {count}")
    size = np.abs(array[array != 0.0])
    if not np.all((size >= SMALLEST_NUMBER) & (size <= LARGEST_NUMBER)):
        raise ParameterError(
            name, f"every number must be 0 or between {SMALLEST_NUMBER:g} and {LARGEST_NUMBER:g} in size"
        )
    return array

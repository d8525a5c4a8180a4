"""What the modal model needs to know of a linear structure ``M x'' + C x' + K x = 0``.

A structure has *coordinates* of its own, N for the positions and the N velocities, in which its equations of motion
have no coefficient that is not given: for a chain the elongations of its links, else the displacements themselves. A
decomposition into blocks is refined in these.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.model.kernels.elements import Elements, invariance_residual
from grazemap_core.model.kernels.steady_response import steady_amplitudes
from grazemap_core.records import ABC, NamedTuple


class Response(NamedTuple):
    """The steady motion at n frequencies."""

    amplitudes: Complexes
    """(n, N) Of the displacements, x(t) = Im(amplitude e^{i w t})."""
    coordinate: Complexes
    """(n,) Amplitudes of one coordinate."""
    exists: Booleans
    """(n,) False at a resonance with no damping or too little."""


class Structure(ABC):
    """A linear structure with N degrees of freedom."""

    @property
    @abstractmethod
    def size(self) -> int:
        """Number of degrees of freedom N."""

    @property
    @abstractmethod
    def mass_matrix(self) -> Floats:
        """M, shape (N, N), symmetric and positive definite."""

    @property
    @abstractmethod
    def damping_matrix(self) -> Floats:
        """C, shape (N, N)."""

    @property
    @abstractmethod
    def stiffness_matrix(self) -> Floats:
        """K, shape (N, N)."""

    @property
    @abstractmethod
    def elements(self) -> Elements:
        """The elements whose sum the structure is: given masses, dampings and stiffnesses."""

    def mass_norms(self, vectors: Floats) -> Floats:
        """Return ``sqrt(x^T M x)`` of every column of vectors (N, m), shape (m,)."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->j", vectors, self.mass_matrix @ vectors)))

    def row_of_coordinates(self, row: Floats) -> Floats | None:
        """Return a row (N,) on displacements as one on the coordinates, where these round it less; else None."""
        return None

    @abstractmethod
    def solve_mass(self, vectors: Floats) -> Floats:
        """Return ``M^-1 vectors``, shape (N,) or (N, m)."""

    def effective_mass(self, row: Floats) -> float:
        """Return ``1/(h^T M^-1 h)`` for a row h (N,): the mass that an impulse along the stop meets."""
        return float(1.0 / (row @ self.solve_mass(row)))

    @abstractmethod
    def ground_forces(self, influence: Floats) -> tuple[Floats, Floats]:
        """Return ``K r`` and ``C r``, (N,) each: the forces on the structure at rest by a ground that moves.

        A unit displacement of the ground moves the free structure by r = `influence`.
        """

    def response(self, frequencies: Floats, forces: Complexes, row: Floats) -> Response:
        """Return the steady response to forces ``Im(f e^{i w t})``, accurate also at sharp resonances.

        Parameters
        ----------
        frequencies : ndarray of shape (n,)
            w > 0.
        forces : ndarray of complex, shape (n, N)
            f at every frequency.
        row : ndarray of shape (N,)
            The coordinate ``row x`` has an error of about one rounding.
        """
        frequencies, row = np.ascontiguousarray(frequencies), np.ascontiguousarray(row)
        return Response(*steady_amplitudes(self.elements, frequencies, np.ascontiguousarray(forces), row))

    @abstractmethod
    def undamped(self) -> Structure:
        """Return the structure without damping."""

    @abstractmethod
    def energy_matrix(self) -> Floats:
        """Return A of ``z' = A z``, shape (2N, 2N); half of ``|z|^2`` is the energy of a state z of undamped motion."""

    @abstractmethod
    def from_energy(self) -> Floats:
        """Return the matrix that takes z of `energy_matrix` to the coordinates, shape (2N, 2N)."""

    @abstractmethod
    def weighted(self, columns: Floats) -> Floats:
        """Return columns of coordinates (2N, m) in energy units, in which every row has a comparable size."""

    @abstractmethod
    def unweighted(self, columns: Floats) -> Floats:
        """Return the inverse of `weighted`."""

    @abstractmethod
    def displacements(self, columns: Floats) -> Floats:
        """Return the displacements (N, m) of columns of coordinates (2N, m)."""

    @abstractmethod
    def rows_of_states(self, rows: Floats) -> Floats:
        """Return rows (m, 2N) that act on weighted coordinates as rows that act on displacements and velocities."""

    def invariance_residual(self, columns: Floats, frequency_squared: Floats, decay: Floats) -> Floats:
        """Return ``A X - X T`` in coordinates, computed in double-double, shape (2N, 2N).

        T holds the companion blocks ``[[0, 1], [-frequency_squared, -2 decay]]``, and X is `columns`.
        """
        count = self.size
        residual, momentum = np.empty((2 * count, 2 * count)), np.empty((count, 2))
        columns = np.ascontiguousarray(columns)
        invariance_residual(self.elements, columns, frequency_squared, decay, momentum, residual)
        residual[count:] = self.solve_mass(residual[count:])
        return residual

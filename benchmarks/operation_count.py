"""The minimum number of double-precision operations of the lockstep scheme for one forcing period of one trajectory.

The scheme: the state is N blocks (u, u'), advanced from cell to cell by constant factors; a bound from x1 and v1 at
both ends of a cell clears it; an impact is one polynomial of fixed degree, a start of degree five, two steps of
Halley's method, the kick carried to the end of the cell, and the certificates on both sides of it.

One operation is one fused multiply-add, or one addition, multiplication, comparison or division where nothing can be
fused: each takes one slot of the pipes whose peak `peak` measures. Loads, stores, gathering and what a lane waits for
its neighbours are not counted, so the count is a lower bound and the rate that follows from it an upper one, for this
scheme with these numbers of cells and degree.
"""

from __future__ import annotations

from dataclasses import dataclass

START = 80
"""Side, gap and slope at both ends and at mid-cell, the quadratic's root, two steps on the polynomial through them."""
IMPACT_LAW = 20
"""Step, speed, velocity jump, contact acceleration, and the certificate before the impact."""
CERTIFICATES = 40
"""The rest of the cell, the other stop, the next cell, coming to rest; that there is no contact at all."""


@dataclass(frozen=True)
class Scheme:
    """Size of the problem: masses N, degree of the series, cells per forcing period."""

    masses: int
    degree: int
    cells: int

    @property
    def per_cell(self) -> int:
        """Operations to carry one lane over one cell and to clear it."""
        advance = 4 * self.masses  # a matrix of two rows, per block
        return advance + self._position_and_velocity + self._cell_test

    @property
    def per_impact(self) -> int:
        """Operations of one impact, on top of its cell."""
        series = (2 * self.masses + 1) * (self.degree + 1)  # coefficients of x1
        free_end = 4 * self.masses + self._position_and_velocity + self._bounds
        first = 2 * self.degree + 8  # value and slope together; the step, the bend being that of the start
        second = 3 * self.degree + 5  # value, slope and bend together; the step
        kick = 2 * self.masses * (self.degree + 1)  # what it amounts to at the end of the cell
        end = self._position_and_velocity + self._bounds
        return series + free_end + START + first + second + IMPACT_LAW + kick + end + CERTIFICATES

    def per_period(self, impacts: float) -> float:
        """Operations of one forcing period with so many impacts."""
        return self.cells * self.per_cell + impacts * self.per_impact

    @property
    def _position_and_velocity(self) -> int:
        """Both are weighed sums of all 2 N parts."""
        return 4 * self.masses

    @property
    def _bounds(self) -> int:
        """Envelope of every block, and what it adds to two bounds."""
        return 4 * self.masses

    @property
    def _cell_test(self) -> int:
        """Two control points, three maxima, one comparison; the remainder is in the limit that is compared with."""
        return 6

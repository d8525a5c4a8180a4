"""How many double-precision operations the lockstep scheme needs, at least, for one forcing period of one trajectory.

The scheme: the state is N complex modal amplitudes, advanced from cell to cell by constant factors; a bound from x1 and
v1 at both ends of a cell clears it; an impact is one polynomial of fixed degree, a quadratic start, four Newton steps,
the jump and the rest of the cell. One operation is one fused multiply-add, or one addition, multiplication, comparison
or division where nothing can be fused: each takes one slot of the pipes whose peak `peak` measures. Loads, stores,
gathering and what a lane waits for its neighbours are not counted, so the count is a lower bound and the rate that
follows from it an upper one, for this scheme with these numbers of cells and degree.
"""

from __future__ import annotations

from dataclasses import dataclass

NEWTON_STEPS = 4


@dataclass(frozen=True)
class Scheme:
    """Size of the problem: masses N, degree of the series, cells per forcing period."""

    masses: int
    degree: int
    cells: int

    @property
    def per_cell(self) -> int:
        """Operations to carry one lane over one cell and to clear it."""
        advance = 4 * self.masses  # complex times complex, per mode
        return advance + self._position_and_velocity + self._cell_test

    @property
    def per_impact(self) -> int:
        """Operations of one impact, on top of its cell."""
        series = (2 * self.masses + 1) * (self.degree + 1)  # coefficients of the distance to the stop
        start = 2 * self.degree + 10  # the distance at the middle and at the end, then the parabola's root
        newton = NEWTON_STEPS * (2 * self.degree + 2)  # value and slope together, a quotient and a difference
        speed = 2 * self.degree + 1
        rest_of_cell = 2 * self.masses * self.degree  # the factor of every mode for what is left of the cell
        jump = 3 * self.masses + 2
        bound = 3 * self.masses  # the bound of the fourth derivative, anew
        return (
            series + start + newton + speed + rest_of_cell + jump + bound
            + self._position_and_velocity + self._cell_test
        )  # fmt: skip

    def per_period(self, impacts: float) -> float:
        """Operations of one forcing period with so many impacts."""
        return self.cells * self.per_cell + impacts * self.per_impact

    @property
    def _position_and_velocity(self) -> int:
        """x1 adds up N amplitudes, v1 weighs their 2 N parts."""
        return 3 * self.masses

    @property
    def _cell_test(self) -> int:
        """Two control points, three maxima, the remainder added, one comparison."""
        return 7

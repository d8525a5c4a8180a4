"""The point at which a branch ends on another one: at a PD its halves become equal, at an SB each other's mirror image.

On the branch that ends there the equations are singular: the other branch has a tangent there too. On the other branch,
of which a half of each orbit is an orbit, the point is a regular zero of the doubling test, so it is solved for there.
The half of the orbits' period leads from each of them to another orbit of the branch, with the halves exchanged. So
beyond the point the branch is the same one again, and the difference of the halves has the other sign: that, and no
size of it, tells such a point from a fold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.orbits.family import OrbitFamily


@dataclass(frozen=True, eq=False)
class Halves:
    """How the orbits of a path are made of two halves with the impacts of one orbit of the other branch.

    Attributes
    ----------
    path : ContinuationProblem
    sign : float
        1: the second half is on the stops of the first, half the period later; -1: on the opposite ones.
    """

    path: ContinuationProblem
    sign: float

    @classmethod
    def of(cls, path: ContinuationProblem, unknowns: Floats) -> Halves | None:
        """Return those of the path at a point, or None where its orbits have none."""
        pattern, stops = path.family.pattern, path.stops
        count, rest = divmod(len(stops), 2)
        sign = 1.0 if pattern.multiple % 2 == 0 else -1.0
        if rest or pattern.symmetric or not np.array_equal(stops[count:], sign * stops[:count]):
            return None
        return cls(path, sign) if sign > 0.0 or path.gaps(unknowns).symmetric else None

    def mean(self, unknowns: Floats) -> Floats:
        """Return the mean of both halves, as unknowns of the other branch."""
        return np.append(np.mean(self._each(unknowns), axis=0), unknowns[2 * self.path.count :])

    def difference(self, unknowns: Floats) -> Floats:
        """Return the second half less the first one, phases and speeds."""
        first, second = self._each(unknowns)
        return np.asarray(second - first)

    def doubled(self, unknowns: Floats) -> Floats:
        """Return an orbit of the other branch, as unknowns of this one."""
        count = self.path.count // 2
        phases, speeds = unknowns[:count], unknowns[count : 2 * count]
        later = phases + 0.5 * self.path.family.turn
        return np.concatenate([phases, later, speeds, self.sign * speeds, unknowns[2 * count :]])

    def other(self) -> ContinuationProblem:
        """Return the path of the other branch, in the same units."""
        path, pattern = self.path, self.path.family.pattern
        period = pattern.multiple // 2 if self.sign > 0.0 else pattern.multiple
        family = OrbitFamily.of(path.family.oscillator, period, symmetric=self.sign < 0.0)
        stops = path.stops[: path.count // 2].astype(np.int64)
        return ContinuationProblem(family, stops, path.parameters, path.fixed)

    def _each(self, unknowns: Floats) -> Floats:
        """Return the phases and speeds (2, k) of both halves, those of the second one as those of the first."""
        count = self.path.count
        phases, speeds = unknowns[:count].reshape(2, -1).copy(), unknowns[count : 2 * count].reshape(2, -1).copy()
        phases[1] -= 0.5 * self.path.family.turn
        speeds[1] *= self.sign
        return np.concatenate([phases, speeds], axis=1)

"""Where a branch ends on another one, and the orbit there.

At a PD the two halves of its orbits become equal, at an SB each other's mirror image. On the branch that ends there the
equations are singular: the other branch has a tangent there too. On the other branch, of which a half of each orbit is
an orbit, the point is a regular zero of the doubling test, so it is solved for there. The half of the orbits' period
leads from each of them to another orbit of the branch, with the halves exchanged. So beyond the point the branch is the
same one again, and the difference of the halves has the other sign: that, and no size of it, tells such a point from a
fold.

At a GR impacts that follow each other on one stop come together, and their velocities vanish together: after an impact
of velocity v the contact, pressed against the stop with the acceleration a, meets it again after the time 2 R v/a, with
the velocity R v. The equations are singular there, as two equal impacts of velocities v and -R v solve them too. With
one of the impacts alone they are regular, and the point is a graze, so it is solved for there.
"""

from __future__ import annotations

import numpy as np

from grazemap_core.arrays import Floats
from grazemap_core.continuation.continuation_problem import ContinuationProblem
from grazemap_core.continuation.tolerances import GRAZE_MARGIN, MIN_TANGENT_COSINE
from grazemap_core.grazing.one_impact_family import Pattern
from grazemap_core.records import dataclass


@dataclass(frozen=True, eq=False)
class Halves:
    """How the orbits of a path are made of two halves with the impacts of one orbit of the other branch."""

    path: ContinuationProblem
    """The path whose orbits these are."""
    sign: float
    """1: the second half is on the stops of the first, half the period later; -1: on the opposite ones."""

    @classmethod
    def of(cls, path: ContinuationProblem, unknowns: Floats) -> Halves | None:
        """Return those of the path at a point, or None where its orbits have none."""
        pattern, sides = path.pattern, path.sides
        count, rest = divmod(len(sides), 2)
        sign = 1.0 if pattern.multiple % 2 == 0 else -1.0
        if rest or pattern.symmetric or not np.array_equal(sides[count:], sign * sides[:count]):
            return None
        return cls(path, sign) if sign > 0.0 or path.stops(unknowns).symmetric else None

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
        later = phases + 0.5 * self.path.turn
        return np.concatenate([phases, later, speeds, self.sign * speeds, unknowns[2 * count :]])

    def other(self) -> ContinuationProblem:
        """Return the path of the other branch, in the same units."""
        path, multiple = self.path, self.path.pattern.multiple
        pattern = Pattern(multiple // 2, symmetric=False) if self.sign > 0.0 else Pattern(multiple, symmetric=True)
        return path.along_with(pattern, path.sides[: path.count // 2])

    def _each(self, unknowns: Floats) -> Floats:
        """Return the phases and speeds (2, k) of both halves, those of the second one as those of the first."""
        count = self.path.count
        phases, speeds = unknowns[:count].reshape(2, -1).copy(), unknowns[count : 2 * count].reshape(2, -1).copy()
        phases[1] -= 0.5 * self.path.turn
        speeds[1] *= self.sign
        return np.concatenate([phases, speeds], axis=1)


@dataclass(frozen=True, eq=False)
class Meeting:
    """An orbit at which impacts that follow each other on one stop come together, with velocity 0."""

    unknowns: Floats
    """(2 k + p,) That orbit, as unknowns of the path."""
    beside: Floats
    """(2 k + p,) An orbit of the branch just before it, likewise."""
    impact: int
    """Index of the first of these impacts."""

    @classmethod
    def between(cls, path: ContinuationProblem, here: Floats, step: Floats) -> Meeting | None:
        """Return the meeting between an orbit of a branch and the end of a step along its tangent, or None.

        The step exchanges the order of these impacts, and its direction is as close to the way there as that of any
        other step of a branch.
        """
        count, turn = path.count, path.turn
        now, then = (np.diff(values[:count], append=values[0] + turn) for values in (here, here + step))
        meets = then <= 0.0
        first = np.flatnonzero(meets & ~np.roll(meets, 1))
        if len(first) != 1:
            return None
        impact = int(first[0])
        others = (impact + 1 + np.arange(np.sum(meets))) % count
        if np.any(path.sides[others] * np.where(others < impact, path.mirror, 1.0) != path.sides[impact]):
            return None
        guess, normal = here + now[impact] / (now[impact] - then[impact]) * step, np.eye(len(here))[count + impact]
        guess[count + impact] = 0.0
        kept = np.delete(np.arange(len(here)), [*others, *(count + others)])
        alone = path.along_with(path.pattern, np.delete(path.sides, others))
        solution = alone.correct(guess[kept], normal[kept])
        if solution is None:
            return None
        unknowns = np.zeros(len(here))
        unknowns[kept] = solution[0]
        unknowns[others] = unknowns[impact] - np.where(others < impact, turn, 0.0)
        way, along = unknowns - here, step / np.linalg.norm(step)
        if float(way @ along) < MIN_TANGENT_COSINE * float(np.linalg.norm(way)):
            return None
        beside = path.correct(here + (1.0 - GRAZE_MARGIN) * way, along)
        return None if beside is None else cls(unknowns, beside[0], impact)

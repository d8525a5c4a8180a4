"""A structure as the sum of its elements, and the residual of its decomposition into blocks, in double-double.

The mass, the damping and the stiffness of an element are given numbers, so nothing is rounded before a residual is
formed. In a stiff chain neighbours move almost together: their difference, the stretch of a link, is formed in
double-double before it is multiplied.
"""

from __future__ import annotations

from grazemap_core.arrays import Floats, Integers
from grazemap_core.numerics.jit.compiled import inlined, kernel
from grazemap_core.numerics.kernels.double_double import Pair, add, negative, scale, two_prod, two_sum
from grazemap_core.records import NamedTuple


class Elements(NamedTuple):
    """The E elements of a structure.

    The force of an element is ``m d'' + c d' + k d`` with d its stretch, the difference of two displacements. It is
    subtracted from the forces on one coordinate and added to those on another. N stands for the ground.
    """

    stretched_by: Integers
    """(E, 2) The two displacements, in increasing order."""
    acts_on: Integers
    """(E, 2) The two coordinates."""
    mass: Floats
    """(E,) m."""
    damping: Floats
    """(E,) c."""
    stiffness: Floats
    """(E,) k."""
    reach: int
    """Largest ``|i - j|`` with a force on coordinate i by displacement j."""
    elongations: bool
    """Whether the structure's own coordinates (`Structure`) are ``x_i - x_{i+1}``, x_{N+1} = 0; else they are x_i."""


@inlined
def _stretch_rate(columns: Floats, column: int, i: int, j: int, ground: int) -> Pair[float]:
    """Return the velocity i minus the velocity j, of states in `columns`; that of the ground is 0."""
    return two_sum(columns[ground + i, column], -columns[ground + j, column] if j < ground else 0.0)


@inlined
def _stretch(elongations: bool, columns: Floats, column: int, i: int, j: int, ground: int) -> Pair[float]:
    """Return the displacement i minus the displacement j, i < j, of states in `columns`; that of the ground is 0."""
    if not elongations:
        return two_sum(columns[i, column], -columns[j, column] if j < ground else 0.0)
    total = Pair(columns[i, column], 0.0)
    for between in range(i + 1, j):
        total = add(total, Pair(columns[between, column], 0.0))
    return total


@inlined
def _by_blocks(columns: Floats, row: int, column: int, frequency_squared: Floats, decay: Floats) -> Pair[float]:
    """Return an entry of ``X T``; see `invariance_residual`."""
    block = column // 2
    if column == 2 * block:
        return two_prod(columns[row, column + 1], -frequency_squared[block])
    return add(two_prod(columns[row, column], -2.0 * decay[block]), Pair(columns[row, column - 1], 0.0))


@kernel
def invariance_residual(
    elements: Elements, columns: Floats, frequency_squared: Floats, decay: Floats, momentum: Floats, residual: Floats
) -> None:
    """Write ``A X - X T``, where T holds the companion blocks ``[[0, 1], [-frequency_squared, -2 decay]]``.

    Parameters
    ----------
    elements : Elements
    columns : (2N, 2N)
        X; rows are the structure's coordinates, then velocities, columns are (a_1, b_1, a_2, b_2, ...): the state is
        ``a u + b u'``.
    frequency_squared, decay : (N,)
    momentum : (N, 2)
        Scratch.
    residual : (2N, 2N)
        The result; the rows of velocities are multiplied by M.
    """
    count = decay.size
    for column in range(2 * count):
        for i in range(count):
            rate = _stretch_rate(columns, column, i, i + 1 if elements.elongations else count, count)
            rest = add(rate, negative(_by_blocks(columns, i, column, frequency_squared, decay)))
            residual[i, column] = rest.high + rest.low
            momentum[i, 0], momentum[i, 1] = 0.0, 0.0
        for e in range(elements.mass.size):
            i, j = elements.stretched_by[e, 0], elements.stretched_by[e, 1]
            force = Pair(0.0, 0.0)
            if elements.stiffness[e] != 0.0:
                force = scale(_stretch(elements.elongations, columns, column, i, j, count), elements.stiffness[e])
            if elements.damping[e] != 0.0:
                force = add(force, scale(_stretch_rate(columns, column, i, j, count), elements.damping[e]))
            if elements.mass[e] != 0.0:
                change = _by_blocks(columns, count + i, column, frequency_squared, decay)
                if j < count:
                    change = add(change, negative(_by_blocks(columns, count + j, column, frequency_squared, decay)))
                force = add(force, scale(change, elements.mass[e]))
            for side in range(2):
                on = elements.acts_on[e, side]
                if on < count:
                    momentum[on, 0], momentum[on, 1] = add(Pair(momentum[on, 0], momentum[on, 1]), negative(force))
                force = negative(force)
        for i in range(count):
            residual[count + i, column] = momentum[i, 0] + momentum[i, 1]

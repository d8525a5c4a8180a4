"""Basin fractions: the shares of random initial states that lead to each attractor, along one parameter.

The same states are run at every value of the parameter. `fraction_tile` finds their motions, value by value;
`basin_fractions` identifies the attractors and follows them along the parameter.

An attractor keeps its number from value to value while it keeps its name: the kind of the motion, its period, its
impacts, whether it is symmetric and whether it rests on a stop. Several attractors of one name are matched with those
seen before, each where it was found last, such that the sum of the squared distances between their means is minimal
(Datseris, Rossi & Wagemakers match by distances). The means are those of the contact coordinate, measured from the
steady motion, and of its rate at the initial phase of the forcing, in units of the clearance and of omega times the
clearance. An attractor without a match has a new number. So a period doubling begins new numbers, and a number does not
say that two motions are on one branch: that is a question for continuation.

References
----------
P. J. Menck, J. Heitzig, N. Marwan, J. Kurths, How basin stability complements the linear-stability paradigm, Nature
Physics 9 (2013) 89-92.
G. Datseris, K. L. Rossi, A. Wagemakers, Framework for global stability analysis of dynamical systems, Chaos 33 (2023)
073151.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.contact.stops import both_clearances
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.maps.basins import Attractor, attractors, check_limits, motions_from
from grazemap_core.maps.map_settings import RunSettings
from grazemap_core.maps.planes import ParameterLine, Point
from grazemap_core.maps.runner import Runners
from grazemap_core.maps.samples import binomial_error
from grazemap_core.maps.tolerances import MOST_DRAWS
from grazemap_core.maps.unfolding import NAME
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator


class StateRanges(NamedTuple):
    """The ranges of initial states."""

    displacement: Floats
    """(N, 2) The smallest and the largest displacement of each degree of freedom."""
    velocity: Floats
    """(N, 2) The smallest and the largest velocity of each degree of freedom."""


@dataclass(frozen=True, eq=False)
class BasinFractions:
    """The attractors along a parameter with n values, a of them, in the order in which they are met."""

    attractors: list[Attractor]
    """Each as it is at the first value where it was found."""
    states: Integers
    """(a, n) Number of initial states that lead to it at each value; 0 where it was not found."""
    share: Floats
    """(a, n) states/s, for s initial states."""
    share_error: Floats
    """(a, n) Its binomial standard error, ``sqrt(share (1 - share)/s)``."""
    mean_position: Floats
    """(a, n) As of an `Attractor`; NaN where the attractor was not found, or where the number is not known."""
    mean_velocity: Floats
    """(a, n) As `mean_position`."""
    multiplier: Floats
    """(a, n) As `mean_position`."""
    lyapunov: Floats
    """(a, n) As `mean_position`."""
    verified: Booleans
    """(a, n) Whether it is verified from every state that leads to it."""
    unresolved: Floats
    """(n,) Share of the states whose motion is unresolved."""
    unresolved_error: Floats
    """(n,) Standard error of this share."""
    sensitive: Floats
    """(n,) Share of the states that are sensitive."""


def points_along(line: ParameterLine) -> list[Point]:
    """Return what is simulated at each value of a line."""
    return [line.point(index) for index in range(len(line.axis.values))]


@in_own_period
def ranges_of(points: Sequence[Point], displacement: ArrayLike | None, velocity: ArrayLike | None) -> StateRanges:
    """Return the ranges of initial states, with those that are left out.

    Parameters
    ----------
    points : sequence of Point
    displacement, velocity : (N, 2)
        Left out: the equilibrium (without stops, at the first point) plus or minus c/max |h|, and plus or minus omega
        times as much: h is the contact row, omega the smallest one, and c the smallest distance of a stop from the
        middle between both, or of a single stop from the equilibrium.

    Raises
    ------
    ParameterError
        There are not N pairs of increasing or equal finite numbers, or a single stop touches the structure in its
        equilibrium, and the ranges are left out.
    """
    first = points[0].oscillator
    pairs = (("displacement", displacement), ("velocity", velocity))
    half = 0.0 if all(value is not None for _, value in pairs) else _half_range(points)
    omega, at_rest = min(point.omega for point in points), equilibrium(first)[:, None]
    others = (at_rest + np.array([-half, half]), np.tile(omega * np.array([-half, half]), (first.size, 1)))
    return StateRanges(*(_range(*pair, first.size, other) for pair, other in zip(pairs, others, strict=True)))


def random_states(points: Sequence[Point], ranges: StateRanges, count: int, seed: int) -> Floats:
    """Return initial states (count, 2, N), displacements and velocities, uniform in the ranges.

    Of those only such states whose contact is between the stops, and not on them, at every point.

    Raises
    ------
    ParameterError
        Less than about one state in MOST_DRAWS is between the stops.
    """
    checked_order("states", count, 1)
    right, left = np.min([both_clearances(point.clearance) for point in points], axis=0)
    rows = {id(point.oscillator): point.oscillator.contact for point in points}.values()
    low, high = (np.stack([ranges.displacement[:, end], ranges.velocity[:, end]]) for end in (0, 1))
    random, tried, kept_count, kept = np.random.default_rng(seed), 0, 0, []
    while kept_count < count:
        drawn = random.uniform(low, high, (count, *low.shape))
        place = np.stack([drawn[:, 0] @ row for row in rows])
        kept.append(drawn[np.all((-left < place) & (place < right), axis=0)])
        tried, kept_count = tried + count, kept_count + len(kept[-1])
        if tried > MOST_DRAWS * (kept_count + 1):
            raise ParameterError("displacement", "the ranges hardly have a state with the contact between the stops")
    return np.concatenate(kept)[:count]


@in_own_period
def fraction_tile(
    points: Sequence[Point], states: Floats, phase: float = 0.0, max_periods: int = 1000, max_period: int = 32
) -> dict[str, NDArray[Any]]:
    """Find the motion that trajectories settle to from every state, at every point.

    Points and states are computed independently, so tiles of either have the bytes of the whole.

    Parameters
    ----------
    points : sequence of n Point
    states : (s, 2, N)
        From `random_states`.
    phase : float
        Phase of the forcing at the start, radians.
    max_periods, max_period : int
        As in `map_settings.MapSettings`.

    Returns
    -------
    dict of arrays of shape (n, s)
        The arrays of `basins.basin_tile`.
    """
    check_limits(phase, max_periods, max_period)
    motions, runners = [], Runners(RunSettings(max_periods, max_period))
    for point in points:
        forced = forced_oscillator(*point)
        motions.append(motions_from(runners.of(point.oscillator), forced, *from_rest(forced, states), phase))
    return {name: np.stack([of_point[name] for of_point in motions]) for name in motions[0]}


def from_rest(forced: ForcedOscillator, states: Floats) -> tuple[Floats, Floats]:
    """Return the state at rest (2, N), and what states (s, 2, N) add to it."""
    rest = np.stack([forced.displacement_at_rest, np.zeros_like(forced.displacement_at_rest)])
    return rest, states - rest


def basin_fractions(arrays: dict[str, NDArray[Any]]) -> BasinFractions:
    """Return the attractors along a parameter, and the shares of the states that lead to them.

    Parameters
    ----------
    arrays : dict of arrays of shape (n, s)
        From `fraction_tile`, of all values and states, the values in order.
    """
    every: list[Attractor] = []
    last: list[Attractor] = []
    rows: list[dict[int, Attractor]] = []
    for k in range(len(arrays["kind"])):
        candidates = attractors({name: values[k] for name, values in arrays.items()})[1]
        numbers = matched(candidates, last)
        last += [attractor for attractor, number in zip(candidates, numbers, strict=True) if number >= len(last)]
        every += last[len(every) :]
        rows.append(dict(zip(numbers, candidates, strict=True)))
        for number, attractor in rows[-1].items():
            last[number] = attractor
    values, states = arrays["kind"].shape
    count = np.zeros((len(every), values), dtype=np.int64)
    verified = np.zeros(count.shape, dtype=np.bool_)
    names = ("mean_position", "mean_velocity", "multiplier", "lyapunov")
    figures = {name: np.full(count.shape, np.nan) for name in names}
    for k, row in enumerate(rows):
        for number, attractor in row.items():
            count[number, k], verified[number, k] = attractor.states, attractor.verified
            for name, array in figures.items():
                figure = getattr(attractor, name)
                array[number, k] = np.nan if figure is None else figure
    share, unresolved = count / states, np.mean(arrays["kind"] == KINDS.index("unresolved"), axis=1)
    return BasinFractions(
        attractors=every,
        states=count,
        share=share,
        share_error=binomial_error(share, states),
        **figures,
        verified=verified,
        unresolved=unresolved,
        unresolved_error=binomial_error(unresolved, states),
        sensitive=np.mean(arrays["sensitive"], axis=1),
    )


def matched(candidates: Sequence[Attractor], known: Sequence[Attractor]) -> list[int]:
    """Return the number of each attractor found at a value: its position among the known ones, or a new one.

    Parameters
    ----------
    candidates : sequence of Attractor
        Those found at the value.
    known : sequence of Attractor
        Those found before, each where it was found last.
    """
    numbers, new = [-1] * len(candidates), len(known)
    for name in {_name(attractor): None for attractor in candidates}:
        ours = [i for i, attractor in enumerate(candidates) if _name(attractor) == name]
        theirs = [j for j, attractor in enumerate(known) if _name(attractor) == name]
        between = np.array([[_squared(candidates[i], known[j]) for j in theirs] for i in ours]).reshape(len(ours), -1)
        for i, j in zip(*linear_sum_assignment(between), strict=True):
            numbers[ours[i]] = theirs[j]
    for i, number in enumerate(numbers):
        if number < 0:
            numbers[i], new = new, new + 1
    return numbers


def _name(attractor: Attractor) -> tuple[Any, ...]:
    return tuple(getattr(attractor, name) for name in NAME)


def _squared(attractor: Attractor, other: Attractor) -> float:
    """Return the squared distance between the means of two attractors of one name; 0 unless they are periodic."""
    if attractor.mean_position is None or attractor.mean_velocity is None:
        return 0.0
    assert other.mean_position is not None  # as they have one name
    assert other.mean_velocity is not None
    return (attractor.mean_position - other.mean_position) ** 2 + (attractor.mean_velocity - other.mean_velocity) ** 2


def _half_range(points: Sequence[Point]) -> float:
    """Return half the width of the ranges of displacements that are left out."""
    halves = []
    for oscillator, _, clearance in points:
        right, left = both_clearances(clearance)
        half = 0.5 * (right + left)
        if not np.isfinite(half):
            place = float(oscillator.contact @ equilibrium(oscillator))
            half = min(abs(right - place), abs(left + place))
        halves.append(half / np.max(np.abs(oscillator.contact)))
    half = min(halves)
    if not half > 0.0:
        raise ParameterError("displacement", "must be given where the only stop touches the structure at rest")
    return float(half)


def _range(name: str, ends: ArrayLike | None, size: int, otherwise: Floats) -> Floats:
    if ends is None:
        return otherwise
    array = np.array(ends, dtype=np.float64)
    if array.shape != (size, 2) or not np.all(np.isfinite(array)) or np.any(array[:, 1] < array[:, 0]):
        raise ParameterError(name, "must be a pair of numbers per mass, the second not below the first")
    return array

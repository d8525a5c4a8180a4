"""Basins of attraction: the motion that every initial state of a rectangle leads to, at one omega and clearance.

`basin_tile` finds the motions of one tile of a rectangle of two initial coordinates. `attractors` takes the arrays of
all tiles and returns the attractors, and which state leads to which.
"""

from __future__ import annotations

import math
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from grazemap_core.arrays import Floats, Integers
from grazemap_core.contact.stops import Clearance
from grazemap_core.errors import ParameterError, checked_order
from grazemap_core.maps.kernels.lane_state import MEAN_POSITION, MEAN_VELOCITY
from grazemap_core.maps.map_settings import BetweenStops, RunSettings
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.unfolding import NAME, arrays_of
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.own_period import in_own_period
from grazemap_core.records import NamedTuple, dataclass
from grazemap_core.simulation.motion import KINDS
from grazemap_core.simulation.start import ForcedOscillator, forced_oscillator
from grazemap_core.simulation.tolerances import LIMIT_DISTANCE, SEPARATION

Name = Literal["displacement", "velocity"]
_NAMES: Final = ("displacement", "velocity")


class Coordinate(NamedTuple):
    """One of the two coordinates of the rectangle."""

    name: Name
    """What varies."""
    mass: int
    """The degree of freedom, 1 to N."""
    values: Floats
    """(n,) Values in the oscillator's units."""


@dataclass(frozen=True)
class Attractor:
    """A motion to which initial states of the rectangle lead."""

    kind: str
    """One of `motion.KINDS`. Each kind that is not periodic has one entry for all its motions."""
    period: int | None
    """As in `unfolding.unfolding_map_tile`; None unless periodic."""
    impacts_right: int | None
    """As in `unfolding.unfolding_map_tile`; None unless periodic."""
    impacts_left: int | None
    """As in `unfolding.unfolding_map_tile`; None unless periodic."""
    symmetric: bool | None
    """As in `unfolding.unfolding_map_tile`; None unless periodic."""
    sticking: bool | None
    """As in `unfolding.unfolding_map_tile`; None unless periodic."""
    mean_position: float | None
    """Mean of the contact coordinate minus the steady motion, at the initial phase of the forcing, in units of the
    clearance. With `mean_velocity` it distinguishes motions of the same name, such as mirror images."""
    mean_velocity: float | None
    """Mean of the velocity of the contact minus that of the steady motion, at this phase, in units of omega times the
    clearance."""
    multiplier: float
    """Largest modulus of the multipliers over a period; NaN for motions that are not periodic."""
    lyapunov: float
    """Largest exponent per forcing period; for motions that are not periodic, the mean over the states that lead
    there."""
    verified: bool
    """Whether the motion is periodic and was verified from every state that leads there."""
    states: int
    """Number of states that lead there."""
    share: float
    """Fraction of all states."""


@in_own_period
def basin_tile(
    oscillator: Oscillator,
    omega: float,
    clearance: Clearance,
    horizontal: Coordinate,
    vertical: Coordinate,
    displacement: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    phase: float = 0.0,
    max_periods: int = 1000,
    max_period: int = 32,
) -> dict[str, NDArray[Any]]:
    """Find the motion that trajectories settle to from every state of a rectangle.

    Every state is computed independently, so a rectangle cut into tiles gives the same bytes.

    Parameters
    ----------
    omega : float
        > 0.
    clearance : float, or (float or None, float or None)
        As in `trajectories.trajectory`.
    horizontal, vertical : Coordinate
        The two coordinates that vary; they must differ.
    displacement, velocity : (N,)
        All other coordinates, by default those of the static equilibrium at rest.
    phase : float
        Phase of the forcing at the start, radians.
    max_periods, max_period : int
        As in `map_settings.MapSettings`.

    Returns
    -------
    dict of arrays of shape (n, m), [vertical, horizontal]
        The arrays of `unfolding.unfolding_map_tile`; mean_position and mean_velocity (float64; NaN unless periodic).

    Raises
    ------
    ParameterError
        An argument is out of its domain, or the contact does not start between the stops.
    """
    forced = forced_oscillator(oscillator, float(omega), clearance)
    check_limits(phase, max_periods, max_period)
    state, added = initial_states(forced, horizontal, vertical, displacement, velocity)
    return motions_from(Runner(oscillator, RunSettings(max_periods, max_period)), forced, state, added, float(phase))


def check_limits(phase: float, max_periods: int, max_period: int) -> None:
    """Raise ParameterError for a phase that is not finite, and for limits below 1."""
    checked_order("max_periods", max_periods, 1)
    checked_order("max_period", max_period, 1)
    if not np.isfinite(phase):
        raise ParameterError("phase", "must be a finite number")


def motions_from(
    runner: Runner, forced: ForcedOscillator, state: Floats, added: Floats, phase: float
) -> dict[str, NDArray[Any]]:
    """Return the motions that trajectories settle to from states ``state + added``, as arrays of `basin_tile`.

    Arguments are those of `run_states`. The arrays have the shape of `added` without its last two axes.
    """
    shape = added.shape[:-2]
    codes, figures = run_states(runner, forced, state, added, phase)
    codes, figures = codes.T.reshape(-1, *shape), figures.T.reshape(-1, *shape)
    return arrays_of(codes, figures) | {
        "mean_position": figures[MEAN_POSITION].copy(),
        "mean_velocity": figures[MEAN_VELOCITY].copy(),
    }


def run_states(
    runner: Runner, forced: ForcedOscillator, state: Floats, added: Floats, phase: float
) -> tuple[Integers, Floats]:
    """Return codes (s, CODES) and figures (s, FIGURES) of trajectories from states ``state + added``.

    `runner` is of the oscillator of `forced`, `state` of shape (2, N), `added` (..., 2, N), with s states in all.
    """
    scaled = (added / forced.stops.unit).reshape(-1, *state.shape)
    start = BetweenStops(state, scaled)
    codes, figures = runner.run(forced.structure, np.array([forced.clearances]), start, phase)
    return codes[0], figures[0]


def initial_states(
    forced: ForcedOscillator,
    horizontal: Coordinate,
    vertical: Coordinate,
    displacement: ArrayLike | None,
    velocity: ArrayLike | None,
) -> tuple[Floats, Floats]:
    """Return a state (2, N) with 0 in the two coordinates that vary, and what to add for every state, (n, m, 2, N).

    Arguments and errors are those of `basin_tile`.
    """
    size = forced.oscillator.size
    state = np.stack([forced.displacement_at_rest, np.zeros(size)])
    for row, (name, values) in enumerate((("displacement", displacement), ("velocity", velocity))):
        if values is not None:
            numbers = np.asarray(values, dtype=np.float64)
            if numbers.shape != (size,) or not np.all(np.isfinite(numbers)):
                raise ParameterError(name, "must be one finite number per mass")
            state[row] = numbers
    indices = [_index(role, axis, size) for role, axis in (("horizontal", horizontal), ("vertical", vertical))]
    if indices[0] == indices[1]:
        raise ParameterError("vertical", "must differ from the horizontal coordinate")
    for index in indices:
        state[index] = 0.0
    across, up = (np.asarray(axis.values, dtype=np.float64) for axis in (horizontal, vertical))
    added = np.zeros((len(up), len(across), 2, size))
    added[:, :, *indices[0]] = across
    added[:, :, *indices[1]] = up[:, None]
    right, left = forced.clearances
    place = (state[0] + added[..., 0, :]) @ forced.oscillator.contact
    if not np.all((-left < place) & (place < right)):
        raise ParameterError("displacement", "of the contact must lie between the stops, and not on them")
    return state, added


def attractors(arrays: dict[str, NDArray[Any]]) -> tuple[NDArray[np.int16], list[Attractor]]:
    """Return the attractor that each state leads to, and the attractors, the most frequent first.

    Parameters
    ----------
    arrays : dict of arrays
        From `basin_tile`, of all states.

    Returns
    -------
    label : int16, of the shape of the arrays
        Position in the list; -1 for states whose motion is unresolved.
    attractors : list of Attractor
        Motions with the same name are one if their means agree to `SEPARATION` times the accuracy of a motion.

    Raises
    ------
    ParameterError
        There are more attractors than an int16 counts.
    """
    kind = arrays["kind"].ravel()
    keys = np.stack([arrays[name].ravel().astype(np.int64) for name in NAME], axis=1)
    means = np.stack([arrays[name].ravel() for name in ("mean_position", "mean_velocity")], axis=1)
    group = np.full(kind.size, -1, dtype=np.int64)
    count = 0
    for key in np.unique(keys[kind != KINDS.index("unresolved")], axis=0):
        members = np.flatnonzero(np.all(keys == key, axis=1))
        if key[0] != KINDS.index("periodic"):
            group[members] = count
            count += 1
            continue
        for cluster in _clusters(means[members]):
            group[members[cluster]] = count
            count += 1
    position = np.full(count + 1, -1, dtype=np.int16)
    if count > np.iinfo(position.dtype).max:
        raise ParameterError("states", f"lead to {count} different motions, more than {np.iinfo(position.dtype).max}")
    sizes = np.bincount(group[group >= 0], minlength=count)
    by_group = np.argsort(group, kind="stable")[np.count_nonzero(group < 0) :]
    of_group = np.split(by_group, np.cumsum(sizes)[:-1]) if count else []
    # attractors of as many states are in the order of their first states
    first = np.array([states[0] for states in of_group], dtype=np.int64)
    order = np.lexsort([first, -sizes])
    position[order] = np.arange(count)
    label = position[group].reshape(arrays["kind"].shape)
    return label, [_attractor(arrays, of_group[g], kind.size) for g in order]


def _index(role: str, coordinate: Coordinate, size: int) -> tuple[int, int]:
    """Return row and column of a coordinate in a state (2, N). Raises ParameterError."""
    if coordinate.name not in _NAMES:
        raise ParameterError(role, f"must be one of {', '.join(_NAMES)}")
    if not 1 <= coordinate.mass <= size:
        raise ParameterError(role, f"mass must be from 1 to {size}")
    if not np.all(np.isfinite(coordinate.values)):
        raise ParameterError(role, "every number must be finite")
    return _NAMES.index(coordinate.name), coordinate.mass - 1


def _clusters(means: Floats) -> list[Integers]:
    """Return the members of each cluster of points (n, 2): points connected by distances up to the tolerance."""
    tolerance = SEPARATION * LIMIT_DISTANCE
    # points of one cell are connected; points of different cells can be only if the cells are at most two apart
    cells, cell = np.unique(np.floor(means * (math.sqrt(2.0) / tolerance)), axis=0, return_inverse=True)
    members = np.split(np.argsort(cell, kind="stable"), np.cumsum(np.bincount(cell))[:-1])
    trees = [cKDTree(means[which]) for which in members]
    beside = cKDTree(cells).query_pairs(2.0, p=math.inf, output_type="ndarray")
    linked = [trees[i].count_neighbors(trees[j], tolerance) > 0 for i, j in beside.tolist()]
    first, second = beside[np.array(linked, dtype=np.bool_)].T
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(len(cells), len(cells)))
    _, cluster = connected_components(graph, directed=False)
    return [np.flatnonzero(cluster[cell] == number) for number in range(int(cluster.max()) + 1)]


def _attractor(arrays: dict[str, NDArray[Any]], members: Integers, total: int) -> Attractor:
    """Return the attractor of the states `members`, out of `total` states."""
    figures = {name: values.ravel()[members[0]].item() for name, values in arrays.items()}
    periodic = figures["kind"] == KINDS.index("periodic")
    if not periodic:
        lyapunov = arrays["lyapunov"].ravel()[members]
        figures["lyapunov"] = float(np.mean(lyapunov))
    names = (*NAME[1:], "mean_position", "mean_velocity")
    named = {name: figures[name] if periodic else None for name in names}
    return Attractor(
        kind=KINDS[figures["kind"]],
        **named,
        multiplier=figures["multiplier"],
        lyapunov=figures["lyapunov"],
        verified=periodic and bool(np.all(arrays["verified"].ravel()[members])),
        states=len(members),
        share=len(members) / total,
    )

"""The unfolding map: which motion every point of a plane of two parameters settles to.

>>> plane = Plane.of(oscillator, omega=np.array([0.28, 0.29]), clearance=np.array([1.5, 1.6]))
>>> unfolding_map_tile(plane)["impacts_right"]
array([[2, 3], [2, 2]], dtype=int32)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from grazemap_core.arrays import Booleans, Floats, Integers
from grazemap_core.codes import RESOLVED, ROUNDING_DECIDES
from grazemap_core.errors import ParameterError
from grazemap_core.maps.kernels.lane_state import FIGURES, LYAPUNOV_ERROR, SENSITIVE, TRANSIENT_GROWTH, UNVERIFIED
from grazemap_core.maps.map_settings import DEFAULT_SETTINGS, MapSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.simulation.motion import KINDS, kinds_of
from grazemap_core.simulation.observables import Observables

NAME: Final = ("kind", "period", "impacts_right", "impacts_left", "symmetric", "sticking")
"""The arrays of `unfolding_map_tile` that name a motion."""
_OF_SMALL_CHANGES: Final = ("multiplier", "lyapunov", "lyapunov_error")


def unfolding_map_tile(
    plane: Plane,
    settings: MapSettings = DEFAULT_SETTINGS,
    resolve_sensitive: bool = False,
    observed: Observables | None = None,
) -> dict[str, NDArray[Any]]:
    """Find the motion that trajectories settle to at every point of a plane.

    The phase of the forcing is 0 at the start. Every point (of a sweep: every column) is computed independently of the
    others, so a plane cut into tiles gives the same bytes.

    Parameters
    ----------
    plane : Plane
        n values of the vertical parameter and m of the horizontal one.
    settings : MapSettings
    resolve_sensitive : bool
        Whether the motions of sensitive points are decided in multi-precision arithmetic where possible
        (`sensitive_points`), which takes seconds a point. Not for a sweep, which starts at rounded states.
    observed : Observables or None
        What is read off the motions (`map_observables`). Not with resolve_sensitive.

    Returns
    -------
    dict of arrays of shape (n, m), [vertical, horizontal]
        kind (int8, position in `motion.KINDS`), reason (int8, key of `motion.REASONS`: why a motion is unresolved, or
        periodic but not verified), verified (bool: `verification.verify` confirms the periodic orbit, and that it
        captures the trajectory, which is not sensitive), sensitive (bool: a decision on the way to a periodic motion
        may be wrong by round-off, `lane_errors`), transient_growth (float64: largest growth of a small change before
        capture, in its logarithm; NaN unless captured), period,
        impacts_right, impacts_left (int32; -1: not touched, 0: rested on without an impact, -2: infinitely many, in
        complete chatter; all 0 unless periodic), symmetric (bool), sticking (bool: the contact rests on a stop
        some time in the period), multiplier (float64: largest modulus over one motion period; NaN unless periodic),
        lyapunov (float64: largest exponent per forcing period, for a periodic motion from its multiplier; NaN where it
        was not computed), lyapunov_error (float64: standard error of an exponent that was measured along the
        trajectory, from its spread between windows, NaN for others), least_impact_velocity (float64; 0 with complete
        chatter, NaN without impacts or unless periodic), settled_after (int32 forcing periods; -1 unless periodic). Of
        an ensemble also share (float64: fraction of the initial states that lead to this motion, or to its mirror
        image between symmetric stops) and motions_found (int32: number of different motions that are not unresolved). A
        preview has no multiplier, lyapunov and lyapunov_error. With resolve_sensitive also resolved (bool: the motion
        was decided in multi-precision arithmetic). With `observed` also its figures (float64, [figure, vertical,
        horizontal]).

    Raises
    ------
    ParameterError
        A value is out of its domain, or sensitive points cannot be resolved: the map is a sweep, is observed, or
        python-flint is not installed.
    """
    plane.check()
    resolve_grid = _resolution(settings, observed) if resolve_sensitive else None
    runner = PlaneRunner(plane, settings.of_runs(plane.oscillator, observed))
    codes, figures = runner.grid(down=settings.policy == "sweep-down")
    resolved = None
    if resolve_grid is not None:
        sensitive = codes[UNVERIFIED] == ROUNDING_DECIDES
        resolved = resolve_grid(runner, sensitive, codes, figures)
    return named_arrays(codes, figures, settings, plane.mirrors, resolved)


def _resolution(settings: MapSettings, observed: Observables | None) -> Callable[..., Booleans]:
    """Return `sensitive_points.resolve_grid`, which needs python-flint."""
    if observed is not None:
        raise ParameterError("resolve_sensitive", "must be false where observables are asked for")
    if settings.is_sweep:
        raise ParameterError("resolve_sensitive", "must be false for a sweep, which starts at rounded states")
    try:
        from grazemap_core.maps.sensitive_points import resolve_grid
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        message = "must be false here, where python-flint (grazemap[proofs]) is not installed"
        raise ParameterError("resolve_sensitive", message) from None
    return resolve_grid


def named_arrays(
    codes: Integers, figures: Floats, settings: MapSettings, mirrors: bool, resolved: Booleans | None = None
) -> dict[str, NDArray[Any]]:
    """Return the arrays of `unfolding_map_tile` from those of the s trajectories of each point.

    They are codes (CODES, n, m, s) and figures (FIGURES and one per observable, n, m, s), as of `PlaneRunner.grid`.
    With `mirrors` the mirror image of a motion is the same motion in an ensemble. `resolved` (n, m, s) are the
    trajectories that were decided in multi-precision arithmetic.
    """
    chosen = np.zeros(codes.shape[1:3], dtype=np.int64)
    of_ensemble: dict[str, NDArray[Any]] = {}
    if settings.is_ensemble:
        chosen, share, motions = _most_frequent(codes, mirrors)
        of_ensemble = {"share": share, "motions_found": motions}

    def of_chosen(values: NDArray[Any]) -> NDArray[Any]:
        return np.take_along_axis(values, chosen[None, :, :, None], axis=3)[..., 0]

    arrays = arrays_of(of_chosen(codes), of_chosen(figures)) | of_ensemble
    if resolved is not None:
        (arrays["resolved"],) = of_chosen(resolved[None])
    if settings.preview:
        arrays = {name: array for name, array in arrays.items() if name not in _OF_SMALL_CHANGES}
    if len(figures) > FIGURES:
        arrays["figures"] = of_chosen(figures[FIGURES:])
    return arrays


def arrays_of(codes: Integers, figures: Floats) -> dict[str, NDArray[Any]]:
    """Return the arrays of `unfolding_map_tile` from codes (CODES, ...) and figures (FIGURES, ...)."""
    reason, period, right, left, symmetric, after, sticking, growth = codes[:8]
    least_velocity, multiplier, lyapunov = figures[:3]
    kind, reason = kinds_of(reason, growth, codes[UNVERIFIED])
    return {
        "kind": kind,
        "reason": reason,
        "verified": (kind == KINDS.index("periodic")) & (reason == RESOLVED),
        "sensitive": codes[SENSITIVE].astype(np.bool_),
        "transient_growth": figures[TRANSIENT_GROWTH].copy(),
        "period": period.astype(np.int32),
        "impacts_right": right.astype(np.int32),
        "impacts_left": left.astype(np.int32),
        "symmetric": symmetric.astype(np.bool_),
        "sticking": sticking.astype(np.bool_),
        "multiplier": multiplier.copy(),
        "lyapunov": lyapunov.copy(),
        "lyapunov_error": figures[LYAPUNOV_ERROR].copy(),
        "least_impact_velocity": least_velocity.copy(),
        "settled_after": after.astype(np.int32),
    }


def _most_frequent(codes: Integers, mirrors: bool) -> tuple[Integers, Floats, NDArray[np.int32]]:
    """Return the most frequent motion of every point; of equally frequent motions the first.

    Parameters
    ----------
    codes : (CODES, n, m, s)
    mirrors : bool
        Whether the mirror image of a motion is the same motion.

    Returns
    -------
    chosen : (n, m)
        Index of the first initial state that leads to it.
    share : (n, m)
        Fraction of the initial states that lead to it; if no motion is known, that of the unresolved ones.
    motions : (n, m)
        Number of different motions that are known.
    """
    reason, period, right, left, symmetric, _, sticking, growth = codes[:8]
    kind, _ = kinds_of(reason, growth, codes[UNVERIFIED])
    few, many = (np.minimum(right, left), np.maximum(right, left)) if mirrors else (right, left)
    n, m, s = kind.shape
    point = np.repeat(np.arange(n * m), s)
    keys = np.column_stack([point, *(key.ravel() for key in (kind, period, few, many, symmetric, sticking))])
    distinct, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    of_point, known = distinct[:, 0], distinct[:, 1] != 0
    # of every point: a known motion before an unresolved one, then by frequency
    order = np.lexsort([first, -counts, ~known, of_point])
    best = order[np.searchsorted(of_point, np.arange(n * m))]
    motions = np.bincount(of_point[known], minlength=n * m).astype(np.int32)
    return (first[best] % s).reshape(n, m), (counts[best] / s).reshape(n, m), motions.reshape(n, m)

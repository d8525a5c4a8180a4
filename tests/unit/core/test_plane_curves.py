"""Curves and borders over any two parameters, against exact scaling, closed forms and orbits solved for alone."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from grazemap.wire import planes as wire
from grazemap_core.continuation.branches import OrbitPoint
from grazemap_core.continuation.motion_curves import motion_curves, orbit_in_window
from grazemap_core.continuation.parameters import PARAMETERS, ParameterPoint, check_domain, check_interval
from grazemap_core.grazing.grazing_curve import VariedStop, grazing_curve, stop_grazes
from grazemap_core.maps.borders.map_borders import EXPLANATIONS, MapBorders, map_borders
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.plane_grazes import GrazeLine, graze_lines, steady_on
from grazemap_core.maps.planes import Axis, Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.oscillator import Oscillator, Variants
from grazemap_core.orbits.impact_sequences import ImpactSequence
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.orbits.single_impact.curve_parameter import VariedFactor
from grazemap_core.orbits.single_impact.window_curves import CurvePiece, window_curves
from tests.oracles.closed_form import one_impact_branch
from tests.support.borders import count
from tests.support.oscillators import DEFAULT, VARYING, biased
from tests.support.refused import refused
from tests.support.thorough import every_fourth

SEVERAL = replace(DEFAULT, drive=(force(1, np.array([1.0, 0.0, 0.0])), force(3, np.array([0.0, 0.1, 0.0]))))
PUSHED = replace(DEFAULT, bias=np.array([0.02, 0.0, 0.01]))
UNLIKE = replace(DEFAULT, restitution_left=0.6)
OMEGA = (0.262, 0.298)
FIXED = 1.9


def by_motion(pieces: list[CurvePiece]) -> dict[tuple[object, ...], list[CurvePiece]]:
    groups: dict[tuple[object, ...], list[CurvePiece]] = {}
    for piece in pieces:
        groups.setdefault((piece.type, piece.period, piece.impacts_right, piece.impacts_left, piece.stop), []).append(
            piece
        )
    return groups


@pytest.mark.parametrize(
    ("oscillator", "right", "left"),
    [
        (DEFAULT, FIXED, FIXED),
        (SEVERAL, FIXED, FIXED),
        (DEFAULT, FIXED, np.inf),
        (replace(DEFAULT, restitution_left=0.6), FIXED, FIXED),
    ],
    ids=["symmetric", "several harmonics", "one stop", "two restitutions"],
)
def test_curves_over_the_forces_are_those_over_the_clearance_scaled(
    oscillator: Oscillator, right: float, left: float
) -> None:
    """F = clearance fixed / clearance of the curve, speeds F times: exact, and for the same admissible orbits."""
    varied = VariedStop(1, together=True) if left == right else VariedStop(1)
    forces = window_curves(oscillator, OMEGA, (0.85, 1.25), 2, 24, VariedFactor("forcing", right, left))
    known = window_curves(oscillator, OMEGA, (right / 1.25, right / 0.85), 2, 24, varied)
    assert {piece.type for piece in forces} >= {"SN", "GR"}
    both = by_motion(forces), by_motion(known)
    assert both[0].keys() == both[1].keys()
    for name, pieces in both[0].items():
        for scaled, piece in zip(pieces, both[1][name], strict=True):
            np.testing.assert_array_equal(scaled.omega, piece.omega)
            np.testing.assert_allclose(scaled.value, right / piece.value, rtol=1e-12)
            np.testing.assert_allclose(scaled.impact_velocity, scaled.value * piece.impact_velocity, rtol=1e-12)
            assert scaled.admissible == piece.admissible


@pytest.mark.parametrize(("right", "left"), [(1.8, 1.9), (1.8, np.inf)], ids=["two stops", "one stop"])
def test_curves_over_the_bias_have_the_gap_of_the_stop_that_is_struck(right: float, left: float) -> None:
    """At points of the curves the orbit of the oscillator with that bias is special, or grazes as the curve says."""
    pieces = window_curves(PUSHED, OMEGA, (-4.0, 4.0), 1, 24, VariedFactor("bias", right, left))
    struck = {(1, -1), (-1, 1), (-1, -1)} if np.isfinite(left) else {(1, -1), (-1, -1)}
    assert {(piece.impacts_right, piece.impacts_left) for piece in pieces} == struck
    compared = 0
    for piece in pieces:
        middle = len(piece.omega) // 2
        factor, omega = float(piece.value[middle]), float(piece.omega[middle])
        there = replace(PUSHED, bias=factor * PUSHED.bias)
        stop = piece.stop if piece.impacts_right == piece.impacts_left else piece.impacts_right
        if piece.impacts_right == piece.impacts_left:
            other = left if stop > 0 else right
            grazes = stop_grazes(there, [omega], VariedStop(stop, None if np.isinf(other) else other))
            assert grazes.clearance[0] == pytest.approx(right if stop > 0 else left, rel=1e-12)
            assert grazes.virtual[0] != piece.admissible
        elif piece.type in ("SN", "PD"):
            special = one_impact_branch(there, omega, 1, stop=stop, alone=True).special_points
            gap = (right if stop > 0 else left) - stop * contact_equilibrium(there)
            assert min(abs(point.clearance - gap) for point in special if point.type == piece.type) < 1e-11
            compared += 1
    assert compared >= 1 + np.isfinite(left)


def test_a_bias_that_does_not_move_the_contact_has_no_curves() -> None:
    with refused("bias"):
        window_curves(DEFAULT, OMEGA, (-1.0, 1.0), 1, 4, VariedFactor("bias", 1.8, 1.8))


@pytest.mark.parametrize(("clearance", "types"), [(1.87, {"SN", "GR"}), (1.92, {"SN", "PD", "GR"})])
def test_curves_over_frequency_and_restitution_are_the_closed_form_s_at_every_restitution(
    clearance: float, types: set[str]
) -> None:
    """The gap at the special point of the branch at the curve's frequency and restitution is that of the stop."""
    at = ParameterPoint.of(DEFAULT, 1.0, clearance)
    window: dict[str, tuple[float, float]] = {"omega": (0.26, 0.30), "restitution": (0.4, 0.95)}
    start = orbit_in_window(DEFAULT, at, window, 1, [1])
    assert start is not None
    curves = motion_curves(DEFAULT, start, *window.values(), plane=("omega", "restitution"))
    compared = set()
    for curve in curves:
        for omega, restitution, orbit in zip(curve.horizontal, curve.vertical, curve.velocities, strict=True):
            if curve.type not in ("SN", "PD") or orbit[0] < 0.0:
                continue
            there = replace(DEFAULT, restitution=float(restitution))
            (point,) = [p for p in one_impact_branch(there, float(omega)).special_points if p.type == curve.type]
            assert point.clearance == pytest.approx(clearance, rel=1e-12)
            compared.add(curve.type)
        if curve.type == "GR" and curve.impact is not None and len(curve.stops) == 1:  # the graze at the clearance
            np.testing.assert_allclose(grazing_curve(DEFAULT, curve.horizontal).clearance, clearance, rtol=1e-10)
            compared.add(curve.type)
    assert compared == types


@pytest.mark.thorough
def test_curves_from_an_orbit_with_other_factors_are_those_from_the_oscillator() -> None:
    """In the plane of the forces and the damping, from an orbit at neither factor 1."""
    at = ParameterPoint.of(VARYING, 0.27, 1.82).varied("forcing", 0.99).varied("damping", 1.01)
    there = at.applied(VARYING)
    place = {"forcing": (0.99, 0.99), "damping": (1.01, 1.01)}
    start = orbit_in_window(VARYING, at, place, 1, [1, -1])
    assert isinstance(start, OrbitPoint)
    assert start.orbit.admissible
    ranges = (0.95, 1.05), (0.95, 1.1)
    curves = motion_curves(VARYING, start, *ranges, plane=("forcing", "damping"), max_points=20)
    assert {curve.type for curve in curves} >= {"SN", "SB", "GR"}
    compared = 0
    for curve in curves:
        if curve.impact is not None or curve.type == "GR":
            continue
        values = curve.points[len(curve.points) // 2]
        assert (values.omega, values.clearance) == (0.27, 1.82)
        applied = values.applied(VARYING)
        assert applied.drive[0].constant[0] == pytest.approx(values.forcing * there.drive[0].constant[0] / 0.99)
        span = len(curve.points) // 2
        impacts = curve_impacts(curve, span)
        orbit = periodic_orbit(applied, values.omega, values.clearance, impacts)
        wanted = {"SN": 1.0, "PD": -1.0, "SB": 1.0}.get(curve.type)
        if orbit.converged and wanted is not None:
            assert np.min(np.abs(orbit.multipliers - wanted)) < 1e-3
            compared += 1
    assert compared


def curve_impacts(curve, place):  # type: ignore[no-untyped-def]
    phases, velocities = curve.phases[place], curve.velocities[place]
    return ImpactSequence(curve.period, curve.stops, phases, velocities, curve.symmetric).whole


GRAZED = {
    "omega, clearance": (DEFAULT, ("omega", 0.262, 0.298), ("clearance", 1.6, 2.0)),
    "omega, forcing": (DEFAULT, ("omega", 0.262, 0.298), ("forcing", 0.85, 1.2)),
    "bias, omega": (PUSHED, ("bias", -2.0, 2.0), ("omega", 0.262, 0.298)),
    "omega, restitution": (DEFAULT, ("omega", 0.262, 0.298), ("restitution", 0.5, 0.9)),
    "gaps": (biased(), ("clearance_right", 1.6, 2.0), ("clearance_left", 1.6, 2.0)),
    "omega, mass": (VARYING, ("omega", 0.262, 0.298), ("masses[1]", 0.9, 1.1)),
    "damping, mass": (VARYING, ("damping", 0.8, 1.2), ("masses[1]", 0.5, 3.0)),
}


def plane_of(name: str, size: int = 9) -> Plane:
    oscillator, *axes = GRAZED[name]
    across, up = (Axis(axis, np.linspace(start, stop, size)) for axis, start, stop in axes)
    return Plane(oscillator, ParameterPoint.of(oscillator, 0.28, 1.87), across, up)


@pytest.mark.parametrize("name", GRAZED)
def test_the_margin_vanishes_on_the_grazing_curves_of_every_plane(name: str) -> None:
    plane = plane_of(name)
    lines = list(graze_lines(plane))
    assert lines
    for line in lines:
        for point in zip(line.horizontal.tolist(), line.vertical.tolist(), line.admissible.tolist(), strict=True):
            axes = (axis._replace(values=np.array([value])) for axis, value in zip(plane.axes, point[:2], strict=True))
            here = Plane(plane.oscillator, plane.at, *axes)
            margins = steady_on(here).margins()[0]
            own, other = margins if line.stop > 0 else margins[::-1]
            assert abs(own) < 1e-11
            assert point[2] == (plane.mirrors or other >= 0.0)


def test_a_grazing_curve_ends_where_there_is_no_steady_motion() -> None:
    """There is none without damping; with damping 0 among the values the curve has no point there."""
    at = ParameterPoint.of(VARYING, 0.28, 1.87)
    damping, forcing = Axis("damping", np.linspace(0.0, 1.2, 9)), Axis("forcing", np.linspace(0.5, 1.0, 9))
    lines = list(graze_lines(Plane(VARYING, at, damping, forcing)))
    assert lines
    for line in lines:
        assert np.all(np.isfinite(line.horizontal))
        assert np.all(np.isfinite(line.vertical))
        assert np.min(line.horizontal) > 0.0


def test_grazing_curves_of_a_tiny_machine_are_as_exact() -> None:
    """Masses of 1e-10: a parameter is solved for relative to its size."""
    size = 1e-10

    def tiny(changes: dict[str, float]) -> Oscillator:
        masses = [size * changes.get("masses[1]", 1.0), 10.0 * size, 10.0 * size]
        return Oscillator.create(masses, [size, 5.0 * size, 5.0 * size], 0.05 * size, [size, 0.0, 0.0], 0.8)

    def scaled(changes: dict[str, float]) -> Oscillator:
        return tiny({"masses[1]": changes.get("masses[1]", size) / size})

    oscillator = replace(tiny({}), variants=Variants({"masses[1]": size}, scaled))
    across, up = Axis("omega", np.linspace(0.262, 0.298, 9)), Axis("masses[1]", size * np.linspace(0.9, 1.1, 9))
    plane = Plane(oscillator, ParameterPoint.of(oscillator, 0.28, 1.87), across, up)
    lines = list(graze_lines(plane))
    assert lines
    for line in lines:
        for x, y in zip(line.horizontal.tolist(), line.vertical.tolist(), strict=True):
            here = replace(plane, horizontal=Axis("omega", np.array([x])), vertical=Axis("masses[1]", np.array([y])))
            assert np.min(np.abs(steady_on(here).margins()[0])) < 1e-11


@pytest.mark.parametrize("name", GRAZED)
def test_grazing_curves_separate_all_points_with_margins_of_different_signs(name: str) -> None:
    """Between neighbours with different signs a curve crosses: along the explicit axis, and where both margins vary."""
    plane = plane_of(name)
    margins = steady_on(plane).margins()
    for stop in (1,) if plane.mirrors else (1, -1):
        of_stop = margins[:, 0 if stop > 0 else 1].reshape(plane.shape[::-1]).T > 0.0
        lines = [line for line in graze_lines(plane) if line.stop == stop]
        crossed = np.argwhere(of_stop[:, 1:] != of_stop[:, :-1]).tolist()
        for row, column in crossed:
            value = plane.vertical.values[row]
            ends = plane.horizontal.values[column : column + 2]
            assert any(crosses(line, value, *ends) for line in lines), (row, column)


def crosses(line: GrazeLine, value: float, start: float, stop: float) -> bool:
    """Whether a polyline passes through a horizontal side."""
    for (x, y), (after, above) in itertools.pairwise(zip(line.horizontal, line.vertical, strict=True)):
        if min(y, above) <= value <= max(y, above):
            share = 0.0 if above == y else (value - y) / (above - y)
            at = x + share * (after - x)
            if start - 1e-4 <= at <= stop + 1e-4:
                return True
    return False


BORDERED = {
    "omega, forcing": (DEFAULT, ("omega", 0.276, 0.284), ("forcing", 0.98, 1.03)),
    "restitution, omega": (DEFAULT, ("restitution", 0.6, 0.9), ("omega", 0.276, 0.288)),
    "gaps": (DEFAULT, ("clearance_right", 1.8, 1.95), ("clearance_left", 1.8, 1.95)),
    "omega, mass": (VARYING, ("omega", 0.276, 0.284), ("masses[1]", 0.9, 1.1)),
    "bias, omega": (PUSHED, ("bias", -1.0, 1.0), ("omega", 0.276, 0.284)),
}


@pytest.mark.parametrize("name", every_fourth(BORDERED))
def test_borders_of_maps_over_any_two_parameters_are_explained(name: str) -> None:
    oscillator, *axes = BORDERED[name]
    across, up = (Axis(axis, np.linspace(start, stop, 10)) for axis, start, stop in axes)
    plane = Plane(oscillator, ParameterPoint.of(oscillator, 0.28, 1.89), across, up)
    arrays = unfolding_map_tile(plane, MapSettings(max_periods=600))
    borders = map_borders(plane, arrays)
    assert count(borders, "curve") > 0, [(c.type, c.name) for c in borders.curves]
    unexplained = borders.explanation == EXPLANATIONS.index("unexplained")
    assert np.count_nonzero(unexplained & borders.regular) <= 0.1 * len(borders.row)
    for curve in borders.curves:
        if curve.orbits is not None:
            assert curve.orbits.plane == plane.names
            np.testing.assert_array_equal(curve.horizontal, [point.value(across.name) for point in curve.orbits.points])


@pytest.mark.thorough
def test_borders_over_the_forces_are_those_over_the_clearance() -> None:
    """The same motions, explanations and distances where the rows are those of the clearance over the forces."""
    omega, forces = np.linspace(0.276, 0.284, 10), np.linspace(0.98, 1.03, 10)
    scaled = Plane.of(DEFAULT, omega, (1.89 / forces)[::-1])
    other = Plane(DEFAULT, ParameterPoint.of(DEFAULT, 1.0, 1.89), Axis("omega", omega), Axis("forcing", forces))
    first, second = (
        map_borders(plane, unfolding_map_tile(plane, MapSettings(max_periods=600))) for plane in (scaled, other)
    )
    ours = {(9 - int(r) - (a == 0), int(c), int(a)): int(e) for r, c, a, e in rows(first)}
    theirs = {(int(r), int(c), int(a)): int(e) for r, c, a, e in rows(second)}
    assert ours == theirs
    assert {curve.type for curve in first.curves} == {curve.type for curve in second.curves}


def rows(borders: MapBorders) -> list[tuple[int, int, int, int]]:
    return list(zip(borders.row, borders.column, borders.along, borders.explanation, strict=True))


@pytest.mark.thorough
def test_a_curve_of_a_plane_of_a_mass_passes_the_special_points_of_branches_at_other_masses() -> None:
    at = ParameterPoint.of(VARYING, 0.28, 1.87)
    window: dict[str, tuple[float, float]] = {"omega": (0.26, 0.30), "masses[1]": (0.9, 1.1)}
    start = orbit_in_window(VARYING, at, window, 1, [1])
    assert start is not None
    curves = motion_curves(VARYING, start, *window.values(), plane=("omega", "masses[1]"), max_points=40)
    folds = [curve for curve in curves if curve.type == "SN"]
    assert folds
    for curve in folds:
        for omega, mass in zip(curve.horizontal.tolist()[::5], curve.vertical.tolist()[::5], strict=True):
            there = VARYING.with_structure({"masses[1]": mass})
            (point,) = [p for p in one_impact_branch(there, omega).special_points if p.type == "SN"]
            assert point.clearance == pytest.approx(1.87, rel=1e-9)


def test_the_names_and_domains_of_parameters_are_those_of_requests() -> None:
    """Core and wire models do not import each other, so each has the list."""
    assert {*wire.SCALARS, "omega"} == {*PARAMETERS}
    names = (*PARAMETERS, "damping", "masses[1]", "stiffnesses[2]", "dampings[3]")
    values = (-2.0, -1e-60, 0.0, 1e-60, 0.5, 1.0, 1.5, 1e60)
    for name, value in itertools.product(names, values):
        assert accepted(wire.require_domain, name, value) == accepted(check_domain, name, np.array([value])), (
            name,
            value,
        )
    for value in (np.nan, np.inf, -np.inf):
        assert not any(accepted(check_domain, name, np.array([value])) for name in names)


def accepted(check, name, value) -> bool:  # type: ignore[no-untyped-def]
    try:
        check(name, value)
    except Exception:
        return False
    return True


def test_an_interval_that_is_not_one_of_its_parameter_is_refused() -> None:
    for name, start, stop in (
        ("restitution", 0.5, 1.5),
        ("omega", 0.0, 1.0),
        ("bias", 1.0, 1.0),
        ("bias", 0.0, np.inf),
    ):
        with refused("range"):
            check_interval(name, start, stop, named="range")
    point = orbit_in_window(
        DEFAULT, ParameterPoint.of(DEFAULT, 1.0, 1.0), {"omega": (0.27, 0.27), "clearance": (1.85, 1.85)}, 1, [1]
    )
    assert point is not None
    with refused("omega"):
        motion_curves(DEFAULT, point.orbit, (0.2, 0.26), (1.8, 1.9))

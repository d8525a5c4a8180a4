"""Grazing curves of one stop, of unequal stops and with a bias: evaluated anywhere, and drawn over maps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap.plots.axes import kept_from_pyplot
from grazemap.results import CodimensionTwoPoints, StopGrazingCurves, UnfoldingMap
from grazemap.wire.processes import parse_request
from tests.support.computed import result_of, whole

OMEGA = {"start": 0.26, "stop": 0.30}
ROWS = {"start": 1.3, "stop": 2.3, "points": 3}
BIASED = {"bias": [0.05, 0.0, 0.0]}
EVEN = {"forcing": [{"amplitude": [1.0, 0.0, 0.0]}, {"amplitude": [0.2, 0.0, 0.0], "harmonic": 2}]}
# the oscillator, the clearance of the curve, that of the map, and the stops whose curves are drawn
MACHINES = {
    "right stop alone": ({}, {"left": None}, {"right": ROWS, "left": None}, ["right"]),
    "left stop alone": (EVEN, {"right": None}, {"right": None, "left": ROWS}, ["left"]),
    "unequal stops": ({}, {"left": 1.8}, {"right": ROWS, "left": 1.8}, ["right"]),
    "unequal stops, bias": (BIASED, {"right": 1.8}, {"right": 1.8, "left": ROWS}, ["left"]),
    "bias": (BIASED, None, ROWS, ["right", "left"]),
    "even harmonic": (EVEN, None, ROWS, ["right", "left"]),
    "unequal stops, the curves of both": (BIASED, None, {"right": ROWS, "left": 1.8}, ["right"]),
    "one stop, the curve of two": ({}, None, {"right": ROWS, "left": None}, ["right"]),
}
NAMES = pytest.mark.parametrize("name", MACHINES)


def curves_of(oscillator: dict[str, Any], clearance: Any) -> Any:
    body = {"oscillator": oscillator, "omega": {**OMEGA, "points": 41}, "max_order": 2}
    body |= {} if clearance is None else {"clearance": clearance}
    return result_of("grazing-curves", body, whole("grazing-curves", body))


def map_over(**body: Any) -> UnfoldingMap:
    """A map of which no motion was resolved: what is drawn over it depends on its request alone."""
    shape, request = (3, 3), parse_request("unfolding-maps", body)
    across, up = (np.linspace(*axis.ends, 3) for axis in (request.plane.horizontal, request.plane.vertical))
    counts = dict.fromkeys(("period", "impacts_right", "impacts_left", "settled_after"), np.zeros(shape, np.int32))
    flags = dict.fromkeys(("symmetric", "sticking", "verified", "sensitive"), np.zeros(shape, np.bool_))
    document = {
        **counts,
        **flags,
        **dict(zip(request.plane.fields, (across, up), strict=True)),
        "kind": np.zeros(shape, np.int8),
        "kinds": np.array(["unresolved"]),
        "least_impact_velocity": np.full(shape, np.nan),
        "transient_growth": np.full(shape, np.nan),
        "reason": np.zeros(shape, np.int8),
        "reasons": np.array([""]),
    }
    umap = result_of("unfolding-maps", body, document)
    assert isinstance(umap, UnfoldingMap)
    return umap


@NAMES
def test_a_curve_is_evaluated_anywhere(name: str) -> None:
    oscillator, clearance, _, _ = MACHINES[name]
    curve = curves_of(oscillator, clearance)
    clearances = {side: getattr(curve, f"clearance_{side}") for side in ("right", "left")}
    known = {side: values for side, values in clearances.items() if values is not None}
    # as the core has it, to the rounding of the frequencies' responses
    np.testing.assert_allclose(curve.at(curve.omega), np.max([*known.values()], axis=0), rtol=1e-12)
    assert curve.at(0.28).shape == ()
    assert curve.at([[0.27], [0.28]]).shape == (2, 1)
    if not isinstance(curve, StopGrazingCurves):
        return
    for side, values in known.items():
        np.testing.assert_allclose(curve.at(curve.omega, side), values, rtol=1e-12)
    if len(known) == 1:
        (absent,) = clearances.keys() - known.keys()
        with pytest.raises(ValueError, match=absent):
            curve.at(0.28, absent)
    else:  # of two curves that of the stop that the motion touches first
        solid = np.where(curve.virtual_right, known["left"], known["right"])
        np.testing.assert_allclose(curve.at(curve.omega), solid, rtol=1e-12)
    for outside in (0.2, np.nan, [0.28, 0.4]):
        with pytest.raises(ValueError, match="outside"):
            curve.at(outside)


@NAMES
def test_a_curve_is_drawn_over_a_map(name: str) -> None:
    oscillator, clearance, rows, drawn = MACHINES[name]
    curve = curves_of(oscillator, clearance)
    umap = map_over(oscillator=oscillator, omega={**OMEGA, "points": 3}, clearance=rows)
    with kept_from_pyplot():
        ax = umap.plot(curve=curve)
    lines = [line for line in ax.lines if line.get_label().startswith("graze of the")]
    assert {line.get_label().split()[3] for line in lines} == set(drawn)
    looks = [(line.get_color(), line.get_linestyle()) for line in lines]
    assert len(set(looks)) == len(looks)
    for stop in drawn:
        own, other = (curve.clearance_right, "left") if stop == "right" else (curve.clearance_left, "right")
        # between the stops at own, the other one as the map has it: dashed where the motion reaches that one
        fixed = own if "start" in rows else rows[other]
        for line in lines:
            if line.get_label().split()[3] != stop:
                continue
            virtual = line.get_label().endswith("virtual")
            shown = np.isfinite(line.get_ydata())
            np.testing.assert_array_equal(np.asarray(line.get_ydata())[shown], own[shown])
            if fixed is None:
                assert shown.all()
                assert not virtual
                continue
            reached = curves_of(oscillator, {stop: None})
            farthest = getattr(reached, f"clearance_{other}")
            np.testing.assert_array_equal(shown, (farthest > fixed) == virtual)


def test_what_cannot_be_drawn_over_a_map_is_refused() -> None:
    left, both = curves_of({}, {"right": 1.8}), curves_of({}, None)
    omega = {**OMEGA, "points": 3}
    with kept_from_pyplot(), pytest.raises(ValueError, match="right"):
        map_over(omega=omega, clearance={"right": ROWS, "left": 1.8}).plot(curve=left)
    restitution = {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9, "points": 3}}
    umap = map_over(horizontal={"vary": "omega", "values": omega}, vertical=restitution, clearance=1.8)
    for curve in (left, both):
        with kept_from_pyplot(), pytest.raises(ValueError, match="restitution"):
            umap.plot(curve=curve)


@NAMES
def test_mirror_images_are_merged_between_symmetric_stops_only(name: str) -> None:
    oscillator, _, rows, _ = MACHINES[name]
    umap = map_over(oscillator=oscillator, omega={**OMEGA, "points": 3}, clearance=rows)
    with pytest.raises(ValueError, match="symmetric"):
        umap.motions(merge_mirror_images=True)
    alike = map_over(omega={**OMEGA, "points": 3}, clearance=ROWS)
    assert len(alike.motions(merge_mirror_images=True)) == 1


def test_points_of_a_stop_that_does_not_vary_are_not_drawn_over_a_map() -> None:
    body = {"oscillator": BIASED, "omega": OMEGA, "max_order": 4}
    points = result_of("codimension-two-points", body, whole("codimension-two-points", body))
    assert isinstance(points, CodimensionTwoPoints)
    of_stop = {
        stop: {(point.omega, point.clearance) for point in points.points if point.stop == stop} for stop in (1, -1)
    }
    assert all(of_stop.values())
    for rows, drawn in (({"right": ROWS, "left": 1.8}, 1), ({"right": 1.8, "left": ROWS}, -1)):
        umap = map_over(oscillator=BIASED, omega={**OMEGA, "points": 3}, clearance=rows)
        with kept_from_pyplot():
            ax = umap.plot(points=points)
        marked = {tuple(place) for line in ax.lines if line.get_linestyle() == "None" for place in line.get_xydata()}
        assert marked == of_stop[drawn]


@NAMES
def test_points_are_drawn_with_the_curves_of_their_stops(name: str) -> None:
    oscillator, clearance, _, _ = MACHINES[name]
    body = {"oscillator": oscillator, "omega": OMEGA, "max_order": 1}
    body |= {} if clearance is None else {"clearance": clearance}
    points = result_of("codimension-two-points", body, {"points": []})
    assert isinstance(points, CodimensionTwoPoints)
    with kept_from_pyplot():
        ax = points.plot()
    curve = curves_of(oscillator, clearance)
    for stop in ("right", "left"):
        lines = [line for line in ax.lines if f"{stop} stop" in str(line.get_label())]
        known = getattr(curve, f"clearance_{stop}") if isinstance(curve, StopGrazingCurves) else None
        assert bool(lines) == (known is not None)
        for line in lines:
            shown = np.isfinite(line.get_ydata())
            omega, drawn = np.asarray(line.get_xdata())[shown], np.asarray(line.get_ydata())[shown]
            np.testing.assert_allclose(drawn, curve.at(omega, stop), rtol=1e-12)
            virtual = np.interp(omega, curve.omega, getattr(curve, f"virtual_{stop}"))
            sure = (virtual == 0.0) | (virtual == 1.0)
            assert np.all(virtual[sure] == str(line.get_label()).endswith("virtual"))

"""Windows and diagrams over any two parameters: what is refused, equal requests, results, pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_sdk_planes import refused

from grazemap.client.process_methods import METHODS
from grazemap.errors import ParameterError
from grazemap.results import BifurcationCurves, UnfoldingDiagram, UnfoldingMap
from grazemap.results.base import decode_result
from grazemap.wire import canonical, canonical_id, parse_request
from grazemap.wire.planes import WindowAxis
from tests.support.sdk_documents import AXES, CURVES_OF_AXES, DIAGRAM_OF_AXES, npz

OMEGA = {"vary": "omega", "values": {"start": 0.26, "stop": 0.3}}
RESTITUTION = {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9}}
FORCING = {"vary": "forcing", "values": {"start": 0.8, "stop": 1.2}}
RIGHT = {"vary": "clearance_right", "values": {"start": 1.0, "stop": 2.0}}
LEFT = {"vary": "clearance_left", "values": {"start": 1.0, "stop": 2.0}}
MASS = {"vary": "masses[2]", "values": {"start": 9.0, "stop": 10.0}}
MOTION = {"period": 1, "stops": [1]}
ORBIT = {**MOTION, "phases": [0.1], "velocities": [0.2]}
BASE = {"horizontal": OMEGA, "vertical": RESTITUTION, "clearance": 1.6}
INTERVAL, RANGE = {"start": 0.26, "stop": 0.3}, {"start": 0.26, "stop": 0.3, "points": 4}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vertical": OMEGA}, "/vertical/vary"),
        ({"vertical": None}, "/vertical"),
        ({"horizontal": None}, "/horizontal"),
        ({"horizontal": RIGHT, "vertical": {**RIGHT, "vary": "clearance"}, "clearance": None}, "/vertical/vary"),
        ({"vertical": {**RESTITUTION, "vary": "speed"}}, "/vertical/vary"),
        ({"vertical": {**RESTITUTION, "values": {"start": 0.5, "stop": 1.5}}}, "/vertical/values"),
        ({"vertical": {**RESTITUTION, "values": {"start": 0.9, "stop": 0.5}}}, "/vertical/values"),
        ({"vertical": {"vary": "bias", "values": {"start": 0.0, "stop": 1.0}}}, "/vertical/vary"),
        ({"vertical": {**RESTITUTION, "values": RANGE}}, "/vertical/values"),
        ({"omega": INTERVAL}, "/omega"),
        ({"horizontal": OMEGA, "vertical": RIGHT, "clearance": {"right": INTERVAL}}, "/clearance"),
        ({"omega": 0.29}, "/omega"),
        ({"horizontal": RIGHT, "clearance": {"left": 1.2}, "motions": [MOTION]}, "/omega"),
        ({"clearance": None}, "/clearance"),
        ({"clearance": INTERVAL}, "/clearance"),
        ({"vertical": RIGHT}, "/clearance"),
        ({"vertical": MASS}, "/motions"),
        ({"horizontal": RIGHT, "vertical": LEFT, "clearance": None, "omega": 0.28}, "/motions"),
        ({"motions": [{**MOTION, "omega": 0.28}]}, "/motions/0/omega"),
        ({"motions": [{**MOTION, "horizontal": 0.28, "vertical": 1.0}]}, "/motions/0/vertical"),
        ({"motions": [MOTION, {**ORBIT, "horizontal": 0.28}]}, "/motions/1/vertical"),
        ({"motions": [{**MOTION, "stops": [-1]}], "clearance": {"right": 1.6}}, "/motions/0/stops"),
    ],
)
def test_a_window_that_is_none_is_refused_by_its_field(changes, pointer):
    body = {name: value for name, value in {**BASE, **changes}.items() if value is not None}
    errors = refused("bifurcation-curves", body)
    assert list(errors) == [pointer]
    assert errors[pointer]


def test_an_error_of_a_motion_is_at_the_field_that_was_sent():
    """Also where axes of omega and clearance mean the same as intervals."""
    axes = {"horizontal": OMEGA, "vertical": {"vary": "clearance", "values": {"start": 1.5, "stop": 2.0}}}
    for motion, field in (
        ({**MOTION, "horizontal": 0.5}, "horizontal"),
        ({**MOTION, "omega": 0.28, "vertical": 1.9}, "omega"),
        ({**ORBIT, "horizontal": 0.28}, "vertical"),
    ):
        assert list(refused("bifurcation-curves", {**axes, "motions": [motion]})) == [f"/motions/0/{field}"]
    within = {**MOTION, "horizontal": 0.28, "vertical": 1.9}
    found = parse_request("bifurcation-curves", {**axes, "motions": [within]})
    assert (found.motions[0].omega, found.motions[0].clearance) == (0.28, 1.9)


def test_a_window_of_ranges_needs_both_and_places_in_them():
    body = {"omega": INTERVAL, "clearance": {"start": 1.5, "stop": 2.0}}
    for field in body:
        for given in ({name: value for name, value in body.items() if name != field}, {**body, field: 1.0}):
            assert list(refused("bifurcation-curves", given)) == [f"/{field}"]
    assert list(refused("bifurcation-curves", {**body, "motions": [{**MOTION, "vertical": 1.6}]})) == [
        "/motions/0/vertical"
    ]
    assert list(refused("bifurcation-curves", {**body, "motions": [{**ORBIT, "omega": 0.27}]})) == [
        "/motions/0/clearance"
    ]


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vertical": None}, "/vertical"),
        ({"vertical": {**OMEGA, "values": RANGE}}, "/vertical/vary"),
        ({"omega": 0.29}, "/omega"),
        ({"clearance": None}, "/clearance"),
    ],
)
def test_a_diagram_of_a_plane_that_is_none_is_refused_by_its_field(changes, pointer):
    up = {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9, "points": 3}}
    body = {"horizontal": {**OMEGA, "values": RANGE}, "vertical": up, "clearance": 1.6, **changes}
    assert list(refused("unfolding-diagrams", {name: one for name, one in body.items() if one is not None})) == [
        pointer
    ]


def identity(process, **body):
    return canonical_id(process, canonical(parse_request(process, body)), "0")


def test_equal_windows_have_one_id():
    process, up = "bifurcation-curves", {"start": 1.0, "stop": 2.0}
    ranges = identity(process, omega=INTERVAL, clearance=up, motions=[{**MOTION, "omega": 0.28, "clearance": 1.5}])
    place = {**MOTION, "horizontal": 0.28, "vertical": 1.5}
    both = {"horizontal": OMEGA, "vertical": {"vary": "clearance", "values": up}}
    assert identity(process, **both, motions=[place]) == ranges
    one = identity(process, omega=INTERVAL, clearance={"right": up, "left": 1.2})
    assert identity(process, horizontal=OMEGA, vertical=RIGHT, clearance={"left": 1.2}) == one
    fixed = identity(process, **BASE)
    assert identity(process, **{**BASE, "clearance": {"right": 1.6, "left": 1.6}}) == fixed
    assert identity(process, **BASE, points=7) == fixed  # continued curves have no number of frequencies
    explicit = {**BASE, "vertical": FORCING}
    assert identity(process, **explicit, points=7) != identity(process, **explicit)
    values = {"start": 1.0, "stop": 2.0, "points": 3}
    across = {"vary": "omega", "values": RANGE}
    diagram = identity("unfolding-diagrams", omega=RANGE, clearance=values)
    assert (
        identity("unfolding-diagrams", horizontal=across, vertical={"vary": "clearance", "values": values}) == diagram
    )


def test_the_text_of_windows_of_ranges_is_as_before_there_were_axes():
    body = {"omega": INTERVAL, "clearance": {"start": 1.5, "stop": 2.0}}
    assert canonical(parse_request("bifurcation-curves", body)).keys() == {
        "oscillator", "omega", "clearance", "max_multiple", "points",
    }  # fmt: skip
    motion = canonical(parse_request("bifurcation-curves", {**body, "motions": [MOTION]}))
    assert motion.keys() == {"oscillator", "omega", "clearance", "motions"}
    assert motion["motions"][0].keys() == {"period", "stops", "phases", "velocities", "omega", "clearance"}


def test_axes_of_a_window_are_given_by_name_start_and_stop():
    def asked(**given):
        return METHODS["bifurcation_curves"].asked(**given)[0]

    plane = {"clearance": 1.6, "horizontal": ("omega", 0.26, 0.3), "vertical": WindowAxis(**RESTITUTION)}
    request = asked(**plane, motions=[(1, [1])])
    assert request.horizontal.model_dump() == OMEGA
    assert request.plane.shape == (2, 2)
    assert [(motion.period, motion.stops) for motion in request.motions] == [(1, [1])]
    with pytest.raises(ParameterError):
        asked(**plane | {"horizontal": ("omega", [0.26, 0.3])})
    orbit = decode_result(npz("periodic-orbits"))
    with pytest.raises(ParameterError):
        asked(**plane, motions=[orbit])  # it does not say which restitution it has
    sides = {"horizontal": ("clearance_right", 1.0, 2.0), "vertical": ("clearance_left", 1.0, 2.0)}
    (motion,) = asked(omega=0.27, **sides, motions=[orbit]).motions
    assert (motion.horizontal, motion.vertical, motion.stops) == (1.85, 1.85, [1, -1])


def test_curves_of_other_parameters_are_drawn_over_a_map_of_the_same_ones():
    umap, same, other = (decode_result(npz(name)) for name in (AXES, CURVES_OF_AXES, "bifurcation-curves"))
    assert isinstance(umap, UnfoldingMap)
    assert isinstance(same, BifurcationCurves)
    assert isinstance(other, BifurcationCurves)
    assert same.parameters == ("restitution", "omega")
    ax = umap.plot(curves=same)
    assert ax.get_xlabel() == "restitution $R$"
    assert lines_from(ax, [0.6, 0.25], [0.7, 0.3])
    assert not lines_from(umap.plot(), [0.6, 0.25], [0.7, 0.3])
    with pytest.raises(ValueError, match="curves are over omega and clearance, and the map is over restitution"):
        umap.plot(curves=other)
    alone = same.plot(admissible=False)
    assert (alone.get_xlabel(), alone.get_xlim()) == ("restitution $R$", (0.5, 0.9))
    assert same.varied_stop is None


@pytest.mark.parametrize(
    ("name", "said"),
    [(CURVES_OF_AXES, "with one impact"), ("bifurcation-curves", "with one impact, or one on either stop")],
)
def test_curves_of_one_impact_have_both_stops_in_the_title_where_these_are_alike(name, said):
    found = decode_result(npz(name))
    assert isinstance(found, BifurcationCurves)
    assert replace(found, motions=()).plot().get_title() == f"Bifurcation curves of motions {said}"
    assert found.plane is found.plane


def lines_from(ax, start, stop):
    """The lines of a picture between two points."""
    ends = (line.get_xydata()[[0, -1]] for line in ax.lines if len(line.get_xydata()))
    return [one for one in ends if np.allclose(one, [start, stop])]


def test_an_orbit_of_a_curve_of_any_plane_has_the_oscillator_there():
    found = decode_result(npz(CURVES_OF_AXES))
    assert isinstance(found, BifurcationCurves)
    (curve,) = found.curves
    assert curve.omega is None
    np.testing.assert_array_equal(curve.line, [[0.6, 0.25], [0.7, 0.3]])
    orbit = found.orbit(curve, 1)
    assert (orbit["oscillator"]["restitution"], orbit["omega"]) == (0.7, 0.3)
    assert orbit["clearance"] == {"right": 1.6, "left": None}
    assert parse_request("periodic-orbits", orbit)
    with pytest.raises(ValueError, match="use BifurcationCurves"):
        curve.orbit(1)


def test_a_diagram_of_any_plane_has_its_own_grazing_curves():
    found = decode_result(npz(DIAGRAM_OF_AXES))
    assert isinstance(found, UnfoldingDiagram)
    assert found.grazing_curve is None
    assert found.codimension_two_points is None
    assert found.bifurcation_curves is not None
    assert found.bifurcation_curves.parameters == found.unfolding_map.parameters
    assert found.grazing_curves is not None
    (line,) = found.grazing_curves
    ax = found.plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "graze of the right stop" in texts
    assert "grazing, right stop" not in texts  # from the points of the map
    assert lines_from(ax, [0.5, 0.24], [0.9, 0.24])
    assert (line.stop, ax.get_ylabel()) == (1, r"forcing frequency $\omega$")
    assert "curve" in found.summary()

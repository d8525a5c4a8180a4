"""Maps and diagrams over any parameters: what is refused, equal requests, results, pictures."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.contour import QuadContourSet

from grazemap.client.arguments import validated
from grazemap.client.process_methods import METHODS
from grazemap.errors import ParameterError
from grazemap.results import UnfoldingMap
from grazemap.results.base import decode_result
from grazemap.wire import Oscillator, canonical, canonical_id, parse_request
from grazemap.wire.planes import Axis, with_parameter
from tests.support.sdk_documents import AXES, npz

OMEGA = {"vary": "omega", "values": {"start": 0.26, "stop": 0.3, "points": 4}}
RESTITUTION = {"vary": "restitution", "values": {"start": 0.5, "stop": 0.9, "points": 3}}
RIGHT = {"vary": "clearance_right", "values": [1.0, 1.5, 2.0]}
MASS = {"vary": "masses[2]", "values": [9.0, 10.0]}
BASE = {"horizontal": OMEGA, "vertical": RESTITUTION, "clearance": 1.6}
DENSE = {"matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]}, "forcing": [1.0]}


def refused(process, body):
    with pytest.raises(ParameterError) as caught:
        validated(process, body)
    return {error.pointer: error.allowed for error in caught.value.problem.errors}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vertical": OMEGA}, "/vertical/vary"),
        ({"vertical": None}, "/vertical"),
        ({"horizontal": None}, "/horizontal"),
        ({"horizontal": RIGHT, "vertical": {**RIGHT, "vary": "clearance"}, "clearance": None}, "/vertical/vary"),
        ({"vertical": {**RESTITUTION, "vary": "speed"}}, "/vertical/vary"),
        ({"vertical": {**RESTITUTION, "vary": "masses[0]"}}, "/vertical/vary"),
        ({"vertical": {**MASS, "vary": "masses[4]"}}, "/vertical/vary"),
        ({"vertical": {**MASS, "vary": "dampings[1]"}}, "/vertical/vary"),
        ({"vertical": MASS, "oscillator": DENSE}, "/vertical/vary"),
        ({"vertical": {"vary": "bias", "values": [0.0, 1.0]}}, "/vertical/vary"),
        (
            {"vertical": {"vary": "forcing", "values": [0.5, 1.0]}, "oscillator": {"forcing": [0, 0, 0]}},
            "/vertical/vary",
        ),
        ({"vertical": {"vary": "restitution", "values": [0.5, 1.5]}}, "/vertical/values"),
        ({"vertical": {"vary": "forcing", "values": [0.0, 1.0]}}, "/vertical/values"),
        ({"vertical": {"vary": "damping", "values": [-1.0, 1.0]}}, "/vertical/values"),
        ({"vertical": {**MASS, "values": [0.0, 1.0]}}, "/vertical/values"),
        ({"vertical": {"vary": "restitution", "values": [0.9, 0.5]}}, "/vertical/values"),
        ({"omega": 0.29}, "/omega"),
        ({"horizontal": MASS}, "/omega"),
        ({"horizontal": MASS, "omega": {"start": 0.2, "stop": 0.3, "points": 3}}, "/omega"),
        ({"clearance": None}, "/clearance"),
        ({"clearance": {"start": 1.0, "stop": 2.0, "points": 3}}, "/clearance"),
        ({"vertical": RIGHT}, "/clearance"),
        ({"vertical": RIGHT, "clearance": {"right": 1.0, "left": 1.0}}, "/clearance/right"),
        ({"vertical": RIGHT, "clearance": {"left": -1.2}}, "/clearance"),
        ({"clearance": {"right": None, "left": None}}, "/clearance"),
        ({"resolve_sensitive": True, "policy": "sweep-up"}, "/resolve_sensitive"),
    ],
)
def test_a_plane_that_is_none_is_refused_by_the_field_and_the_allowed_range(changes, pointer):
    body = {name: value for name, value in {**BASE, **changes}.items() if value is not None}
    errors = refused("unfolding-maps", body)
    assert list(errors) == [pointer]
    assert errors[pointer]


@pytest.mark.parametrize("field", ["omega", "clearance"])
def test_a_map_without_axes_needs_both_ranges(field):
    body = {"omega": OMEGA["values"], "clearance": OMEGA["values"]}
    for given in ({name: value for name, value in body.items() if name != field}, {**body, field: 1.0}):
        assert list(refused("unfolding-maps", given)) == [f"/{field}"]


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vary": "omega", "omega": 0.29}, "/omega"),
        ({"vary": "clearance"}, "/clearance"),
        ({"vary": "restitution", "omega": None}, "/omega"),
        ({"vary": "restitution", "clearance": None}, "/clearance"),
        ({"vary": "speed"}, "/vary"),
        ({"vary": "bias"}, "/vary"),
        ({"vary": "restitution", "range": [0.5, 2.0]}, "/range"),
    ],
)
def test_a_line_that_is_none_is_refused_by_the_field_and_the_allowed_range(changes, pointer):
    body = {"vary": "damping", "range": [0.5, 1.0], "omega": 0.29, "clearance": 1.6} | changes
    errors = refused("bifurcation-diagrams", {name: value for name, value in body.items() if value is not None})
    assert list(errors) == [pointer]
    assert errors[pointer]


def identity(**body):
    return canonical_id("unfolding-maps", canonical(parse_request("unfolding-maps", body)), "0")


def test_equal_planes_have_one_id():
    up = {"start": 1.0, "stop": 2.0, "points": 3}
    ranges = identity(omega=OMEGA["values"], clearance=up)
    assert identity(horizontal=OMEGA, vertical={"vary": "clearance", "values": up}) == ranges
    one = identity(omega=OMEGA["values"], clearance={"right": [1.0, 1.5, 2.0], "left": 1.2})
    assert identity(horizontal=OMEGA, vertical=RIGHT, clearance={"left": 1.2}) == one
    both = identity(**BASE)
    assert identity(**{**BASE, "clearance": {"right": 1.6, "left": 1.6}}) == both
    assert len({ranges, one, both, identity(horizontal=RESTITUTION, vertical=OMEGA, clearance=1.6)}) == 4


def test_a_parameter_is_changed_in_every_form_of_an_oscillator():
    chain = Oscillator(damping=[0.1, 0.2, 0.3], bias=[1.0, 0.0, 2.0], base={"amplitude": 0.5, "stops_move": True})
    assert with_parameter(chain, "dampings[2]", 0.7).damping == [0.1, 0.7, 0.3]
    assert with_parameter(chain, "damping", 2.0).damping == [0.2, 0.4, 0.6]
    assert with_parameter(chain, "stiffnesses[3]", 4.0).stiffnesses == [1.0, 5.0, 4.0]
    assert with_parameter(chain, "bias", 3.0).bias == [3.0, 0.0, 6.0]
    moved = with_parameter(chain, "forcing", 2.0)
    assert moved.base is not None
    assert (moved.base.amplitude, moved.forcing) == (1.0, [0.0, 0.0, 0.0])
    left = with_parameter(Oscillator(), "restitution_left", 0.5).restitution
    assert (left.right, left.left) == (0.8, 0.5)
    one = {"mass": [[1.0]], "stiffness": [[1.0]]}
    for damping, scaled in [
        ([[0.1]], [[0.2]]),
        ({"modal": 0.1}, {"modal": 0.2}),
        ({"modal": [0.1]}, {"modal": [0.2]}),
        ({"rayleigh": [0.1, 0.2]}, {"rayleigh": [0.2, 0.4]}),
    ]:
        dense = Oscillator(matrices={**one, "damping": damping}, forcing=[1.0])
        assert with_parameter(dense, "damping", 2.0).model_dump()["matrices"]["damping"] == scaled


def test_a_result_has_the_values_by_role_and_by_name():
    found = decode_result(npz(AXES))
    assert isinstance(found, UnfoldingMap)
    np.testing.assert_array_equal(found.horizontal, [0.5, 0.7, 0.9])
    np.testing.assert_array_equal(found.omega, [0.2, 0.3])
    assert found.clearance is None
    assert found.parameters == ("restitution", "omega")
    point = found.at(0.52, 0.3)
    assert (point.horizontal, point.vertical, point.omega) == (0.5, 0.3, 0.3)
    assert point.clearance == {"right": 1.6, "left": None}
    assert point.request is not None
    assert point.request["oscillator"]["restitution"] == 0.5
    request = found.zoom((0.6, 0.7), (0.25, 0.3))
    assert (request["horizontal"], request["vertical"]) == (("restitution", 0.6, 0.7), ("omega", 0.25, 0.3))
    with pytest.raises(ValueError, match="restitution = 2 is outside the map"):
        found.at(2.0, 0.3)


def test_a_dataset_has_the_parameters_as_coordinates():
    data = decode_result(npz(AXES)).to_xarray()
    assert data["kind"].dims == ("omega", "restitution")
    np.testing.assert_array_equal(data["restitution"], [0.5, 0.7, 0.9])


def test_the_grazing_curves_are_drawn_where_the_margins_are_zero():
    found = decode_result(npz(AXES))
    assert isinstance(found, UnfoldingMap)
    ax = found.plot()
    assert ax.get_xlabel() == "restitution $R$"
    assert "grazing, right stop" in [text.get_text() for text in ax.get_legend().get_texts()]
    (curve,) = [one for one in ax.collections if isinstance(one, QuadContourSet)]
    (segment,) = curve.allsegs[0]
    np.testing.assert_allclose(segment[:, 1], 0.2 + 0.1 * 2.0 / 3.0)
    assert "restitution: 0.5 to 0.9" in found._repr_html_()


def test_axes_are_given_by_name_and_values():
    given = {"clearance": 1.6, "vertical": ("restitution", [0.5, 0.9]), "shape": (2, 8)}
    request, _ = METHODS["unfolding_map"].asked(**given, horizontal=("omega", 0.26, 0.3))
    assert request.horizontal.model_dump() == {"vary": "omega", "values": {"start": 0.26, "stop": 0.3, "points": 8}}
    assert request.vertical.model_dump() == {"vary": "restitution", "values": [0.5, 0.9]}
    axis = Axis(vary="omega", values=[0.2, 0.3])
    assert METHODS["unfolding_map"].asked(**given, horizontal=axis)[0].horizontal == axis
    with pytest.raises(ParameterError):
        METHODS["unfolding_map"].asked(**given, horizontal="omega")

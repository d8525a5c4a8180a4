"""Maps, diagrams and windows over any two parameters: what is refused, equal requests, results, pictures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.contour import QuadContourSet

from grazemap.client.process_methods import METHODS
from grazemap.errors import ParameterError
from grazemap.validation import validated
from grazemap.wire import Oscillator, canonical_id, parse_request
from grazemap.wire.planes import Axis, WindowAxis, with_parameter
from tests.support.sdk_documents import AXES, CURVES_OF_AXES, DIAGRAM_OF_AXES, result_of
from tests.support.sdk_refusals import refused

MAP, WINDOW, DIAGRAM = "unfolding-maps", "bifurcation-curves", "unfolding-diagrams"
MOTION = {"period": 1, "stops": [1]}
ORBIT = {**MOTION, "phases": [0.1], "velocities": [0.2]}
DENSE = {"matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]}, "forcing": [1.0]}


def values(process, start, stop):
    """Values between two, as a process takes them: a window has no points."""
    return {"start": start, "stop": stop} | ({} if process == WINDOW else {"points": 4})


def axis(process, vary, start, stop):
    return {"vary": vary, "values": values(process, start, stop)}


def base(process):
    """A request over omega and the coefficient of restitution."""
    axes = {"horizontal": axis(process, "omega", 0.26, 0.3), "vertical": axis(process, "restitution", 0.5, 0.9)}
    return {**axes, "clearance": 1.6}


def pointers(process, body):
    """The fields by which a request is refused; each says what is allowed."""
    errors = refused(validated, process, {name: value for name, value in body.items() if value is not None})
    assert all(allowed for _, allowed in errors.values())
    return list(errors)


@pytest.mark.parametrize("process", [MAP, WINDOW, DIAGRAM])
def test_a_plane_that_is_none_is_refused_by_the_field_and_the_allowed_range(process):
    omega, up = (axis(process, "omega", 0.26, 0.3), axis(process, "clearance_right", 1.0, 2.0))
    for changes, pointer in (
        ({"vertical": omega}, "/vertical/vary"),
        ({"vertical": None}, "/vertical"),
        ({"horizontal": None}, "/horizontal"),
        ({"horizontal": up, "vertical": {**up, "vary": "clearance"}, "clearance": None}, "/vertical/vary"),
        ({"vertical": axis(process, "speed", 0.5, 0.9)}, "/vertical/vary"),
        ({"vertical": axis(process, "bias", 0.0, 1.0)}, "/vertical/vary"),
        ({"vertical": axis(process, "restitution", 0.5, 1.5)}, "/vertical/values/stop"),
        ({"vertical": axis(process, "restitution", 0.9, 0.5)}, "/vertical/values"),
        ({"omega": 0.29}, "/omega"),
        ({"clearance": None}, "/clearance"),
        ({"clearance": values(process, 1.0, 2.0)}, "/clearance"),
        ({"vertical": up}, "/clearance"),
    ):
        assert pointers(process, {**base(process), **changes}) == [pointer], changes


MASS = {"vary": "masses[2]", "values": [9.0, 10.0]}
RIGHT = {"vary": "clearance_right", "values": [1.0, 1.5, 2.0]}


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vertical": {**MASS, "vary": "masses[0]"}}, "/vertical/vary"),
        ({"vertical": {**MASS, "vary": "masses[4]"}}, "/vertical/vary"),
        ({"vertical": {**MASS, "vary": "dampings[1]"}}, "/vertical/vary"),
        ({"vertical": MASS, "oscillator": DENSE}, "/vertical/vary"),
        (
            {"vertical": {"vary": "forcing", "values": [0.5, 1.0]}, "oscillator": {"forcing": [0, 0, 0]}},
            "/vertical/vary",
        ),
        ({"vertical": {"vary": "forcing", "values": [0.0, 1.0]}}, "/vertical/values/0"),
        ({"vertical": {"vary": "damping", "values": [-1.0, 1.0]}}, "/vertical/values/0"),
        ({"vertical": {**MASS, "values": [0.0, 1.0]}}, "/vertical/values/0"),
        ({"vertical": {"vary": "restitution", "values": [0.9, 0.5]}}, "/vertical/values"),
        ({"horizontal": MASS}, "/omega"),
        ({"horizontal": MASS, "omega": {"start": 0.2, "stop": 0.3, "points": 3}}, "/omega"),
        ({"vertical": RIGHT, "clearance": {"right": 1.0, "left": 1.0}}, "/clearance/right"),
        ({"vertical": RIGHT, "clearance": {"left": -1.2}}, "/clearance"),
        ({"clearance": {"right": None, "left": None}}, "/clearance"),
    ],
)
def test_a_map_of_an_oscillator_that_is_none_is_refused_by_the_field(changes, pointer):
    assert pointers(MAP, {**base(MAP), **changes}) == [pointer]


UP = axis(WINDOW, "clearance_right", 1.0, 2.0)


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vertical": {"vary": "restitution", "values": values(MAP, 0.26, 0.3)}}, "/vertical/values"),
        ({"omega": values(WINDOW, 0.26, 0.3)}, "/omega"),
        ({"vertical": UP, "clearance": {"right": values(WINDOW, 0.26, 0.3)}}, "/clearance/right"),
        ({"horizontal": UP, "clearance": {"left": 1.2}, "motions": [MOTION]}, "/omega"),
        ({"vertical": axis(WINDOW, "masses[2]", 9.0, 10.0)}, "/motions"),
        (
            {"horizontal": UP, "vertical": {**UP, "vary": "clearance_left"}, "clearance": None, "omega": 0.28},
            "/motions",
        ),
        (
            {
                "horizontal": UP,
                "vertical": {**UP, "vary": "clearance_left"},
                "clearance": None,
                "omega": 0.28,
                "motions": [{**MOTION, "clearance": 1.5}],
            },
            "/motions/0",
        ),
        ({"motions": [{**MOTION, "omega": 0.31}]}, "/motions/0/omega"),
        ({"motions": [{**MOTION, "clearance": 1.6}]}, "/motions/0"),
        ({"motions": [{**MOTION, "horizontal": 0.28, "vertical": 1.0}]}, "/motions/0/vertical"),
        ({"motions": [MOTION, {**ORBIT, "horizontal": 0.28}]}, "/motions/1/vertical"),
        ({"motions": [{**MOTION, "stops": [-1]}], "clearance": {"right": 1.6}}, "/motions/0/stops"),
    ],
)
def test_a_window_without_its_motions_is_refused_by_the_field(changes, pointer):
    assert pointers(WINDOW, {**base(WINDOW), **changes}) == [pointer]


@pytest.mark.parametrize("process", [MAP, WINDOW])
@pytest.mark.parametrize("field", ["omega", "clearance"])
def test_without_axes_both_ranges_are_needed(process, field):
    body = {"omega": values(process, 0.26, 0.3), "clearance": values(process, 1.5, 2.0)}
    for changes in ({field: None}, {field: 1.0}):
        assert pointers(process, body | changes) == [f"/{field}"]


def test_an_error_of_a_motion_is_at_the_field_that_was_sent():
    """Also where axes of omega and clearance mean the same as intervals."""
    ranges = {"omega": values(WINDOW, 0.26, 0.3), "clearance": values(WINDOW, 1.5, 2.0)}
    axes = {"horizontal": axis(WINDOW, "omega", 0.26, 0.3), "vertical": axis(WINDOW, "clearance", 1.5, 2.0)}
    for window, motion, field in (
        (axes, {**MOTION, "horizontal": 0.5}, "horizontal"),
        (axes, {**MOTION, "omega": 0.31, "vertical": 1.9}, "omega"),
        (axes, {**ORBIT, "horizontal": 0.28}, "vertical"),
        (ranges, {**MOTION, "vertical": 2.6}, "clearance"),
        (ranges, {**ORBIT, "omega": 0.27}, "clearance"),
    ):
        assert pointers(WINDOW, {**window, "motions": [motion]}) == [f"/motions/0/{field}"]
    for place in ({"horizontal": 0.28, "vertical": 1.9}, {"omega": 0.28, "clearance": 1.9}):
        request = parse_request(WINDOW, {**axes, "motions": [{**MOTION, **place}]})
        assert (request.motions[0].horizontal, request.motions[0].vertical) == (0.28, 1.9)


@pytest.mark.parametrize(
    ("changes", "pointer"),
    [
        ({"vary": "omega", "omega": 0.29}, "/omega"),
        ({"vary": "clearance"}, "/clearance"),
        ({"vary": "restitution", "omega": None}, "/omega"),
        ({"vary": "restitution", "clearance": None}, "/clearance"),
        ({"vary": "speed"}, "/vary"),
        ({"vary": "bias"}, "/vary"),
        ({"vary": "restitution", "range": [0.5, 2.0]}, "/range/1"),
    ],
)
def test_a_line_that_is_none_is_refused_by_the_field_and_the_allowed_range(changes, pointer):
    body = {"vary": "damping", "range": [0.5, 1.0], "omega": 0.29, "clearance": 1.6}
    assert pointers("bifurcation-diagrams", body | changes) == [pointer]


def identity(process, **body):
    return canonical_id(process, parse_request(process, body).canonical(), "0")


@pytest.mark.parametrize("process", [MAP, WINDOW, DIAGRAM])
def test_equal_planes_have_one_id(process):
    omega, up = values(process, 0.26, 0.3), values(process, 1.0, 2.0)
    across = {"horizontal": {"vary": "omega", "values": omega}}
    ranges = identity(process, omega=omega, clearance=up)
    assert identity(process, **across, vertical={"vary": "clearance", "values": up}) == ranges
    fixed_left = identity(process, omega=omega, clearance={"right": up, "left": 1.2})
    right = {"vary": "clearance_right", "values": up}
    assert identity(process, **across, vertical=right, clearance={"left": 1.2}) == fixed_left
    both = identity(process, **base(process))
    assert identity(process, **{**base(process), "clearance": {"right": 1.6, "left": 1.6}}) == both
    swapped = {"horizontal": base(process)["vertical"], "vertical": base(process)["horizontal"]}
    assert len({ranges, fixed_left, both, identity(process, **swapped, clearance=1.6)}) == 4


def test_the_id_of_a_window_has_what_its_curves_depend_on():
    ranges = {"omega": values(WINDOW, 0.26, 0.3), "clearance": values(WINDOW, 1.0, 2.0)}
    axes = {"horizontal": axis(WINDOW, "omega", 0.26, 0.3), "vertical": axis(WINDOW, "clearance", 1.0, 2.0)}
    place, same = ({**MOTION, "omega": 0.28, "clearance": 1.5}, {**MOTION, "horizontal": 0.28, "vertical": 1.5})
    assert identity(WINDOW, **axes, motions=[same]) == identity(WINDOW, **ranges, motions=[place])
    # continued curves have no number of frequencies
    assert identity(WINDOW, **base(WINDOW), points=7) == identity(WINDOW, **base(WINDOW))
    explicit = {**base(WINDOW), "vertical": axis(WINDOW, "forcing", 0.8, 1.2)}
    assert identity(WINDOW, **explicit, points=7) != identity(WINDOW, **explicit)
    assert parse_request(WINDOW, ranges).canonical().keys() == {*axes, "oscillator", "max_multiple", "points"}
    motion = parse_request(WINDOW, {**ranges, "motions": [MOTION]}).canonical()
    assert motion.keys() == {*axes, "oscillator", "motions"}
    assert motion["motions"][0].keys() == {"period", "stops", "phases", "velocities"}


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
    undamped = {"mass": [[1.0]], "stiffness": [[1.0]]}
    for damping, scaled in [
        ([[0.1]], [[0.2]]),
        ({"modal": 0.1}, {"modal": 0.2}),
        ({"modal": [0.1]}, {"modal": [0.2]}),
        ({"rayleigh": [0.1, 0.2]}, {"rayleigh": [0.2, 0.4]}),
    ]:
        dense = Oscillator(matrices={**undamped, "damping": damping}, forcing=[1.0])
        assert with_parameter(dense, "damping", 2.0).model_dump()["matrices"]["damping"] == scaled


def test_a_result_has_the_values_by_role_and_by_name():
    result = result_of(AXES)
    np.testing.assert_array_equal(result.horizontal, [0.5, 0.7, 0.9])
    np.testing.assert_array_equal(result.omega, [0.2, 0.3])
    assert result.clearance is None
    assert result.parameters == ("restitution", "omega")
    point = result.at(0.52, 0.3)
    assert (point.horizontal, point.vertical, point.omega) == (0.5, 0.3, 0.3)
    assert point.clearance == {"right": 1.6, "left": None}
    assert point.request is not None
    assert point.request["oscillator"]["restitution"] == 0.5
    request = result.zoom((0.6, 0.7), (0.25, 0.3))
    assert (request["horizontal"], request["vertical"]) == (("restitution", 0.6, 0.7), ("omega", 0.25, 0.3))
    with pytest.raises(ValueError, match="restitution = 2 is outside the map"):
        result.at(2.0, 0.3)
    with pytest.raises(ValueError, match=r"omega = 0\.5 is outside the map"):
        result.zoom((0.6, 0.7), (0.25, 0.5))
    data = result.to_xarray()
    assert data["kind"].dims == ("omega", "restitution")
    np.testing.assert_array_equal(data["restitution"], [0.5, 0.7, 0.9])


def test_the_grazing_curves_are_drawn_where_the_margins_are_zero():
    result = result_of(AXES)
    ax = result.plot()
    assert ax.get_xlabel() == "restitution $R$"
    assert "grazing, right stop" in [text.get_text() for text in ax.get_legend().get_texts()]
    (curve,) = [artist for artist in ax.collections if isinstance(artist, QuadContourSet)]
    (segment,) = curve.allsegs[0]
    np.testing.assert_allclose(segment[:, 1], 0.2 + 0.1 * 2.0 / 3.0)
    assert "restitution: 0.5 to 0.9" in result._repr_html_()


def test_axes_are_given_by_name_and_values():
    keywords = {"clearance": 1.6, "vertical": ("restitution", [0.5, 0.9]), "shape": (2, 8)}
    request, *_ = METHODS["unfolding_map"].request_for(**keywords, horizontal=("omega", 0.26, 0.3))
    assert request.horizontal.model_dump() == {"vary": "omega", "values": {"start": 0.26, "stop": 0.3, "points": 8}}
    assert request.vertical.model_dump() == {"vary": "restitution", "values": [0.5, 0.9]}
    axis = Axis(vary="omega", values=[0.2, 0.3])
    keywords["shape"] = (2, 2)
    assert METHODS["unfolding_map"].request_for(**keywords, horizontal=axis)[0].horizontal == axis
    with pytest.raises(ParameterError):
        METHODS["unfolding_map"].request_for(**keywords, horizontal="omega")


def test_axes_of_a_window_are_given_by_name_start_and_stop():
    def asked(**keywords):
        return METHODS["bifurcation_curves"].request_for(**keywords)[0]

    plane = {
        "clearance": 1.6,
        "horizontal": ("omega", 0.26, 0.3),
        "vertical": WindowAxis(**axis(WINDOW, "restitution", 0.5, 0.9)),
    }
    request = asked(**plane, motions=[(1, [1])])
    assert request.horizontal.model_dump() == axis(WINDOW, "omega", 0.26, 0.3)
    assert request.plane.shape == (2, 2)
    assert [(motion.period, motion.stops) for motion in request.motions] == [(1, [1])]
    with pytest.raises(ParameterError):
        asked(**plane | {"horizontal": ("omega", [0.26, 0.3])})
    orbit = result_of("periodic-orbits")
    with pytest.raises(ParameterError):
        asked(**plane, motions=[orbit])  # it does not say which restitution it has
    sides = {"horizontal": ("clearance_right", 1.0, 2.0), "vertical": ("clearance_left", 1.0, 2.0)}
    (motion,) = asked(omega=0.27, **sides, motions=[orbit]).motions
    assert (motion.horizontal, motion.vertical, motion.stops) == (1.85, 1.85, [1, -1])


def test_curves_of_other_parameters_are_drawn_over_a_map_of_the_same_ones():
    umap, same, other = (result_of(name) for name in (AXES, CURVES_OF_AXES, "bifurcation-curves"))
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
    ("name", "motions"),
    [(CURVES_OF_AXES, "with one impact"), ("bifurcation-curves", "with one impact, or one on either stop")],
)
def test_curves_of_one_impact_have_both_stops_in_the_title_where_these_are_alike(name, motions):
    result = result_of(name)
    assert replace(result, motions=()).plot().get_title() == f"Bifurcation curves of motions {motions}"
    assert result.plane is result.plane


def lines_from(ax, start, stop):
    """The lines of a picture between two points."""
    ends = (line.get_xydata()[[0, -1]] for line in ax.lines if len(line.get_xydata()))
    return [pair for pair in ends if np.allclose(pair, [start, stop])]


def test_an_orbit_of_a_curve_of_any_plane_has_the_oscillator_there():
    result = result_of(CURVES_OF_AXES)
    (curve,) = result.curves
    assert curve.omega is None
    np.testing.assert_array_equal(curve.line, [[0.6, 0.25], [0.7, 0.3]])
    orbit = result.orbit(curve, 1)
    assert (orbit["oscillator"]["restitution"], orbit["omega"]) == (0.7, 0.3)
    assert orbit["clearance"] == {"right": 1.6, "left": None}
    assert parse_request("periodic-orbits", orbit)
    with pytest.raises(ValueError, match="use BifurcationCurves"):
        curve.orbit(1)


def test_a_diagram_of_any_plane_has_its_own_grazing_curves():
    result = result_of(DIAGRAM_OF_AXES)
    assert result.grazing_curve is None
    assert result.codimension_two_points is None
    assert result.bifurcation_curves is not None
    assert result.bifurcation_curves.parameters == result.unfolding_map.parameters
    assert result.grazing_curves is not None
    (line,) = result.grazing_curves
    ax = result.plot()
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "graze of the right stop" in texts
    assert "grazing, right stop" not in texts  # from the points of the map
    assert lines_from(ax, [0.5, 0.24], [0.9, 0.24])
    assert (line.stop, ax.get_ylabel()) == (1, r"forcing frequency $\omega$")
    assert "curve" in result.summary()

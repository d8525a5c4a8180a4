"""Arguments become the wire model of a request, or an exception that names the place."""

import inspect
import itertools
import math
from array import array
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import xarray
from pydantic import ValidationError

from grazemap import AsyncClient, Client, Oscillator
from grazemap.client.process_methods import METHODS, ProcessMethod
from grazemap.errors import ParameterError
from grazemap.results import GrazingCurve
from grazemap.validation import validated
from grazemap.wire import (
    PROCESSES,
    ClearancePair,
    Grid,
    InitialState,
    Interval,
    Operation,
    ProcessRequest,
    Range,
    UnfoldingMapsRequest,
    canonical_id,
    parse_request,
)
from grazemap.wire.planes import Axis
from tests.support.sdk_documents import result_of
from tests.support.sdk_refusals import refused


def asked(name, *arguments, **keywords):
    """Return the request that a method of the clients sends."""
    return METHODS[name].request_for(*arguments, **keywords)[0]


def umap(omega, clearance, shape) -> UnfoldingMapsRequest:
    return asked("unfolding_map", omega=omega, clearance=clearance, shape=shape)


def test_a_pair_with_a_number_of_points_is_a_range():
    request = asked("grazing_curve", omega=(0.05, 1.2), points=2000)
    assert request.axis.values.model_dump() == {"start": 0.05, "stop": 1.2, "points": 2000}
    assert request.oscillator == Oscillator()


@pytest.mark.parametrize(
    "values",
    [
        [0.1, 0.2],
        (0.1, 0.2, 0.4),
        np.array([0.1, 0.2]),
        range(1, 4),
        range(1, 3),
        array("d", [1.0, 2.0, 3.0]),
        xarray.DataArray([1.0, 2.0]),
    ],
)
def test_any_sequence_and_anything_numpy_reads_is_the_values(values):
    assert asked("grazing_curve", omega=values).axis.values == [float(value) for value in values]
    if not isinstance(values, tuple):
        assert list(refused(asked, "grazing_curve", omega=values, points=9)) == ["/omega"]


@pytest.mark.parametrize("values", [Range(start=0.1, stop=0.2, points=5), {"start": 0.1, "stop": 0.2, "points": 5}])
def test_points_must_agree_with_those_of_a_range(values):
    for points in (None, 5):
        assert asked("grazing_curve", omega=values, points=points).axis.values.points == 5
    assert "another number" in refused(asked, "grazing_curve", omega=values, points=9)["/omega"][0]


def test_numpy_scalars_are_numbers():
    for number in (0.1, np.float64(0.1), np.array(0.1)):
        assert Oscillator(damping=number).damping == 0.1
    restitution = {"restitution": np.float64(0.5)}
    path = {"oscillator": restitution, "omega": np.float64(0.3), "clearance": 1.5, "periods": np.int64(4)}
    request = validated("trajectories", path)
    assert (request.omega, request.periods, request.oscillator.restitution) == (0.3, 4, 0.5)
    assert asked("grazing_curve", omega=[1, 2], sequence=np.True_).sequence is True


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda values: array("d", values), xarray.DataArray])
def test_lists_in_mappings_and_models_are_any_sequence_too(kind):
    values = kind([1.0, 2.0, 3.0])
    assert Oscillator(masses=values).masses == [1.0, 2.0, 3.0]
    assert InitialState(velocity=values).velocity == [1.0, 2.0, 3.0]
    assert asked("grazing_curve", {"damping": values}, omega=[1, 2]).oscillator.damping == [1.0, 2.0, 3.0]


PATH = {"omega": 0.3, "clearance": 1.5, "periods": 2}


def test_a_state_of_none_is_rest_as_the_default_is():
    path = {"omega": 0.29, "clearance": 1.6, "periods": 2}
    assert asked("trajectory", **path) == asked("trajectory", **path, initial=None)


@pytest.mark.parametrize("shape", [(2, 3), [2, 3], np.array([2, 3]), np.array([2, 3], np.int16)])
def test_a_shape_is_any_two_numbers_also_beside_lists_of_as_many_values(shape):
    for omega, clearance in (((0.2, 0.3), (1.5, 1.6)), ([0.2, 0.25, 0.3], [1.5, 1.6])):
        request = asked("unfolding_map", omega=omega, clearance=clearance, shape=shape)
        assert request.plane.shape == (2, 3)
    with pytest.raises(ParameterError, match="shape gives another number"):
        asked("unfolding_map", omega=[0.2, 0.3], clearance=[1.5, 1.6], shape=shape)


def test_three_numbers_whose_last_is_whole_in_any_type_are_no_values():
    for number in (5, np.int64(5), np.uint8(5)):
        with pytest.raises(ParameterError, match="three numbers"):
            asked("grazing_curve", omega=(0.2, 0.3, number))


def test_times_take_the_place_of_evenly_spaced_samples():
    plain = validated("trajectories", PATH).canonical()
    assert plain["samples_per_period"] == 200
    assert "times" not in plain
    asked = validated("trajectories", {**PATH, "times": np.array([0, 1.5])}).canonical()
    assert asked["times"] == [0.0, 1.5]
    assert "samples_per_period" not in asked
    # what a worker parses is the same question again
    assert validated("trajectories", asked).canonical() == asked


def test_a_request_of_an_earlier_version_keeps_its_id():
    # of the version before there were times and lists of states
    known = "b054270bdec750d3644de0568904420db1ae72967fbd2de77798886b73d71035"
    body = {"omega": 0.29, "clearance": 1.6, "periods": 2}
    for extra in ({}, {"samples_per_period": 200, "initial": {"phase": 0}}, {"times": None}):
        assert canonical_id("trajectories", validated("trajectories", {**body, **extra}).canonical(), "0.1.0") == known
    listed = validated("trajectories", {**body, "initial": [{}]})
    assert canonical_id("trajectories", listed.canonical(), "0.1.0") != known


def test_states_of_a_list_are_written_out_one_by_one():
    request = validated("trajectories", {**PATH, "initial": ({}, {"velocity": (0, 0, 1)})})
    assert [state.velocity for state in request.states] == [[0.0] * 3, [0.0, 0.0, 1.0]]
    assert validated("trajectories", request.canonical()).canonical() == request.canonical()
    for states in (np.array([{}], dtype=object), iter([{}])):
        assert "/initial" in refused(validated, "trajectories", {**PATH, "initial": states})


def test_the_end_of_the_record_is_in_it_however_its_time_is_computed():
    for omega, periods in itertools.product((0.29, 0.1, 1 / 3, 7.3), (1, 3, 7, 200)):
        ends = (2 * math.pi * periods / omega, periods * 2 * math.pi / omega, periods * (2 * math.pi / omega))
        for end in ends:
            validated("trajectories", {"omega": omega, "clearance": 1.0, "periods": periods, "times": [end]})
        beyond = {"omega": omega, "clearance": 1.0, "periods": periods, "times": [0.0, ends[0] * (1 + 1e-14)]}
        assert list(refused(validated, "trajectories", beyond)) == ["/times/1"]


def test_shape_is_clearances_by_omegas_and_agrees_with_explicit_values():
    request = umap((0.26, 0.30), (1.3, 2.0), (64, 128))
    assert (request.vertical.values.points, request.horizontal.values.points) == (64, 128)
    assert umap((0.26, 0.30), [1.3, 1.5], (2, 128)).vertical.values == [1.3, 1.5]
    assert list(refused(umap, (0.26, 0.30), [1.3, 1.5], (3, 128))) == ["/clearance"]


def test_the_error_of_a_pair_without_points_names_what_is_missing():
    detail, allowed = refused(asked, "grazing_curve", omega=(0.1, 0.2))["/omega"]
    assert "points is missing" in detail
    assert "(start, stop)" in allowed
    assert "shape is missing" in refused(umap, (0.1, 0.2), (1, 2), None)["/omega"][0]


def test_the_error_of_the_clearance_of_one_stop_names_it():
    errors = refused(asked, "unfolding_map", omega=[0.2, 0.3], clearance={"right": (1.0, 2.0)})
    assert list(errors) == ["/clearance/right"]
    assert errors["/clearance/right"][0] == "clearance.right has a start and a stop, and shape is missing"
    errors = refused(asked, "bifurcation_curves", omega=(0.2, 0.3), clearance={"left": (1.0,)})
    assert errors["/clearance/left"][0] == "clearance.left is not an interval"


@pytest.mark.parametrize(("method", "shape"), [("unfolding_map", {"shape": (3, 4)}), ("bifurcation_curves", {})])
def test_clearances_of_both_stops_are_a_mapping_or_a_model(method, shape):
    axes = {"horizontal": ("omega", 0.2, 0.3), "vertical": ("restitution", 0.5, 0.9), **shape}
    pair = {"right": 1.6, "left": None}
    model = ClearancePair(**pair)
    assert asked(method, **axes, clearance=model) == asked(method, **axes, clearance=pair)
    ranges = {"omega": (0.2, 0.3), **shape}
    errors = refused(asked, method, **ranges, clearance=model)
    assert errors == refused(asked, method, **ranges, clearance=pair)
    assert list(errors) == ["/clearance"]


def test_what_is_missing_of_a_window_is_named_with_all_that_is_allowed():
    for keywords, field in (({}, "omega"), ({"omega": (0.2, 0.3)}, "clearance"), ({"clearance": (1.0, 2.0)}, "omega")):
        assert "start, stop" in refused(asked, "bifurcation_curves", **keywords)[f"/{field}"][1]
    result = result_of("periodic-orbits")
    for name, other in (("horizontal", "vertical"), ("vertical", "horizontal")):
        errors = refused(asked, "bifurcation_curves", **{name: ("omega", 0.2, 0.3)}, clearance=1.6, motions=[result])
        assert list(errors) == [f"/{other}"]
    assert "not an interval" in refused(branch, (1, [1]), range=None)["/range"][0]


@pytest.mark.parametrize(
    ("changes", "pointer", "allowed"),
    [
        ({"omega": -1.0}, "/omega", "> 0"),
        ({"omega": float("nan")}, "/omega", "finite"),
        ({"omega": True}, "/omega", "number"),
        ({"omega": "0.3"}, "/omega", "number"),
        ({"periods": 2.5}, "/periods", "integer"),
        ({"wobble": 1}, "", "samples_per_period"),
        ({"oscillator": {"restitution": 2}}, "/oscillator/restitution", "<= 1"),
        ({"oscillator": {"masses": [1, 0, 1]}}, "/oscillator/masses/1", "> 0"),
        ({"oscillator": {"damping": [-1]}}, "/oscillator/damping/0", ">= 0"),
        ({"oscillator": {"units": "si"}}, "/oscillator/units", 'one of "nondimensional", "SI"'),
    ],
)
def test_bad_values_are_refused_before_anything_is_sent(changes, pointer, allowed):
    assert allowed in refused(validated, "trajectories", PATH | changes)[pointer][1]


@pytest.mark.parametrize(
    ("wrong", "pointer", "told"),
    [
        ({"": 1}, "", 'Unknown field ""'),
        ({"[": 1}, "", 'Unknown field "["'),
        ({"oscillator": {"[range]": 1}}, "/oscillator", 'Unknown field "[range]"'),
        ({"omga": 1}, "", 'Unknown field "omga"; did you mean omega'),
        ({"wobble": 1}, "", 'Unknown field "wobble"'),
        ({"oscillator": {"mases": [1]}}, "/oscillator", 'Unknown field "mases"; did you mean masses'),
        ({"initial": [{}, {"phas": 1}]}, "/initial/1", 'Unknown field "phas"; did you mean phase'),
        ({"w" * 5000: 1}, "", f'Unknown field "{"w" * 64}"'),
    ],
)
def test_an_unknown_field_is_named_with_the_one_that_may_be_meant(wrong, pointer, told):
    assert refused(validated, "trajectories", PATH | wrong)[pointer][0] == told


def test_stops_that_are_allowed_are_numbers():
    assert refused(orbit, (1, [2]))["/motion/stops/0"][1] == "one of 1, -1"


@pytest.mark.parametrize("left", [(), None, 1.75])
def test_the_parts_of_a_diagram_are_the_requests_by_themselves(left):
    """Of equal stops, or of one whose clearance varies and another that is absent or fixed."""

    def clearance(values):
        return values if left == () else {"right": values, "left": left}

    omega, numbers = {"omega": (0.26, 0.3)}, {"max_order": 4, "max_multiple": 2}
    fixed = {} if left == () else {"clearance": {"left": left}}
    plane = {**omega, "clearance": clearance([1.3, 1.5, 2.0]), "shape": (3, 900), "max_periods": 500, "max_period": 16}
    whole = asked("unfolding_diagram", **plane, **numbers, borders=True)
    assert whole.unfolding_map == asked("unfolding_map", **plane)
    assert whole.grazing_curve == asked("grazing_curve", **omega, points=1800, max_order=4, **fixed)
    assert whole.codimension_two_points == asked("codimension_two_points", **omega, **numbers, **fixed)
    window = {**omega, "clearance": clearance((1.3, 2.0))}
    assert whole.bifurcation_curves == asked("bifurcation_curves", **window, max_multiple=2, points=1800)


def orbit(motion=None, initial=None):
    keywords = {"motion": motion, "initial": initial, "transient_periods": 100, "max_period": 8}
    return asked("periodic_orbit", omega=0.3, clearance=1.5, **keywords)


def branch(motion=None, vary="clearance", range=(1.4, 1.9)):
    keywords = {"transient_periods": 9, "max_period": 8, "vary": vary, "range": range, "max_points": 9}
    return asked("orbit_branch", omega=0.3, clearance=1.5, motion=motion, **keywords)


def mapping(overshoot):
    return asked("discontinuity_mapping", omega=0.3, overshoot=overshoot)


def basins(horizontal=("displacement", 2, [-1.0, 1.0]), shape=None, **initial):
    keywords = {"shape": shape, "max_periods": 100, "max_period": 8, **initial}
    vertical = ("velocity", 2, [0.0, 0.5])
    return asked("basins", omega=0.3, clearance=1.6, horizontal=horizontal, vertical=vertical, **keywords)


def test_coordinates_that_a_rectangle_replaces_are_not_part_of_the_request():
    request = basins(initial={"displacement": [0.1, 9.0, 0.2], "velocity": [0.3, 9.0, 0.4]})
    assert request == basins(initial={"displacement": [0.1, 0.0, 0.2], "velocity": [0.3, -7.0, 0.4]})
    assert request.initial.displacement == [0.1, 0.0, 0.2]
    assert basins() == basins(initial={"phase": 0})


def test_a_coordinate_that_a_rectangle_replaces_may_lie_outside_the_stops():
    across = ("displacement", 1, [-1.0, 1.0])
    assert basins(across, initial={"displacement": [9.0, 0.1, 0.2]}) == basins(
        across, initial={"displacement": [0.0, 0.1, 0.2]}
    )


def test_the_one_form_of_a_rectangle_between_two_masses_is_taken_again():
    initial = {"displacement": [5.0, 5.0, 0.0]}
    request = asked(
        "basins",
        oscillator={"contact": [1, 2]},
        omega=0.3,
        clearance=1.6,
        horizontal=("displacement", 1, [4.0, 6.0]),
        vertical=("velocity", 1, [0.0, 0.5]),
        initial=initial,
    )
    assert request.initial.displacement == [0.0, 5.0, 0.0]
    assert parse_request("basins", request.model_dump()) == request


def curves(motions, **keywords):
    return asked("bifurcation_curves", omega=(0.2, 0.3), clearance=(1.0, 2.0), motions=motions, **keywords)


def test_motions_of_a_window_are_given_in_several_ways():
    result = result_of("periodic-orbits")
    asked = curves([(1, [1, -1]), {"period": 1, "stops": np.array([1, -1]), "label": "1-1r-1l"}, result])
    first, second, third = asked.motions
    assert first.model_dump() == second.model_dump()  # a label adds nothing
    assert (third.horizontal, third.vertical, third.stops) == (0.27, 1.85, [1, -1])
    assert third.velocities == [0.25, -0.25]
    assert orbit(motion=result).motion.phases == third.phases
    # the numbers of closed forms are no part of a question for motions, and the other way round
    texts = [curves(None).canonical(), asked.canonical()]
    assert [sorted({"motions", "max_multiple", "points"} & set(text)) for text in texts] == [
        ["max_multiple", "points"],
        ["motions"],
    ]
    wider = curves([(1, [1, -1]), (1, [1, -1]), result], max_multiple=9, points=50)
    assert wider.canonical() == asked.canonical()


def test_windows_of_one_stop_and_the_orbits_in_them():
    result = replace(result_of("periodic-orbits"), clearance=math.nan, clearance_left=1.4)
    window = {"omega": (0.2, 0.3), "clearance": {"right": None, "left": (1.0, 2.0)}}
    (motion,) = asked("bifurcation_curves", **window, motions=[replace(result, stops=(-1, -1))]).motions
    assert motion.vertical == 1.4
    errors = refused(asked, "bifurcation_curves", **window, motions=[(1, [1])])
    assert list(errors) == ["/motions/0/stops"]
    window["clearance"] = {"right": 1.0, "left": 1.2}
    for motions in (None, [(1, [1])]):
        assert list(refused(asked, "bifurcation_curves", **window, motions=motions)) == ["/clearance"]
    window["clearance"] = {"right": (1.0,)}
    assert list(refused(asked, "bifurcation_curves", **window)) == ["/clearance/right"]
    window["clearance"] = {"right": "a"}
    assert list(refused(asked, "bifurcation_curves", **window)) == ["/clearance/right"]


@pytest.mark.parametrize("wrong", ["1-2r-2l", (1, [1], 2), 3])
def test_the_error_of_an_invalid_motion_shows_the_form_of_a_valid_one(wrong):
    for call, pointer in ((lambda: orbit(wrong), "/motion"), (lambda: curves([(1, [1]), wrong]), "/motions/1")):
        detail, allowed = refused(call)[pointer]
        assert "not a motion" in detail
        assert "(period, stops), e.g. (1, [1, 1, -1, -1])" in allowed


def test_an_orbit_that_was_not_found_is_refused_as_a_motion_with_the_reason():
    lost = replace(result_of("periodic-orbits"), converged=False, reason="Newton's method does not converge")
    for call, pointer in ((lambda: orbit(lost), "/motion"), (lambda: curves([lost]), "/motions/0")):
        assert refused(call)[pointer][0] == "this orbit was not found: Newton's method does not converge"


@pytest.mark.parametrize(
    ("model", "fields", "name", "told", "allowed"),
    [
        (Oscillator, {"restitution": 271828}, "restitution", "less than or equal to 1", "1"),
        (Oscillator, {"masses": [1, 0, 1]}, "masses.1", "greater than 0", "0"),
        (Oscillator, {"masses": [1, 1]}, "stiffnesses", "stiffnesses has 3 numbers", "of one length"),
        (Oscillator, {"mases": [1, 1]}, "mases", "did you mean masses", "units, masses, stiff"),
        (Oscillator, {"units": "si"}, "units", "Input is none of", 'one of "nondimensional", "SI"'),
        (InitialState, {"phase": "late"}, "phase", "valid number", "a finite number"),
        (InitialState, {"phas": 1.0}, "phas", "did you mean phase", "displacement, velocity, phase"),
        (Range, {"start": 1.0, "stop": 0.5, "points": 3}, "Range", "stop must be greater", "stop > start"),
        (
            UnfoldingMapsRequest,
            {"omega": [1, 2], "oscillator": {"damping": -1}},
            "oscillator.damping",
            "equal to 0",
            "0",
        ),
    ],
)
def test_a_model_made_with_wrong_fields_names_them_and_what_is_allowed(model, fields, name, told, allowed):
    with pytest.raises(ValidationError) as caught:
        model(**fields)
    place, _, text = str(caught.value).partition("\n  ")
    assert place.endswith(name)
    assert told in text
    assert allowed in text.partition("(allowed: ")[2]
    assert "errors.pydantic.dev" not in text
    assert "271828" not in text
    assert isinstance(caught.value, ValueError)


def test_a_model_and_a_request_say_the_same_of_a_field():
    wrong = {"mases": [1], "restitution": 2, "damping": [-1.0], "units": "si", "forcing": "x"}
    refusals = refused(asked, "grazing_curve", wrong, omega=[1.0, 2.0])
    with pytest.raises(ValidationError) as caught:
        Oscillator(**wrong)
    messages = {"/".join(map(str, error["loc"])): error["msg"] for error in caught.value.errors()}
    for pointer, (detail, allowed) in refusals.items():
        place = pointer.removeprefix("/oscillator").removeprefix("/") or "mases"
        assert messages[place] == f"{detail} (allowed: {allowed})"
    assert len(messages) == len(refusals) == 5


def test_fields_are_given_by_name():
    with pytest.raises(TypeError):
        Oscillator([1.0, 2.0])


@pytest.mark.parametrize("name", ["unfolding_map", "trajectory"])
def test_an_unknown_argument_of_a_method_is_named_with_the_nearest_and_those_there_are(client, service, name):
    with pytest.raises(
        TypeError, match=rf"^{name}\(\) has no argument omga; did you mean omega \(allowed: oscillator, "
    ):
        getattr(client, name)(omga=0.3, clearance=1.0)
    assert service.requests == []


def test_the_methods_of_the_asynchronous_client_are_coroutine_functions():
    assert all(inspect.iscoroutinefunction(getattr(AsyncClient, name)) for name in METHODS)


def test_a_process_that_is_misspelt_is_named_with_the_nearest_and_those_there_are(client):
    told = refused(client.submit, "unfolding_map", {})[""]
    assert "did you mean unfolding-maps" in told[0]
    assert "unfolding-maps" in told[1]


def test_an_interval_of_a_model_is_one_of_a_branch():
    request = branch((1, [1]), "clearance", Interval(start=1.0, stop=2.0))
    assert request.axis.ends == (1.0, 2.0)
    zero = branch((1, [1]), "restitution", (0, 1))
    assert zero.axis.ends == (0.0, 1.0)


@pytest.mark.parametrize(
    ("call", "pointer"),
    [
        (lambda: asked("grazing_curve", "x", omega=(0.1, 0.2), points=5), "/oscillator"),
        (lambda: asked("grazing_curve", 5, omega=(0.1, 0.2), points=5), "/oscillator"),
        (lambda: asked("grazing_curve", {1: 2}, omega=(0.1, 0.2), points=5), "/oscillator/1"),
        (lambda: Client().trajectory(omega=0.3, clearance=1.5, initial="rest", periods=4), "/initial"),
        (lambda: asked("grazing_curve", omega=0.3), "/omega"),
        (lambda: asked("grazing_curve", omega="0.3", points=3), "/omega"),
        (lambda: asked("grazing_curve", omega=np.array(0.3), points=5), "/omega"),
        (lambda: asked("grazing_curve", omega=np.array([[0.3, 0.4]])), "/omega/0"),
        (lambda: asked("codimension_two_points", omega=np.array(0.3)), "/omega"),
        (lambda: asked("codimension_two_points", omega=0.3), "/omega"),
        (lambda: mapping("1e-3"), "/overshoot/0"),
        (lambda: mapping(None), "/overshoot"),
        (lambda: orbit(motion=(1, [])), "/motion/stops"),
        (lambda: orbit(motion={"period": 1, "stops": [1], "phases": [0, 1], "velocities": [1]}), "/motion/phases"),
        (
            lambda: orbit(motion={"period": 1, "stops": [1, 1], "phases": [2, 1], "velocities": [1, 1]}),
            "/motion/phases",
        ),
        (lambda: orbit(motion=(1, [1]), initial={"phase": 1}), "/initial"),
        (lambda: branch(vary="clearance", range=(1.6, 1.9)), "/range"),
        (lambda: curves([(1, [1]), {"period": 1, "stops": [1], "omega": 0.4}]), "/motions/1/omega"),
        (
            lambda: curves([{"period": 1, "stops": [1], "phases": [1], "velocities": [1], "omega": 0.25}]),
            "/motions/0/clearance",
        ),
        (lambda: branch(vary="clearance", range=1.4), "/range"),
        (lambda: asked("bifurcation_diagram", omega=0.3, clearance=1.5), "/range"),
        (lambda: asked("bifurcation_diagram", omega=(0.2, 0.3), clearance=(1, 2), points=5), "/range"),
        (lambda: asked("bifurcation_diagram", omega=0.3, clearance=(1, 2)), "/clearance"),
        (lambda: basins(horizontal=("displacement", 1, (-1.0, 1.0))), "/horizontal/values"),
        (lambda: basins(horizontal=("displacement", 1, 0.5)), "/horizontal/values"),
        (lambda: basins(horizontal="x1"), "/horizontal"),
        (lambda: basins(initial={"displacement": [1.6, 0, 0]}), "/initial/displacement"),
        (lambda: basins(shape=3), "/shape"),
        (lambda: umap((0.1, 0.2), (1, 2), 5), "/shape"),
        (lambda: umap((0.1, 0.2), (1, 2), (5, 6, 7)), "/shape"),
        (lambda: umap((0.1, 0.2), (1, 2), "ab"), "/omega/points"),
        (lambda: validated("trajectories", None), ""),
        (lambda: validated("trajectories", 5), ""),
        (lambda: validated([], {}), ""),
    ],
)
def test_arguments_of_a_wrong_kind_are_parameter_errors(call, pointer):
    assert pointer in refused(call)


def test_a_request_of_another_process_is_refused_also_where_it_has_all_the_fields():
    whole = branch((1, [1]), range=(1.4, 1.9))
    assert validated("orbit-branches", whole) is whole
    for process in ("periodic-orbits", "unfolding-maps"):
        assert "another process" in refused(validated, process, whole)[""][0]


def test_the_exception_reads_as_plain_text():
    with pytest.raises(ParameterError, match=r"/omega: .*\(allowed: .*> 0"):
        validated("trajectories", PATH | {"omega": 0})


@pytest.mark.parametrize("process", PROCESSES)
def test_a_method_requires_what_its_request_requires(process):
    named = {method.process: name for name, method in METHODS.items()}
    parameters = inspect.signature(getattr(Client, named[process])).parameters
    required = {name for name, field in PROCESSES[process].model_fields.items() if field.is_required()}
    short = PROCESSES[process].short
    if short is not None:
        required -= {*short.axes}  # the short forms stand for them: where there is one alone, it is required
        required |= {name for name in short.fields if len(short.fields.keys() - {"vary"}) == 1} - {"vary"}
    if process == "proofs":
        required -= {"statement"}  # a point or an orbit has its own
    assert [name for name in required if parameters[name].default is not inspect.Parameter.empty] == []


class ToysRequest(ProcessRequest):
    """A process that is not there."""

    operation = Operation("toys", "submit_toy", "Compute a toy.", {}, "A book.")

    omega: Grid
    """Frequencies."""
    level: Literal["low", "high"] = "low"
    """How much of it."""
    window: Interval | None = None
    """Where it is."""


def test_the_method_of_a_new_process_follows_from_its_request(monkeypatch):
    monkeypatch.setitem(PROCESSES, "toys", ToysRequest)
    method = ProcessMethod("toys", GrazingCurve)
    assert str(method.signature) == (
        "(self, oscillator: 'OscillatorLike' = None, *, omega: 'Values', points: 'int | None' = None, "
        "level: 'str' = 'low', window: 'tuple[float, float] | None' = None, progress: 'bool' = True) -> 'GrazingCurve'"
    )
    for part in ("Compute a toy.", 'level : {"low", "high"}\n    How much of it.', "References\n----------\nA book."):
        assert part in method.doc
    request, progress, _ = method.request_for(omega=(0.2, 0.3), points=4, progress=False)
    assert (request.omega.points, request.window, progress) == (4, None, False)
    assert "/level" in refused(method.request_for, omega=[0.2, 0.3], level="none")


def test_a_number_with_a_unit_is_refused_for_a_nondimensional_oscillator(client):
    with pytest.raises(ParameterError) as refused:
        client.unfolding_map(omega=("10Hz", "13Hz"), clearance=(1.0, 2.0), shape=(3, 3))
    assert [error.pointer for error in refused.value.problem.errors] == ["/omega/start", "/omega/stop"]
    for error in refused.value.problem.errors:
        assert error.detail.startswith("Hz is a unit of SI")


def test_a_range_without_the_orbit_names_parameter_unit_and_value(client):
    machine = {"units": "SI", "masses": [2.0], "stiffnesses": [800.0], "damping": 0.001, "forcing": [12.0]}
    with pytest.raises(ParameterError) as refused:
        client.orbit_branch(machine, omega=20.0, clearance=0.0027, range=(1.0, 6.0), motion=(1, [1, -1]))
    (error,) = refused.value.problem.errors
    assert error.detail == "the range, in m, does not contain the clearance of the orbit, 0.0027 m"
    assert error.allowed == "start <= clearance <= stop"


def test_an_unknown_field_is_named_before_the_missing_one():
    with pytest.raises(ParameterError) as refused:
        validated("grazing-curves", {"omga": [0.2, 0.3]})
    assert [error.detail.partition(" ")[0] for error in refused.value.problem.errors] == ["Unknown", "Field"]


def test_a_pair_of_clearances_in_the_place_of_one_is_named_as_that():
    pair = {"right": 1.5, "left": None}
    with pytest.raises(ParameterError, match=r"/clearance/right: .*both stops"):
        METHODS["trajectory"].request_for(omega=0.3, clearance={"right": pair}, periods=2)
    assert METHODS["trajectory"].request_for(omega=0.3, clearance=pair, periods=2)[0].clearance.right == 1.5


def test_a_diagram_takes_as_many_values_as_are_given_where_no_shape_is():
    diagram = asked("unfolding_diagram", omega=[0.1, 0.2, 0.3], clearance=(1.0, 2.0))
    assert (len(diagram.horizontal.values), diagram.vertical.values.points) == (3, 256)
    assert "/omega" in refused(asked, "unfolding_diagram", omega=[0.1, 0.2, 0.3], clearance=(1.0, 2.0), shape=(8, 8))


@pytest.mark.parametrize("form", [dict, Axis], ids=["mapping", "axis"])
def test_an_axis_with_its_points_contradicts_another_shape(form):
    axes = {
        role: form(vary=name, values={"start": 1.0, "stop": 2.0, "points": 16})
        for role, name in (("horizontal", "omega"), ("vertical", "clearance"))
    }
    assert asked("unfolding_map", **axes).vertical.values.points == 16
    assert asked("unfolding_map", **axes, shape=(16, 16)).vertical.values.points == 16
    assert "/horizontal/values" in refused(asked, "unfolding_map", **axes, shape=(16, 32))


def test_what_knows_its_statement_takes_no_other_one():
    point = result_of("codimension-two-points").points[0]
    assert asked("prove", point).statement
    assert "/statement" in refused(asked, "prove", point, statement={"kind": "orbit"})

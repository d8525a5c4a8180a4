"""Numbers with units in Python, as on the command line: Hz, rpm and mm become rad/s and m before anything is sent."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from grazemap import errors, load
from grazemap.client.process_methods import METHODS
from grazemap.units import in_si, shown_in
from grazemap.wire import PROCESSES, Oscillator
from tests.support import sdk_documents

MACHINE = {"units": "SI", "masses": [0.5, 2], "stiffnesses": [2000, 8000], "damping": [1.5, 6], "forcing": [5, 0],
           "restitution": 0.8}  # fmt: skip
HERTZ = 2.0 * math.pi


def request_of(method, *arguments, **keywords):
    return METHODS[method].request_for(*arguments, **keywords)[0].model_dump()


@pytest.mark.parametrize("machine", [MACHINE, Oscillator(**MACHINE)])
def test_every_place_of_a_frequency_or_a_length_takes_a_unit(machine):
    curve = request_of("grazing_curve", machine, omega=("9 Hz", "1200 rpm"), points=3)
    assert curve["axis"]["values"] == {"start": 9.0 * HERTZ, "stop": 20.0 * HERTZ, "points": 3}
    initial = {"displacement": ["0.1 mm", 0.0], "velocity": [0.0, 0.0]}
    path = request_of(
        "trajectory", machine, omega="9Hz", clearance={"right": "0.5 mm", "left": None}, periods=3, initial=initial
    )
    assert (path["omega"], path["clearance"]["right"]) == (9.0 * HERTZ, 0.0005)
    assert path["initial"]["displacement"] == [0.0001, 0.0]
    axes = {"horizontal": ("omega", ["9 Hz", "10 Hz"]), "vertical": ("clearance", "1 mm", "3e-3 m")}
    umap = request_of("unfolding_map", machine, **axes, shape=(4, 2))
    assert umap["horizontal"]["values"] == [9.0 * HERTZ, 10.0 * HERTZ]
    assert umap["vertical"]["values"] == {"start": 0.001, "stop": 0.003, "points": 4}


@pytest.mark.parametrize(
    ("machine", "omega", "expected"),
    [
        (MACHINE, "9 mm", ["/omega", "mm is no unit of omega", "Hz, rpm or rad/s in SI"]),
        (MACHINE, " 9 mm", ["/omega", "mm is no unit of omega", "Hz, rpm or rad/s in SI"]),
        (None, " 9 Hz", ["/omega", "Hz is a unit of SI", 'units="SI"']),
        (MACHINE, "nine", ["/omega", "valid number", "in rad/s in SI"]),
        (None, "9 Hz", ["/omega", "Hz is a unit of SI", 'units="SI"']),
    ],
)
def test_what_is_no_number_with_a_unit_of_its_field_is_named(machine, omega, expected):
    with pytest.raises(errors.ParameterError) as raised:
        request_of("trajectory", machine, omega=omega, clearance=1.0, periods=3)
    assert all(part in str(raised.value) for part in expected)


@pytest.mark.parametrize(
    ("method", "asked", "place"),
    [
        ("grazing_curve", {"omega": ("5 Hz", 40), "points": 3}, "/omega"),
        ("grazing_curve", {"omega": [np.float64(31.0), "40 rad/s"]}, "/omega"),
        ("structure", {"omega": [1, "2 Hz"]}, "/omega"),
        ("unfolding_map", {"omega": (31, 40), "clearance": {"right": ("1 mm", 0.002), "left": 1}}, "/clearance/right"),
        ("unfolding_map", {"omega": (31, 40), "vertical": ("clearance", 0.001, "2 mm")}, "/vertical/values"),
    ],
)
def test_a_list_or_a_range_has_a_unit_with_each_number_or_with_none(method, asked, place):
    shape = {"shape": (2, 2)} if method == "unfolding_map" else {}
    with pytest.raises(errors.ParameterError) as raised:
        request_of(method, MACHINE, **asked, **shape)
    assert [error.pointer for error in raised.value.problem.errors] == [place]


# by the texts of an oscillator's fields: the numbers in SI
OSCILLATORS = {
    "masses": (["250 g", "0.25 kg", "0.002t"], [0.25, 0.25, 2.0]),
    "stiffnesses": (["12 N/mm", "3 kN/m", "800 N/m"], [12000.0, 3000.0, 800.0]),
    "damping": (["0.1 N s/mm", "2 kN s/m", "5Ns/m"], [100.0, 2000.0, 5.0]),
    "forcing": (["5 N", 0, "2 kN"], [5.0, 0.0, 2000.0]),
    "bias": (["1 N", 0.0, "-2 kN"], [1.0, 0.0, -2000.0]),
    "base": (
        {"amplitude": "0.2 mm", "stops_move": True},
        {"amplitude": 0.0002, "phase": 0.0, "stops_move": True, "influence": [1.0] * 3},
    ),
}
CHAIN = {"units": "SI", "masses": [1.0] * 3, "stiffnesses": [1000.0] * 3, "damping": "2 ms"}


@pytest.mark.parametrize("name", OSCILLATORS)
@pytest.mark.parametrize("form", [dict, lambda fields: Oscillator(**fields)], ids=["mapping", "Oscillator"])
def test_the_fields_of_an_oscillator_take_units(name, form):
    written, expected = OSCILLATORS[name]
    path = request_of("trajectory", form(CHAIN | {name: written}), omega=60.0, clearance=0.001, periods=3)
    assert path["oscillator"][name] == expected
    assert path["oscillator"]["damping"] == (0.002 if name != "damping" else expected)


@pytest.mark.parametrize(
    ("forcing", "amplitude"),
    [
        ({"amplitude": ["3 kg mm", 0, "20 g mm"], "law": "unbalance"}, [0.003, 0.0, 0.00002]),
        ([{"amplitude": ["3 N", 0, 0]}, {"amplitude": ["1 kN", 0, 0], "harmonic": 2}], [3.0, 0.0, 0.0]),
    ],
)
def test_an_unbalance_has_another_unit_than_a_force(forcing, amplitude):
    machine = Oscillator(**CHAIN, forcing=forcing)
    assert machine.harmonics[0].amplitude == amplitude
    wrong = [{**each, "law": "unbalance"} for each in forcing] if isinstance(forcing, list) else forcing["amplitude"]
    with pytest.raises(ValidationError, match="is no unit of"):
        Oscillator(**CHAIN, forcing=wrong)


def test_matrices_take_units_in_their_entries():
    rows = {"mass": [["2 kg", 0], [0, "500 g"]], "stiffness": [["3 kN/m", "-1 kN/m"], ["-1 kN/m", "1 N/mm"]]}
    machine = Oscillator.from_matrices(**rows, damping={"modal": 0.01}, units="SI", forcing=["5 N", 0])
    assert machine.matrices.mass == [[2.0, 0.0], [0.0, 0.5]]
    assert machine.matrices.stiffness == [[3000.0, -1000.0], [-1000.0, 1000.0]]


@pytest.mark.parametrize(
    ("fields", "place", "parts"),
    [
        ({"damping": "1.5 N s/m"}, ("damping",), ["ms or s in SI", "a list has the coefficients"]),
        ({"damping": ["2 ms"] * 3}, ("damping", "0"), ["ms is no unit of damping of each link", "N s/m in SI"]),
        ({"masses": ["250 g", 1.0, 2.0]}, ("masses",), ["Only some of the numbers"]),
        ({"units": "nondimensional"}, ("damping",), ["ms is a unit of SI", 'units="SI"']),
    ],
)
def test_a_unit_that_a_field_of_an_oscillator_cannot_have_is_named(fields, place, parts):
    with pytest.raises(ValidationError) as raised:
        Oscillator(**CHAIN | fields)
    error = raised.value.errors()[0]
    assert error["loc"] == place
    assert all(part in error["msg"] for part in parts)
    with pytest.raises(errors.ParameterError) as refused:
        request_of("trajectory", CHAIN | fields, omega=60.0, clearance=0.001, periods=3)
    assert "/".join(("/oscillator", *place)) in [entry.pointer for entry in refused.value.problem.errors]


@pytest.mark.parametrize("name", ["masses", "damping"])
def test_a_body_over_http_has_numbers(name):
    body = {
        "oscillator": MACHINE | {name: ["250 g" if name == "masses" else "1 N s/m"] * 2},
        "omega": [60.0, 70.0, 80.0],
    }
    with pytest.raises(errors.ParameterError, match="valid number"):
        PROCESSES["grazing-curves"].checked(body)


def test_single_numbers_with_a_unit_stand_where_ranges_and_lists_of_them_may():
    fractions = {"omega": ("9 Hz", "12 Hz"), "points": 3, "clearance": "4 mm"}
    for ranges in (["0.1 mm", ("-1 mm", "1 mm")], [1e-4, (-1e-3, 1e-3)]):
        asked = request_of("basin_fractions", MACHINE, **fractions, displacement=ranges)
        assert asked["displacement"] == [{"start": 1e-4, "stop": 1e-4}, {"start": -1e-3, "stop": 1e-3}]
    for overshoot in ("0.1 mm", 1e-4, ["0.1 mm"]):
        asked = request_of("discontinuity_mapping", MACHINE, omega="9 Hz", overshoot=overshoot)
        assert asked["overshoot"] == [1e-4]


def test_a_factor_on_a_field_of_an_oscillator_has_no_unit():
    machine = CHAIN | {"damping": 0.002}
    for vary in ("forcing", "bias", "damping"):
        with pytest.raises(errors.ParameterError, match="valid number"):
            request_of("bifurcation_diagram", machine, omega=60.0, clearance=0.001, vary=vary, range=["1 N", "2 N"])
    diagram = request_of(
        "bifurcation_diagram", machine, omega=60.0, clearance=0.001, vary="masses[2]", range=["900 g", "1.1 kg"]
    )
    assert diagram["axis"]["values"] == [0.9, 1.1]


def test_texts_that_are_no_quantities_stay_as_they_are():
    fields = {"policy": "5 mm", "horizontal": {"vary": "restitution", "values": ["1 mm"]}, "name": ("9 Hz",)}
    refused = []
    assert in_si(fields, "SI", refused) == fields
    assert refused == []


@pytest.mark.parametrize(
    ("fields", "shown"),
    [
        ({"omega": "9 Hz", "clearance": "0.5 mm"}, ("Hz", "mm")),
        ({"omega": "1200 rpm", "clearance": 0.001}, ("rpm",)),
        ({"omega": 60.0, "clearance": {"right": 0.001, "left": "0.5 mm"}}, ("mm",)),
        ({"omega": "57 rad/s", "clearance": "1 m"}, ()),
        ({"omega": 60.0, "clearance": 0.001}, ()),
    ],
)
def test_the_units_that_are_written_are_those_of_the_result(fields, shown):
    request, _, units = METHODS["trajectory"].request_for(MACHINE, **fields, periods=3)
    assert units == shown
    plain = {name: request.model_dump()[name] for name in fields}
    assert METHODS["trajectory"].request_for(MACHINE, **plain, periods=3)[0] == request


@pytest.mark.parametrize(
    ("machine", "omega", "shown"),
    [
        ({"masses": ["500 g", "2 kg"]}, ("9 Hz", "12 Hz"), ("g", "Hz", "mm")),
        ({"masses": ["500 g", "2 kg"]}, (50.0, 60.0), ("g",)),
        ({"forcing": ["1 kN", 0]}, (50.0, 60.0), ()),
        ({"base": {"amplitude": 0.001, "stops_move": False}}, ("9 Hz", "12 Hz"), ("Hz", "mm")),
        ({"base": {"amplitude": "1 mm", "stops_move": False}}, (50.0, 60.0), ("mm",)),
    ],
)
def test_units_of_the_machine_are_those_of_the_result_where_they_are_of_what_may_vary(machine, omega, shown):
    assert METHODS["grazing_curve"].request_for(MACHINE | machine, omega=omega, points=3)[2] == shown


def test_lengths_of_which_none_is_written_go_with_hertz_or_rpm():
    for omega, shown in ((("9 Hz", "12 Hz"), ("Hz", "mm")), (("900 rpm", "1200 rpm"), ("rpm", "mm")), ((50, 60), ())):
        assert METHODS["grazing_curve"].request_for(MACHINE, omega=omega, points=3)[2] == shown


def test_a_result_has_its_units_in_pictures_and_tables_and_keeps_its_arrays(tmp_path):
    result = sdk_documents.in_si("grazing-curves")
    shown = result.in_units("rpm", "mm")
    assert shown.omega is result.omega
    table = shown.to_dataframe()
    assert table.attrs["units"]["omega"] == "rpm"
    assert table["omega"].tolist() == pytest.approx((result.omega * 60.0 / HERTZ).tolist())
    assert table["clearance"].tolist() == pytest.approx((1000.0 * result.clearance).tolist())
    ax = shown.plot()
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"forcing frequency $\omega/2\pi$ (rpm)", "clearance $b$ (mm)")
    assert ax.get_xlim() == pytest.approx([end * 60.0 / HERTZ for end in result.plot().get_xlim()])
    head, _ = shown.save(tmp_path / "curve.csv").read_text().split("\n", 1)
    assert head.startswith("omega (rpm),clearance (mm),")
    assert shown.in_units("Hz").shown_units == ("Hz", "mm")
    assert shown.in_units("rad/s", "m").shown_units == ()
    assert shown.plot(engineering_units=True).get_xlabel().endswith("(Hz)")


@pytest.mark.parametrize("ending", ["npz", "json"])
@pytest.mark.parametrize("sample", ["grazing-curves", "unfolding-diagrams", sdk_documents.MANY])
def test_a_file_of_a_result_keeps_its_units_beside_its_arrays(ending, sample, tmp_path):
    result = sdk_documents.in_si(sample)
    shown = result.in_units("rpm", "mm")
    again = load(shown.save(tmp_path / f"shown.{ending}"))
    assert again.shown_units == ("rpm", "mm")
    assert again.plot(labels=True) is not None
    assert again.meta == result.meta
    assert again.save(tmp_path / f"again.{ending}").read_bytes() == (tmp_path / f"shown.{ending}").read_bytes()
    plain = load(result.save(tmp_path / f"si.{ending}"))
    assert plain.shown_units == ()
    in_si = again.in_units("rad/s", "m").save(tmp_path / f"in_si.{ending}")
    assert in_si.read_bytes() == (tmp_path / f"si.{ending}").read_bytes()


@pytest.mark.parametrize("ending", ["npz", "json"])
def test_a_file_of_a_whole_result_takes_engineering_units_and_no_table(ending, tmp_path):
    result, path = sdk_documents.in_si("grazing-curves"), tmp_path / f"curve.{ending}"
    assert load(result.save(path, engineering_units=True)).shown_units == result.in_units("Hz", "mm").shown_units
    with pytest.raises(ValueError, match=r"\.csv"):
        result.save(path, "points")
    with pytest.raises(ValueError, match="nondimensional"):
        sdk_documents.result_of("grazing-curves").save(path, engineering_units=True)


def test_a_reloaded_result_has_the_same_pictures_and_tables(tmp_path):
    shown = sdk_documents.in_si("grazing-curves").in_units("rpm", "mm")
    again = load(shown.save(tmp_path / "shown.npz"))
    assert again.to_dataframe().equals(shown.to_dataframe())
    assert again.to_dataframe().attrs == shown.to_dataframe().attrs
    assert again.plot().get_xlim() == shown.plot().get_xlim()
    assert again.plot().get_xlabel() == shown.plot().get_xlabel()


@pytest.mark.parametrize("units", ["Hz", ["furlong"], [1], 5, [["Hz"]]])
def test_a_file_with_units_that_no_result_has_is_no_result(units, tmp_path):
    result = sdk_documents.in_si("grazing-curves")
    path = replace(result, meta={**result.meta, "shown_units": units}).save(tmp_path / "x.json")
    with pytest.raises(errors.ResultFormatError):
        load(path)


def test_the_parts_of_a_result_have_its_units():
    diagram = sdk_documents.in_si("unfolding-diagrams").in_units("Hz")
    assert diagram.unfolding_map.shown_units == diagram.grazing_curve.shown_units == ("Hz",)
    many = sdk_documents.in_si(sdk_documents.MANY).in_units("rpm", "mm")
    assert [path.shown_units for path in many.trajectories] == [("rpm", "mm")] * len(many)


def test_units_that_a_result_cannot_have_are_refused():
    with pytest.raises(ValueError, match="no unit in which a result can be shown"):
        sdk_documents.in_si("grazing-curves").in_units("inch")
    with pytest.raises(ValueError, match="nondimensional"):
        sdk_documents.result_of("grazing-curves").in_units("Hz")
    assert shown_in("kg", ("Hz", "mm")) == ("kg", 1.0)


def test_both_clients_show_a_result_in_the_units_of_its_request(client, service):
    curve = client.grazing_curve(MACHINE, omega=("9 Hz", "20 Hz"), points=3)
    assert curve.shown_units == ("Hz", "mm")
    assert client.grazing_curve(MACHINE, omega=(60.0, 120.0), points=3).shown_units == ()

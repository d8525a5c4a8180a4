"""What is allowed and probably not meant: a note on the job and the result, a warning, a line of the command."""

import json
import math
import re
import tracemalloc
import warnings

import numpy as np
import pytest

from grazemap import cli
from grazemap.client.messages import warn_about
from grazemap.codec import decode_npz, encode_npz
from grazemap.errors import ParameterError, RequestWarning
from grazemap.results import decode_result, load
from grazemap.results.record import changed
from grazemap.wire import Note, Oscillator, notes_on, parse_request, unstated
from grazemap.wire.linear import matrices, steady_amplitude
from grazemap.wire.notes import OTHER_MOTIONS
from tests.support.sdk_documents import npz

SI = {"units": "SI", "masses": [2.0], "stiffnesses": [800.0], "damping": 0.001, "forcing": [12.0]}
MAP = {"omega": {"start": 0.26, "stop": 0.30, "points": 8}, "clearance": {"start": 1.3, "stop": 2.0, "points": 8}}
WINDOWS = {"omega": (0.26, 0.30), "clearance": (9.0, 10.0), "shape": (3, 2), "progress": False}


def codes(process: str, body: dict) -> list[str]:
    return [note.code for note in notes_on(parse_request(process, body))]


def span(start: float, stop: float) -> dict:
    return {"start": start, "stop": stop, "points": 8}


LINE = {"vary": "clearance", "omega": 0.29}
PLANE = {"horizontal": {"vary": "omega", "values": span(0.26, 0.30)}, "clearance": 9.0}
NEAR_AN_ANTIRESONANCE = {
    "oscillator": {"masses": [1.0, 1.0], "stiffnesses": [1.0, 1.0], "damping": 0.001, "forcing": [1.0, 0.0]},
    "omega": {"start": 0.05, "stop": 3.0, "points": 5},
    "clearance": {"start": 0.0055, "stop": 0.006, "points": 5},
}


@pytest.mark.parametrize(
    ("process", "body", "expected"),
    [
        ("grazing-curves", {"omega": [0.2, 0.3, 0.5]}, []),
        ("grazing-curves", {"omega": [0.29, 0.291]}, []),
        ("trajectories", {"omega": 0.29, "clearance": 5.0, "periods": 3}, []),
        ("bifurcation-diagrams", LINE | {"range": span(5.0, 6.0)}, ["above-grazing-curve"]),
        ("bifurcation-diagrams", LINE | {"range": span(1.0, 6.0)}, []),
        ("unfolding-maps", MAP, []),
        ("unfolding-maps", MAP | {"clearance": span(9.0, 10.0)}, ["above-grazing-curve"]),
        ("unfolding-maps", MAP | {"clearance": span(0.01, 0.02)}, ["below-grazing-curve"]),
        ("unfolding-maps", MAP | {"omega": [0.26, 0.30]}, ["two-values"]),
        ("unfolding-maps", MAP | {"omega": [0.26, 0.30, 100.0]}, ["points-among-values"]),
        ("unfolding-maps", {"oscillator": SI, "omega": span(15.0, 25.0), "clearance": span(0.01, 0.05)}, []),
        (
            "unfolding-maps",
            {"oscillator": SI, "omega": span(2.4, 4.0), "clearance": span(0.01, 0.05)},
            ["frequencies-in-hertz"],
        ),
        (
            "unfolding-maps",
            {"oscillator": SI, "omega": span(15.0, 25.0), "clearance": span(10.0, 50.0)},
            ["clearances-in-millimetres", "above-grazing-curve"],
        ),
        ("unfolding-maps", NEAR_AN_ANTIRESONANCE, []),
        # a plane is compared with one curve where the curve does not move
        (
            "unfolding-maps",
            PLANE | {"vertical": {"vary": "restitution", "values": [0.5, 0.7, 0.9]}},
            ["above-grazing-curve"],
        ),
        ("unfolding-maps", PLANE | {"vertical": {"vary": "forcing", "values": [0.5, 3.0, 6.0]}}, []),
    ],
)
def test_what_is_probably_not_meant_is_noted(process, body, expected):
    assert codes(process, body) == expected


@pytest.mark.parametrize(
    ("damping", "expected"),
    [
        (0.02, ["strong-damping"]),
        ([0.02, 0.02], ["damping-in-newton-seconds-per-millimetre", "weak-damping"]),
        ([300.0, 300.0], ["strong-damping"]),
        (5e-4, []),
        ([3.0, 3.0], []),
        (0.0, []),
        ([0.0, 0.0], []),
    ],
)
def test_a_damping_in_si_that_may_be_a_ratio_is_noted(damping, expected):
    machine = {"units": "SI", "masses": [0.9, 2.4], "stiffnesses": [6000.0, 20000.0], "forcing": [5.0, 0.0]}
    body = {"oscillator": {**machine, "damping": damping}, "omega": span(60.0, 80.0)}
    notes = notes_on(parse_request("grazing-curves", body))
    assert [note.code for note in notes] == expected
    for note in notes[-1:]:
        # the number that is suggested gives the first mode this ratio
        suggested = float(re.search(r"the number (\S+)$", note.detail)[1])
        assert Oscillator(**machine, damping=suggested).damping_ratios[0] == pytest.approx(0.02, rel=1e-3)
    if damping == 0.02:
        assert f"up to {Oscillator(**machine, damping=damping).damping_ratios[1]:.4g}:" in notes[0].detail


# one mass of which k = m = 1, on a base with the amplitude 1: relative to it, 1/(sqrt((1 - w^2)^2 + (0.2 w)^2)/w^2)
_MASS = {"masses": [1.0], "stiffnesses": [1.0], "damping": 0.1, "restitution": 0.5}
RACK = {**_MASS, "base": {"amplitude": 1.0, "stops_move": True}}
# the steady amplitude at omega = 2, and that of a force of 1 on the mass, which its bias moves 1 to the right
AT_TWO = 4.0 / math.hypot(3.0, 0.4)
PRELOADED = {**_MASS, "forcing": [1.0], "bias": [1.0]}
FORCED_AT_TWO = AT_TWO / 4.0
TWO_OF_THE_CHAIN = {"masses": [1.0, 1.0], "stiffnesses": [1.0, 1.0], "damping": 0.1, "forcing": [1.0, 0.0]}


@pytest.mark.parametrize(
    ("oscillator", "gaps", "omega", "noted"),
    [
        (RACK, {"clearance": span(1.01 * AT_TWO, 9.0)}, 2.0, True),
        (RACK, {"clearance": span(0.99 * AT_TWO, 9.0)}, 2.0, False),
        (RACK, {"clearance": {"right": span(1.01 * AT_TWO, 9.0), "left": None}}, 2.0, True),
        # the resonance lies between the samples
        (RACK, {"clearance": 4.0}, span(0.5, 9.0), False),
        (RACK, {"clearance": 5.1}, span(0.5, 9.0), True),
        ({**RACK, "base": {"amplitude": 0.0, "stops_move": True}}, {"clearance": span(1.0, 9.0)}, 2.0, False),
        # the clearance of each stop is compared with the way to that side of the equilibrium
        (PRELOADED, {"clearance": {"right": span(1.0 + 1.01 * FORCED_AT_TWO, 9.0), "left": 0.1}}, 2.0, True),
        (PRELOADED, {"clearance": {"right": span(1.0 + 0.99 * FORCED_AT_TWO, 9.0), "left": 0.1}}, 2.0, False),
        (PRELOADED, {"clearance": {"right": 5.0, "left": span(-0.99, 9.0)}}, 2.0, False),
        (PRELOADED, {"clearance": {"right": 5.0, "left": span(-0.6, 9.0)}}, 2.0, True),
        # stops that are not alike, of a chain
        (TWO_OF_THE_CHAIN, {"clearance": {"right": span(90.0, 99.0), "left": 80.0}}, 2.0, True),
        (TWO_OF_THE_CHAIN, {"clearance": {"right": span(90.0, 99.0), "left": 0.1}}, 2.0, False),
        # the curve moves where a mass varies; it is no window where nothing varies but a restitution
        (RACK, {"clearance": 90.0, "vary": "damping", "range": span(0.5, 2.0)}, 2.0, False),
        (RACK, {"clearance": 90.0, "vary": "restitution", "range": span(0.5, 0.9)}, 2.0, False),
    ],
)  # fmt: skip
def test_a_window_above_the_grazing_clearance_of_every_stop_is_noted_for_every_machine(oscillator, gaps, omega, noted):
    body = {"oscillator": oscillator, "omega": omega, **gaps}
    assert codes("bifurcation-diagrams", body) == ["above-grazing-curve"] * noted


def test_what_asks_for_the_grazing_curve_itself_is_no_window():
    body = {"oscillator": RACK, "omega": span(0.5, 0.6), "clearance": {"left": 90.0}}
    assert codes("grazing-curves", body) == []


def test_the_note_says_where_the_grazing_curve_is():
    (note,) = notes_on(parse_request("unfolding-maps", MAP | {"clearance": span(9.0, 10.0)}))
    low, high = (float(word) for word in re.findall(r"\d+\.\d+", note.detail))
    amplitudes = steady_amplitude(Oscillator(), np.linspace(0.26, 0.30, 1000))
    assert (low, high) == pytest.approx((amplitudes.min(), amplitudes.max()), rel=1e-3)


def test_a_client_warns_at_the_line_of_the_caller(client):
    with pytest.warns(RequestWarning, match="above the grazing curve") as caught:
        client.unfolding_map(**WINDOWS)
    if type(client).__name__ == "Client":  # in a task of asyncio there is no line of the caller
        assert caught[0].filename == __file__


def test_an_estimate_has_the_notes_without_a_job(client, service):
    with pytest.warns(RequestWarning, match="above the grazing curve"):
        forecast = client.estimate("unfolding-maps", MAP | {"clearance": span(9.0, 10.0)})
    assert (forecast.seconds, [note.code for note in forecast.notes]) == (3.0, ["above-grazing-curve"])
    assert service.jobs == {}
    with pytest.raises(ParameterError):
        client.estimate("unfolding-maps", {})


@pytest.mark.parametrize(("values", "message"), [((0.26, 0.30), "two values"), ((0.26, 0.30, 128), "last one 128")])
def test_a_range_without_a_number_of_points_is_noted_where_it_is_submitted_or_estimated(client, values, message):
    for call in (client.submit, client.estimate):
        with pytest.warns(RequestWarning, match=message):
            call("unfolding-maps", MAP | {"omega": values})


# the machines of docs/machines.md, with a frequency, a range of frequencies and the gap in metres
MACHINES = {
    "one stop": (
        {"masses": [0.5], "stiffnesses": [2000.0], "damping": [1.5], "forcing": [5.0]},
        70.0, (50.0, 80.0), {"right": 0.003, "left": None},
    ),
    "two unlike stops": (
        {"masses": [0.5, 2.0], "stiffnesses": [2000.0, 8000.0], "damping": [1.5, 6.0], "forcing": [5.0, 0.0],
         "bias": [2.0, 0.0], "restitution": {"right": 0.7, "left": 0.5}},
        60.0, (40.0, 80.0), {"right": 0.004, "left": 0.003},
    ),
    "rotor": (
        {"masses": [8.0, 40.0], "stiffnesses": [2e5, 4e6], "damping": [60.0, 600.0], "contact": [1, 2],
         "forcing": {"amplitude": [4e-4, 0.0], "law": "unbalance"}},
        170.0, (100.0, 250.0), 0.0005,
    ),
    "shaken base": (
        {"masses": [2.0, 3.0, 3.0], "stiffnesses": [3000.0, 6000.0, 6000.0], "damping": [2.0, 4.0, 4.0],
         "base": {"amplitude": 0.002, "stops_move": True}},
        22.0, (18.0, 30.0), 0.01,
    ),
    "modes": (
        {"matrices": {"mass": np.eye(3).tolist(), "damping": {"modal": [0.01, 0.01, 0.015]},
                      "stiffness": np.diag([13225.0, 514089.0, 4028049.0]).tolist()},
         "contact": {"row": [3.162, -3.162, 3.162]}, "forcing": [2.148, 4.514, 0.124]},
        112.0, (100.0, 130.0), {"right": 0.0015, "left": None},
    ),
}  # fmt: skip


def scaled(clearance, factor: float):
    if isinstance(clearance, dict):
        return {stop: None if gap is None else factor * gap for stop, gap in clearance.items()}
    return factor * clearance


def questions(oscillator: dict, omega: float, window: tuple[float, float], clearance) -> list[tuple[str, dict]]:
    """A request of every process in which a clearance is a number or varies, about a gap."""
    machine = {"oscillator": {"units": "SI", **oscillator}}
    point = {**machine, "omega": omega, "clearance": clearance}
    sides = clearance if isinstance(clearance, dict) else {"": clearance}
    gap, named = sides.get("right", sides.get("")), "right" in sides
    wide = {"start": 0.3 * gap, "stop": 3.0 * gap, "points": 4}
    other = {"left": sides.get("left")}
    varied = {"right": wide, **other} if named else wide
    interval = {"start": 0.3 * gap, "stop": 3.0 * gap}
    name = "clearance_right" if named else "clearance"
    motion = {"period": 1, "stops": [1]}
    along = {**machine, "omega": omega, "vary": name, "range": wide, **({"clearance": other} if named else {})}
    coordinates = {
        role: {"quantity": quantity, "mass": 1, "values": {"start": -1e-4 * gap, "stop": 1e-4 * gap, "points": 4}}
        for role, quantity in (("horizontal", "displacement"), ("vertical", "velocity"))
    }
    factor = {"vary": "forcing", "values": {"start": 0.5, "stop": 2.0, "points": 4}}
    damping = {"vary": "damping", "values": {"start": 0.5, "stop": 2.0, "points": 4}}
    asked = [
        ("structures", {**machine, "omega": [omega], "clearance": clearance}),
        ("trajectories", {**point, "periods": 3}),
        ("periodic-orbits", point),
        ("orbit-branches", {**point, "vary": "omega", "range": {"start": window[0], "stop": window[1]}}),
        ("basins", {**point, **coordinates}),
        ("bifurcation-diagrams", along),
        ("basin-fractions", along),
        ("bifurcation-diagrams", {**point, "omega": None, "vary": "omega", "range": span(*window)}),
        ("unfolding-maps", {**machine, "omega": span(*window), "clearance": varied}),
        ("unfolding-diagrams", {**machine, "omega": span(*window), "clearance": varied}),
        ("unfolding-maps", {**point, "horizontal": factor, "vertical": damping}),
        (
            "proofs",
            {**machine, "statement": {"kind": "orbit", "omega": omega, "clearance": clearance, "motion": motion}},
        ),
        (
            "bifurcation-curves",
            {
                **machine,
                "omega": {"start": window[0], "stop": window[1]},
                "clearance": {"right": interval, **other} if named else interval,
                "motions": [motion],
            },
        ),
    ]
    if other["left"] is not None:  # a gap that does not vary
        asked += [
            ("grazing-curves", {**machine, "omega": span(*window), "clearance": other}),
            ("codimension-two-points", {**machine, "omega": {"start": 40.0, "stop": 80.0}, "clearance": other}),
            ("discontinuity-mappings", {**machine, "omega": omega, "overshoot": [1e-6], "clearance": other}),
        ]
    return asked


@pytest.mark.parametrize("name", MACHINES)
def test_a_gap_in_millimetres_is_noted_for_every_machine_and_process(name):
    oscillator, omega, window, clearance = MACHINES[name]
    for factor, noted in ((1.0, False), (1000.0, True)):
        for process, body in questions(oscillator, omega, window, scaled(clearance, factor)):
            is_noted = "clearances-in-millimetres" in codes(process, body)
            assert is_noted is noted, (process, factor)
        if noted:  # neither where no unit of length is known
            body = {"oscillator": {"units": "nondimensional", **oscillator}, "omega": omega, "periods": 3}
            assert codes("trajectories", {**body, "clearance": scaled(clearance, factor)}) == []


def test_a_note_on_units_says_the_sizes_that_it_compares():
    oscillator, omega, _, _ = MACHINES["two unlike stops"]
    machine = Oscillator(units="SI", **oscillator)
    body = {"oscillator": machine, "omega": omega, "clearance": {"right": 4.0, "left": 3.0}, "periods": 3}
    (detail,) = (note.detail for note in notes_on(parse_request("trajectories", body)) if "clearance" in note.code)
    natural, ratio, moved = (
        machine.natural_frequencies,
        machine.damping_ratios[0],
        steady_amplitude(machine, np.array([omega])),
    )
    for number in (f"{natural[0]:.4g}", f"{natural[1]:.4g}", f"{ratio:.2g}", f"{moved[0]:.3g}", "3 m"):
        assert number in detail, detail


# every slip, at a machine of the page and a frequency or a window of it
SLIPS = [
    ("one stop", {"omega": span(50.0 * 9.549, 80.0 * 9.549)}, {}, "frequencies-in-rpm"),
    ("one stop", {}, {"stiffnesses": [2.0]}, "stiffnesses-in-newtons-per-millimetre"),
    ("one stop", {}, {"masses": [500.0]}, "masses-in-grams"),
    ("one stop", {}, {"damping": [0.0015]}, "damping-in-newton-seconds-per-millimetre"),
    ("one stop", {}, {"forcing": [0.005]}, "forces-in-kilonewtons"),
    ("rotor", {}, {"forcing": {"amplitude": [0.4, 0.0], "law": "unbalance"}}, "unbalance-in-kilogram-millimetres"),
    ("rotor", {}, {"forcing": {"amplitude": [400.0, 0.0], "law": "unbalance"}}, "unbalance-in-gram-millimetres"),
    ("shaken base", {}, {"base": {"amplitude": 2.0, "stops_move": True}}, "base-in-millimetres"),
    ("modes", {}, {"matrices": "per cent"}, "damping-in-per-cent"),
]


@pytest.mark.parametrize(("name", "changes", "slip", "code"), SLIPS, ids=[slip[3] for slip in SLIPS])
def test_a_slip_of_a_unit_is_named_and_the_right_request_is_not(name, changes, slip, code):
    oscillator, _, window, clearance = MACHINES[name]
    if "matrices" in slip:
        slip = {"matrices": oscillator["matrices"] | {"damping": {"modal": [100 * 0.01, 100 * 0.01, 100 * 0.015]}}}
    asked = {"omega": span(*window), "max_period": 8}
    side, gap = ("right", clearance["right"]) if isinstance(clearance, dict) else ("", clearance)
    gaps = span(0.5 * gap, gap)
    asked["clearance"] = {"right": gaps, "left": clearance["left"]} if side else gaps
    right = {"oscillator": {"units": "SI", **oscillator}, **asked}
    assert code not in codes("unfolding-maps", right)
    wrong = {"oscillator": {"units": "SI", **oscillator, **slip}, **asked, **changes}
    assert code in codes("unfolding-maps", wrong)


# a block on a soft spring, sqrt(20) rad/s, on a mass that is forced, sqrt(2000) rad/s
BLOCK = {"masses": [0.1, 1.0], "stiffnesses": [2.0, 2000.0], "damping": [0.02, 0.9], "contact": [1, 2],
         "forcing": [0.0, 0.5]}  # fmt: skip
# six equal masses, up to 2 sqrt(1e4) rad/s
ROW = {"masses": [1.0] * 6, "stiffnesses": [1e4] * 6, "damping": 4e-4, "forcing": [5.0, *[0.0] * 5]}
UNLIKE = {"masses": [2.0, 3.0], "stiffnesses": [4e3, 4e5], "forcing": [5.0, 0.0]}


@pytest.mark.parametrize(
    ("machine", "omega", "expected"),
    [
        # who asks about a machine asks about where it is fast, not about the block alone
        (BLOCK, span(38.0, 52.0), []),
        (BLOCK, span(38.0 / math.tau, 52.0 / math.tau), ["frequencies-in-hertz"]),
        # or about what is above all resonances, but not far above them
        (ROW, span(210.0, 290.0), []),
        (ROW, span(1000.0, 1300.0), ["frequencies-in-rpm"]),
        # one number for springs that are unlike is a ratio rather than a coefficient, if it may be one
        (UNLIKE | {"damping": [0.1, 0.1]}, span(30.0, 50.0), ["weak-damping"]),
        (UNLIKE | {"damping": [0.1, 10.0]}, span(30.0, 50.0), []),
        (UNLIKE | {"damping": [2.0, 2.0]}, span(30.0, 50.0), []),
        (UNLIKE | {"damping": 0.02}, span(30.0, 50.0), ["strong-damping"]),
    ],
)
def test_the_likelier_reading_of_a_request_decides(machine, omega, expected):
    assert codes("grazing-curves", {"oscillator": {"units": "SI", **machine}, "omega": omega}) == expected


def test_a_gap_of_a_lightly_damped_machine_is_compared_with_its_resonance():
    # beside a resonance of 1.3 m the steady motion goes 11 mm
    light = {**SI, "masses": [0.5], "stiffnesses": [2000.0], "forcing": [5.0], "damping": 1.6e-5}
    for clearance, noted in ((3.0, True), (1.0, False)):
        for stops in (clearance, {"right": clearance, "left": None}):
            note_codes = codes("trajectories", {"oscillator": light, "omega": 70.0, "clearance": stops, "periods": 3})
            assert ("clearances-in-millimetres" in note_codes) is noted


def test_no_stop_at_any_distance_is_noted_where_nothing_moves_or_no_motion_is_largest():
    still = {**SI, "forcing": [0.0]}
    undamped = {**SI, "damping": 0.0}
    for oscillator, omega in ((still, 15.0), (undamped, 20.0)):
        body = {"oscillator": oscillator, "omega": omega, "clearance": {"right": 3.0, "left": None}, "periods": 3}
        assert codes("trajectories", body) == []
    # a stop that is touched at rest has no unit, and one that is very far is no stop
    for clearance in ({"right": 0.0, "left": None}, {"right": 1e6, "left": 1e6}, {"right": 0.02, "left": 1e3}):
        assert codes("trajectories", {"oscillator": SI, "omega": 15.0, "clearance": clearance, "periods": 3}) == []
    assert codes(
        "trajectories", {"oscillator": SI, "omega": 15.0, "clearance": {"right": 0.0, "left": 20.0}, "periods": 3}
    ) == ["clearances-in-millimetres"]


@pytest.mark.parametrize(
    ("changes", "noted"),
    [
        ({}, True),
        ({"damping": None}, True),
        ({"units": "nondimensional"}, False),
        ({"units": "SI"}, False),
        ({"damping": 0.01}, True),
        ({"masses": [0.5, 2.0], "stiffnesses": [1.0, 4.0]}, False),
        ({"masses": [1e4, 1e4]}, False),
    ],
)
def test_numbers_in_si_without_units_are_noted(client, changes, noted):
    numbers = {"masses": [0.5, 2.0], "stiffnesses": [2000.0, 8000.0], "damping": [1.5, 6.0], "forcing": [5.0, 0.0]}
    oscillator = {name: value for name, value in (numbers | changes).items() if value is not None}
    omega = span(40.0, 80.0)
    request = parse_request("grazing-curves", {"oscillator": oscillator, "omega": omega})
    assert ("units-left-out" in [note.code for note in unstated(request)]) is noted
    if noted:
        for how in (oscillator, Oscillator(**oscillator)):
            with pytest.warns(RequestWarning) as caught:
                client.grazing_curve(how, omega=(40.0, 80.0), points=8, progress=False)
            assert [warning.message.code for warning in caught] == ["units-left-out"]


def test_the_default_restitution_is_noted_in_si_only():
    stated = {**SI, "restitution": 0.8}
    omega = span(15.0, 25.0)
    noted = [
        [note.code for note in unstated(parse_request("grazing-curves", body))]
        for body in ({"oscillator": SI, "omega": omega}, {"oscillator": stated, "omega": omega}, {"omega": omega})
    ]
    assert noted == [["default-restitution"], [], []]
    # the job is the same one
    first, second = (parse_request("grazing-curves", {"oscillator": system, "omega": omega}) for system in (SI, stated))
    assert first.canonical() == second.canonical()


def test_every_default_of_a_chain_in_si_is_noted_by_name():
    bare = {"units": "SI", "damping": [1.0, 1.0, 1.0]}
    oscillators = [
        bare,
        bare | {"restitution": 0.8, "masses": [2.0, 3.0], "stiffnesses": [9.0, 9.0], "damping": [1, 1]},
    ]
    oscillators.append(oscillators[-1] | {"base": {"amplitude": 0.01, "stops_move": True}})
    noted = [
        [note.code for note in unstated(parse_request("grazing-curves", {"oscillator": body, "omega": span(1.0, 2.0)}))]
        for body in oscillators
    ]
    assert noted == [
        [f"default-{name}" for name in ("masses", "stiffnesses", "forcing", "restitution")],
        ["default-forcing"],
        [],
    ]


@pytest.mark.parametrize("oscillator", [SI, Oscillator(**SI)])
def test_a_client_warns_of_the_default_restitution_however_the_oscillator_is_given(client, oscillator):
    request = {"oscillator": oscillator, "omega": span(15.0, 25.0)}
    message = "restitution is not given, and its default 0.8 is used"
    with pytest.warns(RequestWarning, match=message):
        client.submit("grazing-curves", request)
    with pytest.warns(RequestWarning, match=message):
        forecast = client.estimate("grazing-curves", request)
    assert [note.code for note in forecast.notes] == ["default-restitution"]
    with pytest.warns(RequestWarning, match=message):
        client.grazing_curve(oscillator, omega=(15.0, 25.0), points=8, progress=False)


def test_the_command_line_says_the_default_restitution(url, capsys):
    chain = ["--units", "SI", "--masses", "2,", "--stiffnesses", "800,", "--damping", "0.001", "--forcing", "12,"]
    command = ["grazing-curves", *chain, "--omega", "15:25:8", "--quiet", "--url", url]
    for more, lines in (([], 1), (["--restitution", "0.8"], 0)):
        assert cli.main([*command, *more]) == 0
        assert capsys.readouterr().err.count("note: restitution is not given, and its default 0.8") == lines


def test_the_command_line_prints_the_note(url, tmp_path, capsys):
    source, output = tmp_path / "request.json", tmp_path / "map.npz"
    source.write_text(json.dumps(MAP | {"clearance": span(9.0, 10.0)}))
    assert cli.main(["run", "unfolding-maps", "--json", str(source), "-o", str(output), "--url", url]) == 0
    assert "grazemap: note: every clearance is above the grazing curve" in capsys.readouterr().err


def test_a_result_has_the_notes_of_its_meta(service, client):
    with pytest.warns(RequestWarning):
        job = client.submit("unfolding-maps", MAP | {"clearance": span(9.0, 10.0)})
    assert [note.code for note in job.job.notes] == ["above-grazing-curve"]
    document = decode_result(service.results.setdefault(job.id, _with_notes()))
    assert [note.detail for note in document.notes] == ["here"]


def _with_notes() -> bytes:
    document, meta = decode_npz(npz("unfolding-maps"))
    return encode_npz(document, meta | {"notes": [{"code": "x", "detail": "here"}]})


def _with_other_motion() -> bytes:
    motion = {"label": "1-1r-1l", "starts": 37, "request": {"omega": 0.29, "clearance": 1.6, "periods": 2}}
    names = {"period": 1, "impacts_right": 1, "impacts_left": 1, "symmetric": True}
    figures = {"multiplier": 0.6, "least_impact_velocity": 0.03}
    record = {"starts": 64, "settled": 64, "motions": [motion | names | figures]}
    document, meta = decode_npz(npz("trajectories", {"other_starts": record}))
    return encode_npz(document, meta | {"notes": [{"code": OTHER_MOTIONS, "detail": "others live here"}]})


def test_a_client_warns_of_other_motions_when_the_result_arrives(service, client, tmp_path):
    point = {"omega": 0.29, "clearance": 1.6, "periods": 2, "other_starts": 64}
    job = client.submit("trajectories", point)
    job.wait()
    service.results[job.id] = _with_other_motion()
    with pytest.warns(RequestWarning, match="others live here") as caught:
        result = job.result()
    assert caught[0].message.code == OTHER_MOTIONS
    if type(client).__name__ == "Client":
        assert caught[0].filename == __file__
    assert "1-1r-1l (37 of 64)" in repr(result)
    (motion,) = result.other_starts.motions
    assert motion.request == {"omega": 0.29, "clearance": 1.6, "periods": 2}
    for name in ("path.json", "path.npz"):
        again = load(result.save(tmp_path / name)).other_starts
        assert (str(again), again.motions[0].request) == (str(result.other_starts), motion.request)
    assert "no other motion" in str(changed(result.other_starts, motions=()))


def test_three_numbers_in_a_tuple_are_refused_with_the_way_to_write_them(client, service):
    with pytest.raises(ParameterError) as caught:
        client.grazing_curve(omega=(0.2, 0.4, 100))
    (error,) = caught.value.problem.errors
    assert error.pointer == "/omega"
    assert "(0.2, 0.4) with points" in error.allowed
    assert service.requests == []


def test_si_without_damping_is_refused():
    body = {"oscillator": {name: value for name, value in SI.items() if name != "damping"}, "omega": [10.0, 20.0, 30.0]}
    with pytest.raises(ValueError, match="no default in SI"):
        parse_request("grazing-curves", body)
    body["oscillator"]["damping"] = 0.0
    parse_request("grazing-curves", body)


def test_a_frequency_that_rounding_hides_is_not_divided_by():
    stiff = {"units": "SI", "masses": [1.0, 1.0, 1.0], "stiffnesses": [1e60, 1e-7, 1e-60], "damping": 1e-60}
    request = parse_request("structures", {"oscillator": stiff, "omega": [1.0]})
    assert isinstance(notes_on(request), list)


def test_natural_frequencies_and_damping_ratios_are_those_of_closed_forms():
    single = Oscillator(**SI)
    assert single.natural_frequencies == pytest.approx([20.0], rel=1e-14)
    assert single.damping_ratios == pytest.approx([0.001 * 20.0], rel=1e-14)
    linked = Oscillator(**{**SI, "damping": [3.0]})
    assert linked.damping_ratios == pytest.approx([3.0 / (2.0 * math.sqrt(2.0 * 800.0))], rel=1e-14)
    # two equal masses on equal springs: the golden ratio
    two = Oscillator(masses=[1.0, 1.0], stiffnesses=[1.0, 1.0], damping=[0.1, 0.1], forcing=[1.0, 0.0])
    golden = np.array([(math.sqrt(5.0) - 1.0) / 2.0, (math.sqrt(5.0) + 1.0) / 2.0])
    assert two.natural_frequencies == pytest.approx(golden, rel=1e-14)
    assert two.damping_ratios == pytest.approx(0.1 * golden, rel=1e-13)
    # more damping than a mode can oscillate with
    assert Oscillator(**{**SI, "damping": [100.0]}).damping_ratios == pytest.approx([1.25], rel=1e-13)
    # the eigenvalues of an overdamped mode may lie on either side of those of another one
    wide = Oscillator(
        **{**SI, "masses": [1.0, 1e-3], "stiffnesses": [1.0, 1.0], "forcing": [1.0, 0.0], "damping": [0.02, 10.0]}
    )
    _, damping, stiffness = matrices(wide)
    values = np.roots(
        np.polysub(
            np.polymul([1.0, damping[0, 0], stiffness[0, 0]], [1e-3, damping[1, 1], stiffness[1, 1]]),
            np.polymul([damping[0, 1], stiffness[0, 1]], [damping[0, 1], stiffness[0, 1]]),
        )
    )
    upper, real = values[values.imag > 0], np.sort(values[np.abs(values.imag) < 1e-9].real)
    assert abs(real[1]) < abs(upper[0]) < abs(real[0])
    expected = {float(-upper[0].real / abs(upper[0])), float(-real.sum() / (2.0 * np.sqrt(real.prod())))}
    assert sorted(wide.damping_ratios) == pytest.approx(sorted(expected), rel=1e-6)
    both = Oscillator(
        **{**SI, "masses": [1.0, 1.0], "stiffnesses": [1.0, 1.0], "forcing": [1.0, 0.0], "damping": [50.0, 60.0]}
    )
    assert np.isnan(both.damping_ratios).all()


def test_a_window_below_the_grazing_curve_is_noted_without_a_warning(client):
    job = client.submit("unfolding-maps", MAP | {"clearance": span(1.3, 1.5)})
    assert [note.code for note in job.job.notes] == ["below-grazing-curve"]


def test_an_undamped_resonance_is_no_error_and_costs_no_job():
    body = {"masses": [1.0], "stiffnesses": [4.0], "damping": 0.0, "forcing": [1.0]}
    assert steady_amplitude(Oscillator(**body), np.array([1.0, 2.0, 3.0]))[1] == np.inf
    window = {"omega": {"start": 1.0, "stop": 3.0, "points": 5}, "clearance": {"start": 1.0, "stop": 2.0, "points": 5}}
    assert codes("unfolding-maps", {"oscillator": body, **window}) == []


def test_ratios_beside_a_much_stronger_damper_are_exact_or_nan():
    for damping in (1e4, 1e7, 1e8):
        single = Oscillator(**{**SI, "masses": [1.0], "stiffnesses": [1.0], "damping": [damping]})
        assert single.damping_ratios == pytest.approx([damping / 2.0], rel=1e-12)
    three = {**SI, "masses": [1.0] * 3, "stiffnesses": [1.0] * 3, "forcing": [1.0, 0.0, 0.0]}
    ratios = Oscillator(**{**three, "damping": [1e9, 0.0, 0.0]}).damping_ratios
    assert not np.any(ratios < 0.0)
    assert np.isfinite(Oscillator(**{**three, "damping": [0.1, 0.0, 0.0]}).damping_ratios).all()


def test_many_frequencies_take_little_memory():
    chain = Oscillator(**{**SI, "masses": [1.0] * 64, "stiffnesses": [1.0] * 64, "forcing": [1.0] * 64})
    omega = np.linspace(0.1, 2.0, 2000)
    tracemalloc.start()
    amplitude = steady_amplitude(chain, omega)
    assert tracemalloc.get_traced_memory()[1] < 2e8
    tracemalloc.stop()
    assert amplitude[::500] == pytest.approx(steady_amplitude(chain, omega[::500]), rel=1e-10)


def test_kernels_that_are_compiled_first_are_no_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_about([Note(code="compiles-first", detail="the first map compiles")])


@pytest.mark.parametrize("omega", [0.55, 12.0, 333.0])
def test_without_forces_a_frequency_is_compared_with_nothing(omega):
    still = {"units": "SI", "masses": [100.0], "stiffnesses": [1e4], "damping": 0.001, "forcing": [0.0]}
    body = {"oscillator": still, "omega": omega, "clearance": 0.1, "periods": 3, "initial": {"velocity": [1.0]}}
    assert codes("trajectories", body) == []


def test_no_size_of_a_machine_is_too_small_or_too_large_to_be_compared():
    def any_size(random):
        return 10.0 ** random.uniform(-60.0, 60.0)

    random = np.random.default_rng(1)
    for _ in range(100):
        chain = {name: [any_size(random)] for name in ("masses", "stiffnesses", "damping")}
        forcing = {"amplitude": [any_size(random)], "law": random.choice(["constant", "unbalance"])}
        machine = {"units": "SI", **chain, "forcing": forcing}
        body = {"oscillator": machine, "omega": any_size(random), "clearance": any_size(random), "periods": 3}
        try:
            request = parse_request("trajectories", body)
        except ValueError:  # beyond what can be computed
            continue
        with np.errstate(all="ignore"):
            assert all(note.detail for note in notes_on(request))

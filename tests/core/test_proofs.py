"""One statement of each kind is proven, false ones are disproven or refused, and what is undecided says why."""

import re
import time
from copy import deepcopy
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from general_oracle import GeneralOracle

from grazemap.checker import check
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.one_stop import VariedStop
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.certificates import exact_oscillator
from grazemap_core.proofs.prove import KINDS, prove

DEFAULT = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
REST = {"displacement": ["0.0"] * 3, "velocity": ["0.0"] * 3, "phase": "0.0"}
ORBIT = {"kind": "orbit", "omega": "0.29", "clearance": "1.6", "period": 1, "stops": [1, 1, -1, -1], "stable": True}
ATTRACTION = {"kind": "attraction", "omega": "0.29", "clearance": "1.6", **REST}
AT_BREAKING = {"kind": "bifurcation", "omega": "0.27", "clearance": "1.40", "period": 1, "stops": [1, 1, 1, -1, -1, -1]}
BREAKING = {**AT_BREAKING, "type": "SB", "parameter": "clearance", "range": ["1.35", "1.5"]}
AT_GRAZE = {"kind": "bifurcation", "omega": "0.27", "clearance": "1.5", "period": 1, "stops": [1, 1, -1, -1]}
GRAZE = {**AT_GRAZE, "type": "GR", "parameter": "clearance", "range": ["1.35", "1.55"]}

# dense matrices, contact between two masses, two harmonics with phases, a bias, two restitutions and gaps that differ
GENERAL = Oscillator.of_structure(
    Matrices.create([[2.0, 0.3], [0.3, 1.0]], [[3.0, -1.0], [-1.0, 2.0]], [[0.2, 0.05], [0.05, 0.1]]),
    [1.0, -1.0],
    [
        force(1, np.array([1.0, -0.4]), np.array([0.3, 0.0])),
        force(2, np.array([0.02, 0.0]), np.array([0.0, 0.5]), unbalance=True),
    ],
    0.7,
    [0.1, 0.0],
    0.5,
)
UNEQUAL = {"omega": "0.7", "clearance": {"right": "0.3", "left": "0.4"}}
FROM_EQUILIBRIUM = {"displacement": "equilibrium", "velocity": ["0.0"] * 2, "phase": "0.0"}


@pytest.fixture(scope="module")
def general():
    return prove(GENERAL, {"kind": "attraction", **UNEQUAL, **FROM_EQUILIBRIUM}, time_limit=600.0)


@pytest.fixture(scope="module")
def orbit():
    return prove(DEFAULT, ORBIT, time_limit=600.0)  # kernels may have to be compiled


@pytest.fixture(scope="module")
def attraction():
    return prove(DEFAULT, ATTRACTION)


def test_an_orbit_is_proven(orbit):
    assert orbit["verdict"] == "proven", orbit["reason"]
    assert orbit["enclosures"]["symmetric"]
    assert (orbit["enclosures"]["impacts_right"], orbit["enclosures"]["impacts_left"]) == (2, 2)


def test_the_order_of_a_certificate_s_fields_does_not_matter(orbit):
    forcing = dict(reversed(orbit["oscillator"]["forcing"].items()))
    answer = check(orbit | {"oscillator": orbit["oscillator"] | {"forcing": forcing}})
    assert answer.accepted, answer.reason


def test_a_stable_orbit_is_not_unstable():
    found = prove(DEFAULT, {**ORBIT, "stable": False})
    assert found["verdict"] == "disproven"
    assert check(found).accepted


def test_where_a_trajectory_goes_is_proven_and_another_label_disproven(attraction):
    assert attraction["verdict"] == "proven", attraction["reason"]
    label = {"period": 1, "impacts_right": 1, "impacts_left": 1}
    assert check(attraction | {"statement": ATTRACTION | label | {"impacts_right": 2, "impacts_left": 2}}).accepted
    other = attraction | {"statement": ATTRACTION | label}
    assert "contradicts" in check(other).reason
    assert check(other | {"verdict": "disproven"}).accepted


@pytest.mark.parametrize(("statement", "value"), [(BREAKING, "1.367766070496"), (GRAZE, "1.412592943269")])
def test_bifurcations_are_proven(statement, value):
    found = prove(DEFAULT, statement, time_limit=600.0)
    assert found["verdict"] == "proven", found["reason"]
    assert found["enclosures"]["value"].startswith("[" + value[:-1])
    moved = deepcopy(found)
    moved["theorem"]["value"] = str(Fraction(found["theorem"]["value"]) + 10 * Fraction(found["theorem"]["radius"]))
    assert "does not map the box into itself" in check(moved).reason


@pytest.mark.thorough
@pytest.mark.timeout(600)
def test_a_trajectory_that_touches_a_stop_beside_an_orbit_is_not_attracted_by_it():
    place = {"omega": "0.2604494382022472", "clearance": "1.7718524462135552"}
    said = {"period": 3, "impacts_right": 2, "impacts_left": 2}
    found = prove(DEFAULT, {**ATTRACTION, **place, **said}, time_limit=400.0)
    assert found["verdict"] == "disproven", found["reason"]
    assert [found["enclosures"][name] for name in said] == [1, 1, 1]


def test_the_numbers_of_the_theory_page_are_proven():
    statement = {"kind": "codimension-two", "type": "g", "order": 2, "range": ["0.282", "0.283"]}
    found = prove(DEFAULT, statement)
    page = (Path(__file__).parents[2] / "docs" / "theory.md").read_text("utf-8")
    omega, clearance = re.findall(r"^\| (?:recurrence m = 2, active: omega|clearance there) \| (\S+) \|$", page, re.M)
    assert found["verdict"] == "proven"
    assert found["enclosures"]["active"]
    assert found["enclosures"]["omega"].startswith(f"[{omega}")
    assert found["enclosures"]["clearance"].startswith(f"[{clearance}")


def test_where_a_trajectory_of_a_general_system_goes_is_proven(general):
    """The impacts of the orbit are those of fifty digits."""
    assert general["verdict"] == "proven", general["reason"]
    found = general["enclosures"]
    exact = GeneralOracle.of(GENERAL, 0.7, 0.3, 0.4)
    exact.run(until=60 * 2.0 * np.pi / 0.7)
    speeds = [float(v) for v in exact.speeds[-3:]]
    assert sorted(exact.stops[-3:]) == sorted(found["stops"]) == [-1, 1, 1]
    np.testing.assert_allclose(sorted(middle(v) for v in found["velocities"]), sorted(speeds), rtol=1e-9)


def middle(ball):
    """The middle of a ball as certificates have it."""
    return float(ball[1:].split(" ")[0])


@pytest.mark.parametrize(
    ("kind", "parameter", "interval", "value"),
    [("SN", "clearance_right", ["0.29", "0.34"], 0.3362914865006), ("GR", "omega", ["0.65", "0.71"], 0.66465344490)],
)
def test_bifurcations_of_a_general_system_are_proven(kind, parameter, interval, value):
    at = {"kind": "bifurcation", **UNEQUAL, "period": 1, "stops": [1, 1, -1]}
    found = prove(GENERAL, {**at, "type": kind, "parameter": parameter, "range": interval}, time_limit=600.0)
    assert found["verdict"] == "proven", found["reason"]
    assert middle(found["enclosures"]["value"]) == pytest.approx(value, rel=1e-10)


@pytest.mark.parametrize(("kind", "order", "multiple"), [("g", 2, 0), ("h", 2, 1), ("h_s", 2, 1)])
def test_points_of_one_stop_of_a_general_system_are_proven(kind, order, multiple):
    points = codimension_two_points(GENERAL, 0.2, 2.0, 4, 2, VariedStop(1))
    said = {"g": None, "h": "SN", "h_s": "PD"}[kind]
    known = [
        point.omega
        for point in points
        if (point.bifurcation == said and point.multiple == multiple if said else point.order == order)
    ]
    assert known
    window = [repr(known[0] * (1.0 - 1e-6)), repr(known[0] * (1.0 + 1e-6))]
    statement = {"kind": "codimension-two", "type": kind, "order": order, "range": window}
    found = prove(GENERAL, {**statement, "stop": 1})
    assert found["verdict"] == "proven", found["reason"]
    assert middle(found["enclosures"]["omega"]) == pytest.approx(known[0], rel=1e-12)
    assert "clearance" not in found["enclosures"]  # of several harmonics
    # a bias and even harmonics: the stops are not grazed at once
    both = {name: value for name, value in found["theorem"].items() if name != "stop"}
    assert "not grazed so" in check(found | {"statement": statement, "theorem": both}).reason


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("contact", lambda contact: ["1.0000001", contact[1]]),
        ("bias", lambda bias: ["0.1000001", bias[1]]),
        ("bias", None),
        ("forcing", lambda forcing: forcing[:1]),
        ("forcing", lambda forcing: [forcing[0], forcing[1] | {"harmonic": 3}]),
        ("forcing", lambda forcing: [forcing[0], forcing[1] | {"powers": forcing[1]["powers"][:1]}]),
        ("damping", lambda damping: [damping[0], ["0.0500001", damping[1][1]]]),
        ("mass", lambda mass: [["2.0000001", mass[0][1]], mass[1]]),
    ],
)
def test_certificates_of_another_general_system_are_refused(general, name, change):
    other = deepcopy(general["oscillator"])
    if change is None:
        del other[name]
    else:
        other[name] = change(other[name])
    answer = check(general | {"oscillator": other})
    assert "does not map the box into itself" in answer.reason or "no contact" in answer.reason


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"gaps": ["0.3", "0.4000001"]}, "not the statement's clearance"),
        ({"gaps": ["0.3", None]}, "is absent"),
        ({"gaps": ["0.4", "0.3"]}, ""),
        ({"restitutions": ["0.5", "0.7"]}, ""),
        ({"displacement": ["0.0", "0.0"]}, "displacement is not that of the statement"),
        ({"symmetric": True, "gaps": ["0.3", "0.3"], "restitutions": ["0.7", "0.7"]}, "odd harmonics and no bias"),
        ({"gaps": ["0.3", "-0.3"]}, "the gaps are positive"),
        ({"gaps": [None, None]}, "the gaps are positive"),
    ],
)
def test_false_theorems_on_a_general_system_are_refused(general, change, reason):
    answer = check(general | {"theorem": general["theorem"] | change})
    assert not answer.accepted
    assert reason in answer.reason or "does not map the box" in answer.reason


def test_chatter_is_undecided():
    found = prove(DEFAULT, {**ATTRACTION, "omega": "0.27", "clearance": "0.5"})
    assert found["verdict"] == "undecided"
    assert found["reason"] == "rests (30 digits, 60 s)"
    assert not check(found).accepted


def test_the_time_limit_is_named():
    found = prove(DEFAULT, ATTRACTION, time_limit=1e-3)
    assert found["reason"] == "the time limit is reached (30 digits, 0.001 s)"


def test_the_time_limit_ends_a_long_step(monkeypatch):
    def endless(search, statement):
        while True:
            pass

    monkeypatch.setitem(KINDS, "attraction", endless)
    begun = time.monotonic()
    found = prove(DEFAULT, ATTRACTION, time_limit=0.5)
    assert found["reason"] == "the time limit is reached (30 digits, 0.5 s)"
    assert time.monotonic() - begun < 5.0  # the limit, and the clock's steps on a busy machine


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"radius": "1e-40"}, "does not map the box into itself"),
        ({"gaps": ["1.60000001", "1.60000001"]}, "does not map the box into itself"),
        ({"restitutions": ["0.80000001", "0.80000001"]}, "does not map the box into itself"),
        ({"gaps": ["1.6", "1.60000001"]}, "needs two equal gaps"),
        ({"gaps": ["1.6", None]}, "needs two equal gaps"),
        ({"restitutions": ["0.8", "0.80000001"]}, "needs two equal gaps and two equal restitutions"),
        ({"restitutions": ["1.1", "1.1"]}, "not between 0 and 1"),
        ({"unstable": 1}, "0 multipliers lie outside"),
        ({"period": 1.0}, "not a number of forcing periods"),
        ({"period": 2}, "odd period"),
    ],
)
def test_false_theorems_on_an_orbit_are_refused(orbit, change, reason):
    false = orbit | {"theorem": orbit["theorem"] | change}
    assert reason in check(false).reason


@pytest.mark.parametrize("place", [0, 7, -1])
def test_a_transient_without_one_of_its_impacts_is_refused(attraction, place):
    false = deepcopy(attraction)
    for name in ("stops", "times"):
        false["theorem"]["transient"][name].pop(place)
    answer = check(false)
    assert not answer.accepted
    # or the motion without the impact does not come to the next one
    assert "passes a stop" in answer.reason or "no contact is shown to exist" in answer.reason


def test_decimals_are_exact():
    data = exact_oscillator(DEFAULT)
    assert data["damping"] == [["1/10", "-1/10", "0"], ["-1/10", "3/5", "-1/2"], ["0", "-1/2", "1"]]
    per_link = Oscillator.create([1.0], [1.0], [0.05], [1.0], 0.8)
    assert exact_oscillator(per_link)["damping"] == [["1/10"]]

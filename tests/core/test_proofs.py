"""One statement of each kind is proven, false ones are disproven or refused, and what is undecided says why."""

import re
import time
from copy import deepcopy
from fractions import Fraction
from pathlib import Path

import pytest

from grazemap.checker import check
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

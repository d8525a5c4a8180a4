"""One statement of each kind is proven, false ones are disproven or refused, and what is undecided says why."""

import re
from copy import deepcopy
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from grazemap.checker import check
from grazemap_core.continuation.branch_switching import starts_beyond
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.grazing.codimension_two import codimension_two_points
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.proofs.certificates import exact_oscillator
from grazemap_core.proofs.prove import prove
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.general_oracle import GeneralOracle
from tests.support.orbits import orbit_with
from tests.support.oscillators import DEFAULT
from tests.support.thorough import the_first

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
    return prove(GENERAL, {"kind": "attraction", **UNEQUAL, **FROM_EQUILIBRIUM})


@pytest.fixture(scope="module")
def orbit():
    return prove(DEFAULT, ORBIT)


@pytest.fixture(scope="module")
def attraction():
    return prove(DEFAULT, ATTRACTION)


def with_part(certificate, name, change):
    """A certificate in which a part has other values."""
    return certificate | {name: certificate[name] | change}


def test_an_orbit_is_proven(orbit):
    assert verdict(orbit) == "proven", orbit.reason
    assert orbit.enclosures["symmetric"]
    assert orbit.enclosures["label"] == "1-2r-2l"


def verdict(proof):
    return proof.certificate["verdict"]


def test_the_order_of_a_certificate_s_fields_does_not_matter(orbit):
    turned = {name: dict(reversed(orbit.certificate[name].items())) for name in ("oscillator", "statement", "theorem")}
    answer = check(dict(reversed((orbit.certificate | turned).items())))
    assert answer.accepted, answer.reason


# with one impact there are a stable and an unstable orbit; phase and velocity of the stable one
ONE_IMPACT = {"kind": "orbit", "omega": "0.27", "clearance": "1.86", "period": 1, "stops": [1]}
NODE = {"phases": ["1.394395"], "velocities": ["0.154008"], "radius": "1e-5"}


@pytest.mark.parametrize(
    ("request_", "outcome"),
    [
        ({"stable": True}, "proven"),
        ({"stable": False}, "proven"),
        ({"stable": True, **NODE}, "proven"),
        ({"stable": False, **NODE}, "disproven"),
        ({"stable": True, **NODE, "phases": ["1.39449"]}, "disproven"),
    ],
)
def test_what_is_said_of_an_orbit_is_decided_by_the_orbits_that_it_may_mean(request_, outcome):
    proof = prove(DEFAULT, ONE_IMPACT | request_)
    assert verdict(proof) == outcome, proof.reason
    assert check(proof.certificate).accepted
    other = {"proven": "disproven", "disproven": "proven"}[outcome]
    assert not check(proof.certificate | {"verdict": other}).accepted
    stated = proof.certificate["statement"]
    opposite = check(with_part(proof.certificate, "statement", {"stable": not stated["stable"]}))
    assert not opposite.accepted or outcome == "disproven"


def test_a_stable_orbit_does_not_disprove_that_another_one_is_unstable(orbit):
    """An orbit of four impacts is found by a trajectory, which says nothing of unstable ones."""
    assert verdict(prove(DEFAULT, {**ORBIT, "stable": False})) == "undecided"
    unstable = with_part(orbit.certificate, "statement", {"stable": False})
    for outcome in ("proven", "disproven"):
        assert not check(unstable | {"verdict": outcome}).accepted


@pytest.mark.thorough
def test_where_a_trajectory_goes_is_proven_and_another_label_disproven(attraction):
    certificate = attraction.certificate
    assert certificate["verdict"] == "proven", attraction.reason
    assert check(with_part(certificate, "statement", {"label": "1-2r-2l"})).accepted
    is_disproven_with_another_label(certificate)


@pytest.mark.parametrize(("statement", "value"), [(BREAKING, "1.367766070496"), (GRAZE, "1.412592943269")])
def test_bifurcations_are_proven(statement, value):
    proof = prove(DEFAULT, statement)
    certificate = proof.certificate
    assert certificate["verdict"] == "proven", proof.reason
    assert proof.enclosures["value"].startswith("[" + value[:-1])
    theorem = certificate["theorem"]
    moved = str(Fraction(theorem["value"]) + 10 * Fraction(theorem["radius"]))
    assert "does not map the box into itself" in check(with_part(certificate, "theorem", {"value": moved})).reason
    assert not check(certificate | {"verdict": "disproven"}).accepted
    phases = certificate["statement"]["phases"]
    elsewhere = {"phases": [str(Fraction(phases[0]) + Fraction(1, 10**5)), *phases[1:]]}
    assert "in the statement's box" in check(with_part(certificate, "statement", elsewhere)).reason
    unnamed = {name: x for name, x in certificate["statement"].items() if name not in NODE}
    assert not check(certificate | {"statement": unnamed}).accepted


@pytest.mark.thorough
@pytest.mark.timeout(600)
def test_a_trajectory_that_touches_a_stop_beside_an_orbit_is_not_attracted_by_it():
    place = {"omega": "0.2604494382022472", "clearance": "1.7718524462135552"}
    proof = prove(DEFAULT, {**ATTRACTION, **place, "label": "3-2r-2l"})
    assert verdict(proof) == "disproven", proof.reason
    assert proof.enclosures["label"] == "1-1r-1l"


def test_the_numbers_of_the_theory_page_are_proven():
    proof = prove(DEFAULT, {"kind": "codimension-two", "type": "g", "order": 2, "range": ["0.282", "0.283"], "stop": 0})
    page = (Path(__file__).parents[3] / "docs" / "theory.md").read_text("utf-8")
    omega, clearance = re.findall(r"^\| (?:recurrence m = 2, active: omega|clearance there) \| (\S+) \|$", page, re.M)
    assert verdict(proof) == "proven"
    assert proof.enclosures["active"]
    assert proof.enclosures["omega"].startswith(f"[{omega}")
    assert proof.enclosures["clearance"].startswith(f"[{clearance}")


def test_where_a_trajectory_of_a_general_system_goes_is_proven(general):
    """The impacts of the orbit are those of fifty digits."""
    assert verdict(general) == "proven", general.reason
    shown = general.enclosures
    exact = GeneralOracle.of(GENERAL, 0.7, 0.3, 0.4)
    exact.run(until=60 * 2.0 * np.pi / 0.7)
    speeds = [float(v) for v in exact.speeds[-3:]]
    assert sorted(exact.stops[-3:]) == sorted(shown["stops"]) == [-1, 1, 1]
    np.testing.assert_allclose(sorted(middle(v) for v in shown["velocities"]), sorted(speeds), rtol=1e-9)


def test_another_label_of_a_general_system_is_disproven(general):
    is_disproven_with_another_label(general.certificate)


def is_disproven_with_another_label(certificate):
    other = with_part(certificate, "statement", {"label": "1-1r-1l"})
    assert not check(other).accepted
    assert check(other | {"verdict": "disproven"}).accepted
    assert not check(certificate | {"verdict": "disproven"}).accepted


def middle(ball):
    """The middle of a ball as certificates have it."""
    return float(ball[1:].split(" ")[0])


@pytest.mark.parametrize(
    ("kind", "parameter", "interval", "value"),
    [("SN", "clearance_right", ["0.29", "0.34"], 0.3362914865006), ("GR", "omega", ["0.65", "0.71"], 0.66465344490)],
)
def test_bifurcations_of_a_general_system_are_proven(kind, parameter, interval, value):
    at = {"kind": "bifurcation", **UNEQUAL, "period": 1, "stops": [1, 1, -1]}
    proof = prove(GENERAL, {**at, "type": kind, "parameter": parameter, "range": interval})
    assert verdict(proof) == "proven", proof.reason
    assert middle(proof.enclosures["value"]) == pytest.approx(value, rel=1e-10)


@pytest.mark.parametrize(("kind", "order", "multiple"), [("g", 2, 0), ("h", 2, 1), ("h_s", 2, 1)])
def test_points_of_one_stop_of_a_general_system_are_proven(kind, order, multiple):
    points = codimension_two_points(GENERAL, 0.2, 2.0, 4, 2, VariedStop(1))
    bifurcation = {"g": None, "h": "SN", "h_s": "PD"}[kind]
    known = [
        point.omega
        for point in points
        if (point.bifurcation == bifurcation and point.multiple == multiple if bifurcation else point.order == order)
    ]
    assert known
    window = [repr(known[0] * (1.0 - 1e-6)), repr(known[0] * (1.0 + 1e-6))]
    statement = {"kind": "codimension-two", "type": kind, "order": order, "range": window}
    proof = prove(GENERAL, {**statement, "stop": 1})
    assert verdict(proof) == "proven", proof.reason
    assert middle(proof.enclosures["omega"]) == pytest.approx(known[0], rel=1e-12)
    curve = reference_motion_maximum(known[0])
    assert middle(proof.enclosures["clearance"]) == pytest.approx(curve, rel=1e-9)
    # a bias and even harmonics: the stops are not grazed at once
    both = check(with_part(proof.certificate, "statement", {"stop": 0}))
    assert "not grazed at once" in both.reason


def reference_motion_maximum(omega):
    """The largest contact coordinate of the steady motion of GENERAL, from its amplitudes on a fine grid."""
    mass, damping = np.array([[2.0, 0.3], [0.3, 1.0]]), np.array([[0.2, 0.05], [0.05, 0.1]])
    stiffness, row = np.array([[3.0, -1.0], [-1.0, 2.0]]), np.array([1.0, -1.0])
    forces = {1: np.array([np.exp(0.3j), -0.4]), 2: np.array([0.02, 0.0]) * (2.0 * omega) ** 2}
    phase = np.linspace(0.0, 2.0 * np.pi, 200_001)
    moved = row @ np.linalg.solve(stiffness, [0.1, 0.0]) * np.ones_like(phase)
    for order, force_ in forces.items():
        s = order * omega
        amplitude = row @ np.linalg.solve(stiffness - s * s * mass + 1j * s * damping, force_)
        moved += (amplitude * np.exp(1j * order * phase)).imag
    return float(moved.max())


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
    other = deepcopy(general.certificate["oscillator"])
    if change is None:
        del other[name]
    else:
        other[name] = change(other[name])
    answer = check(general.certificate | {"oscillator": other})
    assert "does not map the box into itself" in answer.reason or "no contact" in answer.reason


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("statement", {"clearance": {"right": "0.3", "left": "0.4000001"}}),
        ("statement", {"clearance": {"right": "0.3", "left": None}}),
        ("statement", {"clearance": {"right": "0.4", "left": "0.3"}}),
        ("statement", {"clearance": {"right": "0.3", "left": "-0.3"}}),
        ("statement", {"clearance": {"right": None, "left": None}}),
        ("statement", {"restitution": {"right": "0.5", "left": "0.7"}}),
        ("statement", {"displacement": ["0.31", "0.0"]}),
        ("theorem", {"symmetric": True}),
    ],
)
def test_false_theorems_on_a_general_system_are_refused(general, part, change):
    assert not check(with_part(general.certificate, part, change)).accepted


BOUNCING = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.6)
ASIDE = {"displacement": ["-0.5"], "velocity": ["0.0"], "phase": "0.0"}


def test_a_mass_that_bounces_on_a_stop_at_its_equilibrium_is_attracted():
    proof = prove(BOUNCING, {"kind": "attraction", "omega": "1.5", "clearance": {"right": "0", "left": None}} | ASIDE)
    assert verdict(proof) == "proven", proof.reason


def test_a_trajectory_that_begins_within_the_ball_of_its_orbit_is_attracted():
    settled = trajectory(BOUNCING, 0.8, (1.0, None), [0.0], [0.0], transient_periods=400, periods=1)
    where = int(np.searchsorted(settled.time, settled.impacts.time[0])) + 3  # soon after its impact
    phase = 0.8 * settled.time[where]
    state = {
        "displacement": [repr(float(settled.displacement[0, where]))],
        "velocity": [repr(float(settled.velocity[0, where]))],
        "phase": repr(float(phase % (2.0 * np.pi))),
    }
    proof = prove(BOUNCING, {"kind": "attraction", "omega": "0.8", "clearance": {"right": "1", "left": None}} | state)
    assert verdict(proof) == "proven", proof.reason


def test_a_range_with_an_undamped_resonance_is_undecided():
    undamped = Oscillator.create([1.0], [1.0], 0.0, [1.0], 0.6)
    proof = prove(undamped, {"kind": "codimension-two", "type": "h", "order": 2, "range": ["0.5", "1.5"], "stop": 1})
    assert proof.certificate["verdict"] == "undecided"
    assert "infinite" in proof.reason


def test_more_masses_than_the_checker_takes_are_undecided():
    many = Oscillator.create([1.0] * 65, [1.0] * 65, 0.05, [1.0] + [0.0] * 64, 0.6)
    proof = prove(many, {"kind": "codimension-two", "type": "g", "order": 2, "range": ["0.5", "1.5"], "stop": 1})
    assert proof.certificate["verdict"] == "undecided"
    assert "64" in proof.reason


def of_one_stop(oscillator, orbit, kind, interval):
    """The statement of a bifurcation over the clearance of the right stop, which is the only one, from an orbit."""
    impacts = orbit.impacts
    motion = {"period": impacts.period, "stops": impacts.stops.tolist(), "radius": "1e-3"} | {
        name: [repr(float(x)) for x in getattr(impacts, name)] for name in ("phases", "velocities")
    }
    place = {
        "omega": repr(orbit.values.omega),
        "clearance": {"right": repr(orbit.values.clearance_right), "left": None},
    }
    request = {"kind": "bifurcation", "type": kind, "parameter": "clearance_right", "range": interval}
    return prove(oscillator, request | place | motion)


def test_the_graze_at_which_the_only_impact_of_two_periods_vanishes_is_proven():
    oscillator = Oscillator.create([1.0], [1.0], 0.02, [1.0], 0.6)
    amplitude = 1.0 / abs(complex(1.0 - 2.1**2, 0.04 * 2.1))
    orbit = orbit_with(oscillator, 2.1, (1.02 * amplitude, None), 2, [1])
    begin = SimpleNamespace(impacts=orbit.impacts, values=ParameterPoint.of(oscillator, 2.1, (1.02 * amplitude, None)))
    proof = of_one_stop(oscillator, begin, "GR", [repr(0.9 * amplitude), repr(1.1 * amplitude)])
    assert verdict(proof) == "proven", proof.reason
    assert proof.certificate["statement"]["period"] == 1
    assert proof.certificate["statement"]["stops"] == [1]


def test_the_doubling_at_the_end_of_the_doubled_branch_is_proven():
    oscillator = Oscillator.create([1.0], [1.0], 0.05, [1.0], 0.8)
    branch = orbit_branch(oscillator, orbit_with(oscillator, 2.4, (0.0, None), 1, [1]), -0.1, 0.2, "clearance_right")
    (point,) = [point for point in branch.special_points if point.type == "PD" and point.values.clearance_right > 0.0]
    (doubled,) = starts_beyond(oscillator, point, "clearance_right")
    proof = of_one_stop(oscillator, doubled, "PD", ["0.1", "0.16"])
    assert verdict(proof) == "proven", proof.reason
    assert proof.certificate["statement"]["period"] == 1


def test_chatter_is_undecided():
    proof = prove(DEFAULT, {**ATTRACTION, "omega": "0.27", "clearance": "0.5"})
    assert verdict(proof) == "undecided"
    assert "rests" in proof.reason
    assert not check(proof.certificate).accepted


@pytest.mark.parametrize(
    ("part", "change", "reason"),
    [
        ("theorem", {"radius": "1e-40"}, "does not map the box into itself"),
        ("statement", {"clearance": {"right": "1.60000001", "left": "1.60000001"}}, "does not map the box into itself"),
        ("statement", {"restitution": {"right": ".8", "left": ".8"}}, "decimal"),
        ("statement", {"restitution": {"right": "0.80000001", "left": "0.80000001"}}, "does not map the box"),
        ("statement", {"clearance": {"right": "1.6", "left": "1.60000001"}}, "not equal"),
        ("statement", {"clearance": {"right": "1.6", "left": None}}, "not equal"),
        ("statement", {"restitution": {"right": "0.8", "left": "0.80000001"}}, "not equal"),
        ("statement", {"restitution": {"right": "1.1", "left": "1.1"}}, "not between 0 and 1"),
        ("statement", {"omega": "varied"}, "omega"),
        ("theorem", {"period": 1.0}, "integer"),
        ("theorem", {"period": 2}, "odd period"),
        ("theorem", {"scale": "-2"}, "scale"),
    ],
)
def test_false_certificates_of_an_orbit_are_refused(orbit, part, change, reason):
    assert reason in check(with_part(orbit.certificate, part, change)).reason


@pytest.mark.parametrize(
    ("motion", "place"), the_first(1, [("general", -1), ("attraction", 0), ("attraction", 7), ("attraction", -1)])
)
def test_a_transient_without_one_of_its_impacts_is_refused(request, motion, place):
    false = deepcopy(request.getfixturevalue(motion).certificate)
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

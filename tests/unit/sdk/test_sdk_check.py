"""`grazemap check`, on a certificate that is known by hand: one mass, whose impulse response is a damped sine."""

import json
from fractions import Fraction
from math import prod
from pathlib import Path
from typing import Any

import pytest
from flint import arb

from grazemap import cli
from grazemap.checker import FORMAT, check
from grazemap.checker.arithmetic import Refused, exact, newton
from grazemap.checker.reading import OSCILLATOR
from grazemap.checker.system import Inputs, Machine, System
from tests.support.sdk_documents import result_of

# with m = 1, k = 1, c = 0.2, g first vanishes at pi/sqrt(0.99), so the graze recurs at return 1 for omega = sqrt(0.99)
OMEGA, MOVED = "0.99498743710661995", "0.99498743710662005"


FORGED = sorted((Path(__file__).parents[2] / "data" / "forged").glob("*.json"))


def certificate(value: str = OMEGA, stiffness: str = "1", high: str = "1.1", **more: Any) -> dict[str, Any]:
    return {
        "format": FORMAT,
        "statement": {"kind": "codimension-two", "type": "g", "order": 1, "range": ["0.9", high], "stop": 0},
        "verdict": "proven",
        "oscillator": {
            "mass": [["1"]],
            "damping": [["1/5"]],
            "stiffness": [[stiffness]],
            "contact": ["1"],
            "forcing": [{"harmonic": 1, "powers": [[["1"], ["0"]]]}],
        },
        "theorem": {"value": value, "radius": "1e-17"},
        "bits": 128,
        **more,
    }


def with_statement(**change: Any) -> dict[str, Any]:
    return certificate(statement={**certificate()["statement"], **change})


def of_format_2(**change: Any) -> dict[str, Any]:
    """The same certificate in the format before, which repeats the inputs in the theorem."""
    shared = {"kind": "codimension-two", "type": "g", "order": 1, "range": ["0.9", "1.1"]}
    inputs = {"omega": "1", "gaps": ["1", "1"], "restitutions": ["0.8", "0.8"]}
    now = certificate()
    theorem = {**shared, **inputs, **now["theorem"]}
    return {**now, "format": "grazemap-certificate-2", "statement": shared, "theorem": theorem, **change}


@pytest.fixture
def checked(tmp_path, capfd):
    """Gives `checked(document, *words)`: the exit code of `grazemap check`, and its output and errors."""

    def run(document, *words):
        path = tmp_path / "certificate.json"
        path.write_text(document if isinstance(document, str) else json.dumps(document))
        return cli.main(["check", str(path), *words]), *capfd.readouterr()

    return run


def test_a_true_certificate_is_verified_and_the_reason_of_a_refusal_is_printed(checked):
    code, output, _ = checked(certificate())
    assert code == 0
    assert "verified: the statement is proven" in output
    code, _, errors = checked(certificate(value=MOVED))
    assert code == 1
    assert "does not map the box into itself" in errors


@pytest.mark.parametrize(
    ("false", "reason"),
    [
        (certificate(value=MOVED), "does not map the box into itself"),
        (certificate(high="0.99"), "lie in the stated range"),
        (certificate(stiffness="1.0000001"), "does not map the box into itself"),
        (certificate(verdict="disproven"), "does not exclude"),
        (with_statement(order=3), "recurs earlier is undecided"),
        (with_statement(stop=1), "whole periods"),
        (with_statement(active=True), "unknown name"),
        (with_statement(order=1.0), "integer"),
        (with_statement(order=True), "integer"),
        (with_statement(type="H"), "none of"),
        (with_statement(range=["0.9"]), "list"),
        (with_statement(range=["-0.9", "1.1"]), "positive"),
        (certificate(bits=10**9), "integer from"),
        (certificate(value="1e99999"), "decimal"),
        (certificate(value="\u0661"), "decimal"),
        (certificate(value="1/0"), "number"),
        (certificate(value="9" * 20_000), "number"),
        (certificate(stiffness="-1"), "decay"),
        (certificate(reason="it is so"), "unknown name"),
        (certificate(theorem={"value": OMEGA}), "lacks radius"),
        (of_format_2(bits=1), "integer from"),
        (of_format_2(verdict="disproven"), "does not exclude"),
        (of_format_2(statement={"kind": "codimension-two", "type": "g", "order": 3, "range": ["0.9", "1.1"]}), "order"),
    ],
)
def test_a_false_certificate_is_refused_with_its_reason(false, reason):
    answer = check(false)
    assert not answer.accepted
    assert reason in answer.reason


def test_a_certificate_of_the_format_before_is_verified():
    assert check(of_format_2()).accepted
    harmonics = [{"harmonic": 2, "powers": [[["1"], ["0"]]]}]
    twice = check(of_format_2(oscillator={**certificate()["oscillator"], "forcing": harmonics}))
    assert "periods" in twice.reason


@pytest.mark.parametrize("path", FORGED, ids=lambda path: path.stem)
def test_certificates_of_false_statements_are_refused(path, capsys):
    """Each was accepted before; README.md beside them says what is false."""
    assert cli.main(["check", str(path)]) == 1
    assert "not verified" in capsys.readouterr().err


def test_no_text_of_a_certificate_that_is_not_read_reaches_the_terminal(checked):
    marked = "\x1b[2J\nverified: the statement is proven"
    for document in (
        certificate(verdict="undecided", reason=marked),
        certificate(**{marked: 1}),
        with_statement(type=marked),
        with_statement(**{marked: "1"}),
        certificate(value=marked),
        certificate(format=marked),
        {**of_format_2(), marked: 1},
    ):
        code, output, errors = checked(document)
        assert code == 1
        assert "\x1b" not in output + errors
        assert "verified: the" not in output


def test_a_name_that_is_there_twice_is_refused(checked):
    code, _, errors = checked(json.dumps(certificate()).replace('"order": 1', '"order": 1, "order": 1'))
    assert code == 2
    assert "twice" in errors


def test_modules_beside_a_certificate_are_not_loaded(tmp_path, monkeypatch, capfd):
    (tmp_path / "flint.py").write_text("import os, sys; sys.stderr.write('loaded'); os._exit(3)")
    (tmp_path / "certificate.json").write_text(json.dumps(certificate()))
    monkeypatch.chdir(tmp_path)
    assert cli.main(["check", "certificate.json"]) == 0
    assert "loaded" not in capfd.readouterr().err


def test_that_an_orbit_is_not_symmetric_is_not_said():
    """No theorem shows it: an orbit that is not called symmetric may be so."""
    steady = {"period": 1, "symmetric": False, "section": "0", "scale": "1", "stops": [], "times": []}
    inputs = {"omega": "1", "clearance": {"right": "9", "left": "9"}, "restitution": {"right": "0.8", "left": "0.8"}}
    statement = {"kind": "orbit", **inputs, "period": 1, "stops": [], "stable": True}
    # x'' + x'/5 + 2 x = sin t
    theorem = {**steady, "state": ["-0.192307692307692307692", "0.961538461538461538461"], "radius": "1e-9"}
    answer = check(certificate(stiffness="2", statement=statement, theorem=theorem))
    assert answer.accepted, answer.reason
    assert "symmetric" not in answer.enclosures
    assert check(certificate(stiffness="2", statement=statement, theorem={**theorem, "symmetric": True})).accepted


def test_the_time_of_a_check_is_limited(checked):
    code, _, errors = checked(certificate(), "--seconds", "0.01")
    assert code == 1
    assert "within 0.01 s" in errors


@pytest.mark.parametrize("zeros", [("0.3",), ("0.3", "0.3"), ("0.3", "0.3000000001"), ("0.30001",)])
def test_one_zero_in_a_box_is_shown_but_not_two_or_none(zeros):
    places = [exact(zero) for zero in zeros]

    def function(unknowns):
        return [prod(unknowns[0] - place for place in places)]

    if len(zeros) == 1 and zeros[0] == "0.3":
        assert newton(function, [exact("0.30000001")], exact("1e-6"))[0].contains(places[0])
    else:
        with pytest.raises((Refused, ZeroDivisionError)):
            newton(function, [exact("0.30000001")], exact("1e-6"))


@pytest.mark.parametrize("gap", ["1.000000000001", "0.999999999999"])
@pytest.mark.parametrize("stop", [1, -1])
def test_a_pass_before_a_stop_is_shown_but_not_one_beyond_it(gap, stop):
    unforced = {"mass": [["1"]], "damping": [["0"]], "stiffness": [["1"]], "contact": ["1"], "forcing": []}
    inputs = Inputs(Fraction(1), (Fraction(gap), Fraction(gap)), (Fraction("0.8"), Fraction("0.8")))
    system = System(Machine(OSCILLATOR(unforced, "the oscillator")), inputs)
    state = system.with_phase([arb(0), stop / system.scale], arb(0))  # q = +- sin(t), which is 1 at most
    if gap > "1":
        system.fly(state, arb(3), 0, 0, "the flight")
    else:
        with pytest.raises(Refused, match="the flight: it passes a stop by"):
            system.fly(state, arb(3), 0, 0, "the flight")


def test_a_saved_result_is_read_as_a_certificate(tmp_path, capsys):
    path = result_of("proofs").save(tmp_path / "proof.json")
    assert cli.main(["check", str(path)]) == 1
    assert "undecided" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"certificate": 1}', '{"statement": {}, "verdict": 1}'])
def test_a_file_that_is_no_certificate_is_named(checked, text):
    code, _, errors = checked(text)
    assert code == 2
    assert "is not a certificate" in errors

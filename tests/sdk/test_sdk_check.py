"""`grazemap check`, on a certificate that is known by hand: one mass, whose impulse response is a damped sine."""

import json
from math import prod

import pytest
from flint import arb
from sdk_documents import npz

from grazemap import cli
from grazemap.checker import check
from grazemap.checker.arithmetic import Refused, exact, newton
from grazemap.checker.system import System
from grazemap.results import decode_result

# with m = 1, k = 1, c = 0.2, g first vanishes at pi/sqrt(0.99), so the graze recurs at return 1 for omega = sqrt(0.99)
OMEGA, MOVED = "0.99498743710661995", "0.99498743710662005"


def certificate(value: str = OMEGA, stiffness: str = "1", high: str = "1.1") -> dict[str, object]:
    shared = {"kind": "codimension-two", "type": "g", "order": 1, "range": ["0.9", high]}
    return {
        "format": "grazemap-certificate-1",
        "statement": shared,
        "verdict": "proven",
        "oscillator": {
            "mass": [["1"]],
            "damping": [["1/5"]],
            "stiffness": [[stiffness]],
            "contact": ["1"],
            "forcing": {"sine": ["1"], "cosine": ["0"]},
        },
        "theorem": {
            **shared,
            "omega": "1",
            "gaps": ["1", "1"],
            "restitutions": ["0.8", "0.8"],
            "value": value,
            "radius": "1e-17",
        },
        "bits": 128,
    }


def test_a_true_certificate_is_verified(tmp_path, capsys):
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(certificate()))
    assert cli.main(["check", str(path)]) == 0
    assert "verified: the statement is proven" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("false", "reason"),
    [
        (certificate(value=MOVED), "does not map the box into itself"),
        (certificate(high="0.99"), "lie in the stated range"),
        (certificate(stiffness="1.0000001"), "does not map the box into itself"),
        (certificate() | {"verdict": "disproven"}, "does not contradict"),
        (certificate() | {"statement": {"kind": "codimension-two", "type": "g", "order": 3}}, "order is not that"),
        (certificate() | {"bits": 10**9}, "out of range"),
        (certificate(value="1e999999999"), "malformed"),
    ],
)
def test_a_false_certificate_is_refused_with_its_reason(tmp_path, capsys, false, reason):
    answer = check(false)
    assert not answer.accepted
    assert reason in answer.reason
    path = tmp_path / "certificate.json"
    path.write_text(json.dumps(false))
    assert cli.main(["check", str(path)]) == 1
    assert reason in capsys.readouterr().err


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
    data = {"mass": [["1"]], "damping": [["0"]], "stiffness": [["1"]], "contact": ["1"]}
    unforced = data | {"forcing": {"sine": ["0"], "cosine": ["0"]}}
    system = System(unforced, {"omega": "1", "gaps": [gap, gap], "restitutions": ["0.8", "0.8"]})
    state = system.with_phase([arb(0), stop / system.scale], arb(0))  # q = +- sin(t), which is 1 at most
    if gap > "1":
        system.fly(state, arb(3), 0, 0, "the flight")
    else:
        with pytest.raises(Refused, match="the flight: it passes a stop by"):
            system.fly(state, arb(3), 0, 0, "the flight")


def test_a_saved_result_is_read_as_a_certificate(tmp_path, capsys):
    path = decode_result(npz("proofs")).save(tmp_path / "proof.json")
    assert cli.main(["check", str(path)]) == 1
    assert "undecided: rests" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"certificate": 1}', '{"statement": {}, "verdict": 1}'])
def test_a_file_that_is_no_certificate_is_named(tmp_path, capsys, text):
    path = tmp_path / "certificate.json"
    path.write_text(text)
    assert cli.main(["check", str(path)]) == 2
    assert "is not a certificate" in capsys.readouterr().err

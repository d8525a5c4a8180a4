"""`grazemap check`, on a certificate that is known by hand: one mass, whose impulse response is a damped sine."""

import json

import pytest
from sdk_documents import npz

from grazemap import cli
from grazemap.checker import check
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

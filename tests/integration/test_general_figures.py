"""The figures of general structures that were verified to 50 digits elsewhere, through the SDK: each to 1e-11."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grazemap import Oscillator
from grazemap.local_stack import LocalClient
from grazemap.results import Structure

FIGURES: dict[str, Any] = {
    one["id"]: one["value"]
    for one in json.loads((Path(__file__).parents[1] / "data" / "general_figures.json").read_text("utf-8"))["figures"]
}
STIFFNESS = [[1.0, -1.0, 0.0], [-1.0, 6.0, -5.0], [0.0, -5.0, 10.0]]
CHAIN: dict[str, Any] = {}
"""The paper's chain is the default."""
MATRICES = {
    "matrices": {
        "mass": np.diag([1.0, 10.0, 10.0]).tolist(),
        "damping": {"rayleigh": [0.0, 0.1]},
        "stiffness": STIFFNESS,
    },
    "forcing": [1.0, 0.0, 0.0],
}
COCO = {
    "matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]},
    "forcing": {"amplitude": [1.0], "phase": [np.pi / 2]},
}
RELATIVE = 1e-11


def close(figure: str) -> Any:
    return pytest.approx(float(figure), rel=RELATIVE)


def structure(stack: LocalClient, described: dict[str, Any], **asked: Any) -> Structure:
    return stack.structure(Oscillator(**described), **asked, progress=False)


@pytest.mark.parametrize(
    ("name", "described", "omega"),
    [
        ("coco/steady", COCO, 0.8),
        ("chain-one-stop/steady", CHAIN, 0.29),
        ("chain-one-stop/steady", MATRICES, 0.29),
    ],
)
def test_steady_motion_and_impulse_response(
    stack: LocalClient, name: str, described: dict[str, Any], omega: float
) -> None:
    known, found = FIGURES[name], structure(stack, described, omega=[omega], times=[3.7])
    assert found.effective_mass == close(known["m_c"])
    assert found.kappa == close(known["kappa"])
    assert found.contact_equilibrium == 0.0
    assert found.amplitude is not None
    assert found.phase is not None
    assert found.amplitude_slope is not None
    assert found.amplitude[0] == close(known["A"])
    assert found.phase[0] == close(known["phase"])
    assert found.amplitude_slope[0] == close(known["dA_domega"])
    assert found.impulse_response[0] == close(known["g(3.7)"])


@pytest.mark.parametrize(("name", "described"), [("coco/zeros", COCO), ("chain-one-stop/zeros", CHAIN)])
def test_the_impulse_response_vanishes_at_its_zeros(stack: LocalClient, name: str, described: dict[str, Any]) -> None:
    zeros = np.array(FIGURES[name]["g(s)=0"], dtype=float)
    around = np.concatenate([zeros * (1.0 - RELATIVE), zeros * (1.0 + RELATIVE)])
    response = structure(stack, described, times=around).impulse_response
    before, after = np.split(response, 2)
    assert np.all(before * after < 0.0)


@pytest.mark.parametrize("described", [CHAIN, MATRICES])
def test_a_contact_between_two_masses(stack: LocalClient, described: dict[str, Any]) -> None:
    known = FIGURES["relative/first_impact"]
    found = structure(stack, {**described, "contact": [1, 2]}, omega=[0.29, 0.9], times=[3.7])
    assert found.effective_mass == close(known["m_c"])
    assert found.amplitude is not None
    assert found.amplitude.tolist() == [close(known["A"]), close(known["A(0.9)"])]
    assert found.impulse_response[0] == close(known["g(3.7)"])


def test_bias_moves_the_equilibrium_between_the_stops(stack: LocalClient) -> None:
    known, biased = FIGURES["bias/equivalent"], {"bias": [0.05, 0.0, 0.0]}
    found = structure(stack, biased, omega=[0.29], clearance=1.65)
    assert found.contact_equilibrium == close(known["q_e"])
    assert found.gaps is not None
    assert found.amplitude is not None
    assert (found.gaps.right, found.gaps.left) == (close(known["effective_right"]), close(known["effective_left"]))
    graze = FIGURES["bias/grazing_clearances"]
    assert found.contact_equilibrium + found.amplitude[0] == close(graze["right"])
    assert found.amplitude[0] - found.contact_equilibrium == close(graze["left"])


@pytest.mark.parametrize(
    ("stops_move", "contact", "amplitude", "slope"),
    [
        (False, 1, "A_stops_in_space", "dA_stops_in_space"),
        (True, 1, "A_stops_on_ground", "dA_stops_on_ground"),
        (False, [1, 2], "A_between_1_and_2", None),
        (True, [1, 2], "A_between_1_and_2", None),
    ],
)
@pytest.mark.parametrize("described", [CHAIN, {"matrices": MATRICES["matrices"]}])
def test_a_moving_base(
    stack: LocalClient, described: dict[str, Any], stops_move: bool, contact: Any, amplitude: str, slope: str | None
) -> None:
    base = {"amplitude": 1.0, "stops_move": stops_move, "influence": [1.0, 1.0, 1.0]}
    found = structure(stack, {**described, "contact": contact, "base": base}, omega=[0.29])
    assert found.amplitude is not None
    assert found.amplitude_slope is not None
    assert found.amplitude[0] == close(FIGURES["base/amplitudes"][amplitude])
    if slope is not None:
        assert found.amplitude_slope[0] == close(FIGURES["base/amplitudes"][slope])

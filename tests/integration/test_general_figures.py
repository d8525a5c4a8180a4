"""The figures of general structures that were verified to 50 digits elsewhere, through the SDK: each to 1e-11."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from grazemap import Oscillator
from grazemap.local_stack import LocalClient
from grazemap.results import StopGrazingCurves, Structure

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


@pytest.mark.parametrize(("name", "described"), [("coco", COCO), ("chain-one-stop", CHAIN)])
def test_grazes_of_one_stop(stack: LocalClient, name: str, described: dict[str, Any]) -> None:
    only = {"left": None}
    found = stack.codimension_two_points(
        Oscillator(**described), omega=(0.1, 20.0), clearance=only, max_order=2, max_multiple=1, progress=False
    ).points
    # a graze recurs after one period at the zeros of g
    times = sorted(2.0 * np.pi / point.omega for point in found if point.kind == "recurrence")
    zeros = [float(zero) for zero in FIGURES[f"{name}/zeros"]["g(s)=0"] if 0.32 < float(zero) < 62.0]
    assert times[: len(zeros)] == [close(str(zero)) for zero in zeros]
    for known in FIGURES[f"{name}/resonant_points"]:
        of_its_kind = [p for p in found if (p.bifurcation, p.multiple) == (known["kind"], known["n"])]
        (point,) = (point for point in of_its_kind if point.omega == close(known["omega"]))
        assert (point.stop, point.symmetric, point.margin) == (1, False, None)
        assert point.clearance == close(known["A"])
        assert point.amplitude_slope == close(known["dA_domega"])
        assert point.unfolding is not None
        assert point.unfolding.curve_omega == known["side_of_omega"]
        if known["kind"] == "SN":
            assert point.unfolding.quadratic == close(known["coefficient"])
        else:
            assert point.unfolding.velocity_slope == pytest.approx(abs(float(known["v_slope"])), rel=RELATIVE)
            assert point.unfolding.slope == pytest.approx(float(known["slope_relative_to_A"]), rel=RELATIVE, abs=1e-15)
    for known in FIGURES[f"{name}/first_recurrence_one_stop"]:
        omega = [float(known["omega"]), 25.0, 30.0]
        curves = stack.grazing_curve(Oscillator(**described), omega=omega, clearance=only, max_order=40, progress=False)
        assert isinstance(curves, StopGrazingCurves)
        assert curves.first_recurrence_right is not None
        assert curves.first_recurrence_right[0] == 2 * known["first_recurrence_periods"]


def test_a_bias_moves_the_grazes_apart(stack: LocalClient) -> None:
    curves = stack.grazing_curve(Oscillator(bias=[0.05, 0.0, 0.0]), omega=[0.29, 0.3, 0.31], progress=False)
    known = FIGURES["bias/grazing_clearances"]
    assert isinstance(curves, StopGrazingCurves)
    assert curves.clearance_right is not None
    assert curves.clearance_left is not None
    assert curves.clearance_right[0] == close(known["right"])
    assert curves.clearance_left[0] == close(known["left"])
    # as the clearance of both falls, the right stop is grazed first
    assert not np.any(curves.virtual_right)
    assert np.all(curves.virtual_left)


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

"""The figures of general structures that were verified to 50 digits elsewhere, through the SDK: each to 1e-11."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from grazemap import Oscillator
from grazemap.local_client import LocalClient
from grazemap.results import StopGrazingCurves, Structure
from tests.support.general_figures import FIGURES

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


def close_to(figures: list[str]) -> Any:
    return pytest.approx([float(figure) for figure in figures], rel=RELATIVE, abs=1e-300)


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
    known, properties = FIGURES[name], structure(stack, described, omega=[omega], times=[3.7])
    assert properties.effective_mass == close(known["m_c"])
    assert properties.kappa == close(known["kappa"])
    assert properties.contact_equilibrium == 0.0
    assert properties.amplitude is not None
    assert properties.phase is not None
    assert properties.amplitude_slope is not None
    assert properties.amplitude[0] == close(known["A"])
    assert properties.phase[0] == close(known["phase"])
    assert properties.amplitude_slope[0] == close(known["dA_domega"])
    assert properties.impulse_response[0] == close(known["g(3.7)"])


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
    points = stack.codimension_two_points(
        Oscillator(**described), omega=(0.1, 20.0), clearance=only, max_order=2, max_multiple=1, progress=False
    ).points
    # a graze recurs after one period at the zeros of g
    times = sorted(2.0 * np.pi / point.omega for point in points if point.kind == "recurrence")
    zeros = [float(zero) for zero in FIGURES[f"{name}/zeros"]["g(s)=0"] if 0.32 < float(zero) < 62.0]
    assert times[: len(zeros)] == [close(str(zero)) for zero in zeros]
    for known in FIGURES[f"{name}/resonant_points"]:
        of_its_kind = [p for p in points if (p.bifurcation, p.multiple) == (known["kind"], known["n"])]
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


def test_codimension_two_points_of_one_mass(stack: LocalClient) -> None:
    """In the plane of the force at a gap of 1, which is 1 over the clearance at a force of 1."""
    points = stack.codimension_two_points(
        Oscillator(**COCO), omega=(0.4, 3.2), clearance={"left": None}, max_order=2, max_multiple=3, progress=False
    ).points
    compared = 0
    for known in FIGURES["coco/codim2_points_force_plane"]:
        at = [point for point in points if point.omega == close(known["omega"]) and point.multiple == known["n"]]
        for kind, name in (("SN", "SN_coefficient"), ("PD", "PD_quadratic")):
            (point,) = (candidate for candidate in at if candidate.bifurcation == kind)
            assert point.clearance == close(known["A_per_unit_force"])
            assert 1.0 / point.clearance == close(known["grazing_force"])
            assert point.unfolding is not None
            assert point.unfolding.quadratic == close(known[f"{name}_clearance"])
            assert -point.unfolding.quadratic / point.clearance**2 == close(known[f"{name}_force"])
            assert point.unfolding.curve_omega == known[f"{kind}_side_of_omega"]
            compared += 1
    assert compared == 2 * 16


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
    properties = structure(stack, {**described, "contact": [1, 2]}, omega=[0.29, 0.9], times=[3.7])
    assert properties.effective_mass == close(known["m_c"])
    assert properties.amplitude is not None
    assert properties.amplitude.tolist() == [close(known["A"]), close(known["A(0.9)"])]
    assert properties.impulse_response[0] == close(known["g(3.7)"])


def test_bias_moves_the_equilibrium_between_the_stops(stack: LocalClient) -> None:
    known, biased = FIGURES["bias/equivalent"], {"bias": [0.05, 0.0, 0.0]}
    properties = structure(stack, biased, omega=[0.29], clearance=1.65)
    assert properties.contact_equilibrium == close(known["q_e"])
    assert properties.gaps is not None
    assert properties.amplitude is not None
    assert (properties.gaps.right, properties.gaps.left) == (
        close(known["effective_right"]),
        close(known["effective_left"]),
    )
    graze = FIGURES["bias/grazing_clearances"]
    assert properties.contact_equilibrium + properties.amplitude[0] == close(graze["right"])
    assert properties.amplitude[0] - properties.contact_equilibrium == close(graze["left"])


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
    properties = structure(stack, {**described, "contact": contact, "base": base}, omega=[0.29])
    assert properties.amplitude is not None
    assert properties.amplitude_slope is not None
    assert properties.amplitude[0] == close(FIGURES["base/amplitudes"][amplitude])
    if slope is not None:
        assert properties.amplitude_slope[0] == close(FIGURES["base/amplitudes"][slope])


def multipliers_of(known: dict[str, Any]) -> list[complex]:
    return sorted((complex(float(a), float(b)) for a, b in known["multipliers"]), key=lambda m: (m.real, m.imag))


@pytest.mark.parametrize(("name", "described"), [("coco", COCO), ("chain-one-stop", CHAIN)])
def test_orbits_of_one_stop(stack: LocalClient, name: str, described: dict[str, Any]) -> None:
    for known in FIGURES[f"{name}/orbits"]:
        guess = {
            "period": known["n"],
            "stops": [1],
            "phases": [float(known["impact_phase_wt"]) + 1e-3],
            "velocities": [float(known["v"]) * 1.001],
        }
        orbit = stack.periodic_orbit(
            Oscillator(**described),
            omega=float(known["omega"]),
            clearance={"right": float(known["right_stop"]), "left": None},
            motion=guess,
            progress=False,
        )
        assert orbit.clearance_right == float(known["right_stop"])
        assert np.isnan(orbit.clearance)
        assert orbit.velocities[0] == close(known["v"])
        away = (orbit.phases[0] - float(known["impact_phase_wt"])) / np.pi
        assert away == pytest.approx(2.0 * round(away / 2.0), abs=RELATIVE)
        multipliers = sorted(orbit.multipliers.tolist(), key=lambda m: (round(m.real, 9), m.imag))
        assert multipliers == pytest.approx(multipliers_of(known), rel=RELATIVE, abs=RELATIVE)
        assert orbit.admissible == known["admissible_one_stop"]


def test_the_orbit_of_the_book_from_rest_and_by_name(stack: LocalClient) -> None:
    known = FIGURES["coco/book_orbit"]
    for motion in (None, (1, [1])):
        orbit = stack.periodic_orbit(
            Oscillator(**COCO), omega=1.0, clearance={"right": 1.0, "left": None}, motion=motion, progress=False
        )
        assert orbit.velocities[0] == close(known["v_before"])
        assert orbit.phases[0] == close(known["impact_time_mod_2pi"])
        assert (orbit.motion.label, orbit.verified) == ("1-1r-(-1)l", True)


def test_special_points_over_the_force(stack: LocalClient) -> None:
    """The branch over the factor of the force at a gap of 1 has the recorded saddle-nodes and period doublings."""
    for known in FIGURES["coco/curve_points_force_plane"]:
        force = float(known["force"])
        if known["n"] > 1 or float(known["v_at_d_1"]) > 5.0:
            continue
        amplitude = 1.1 * force  # orbits exist above the saddle-node
        branch = stack.orbit_branch(
            Oscillator(**{**COCO, "forcing": {"amplitude": [amplitude], "phase": [np.pi / 2]}}),
            omega=float(known["omega"]),
            clearance={"right": 1.0, "left": None},
            motion=(1, [1]),
            vary="forcing",
            range=(0.7, 1.3),
            progress=False,
        )
        factors = [point.forcing for point in branch.special_points if point.type == known["kind"]]
        assert min(abs(amplitude * factor / force - 1.0) for factor in factors if factor) < RELATIVE


@pytest.mark.parametrize(("name", "described"), [("coco", COCO), ("chain-one-stop", CHAIN)])
def test_curve_points_over_the_right_clearance(stack: LocalClient, name: str, described: dict[str, Any]) -> None:
    for known in FIGURES[f"{name}/curve_points"]:
        gap, omega = float(known["effective_gap"]), float(known["omega"])
        if gap < 0.5:
            continue
        branch = stack.orbit_branch(
            Oscillator(**described),
            omega=omega,
            clearance={"right": 0.99 * gap, "left": None},
            motion=(1, [1]),
            vary="clearance_right",
            range=(0.97 * gap, 1.02 * gap),
            progress=False,
        )
        assert "right stop" in branch.plot().get_xlabel()
        branch.plot_multipliers()
        assert branch.clearance_left is not None
        assert np.all(np.isnan(branch.clearance_left))
        points = [point for point in branch.special_points if point.type == known["kind"]]
        assert min(abs(point.parameter / gap - 1.0) for point in points) < RELATIVE
        assert min(abs(point.velocities[0] / float(known["v"]) - 1.0) for point in points) < 1e-6


def test_a_trajectory_between_unequal_stops(stack: LocalClient) -> None:
    known = FIGURES["unequal-stops/trajectory"]
    trajectory = stack.trajectory(
        Oscillator(**MATRICES), omega=0.29, clearance={"right": 1.6, "left": 1.75}, periods=200, progress=False
    )
    impacts = trajectory.impacts
    assert (len(impacts.time), np.sum(impacts.stop == 1)) == (known["impacts"], known["right"])
    listed = len(known["first_times"])
    assert impacts.stop[:listed].tolist() == known["first_stops"]
    assert impacts.time[:listed] == close_to(known["first_times"])
    assert impacts.velocity[:listed] == close_to(known["first_velocities"])
    assert trajectory.final.displacement == close_to(known["final_displacement"])
    assert trajectory.final.velocity == close_to(known["final_velocity"])


def test_the_first_impact_of_two_masses_on_each_other(stack: LocalClient) -> None:
    known = FIGURES["relative/first_impact"]
    trajectory = stack.trajectory(
        Oscillator(contact=[1, 2]), omega=0.29, clearance={"right": 0.8, "left": 1.1}, periods=1, progress=False
    )
    assert trajectory.impacts.time[0] == close(known["first_impact_time"])
    assert trajectory.impacts.velocity[0] == close(known["first_impact_velocity"])


@pytest.mark.parametrize(
    ("name", "described", "omega", "clearance"),
    [("stick/chain-one-stop", CHAIN, 0.1, 1.2), ("stick/coco-like", COCO, 0.3, 0.6)],
)
def test_rests_on_one_stop(
    stack: LocalClient, name: str, described: dict[str, Any], omega: float, clearance: float
) -> None:
    known = FIGURES[name]
    trajectory = stack.trajectory(
        Oscillator(**described, restitution=0.3),
        omega=omega,
        clearance={"right": clearance, "left": None},
        periods=6,
        progress=False,
    )
    first = known["first_impacts"]
    assert trajectory.impacts.time[: len(first)] == close_to([time for time, _, _ in first])
    assert trajectory.impacts.velocity[: len(first)] == close_to([speed for _, _, speed in first])
    rests = trajectory.sticking
    starts, ends = ([time for what, time, _ in known["events"] if what == kind] for kind in ("accumulation", "release"))
    assert rests.start == close_to(starts)
    assert rests.stop_time[: len(ends)] == close_to(ends)
    assert np.all(rests.stop == 1)
    assert trajectory.final.displacement == close_to(known["final_displacement"])
    assert trajectory.final.velocity == close_to(known["final_velocity"])


def test_a_map_with_one_stop(stack: LocalClient) -> None:
    """The map over the force at a gap of 1 is that over the gap, 1 over the force, at a force of 1."""
    known = np.array(FIGURES["coco/map_force_plane"])[::-1]  # rows along the clearance
    forces = np.arange(12, 0, -1) / 10.0
    # two masses beside it do not move, so that the map's kernels are those of three masses, which are there
    three = {"mass": np.eye(3), "damping": 0.1 * np.eye(3), "stiffness": np.diag([1.0, 2.0, 3.0])}
    oscillator = Oscillator(
        matrices={name: matrix.tolist() for name, matrix in three.items()},
        forcing={"amplitude": [1.0, 0.0, 0.0], "phase": [np.pi / 2, 0.0, 0.0]},
    )
    umap = stack.unfolding_map(
        oscillator,
        omega=(0.55 + 0.1 * np.arange(12)).tolist(),
        clearance={"right": (1.0 / forces).tolist(), "left": None},
        progress=False,
    )
    # what a point of the map, and a part of it, are asked for with has the same stops
    point = umap.at(1.05, 1.0)
    assert point.request is not None
    assert point.request["clearance"] == {"right": 1.0, "left": None}
    part = umap.zoom((1.0, 1.1), (0.9, 1.1))
    assert (part["vertical"], part["clearance"]) == (("clearance_right", 0.9, 1.1), {"left": None})
    assert umap.plot().get_ylabel() == "clearance $b$ of the right stop"
    settled = known[:, :, 0] > 0
    for name, values in zip(("period", "impacts_right", "impacts_left"), np.moveaxis(known, 2, 0), strict=True):
        assert np.array_equal(getattr(umap, name)[settled], values[settled])
    assert np.all(umap.verified[settled])
    assert np.count_nonzero(settled) == 141

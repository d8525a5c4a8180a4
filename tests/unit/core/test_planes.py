"""Maps and diagrams over any parameters: the same motions as of the oscillator that has the values of each point."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from grazemap_core.codes import HIDDEN_BY_ROUNDING
from grazemap_core.contact.stops import STOPS_UNIT
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.maps import planes
from grazemap_core.maps.kernels import lane_state
from grazemap_core.maps.map_settings import MapSettings, RunSettings, random_starts
from grazemap_core.maps.plane_grazes import grazing_margins
from grazemap_core.maps.planes import Axis, Plane, PlaneRunner
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.drive import force
from grazemap_core.simulation.observables import Observables, Output
from grazemap_core.simulation.trajectories import trajectory
from tests.support.oscillators import DEFAULT, VARYING, biased
from tests.support.refused import refused
from tests.support.thorough import the_first

PERIODS = 300
OMEGA = np.linspace(0.262, 0.298, 4)
LABEL = ("kind", "period", "impacts_right", "impacts_left", "symmetric", "sticking")


AXES = {
    "omega": Axis("omega", OMEGA),
    "clearance": Axis("clearance", np.linspace(1.35, 1.95, 5)),
    "clearance_right": Axis("clearance_right", np.linspace(1.4, 1.9, 5)),
    "clearance_left": Axis("clearance_left", np.linspace(-0.2, 1.8, 4)),
    "restitution": Axis("restitution", np.linspace(0.3, 0.9, 4)),
    "restitution_left": Axis("restitution_left", np.linspace(0.0, 1.0, 4)),
    "bias": Axis("bias", np.linspace(-3.0, 4.0, 4)),
    "forcing": Axis("forcing", np.linspace(0.7, 1.4, 4)),
    "damping": Axis("damping", np.linspace(0.6, 1.4, 3)),
    "masses[1]": Axis("masses[1]", np.linspace(0.8, 1.3, 3)),
}
PAIRS = [
    ("omega", "restitution"),
    ("clearance_right", "clearance_left"),
    ("restitution_left", "omega"),
    ("omega", "bias"),
    ("forcing", "bias"),
    ("omega", "damping"),
    ("damping", "masses[1]"),
    ("damping", "clearance"),
    ("clearance", "masses[1]"),
]


def plane(across, up, oscillator=None):
    """A plane about the default point; the bias varies that of a biased one."""
    of = (biased() if "bias" in (across, up) else VARYING) if oscillator is None else oscillator
    at = ParameterPoint.of(of, 0.29, 1.6)
    return Plane(of, at, AXES[across], AXES[up])


def alone(grid, row, column, observed=None, **settings):
    """The map of one point, of the oscillator that has all its values."""
    oscillator, omega, clearance = grid.at_point(row, column)
    if isinstance(clearance, tuple):
        right, left = clearance
        pair = [[np.inf if side is None else side for side in (right, left)]]
        single = Plane.of(oscillator, np.array([omega]), np.array(pair))
    else:
        single = Plane.of(oscillator, np.array([omega]), np.array([clearance]))
    return unfolding_map_tile(single, MapSettings(PERIODS, **settings), observed=observed)


@pytest.mark.parametrize(("across", "up"), PAIRS)
def test_a_point_has_the_motion_of_the_oscillator_with_its_values(across, up):
    grid = plane(across, up)
    arrays = unfolding_map_tile(grid, MapSettings(PERIODS))
    rows, columns = grid.shape
    for row, column in [(0, 0), (rows - 1, 0), (1, columns - 1)]:
        single = alone(grid, row, column)
        settled = single["verified"][0, 0]
        for name in LABEL if settled else ("kind",):
            assert arrays[name][row, column] == single[name][0, 0], name
        if settled:
            assert arrays["least_impact_velocity"][row, column] == pytest.approx(
                single["least_impact_velocity"][0, 0], rel=1e-9, nan_ok=True
            )


@pytest.mark.parametrize(("across", "up"), [("omega", "restitution"), ("omega", "damping"), ("forcing", "bias")])
def test_the_transposed_plane_is_the_same_map(across, up):
    tile, other = (
        unfolding_map_tile(plane(across, up), MapSettings(PERIODS)),
        unfolding_map_tile(plane(up, across), MapSettings(PERIODS)),
    )
    for name, array in tile.items():
        np.testing.assert_array_equal(array, other[name].T, err_msg=name)


RESONANT = float(trajectory_models(VARYING).free.frequency_squared[0] ** 0.5)
APART = {
    "more than lanes": (VARYING, 1.5, np.linspace(0.262, 0.298, 12), np.linspace(0.6, 1.4, 12)),
    "chatter and rest": (VARYING, 0.15, OMEGA, AXES["damping"].values),
    "one stop, hardly damped": (VARYING, (0.6, None), OMEGA, np.array([1e-3, 1.0])),
    "resonance": (VARYING, 20.0, np.array([RESONANT, 1.01 * RESONANT]), np.array([1e-13, 1e-12])),
    "bias and two harmonics": (biased(harmonics=True), 1.4, OMEGA, AXES["damping"].values),
    "preloaded": (biased(), (-0.2, 1.0), OMEGA, AXES["damping"].values),
    "hidden by rounding": (VARYING, 1e-14, OMEGA[:2], AXES["damping"].values),
}


@pytest.mark.parametrize("name", the_first(4, APART))
def test_trajectories_apart_are_those_that_run_alone(name, monkeypatch):
    """A lane with tables of its own does what it does among lanes that share them, to the byte."""
    oscillator, clearance, omega, damping = APART[name]
    at = ParameterPoint.of(oscillator, 0.29, clearance)
    runner = PlaneRunner(Plane(oscillator, at, Axis("omega", omega), Axis("damping", damping)), RunSettings(PERIODS, 8))
    codes, figures = runner.grid()
    # a lane for each trajectory, then one after the other
    for attribute in ("BYTES_OF_SEPARATE_MODELS", "CAN_SEPARATE"):
        monkeypatch.setattr(planes, attribute, 0)
        other_codes, other_figures = runner.grid()
        np.testing.assert_array_equal(codes, other_codes)
        np.testing.assert_array_equal(figures, other_figures)
    reasons, sticking = np.unique(codes[lane_state.REASON]), codes[lane_state.STICKING]
    assert np.any(sticking) or name != "chatter and rest"
    assert len(reasons) > 1 or name != "more than lanes"
    assert np.all(reasons == HIDDEN_BY_ROUNDING) or name != "hidden by rounding"


def test_a_map_over_the_forces_at_powers_of_two_is_that_over_the_clearance():
    """Motions between stops at b under forces F are F times those under 1, at b/F (theory, "Other planes")."""
    factors = 2.0 ** np.arange(-2, 2)
    over_forces = Plane(VARYING, ParameterPoint.of(VARYING, 1.0, 0.85), AXES["omega"], Axis("forcing", factors))
    tile = unfolding_map_tile(over_forces, MapSettings(PERIODS))
    scaled = unfolding_map_tile(Plane.of(VARYING, OMEGA, 0.85 / factors[::-1]), MapSettings(PERIODS))
    for row, factor in enumerate(factors):
        forced = replace(DEFAULT, drive=(force(1, np.array([factor, 0.0, 0.0])),))
        really = unfolding_map_tile(Plane.of(forced, OMEGA, np.array([0.85])), MapSettings(PERIODS))
        for name, array in tile.items():
            size = factor if name == "least_impact_velocity" else 1.0
            np.testing.assert_array_equal(array[row], really[name][0], err_msg=name)
            np.testing.assert_array_equal(array[row], size * scaled[name][len(factors) - 1 - row], err_msg=name)
    assert len(np.unique(tile["impacts_right"][tile["verified"]])) > 2


@pytest.mark.parametrize("up", ["clearance_right", "restitution", "bias", "forcing", "damping", "omega"])
def test_a_sweep_hands_on_the_physical_state(up):
    """The end of each trajectory is the state of the real oscillator after as many periods."""
    grid = plane("clearance" if up == "omega" else "omega", up, biased())
    runner = PlaneRunner(grid, RunSettings(4, 8, early=False, linearised=False, follow=True))
    ends = []
    final_state = Runner.final_state

    def kept(*arguments):
        ends.append(final_state(*arguments))
        return ends[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Plane, "is_swept_by_kernels", False)
        patch.setattr(Runner, "final_state", kept)
        runner.sweep(np.arange(grid.shape[0]), 1)
    state = None
    for row, end in enumerate(ends):
        oscillator, omega, clearance = grid.at_point(row, 1)
        begun = () if state is None else _within(oscillator, clearance, state)
        run = trajectory(oscillator, omega, clearance, *begun, periods=4, samples_per_period=1)
        state = np.stack([run.final.displacement, run.final.velocity])
        np.testing.assert_allclose(end, state, atol=1e-9)
        state = end


def _within(oscillator, clearance, state):
    right, left = clearance if isinstance(clearance, tuple) else (clearance, clearance)
    inside = min(max(float(oscillator.contact @ state[0]), -left), right)
    return oscillator.with_contact(state[0], inside), state[1]


@pytest.mark.parametrize("up", ["clearance", "clearance_left", "restitution_left"])
def test_a_sweep_point_by_point_is_that_of_the_kernels(up, monkeypatch):
    grid = plane("omega", up, biased(harmonics=True))
    kernels = unfolding_map_tile(grid, MapSettings(PERIODS, policy="sweep-down"))
    monkeypatch.setattr(Plane, "is_swept_by_kernels", False)
    points = unfolding_map_tile(grid, MapSettings(PERIODS, policy="sweep-down"))
    both = kernels["verified"] & points["verified"]
    assert both.mean() > 0.25
    for name in LABEL:
        np.testing.assert_array_equal(kernels[name][both], points[name][both])
    np.testing.assert_array_equal(kernels["verified"], points["verified"])


@pytest.mark.parametrize("up", ["bias", "forcing", "restitution"])
def test_an_ensemble_has_random_states_about_the_origin_of_each_point(up):
    grid = plane("omega", up)
    settings = {"policy": "ensemble", "initial_conditions": 3, "seed": 1}
    arrays = unfolding_map_tile(grid, MapSettings(PERIODS, **settings))
    for row, column in [(0, 0), (2, 3)]:
        single = alone(grid, row, column, **settings)
        assert arrays["share"][row, column] == single["share"][0, 0]
        assert arrays["motions_found"][row, column] == single["motions_found"][0, 0]


@pytest.mark.parametrize(("across", "up"), [("omega", "forcing"), ("clearance_right", "bias"), ("damping", "forcing")])
def test_what_is_observed_is_of_the_motion_of_the_oscillator_with_the_values(across, up):
    """Forces that are scaled for the kernels do not scale energies and outputs."""
    grid = plane(across, up, biased())
    wanted = Observables(
        ("dissipated_power", "impulse", "peak_displacement"), (Output("x2", np.array([0.0, 1.0, 0.0]), np.zeros(3)),)
    )
    arrays = unfolding_map_tile(grid, MapSettings(PERIODS), observed=wanted)
    checked = 0
    for row, column in [(0, 0), (1, 1), (3, 2), (2, 2)]:
        single = alone(grid, row, column, observed=wanted)
        if single["verified"][0, 0]:
            np.testing.assert_allclose(arrays["figures"][:, row, column], single["figures"][:, 0, 0], rtol=1e-9)
            checked += 1
    assert checked > 1


@pytest.mark.parametrize(("across", "up"), [("omega", "damping"), ("clearance_right", "bias"), ("omega", "forcing")])
def test_the_margins_are_those_of_the_simulated_steady_motion(across, up):
    grid = plane(across, up, biased(harmonics=True))
    right, left = grazing_margins(grid)
    for row, column in [(0, 0), (1, 2)]:
        oscillator, omega, clearance = grid.at_point(row, column)
        sides = clearance if isinstance(clearance, tuple) else (clearance, clearance)
        phase = np.linspace(0.0, 2.0 * np.pi, 20001)
        motion = np.full_like(
            phase, float(oscillator.contact @ np.linalg.solve(oscillator.stiffness_matrix, oscillator.bias))
        )
        for harmonic in oscillator.drive:
            w = harmonic.order * omega
            matrix = oscillator.stiffness_matrix - w**2 * oscillator.mass_matrix + 1j * w * oscillator.damping_matrix
            amplitude = oscillator.contact @ np.linalg.solve(matrix, harmonic.amplitudes(np.array([omega]))[0])
            motion = motion + np.imag(amplitude * np.exp(1j * harmonic.order * phase))
        assert right[row, column] == pytest.approx(sides[0] - motion.max(), abs=1e-6)
        assert left[row, column] == pytest.approx(sides[1] + motion.min(), abs=1e-6)


@pytest.mark.parametrize(
    ("across", "up", "name"),
    [
        (AXES["omega"], AXES["omega"], "vertical"),
        (AXES["omega"], Axis("restitution", np.array([0.5, 1.1])), "restitution"),
        (AXES["omega"], Axis("clearance", np.array([-1.0, 1.0])), "clearance"),
        (AXES["omega"], Axis("clearance_left", np.array([-1.7, 1.0])), "clearance"),
        (AXES["omega"], Axis("forcing", np.array([0.0, 1.0])), "forcing"),
        (Axis("omega", np.array([0.0, 1.0])), AXES["restitution"], "omega"),
        (AXES["omega"], Axis("bias", np.array([0.0, np.nan])), "bias"),
        (AXES["omega"], Axis("springs[1]", np.array([0.5, 1.0])), "springs[1]"),
    ],
)
def test_a_plane_out_of_the_domain_of_a_parameter_is_refused(across, up, name):
    grid = Plane(VARYING, ParameterPoint.of(VARYING, 0.29, 1.6), across, up)
    with refused(name):
        unfolding_map_tile(grid, MapSettings(PERIODS))


@pytest.mark.parametrize("clearance", [(1.9, 0.4), (0.3, None), (None, 0.3)])
def test_random_states_of_an_ensemble_have_the_contact_between_the_stops(clearance, monkeypatch):
    """Their contact coordinates fill the space between two stops, and begin at none of them."""
    seen = []

    def kept(masses, column, own, classify_lane):
        starts = column.task.starts
        row = model.contact_row.ravel()
        for index in range(len(starts.stops)):
            for direction in starts.directions:
                moved = starts.stops[index, STOPS_UNIT] * direction + starts.offset[index] * starts.aside[index]
                u = starts.base[index] + moved
                place = float(row @ u.ravel()) + steady
                seen.append(place)
                assert -starts.stops[index, 1] < place < starts.stops[index, 0]
        column.results.codes[...], column.results.figures[...] = 0, 0.0

    monkeypatch.setattr("grazemap_core.maps.runner.settle_column", kept)
    pair = np.array([[np.inf if side is None else side for side in clearance]])
    grid = Plane.of(VARYING, np.array([0.29]), pair)
    task = RunSettings(5, 2, starts=random_starts(VARYING, 40, 0))
    runner = PlaneRunner(grid, task)
    model = trajectory_models(VARYING).free
    forced = Runner(VARYING, task).at(0.29)
    steady = float(forced.reference_state(0.0)[:3] @ VARYING.contact)
    runner.points(np.array([0]), np.array([0]))
    assert len(seen) == 40
    if None not in clearance:
        assert np.ptp(seen) > 0.8 * sum(clearance)

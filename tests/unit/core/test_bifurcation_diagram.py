"""Bifurcation diagrams: periodic motions show as many points as periods, and sweeps stay on their branch."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap_core.codes import ROUNDING_DECIDES, STICKS
from grazemap_core.maps.bifurcation_diagrams import sections
from grazemap_core.maps.kernels.lane_state import IMPACTS
from grazemap_core.maps.map_settings import MapSettings, RunSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.runner import Runner
from grazemap_core.maps.tolerances import EXPONENT_PERIODS
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS, REASONS
from grazemap_core.simulation.start import State, forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.closed_form import one_impact_branch
from tests.oracles.one_impact_orbits import orbits_at_clearance
from tests.oracles.steady_displacements import steady_response
from tests.slow.resolved_points import ONE_MASS, SENSITIVE
from tests.support.lines import line
from tests.support.oscillators import DEFAULT
from tests.support.refused import refused
from tests.support.thorough import KERNELS_FIRST


def distinct(values, tolerance=1e-6):
    """Return how many different numbers there are."""
    return 1 + np.count_nonzero(np.diff(np.sort(values)) > tolerance)


def test_a_motion_of_period_n_shows_n_points_and_its_impacts():
    diagram = list(sections(line(DEFAULT, "clearance", [1.6, 1.99, 2.1], 0.29)))
    assert [section.motion.period for section in diagram] == [1, 3, 1]
    assert [distinct(section.displacement) for section in diagram] == [1, 3, 1]
    assert [section.displacement.size for section in diagram] == [64] * 3
    assert [section.impact_velocity.size for section in diagram] == [64 * 4, pytest.approx(2 * 64 / 3, abs=1), 0]
    assert np.all(diagram[0].impact_velocity * diagram[0].impact_stop > 0.0)
    # beyond the grazing curve it is the steady motion, at phase 0
    steady = steady_response(DEFAULT, [0.29])[0, 0]
    np.testing.assert_allclose(diagram[2].displacement, steady.imag, atol=1e-12)


def test_omega_may_vary_too():
    section = next(sections(line(DEFAULT, "omega", [0.29, 0.30], 1.6)))
    same = next(sections(line(DEFAULT, "clearance", [1.6, 1.7], 0.29)))
    np.testing.assert_array_equal(section.displacement, same.displacement)


def test_a_sweep_keeps_to_its_branch_and_agrees_with_the_closed_form():
    # between the graze of the steady motion and the saddle-node two motions coexist: down from above it is the steady
    # one, up from below the one with an impact
    clearance = np.append(np.linspace(1.850, 1.867, 12), 1.875)  # the last one is above the saddle-node
    up = list(sections(line(DEFAULT, "clearance", clearance, 0.27), "sweep-up"))
    down = list(sections(line(DEFAULT, "clearance", clearance, 0.27), "sweep-down"))[::-1]
    amplitude = abs(steady_response(DEFAULT, [0.27])[0, 0])
    branch = one_impact_branch(DEFAULT, 0.27)
    coexist = 0
    assert up[-1].impact_velocity.size == down[-1].impact_velocity.size == 0
    for value, above, below in zip(clearance[:-1], down[:-1], up[:-1], strict=True):
        fast = orbits_at_clearance(branch, float(value))[-1]
        assert sorted((below.motion.impacts_right, below.motion.impacts_left)) == [-1, 1]
        np.testing.assert_allclose(np.abs(below.impact_velocity), fast.impact_velocity, rtol=1e-6)
        if value > amplitude:
            assert above.impact_velocity.size == 0
            coexist += 1
    assert coexist >= 5


def test_sweeps_name_what_sweeps_of_maps_name():
    clearance = np.linspace(1.55, 1.95, 15)
    for policy in ("rest", "sweep-up", "sweep-down"):
        tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.29]), clearance), MapSettings(policy=policy))
        diagram = list(sections(line(DEFAULT, "clearance", clearance, 0.29), policy, transient_periods=1000))
        if policy == "sweep-down":
            diagram = diagram[::-1]
        compared = 0
        for i, section in enumerate(diagram):
            if section.motion.kind == "periodic" and tile["kind"][i, 0] == 1:
                counts = sorted((section.motion.impacts_right, section.motion.impacts_left))
                assert section.motion.period == tile["period"][i, 0]
                assert counts == sorted((tile["impacts_right"][i, 0], tile["impacts_left"][i, 0]))
                compared += 1
        assert compared


def test_labels_from_rest_are_those_of_a_map():
    clearance = np.linspace(1.3, 1.99, 9)
    tile = unfolding_map_tile(
        Plane.of(DEFAULT, np.array([0.28]), clearance), MapSettings(max_periods=30 + 20 + EXPONENT_PERIODS)
    )
    diagram = list(sections(line(DEFAULT, "clearance", clearance, 0.28), "rest", 20, 30))
    assert {section.motion.kind for section in diagram} == {"chaotic", "periodic"}
    assert [KINDS.index(section.motion.kind) for section in diagram] == tile["kind"][:, 0].tolist()
    for name in ("verified", "period", "impacts_right", "impacts_left", "symmetric", "sticking"):
        assert [getattr(section.motion, name) or 0 for section in diagram] == tile[name][:, 0].tolist()
    for name in ("sensitive", "transient_growth"):
        np.testing.assert_array_equal([getattr(section, name) for section in diagram], tile[name][:, 0])


def test_a_trajectory_that_passes_an_orbit_is_named_after_where_it_goes():
    # as `test_capture`: the trajectory comes close to the verified orbit 3-2r-2l, and leaves it again
    (section,) = sections(line(DEFAULT, "clearance", [1.7718524462135552], 0.2604494382022472))
    motion = section.motion
    assert (motion.period, motion.impacts_right, motion.impacts_left, motion.verified) == (1, 1, 1, True)


@pytest.mark.parametrize(
    ("oscillator", "omega", "clearance"),
    [SENSITIVE[:3], pytest.param(*ONE_MASS[:3], marks=KERNELS_FIRST)],
    ids=["three masses", "one mass"],
)
def test_a_motion_after_a_long_chaotic_transient_is_sensitive(oscillator, omega, clearance):
    (section,) = sections(line(oscillator, "omega", [omega], clearance))
    assert (section.motion.kind, section.motion.verified, section.sensitive) == ("periodic", False, True)
    assert section.motion.reason == REASONS[ROUNDING_DECIDES]


def test_the_motion_that_is_named_is_the_one_that_is_drawn():
    """After a chaotic transient roundings decide where a trajectory goes; the record belongs to the named motion."""
    clearance = np.linspace(1.2, 2.1, 150)[12:28]
    decided_by_rounding = 0
    for section in sections(line(DEFAULT, "clearance", clearance, 0.28)):
        motion = section.motion
        if motion.kind != "periodic":
            continue
        displacement, period = section.displacement, motion.period
        np.testing.assert_allclose(displacement[period:], displacement[:-period], atol=1e-6)
        wanted = np.array([motion.impacts_right, motion.impacts_left]) * 64 / period
        drawn = [np.count_nonzero(section.impact_stop == stop) for stop in (1, -1)]
        # the counts of a map are those of one of two mirrored motions; a record may begin within a period
        np.testing.assert_allclose(np.sort(drawn), np.sort(wanted), atol=wanted.max() * period / 64)
        decided_by_rounding += section.sensitive
    assert decided_by_rounding >= 2


def test_a_trajectory_of_a_sweep_has_the_error_of_the_one_before_unless_that_was_captured():
    clearance = [1.383333, 1.390909, 1.398485]
    chaotic, after, captured = sections(line(DEFAULT, "clearance", clearance, 0.28), "sweep-down")
    assert (chaotic.motion.kind, chaotic.sensitive) == ("chaotic", False)
    assert (after.motion.kind, after.motion.verified, after.sensitive) == ("periodic", False, True)
    assert (captured.motion.verified, captured.sensitive) == (True, False)
    from_rest = list(sections(line(DEFAULT, "clearance", clearance, 0.28)))[1]
    assert (from_rest.motion.verified, from_rest.sensitive) == (True, False)


@pytest.mark.parametrize("stop", [1.0, -1.0])
@pytest.mark.parametrize("velocity", [0.0, -0.3, 0.3])
def test_a_state_on_a_stop_is_followed_as_by_a_recorded_trajectory(stop, velocity):
    runner = Runner(DEFAULT, RunSettings(8, 32, early=False, linearised=False))
    for phase in (0.0, 2.0, 4.0):
        state = State(np.array([0.7 * stop, 0.1, -0.2]), np.array([velocity * stop, 0.1, 0.0]), phase)
        codes, _, _ = runner.run_from(forced_oscillator(DEFAULT, 0.4, 0.7), state)
        run = trajectory(DEFAULT, 0.4, 0.7, state.displacement, state.velocity, phase, periods=8)
        at_start = run.impacts.time == 0.0
        assert np.count_nonzero(at_start) == (velocity > 0.0)
        assert codes[IMPACTS] == np.count_nonzero(~at_start)


def test_a_sweep_goes_on_from_a_rest_on_a_stop():
    soft = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.3)
    rested, after = sections(line(soft, "omega", [0.457, 0.465], 0.5), "sweep-up")
    assert (abs(after.start.displacement[0]), after.start.velocity[0]) == (0.5, 0.0)
    for motion in (rested.motion, after.motion):
        assert (motion.period, motion.impacts_right, motion.impacts_left, motion.sticking) == (1, -2, -2, True)
        assert motion.reason == REASONS[STICKS]


def test_chaos_is_distinguished_from_motions_that_have_not_settled():
    clearance = np.linspace(1.2, 2.1, 32)
    tile = unfolding_map_tile(Plane.of(DEFAULT, np.array([0.28]), clearance))
    diagram = list(sections(line(DEFAULT, "clearance", clearance, 0.28)))
    kinds = [section.motion.kind for section in diagram]
    assert kinds.count("chaotic") >= 2
    for i, section in enumerate(diagram):
        if section.motion.kind == "chaotic":
            assert tile["kind"][i, 0] in (KINDS.index("chaotic"), KINDS.index("unresolved"))
            assert section.motion.reason is None
            assert not section.motion.verified
        assert (section.motion.reason is None) == (section.motion.verified or section.motion.kind == "chaotic")


@pytest.mark.parametrize(
    ("arguments", "settings", "name"),
    [
        (("restitution", [1.0, 2.0], 0.3), {}, "restitution"),
        (("masses[1]", [1.0, 2.0], 0.3), {}, "masses[1]"),
        (("clearance", [2.0, 1.0], 0.3), {}, "clearance"),
        (("clearance", [0.0, 1.0], 0.3), {}, "clearance"),
        (("clearance", [1.0, np.nan], 0.3), {}, "clearance"),
        (("clearance", [1.0, 2.0], -0.3), {}, "omega"),
        (("omega", [1.0, 2.0], np.inf), {}, "clearance"),
        (("omega", [1.0, 2.0], (-1.0, 0.5)), {}, "clearance"),
        (("clearance", [1.0, 2.0], 0.3), {"policy": "ensemble"}, "policy"),
        (("clearance", [1.0, 2.0], 0.3), {"periods": 0}, "periods"),
        (("clearance", [1.0, 2.0], 0.3), {"transient_periods": -1}, "transient_periods"),
        (("clearance", [1.0, 2.0], 0.3), {"max_period": 0}, "max_period"),
    ],
)
def test_an_invalid_diagram_is_refused_before_anything_is_simulated(arguments, settings, name):
    with refused(name):
        sections(line(DEFAULT, *arguments), **settings)

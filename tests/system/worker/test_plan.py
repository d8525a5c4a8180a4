"""Plans: every pixel in exactly one tile, and a cost that rises with the work."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grazemap.wire import Estimate, Oscillator, ProcessRequest, UnfoldingMapsRequest, linear, parse_request
from grazemap_core.maps import tolerances
from grazemap_core.maps.tolerances import EXPONENT_PERIODS
from grazemap_worker.planning import Plan, rates
from grazemap_worker.planning.costs import contact_force, fastest_exponent, setup_seconds
from grazemap_worker.planning.rates import (
    MAP_PERIODS_PER_SECOND,
    PERIODS_PER_SECOND,
    RESOLUTION_AT_WORST,
    TILE_SECONDS,
    WORST_TILE_SECONDS,
)
from grazemap_worker.processes import IMPLEMENTATIONS, kernels_of
from grazemap_worker.processes.conversion import core_oscillator

DEFAULT = Oscillator()
SIDES = {"omega": {"start": 0.26, "stop": 0.3, "points": 300}, "clearance": {"start": 1.3, "stop": 2.0, "points": 300}}


def plan(process: str, request: ProcessRequest) -> Plan:
    return IMPLEMENTATIONS[process].plan(request)


def map_request(columns: int, rows: int, max_periods: int = 1000, start: float = 0.26) -> UnfoldingMapsRequest:
    return UnfoldingMapsRequest.model_validate(
        {
            "omega": {"start": start, "stop": start + 0.04, "points": columns},
            "clearance": {"start": 1.3, "stop": 2.0, "points": rows},
            "max_periods": max_periods,
        }
    )


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.08])
@pytest.mark.parametrize("process", ["grazing-curves", "codimension-two-points"])
def test_the_zeros_of_any_impulse_response_are_estimated(process: str, damping: float) -> None:
    """At damping 0.05 the mass is critically damped to the last bit."""
    oscillator = {"masses": [2.0], "stiffnesses": [800.0], "damping": damping, "forcing": [12.0], "restitution": 0.7}
    omega = {"start": 10.0, "stop": 30.0, **({"points": 4} if process == "grazing-curves" else {})}
    request = parse_request(process, {"oscillator": {**oscillator, "units": "SI"}, "omega": omega})
    assert 0.0 < plan(process, request).estimate.seconds < 0.1


def test_the_sample_of_chaotic_motions_is_estimated_as_the_core_takes_it() -> None:
    assert tolerances.RUN_ON_SAMPLE == rates.RUN_ON_SAMPLE
    assert tolerances.SIDE_BY_SIDE == rates.RUN_ON_TOGETHER
    assert tolerances.RUN_ON == rates.RUN_ON
    assert tolerances.RUN_ON_PERIODS == rates.RUN_ON_PERIODS


def test_motions_of_a_diagram_are_estimated_to_settle_as_late_as_the_core_waits() -> None:
    assert rates.DIAGRAM_SETTLING_PERIODS == EXPONENT_PERIODS


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 200), st.integers(2, 200), st.sampled_from([1, 30, 250, 10**6]))
def test_tiles_cover_the_grid_exactly_once(columns: int, rows: int, max_periods: int) -> None:
    cut = plan("unfolding-maps", map_request(columns, rows, max_periods))
    covered = np.zeros((rows, columns), dtype=int)
    for row_start, row_stop, column_start, column_stop in cut.tiles:
        assert row_start < row_stop
        assert column_start < column_stop
        covered[row_start:row_stop, column_start:column_stop] += 1
    assert (covered == 1).all()
    assert cut.estimate.tiles == cut.tile_count == len(cut.tiles)


@pytest.mark.parametrize(("columns", "rows"), [(512, 512), (2000, 3), (3, 2000), (128, 128)])
def test_tiles_of_a_large_map_take_about_the_intended_time(columns: int, rows: int) -> None:
    # a preview, whose estimate is that of its tiles alone
    cut = plan("unfolding-maps", map_request(columns, rows).model_copy(update={"preview": True}))
    seconds = cut.tile_rows * cut.tile_columns * cut.estimate.seconds / (rows * columns)
    assert 0.3 * TILE_SECONDS < seconds <= 1.2 * TILE_SECONDS


def test_a_diagram_is_cut_as_its_map_and_its_borders_take_longer() -> None:
    body = {
        "omega": {"start": 0.26, "stop": 0.3, "points": 100},
        "clearance": {"start": 1.3, "stop": 2.0, "points": 100},
    }
    alone = plan("unfolding-maps", parse_request("unfolding-maps", body))
    with_borders, without = (
        plan("unfolding-diagrams", parse_request("unfolding-diagrams", {**body, "borders": borders}))
        for borders in (True, False)
    )
    assert without.tiles == with_borders.tiles == alone.tiles
    assert alone.after == 0 < without.after < 100 <= with_borders.after
    assert with_borders.estimate.seconds > without.estimate.seconds > alone.estimate.seconds
    # steps after the tiles are such as tiles are
    large = plan("unfolding-diagrams", parse_request("unfolding-diagrams", {**body, "borders": True, **SIDES}))
    seconds = plan("unfolding-maps", parse_request("unfolding-maps", {**body, **SIDES})).estimate.seconds
    assert large.after / large.tile_count == pytest.approx((large.estimate.seconds - seconds) / seconds, rel=0.02)


def test_a_column_of_few_clearances_costs_more_a_point_but_less_than_a_whole_one() -> None:
    long, short, least = (plan("unfolding-maps", map_request(64, rows)).estimate.seconds for rows in (128, 8, 2))
    assert 8 / 128 * long < short < long
    assert 2 / 8 * short < least < short


def test_a_branch_costs_more_the_more_impacts() -> None:
    def seconds(impacts: int) -> float:
        guess = {"phases": [0.01 * k for k in range(impacts)], "velocities": [0.1] * impacts}
        motion = {"period": 1, "stops": [1] * impacts, **guess}
        body = {"omega": 0.29, "clearance": 1.6, "motion": motion, "range": {"start": 1.3, "stop": 2.0}}
        return plan("orbit-branches", parse_request("orbit-branches", body)).estimate.seconds

    assert seconds(1) < seconds(4) < 1.2 * seconds(1)
    assert 1.7 < seconds(120) / seconds(60) < 2.0


def test_a_branch_over_a_parameter_of_the_structure_costs_the_modes_at_every_point() -> None:
    motion = {
        "period": 1,
        "stops": [1, 1, -1, -1],
        "phases": [0.1, 1.0, 3.2, 4.1],
        "velocities": [0.1, 0.1, -0.1, -0.1],
    }
    seconds = []
    for vary, start, stop in (("clearance", 1.4, 1.8), ("damping", 0.3, 3.0)):
        body = {
            "omega": 0.29,
            "clearance": 1.6,
            "motion": motion,
            "vary": vary,
            "range": {"start": start, "stop": stop},
        }
        seconds.append(plan("orbit-branches", parse_request("orbit-branches", body)).estimate.seconds)
    assert 5.0 * seconds[0] < seconds[1] < 60.0 * seconds[0]  # the range of damping is wide, too


def test_curves_of_motions_cost_more_the_more_impacts_and_the_less_is_known() -> None:
    window = {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.0}}

    def estimate(*motions: dict[str, object]) -> Estimate:
        return plan("bifurcation-curves", parse_request("bifurcation-curves", {**window, "motions": motions})).estimate

    motion = {"period": 1, "stops": [1]}
    place = {"omega": 0.28, "clearance": 1.5}
    known = {**motion, **place, "phases": [1.0], "velocities": [0.1]}
    assert estimate(known).periods == 0
    assert 0 < estimate({**motion, **place}).periods < estimate(motion).periods
    assert estimate(known, known).seconds == 2 * estimate(known).seconds
    many = {**known, "stops": [1] * 40, "phases": [0.1 * k for k in range(40)], "velocities": [0.1] * 40}
    assert estimate(many).seconds > 2 * estimate(known).seconds


def adaptive(columns: int, rows: int, **settings: object) -> UnfoldingMapsRequest:
    return map_request(columns, rows).model_copy(update={"adaptive": True, **settings})


def test_an_adaptive_map_is_cut_into_tall_strips_and_costs_less_the_larger_it_is() -> None:
    shares = []
    for side in (128, 1024, 4096):
        full = plan("unfolding-maps", map_request(side, side, 200))
        cut = plan("unfolding-maps", adaptive(side, side, max_periods=200))
        assert (cut.tile_rows, cut.tile_columns) == (side, 64)
        assert cut.estimate.tiles == cut.tile_count == side // 64
        assert (cut.after > 0) == (cut.tile_count >= 16)
        shares.append(cut.estimate.seconds / full.estimate.seconds)
    assert 1.6 >= shares[0] > shares[1] > shares[2] > 0.05
    assert shares[2] < 0.3
    small, many = plan("unfolding-maps", adaptive(5, 7)), adaptive(512, 512, policy="ensemble", initial_conditions=10)
    assert (small.tile_count, small.tile_rows, small.tile_columns) == (1, 7, 5)
    base = plan("unfolding-maps", adaptive(512, 512)).estimate
    assert 8 * base.seconds < plan("unfolding-maps", many).estimate.seconds < 10 * base.seconds
    assert plan("unfolding-maps", many).estimate.periods == pytest.approx(10 * base.periods)


@pytest.mark.parametrize("kind", [{}, {"adaptive": True}, {"policy": "sweep-up"}])
def test_a_preview_is_expected_sooner(kind: dict[str, object]) -> None:
    request = map_request(512, 512).model_copy(update=kind)
    whole, preview = (plan("unfolding-maps", request.model_copy(update={"preview": told})) for told in (False, True))
    assert preview.estimate.seconds < 0.85 * whole.estimate.seconds
    assert preview.tile_count <= whole.tile_count


def test_the_tiles_of_a_map_that_is_resolved_end_in_time() -> None:
    request = map_request(64, 64)
    as_it_is, resolved = (
        plan("unfolding-maps", request.model_copy(update={"resolve_sensitive": told})) for told in (False, True)
    )
    assert resolved.tile_rows * resolved.tile_columns * RESOLUTION_AT_WORST < 1.2 * WORST_TILE_SECONDS
    assert resolved.estimate.seconds > as_it_is.estimate.seconds


@pytest.mark.parametrize("max_periods", [10_000, 1_000_000])
def test_a_strip_that_may_exceed_the_time_limit_of_a_tile_is_cut(max_periods: int) -> None:
    cut = plan("unfolding-maps", adaptive(128, 4096, max_periods=max_periods))
    assert cut.tile_rows * cut.tile_columns * max_periods / MAP_PERIODS_PER_SECOND < 1.2 * WORST_TILE_SECONDS
    assert cut.tile_rows < 4096


def test_the_estimate_rises_with_pixels_periods_and_stiffness() -> None:
    base = plan("unfolding-maps", map_request(64, 64)).estimate
    assert plan("unfolding-maps", map_request(128, 64)).estimate.periods == 2 * base.periods
    assert plan("unfolding-maps", map_request(64, 64, max_periods=25)).estimate.seconds < 0.3 * base.seconds
    assert plan("unfolding-maps", map_request(64, 64, start=0.01)).estimate.seconds > 5 * base.seconds
    trajectory = parse_request(
        "trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 200, "transient_periods": 800}
    )
    assert plan("trajectories", trajectory).estimate.periods == 1000
    assert plan("trajectories", trajectory).estimate.seconds >= 1000 / PERIODS_PER_SECOND
    assert plan("trajectories", trajectory).tile_count == 1
    many = parse_request(
        "trajectories", {"omega": 0.29, "clearance": 1.6, "periods": 200, "transient_periods": 800, "initial": [{}] * 7}
    )
    assert plan("trajectories", many).estimate.periods == 7000
    seconds = plan("trajectories", trajectory).estimate.seconds
    assert plan("trajectories", many).estimate.seconds == pytest.approx(
        7 * seconds - 6 * setup_seconds(DEFAULT), rel=1e-14
    )
    assert plan("trajectories", many).tile_count == 1


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_the_fastest_exponent_bounds_every_eigenvalue(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 5))
    positive = st.lists(st.floats(0.05, 20), min_size=size, max_size=size)
    dampings = st.one_of(st.just(0.0), st.floats(0.01, 10), st.lists(st.floats(0.01, 10), min_size=size, max_size=size))
    units = data.draw(st.sampled_from(["nondimensional", "SI"]))
    oscillator = Oscillator(
        masses=data.draw(positive),
        stiffnesses=data.draw(positive),
        forcing=[1.0] * size,
        damping=data.draw(dampings),
        units=units,
    )
    core = core_oscillator(oscillator)
    mass, damping, stiffness = (core.mass_matrix, core.damping_matrix, core.stiffness_matrix)
    inverse = np.linalg.inv(mass)
    first_order = np.block([[np.zeros((size, size)), np.eye(size)], [-inverse @ stiffness, -inverse @ damping]])
    largest = np.abs(np.linalg.eigvals(first_order)).max()
    bound = fastest_exponent(oscillator)
    assert largest <= bound * (1 + 1e-6)
    if oscillator.damping == 0.0:
        assert bound <= 2.0 * largest


@settings(max_examples=50, deadline=None)
@given(st.data())
def test_the_force_on_the_held_mass_and_its_free_amplitude_are_those_of_the_matrices(data: st.DataObject) -> None:
    size = data.draw(st.integers(1, 6))
    positive = st.lists(st.floats(0.2, 5), min_size=size, max_size=size)
    chain = {name: data.draw(positive) for name in ("masses", "stiffnesses", "damping", "forcing")}
    oscillator, omega = Oscillator(**chain), np.array([data.draw(st.floats(0.1, 5))])
    force, amplitude = contact_force(oscillator, omega)
    # damping is heavy, so that growing for a hundred periods changes little
    assert amplitude == pytest.approx(linear.steady_amplitude(oscillator, omega), rel=0.05)
    mass, damping, stiffness = linear.matrices(oscillator)
    dynamic = stiffness - omega[0] ** 2 * mass + 1j * omega[0] * damping
    others = np.linalg.solve(dynamic[1:, 1:], np.array(oscillator.forcing)[1:])
    assert force == pytest.approx(abs(oscillator.forcing[0] - dynamic[0, 1:] @ others), rel=0.05, abs=0.02)
    alone = contact_force(oscillator, omega.item())
    assert [float(value) for value in alone] == pytest.approx([force[0], amplitude[0]], rel=1e-12)


def test_diagrams_wait_for_the_kernels_of_their_masses() -> None:
    body = {"vary": "clearance", "range": {"start": 1.3, "stop": 2.0, "points": 4}, "omega": 0.29}
    assert kernels_of("bifurcation-diagrams", parse_request("bifurcation-diagrams", body)) == "diagrams"


def test_there_is_no_tile_outside_the_plan() -> None:
    with pytest.raises(IndexError):
        plan("unfolding-maps", map_request(4, 4)).tile(10**6)


@pytest.mark.parametrize(
    ("mass", "stiffness", "damping"), [(1e-60, 1e60, 0.0), (1e-60, 1e60, 1e60), (1e60, 1e-60, 0.0)]
)
def test_extreme_numbers_have_a_finite_positive_estimate(mass: float, stiffness: float, damping: float) -> None:
    oscillator = Oscillator(masses=[mass], stiffnesses=[stiffness], damping=damping, forcing=[1.0])
    request = map_request(8, 8).model_copy(update={"oscillator": oscillator})
    estimate = plan("unfolding-maps", request).estimate
    assert estimate.seconds > 0
    assert estimate.tiles >= 1


def test_a_sweep_is_cut_into_whole_columns_and_an_ensemble_costs_as_many_maps() -> None:
    base = plan("unfolding-maps", map_request(64, 600))
    for policy in ("sweep-up", "sweep-down"):
        sweep = plan("unfolding-maps", map_request(64, 600).model_copy(update={"policy": policy}))
        assert sweep.tile_rows == 600
        assert sweep.estimate.seconds > base.estimate.seconds
    many = {"policy": "ensemble", "initial_conditions": 10}
    ensemble = plan("unfolding-maps", map_request(64, 600).model_copy(update=many))
    assert ensemble.estimate.periods == pytest.approx(10 * base.estimate.periods)
    # the sample that is run on does not grow with the map
    assert 8 * base.estimate.seconds < ensemble.estimate.seconds < 10 * base.estimate.seconds
    assert ensemble.tile_rows * ensemble.tile_columns < base.tile_rows * base.tile_columns

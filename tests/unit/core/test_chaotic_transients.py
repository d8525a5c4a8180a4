"""The chance of chaotic motions to settle: against longer maps, basins and diagrams, and exact binomial intervals."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binomtest

from grazemap_core.codes import HIDDEN_BY_ROUNDING
from grazemap_core.maps import chaotic_transients
from grazemap_core.maps.basins import Coordinate, basin_tile
from grazemap_core.maps.bifurcation_diagrams import Section, sections
from grazemap_core.maps.chaotic_transients import chance_in_basins, chance_in_diagram, chance_in_map
from grazemap_core.maps.map_settings import MapSettings, RunSettings
from grazemap_core.maps.planes import Plane, PlaneRunner
from grazemap_core.maps.samples import sample, sample_of_groups
from grazemap_core.maps.tolerances import RUN_ON, RUN_ON_PERIODS, RUN_ON_SAMPLE, SIDE_BY_SIDE
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.motion import KINDS, Motion
from grazemap_core.simulation.start import State
from tests.support.lines import line
from tests.support.oscillators import DEFAULT
from tests.support.thorough import KERNELS_FIRST

ONE_MASS = Oscillator.create([1.0], [1.0], 0.02, [1.0], 0.8)
CHAOTIC, PERIODIC = KINDS.index("chaotic"), KINDS.index("periodic")


class Window(NamedTuple):
    """A map with chaos, some of it transient."""

    oscillator: Oscillator
    omega: NDArray[np.float64]
    clearance: NDArray[np.float64]

    def row(self, number: int) -> Window:
        """The map of one clearance."""
        return self._replace(clearance=self.clearance[[number]])


CHAIN = Oscillator.create([1.0, 2.0, 2.0], [1.0, 2.0, 2.0], 0.02, [1.0, 0.0, 0.0], 0.95)
LIGHT = Oscillator.create([1.0], [1.0], 0.01, [1.0], 0.9)
OMEGA, CLEARANCE = np.linspace(0.6, 1.6, 12), np.linspace(0.2, 0.8, 14)
WINDOWS = pytest.mark.parametrize(
    "window",
    [
        Window(CHAIN, np.linspace(0.6, 1.6, 24), np.linspace(0.5, 0.8, 6)),
        pytest.param(Window(LIGHT, OMEGA, CLEARANCE), marks=KERNELS_FIRST),
    ],
    ids=["three masses", "one mass"],
)
CHAOS = pytest.mark.parametrize(
    ("oscillator", "omega", "clearance"),
    [(CHAIN, 1.1, 0.3), pytest.param(ONE_MASS, 0.9545, 6.2047, marks=KERNELS_FIRST)],
    ids=["three masses", "one mass"],
)
WATCHED = 150


@WINDOWS
def test_the_sample_of_a_map_settles_where_a_longer_map_is_periodic(window: Window) -> None:
    short = unfolding_map_tile(Plane.of(*window), MapSettings(WATCHED))
    chance = chance_in_map(short["kind"], Plane.of(*window), MapSettings(max_periods=WATCHED))
    assert chance is not None
    longer = unfolding_map_tile(Plane.of(*window), MapSettings(RUN_ON * WATCHED, preview=True))
    rows, columns = np.nonzero(short["kind"] == CHAOTIC)
    chosen = sample_of_groups([np.flatnonzero(columns == column) for column in np.unique(columns)], WATCHED)
    then = longer["kind"][rows[chosen], columns[chosen]]
    assert (chance.watched, chance.run_on, chance.chaotic) == (WATCHED, RUN_ON * WATCHED, len(rows))
    assert (chance.sampled, chance.settled) == (len(chosen), np.count_nonzero(then == PERIODIC))
    assert 0 < chance.settled < chance.sampled
    exact = binomtest(chance.settled, chance.sampled).proportion_ci(0.95, "exact")
    assert (chance.low, chance.high) == pytest.approx((exact.low, exact.high), abs=1e-12)
    assert chance.chance == chance.settled / chance.sampled


@WINDOWS
@pytest.mark.parametrize("policy", ["sweep-up", "sweep-down", "ensemble"])
def test_a_point_is_run_on_along_the_trajectory_of_the_map(
    policy: str, window: Window, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings: dict[str, Any] = {"max_periods": WATCHED, "policy": policy, "initial_conditions": 3}
    kind = unfolding_map_tile(Plane.of(*window), MapSettings(**settings))["kind"]
    longer = chance_in_map(kind, Plane.of(*window), MapSettings(**settings))
    # after as many periods as in the map nothing of it is periodic
    monkeypatch.setattr(chaotic_transients, "RUN_ON", 1)
    chance = chance_in_map(kind, Plane.of(*window), MapSettings(**settings))
    assert longer is not None
    assert chance is not None
    assert (longer.sampled, chance.sampled, chance.settled) == (RUN_ON_SAMPLE, RUN_ON_SAMPLE, 0)


@pytest.mark.parametrize("down", [False, True])
def test_a_column_is_swept_once_for_all_points_of_its_sample(down: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    plane, sweep, swept = Plane.of(DEFAULT, np.array([0.28]), np.linspace(1.3, 1.6, 12)), PlaneRunner.sweep, []

    def counted(runner: PlaneRunner, rows: Any, *arguments: Any) -> Any:
        swept.extend(rows)
        return sweep(runner, rows, *arguments)

    monkeypatch.setattr(PlaneRunner, "sweep", counted)
    task, rows = RunSettings(40, 4, follow=True), np.array([2, 5, 11])
    codes = chaotic_transients._of_sweep(plane, task, down, rows, np.zeros(3, dtype=np.int64))
    assert len(swept) <= 12 + 3 * (RUN_ON - 1)
    for row, row_codes in zip(rows.tolist(), codes, strict=True):
        path = [*(range(11, row - 1, -1) if down else range(row + 1)), *[row] * (RUN_ON - 1)]
        whole = sweep(PlaneRunner(plane, task), np.array(path), 0)[0]
        np.testing.assert_array_equal(row_codes, whole[-RUN_ON:, 0])


@WINDOWS
def test_a_sweep_of_one_clearance_is_run_on_as_the_map_from_rest(window: Window) -> None:
    for row in (0, 2):
        arguments = window.row(row)
        kind = unfolding_map_tile(Plane.of(*arguments), MapSettings(WATCHED))["kind"]
        rest = chance_in_map(kind, Plane.of(*arguments), MapSettings(max_periods=WATCHED))
        assert rest is not None
        assert rest.settled > 0
        for policy in ("sweep-up", "sweep-down"):
            assert chance_in_map(kind, Plane.of(*arguments), MapSettings(max_periods=WATCHED, policy=policy)) == rest


def test_points_that_are_not_chaotic_have_no_chance_and_planted_ones_settle() -> None:
    omega, clearance = np.array([0.29]), np.array([1.6, 1.7])
    kind = unfolding_map_tile(Plane.of(DEFAULT, omega, clearance), MapSettings(200))["kind"]
    assert np.all(kind == PERIODIC)
    assert chance_in_map(kind, Plane.of(DEFAULT, omega, clearance), MapSettings(max_periods=200)) is None
    planted = chance_in_map(
        np.full_like(kind, CHAOTIC), Plane.of(DEFAULT, omega, clearance), MapSettings(max_periods=200)
    )
    assert planted is not None
    assert (planted.sampled, planted.settled, planted.high) == (2, 2, 1.0)


@CHAOS
def test_states_of_a_basin_are_run_on_from_where_they_start(
    oscillator: Oscillator, omega: float, clearance: float
) -> None:
    across = Coordinate("displacement", 1, np.linspace(-0.95, 0.95, 3) * clearance)
    up = Coordinate("velocity", 1, np.array([0.1]))
    arguments = (oscillator, omega, clearance, across, up, None, None, 0.3, 150, 32)
    kind = basin_tile(*arguments)["kind"]
    assert np.all(kind == CHAOTIC)
    chance = chance_in_basins(kind, *arguments)
    assert chance is not None
    assert (chance.sampled, chance.settled, chance.low) == (3, 0, 0.0)
    settles = (
        DEFAULT,
        0.29,
        1.6,
        *(coordinate._replace(values=coordinate.values / 10.0) for coordinate in (across, up)),
        *arguments[5:],
    )
    planted = chance_in_basins(kind, *settles)
    assert planted is not None
    assert planted.settled == 3


@CHAOS
def test_a_diagram_is_run_on_from_the_starts_of_its_trajectories(
    oscillator: Oscillator, omega: float, clearance: float
) -> None:
    values = np.array([0.95 * clearance, clearance])
    diagram = list(sections(line(oscillator, "clearance", values, omega), periods=10, transient_periods=100))
    assert [section.motion.kind for section in diagram][1] == "chaotic"
    chance = chance_in_diagram(line(oscillator, "clearance", values[1:], omega), diagram[1:], 610, 32)
    assert chance is not None
    assert (chance.watched, chance.run_on, chance.sampled, chance.settled) == (610, 6100, 1, 0)
    nothing = np.zeros(0)
    states = [State(np.zeros(3), np.zeros(3)), State(np.array([1.6, 0.0, 0.0]), np.zeros(3))]
    stops = nothing.astype(np.int8)
    planted = [
        Section(nothing, nothing, nothing, stops, Motion("chaotic"), False, np.nan, state, nothing) for state in states
    ]
    chance = chance_in_diagram(line(DEFAULT, "omega", np.array([0.29, 0.29]), 1.6), planted, 200, 32)
    assert chance is not None
    assert (chance.chaotic, chance.sampled, chance.settled) == (2, 2, 2)


@WINDOWS
def test_a_trajectory_that_ends_early_does_not_count(window: Window) -> None:
    point = window._replace(omega=np.array([0.9]), clearance=np.array([1e-17]))
    assert unfolding_map_tile(Plane.of(*point), MapSettings(50))["reason"] == HIDDEN_BY_ROUNDING
    chance = chance_in_map(np.full((1, 1), CHAOTIC), Plane.of(*point), MapSettings(max_periods=50))
    assert chance is not None
    assert (chance.sampled, chance.low, chance.high) == (0, 0.0, 1.0)
    assert np.isnan(chance.chance)


def test_a_sample_is_bounded_in_number_and_in_periods() -> None:
    assert sample(7, 1000).tolist() == list(range(7))
    spread = sample(10_000, 1000)
    assert len(spread) == RUN_ON_SAMPLE
    assert np.ptp(np.diff(spread)) == 0
    assert len(sample(10_000, RUN_ON_PERIODS // (3 * RUN_ON))) == 3
    assert sample(10_000, RUN_ON_PERIODS).tolist() == [5000]


def test_a_sample_of_groups_has_some_of_a_group_and_groups_by_their_sizes() -> None:
    sizes = [3, 400, 90, 1000, 7, 500]
    ends = np.cumsum(sizes)
    rng = np.random.default_rng(0)
    groups = np.split(rng.permutation(ends[-1]), ends[:-1])
    places = sample_of_groups(groups, 1000)
    assert len(set(places.tolist())) == RUN_ON_SAMPLE
    counts = [np.isin(places, group).sum() for group in groups]
    # of 2000 motions in groups, those at an eighth, three, five and seven eighths
    assert counts == [0, SIDE_BY_SIDE, 0, 2 * SIDE_BY_SIDE, 0, SIDE_BY_SIDE]
    assert np.all(np.diff(np.flatnonzero(np.isin(groups[1], places))) == 80)  # spread over the group
    periods = RUN_ON_PERIODS // (3 * RUN_ON)
    assert len(sample_of_groups(groups, periods)) == 3
    assert sum(np.isin(sample_of_groups(groups, periods), group).any() for group in groups) == 1


@pytest.mark.parametrize("sizes", [[7], [1] * 1000, [1, 1, 1, 15], [2] * 50])
def test_a_sample_of_small_groups_is_that_without_groups(sizes: list[int]) -> None:
    groups = np.split(np.arange(sum(sizes)), np.cumsum(sizes)[:-1])
    assert np.array_equal(sample_of_groups(groups, 1000), sample(sum(sizes), 1000))

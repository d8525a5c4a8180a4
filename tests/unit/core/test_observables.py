"""Quantities that are read off motions: balances, values of 50 digits, maps, orbits and trajectories."""

from __future__ import annotations

import dataclasses
import itertools
import math

import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.linalg import eigvalsh

from grazemap_core.arrays import Floats
from grazemap_core.errors import ParameterError
from grazemap_core.maps.map_settings import MapSettings
from grazemap_core.maps.planes import Plane
from grazemap_core.maps.unfolding import unfolding_map_tile
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.impact_sequences import impacts_of
from grazemap_core.orbits.orbit_observables import OrbitObserver
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from grazemap_core.simulation.observables import MEANS, OBSERVABLES, Observables, Output, of_record
from grazemap_core.simulation.start import forced_oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.balances import NAMES, TOLERANCE, balances, missing, observables, power_of_forces
from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle
from tests.support.oscillators import DEFAULT
from tests.support.random_systems import random_system
from tests.support.thorough import the_first

NOTHING = np.zeros(3)
OUTPUTS = (
    Output("second", np.array([0.0, 1.0, 0.0]), NOTHING),
    Output("mixed", np.array([1.0, -1.0, 0.5]), np.array([0.3, 0.0, -2.0])),
)
WANTED = Observables(OBSERVABLES, OUTPUTS)
DEGREE = 24


def named(wanted: Observables, figures: Floats) -> dict[str, float]:
    """Return the figures of a motion by the names of the observables."""
    return dict(zip(wanted.names, figures.tolist(), strict=False))


def test_momentum_and_energy_are_in_balance() -> None:
    all_balances = list(balances(4, 4))
    assert all(balance.holds for balance in all_balances), all_balances
    assert len({balance.seed for balance in all_balances}) >= 4


@pytest.mark.parametrize("wrong", range(3))
def test_a_planted_error_breaks_a_balance(wrong: int) -> None:
    run = trajectory(DEFAULT, 0.29, 1.6, periods=1, transient_periods=600, samples_per_period=1)
    wanted = observables(DEFAULT)
    figures = of_record(run.record, forced_oscillator(DEFAULT, 0.29, 1.6).structure.models, wanted, 1)
    power = power_of_forces(DEFAULT, 0.29, run, 1)
    assert max(missing(DEFAULT, 0.29, figures, power)) < TOLERANCE
    figures[wrong] *= 1.0 + 1e-8
    assert max(missing(DEFAULT, 0.29, figures, power)) > TOLERANCE


class Sampled:
    """Integrals and peaks of outputs of a motion of 50 digits, from Chebyshev series between its events."""

    def __init__(self, oracle: GeneralOracle, marks: list[float], outputs: list[Output]) -> None:
        """Follow the motion through increasing times, of which its events are some."""
        self.integral, self.square, self.peak = (np.zeros(len(outputs)) for _ in range(3))
        points = chebyshev.chebpts1(DEGREE + 1)
        for begin, end in itertools.pairwise(marks):
            values = []
            for point in points.tolist():
                oracle.run(until=begin + 0.5 * (1.0 + point) * (end - begin))
                x, v = oracle.state().floats()
                values.append([output.displacement @ x + output.velocity @ v for output in outputs])
            for r, samples in enumerate(np.array(values).T):
                self._add(r, chebyshev.chebfit(points, samples, DEGREE), 0.5 * (end - begin))

    def _add(self, r: int, series: Floats, scale: float) -> None:
        for total, integrand in ((self.integral, series), (self.square, chebyshev.chebmul(series, series))):
            anti = chebyshev.chebint(integrand)
            total[r] += scale * (chebyshev.chebval(1.0, anti) - chebyshev.chebval(-1.0, anti))
        roots = chebyshev.chebroots(chebyshev.chebder(series))
        inside = np.clip(roots[np.abs(roots.imag) < 1e-6].real, -1.0, 1.0)
        at = np.concatenate([[-1.0, 1.0], inside])
        self.peak[r] = max(self.peak[r], float(np.max(np.abs(chebyshev.chebval(at, series)))))


@pytest.mark.parametrize(("seed", "restitution"), the_first(2, [(3, None), (39, 0.3), (8, 0.0), (1, 0.3)]))
def test_values_agree_with_fifty_digits(seed: int, restitution: float | None) -> None:
    """From rest, over two forcing periods, with impacts, rests and complete chatter of general structures."""
    system = random_system(seed, restitution=restitution)
    oscillator, omega = system.oscillator, system.omega
    random, size = np.random.default_rng(seed), system.oscillator.size
    outputs = [Output(f"y{i}", *random.normal(size=(2, size))) for i in range(2)]
    wanted = Observables(OBSERVABLES, tuple(outputs))
    run = trajectory(oscillator, omega, system.clearance, periods=2, samples_per_period=1)
    figures = of_record(run.record, forced_oscillator(oscillator, omega, system.clearance).structure.models, wanted, 2)
    oracle = GeneralOracle.of(oscillator, omega, *system.clearance)
    period = 2.0 * math.pi / omega
    oracle.run(until=2.0 * period)
    events = [float(t) for times in (oracle.times, oracle.rests, oracle.releases) for t in times]
    marks = np.unique(np.concatenate([np.linspace(0.0, 2.0 * period, 2 * 12 + 1), events]))
    # the last bounces of a chatter are too small to matter
    marks = marks[np.concatenate([[True], np.diff(marks) > 1e-7 * period])]
    rest = oscillator.contact @ forced_oscillator(oscillator, omega, system.clearance).equilibrium
    about = Sampled(
        GeneralOracle.of(oscillator, omega, *system.clearance),
        marks.tolist(),
        [*outputs, Output("q", oscillator.contact, np.zeros(size))],
    )
    expected = np.stack([np.sqrt(about.square / (2.0 * period)), about.integral / (2.0 * period), about.peak], axis=1)
    got = figures[len(OBSERVABLES) :].reshape(-1, len(MEANS))
    np.testing.assert_allclose(got, expected[:2], rtol=0.0, atol=1e-10 * np.max(expected))
    values = named(wanted, figures)
    if rest == 0.0:
        assert values["rms_displacement"] == pytest.approx(expected[2, 0], rel=1e-10)
        assert values["peak_displacement"] == pytest.approx(expected[2, 2], rel=1e-10)
    with digits(50):
        mass, speeds = oscillator.effective_mass, [abs(float(v)) for v in oracle.speeds]
        lost = sum(
            0.5 * mass * (1.0 - oscillator.restitution_of(stop) ** 2) * v * v
            for stop, v in zip(oracle.stops, speeds, strict=True)
        )
    assert values["dissipated_power"] == pytest.approx(lost / (2.0 * period), rel=1e-10)
    assert values["peak_impact_speed"] == pytest.approx(max(speeds), rel=1e-10)


def test_the_impulse_of_a_rest_is_the_momentum_that_the_stop_takes() -> None:
    """By the balance of momentum along the jump over a part of a trajectory that begins and ends anywhere."""
    for seed, restitution in ((8, 0.0), (39, 0.3), (3, None)):
        system = random_system(seed, restitution=restitution)
        oscillator, omega, size = system.oscillator, system.omega, system.oscillator.size
        means = tuple(Output(f"x{i}", np.eye(size)[i], np.zeros(size)) for i in range(size))
        run = trajectory(oscillator, omega, system.clearance, periods=3, samples_per_period=1)
        wanted = Observables(("impulse_right", "impulse_left"), means)
        figures = of_record(
            run.record, forced_oscillator(oscillator, omega, system.clearance).structure.models, wanted, 3
        )
        period = 2.0 * math.pi / omega
        place = figures[2:].reshape(-1, len(MEANS))[:, 1]
        moved, pushed = run.displacement[:, -1] - run.displacement[:, 0], run.velocity[:, -1] - run.velocity[:, 0]
        inertia = oscillator.mass_matrix @ pushed + oscillator.damping_matrix @ moved
        force = inertia / (3.0 * period) + oscillator.stiffness_matrix @ place - oscillator.bias
        expected = oscillator.contact * (figures[1] - figures[0]) / period
        np.testing.assert_allclose(force, expected, rtol=0.0, atol=1e-12 * np.max(np.abs(inertia)))


def test_an_orbit_and_the_trajectory_along_it_have_the_same_values() -> None:
    run = trajectory(DEFAULT, 0.29, 1.6, periods=4, transient_periods=400, samples_per_period=1)
    orbit = periodic_orbit(DEFAULT, 0.29, 1.6, impacts_of(run))
    figures = OrbitObserver(DEFAULT, WANTED).figures(DEFAULT, 0.29, 1.6, orbit.impacts)
    recorded = of_record(run.record, forced_oscillator(DEFAULT, 0.29, 1.6).structure.models, WANTED, 4)
    np.testing.assert_allclose(figures, recorded, rtol=0.0, atol=1e-12)
    values = named(WANTED, figures)
    assert values["impact_rate"] == 4.0
    assert values["peak_displacement_right"] == pytest.approx(1.6, abs=1e-13)
    speeds = np.abs(orbit.impacts.whole.velocities)
    assert values["mean_impact_speed"] == pytest.approx(float(np.mean(speeds)), rel=1e-13)
    assert values["impulse"] == pytest.approx(1.8 * float(np.sum(speeds)), rel=1e-13)


def test_a_map_has_the_values_of_its_motions() -> None:
    """And its other arrays to the byte as without them."""
    omega, clearance = np.array([0.27, 0.2872]), np.array([1.35, 1.6, 1.85, 2.4])
    dense = dataclasses.replace(DEFAULT, restitution_left=0.6)
    for oscillator in (DEFAULT, dense):
        plain = unfolding_map_tile(Plane.of(oscillator, omega, clearance), MapSettings(max_periods=400))
        tile = unfolding_map_tile(Plane.of(oscillator, omega, clearance), MapSettings(max_periods=400), observed=WANTED)
        figures = tile.pop("figures")
        assert all(array.tobytes() == plain[name].tobytes() for name, array in tile.items())
        assert set(plain) == set(tile)
        unresolved = tile["kind"] == 0
        assert np.array_equal(np.isnan(figures[WANTED.names.index("impulse")]), unresolved)
        compared = 0
        for row, column in zip(*np.nonzero(tile["verified"]), strict=True):
            period, at = int(tile["period"][row, column]), (omega[column], clearance[row])
            run = trajectory(oscillator, *at, periods=period, transient_periods=3000, samples_per_period=1)
            if run.motion.period != period:
                continue
            expected = of_record(run.record, forced_oscillator(oscillator, *at).structure.models, WANTED, period)
            np.testing.assert_allclose(figures[:, row, column], expected, rtol=0.0, atol=1e-11)
            compared += 1
        assert compared >= 3


def test_motions_with_rests_are_followed_until_they_close() -> None:
    """Of two points of a map whose contact rests, the balances hold."""
    oscillator = dataclasses.replace(DEFAULT, restitution=0.2)
    omega, clearance = np.array([0.12, 0.2]), np.array([0.5, 1.0])
    wanted = observables(oscillator)
    tile = unfolding_map_tile(Plane.of(oscillator, omega, clearance), MapSettings(max_periods=400), observed=wanted)
    resting = tile["sticking"] & (tile["kind"] == 1)
    assert np.count_nonzero(resting) >= 2
    for row, column in zip(*np.nonzero(resting), strict=True):
        at, period = (float(omega[column]), float(clearance[row])), int(tile["period"][row, column])
        run = trajectory(oscillator, *at, periods=period, transient_periods=600 * period, samples_per_period=1)
        power = power_of_forces(oscillator, at[0], run, period)
        assert max(missing(oscillator, at[0], tile["figures"][:, row, column], power)) < TOLERANCE


def test_names_and_figures() -> None:
    with pytest.raises(ParameterError, match="observables"):
        Observables(("impulse", "peak_force"))
    assert WANTED.count == len(OBSERVABLES) + 2 * len(MEANS)
    assert set(NAMES) <= set(OBSERVABLES)
    quiet = trajectory(DEFAULT, 0.29, 5.0, periods=1, transient_periods=400, samples_per_period=1)
    figures = of_record(quiet.record, forced_oscillator(DEFAULT, 0.29, 5.0).structure.models, WANTED, 1)
    values = named(WANTED, figures)
    assert values["impact_rate"] == values["impulse"] == values["dissipated_power"] == 0.0
    assert math.isnan(values["peak_impact_speed"])
    assert math.isnan(values["mean_impact_speed"])
    assert values["peak_displacement"] == pytest.approx(math.sqrt(2.0) * values["rms_displacement"], rel=1e-12)


def test_resonant_modes_count_too() -> None:
    """Of a chain without damping at its lowest frequency: means are those of samples, between two impacts and over."""
    oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.0, [1.0, 0.0, 0.0], 0.8)
    omega = math.sqrt(eigvalsh(oscillator.stiffness_matrix, oscillator.mass_matrix)[0])
    forced = forced_oscillator(oscillator, omega, 1.6)
    run = trajectory(oscillator, omega, 1.6, periods=3, samples_per_period=1)
    assert run.record.forced.free.resonant_forcing.shape[1] > 0
    assert len(run.impacts.time) > 3
    figures = of_record(run.record, forced.structure.models, Observables((), OUTPUTS), 3).reshape(-1, len(MEANS))
    end = 6.0 * math.pi / omega
    marks = np.unique(np.concatenate([np.linspace(0.0, end, 61), run.impacts.time]))
    nodes, weights = np.polynomial.legendre.leggauss(16)
    times = (marks[:-1, None] + 0.5 * np.diff(marks)[:, None] * (1.0 + nodes)).ravel()
    shares = 0.5 * np.outer(np.diff(marks), weights).ravel() / end
    x, v = run.at(times)
    for row, output in zip(figures, OUTPUTS, strict=True):
        y = output.displacement @ x + output.velocity @ v
        assert row[0] == pytest.approx(math.sqrt(float(shares @ y**2)), rel=1e-11)
        assert row[1] == pytest.approx(float(shares @ y), abs=1e-11 * row[0])
        assert np.max(np.abs(y)) <= row[2] <= 1.01 * np.max(np.abs(y))

"""Sizes in the tolerances modules that no bound gives: `python tolerance_sizes.py SYSTEMS [SIZE ...]`.

They are measured on random systems. A grid on which something is looked for is compared with one eight times as fine,
and the chords of a curve with the curve in steps a sixteenth as long. A limit between two kinds of motion is compared
with motions whose kind a long run shows. The docstrings of the sizes say what this check has printed; it fails where
more is missed than they say.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import count, pairwise, product
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

from grazemap_core.contact.stops import Clearance, stops_between
from grazemap_core.continuation.bifurcation_curves import BifurcationCurve, bifurcation_curve
from grazemap_core.continuation.branches import orbit_branch
from grazemap_core.continuation.motion_curves import distances_from_line, followable
from grazemap_core.continuation.parameters import ParameterPoint
from grazemap_core.errors import CoreError
from grazemap_core.grazing import codimension_two
from grazemap_core.grazing.grazing_curve import VariedStop
from grazemap_core.grazing.kernels import root_isolation
from grazemap_core.maps.tolerances import BORDER_BRANCH_STEP, BORDER_REACH, BORDER_STEP
from grazemap_core.model.drive import force
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits import two_impact_orbits
from grazemap_core.orbits.family import OrbitFamily
from grazemap_core.orbits.kernels.admissibility import NO_FURTHER_CONTACT
from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
from grazemap_core.orbits.single_impact import special_orbits
from grazemap_core.orbits.single_impact.harmonics import Places
from grazemap_core.orbits.single_impact.special_orbits import ABSENT, StopGap, StopMotions
from grazemap_core.simulation.start import State
from grazemap_core.simulation.tolerances import GROWTH_BOUND, GROWTH_DRIFT
from tests.oracles.exponents import lyapunov_exponents
from tests.support import general_systems
from tests.support.random_systems import System, random_contact, random_forces, random_system

Floats = np.ndarray[Any, np.dtype[np.float64]]

FINER = 8
"""Parts into which a step of a grid is divided."""
SHORTER = 16
"""Parts into which a step along a curve is divided."""
GRAZE_PHASES, LAG_STEPS = special_orbits.GRAZE_PHASES, two_impact_orbits.LAG_STEPS
SAME = 1e-6
"""Difference of two phases, radians, up to which two orbits are one."""
FREQUENCIES = (1.0, 2.0)
"""Frequencies of each system, in units of that of `random_system`."""
MAP_STEPS = (3e-5, 3e-3)
"""Steps of maps, relative to the parameters: with longer ones BORDER_BRANCH_STEP is the longest step along a curve."""
POINTS = 256
"""Points of a map along either axis."""
FEWEST_ZEROS = 1e4
"""Zeros of a function that MAX_CELLS is said to be enough for."""
RANGE = (0.05, 2.5)
"""Frequencies between which zeros are isolated, in units of that of `random_system`."""
TRANSIENT, BOUNDED = 300, 500
"""Forcing periods before the growth is measured, and in which it has to be bounded."""
WINDOW, LONG = 1_000, 20_000
"""Forcing periods after that in which the growth is weighted, and by which a motion is judged."""
DECAY = 1.0
"""Weighted growth over LONG periods, in nats, above which a motion settles; that of a torus has vanished by then."""


class Measured(NamedTuple):
    """What was measured of a size: `missed` of the `cases` are overlooked, or called wrongly."""

    cases: int
    missed: int
    figure: str


def systems_of(seed: int) -> Iterator[System]:
    """Yield a random chain or other structure under one to three harmonics, between two stops, at some frequencies."""
    system, random = random_system(seed), np.random.default_rng([seed, 5])
    other = system.oscillator
    drive = list(other.drive)
    if seed % 3 == 2:
        drive.append(force(5, random.normal(size=other.size) / 5.0))
    right, left = other.restitution_of(1), other.restitution_of(-1)
    oscillator = Oscillator.of_structure(other.structure, other.contact, drive, right, other.bias, left)
    place = contact_equilibrium(oscillator)
    for share in FREQUENCIES:
        omega = share * system.omega
        reach = OrbitFamily.of(oscillator, 1, symmetric=False).at(omega).steady_size
        gaps = reach * random.uniform(0.2, 0.95, 2)
        yield System(oscillator, omega, (float(gaps[0]) + place, float(gaps[1]) - place))


def motions_of(system: System) -> Iterator[StopMotions]:
    """Yield the motions with one impact in one or two periods whose further contacts are looked for on a grid.

    The other stop is absent, at the same clearance, or fixed.
    """
    oscillator = system.oscillator
    assert isinstance(system.clearance, tuple)
    for multiple in (1, 2):
        forced = OrbitFamily.of(oscillator, multiple, symmetric=False).at(system.omega)
        for stop, fixed in zip((1, -1), reversed(system.clearance), strict=True):
            offset = stop * contact_equilibrium(oscillator)
            assert fixed is not None
            for other in (ABSENT, StopGap(2.0 * offset, 1.0), StopGap(fixed + offset)):
                motions = StopMotions([forced], stop, other)
                if not motions.has_one_interval:
                    yield motions


def admissible_intervals(here: StopMotions) -> list[float]:
    """Return the widths of the intervals of admissible phases that end at a graze, in steps of the grid."""
    phases, widths = [orbit.phase for orbit in here.special("GR")], []
    starts, ends, _ = here.phases_of_impacts
    for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
        inside = sorted(phase for phase in phases if start < phase < end)
        step = (end - start) / (GRAZE_PHASES * len(here.orbits.toward.orders))
        for low, high in pairwise([start, *inside, end] if inside else []):
            if here.contacts(Places.of(0.5 * (low + high))).status[0] == NO_FURTHER_CONTACT:
                widths.append((high - low) / step)
    return widths


def graze_phases(systems: int) -> Measured:
    """Compare the intervals of admissible phases on the grid with those on a finer one."""
    widths: list[float] = []
    missed = 0
    for seed in range(systems):
        for here in (motions for system in systems_of(seed) for motions in motions_of(system)):
            coarse = admissible_intervals(here)
            with mock.patch.object(special_orbits, "GRAZE_PHASES", FINER * GRAZE_PHASES):
                fine = admissible_intervals(here)
            missed += max(len(fine) - len(coarse), 0)
            widths += fine
    narrow = np.sort(widths)
    figure = f"the narrowest intervals of phases have {narrow[0]:.2g}, {narrow[1]:.2g} and {narrow[2]:.2g} steps"
    return Measured(len(widths), missed, figure)


def two_impact_orbits_of(system: System, multiple: int) -> list[PeriodicOrbit]:
    """Return the orbits with one impact on each stop in so many periods, each once."""
    oscillator, omega, clearance = system
    forced = OrbitFamily.of(oscillator, multiple, symmetric=False).at(omega)
    stops = stops_between(oscillator, clearance, forced.steady_size)
    orbits: list[PeriodicOrbit] = []
    for guess in two_impact_orbits.two_impact_sequences(forced, stops, 1):
        orbit = periodic_orbit(oscillator, omega, clearance, guess)
        if orbit.converged and orbit.physical and not is_among(orbit, orbits):
            orbits.append(orbit)
    return orbits


def is_among(orbit: PeriodicOrbit, others: list[PeriodicOrbit]) -> bool:
    """Return whether one of the others has impacts at the same phases."""
    return any(
        abs(math.remainder(orbit.impacts.phases[0] - other.impacts.phases[0], 2.0 * math.pi)) <= SAME
        and abs(lag_of(orbit) - lag_of(other)) <= SAME
        for other in others
    )


def lag_of(orbit: PeriodicOrbit) -> float:
    """Return the phase from the impact on the right stop to that on the left one."""
    return float(orbit.impacts.phases[1] - orbit.impacts.phases[0])


def phases_end(orbit: PeriodicOrbit, system: System) -> bool:
    """Return whether the phases at the two lags of the grid about an orbit's differ in number."""
    forced = OrbitFamily.of(system.oscillator, orbit.impacts.period, symmetric=False).at(system.omega)
    lags = two_impact_orbits._Lags(forced, stops_between(system.oscillator, system.clearance, forced.steady_size), 1)
    step = 2.0 * math.pi / LAG_STEPS
    low = math.floor(lag_of(orbit) / step) * step
    return len(lags.mismatches([low])[1]) != len(lags.mismatches([low + step])[1])


def lag_steps(systems: int) -> Measured:
    """Compare the orbits with two impacts on the grid of lags with those on a finer one."""
    orbits, missed, close, at_ends = [], [], 0, 0
    for seed in range(systems):
        for system, multiple in product(systems_of(seed), (1, 2)):
            coarse = two_impact_orbits_of(system, multiple)
            with mock.patch.object(two_impact_orbits, "LAG_STEPS", FINER * LAG_STEPS):
                fine = two_impact_orbits_of(system, multiple)
            orbits += fine
            for orbit in fine:
                if not is_among(orbit, coarse):
                    missed.append(orbit)
                    at_ends += phases_end(orbit, system)
                    lags = [abs(lag_of(other) - lag_of(orbit)) for other in fine if other is not orbit]
                    close += min(lags, default=math.inf) < 2.0 * math.pi / LAG_STEPS
    every, lost = (sum(orbit.admissible for orbit in some) for some in (orbits, missed))
    figure = (
        f"{lost} of {every} admissible orbits; of the missed, {close} have lags within a step of another orbit's, and "
        f"at {at_ends} the phases end within a step"
    )
    return Measured(len(orbits), len(missed), figure)


def distances_of_chords(seed: int) -> Floats | None:
    """Return the distances of a random curve from its chords, in steps of a map; None where there is no curve."""
    system = general_systems.random_system(seed)
    if system is None:
        return None
    oscillator, omega, clearance = system.oscillator, system.omega, system.clearance
    orbit = periodic_orbit(oscillator, omega, clearance, system.impacts)
    values = ParameterPoint.of(oscillator, omega, clearance)
    name = "clearance_right" if math.isfinite(values.clearance_right) else "clearance_left"
    here = values.value(name)
    if not (orbit.converged and here > 0.0):
        return None
    branch = orbit_branch(oscillator, orbit, 0.7 * here, 1.3 * here, name, to_special=True)
    points = [point for point in (followable(oscillator, point) for point in branch.special_points) if point]
    if not points:
        return None
    least, most = np.log(MAP_STEPS)
    step = math.exp(np.random.default_rng([seed, 3]).uniform(least, most))
    assert BORDER_STEP * step < BORDER_BRANCH_STEP
    point = points[0]
    center = np.array([point.omega, point.values.value(name)])
    reach = 0.5 * POINTS * step * np.abs(center)

    def places(longest: float, orbits: int) -> tuple[BifurcationCurve, Floats]:
        sides = [(float(middle - far), float(middle + far)) for middle, far in zip(center, reach, strict=True)]
        curve = bifurcation_curve(oscillator, point, sides[0], sides[1], longest, orbits, ("omega", name))
        return curve, np.column_stack([curve.horizontal, curve.vertical]) / (step * np.abs(center))

    _, chords = places(BORDER_STEP * step, 500)
    _, curve = places(BORDER_STEP * step / SHORTER, 500 * SHORTER)
    return distances_from_line(curve, chords)


def border_step(systems: int) -> Measured:
    """Compare curves in the steps of borders of maps with those in shorter ones."""
    distances: list[Floats] = []
    for seed in count():
        if len(distances) == systems:
            break
        try:
            here = distances_of_chords(seed)
        except CoreError as error:
            print(f"curve of seed {seed}: {error}", flush=True)
            continue
        if here is not None:
            distances.append(here)
    largest = np.array([np.max(here) for here in distances])
    every, allowed = np.concatenate(distances), BORDER_REACH - 0.5
    figure = (
        f"distances of a curve from its chords in steps of a map: median {np.median(every):.2g}, of the farthest point "
        f"{np.median(largest):.2g} in the median of the curves and {np.max(largest):.2g} at most; above {allowed:.2g} "
        f"at {100.0 * np.mean(every > allowed):.2g} % of all points"
    )
    return Measured(systems, int(np.sum(largest > allowed)), figure)


def lightly_damped(seed: int) -> System:
    """Return a chain, a dense or a gyroscopic structure of two to four masses, with little damping."""
    random = np.random.default_rng([seed, 9])
    size = 2 + seed % 3
    gamma = float(10.0 ** random.uniform(-2.5, -1.0))
    if seed // 3 % 2 == 0:
        masses, stiffnesses = 10.0 ** random.uniform(-0.5, 0.5, (2, size))
        structure = Oscillator.create(masses, stiffnesses, gamma, np.ones(size), 1.0).structure
    else:
        mass, stiffness = (general_systems.positive(random, size) for _ in range(2))
        turn = random.normal(size=(size, size)) if seed // 6 % 2 == 0 else np.zeros((size, size))
        structure = Matrices.create(mass, stiffness, 2.0 * gamma * stiffness + turn - turn.T)
    row, drive = random_contact(random, size), random_forces(random, size)
    oscillator = Oscillator.of_structure(structure, row, drive, float(random.uniform(0.5, 0.95)))
    lowest = np.min(np.linalg.eigvals(np.linalg.solve(structure.mass_matrix, structure.stiffness_matrix)).real)
    omega = float(random.uniform(0.3, 2.5) * np.sqrt(lowest))
    reach = OrbitFamily.of(oscillator, 1, symmetric=False).at(omega).steady_size
    right, left = (float(gap) for gap in reach * random.uniform(0.1, 0.95, 2))
    clearances: list[Clearance] = [right, (right, None), (right, left)]
    return System(oscillator, omega, clearances[int(random.integers(3))])


def growth_of(system: System, state: State | None, periods: int) -> tuple[float, bool, State]:
    """Return the weighted growth over so many periods, in nats, whether the growth is bounded, and the state after."""
    start = () if state is None else (state.displacement, state.velocity, state.phase)
    run = lyapunov_exponents(*system, *start, periods=periods, transient_periods=TRANSIENT)
    period = 2.0 * math.pi / system.omega
    total = np.concatenate([[0.0], run.running * period * np.arange(1, periods + 1)])
    parts = np.array_split(total, 8)
    bounded = np.all(np.isfinite(total)) and np.ptp(total) <= GROWTH_BOUND * min(np.ptp(part) for part in parts)
    return abs(run.first_weighted) * periods * period, bool(bounded), run.final


def growth_drift(systems: int) -> Measured:
    """Compare the weighted growth of motions with bounded growth with that over a long run."""
    tori: list[float] = []
    others: list[float] = []
    for seed in count():
        if len(tori) + len(others) == systems:
            break
        system = lightly_damped(seed)
        _, bounded, state = growth_of(system, None, BOUNDED)
        if bounded:
            growth, long = (growth_of(system, state, periods)[0] for periods in (WINDOW, LONG))
            (others if long > DECAY else tori).append(growth)
    slow, fast = (sum(growth <= GROWTH_DRIFT for growth in growths) for growths in (others, tori))
    figure = (
        f"{slow} of {len(others)} motions that settle called tori, {len(tori) - fast} of {len(tori)} tori not; the "
        f"growth of tori up to {max(tori):.2g} nats, that of the others from {min(others, default=math.inf):.2g}"
    )
    return Measured(systems, slow + len(tori) - fast, figure)


def max_cells(systems: int) -> Measured:
    """Count the cells that are searched for each zero of an impulse response or a periodic sum."""
    zero_in_cell, isolate = root_isolation._zero_in_cell, root_isolation.isolate
    calls = 0
    searches: list[tuple[int, int]] = []

    def counted(*arguments: Any) -> Any:
        nonlocal calls
        calls += 1
        return zero_in_cell(*arguments)

    def isolated(*arguments: Any) -> Any:
        nonlocal calls
        calls = 0
        answer = isolate.py_func(*arguments)
        searches.append((calls, len(answer[0])))
        return answer

    with (
        mock.patch.object(root_isolation, "_zero_in_cell", counted),
        mock.patch.object(codimension_two, "isolate", isolated),
    ):
        for seed in range(systems):
            oscillator, omega, _ = random_system(seed)
            one_harmonic = replace(oscillator, drive=oscillator.drive[:1])
            start, stop = (share * omega for share in RANGE)
            codimension_two.codimension_two_points(one_harmonic, start, stop, varied=VariedStop(1))
    cells, zeros = np.array(searches).T
    each = cells[zeros > 0] / zeros[zeros > 0]
    figure = (
        f"cells for each zero: {np.median(each):.2g} in the median, {np.max(each):.2g} at most; "
        f"at most {np.max(cells)} cells of a function"
    )
    missed = int(np.sum(FEWEST_ZEROS * each > root_isolation.MAX_CELLS))
    return Measured(len(each), missed, figure)


CHECKS: dict[str, tuple[Callable[[int], Measured], float]] = {
    "GRAZE_PHASES": (graze_phases, 3 / 416),
    "LAG_STEPS": (lag_steps, 7 / 359),
    "BORDER_STEP": (border_step, 7 / 50),
    "GROWTH_DRIFT": (growth_drift, 4 / 50),
    "MAX_CELLS": (max_cells, 0.0),
}
"""What measures each size, and the share of misses in fifty systems that its docstring states."""


def main(systems: int, names: list[str]) -> int:
    """Print a line for each size; return how many miss more than their docstrings say."""
    failed = 0
    for name in names or CHECKS:
        check, most = CHECKS[name]
        measured = check(systems)
        failed += measured.missed / measured.cases > most
        print(
            f"{name}: {measured.missed} of {measured.cases} missed in {systems} systems; {measured.figure}", flush=True
        )
    return failed


if __name__ == "__main__":
    sys.exit(1 if main(int(sys.argv[1]), sys.argv[2:]) else 0)

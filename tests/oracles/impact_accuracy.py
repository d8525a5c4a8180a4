"""First impact times at random points against 48-digit arithmetic, in units of what an input error amounts to there.

The yardstick of an impact time is its condition: what the multi-precision simulation itself answers to a relative
change of 1e-25 of every input by itself (each mass, stiffness, damping and force, the restitution, the forcing
frequency, the clearance), in sum. An arithmetic that errs by 1e-15 of that is as good as one without rounding, given
inputs that carry some four roundings each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from flint import arb

from benchmarks.ensemble import Ensemble, first_impacts
from grazemap_core.contact.kernels.runs import IMPACT
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.trajectories import trajectory
from tests.oracles.fifty_digits import digits, tridiagonal
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.steady_displacements import contact_amplitude, forced_response

CHANGE = 1e-25
_OF_CHAIN = ("masses", "stiffnesses", "forcing")
IMPACTS = 20
LOCKSTEP_PERIODS = 12
STEP = 1e-8
"""Relative change of the inputs of a calculation with 16 digits."""


@dataclass(frozen=True)
class Accuracy:
    """What became of one point; arrays over the impacts compared, before any complete chatter.

    `error` is of the time, in absolute value; `amplification` the change of the exact time over the relative change of
    the inputs; `complete` whether the core has every impact up to the last one compared, and none besides.
    """

    error: np.ndarray
    amplification: np.ndarray
    complete: bool

    @property
    def worst(self) -> float:
        """Largest error over amplification, 0 without impacts."""
        return float(np.max(self.error / self.amplification, initial=0.0))


def random_point(seed: int) -> tuple[Oscillator, float, float]:
    """A chain of 1 to 5 masses with either kind of damping, a forcing frequency, and a clearance within reach."""
    rng = np.random.default_rng(seed)
    count = 1 + seed % 5
    damping = float(rng.uniform(0.01, 0.3)) if (seed // 5) % 2 else rng.uniform(0.01, 0.4, count)
    forcing = rng.uniform(-1, 1, count)
    oscillator = Oscillator.create(
        rng.uniform(0.5, 3, count), rng.uniform(0.5, 3, count), damping, forcing, float(rng.uniform(0.3, 1.0))
    )
    omega = float(rng.uniform(0.2, 1.5))
    amplitude = contact_amplitude(oscillator, omega)
    return oscillator, omega, float(rng.uniform(0.3, 0.95) * amplitude)


def changed_inputs(oscillator: Oscillator, omega: float, clearance: float) -> Iterator[GeneralOracle]:
    """The simulation with one input after the other changed by its CHANGE."""
    with digits():
        inputs = {name: [arb(v) for v in getattr(oscillator, name).tolist()] for name in _OF_CHAIN}
        # one number gives the damping of all links, or each has its own
        inputs["damping"] = [arb(v) for v in ([oscillator.gamma] if oscillator.gamma else oscillator.link_damping)]
        inputs["others"] = [arb(v) for v in (oscillator.restitution, omega, clearance)]
        for name, values in inputs.items():
            for i, value in enumerate(values):
                if value != 0:
                    changed = [value * (1 + arb(CHANGE)) if k == i else v for k, v in enumerate(values)]
                    yield _of_numbers(oscillator.gamma is not None, **inputs | {name: changed})


def _of_numbers(
    proportional: bool,
    masses: list[arb],
    stiffnesses: list[arb],
    forcing: list[arb],
    damping: list[arb],
    others: list[arb],
) -> GeneralOracle:
    """The simulation of a chain of these numbers, the damping 2 gamma K if it is proportional."""
    restitution, omega, clearance = others
    links = [2 * damping[0] * k for k in stiffnesses] if proportional else damping
    mass = [[m if i == j else arb(0) for j in range(len(masses))] for i, m in enumerate(masses)]
    contact = [int(i == 0) for i in range(len(masses))]
    both = (restitution, restitution), (clearance, clearance)
    return GeneralOracle(mass, tridiagonal(links), tridiagonal(stiffnesses), contact, [(1, forcing)], *both, omega)


def exact_amplification(oscillator: Oscillator, omega: float, clearance: float, exact: GeneralOracle) -> np.ndarray:
    """The expected rounding error of every impact of a simulation, in 48 digits."""
    amplification = np.zeros(len(exact.times))
    for run in changed_inputs(oscillator, omega, clearance):
        run.run(len(exact.times))
        with digits():
            amplification += [abs(float(a - b)) / CHANGE for a, b in zip(run.times, exact.times, strict=True)]
    return amplification


def compare(oscillator: Oscillator, omega: float, clearance: float, impacts: int = IMPACTS) -> Accuracy:
    """Compare the first impacts of a trajectory from rest, at most `impacts` and all before a complete chatter."""
    record = trajectory(oscillator, omega, clearance, periods=40, samples_per_period=1).impacts
    chatter = np.flatnonzero(record.kind == "chatter")
    count = min([impacts, len(record.time), *(int(i) + 1 for i in chatter[:1])])
    exact = GeneralOracle.between(oscillator, omega, clearance)
    exact.run(count)
    amplification = exact_amplification(oscillator, omega, clearance, exact)
    with digits():
        period = 2 * arb.pi() / arb(omega)
        error = np.array(
            [
                abs(float(int(record.period[k]) * period + arb(record.phase_time[k]) - exact.times[k]))
                for k in range(count)
            ]
        )
    # a missed or invented impact shifts the list, by much more than this
    complete = count >= 4 and np.array_equal(record.stop[:count], exact.stops) and bool(np.all(error < 1e-6 / omega))
    return Accuracy(error, amplification, complete)


def plane_points(oscillator: Oscillator, frequencies: int, clearances: int) -> list[tuple[float, np.ndarray]]:
    """Random frequencies, with random clearances of each from 0.3 to 1.2 of the amplitude of the steady motion."""
    rng = np.random.default_rng(2)
    omegas = rng.uniform(0.2, 1.5, size=frequencies)
    amplitudes = abs(forced_response(oscillator, omegas)[:, 0])
    return [(float(w), a * rng.uniform(0.3, 1.2, size=clearances)) for w, a in zip(omegas, amplitudes, strict=True)]


def compare_lockstep(
    oscillator: Oscillator,
    omega: float,
    clearances: np.ndarray,
    amplification: np.ndarray | None = None,
    ensemble: Ensemble | None = None,
) -> list[Accuracy]:
    """Compare the first impacts from rest of many clearances in lockstep, of each those before a complete chatter.

    `amplification` (n, IMPACTS) is the yardstick of every impact; None: it is measured in 48 digits, which takes ten
    times as long as the comparison. `ensemble` are the impacts; None: they are computed here.
    """
    if ensemble is None:
        ensemble = first_impacts(oscillator, omega, clearances, LOCKSTEP_PERIODS, IMPACTS)
    assert ensemble.whole.all()
    results = []
    for lane, clearance in enumerate(clearances.tolist()):
        listed = int(np.count_nonzero(ensemble.half[lane] >= 0))
        count = int(np.argmax(np.append(ensemble.kind[lane, :listed] != IMPACT, True)))
        ends = count < listed  # the next one is the last of a complete chatter that is listed
        exact = GeneralOracle.between(oscillator, omega, clearance)
        with digits():
            half_period = arb.pi() / arb(omega)
        end = 2 * LOCKSTEP_PERIODS * float(half_period)
        exact.run(count if ends or count == IMPACTS else count + 1, end)
        exact.times = [t for t in exact.times if t < end]
        there = len(exact.times) == count
        error = np.zeros(min(count, len(exact.times)))
        with digits():
            for k, t in enumerate(exact.times[:count]):
                error[k] = abs(float(int(ensemble.half[lane, k]) * half_period + arb(ensemble.time[lane, k]) - t))
        # a missed or invented impact shifts the list, by much more than this
        there = (
            there and np.array_equal(ensemble.stop[lane, :count], exact.stops) and bool(np.all(error < 1e-6 / omega))
        )
        if not there:
            size = np.full(len(error), np.nan)
        elif amplification is None:
            size = exact_amplification(oscillator, omega, clearance, exact)
        else:
            size = amplification[lane, :count]
        results.append(Accuracy(error, size, there))
    return results


def lockstep_amplification(oscillator: Oscillator, omega: float, clearances: np.ndarray) -> np.ndarray:
    """The same by differences of the lockstep kernel's own times, accurate to about 1e-4; shape (n, IMPACTS).

    NaN behind an impact that a changed input makes one of another kind or half period.
    """
    gamma = oscillator.gamma
    assert gamma is not None
    inputs = [oscillator.masses, oscillator.stiffnesses, np.array([gamma]), oscillator.forcing]
    inputs += [np.array([value]) for value in (oscillator.restitution, omega)]

    def times(parts: list[np.ndarray], scale: float = 1.0) -> np.ndarray:
        masses, stiffnesses, damping, forcing, restitution, frequency = parts
        chain = Oscillator.create(masses, stiffnesses, float(damping[0]), forcing, float(restitution[0]))
        w = float(frequency[0])
        ensemble = first_impacts(chain, w, scale * clearances, LOCKSTEP_PERIODS, IMPACTS)
        return np.where(ensemble.kind == IMPACT, ensemble.half * (np.pi / w) + ensemble.time, np.nan)

    plain = times(inputs)
    total = abs(times(inputs, 1.0 + STEP) - plain)
    for part, values in enumerate(inputs):
        for i in np.flatnonzero(values):
            changed = [v.copy() for v in inputs]
            changed[part][i] *= 1.0 + STEP
            total += abs(times(changed) - plain)
    return total / STEP

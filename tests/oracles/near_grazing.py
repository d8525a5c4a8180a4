"""Near-grazing first impacts: the steady motion of the contact passes a stop by a small fraction of its amplitude."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import acb, arb

from grazemap_core.contact.forced import forced_structures
from grazemap_core.contact.kernels.runs import EVENT_COUNT, HALF, OK, TIME, UNDECIDED, new_run
from grazemap_core.contact.stops import Clearance, stops_of
from grazemap_core.contact.trajectory_models import trajectory_models
from grazemap_core.grazing.grazing_curve import steady_motion
from grazemap_core.model.equilibrium import contact_equilibrium
from grazemap_core.model.harmonic_response import reference_response
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.simulation.kernels.period_detection import record_half_period, stroboscopic_history
from grazemap_core.simulation.kernels.recorded_run import run_recorded
from tests.oracles.fifty_digits import digits

Floats = np.ndarray[Any, np.dtype[np.float64]]

OVERSHOOTS = (1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-13)
"""Of the amplitude of the steady motion, beyond the stop."""
ROUNDINGS = 8.0 * 2.0**-52
"""Of the steady motion, in units of the sum of its harmonics and the equilibrium."""
SECOND = 0.95
"""Height of another maximum, in units of the highest one, up to which this is the only one that passes the stop."""
FAR = 1.2
"""Gap of the stop that is not meant, in units of the amplitude toward it."""


class Passage(NamedTuple):
    """The steady motion of an oscillator at one frequency, where it comes nearest to a stop.

    `harmonics` are the orders and the amplitudes toward the stop from the equilibrium, `peak` the phase and `height`
    the contact coordinate there, `bend` minus its second derivative along the phase.
    """

    oscillator: Oscillator
    omega: float
    stop: int
    harmonics: list[tuple[int, complex]]
    peak: arb
    height: arb
    bend: arb

    @property
    def start(self) -> float:
        """A phase a quarter of the fastest harmonic's period before the peak."""
        return float(self.peak) - 0.5 * math.pi / max(order for order, _ in self.harmonics)

    @property
    def size(self) -> float:
        """The sum of the terms of the contact coordinate."""
        return sum(abs(x) for _, x in self.harmonics) + abs(contact_equilibrium(self.oscillator))

    def clearance(self, overshoot: float, *, other: bool) -> Clearance:
        """Return clearances so that the motion would pass the stop by a share of its height; the other stop is far."""
        place, theta = self.stop * contact_equilibrium(self.oscillator), np.linspace(-np.pi, np.pi, 721)
        back = -sum((x * np.exp(1j * order * theta)).imag for order, x in self.harmonics).min()
        with digits(40):
            near = float(self.height * (1 - arb(overshoot))) + place
        away = FAR * back - place if other else None
        return (near, away) if self.stop > 0 else (away, near)

    def crossing(self, clearance: Clearance) -> tuple[float, float]:
        """Return the phase from the start at which the motion reaches the stop, and its rate along the phase there."""
        with digits(40):
            near = clearance[0 if self.stop > 0 else 1] if isinstance(clearance, tuple) else clearance
            assert near is not None
            gap = arb(near) - self.stop * arb(contact_equilibrium(self.oscillator))
            phase = self.peak - (2 * (self.height - gap) / self.bend).sqrt()
            for _ in range(20):
                value, rate, _ = _at(self.harmonics, phase)
                step = ((value - gap) / rate).mid()
                phase = (phase - step).mid()
                if abs(float(step)) < 1e-25:
                    return float(phase - arb(self.start)), float(rate)
        raise AssertionError("the exact crossing was not found")


def _at(harmonics: list[tuple[int, complex]], phase: arb) -> tuple[arb, arb, arb]:
    """Return a sum of harmonics at a phase, and two derivatives."""
    turned = [(order, acb(x.real, x.imag) * acb(0, order * phase).exp()) for order, x in harmonics]
    parts = [(x.imag, order * x.real, -order * order * x.imag) for order, x in turned]
    value, rate, bend = (sum(part, arb(0)).mid() for part in zip(*parts, strict=True))
    return value, rate, bend


models_of = lru_cache(8)(trajectory_models)


def passage(oscillator: Oscillator, omega: float, stop: int) -> Passage | None:
    """Return where the steady motion comes nearest to a stop, or None where another maximum is almost as near."""
    steady = reference_response(oscillator, models_of(oscillator).free, np.array([omega]))[0]
    orders = [force.order for force in oscillator.forces]
    harmonics = [(order, complex(stop * x)) for order, x in zip(orders, steady[:, 0, -1], strict=True)]
    theta = np.linspace(-np.pi, np.pi, 720 * max(orders), endpoint=False)
    q = sum((x * np.exp(1j * order * theta)).imag for order, x in harmonics)
    heights = np.sort(q[(q >= np.roll(q, 1)) & (q > np.roll(q, -1))])
    if len(heights) > 1 and heights[-2] > SECOND * heights[-1]:
        return None
    peak = float(steady_motion(oscillator, np.array([omega])).toward(stop).phase[0])
    with digits(40):
        place = arb(peak)
        for _ in range(20):
            _, rate, bend = _at(harmonics, place)
            place = (place - rate / bend).mid()
        height, _, bend = _at(harmonics, place)
        return Passage(oscillator, omega, stop, harmonics, place, height, -bend)


def first_impacts(oscillator: Oscillator, omega: float, start: float, clearances: list[Clearance]) -> Floats:
    """Return the phase from the start of the first impact within a period on the steady motion, NaN without one, (n,).

    No contact may be undecided.
    """
    (structure,) = forced_structures(models_of(oscillator), np.array([omega]))
    forced = structure.at_phase(start)
    begin = structure.free_state(*np.split(structure.reference_state(start), 2), start)
    run, phases = new_run(oscillator.size, len(structure.orders), events=64), np.full(len(clearances), np.nan)
    began, history = new_run(oscillator.size, len(structure.orders)), stroboscopic_history(oscillator.size, 1)
    for k, clearance in enumerate(clearances):
        run.u[:] = begin
        run.cursor[:] = 0
        run.tally[UNDECIDED] = 0.0
        record_half_period(history, 0, run)
        stops = stops_of(oscillator, clearance, structure.cells, forced.free.steady_bound)
        assert run_recorded(forced, stops, run, began, 0, 2, history) == (OK, 2)
        assert run.tally[UNDECIDED] == 0.0
        if run.cursor[EVENT_COUNT] > 0:
            phases[k] = math.pi * run.events[0, HALF] + omega * run.events[0, TIME]
    return phases


class Outcome(NamedTuple):
    """Numbers of impacts that are there, of those missed, and of those found that are not there.

    `error` is the largest error of a phase in units of what `ROUNDINGS` of the steady motion amount to.
    """

    there: int
    missed: int
    false: int
    error: float


def outcome_of(approach: Passage, *, other: bool) -> Outcome:
    """Compare first impacts just beyond a stop, and just not, with the exact crossing."""
    beyond = [approach.clearance(overshoot, other=other) for overshoot in OVERSHOOTS]
    inside = [approach.clearance(-overshoot, other=other) for overshoot in OVERSHOOTS]
    phases = first_impacts(approach.oscillator, approach.omega, approach.start, [*beyond, *inside])
    errors = []
    for clearance, phase in zip(beyond, phases[: len(beyond)], strict=True):
        exact, rate = approach.crossing(clearance)
        errors.append(abs(phase - exact) / (ROUNDINGS * (approach.size / rate + 2.0 * np.pi)))
    missed = int(np.count_nonzero(~(np.array(errors) < np.inf)))
    false = int(np.count_nonzero(np.isfinite(phases[len(beyond) :])))
    return Outcome(len(beyond), missed, false, float(np.max(errors)))

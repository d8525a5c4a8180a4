"""heyoka's batch integrator among the contestants: Taylor's method, one trajectory per SIMD lane.

It is given its best: compiled without compact mode; the equations in their sparse form; the forcing as an oscillator
of its own, which its series likes better than a sine of time; both stops as linear terminal events with a direction;
a callback of one multiplication on a view of the state; and the batch size that was faster when both the machine's
recommended one and twice that were tried.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.work import Floats, Integers, Start, Work, reference_work
from grazemap_core.model.oscillator import Oscillator


class Heyoka:
    """taylor_adaptive_batch at one tolerance; None is heyoka's own, the rounding of double precision."""

    def __init__(self, tolerance: float | None = None, batch: int | None = None) -> None:
        import heyoka

        self.tolerance = tolerance
        self.batch: int = batch or heyoka.recommended_simd_size()

    @property
    def name(self) -> str:
        """Return the tool with its batch size and tolerance."""
        tolerance = "" if self.tolerance is None else f", tol {self.tolerance:g}"
        return f"heyoka batch of {self.batch}{tolerance}"

    def prepare(self, work: Work) -> Callable[[], object]:
        """Return what is to be timed."""
        flow = _ImpactFlow(self, work.oscillator, work.omega)
        return lambda: flow.run(work)

    def impacts(self, work: Work) -> Integers:
        """Return the impacts of every lane."""
        flow = _ImpactFlow(self, work.oscillator, work.omega, recorded=True)
        flow.run(work)
        return np.array([len(times) for times in flow.times[: len(work.clearances)]])

    def impact_times(self, work: Work, count: int) -> Floats:
        """Return the first impact times of lane 0."""
        flow = _ImpactFlow(self, work.oscillator, work.omega, recorded=True)
        flow.run(Work(work.oscillator, work.omega, work.clearances[:1], work.periods))
        return np.array(flow.times[0][:count])

    def first_contacts(self, oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
        """Return the time of the first contact within one forcing period, NaN for none."""
        flow = _ContactSearch.of(self, oscillator)
        return flow.run(start, clearances)


def fastest_batch(periods: int = 20) -> int:
    """Try the machine's recommended batch size and twice that. Returns the faster."""
    import heyoka

    smaller: int = heyoka.recommended_simd_size()
    work = reference_work(4 * smaller, periods)
    seconds = {}
    for batch in (smaller, 2 * smaller):
        run = Heyoka(batch=batch).prepare(work)
        run()
        took = []
        for _ in range(5):
            began = time.process_time()
            run()
            took.append(time.process_time() - began)
        seconds[batch] = min(took)
    return min(seconds, key=lambda batch: seconds[batch])


def _equations(oscillator: Oscillator, omega: Any) -> tuple[list[Any], Any, int]:
    """Return the equations of motion, x1 and the index of v1; the last two variables are sine and cosine."""
    import heyoka as hy

    size = oscillator.size
    x = [hy.make_vars(f"x{i}") for i in range(size)]
    v = [hy.make_vars(f"v{i}") for i in range(size)]
    sine, cosine = hy.make_vars("s", "c")
    stiffness = oscillator.stiffness_matrix / oscillator.masses[:, None]
    damping = oscillator.damping_matrix / oscillator.masses[:, None]
    force = oscillator.forcing / oscillator.masses
    equations = [(x[i], v[i]) for i in range(size)]
    for i in range(size):
        terms = [-float(stiffness[i, j]) * x[j] for j in range(size) if stiffness[i, j] != 0.0]
        terms += [-float(damping[i, j]) * v[j] for j in range(size) if damping[i, j] != 0.0]
        if force[i] != 0.0:
            terms.append(float(force[i]) * sine)
        equations.append((v[i], hy.sum(terms)))
    equations += [(sine, omega * cosine), (cosine, -omega * sine)]
    return equations, x[0], size


class _ImpactFlow:
    """Trajectories from rest through all their impacts, a batch at a time; compiled when it is made."""

    def __init__(self, settings: Heyoka, oscillator: Oscillator, omega: float, recorded: bool = False) -> None:
        import heyoka as hy

        self.batch = settings.batch
        self.times: list[list[float]] = []
        self._first_lane = 0
        equations, x1, index = _equations(oscillator, omega)
        restitution = oscillator.restitution
        views: list[Any] = []

        def rebound(_integrator: Any, _sign: int, lane: int) -> bool:
            views[0][lane] *= -restitution
            return True

        def recorded_rebound(integrator: Any, _sign: int, lane: int) -> bool:
            self.times[self._first_lane + lane].append(float(integrator.time[lane]))
            views[0][lane] *= -restitution
            return True

        callback = recorded_rebound if recorded else rebound
        distances = (hy.par[0] - x1, hy.par[0] + x1)
        falling = hy.event_direction.negative
        self._rest = np.zeros((len(equations), self.batch))
        self._rest[-1] = 1.0
        self._integrator = hy.taylor_adaptive_batch(
            equations,
            self._rest.copy(),
            pars=np.ones((1, self.batch)),
            t_events=[hy.t_event_batch(distance, callback=callback, direction=falling) for distance in distances],
            compact_mode=False,
            **({} if settings.tolerance is None else {"tol": settings.tolerance}),
        )
        views.append(memoryview(self._integrator.state[index]))

    def run(self, work: Work) -> None:
        """Run all lanes; the last batch is filled up with its last lane."""
        end = np.full(self.batch, work.periods * 2.0 * math.pi / work.omega)
        lanes = len(work.clearances)
        self.times = [[] for _ in range(lanes + self.batch)]
        for first in range(0, lanes, self.batch):
            self._first_lane = first
            self._integrator.set_time(0.0)
            self._integrator.state[:] = self._rest
            self._integrator.pars[0] = work.clearances[np.minimum(np.arange(first, first + self.batch), lanes - 1)]
            self._integrator.reset_cooldowns()
            self._integrator.propagate_until(end)


class _ContactSearch:
    """One forcing period without impacts, the first zero of each distance to a stop noted down."""

    _made: dict[tuple[int, float | None, int], _ContactSearch] = {}

    @classmethod
    def of(cls, settings: Heyoka, oscillator: Oscillator) -> _ContactSearch:
        """Return the compiled search for an oscillator, made at the first call."""
        key = (id(oscillator), settings.tolerance, settings.batch)
        if key not in cls._made:
            cls._made[key] = cls(settings, oscillator)
        return cls._made[key]

    def __init__(self, settings: Heyoka, oscillator: Oscillator) -> None:
        import heyoka as hy

        self.batch = settings.batch
        self.oscillator = oscillator  # kept alive: it is the key
        self._first = np.full(self.batch, np.inf)
        equations, x1, _ = _equations(oscillator, hy.par[1])

        def seen(_integrator: Any, time: float, _sign: int, lane: int) -> None:
            self._first[lane] = min(self._first[lane], time)

        distances = (hy.par[0] - x1, hy.par[0] + x1)
        falling = hy.event_direction.negative
        self._integrator = hy.taylor_adaptive_batch(
            equations,
            np.zeros((len(equations), self.batch)),
            pars=np.ones((2, self.batch)),
            nt_events=[hy.nt_event_batch(distance, seen, direction=falling) for distance in distances],
            compact_mode=False,
            **({} if settings.tolerance is None else {"tol": settings.tolerance}),
        )

    def run(self, start: Start, clearances: Floats) -> Floats:
        """Return the first contact for every clearance, NaN for none."""
        state = np.concatenate([start.displacement, start.velocity, [math.sin(start.phase), math.cos(start.phase)]])
        contacts = np.empty(len(clearances))
        for first in range(0, len(clearances), self.batch):
            lanes = np.minimum(np.arange(first, first + self.batch), len(clearances) - 1)
            self._first[:] = np.inf
            self._integrator.set_time(0.0)
            self._integrator.state[:] = state[:, None]
            self._integrator.pars[0] = clearances[lanes]
            self._integrator.pars[1] = start.omega
            self._integrator.propagate_until(np.full(self.batch, 2.0 * math.pi / start.omega))
            count = min(self.batch, len(clearances) - first)
            contacts[first : first + count] = self._first[:count]
        return np.where(np.isfinite(contacts), contacts, np.nan)

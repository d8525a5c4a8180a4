"""The core among the contestants."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks import this_core
from benchmarks.work import Floats, Integers, Start, Work
from grazemap_core.model.oscillator import Oscillator


class Core:
    """The impact core, as `this_core` calls it."""

    @property
    def name(self) -> str:
        """Return the tool with the kernel that ran."""
        return f"this core ({this_core.KERNEL})"

    def prepare(self, work: Work) -> Callable[[], object]:
        """Return what is to be timed."""
        trajectories = this_core.at_rest(work.oscillator, work.omega, work.clearances)
        trajectories.run(1)
        return lambda: trajectories.run(work.periods)

    def impacts(self, work: Work) -> Integers:
        """Return the impacts of every lane."""
        trajectories = this_core.at_rest(work.oscillator, work.omega, work.clearances)
        trajectories.run(work.periods)
        return trajectories.impacts()

    def impact_times(self, work: Work, count: int) -> Floats:
        """Return the first impact times of lane 0."""
        return this_core.impact_times(work.oscillator, work.omega, float(work.clearances[0]), work.periods)[:count]

    def first_contacts(self, oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
        """Return the time of the first contact within one forcing period, NaN for none."""
        return this_core.first_contacts(oscillator, start, clearances)

"""The interface of a tool in the tables, and the timing of several tools in turn.

Repeats are interleaved, A B C A B C, so that other programs on the machine affect all tools equally, and a ratio is
taken within one round. The clock is the CPU time of this process (every tool runs on one core); wall time is recorded
too.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from benchmarks.work import Floats, Integers, Start, Work
from grazemap_core.model.oscillator import Oscillator


class Contestant(Protocol):
    """A tool that follows trajectories through impacts."""

    @property
    def name(self) -> str:
        """Return the tool with the settings that matter."""

    def prepare(self, work: Work) -> Callable[[], object]:
        """Return what is to be timed: all of the work, everything compiled before."""

    def impacts(self, work: Work) -> Integers:
        """Return the impacts of every lane, shape (lanes,)."""

    def impact_times(self, work: Work, count: int) -> Floats:
        """Return the first impact times of lane 0, at most `count`."""

    def first_contacts(self, oscillator: Oscillator, start: Start, clearances: Floats) -> Floats:
        """Return the time of the first contact within one forcing period, NaN for none, shape (clearances,)."""


@dataclass
class Clocked:
    """Seconds of one thing, one entry per round."""

    cpu: list[float] = field(default_factory=list)
    wall: list[float] = field(default_factory=list)


def time_in_turn(
    things: Mapping[str, Callable[[], object]], rounds: int, progress: Callable[[str], None]
) -> dict[str, Clocked]:
    """Time every thing once per round, after one round that does not count."""
    clocked = {name: Clocked() for name in things}
    for number in range(rounds + 1):
        for name, run in things.items():
            gc.collect()
            wall, cpu = time.perf_counter(), time.process_time()
            run()
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            if number > 0:
                clocked[name].cpu.append(cpu)
                clocked[name].wall.append(wall)
        progress(f"round {number} of {rounds}" if number else "warm-up round")
    return clocked

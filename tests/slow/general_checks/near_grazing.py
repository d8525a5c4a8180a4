"""First impacts of five systems whose steady motion passes a stop by 1e-2 to 1e-13 of its height, and just not."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import count, islice
from multiprocessing import get_context
from typing import NamedTuple

import numpy as np

from grazemap_core.model.drive import base_in_space, force
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.near_grazing import OVERSHOOTS, Outcome, outcome_of, passage
from tests.support.random_systems import random_contact, random_structure

from .table import Row, part

IMPACTS = 12_000
"""Of each system."""


class System(NamedTuple):
    """An oscillator, and the stop that is passed."""

    oscillator: Oscillator
    stop: int

    def omegas(self, number: int) -> list[float]:
        """Return random frequencies about the natural ones."""
        structure = self.oscillator.structure
        scale = np.sqrt(np.trace(structure.stiffness_matrix) / np.trace(structure.mass_matrix))
        return (np.random.default_rng(7).uniform(0.1, 1.2, number) * scale).tolist()


def _systems() -> Iterator[tuple[str, System]]:
    random = np.random.default_rng(5)

    def drive(size: int, *orders: int, unbalance: bool = False) -> list:
        return [force(k, random.normal(size=size) / k, random.normal(size=size), unbalance=unbalance) for k in orders]

    def oscillator(size: int, forces: list, *, bias: bool = False, seed: int = 0) -> Oscillator:
        structure = random_structure(np.random.default_rng(seed), size)
        row = random_contact(random, size)
        return Oscillator.of_structure(structure, row, forces, 0.8, random.normal(size=size) * bias, 0.5)

    yield "dense, bias", System(oscillator(3, drive(3, 1), bias=True, seed=3), 1)
    yield "gyroscopic, left stop", System(oscillator(4, drive(4, 1), seed=4), -1)
    yield "chain, unbalance", System(oscillator(5, drive(5, 1, unbalance=True), seed=11), 1)
    yield "three harmonics, bias", System(oscillator(2, drive(2, 1, 2, 3), bias=True, seed=1), -1)
    chain = Oscillator.create([1.0, 2.0, 2.0], [3.0, 2.0, 4.0], [0.05, 0.1, 0.02], np.ones(3), 0.8).structure
    base = [base_in_space(0.7, *chain.ground_forces(np.ones(3)))]
    yield "relative, shaken base", System(Oscillator.of_structure(chain, [1.0, -1.0, 0.0], base, 0.7), 1)


SYSTEMS = dict(_systems())


def outcomes_of(name: str, passages: int) -> list[Outcome]:
    """Return the outcomes of so many passages of a system, every second one with another stop farther away."""
    system = SYSTEMS[name]
    approaches = (
        approach for w in system.omegas(10 * passages) if (approach := passage(system.oscillator, w, system.stop))
    )
    return [
        outcome_of(approach, other=k % 2 == 0)
        for k, approach in zip(count(), islice(approaches, passages), strict=False)
    ]


def check(share: float, processes: int) -> list[Row]:
    """Compare the first impacts of every system."""
    passages = part(IMPACTS // len(OVERSHOOTS), share)
    rows = []
    with get_context("spawn").Pool(processes) as pool:
        by_system = pool.map(partial(outcomes_of, passages=passages), SYSTEMS, chunksize=1)
        for name, outcomes in zip(SYSTEMS, by_system, strict=True):
            there, missed, false = (sum(outcome[k] for outcome in outcomes) for k in range(3))
            error = max(outcome.error for outcome in outcomes)
            rows.append(
                Row(
                    f"near-grazing first impacts: {name}",
                    there,
                    missed + false + (error > 1.0),
                    f"{error:.2f} of the error",
                )
            )
            print(
                f"{name}: {there - missed} of {there} impacts, {false} false, error {error:.2f} of that allowed",
                flush=True,
            )
    return rows

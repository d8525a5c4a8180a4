"""Impacts of structures without damping, or with hardly any, at resonance and beside it, in 60 digits."""

from __future__ import annotations

import numpy as np

from grazemap_core.model.drive import force
from grazemap_core.model.matrices import Matrices
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.general_oracle import GeneralOracle
from tests.slow import resonance
from tests.slow.resonance import OFFSETS, Case
from tests.support.random_systems import random_contact

from .table import Row, part

CASES = 50
NUMBERS = ("mass", "damping", "stiffness", "contact", "harmonics", "restitution", "gaps", "omega", "bias")


def random_case(seed: int) -> Case:
    """Return a dense structure of one to three degrees of freedom, undamped if the seed is even, forced near a mode."""
    rng = np.random.default_rng([seed, 11])
    size, offset = 1 + seed % 3, OFFSETS[seed % len(OFFSETS)]
    mass, stiffness = (root @ root.T + 0.5 * size * np.eye(size) for root in rng.normal(size=(2, size, size)))
    damping = np.zeros((size, size)) if seed % 2 == 0 else 1e-12 * stiffness
    structure = Matrices.create(mass, stiffness, damping)
    forces = [force(1, rng.normal(size=size), rng.normal(size=size))]
    both = rng.uniform(0.6, 0.95, 2)
    oscillator = Oscillator.of_structure(
        structure, random_contact(rng, size), forces, float(both[0]), None, float(both[1])
    )
    model = modal_model(oscillator)
    mode = int(np.argmax(np.abs(model.contact_row[:, 0])))
    omega = float(np.sqrt(model.frequency_squared[mode])) + offset
    amplitudes = np.concatenate([np.zeros(size), np.linalg.solve(mass, oscillator.drive[0].constant)])
    pushed = (model.to_modal @ amplitudes).reshape(size, 2)[mode, 1]
    reach = float(abs(model.contact_row[mode, 0] * pushed)) * np.pi / (2.0 * omega)
    right, left = (rng.uniform(0.3, 3.0, 2) * reach).tolist()
    clearance = [(right, left), (right, None), (None, left)][seed % 4 % 3]
    run = GeneralOracle.of(oscillator, omega, *clearance, digits=60)
    numbers = {name: getattr(run, name) for name in NUMBERS} | {"digits": 60}
    return Case(oscillator, omega, clearance, offset, reach, GeneralOracle, numbers)


def check(share: float, processes: int) -> list[Row]:
    """Compare impacts."""
    outcomes = resonance.main(part(CASES, share), random_case)
    impacts, error = sum(outcome.compared for outcome in outcomes), max(outcome.share for outcome in outcomes)
    figure = f"{impacts} impacts, error {error:.2f} of that allowed"
    return [Row("runs at resonance and beside it, 60 digits", len(outcomes), resonance.failed(outcomes), figure)]

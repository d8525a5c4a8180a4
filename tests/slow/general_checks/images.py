"""Maps of mirror images, and of systems with twice the contact row, which are the same to the byte."""

from __future__ import annotations

from multiprocessing import get_context
from typing import Any

import numpy as np

from grazemap_core.contact.stops import both_clearances
from tests.support.lines import column
from tests.support.random_systems import System, doubled, mirrored, random_system

from .table import Row, part

SYSTEMS = 60
OMEGAS, CLEARANCES, PERIODS = 3, 8, 200
EXCHANGED = {"impacts_right": "impacts_left", "impacts_left": "impacts_right"}


def map_of(system: System) -> dict[str, Any]:
    """Return a small map about the system's point, both clearances in proportion."""
    omega = system.omega * np.linspace(0.9, 1.1, OMEGAS)
    clearances = np.linspace(0.9, 1.1, CLEARANCES)[:, None] * np.array(both_clearances(system.clearance))
    columns = [column(system.oscillator, w, clearances, PERIODS) for w in omega.tolist()]
    return {name: np.concatenate([arrays[name] for arrays in columns], axis=1) for name in columns[0]}


def differences(umap: dict[str, Any], other: dict[str, Any], exchanged: dict[str, str], scale: float) -> list[str]:
    """Return the names of the arrays that differ."""
    names = []
    for name, values in umap.items():
        same = other[exchanged.get(name, name)]
        factor = scale if name == "least_impact_velocity" else 1
        if (values * factor if factor != 1 else values).tobytes() != same.tobytes():
            names.append(name)
    return names


def images_of(seed: int) -> tuple[list[str], list[str]]:
    """Return the names of the arrays that differ from those of the mirror image, and of the doubled row."""
    system = random_system(seed)
    plain = map_of(system)
    return (
        differences(plain, map_of(mirrored(system)), EXCHANGED, 1.0),
        differences(plain, map_of(doubled(system)), {}, 2.0),
    )


def check(share: float, processes: int) -> list[Row]:
    """Compare maps."""
    seeds = sorted(range(part(SYSTEMS, share)), key=lambda seed: (seed % 6, seed))
    with get_context("spawn").Pool(processes) as pool:
        differing = pool.map(images_of, seeds, chunksize=1)
    for seed, names in zip(seeds, differing, strict=True):
        if any(names):
            print(f"maps of seed {seed}: mirror image {names[0]}, doubled row {names[1]}", flush=True)
    return [
        Row(f"maps of {kind} to the byte", len(differing), sum(bool(names[k]) for names in differing))
        for k, kind in enumerate(("mirror images", "doubled contact rows"))
    ]

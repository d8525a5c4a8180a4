"""Errors that are planted in the product, for tests that digests of results see them.

One rounding in each package of the core: the first number that a function of the package returns is one unit in the
last place off. And two fields of a result that are swapped, and the two sides of one.
"""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
import re
import sys
from collections.abc import Callable
from functools import wraps
from typing import Any, NamedTuple

import numpy as np

import grazemap_core
from grazemap_worker.processes import IMPLEMENTATIONS


class Plant(NamedTuple):
    """An error, and a process whose results have it, in a part of the requests."""

    plant: Callable[[], None]
    process: str
    tier: str = "quick"


def nudged(value: Any) -> Any:
    """Return a value with its first number that is not 0, or its first decimal, one unit in the last place off.

    Raises
    ------
    ValueError
        There is no such number in it.
    """
    if isinstance(value, float):
        if value == 0.0 or not np.isfinite(value):
            raise ValueError
        return float(np.nextafter(value, np.inf))
    if isinstance(value, np.ndarray) and value.dtype.kind in "fc":
        copy = value.copy()
        numbers = copy.reshape(-1).view(np.float64)
        places = np.flatnonzero(np.isfinite(numbers) & (numbers != 0.0))
        if not places.size:
            raise ValueError
        numbers[places[0]] = np.nextafter(numbers[places[0]], np.inf)
        return numbers.view(copy.dtype).reshape(copy.shape)
    if isinstance(value, str) and (decimal := re.fullmatch(r"(-?[0-9.]*)([0-8])((?:e.*)?)", value)) is not None:
        return f"{decimal[1]}{int(decimal[2]) + 1}{decimal[3]}"
    if dataclasses.is_dataclass(value):
        names = [field.name for field in dataclasses.fields(value) if field.init]
        parts = _first_nudged([getattr(value, name) for name in names])
        return dataclasses.replace(value, **dict(zip(names, parts, strict=True)))  # type: ignore[type-var]
    if isinstance(value, dict):
        return dict(zip(value, _first_nudged([*value.values()]), strict=True))
    if isinstance(value, tuple | list):
        parts = _first_nudged([*value])
        return value._make(parts) if hasattr(value, "_make") else type(value)(parts)
    raise ValueError


def _first_nudged(parts: list[Any]) -> list[Any]:
    for place, part in enumerate(parts):
        try:
            return [*parts[:place], nudged(part), *parts[place + 1 :]]
        except ValueError:
            continue
    raise ValueError


def _rounding(module: str, name: str) -> Callable[[], None]:
    """Return what replaces a function of the core, wherever it is imported, by one whose results are nudged."""

    def plant() -> None:
        function = getattr(importlib.import_module(f"grazemap_core.{module}"), name)

        @wraps(function)
        def wrong(*values: Any, **named: Any) -> Any:
            result = function(*values, **named)
            try:
                return nudged(result)
            except ValueError:
                return result

        for info in pkgutil.walk_packages(grazemap_core.__path__, "grazemap_core."):
            importlib.import_module(info.name)
        for imported in [loaded for key, loaded in sys.modules.items() if key.startswith("grazemap_core")]:
            for key, value in list(vars(imported).items()):
                if value is function:
                    setattr(imported, key, wrong)

    return plant


def _swap(process: str, field: str, other: str, *inside: str) -> Callable[[], None]:
    """Return what swaps two fields of a result, or of a document inside it."""

    def plant() -> None:
        whole = IMPLEMENTATIONS[process].whole
        assert whole is not None

        def wrong(*values: Any) -> Any:
            result = whole(*values)
            within = result
            for name in inside:
                within = within[name]
            if field in within and other in within:
                within[field], within[other] = within[other], within[field]
            return result

        IMPLEMENTATIONS[process] = dataclasses.replace(IMPLEMENTATIONS[process], whole=wrong)  # type: ignore[index]

    return plant


PLANTS = {
    "numerics": Plant(_rounding("numerics.kernels.double_double", "transformed"), "structures"),
    "model": Plant(_rounding("model.harmonic_response", "contact_response"), "grazing-curves"),
    "contact": Plant(_rounding("contact.stops", "stops_of"), "trajectories"),
    "simulation": Plant(_rounding("simulation.start", "initial_state"), "trajectories"),
    "grazing": Plant(_rounding("grazing.grazing_curve", "wrapped"), "grazing-curves"),
    "orbits": Plant(_rounding("orbits.states", "multipliers_of"), "periodic-orbits"),
    "continuation": Plant(_rounding("continuation.branches", "_branch"), "orbit-branches"),
    "maps": Plant(_rounding("maps.unfolding", "arrays_of"), "unfolding-maps", "maps"),
    "proofs": Plant(_rounding("proofs.certificates", "decimals"), "proofs"),
    "fields": Plant(_swap("trajectories", "displacement", "velocity"), "trajectories"),
    "sides": Plant(_swap("periodic-orbits", "impacts_right", "impacts_left", "motion"), "periodic-orbits"),
}
"""Errors by the package of the core in which they are, or by what is swapped."""


def plant(name: str) -> None:
    """Plant an error, in this process."""
    PLANTS[name].plant()

"""Digests of results that the core computes, recorded beside its version.

`make digests` (python -m tests.result_digests) records those of this version for the processor that it runs on, in
tests/data/digests.json. It refuses to change what is recorded for a version that CHANGELOG.md does not call unreleased:
who changes the bytes of a result changes the version in pyproject.toml first.

What results are made of depends on the processor and on the versions of the libraries too; each combination is recorded
on its own. Names of arrays do not count, nor does their order.
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
import sys
from collections.abc import Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "tests" / "data" / "digests.json"
LIBRARIES = ("numba", "llvmlite", "numpy", "scipy")
# Extensions of the instruction set that change how compiled code, numpy and its linear algebra round.
_EXTENSIONS = ("avx512f", "avx2", "fma")


def core_version() -> str:
    """Return the version of pyproject.toml."""
    found = re.search(r'^version = "(.+)"$', (ROOT / "pyproject.toml").read_text("utf-8"), re.MULTILINE)
    assert found is not None
    return found[1]


def platform_key() -> str:
    """Return what, besides the version, the bytes depend on: the kind of processor, and the libraries' versions."""
    from grazemap_worker.numerics import numerics

    features = numerics().cpu_features.split(", ")
    extensions = [name for name in _EXTENSIONS if name in features]
    libraries = [f"{name} {version(name)}" for name in LIBRARIES]
    return ", ".join([platform.machine(), "+".join(extensions) or "no extensions", *libraries])


def compute() -> dict[str, str]:
    """Return the digests of five maps, two periodic orbits, two branches and a bifurcation diagram, by name."""
    from grazemap_core.continuation.branches import orbit_branch
    from grazemap_core.continuation.parameters import Parameter
    from grazemap_core.maps.bifurcation_diagrams import sections
    from grazemap_core.maps.planes import Plane
    from grazemap_core.maps.unfolding import unfolding_map_tile
    from grazemap_core.model.oscillator import Oscillator
    from grazemap_core.orbits.periodic_orbits import PeriodicOrbit, periodic_orbit
    from grazemap_core.orbits.search import sequence_of_stops
    from tests.lines import line

    three = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
    softer = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.6)
    omega, clearance = np.linspace(0.26, 0.30, 6), np.linspace(1.3, 2.0, 24)

    def solved(oscillator: Oscillator, frequency: float, gap: float, stops: list[int]) -> PeriodicOrbit:
        guess = sequence_of_stops(oscillator, frequency, gap, 1, stops)
        assert guess is not None
        return periodic_orbit(oscillator, frequency, gap, guess)

    def orbit(*of: Any) -> list[Any]:
        found = solved(*of)
        return [found.impacts.phases, found.impacts.velocities, found.multipliers]

    def branch(parameter: Parameter, start: float, stop: float) -> list[Any]:
        found = orbit_branch(three, solved(three, 0.27, 1.55, [1, 1, -1, -1]), start, stop, parameter, max_points=30)
        return [found.phases, found.velocities, found.multipliers]

    diagram = sections(line(three, "clearance", np.linspace(1.4, 1.9, 12), 0.27), "rest", 20, 200, 32)
    return {
        "map from rest": digest(unfolding_map_tile(Plane.of(three, omega, clearance)).values()),
        "map in a sweep": digest(
            unfolding_map_tile(Plane.of(softer, omega[::2], clearance[::2]), policy="sweep-down").values()
        ),
        "map of an ensemble": digest(
            unfolding_map_tile(
                Plane.of(three, omega[::3], clearance[::6]), policy="ensemble", initial_conditions=3
            ).values()
        ),
        "sensitive point resolved": digest(
            unfolding_map_tile(Plane.of(three, omega[5:], clearance[6:7]), resolve_sensitive=True).values()
        ),
        "preview of a map": digest(unfolding_map_tile(Plane.of(three, omega, clearance), preview=True).values()),
        "periodic orbit of four impacts": digest(orbit(three, 0.27, 1.55, [1, 1, -1, -1])),
        "periodic orbit of two impacts": digest(orbit(softer, 0.3, 1.0, [1, -1])),
        "branch over clearance": digest(branch("clearance", 1.5, 1.7)),
        "branch over restitution": digest(branch("restitution", 0.75, 0.85)),
        "bifurcation diagram": digest(
            array for found in diagram for array in (found.displacement, found.velocity, found.impact_velocity)
        ),
    }


def digest(arrays: Iterable[Any]) -> str:
    """Return the sha256 of arrays: of types, shapes and bytes, in an order that does not depend on their names."""
    single = {
        hashlib.sha256(f"{array.dtype} {array.shape} ".encode() + np.ascontiguousarray(array).tobytes()).hexdigest()
        for array in arrays
    }
    return hashlib.sha256(" ".join(sorted(single)).encode()).hexdigest()


def recorded() -> dict[str, dict[str, dict[str, str]]]:
    """Return what is recorded: digests by name, by platform, by version."""
    return json.loads(RECORD.read_text("utf-8")) if RECORD.exists() else {}


def changed(record: dict[str, dict[str, str]], key: str, found: dict[str, str]) -> list[str]:
    """Return the names of the results of a platform whose digests are not those recorded for a version."""
    known = record.get(key, {})
    return [name for name in sorted(known.keys() | found.keys()) if known.get(name) != found.get(name)]


def main() -> int:
    """Record this version's digests on this machine; return the exit status."""
    record, name, key = recorded(), core_version(), platform_key()
    found = compute()
    known = record.setdefault(name, {})
    unreleased = f"## {name} (unreleased)" in (ROOT / "CHANGELOG.md").read_text("utf-8")
    if key in known and changed(known, key, found) and not unreleased:
        sys.stderr.write(
            f"version {name} is released, and {', '.join(changed(known, key, found))} changed: "
            "change the version in pyproject.toml\n"
        )
        return 1
    known[key] = found
    RECORD.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", "utf-8")
    print(f"recorded for {name}: {key}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

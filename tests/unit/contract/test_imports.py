"""The import contracts hold, and each of them has been seen to fail on a planted import."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PACKAGES = ("sdk/grazemap", "core/grazemap_core", "worker/grazemap_worker", "service/grazemap_service")

SDK = "The SDK is a light client"
SDK_LAYERS = "The SDK's packages import only those below them"
CORE = "The core is numerics only"
CORE_LAYERS = "The core's packages import only those below them"
FLINT = "Only proofs and runs in multi-precision arithmetic need python-flint"
KERNELS = "Kernels import kernels only"
WORKER = "The worker speaks no HTTP"
WORKER_LAYERS = "The worker's packages import only those below them"
STORE = "The service and the workers share the store and the queues"
STORE_ALONE = "The store works without RQ"
QUEUE = "RQ is known to the worker's queue package alone"
SERVICE = "The service never loads the core: it enqueues by name"
PACKAGE_MODULES = "Nothing is smuggled in by a package's __init__"

CONTRACTS = (
    SDK,
    SDK_LAYERS,
    CORE,
    CORE_LAYERS,
    FLINT,
    KERNELS,
    WORKER,
    WORKER_LAYERS,
    STORE,
    STORE_ALONE,
    QUEUE,
    SERVICE,
    PACKAGE_MODULES,
)

PLANTS = [
    ("service/grazemap_service/routers/jobs.py", "import numba", SERVICE),
    ("service/grazemap_service/jobs.py", "def late():\n    import grazemap_core.model.oscillator", SERVICE),
    ("service/grazemap_service/app.py", "from grazemap_worker.tasks import drain", SERVICE),
    ("sdk/grazemap/codec.py", "import redis", SDK),
    ("sdk/grazemap/wire/base.py", "from grazemap_core import tolerances", SDK),
    ("sdk/grazemap/wire/base.py", "from grazemap.client import arguments", SDK_LAYERS),
    ("sdk/grazemap/results/records.py", "def late():\n    from grazemap.plots import palette", SDK_LAYERS),
    ("sdk/grazemap/errors.py", "from grazemap.wire import Job", SDK_LAYERS),
    ("core/grazemap_core/model/oscillator.py", "from grazemap.wire import Oscillator", CORE),
    ("core/grazemap_core/contact/cell_problem.py", "from grazemap_core.simulation import motion", CORE_LAYERS),
    ("core/grazemap_core/orbits/kernels/newton.py", "from grazemap_core.maps.kernels import lanes", CORE_LAYERS),
    ("core/grazemap_core/codes.py", "from grazemap_core import checks", CORE_LAYERS),
    ("core/grazemap_core/contact/kernels/cells.py", "from grazemap_core.contact import held_problem", KERNELS),
    ("core/grazemap_core/orbits/search.py", "import flint", FLINT),
    ("worker/grazemap_worker/tasks.py", "import fastapi", WORKER),
    ("worker/grazemap_worker/queue/bells.py", "import numba", STORE),
    ("worker/grazemap_worker/queue/rq_keys.py", "import grazemap_worker.tasks", STORE),
    ("worker/grazemap_worker/supervision/reconciler.py", "from rq.job import Job", QUEUE),
    ("service/grazemap_service/jobs.py", "from rq import Queue", QUEUE),
    ("worker/grazemap_worker/queue/__init__.py", "import grazemap_worker.tasks", PACKAGE_MODULES),
    ("worker/grazemap_worker/planning/limits.py", "from grazemap_worker.store import keys", WORKER_LAYERS),
    ("worker/grazemap_worker/store/ledger.py", "from grazemap_worker.processes import PROCESSES", WORKER_LAYERS),
    ("worker/grazemap_worker/processes/basins.py", "from grazemap_worker import tasks", WORKER_LAYERS),
    ("worker/grazemap_worker/planning/plan.py", "import scipy", STORE),
    ("worker/grazemap_worker/store/ledger.py", "from rq import Queue", STORE_ALONE),
    ("worker/grazemap_worker/__init__.py", "import grazemap_worker.tasks", PACKAGE_MODULES),
    ("worker/grazemap_worker/store/__init__.py", "import numba", PACKAGE_MODULES),
]


CIRCLES = [
    # between modules; inside a function; between two packages whose modules form none
    ("core/grazemap_core/model/chain.py", "import grazemap_core.model.oscillator", "grazemap_core.model.chain"),
    ("sdk/grazemap/wire/base.py", "def late():\n    import grazemap.wire.oscillator", "grazemap.wire.base"),
    (
        "sdk/grazemap/wire/job.py",
        "import grazemap.client.events",
        "  grazemap.client, ",
    ),
]


def lint(folder: Path) -> subprocess.CompletedProcess[str]:
    """Check the packages under a folder against its contracts."""
    return run(folder, Path(sys.executable).with_name("lint-imports"), "--no-cache")


def count_circles(folder: Path) -> subprocess.CompletedProcess[str]:
    """Count the circles of imports of the packages under a folder."""
    return run(folder, Path(sys.executable), ROOT / "tests" / "support" / "import_circles.py")


def run(folder: Path, *command: str | Path) -> subprocess.CompletedProcess[str]:
    paths = os.pathsep.join(str(folder / package.split("/")[0]) for package in PACKAGES)
    return subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_the_contracts_hold() -> None:
    done = lint(ROOT)
    assert done.returncode == 0, done.stdout
    assert "0 broken" in done.stdout
    for name in CONTRACTS:
        assert f"{name} KEPT" in done.stdout


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the packages and the contracts."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "static"))
    shutil.copy(ROOT / ".importlinter", tmp_path)
    return tmp_path


def rounds() -> list[list[tuple[str, str, str]]]:
    """The plants in as few parts as there can be, in each of which a contract has one plant at most."""
    parts: list[list[tuple[str, str, str]]] = []
    for plant in PLANTS:
        part = next((part for part in parts if plant[2] not in {contract for _, _, contract in part}), None)
        if part is None:
            parts.append(part := [])
        part.append(plant)
    return parts


@pytest.mark.parametrize("plants", rounds())
def test_planted_imports_are_found(copy: Path, plants: list[tuple[str, str, str]]) -> None:
    """Each contract is broken, and names the module and the line of its plant."""
    expected = {}
    for path, line, contract in plants:
        target = copy / path
        target.write_text(target.read_text() + f"\n{line}\n")
        module = path.partition("/")[2].removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        number = len(target.read_text().splitlines())
        expected[contract] = rf" {re.escape(module)} -> [\w.]+ \(l\.([\d, l.]*\b)?{number}\b"
    done = lint(copy)
    assert done.returncode == 1
    broken = re.split(r"\n(.+)\n-+\n", done.stdout.partition("Broken contracts")[2])
    said = {name: re.sub(r"\s+", " ", text) for name, text in zip(broken[1::2], broken[2::2], strict=True)}
    for contract, pattern in expected.items():
        assert f"{contract} BROKEN" in done.stdout
        assert re.search(pattern, said[contract]), contract


def test_there_are_no_import_circles() -> None:
    done = count_circles(ROOT)
    assert done.returncode == 0, done.stdout
    assert done.stdout.startswith("0 import circles")


@pytest.mark.parametrize(("path", "line", "member"), CIRCLES)
def test_a_planted_circle_is_found(copy: Path, path: str, line: str, member: str) -> None:
    target = copy / path
    target.write_text(target.read_text() + f"\n{line}\n")
    done = count_circles(copy)
    assert done.returncode == 1
    assert member in done.stdout


def test_an_import_for_type_checkers_is_no_circle(copy: Path) -> None:
    target = copy / "sdk/grazemap/wire/base.py"
    target.write_text(target.read_text() + "\nif TYPE_CHECKING:\n    import grazemap.wire.oscillator\n")
    assert count_circles(copy).returncode == 0

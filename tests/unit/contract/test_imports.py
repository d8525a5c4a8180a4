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

# one import that breaks each contract: the module, and the line at its end
PLANTS = {
    "The SDK is a light client": ("sdk/grazemap/codec.py", "import redis"),
    "The SDK's packages import only those below them": (
        "sdk/grazemap/results/common_records.py",
        "def late():\n    from grazemap.plots import palette",
    ),
    "The core is numerics only": ("core/grazemap_core/model/oscillator.py", "from grazemap.wire import Oscillator"),
    "The core's packages import only those below them": (
        "core/grazemap_core/orbits/kernels/newton.py",
        "from grazemap_core.maps.kernels import first_pass",
    ),
    "Only proofs and runs in multi-precision arithmetic need python-flint": (
        "core/grazemap_core/orbits/search.py",
        "import flint",
    ),
    "Kernels import kernels only": (
        "core/grazemap_core/contact/kernels/cells.py",
        "from grazemap_core.contact import trajectory_models",
    ),
    "The worker speaks no HTTP": ("worker/grazemap_worker/tasks.py", "import fastapi"),
    "The worker's packages import only those below them": (
        "worker/grazemap_worker/processes/basins.py",
        "from grazemap_worker import tasks",
    ),
    "The service and the workers share the store and the queues": (
        "worker/grazemap_worker/queue/wake_ups.py",
        "import numba",
    ),
    "The store works without RQ": ("worker/grazemap_worker/store/ledger.py", "from rq import Queue"),
    "RQ is known to the worker's queue package alone": ("service/grazemap_service/jobs.py", "from rq import Queue"),
    "The service never loads the core: it enqueues by name": (
        "service/grazemap_service/app.py",
        "def late():\n    import grazemap_core.model.oscillator",
    ),
    "Nothing is smuggled in by a package's __init__": (
        "worker/grazemap_worker/queue/__init__.py",
        "import grazemap_worker.tasks",
    ),
}

# circles between modules, inside a function, and between two packages whose modules form none
CIRCLES = [
    ("core/grazemap_core/model/chain.py", "import grazemap_core.model.oscillator", "grazemap_core.model.chain"),
    ("sdk/grazemap/wire/base.py", "def late():\n    import grazemap.wire.oscillator", "grazemap.wire.base"),
    ("sdk/grazemap/wire/job.py", "import grazemap.client.events", "  grazemap.client, "),
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
    assert set(re.findall(r"^(.+) KEPT\b", done.stdout, re.MULTILINE)) == set(PLANTS)


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the packages and the contracts."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__", "static"))
    shutil.copy(ROOT / ".importlinter", tmp_path)
    return tmp_path


def plant(copy: Path, path: str, line: str) -> None:
    with (copy / path).open("a") as target:
        target.write(f"\n{line}\n")


def test_planted_imports_are_found(copy: Path) -> None:
    """Each contract is broken, and names the module and the line of its plant."""
    for path, line in PLANTS.values():
        plant(copy, path, line)
    done = lint(copy)
    assert done.returncode == 1
    broken = re.split(r"\n(.+)\n-+\n", done.stdout.partition("Broken contracts")[2])
    told = {name: re.sub(r"\s+", " ", text) for name, text in zip(broken[1::2], broken[2::2], strict=True)}
    for contract, (path, _) in PLANTS.items():
        assert f"{contract} BROKEN" in done.stdout
        module = path.partition("/")[2].removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        number = len((copy / path).read_text().splitlines())
        pattern = rf" {re.escape(module)} -> [\w.]+ \(l\.([\d, l.]*\b)?{number}\b"
        assert re.search(pattern, told[contract]), contract


def test_there_are_no_import_circles() -> None:
    done = count_circles(ROOT)
    assert done.returncode == 0, done.stdout
    assert done.stdout.startswith("0 import circles")


def test_planted_circles_are_found_and_imports_for_type_checkers_are_none(copy: Path) -> None:
    plant(copy, "sdk/grazemap/wire/base.py", "if TYPE_CHECKING:\n    import grazemap.wire.oscillator")
    assert count_circles(copy).returncode == 0
    for path, line, _ in CIRCLES:
        plant(copy, path, line)
    done = count_circles(copy)
    assert done.returncode == 1
    assert [member for *_, member in CIRCLES if member not in done.stdout] == []

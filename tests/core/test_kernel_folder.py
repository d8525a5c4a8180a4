"""Where compiled kernels are kept: in a folder named after all that they depend on, each a file with a checksum."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import grazemap_core
from grazemap_core.kernel_folder import folder_name

CORE = Path(grazemap_core.__file__).parent
COMPILES = re.compile(r"^@(njit|kernel|fused_kernel|inlined|fused_inlined)\b", re.MULTILINE)
MODULES = sorted(
    ".".join(path.relative_to(CORE.parent).with_suffix("").parts)
    for path in CORE.rglob("*.py")
    if COMPILES.search(path.read_text())
)

# Imports each module alone, in a process that has imported numba and nothing of the core, and prints cache folders.
IMPORT_ALONE = """
import importlib, json, os, sys
import numba
from numba.core.dispatcher import Dispatcher

def folders(module):
    found = {}
    for name, value in vars(module).items():
        whole = getattr(value, "whole", value)
        if isinstance(whole, Dispatcher):
            found[name] = whole._cache.cache_path
    return found

for name in sys.argv[2:]:
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        if sys.argv[1] == "late":  # the kernels are defined before the folder is chosen
            module = sys.modules["grazemap_core"] = type(sys)("grazemap_core")
            module.__path__ = [os.environ["CORE"]]
        print(json.dumps({name: folders(importlib.import_module(name))}), flush=True)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0, name
"""


def cache_folders(modules: list[str], tmp_path: Path, when: str = "") -> dict[str, dict[str, str]]:
    """Return the cache folders of the compiled functions that each module has after it was imported alone."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "CORE": str(CORE)}
    run = subprocess.run(
        [sys.executable, "-c", IMPORT_ALONE, when, *modules],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, dict[str, str]] = {}
    for line in run.stdout.splitlines():
        found |= json.loads(line)
    return found


def outside(found: dict[str, dict[str, str]], tmp_path: Path) -> list[str]:
    folder = tmp_path / folder_name()
    return [
        f"{module}.{name}"
        for module, kernels in found.items()
        for name, path in kernels.items()
        if not Path(path).is_relative_to(folder)
    ]


def test_every_module_of_kernels_keeps_machine_code_in_the_folder_of_the_fingerprint(tmp_path: Path) -> None:
    assert len(MODULES) > 35
    found = cache_folders(MODULES, tmp_path)
    assert sorted(found) == MODULES
    assert all(found.values())
    assert outside(found, tmp_path) == []


def test_a_kernel_defined_before_the_folder_is_chosen_is_detected(tmp_path: Path) -> None:
    module = "grazemap_core.numerics.kernels.dense"
    late = cache_folders([module], tmp_path, "late")
    kernels = "eliminate", "multiply", "add_transposed_product", "cholesky"
    assert outside(late, tmp_path) == [f"{module}.{name}" for name in kernels]


# Calls two kernels that compile quickly, each for a type of its own, and prints what was compiled.
CALLS = """
import sys, time
import numpy as np
from numba.core import event
from grazemap_core import kernel_folder
from grazemap_core.numerics.kernels.dense import multiply
from grazemap_core.contact.kernels.cell_factors import shortfall

compiled = []

class Listener(event.Listener):
    def on_start(self, _event): ...
    def on_end(self, ended): compiled.append(ended.data["dispatcher"].py_func.__name__)

event.register("numba:compile", Listener())
order = "F" if "F" in sys.argv else "C"
while "after" in sys.argv and time.time() < float(sys.argv[-1]):
    pass
left, right, product = (np.asarray(np.eye(3), order=order) for _ in range(3))
multiply(product, left, right)
multiply(product[:2, :2], left[:2, :2], right[:2, :2])
kernel_folder.record("step")
print(*compiled)
"""


def call(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    """Start a process that calls kernels with a cache in a folder."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    command = [sys.executable, "-c", CALLS, *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def compiled(folder: Path, *arguments: str) -> tuple[list[str], str]:
    """Return the names of the kernels that a process has compiled, and what it said."""
    with call(folder, *arguments) as process:
        said, errors = process.communicate()
    assert process.returncode == 0, errors
    return said.split(), errors

"""Where compiled kernels are kept: in a folder named after all that they depend on, each a file with a checksum."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

import grazemap_core
from grazemap_core import kernel_folder
from grazemap_core.compiled_ahead import MADE_FROM, PACKAGE, PROCESSOR, has_level_3, made_from
from grazemap_core.kernel_folder import folder_name, holds

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
        if sys.argv[1] == "read again":  # numba reads its settings after the folder is chosen
            import grazemap_core
            os.environ["NUMBA_FULL_TRACEBACKS"] = "1"
            numba.config.reload_config()
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
    folders: dict[str, dict[str, str]] = {}
    for line in run.stdout.splitlines():
        folders |= json.loads(line)
    return folders


def outside(folders: dict[str, dict[str, str]], tmp_path: Path) -> list[str]:
    folder = tmp_path / folder_name()
    return [
        f"{module}.{name}"
        for module, kernels in folders.items()
        for name, path in kernels.items()
        if not Path(path).is_relative_to(folder)
    ]


@pytest.mark.thorough
def test_every_module_of_kernels_keeps_machine_code_in_the_folder_of_the_fingerprint(tmp_path: Path) -> None:
    assert len(MODULES) > 35
    folders = cache_folders(MODULES, tmp_path)
    assert sorted(folders) == MODULES
    assert all(folders.values())
    assert outside(folders, tmp_path) == []


def test_a_kernel_defined_before_the_folder_is_chosen_is_detected(tmp_path: Path) -> None:
    module = "grazemap_core.numerics.kernels.dense"
    late = cache_folders([module], tmp_path, "late")
    kernels = "eliminate", "multiply", "_add_row", "add_transposed_product", "cholesky"
    assert outside(late, tmp_path) == [f"{module}.{name}" for name in kernels]


def test_the_folder_stays_when_numba_reads_its_settings_again(tmp_path: Path) -> None:
    folders = cache_folders(["grazemap_core.numerics.kernels.dense"], tmp_path, "read again")
    assert any(folders.values())
    assert outside(folders, tmp_path) == []


def test_functions_of_others_keep_the_cache_that_numba_gives_them(tmp_path: Path) -> None:
    (tmp_path / "of_user.py").write_text("import numba\n\n@numba.njit(cache=True)\ndef half(x):\n    return 0.5 * x\n")
    code = "import numba, sys; sys.path.insert(0, sys.argv[1]); {}import of_user; of_user.half(1.0); " + (
        "print(numba.config.CACHE_DIR, of_user.half._cache.cache_path)"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    places = []
    for first in ("", "import grazemap_core; "):
        command = [sys.executable, "-c", code.format(first), tmp_path]
        run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        places.append(run.stdout)
    assert places[0] == places[1]
    assert str(tmp_path / "kept") in places[0]


# Calls two kernels that compile quickly, each for a type of its own, and prints what was compiled.
CALLS = """
import sys, time
import numpy as np
from grazemap_core import kernel_folder
from numba.core import event
from grazemap_core.numerics.jit.compiled import copy_matrix, copy_vector

compiled = []

class Listener(event.Listener):
    def on_start(self, _event): ...
    def on_end(self, ended): compiled.append(ended.data["dispatcher"].py_func.__name__)

event.register("numba:compile", Listener())
number = np.float32 if "float32" in sys.argv else np.float64
while "after" in sys.argv and time.time() < float(sys.argv[-1]):
    pass
copy_vector(np.zeros(2, number), np.ones(2, number))
copy_matrix(np.zeros((2, 2), number), np.ones((2, 2), number))
kernel_folder.record("step")
print(*compiled)
"""


def call(folder: Path, *arguments: str, **settings: str) -> subprocess.Popen[str]:
    """Start a process that calls kernels with a cache in a folder."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder), **settings}
    command = [sys.executable, "-c", CALLS, *arguments]
    return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def compiled(folder: Path, *arguments: str, **settings: str) -> tuple[list[str], str]:
    """Return the names of the kernels that a process has compiled, and what it said."""
    with call(folder, *arguments, **settings) as process:
        output, errors = process.communicate()
    assert process.returncode == 0, errors
    return output.split(), errors


def entries(folder: Path, name: str = "") -> list[Path]:
    return sorted((folder / folder_name()).glob(f"*{name}.*.kernel"))


def test_a_damaged_entry_is_compiled_again_alone(tmp_path: Path) -> None:
    assert compiled(tmp_path) == (["copy_vector", "copy_matrix"], "")
    (damaged,) = entries(tmp_path, "copy_vector")
    content = damaged.read_bytes()
    damaged.write_bytes(content[:500] + bytes(1000) + content[1500:])
    names, errors = compiled(tmp_path)
    assert names == ["copy_vector"]
    assert "is damaged and is compiled again" in errors
    assert compiled(tmp_path) == ([], "")


@pytest.mark.thorough
def test_a_process_that_is_killed_while_it_compiles_leaves_what_it_had_compiled(tmp_path: Path) -> None:
    with call(tmp_path) as process:
        while not entries(tmp_path, "copy_vector"):
            assert process.poll() is None
        process.kill()
    assert "copy_vector" not in compiled(tmp_path)[0]


@pytest.mark.thorough
def test_two_processes_that_compile_for_different_types_at_once_leave_the_kernels_of_both(tmp_path: Path) -> None:
    soon = str(time.time() + 4.0)
    with call(tmp_path, "after", soon) as first, call(tmp_path, "float32", "after", soon) as other:
        for process in (first, other):
            process.communicate()
            assert process.returncode == 0
    assert len(entries(tmp_path, "copy_vector")) == 2
    assert compiled(tmp_path) == ([], "")


def test_a_step_is_held_when_all_its_entries_are_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernel_folder, "folder", lambda: tmp_path / folder_name())
    assert not holds("step")
    compiled(tmp_path)
    assert holds("step")
    (entry,) = entries(tmp_path, "copy_matrix")
    content = entry.read_bytes()
    entry.write_bytes(content[:-1])
    assert not holds("step")
    entry.unlink()
    assert not holds("step")
    entry.write_bytes(content)
    assert holds("step")


def test_without_space_for_an_entry_the_kernel_is_used_all_the_same(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with call(tmp_path / "file") as process:
        _, errors = process.communicate()
    assert "a compiled kernel cannot be stored" in errors
    assert "NotADirectoryError" in errors  # of the record of the step, after both calls


@pytest.mark.thorough
@pytest.mark.skipif(not has_level_3(), reason="the processor is not of the level x86-64-v3")
def test_kernels_that_were_compiled_ahead_are_loaded_where_they_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in PROCESSOR:  # as `make test NARROW=1` sets it
        monkeypatch.delenv(name, raising=False)
    both = ["copy_vector", "copy_matrix"]
    assert compiled(tmp_path / "made", **PROCESSOR)[0] == both
    package = tmp_path / "installed" / PACKAGE
    shutil.copytree(tmp_path / "made", package)
    (package / "__init__.py").touch()
    paths = os.pathsep.join([str(package.parent), os.environ.get("PYTHONPATH", "")])

    def run(folder: str, **settings: str) -> list[str]:
        return compiled(tmp_path / folder, PYTHONPATH=paths, **settings)[0]

    (package / MADE_FROM).write_text(json.dumps(made_from() | {"sources": "others"}))
    assert run("of-others") == both
    (package / MADE_FROM).write_text(json.dumps(made_from()))
    assert run("ahead") == []
    assert list((tmp_path / "ahead").rglob("*.kernel")) == []
    assert run("ahead", GRAZEMAP_KERNELS="native") == both
    # a damaged one is compiled into the user's folder
    (damaged,) = package.rglob("*copy_vector.*.kernel")
    damaged.write_bytes(b"")
    assert run("beside") == ["copy_vector"]

"""The wheel `grazemap-kernels`: the kernels of this version, compiled ahead of time for processors of x86-64-v3.

`python tools/kernels_wheel.py [FOLDER]` (`make kernels-wheel`) compiles all kernels and packs what that has stored into
a wheel in FOLDER (dist). It is for this Python and these versions of numba, llvmlite and numpy, which it requires. It
takes some three minutes and needs a processor of that level.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from importlib.metadata import distribution, version
from pathlib import Path

from grazemap.module_command import module_command
from grazemap_core.compiled_ahead import MADE_FROM, PACKAGE, PROCESSOR, made_from

_ABOUT = '"""Kernels of grazemap, compiled ahead of time; grazemap_core.compiled_ahead says when they are used."""\n'
_PROJECT = """[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "grazemap-kernels"
version = {version}
description = "The kernels of grazemap, compiled ahead of time for x86-64-v3"
license = "BSD-3-Clause"
dependencies = {dependencies}

[tool.hatch.build.targets.wheel]
packages = [{package}]

[tool.hatch.build.targets.wheel.hooks.custom]
path = "tag.py"
"""
# The machine code calls what numba links, so it runs where that runs.
_TAG = """from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Tag(BuildHookInterface):
    def initialize(self, version, build_data):
        build_data.update(pure_python=False, tag={tag})
"""


def compiled(folder: Path) -> Path:
    """Compile every step for x86-64-v3 below a folder; return where the kernels are."""
    environment = os.environ | PROCESSOR | {"NUMBA_CACHE_DIR": str(folder)}
    subprocess.run(module_command("grazemap_core.warmup"), env=environment, check=True)
    (kernels,) = folder.glob("kernels-*")
    return kernels


def write_project(folder: Path, kernels: Path) -> None:
    """Write what the wheel is built from."""
    package = folder / PACKAGE
    package.mkdir()
    shutil.copytree(kernels, package / kernels.name)
    (package / "__init__.py").write_text(_ABOUT, "utf-8")
    (package / MADE_FROM).write_text(json.dumps(made_from()), "utf-8")
    names = ("grazemap", "numba", "llvmlite", "numpy")
    dependencies = json.dumps([f"{name}=={version(name)}" for name in names])
    tags = [line for line in (distribution("numba").read_text("WHEEL") or "").splitlines() if line.startswith("Tag: ")]
    tag = json.dumps(tags[0].removeprefix("Tag: "))
    text = _PROJECT.format(
        version=json.dumps(version("grazemap")), dependencies=dependencies, package=json.dumps(PACKAGE)
    )
    (folder / "pyproject.toml").write_text(text, "utf-8")
    (folder / "tag.py").write_text(_TAG.format(tag=tag), "utf-8")


def main() -> None:
    """Build the wheel into the folder of the first argument."""
    into = Path(sys.argv[1] if len(sys.argv) > 1 else "dist").resolve()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_project(folder, compiled(folder / "cache"))
        subprocess.run([sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", into], cwd=folder, check=True)


if __name__ == "__main__":
    main()

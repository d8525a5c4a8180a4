"""A stack whose kernels are not compiled yet answers what it can, step by step."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from grazemap_core import kernel_folder
from tests.support.running_stack import MAP, RunningStack


def test_curves_are_answered_while_the_kernels_of_maps_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here, cache = kernel_folder.folder(), tmp_path / "cache"
    there = cache / "kernels" / "numba" / here.name
    there.mkdir(parents=True)
    cache.chmod(0o700)
    if kernel_folder.holds("curves"):  # those are compiled, which takes long
        for name in ("curves.kernels", *json.loads((here / "curves.kernels").read_bytes())):
            shutil.copy(here / name, there)
    monkeypatch.setenv("GRAZEMAP_CACHE_DIR", str(cache))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    stack = RunningStack("--data", str(tmp_path / "data"))
    try:
        of_map = stack.request("/v1/unfolding-maps", MAP)["id"]
        curve = {"omega": {"start": 0.27, "stop": 0.28, "points": 10}}
        stack.wait_for(stack.request("/v1/grazing-curves", curve)["id"], 300)
        job = stack.job(of_map)
        assert (job["status"], "kernels" in job["waiting_for"]) == ("accepted", True), job
    finally:
        stack.stop()

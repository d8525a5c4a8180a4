"""A stack whose kernels nobody has compiled yet answers what it can, step by step."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.running_stack import MAP, RunningStack


def test_curves_are_answered_while_the_kernels_of_maps_are_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GRAZEMAP_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    stack = RunningStack("--data", str(tmp_path / "data"))
    try:
        of_map = stack.request("/v1/unfolding-maps", MAP)["id"]
        curve = {"omega": {"start": 0.27, "stop": 0.28, "points": 10}}
        stack.wait_for(stack.request("/v1/grazing-curves", curve)["id"], 90)
        job = stack.job(of_map)
        assert (job["status"], "kernels" in job["waiting_for"]) == ("accepted", True), job
    finally:
        stack.stop()

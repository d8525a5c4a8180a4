"""Kernels for other numbers of masses: compiled once, in a process of its own, and said meanwhile."""

from __future__ import annotations

from pathlib import Path

import numba
import pytest
from watching import until

import grazemap_core  # noqa: F401 - chooses the folder of the kernels, which the tests change
from grazemap_worker.supervision import kernels as kernels_module
from grazemap_worker.supervision.kernels import WARM, Kernels


@pytest.fixture
def compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """The numbers of masses that were loaded here; nothing is compiled."""
    found: list[int] = []
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(kernels_module, "compile_maps", found.append)
    return found


def advance(kernels: Kernels) -> bool:
    until(kernels.advance, 30)
    return True


def test_only_kernels_of_maps_are_compiled(compiled: list[int]) -> None:
    kernels = Kernels()
    kernels.want([*WARM, "core", "maps-", "maps-x", "another"])
    assert not kernels.advance()
    assert kernels.said() == {}


def test_what_is_cached_is_loaded_at_once(compiled: list[int], tmp_path: Path) -> None:
    (tmp_path / "compiled-maps-5").touch()
    kernels = Kernels()
    kernels.want({"maps-5"})
    assert kernels.advance()
    assert compiled == [5]
    assert kernels.ready == {*WARM, "maps-5"}
    assert not kernels.advance()


def test_what_is_not_cached_is_compiled_in_another_process_first(tmp_path: Path, compiled: list[int]) -> None:
    kernels = Kernels()
    kernels.want({"maps-2", "maps-7"})
    assert not kernels.advance()
    assert kernels.said()["maps-2"] == "kernels for 2 masses, compiling for 0 s (about 30 s usually)"
    assert kernels.said()["maps-7"] == "kernels for 7 masses, after others"
    assert advance(kernels)
    assert compiled == [2]
    assert (tmp_path / "compiled-maps-2").exists()
    assert kernels.said().keys() == {"maps-7"}
    kernels.advance()
    kernels.stop()


def test_kernels_that_cannot_be_compiled_leave_it_to_the_tile_to_say_why(
    compiled: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(masses: int) -> None:
        raise ArithmeticError

    (tmp_path / "compiled-maps-5").touch()
    monkeypatch.setattr(kernels_module, "compile_maps", broken)
    kernels = Kernels()
    kernels.want({"maps-5"})
    assert kernels.advance()
    assert "maps-5" in kernels.ready

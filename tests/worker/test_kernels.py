"""Kernels for other numbers of masses: compiled once, in a process of its own, and said meanwhile."""

from __future__ import annotations

import multiprocessing
import operator
import os
import signal
from collections.abc import Callable
from pathlib import Path

import numba
import psutil
import pytest
from watching import living, until

import grazemap_core  # noqa: F401 - chooses the folder of the kernels, which the tests change
from grazemap_worker import progress
from grazemap_worker.supervision import kernel_cache
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


@pytest.fixture
def quick(compiled: list[int], monkeypatch: pytest.MonkeyPatch) -> Kernels:
    """Kernels that wait for a process that compiles nothing."""
    monkeypatch.setattr(kernels_module, "_compile", operator.add)
    kernels = Kernels()
    kernels.want({"maps-7"})
    assert not kernels.advance()
    return kernels


def test_the_end_of_the_process_is_noticed_though_the_supervisor_has_waited_for_it(quick: Kernels) -> None:
    assert quick._process is not None
    os.waitpid(quick._process.pid or 0, 0)
    assert advance(quick)
    assert "maps-7" in quick.ready


def test_a_process_that_is_stopped_while_it_compiles_is_replaced(
    quick: Kernels, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert quick._process is not None
    monkeypatch.setattr(progress, "HUNG_SECONDS", 0.5)
    stopped = psutil.Process(quick._process.pid)
    stopped.suspend()
    assert advance(quick)
    assert living([stopped]) == []


@pytest.mark.parametrize(
    ("function", "arguments"), [(kernels_module._compile, (3,)), (kernel_cache._help, ([], kernel_cache.WarmUp()))]
)
def test_processes_that_compile_end_with_their_supervisor(
    function: Callable[..., None], arguments: tuple[object, ...]
) -> None:
    context = multiprocessing.get_context("spawn")
    process = context.Process(target=function, args=(*arguments, os.getpid() + 1), daemon=True)
    process.start()  # of another process, as if that had ended meanwhile
    process.join(20)
    assert process.exitcode == -signal.SIGKILL


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

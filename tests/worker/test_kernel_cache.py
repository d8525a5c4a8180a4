"""The cache of compiled kernels: private, and rebuilt when it is broken."""

from __future__ import annotations

import multiprocessing
import os
import stat
from pathlib import Path
from threading import Event, Thread
from types import SimpleNamespace

import pytest
from watching import until

from grazemap_core import warmup  # here, not in the test: kernels keep to the cache that is set when they are imported
from grazemap_worker.supervision import kernel_cache


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("NUMBA_CACHE_DIR", "somewhere")
    found = kernel_cache.use_folder(tmp_path)
    (found / "numba").mkdir()
    return found


def broken_index(folder: Path) -> Path:
    index = folder / "numba" / "kernel.nbi"
    index.write_bytes(b"broken")
    return index


def test_the_folder_is_private_and_is_set_for_numba(folder: Path) -> None:
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder / "numba")


def test_a_link_to_another_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "kernels").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(kernel_cache.CacheFolderError):
        kernel_cache.use_folder(tmp_path)


def test_a_cache_that_raises_is_wiped_and_compiled_again(folder: Path) -> None:
    index = broken_index(folder)
    tries = []

    def compile_kernels() -> None:
        tries.append(index.exists())
        if index.exists():
            raise EOFError("broken")

    kernel_cache.warm_up(folder, compile_kernels, kernel_cache.WarmUp())
    assert tries == [True, False]


def test_kernels_that_do_not_compile_do_not_wipe_the_cache(folder: Path) -> None:
    def compile_kernels() -> None:
        raise TypeError("no such kernel")

    with pytest.raises(TypeError):
        kernel_cache.warm_up(folder, compile_kernels, kernel_cache.WarmUp())


def test_a_cache_with_which_two_warm_ups_died_is_wiped(folder: Path) -> None:
    index = broken_index(folder)
    seen = []

    def compile_kernels() -> None:
        seen.append(index.exists())
        if index.exists():
            os._exit(1)

    for expected in (1, 2):
        child = os.fork()
        if child == 0:
            kernel_cache.warm_up(folder, compile_kernels, kernel_cache.WarmUp())
        os.waitpid(child, 0)
        assert (folder / "warming-up").stat().st_size == expected
    kernel_cache.warm_up(folder, compile_kernels, kernel_cache.WarmUp())
    assert seen == [False]
    kernel_cache.warm_up(folder, lambda: None, kernel_cache.WarmUp())
    assert not (folder / "warming-up").exists()


@pytest.mark.parametrize(("cores", "cached", "alone"), [(2, False, False), (2, True, True), (1, False, True)])
def test_two_processes_compile_where_there_are_two_cores_and_nothing_is_cached(
    folder: Path, monkeypatch: pytest.MonkeyPatch, cores: int, cached: bool, alone: bool
) -> None:
    ran: list[tuple[str, ...]] = []
    started: list[tuple[list[str], object]] = []

    class Process:
        pid, exitcode = None, 0

        def __init__(self, target: object, args: tuple[list[str], object, int], daemon: bool) -> None:
            assert daemon
            started.append(args)

        def start(self) -> None: ...

    context = SimpleNamespace(Process=Process, Value=multiprocessing.get_context("spawn").Value)
    monkeypatch.setattr(warmup, "warm_up", lambda *parts: ran.append(parts))
    monkeypatch.setattr(kernel_cache.multiprocessing, "get_context", lambda _method: context)
    monkeypatch.setattr(kernel_cache, "available_cores", lambda: cores)
    (folder / "numba" / "a").mkdir(parents=True)
    if cached:
        (folder / "numba" / "a" / "kernel.nbi").touch()
    kernel_cache.compile_kernels(folder, kernel_cache.WarmUp())
    alone_in_parts = [("grazing",), ("trajectories",), ("orbits",), ("maps",), ()]
    assert ran == ([()] if cached else [("maps",), ()] if cores > 1 else alone_in_parts)
    helped = {part for parts, *_ in started for part in parts}
    assert bool(helped) != alone
    assert helped | {part for parts in ran for part in parts} == (set() if cached else set(warmup.PARTS))


def test_a_warm_up_says_its_step_and_the_seconds_that_are_left(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(kernel_cache.time, "monotonic", lambda: now[0])
    progress = kernel_cache.WarmUp()
    assert progress.text() == "loading the kernels, about 3 s"
    now[0] += 8.0
    assert progress.text() == "loading the kernels, for 8 s so far"
    progress.begin(["maps"])
    assert progress.text() == "compiling kernels, step 1 of 4, about 36 s"
    now[0] += 16.0  # the helper took twice as long as expected
    progress.finish(["grazing"])
    assert progress.text() == "compiling kernels, step 2 of 4, about 56 s"
    now[0] += 100.0
    assert progress.text() == "compiling kernels, step 2 of 4, about 1 s"


def test_a_warm_up_that_waits_says_for_which_process(folder: Path) -> None:
    holds, ended, waits = Event(), Event(), kernel_cache.WarmUp()

    def compile_kernels() -> None:
        holds.set()
        assert ended.wait(10)

    holder = Thread(target=kernel_cache.warm_up, args=(folder, compile_kernels, kernel_cache.WarmUp()))
    holder.start()
    assert holds.wait(10)
    waiter = Thread(target=kernel_cache.warm_up, args=(folder, lambda: None, waits))
    waiter.start()
    expected = f"waiting for another stack, process {os.getpid()}, that compiles the kernels"
    try:
        until(lambda: waits.text() == expected, 10)
    finally:
        ended.set()
        holder.join()
        waiter.join()
    assert waits.text() == "loading the kernels, about 3 s"


def test_the_parts_are_those_of_the_core() -> None:
    assert kernel_cache.SECONDS.keys() == warmup.PARTS.keys()

"""What a job says while its tile compiles kernels, and what is known of it afterwards."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba import types
from numba.extending import intrinsic
from planted import NUMERICS
from watching import until

from grazemap.codec import Document
from grazemap.wire import GrazingCurvesRequest, UnfoldingMapsRequest
from grazemap_core.numerics.jit.inlining import INTERPRETED
from grazemap_worker import said, tasks
from grazemap_worker.compiling import compiled_here, compiling_said, remember_compiled
from grazemap_worker.planning import Plan
from grazemap_worker.processes import Process
from grazemap_worker.processes.conversion import Report
from grazemap_worker.store import Store, core_version

pytestmark = pytest.mark.skipif(INTERPRETED, reason="nothing is compiled")


def new_function() -> object:
    """A function that is not compiled yet."""

    def total(values: tuple[float, ...]) -> float:
        result = 0.0
        for value in values:
            result += value
        return result

    return numba.njit(total)


def test_a_compilation_is_said_and_its_end_too() -> None:
    told: list[str] = []
    with compiling_said(told.append, 2):
        assert new_function()((1.0, 2.0)) == 3.0
        until(lambda: told[-1:] == [""], 5)
    assert told[0] == "kernels for 2 masses, compiling for 0 s (about 30 s usually)"
    assert told[-1] == ""


def test_what_is_compiled_already_is_not_said() -> None:
    function, told = new_function(), []
    assert function((1.0, 2.0)) == 3.0
    with compiling_said(told.append, 2):
        assert function((1.0, 2.0)) == 3.0
    assert told == []


def test_a_tile_that_compiles_says_so_in_its_job(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[str, str]] = []

    def computed(request: UnfoldingMapsRequest, report: Report) -> Document:
        new_function()((1.0,))
        return {"verified": np.array([True])}

    monkeypatch.setattr(store.jobs, "say_waiting", lambda *said: told.append(said))
    monkeypatch.setattr(tasks, "_context", tasks.Context(store, "w", NUMERICS))
    monkeypatch.setattr(tasks, "PROCESSES", {"unfolding-maps": Process(whole=computed)})
    request = UnfoldingMapsRequest(omega=[1, 2, 3], clearance=[1, 2])
    plan = Plan(rows=2, columns=3, tile_rows=2, tile_columns=3)
    job, _ = store.jobs.submit("unfolding-maps", request, core_version(), plan, 100)
    tasks.run_tile(job.id, 0)
    assert store.jobs.status(job.id) == "successful"
    assert told[0][0] == job.id
    assert told[0][1].startswith("kernels for 3 masses, ")
    assert told[-1] == (job.id, "")


def test_the_seconds_of_a_compilation_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(said, "_EVERY_SECONDS", 0.02)

    @intrinsic  # type: ignore[untyped-decorator]
    def slow(typing_context: Any) -> Any:
        time.sleep(1.2)
        return types.int64(), lambda context, builder, signature, arguments: context.get_constant(types.int64, 1)

    with compiling_said(told.append, 2):
        assert numba.njit(lambda: slow())() == 1
    assert any("compiling for 1 s" in text for text in told)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine on which only the warm-up has compiled."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kernels"))
    return tmp_path / "kernels"


def test_a_machine_remembers_for_which_chains_its_kernels_are_compiled(folder: Path) -> None:
    assert compiled_here() == {3}
    assert [remember_compiled(masses) for masses in (2, 3, 2, 12)] == [True, False, False, True]
    assert compiled_here() == {2, 3, 12}
    shutil.rmtree(folder)
    assert compiled_here() == {3}


def test_a_worker_that_computed_a_map_says_for_which_chain(
    store: Store, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tasks, "_context", tasks.Context(store, "w", NUMERICS))
    computed = Process(whole=lambda request, report: {"verified": np.array([True])})
    monkeypatch.setattr(tasks, "PROCESSES", dict.fromkeys(("unfolding-maps", "grazing-curves"), computed))
    store.workers.register("w", NUMERICS.fingerprint, 60, core_version())
    assert not store.workers.compiles_first(2, core_version())  # nothing is known
    store.workers.say_compiled(NUMERICS.fingerprint, compiled_here())
    two = {"masses": [1, 2], "stiffnesses": [1, 2], "forcing": [1, 0]}
    curve = GrazingCurvesRequest(oscillator=two, omega=[1, 2, 3])
    whole_map = UnfoldingMapsRequest(oscillator=two, omega=[1, 2, 3], clearance=[1, 2])
    for process, request, first in (("grazing-curves", curve, True), ("unfolding-maps", whole_map, False)):
        job, _ = store.jobs.submit(process, request, core_version(), Plan(), 100)
        tasks.run_tile(job.id, 0)
        assert store.jobs.status(job.id) == "successful"
        assert store.workers.compiles_first(2, core_version()) is first
    assert not store.workers.compiles_first(3, core_version())
    assert store.workers.compiles_first(4, core_version())


def test_nothing_is_said_after_the_block() -> None:
    told: list[str] = []
    with compiling_said(told.append, 1):
        new_function()((1.0,))
    assert told[0].startswith("kernels for 1 mass, ")
    length = len(told)
    new_function()((1.0,))
    time.sleep(0.05)
    assert len(told) == length

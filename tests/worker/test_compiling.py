"""What a job says while its tile compiles kernels."""

from __future__ import annotations

import time

import numba
import numpy as np
import pytest
from planted import NUMERICS
from watching import until

from grazemap.codec import Document
from grazemap.wire import UnfoldingMapsRequest
from grazemap_core.numerics.jit.inlining import INTERPRETED
from grazemap_worker import compiling, tasks
from grazemap_worker.compiling import compiling_said
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
    assert told[0] == f"kernels for 2 masses, about {compiling.SECONDS:.0f} s to compile"
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


def test_nothing_is_said_after_the_block() -> None:
    told: list[str] = []
    with compiling_said(told.append, 1):
        new_function()((1.0,))
    assert told[0].startswith("kernels for 1 mass, ")
    length = len(told)
    new_function()((1.0,))
    time.sleep(0.05)
    assert len(told) == length

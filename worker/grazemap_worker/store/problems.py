"""The problems of jobs that failed in the workers, as problem details after RFC 9457; they contain nothing internal."""

from __future__ import annotations

from grazemap.wire import Problem
from grazemap.wire.problems import make_problem
from grazemap_worker.planning import Plan
from grazemap_worker.store.keys import ASSEMBLY, MAX_EXCEPTIONS, MAX_LOST
from grazemap_worker.store.records import FailureKind


def failure_problem(kind: FailureKind, tile: int, plan: Plan, limit: str = "") -> Problem:
    """Return the problem of a job with a tile that failed too often; it names the part of the grid and the limit."""
    if tile == ASSEMBLY:
        where = "joining the finished tiles"
    elif plan.tile_count == 1:
        where = "the computation"
    else:
        row_start, row_stop, column_start, column_stop = plan.tile(tile)
        where = f"tile {tile} (clearance {row_start}:{row_stop}, omega {column_start}:{column_stop} of the grid)"
    if kind == "exception":
        name = "computation-failed"
        detail = f"{where} failed {MAX_EXCEPTIONS} times; the worker's log has the reason."
    elif kind == "timeout":
        name = "computation-too-long"
        detail = f"{where} took too long: {limit}. Ask for fewer points or periods."
    elif kind == "memory":
        name = "too-much-memory"
        detail = f"{where} needs more memory than a worker may take ({limit}): ask for fewer points or periods."
    elif kind == "hung":
        name = "computation-hung"
        detail = f"{where} made no progress in {MAX_EXCEPTIONS} attempts, {limit}; the workers' log has details."
    else:
        name = "worker-lost"
        detail = f"{where} lost its worker {MAX_LOST} times before it ended; the workers' log has details."
    return make_problem(name, detail[0].upper() + detail[1:])


def costly_problem(estimate: float, spent: float, limit: float) -> Problem:
    """Return the problem of a job that has taken more processor time than its limit; all arguments are in seconds."""
    detail = (
        f"The job was estimated to take {estimate:.3g} s of processor time and has taken {spent:.3g} s; its limit is "
        f"{limit:.3g} s. Its finished tiles are kept for a while: post the request again to go on, or ask for less."
    )
    return make_problem("too-much-time", detail)


OUTDATED_PROBLEM = make_problem("core-outdated")
"""The problem of a job whose core version no worker has any more."""
FULL_PROBLEM = make_problem("storage-full", "The store is too full for this result: dismiss other jobs, or try later.")
"""The problem of a job whose tiles or result do not fit into the store."""

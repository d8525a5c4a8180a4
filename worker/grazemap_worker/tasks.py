"""What RQ runs: one tile of a job.

In: a job's id and the number of a tile, from a queue. Out: the finished tile or result in the store, or the failure.
Nothing travels through RQ itself; an entry only says that the tile may be worth claiming.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ParamSpec

import structlog
from redis.exceptions import RedisError
from rq.timeouts import JobTimeoutException

from grazemap.codec import Document, decode_npz, encode_npz
from grazemap.schema import VERSION
from grazemap.wire import canonical
from grazemap_worker.numerics import Numerics
from grazemap_worker.processes import PROCESSES
from grazemap_worker.processes.conversion import Report, request_pointer
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import ASSEMBLY, Claim, ResultTooLarge, Store, core_version, is_away, refused_problem


@dataclass(frozen=True)
class Context:
    """Who computes: the store, the name under which tiles are held, and the numerics."""

    store: Store
    holder: str
    numerics: Numerics


class NotWanted(Exception):
    """Nobody waits for what is being computed any more."""


P = ParamSpec("P")

_context: Context | None = None


def enter(context: Context) -> None:
    """Say who computes in this process, before the first `run_tile`."""
    global _context
    _context = context


def run_tile(job_id: str, tile: int) -> None:
    """Compute a tile if it is still wanted and free, and the whole map after the last one.

    Raises
    ------
    RuntimeError
        `enter` was not called.
    redis.exceptions.RedisError
        The store is away; the ledger will offer the tile again.
    """
    if _context is None:
        raise RuntimeError("run_tile belongs in a worker")
    context: Context | None = _context
    number: int | None = tile
    while context is not None and number is not None:
        claim = context.store.claim(
            job_id, number, context.holder, context.numerics.fingerprint, LEASE_SECONDS, core_version()
        )
        if claim is None:
            return
        structlog.contextvars.bind_contextvars(job_id=job_id, tile=number)
        number = _run(claim, context)


def _run(claim: Claim, context: Context) -> int | None:
    """Do what was claimed; return what is to be claimed next (the assembly, after the last tile), if anything."""
    from grazemap_core.errors import CoreError

    store = context.store
    try:
        remaining = _compute(claim, context)
    except NotWanted:
        return None
    except JobTimeoutException:
        store.record_failure(claim.job_id, claim.tile, "timeout", "over its time", claim.holder)
        return None
    except ResultTooLarge as error:
        store.fail(claim.job_id, refused_problem(str(error)))
        return None
    except CoreError as error:
        pointer = request_pointer(claim.request, getattr(error, "name", None))
        store.fail(claim.job_id, refused_problem(str(error), pointer))
        return None
    except Exception as error:
        if isinstance(error, RedisError) and is_away(error):
            raise
        log = structlog.get_logger("grazemap_worker")
        verdict = store.record_failure(claim.job_id, claim.tile, "exception", type(error).__name__, claim.holder)
        log.exception("tile failed", process=claim.process, verdict=verdict)
        return None
    return ASSEMBLY if remaining == 0 and not claim.assembly else None


def _compute(claim: Claim, context: Context) -> int:
    """Compute and commit; return how many tiles remain (-1: nothing more is wanted)."""
    process, store = PROCESSES[claim.process], context.store
    meta = _meta(claim, context)
    if process.whole is not None:
        document, took = _clocked(process.whole, claim.request, _counted(claim, store))
        store.commit_result(claim.job_id, encode_npz(document, meta), claim.fingerprint, took)
        return -1
    if process.tile is None or process.assembled is None:
        raise TypeError(f"the process {claim.process} computes nothing")
    if claim.assembly:
        tiles, report = _finished_tiles(claim, store), _counted_after_tiles(claim, store)
        document, took = _clocked(process.assembled, claim.request, claim.plan, tiles, report)
        store.commit_result(claim.job_id, encode_npz(document, meta), claim.fingerprint, took)
        return -1
    row_start, row_stop, column_start, column_stop = claim.rectangle
    tile_meta = {"index": claim.tile, "rows": [row_start, row_stop], "columns": [column_start, column_stop]}
    document, took = _clocked(process.tile, claim.request, claim.rectangle)
    data = encode_npz(document, {**meta, "tile": tile_meta})
    return store.commit_tile(claim.job_id, claim.tile, data, claim.fingerprint, took)


def _clocked(compute: Callable[P, Document], *args: P.args, **kwargs: P.kwargs) -> tuple[Document, float]:
    """Return what is computed, and the processor seconds that it took."""
    began = time.thread_time()
    document = compute(*args, **kwargs)
    return document, time.thread_time() - began


def _counted(claim: Claim, store: Store) -> Report:
    """Return what takes the steps of a process to the store. It raises NotWanted when nobody waits for them."""

    def report(done: int, total: int) -> None:
        if not store.progress(claim.job_id, done, total):
            raise NotWanted(claim.job_id)

    return report


def _counted_after_tiles(claim: Claim, store: Store) -> Report:
    """Return the same for an assembly: its steps, however many, fill those that the plan has for it."""
    tiles, after = claim.plan.count, claim.plan.after
    told = 0

    def report(done: int, total: int) -> None:
        nonlocal told
        step = after * done // max(1, total)
        if after and step > told:
            told = step
            if not store.progress(claim.job_id, tiles + step, tiles + after):
                raise NotWanted(claim.job_id)

    return report


def _finished_tiles(claim: Claim, store: Store) -> list[Document]:
    documents = []
    for index, data in enumerate(store.tiles(claim.job_id, range(claim.plan.count))):
        if data is None:
            raise LookupError(f"tile {index} is not there")
        documents.append(decode_npz(data)[0])
    return documents


def _meta(claim: Claim, context: Context) -> dict[str, Any]:
    """Return what a result says about itself; no timings, so that the same question gives the same bytes."""
    return {
        "process": claim.process,
        "schema": VERSION,
        "request": canonical(claim.request),
        "core_version": claim.core_version,
        "numerics": context.numerics.as_meta(),
        "units": claim.request.oscillator.units,
    }

"""The task that RQ runs: one tile of a job.

Its input is a job's id and the number of a tile, from a queue; its output, in the store, the finished tile, the result
or the failure. An entry of the queue holds no data: it is a hint that the tile may be worth claiming.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import structlog
from redis.exceptions import RedisError
from rq.timeouts import JobTimeoutException

from grazemap.codec import Document, decode_npz, encode_npz
from grazemap.schema import VERSION, schema_of
from grazemap.schema.documents import add_deprecated
from grazemap.wire import notes_on
from grazemap_worker.compiling import compiling_said, remember_compiled
from grazemap_worker.numerics import Numerics
from grazemap_worker.planning import PLANNING
from grazemap_worker.processes import PROCESSES
from grazemap_worker.processes.conversion import Report, request_pointer
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import ASSEMBLY, Claim, ResultTooLarge, Store, core_version, is_away, refused_problem


@dataclass(frozen=True)
class Context:
    """The store, the name under which this process holds tiles, and its numerics."""

    store: Store
    holder: str
    numerics: Numerics


class NotWanted(Exception):
    """The job that is being computed was dismissed, or has ended."""


_context: Context | None = None


def enter(context: Context) -> None:
    """Set the context of this process, before the first `run_tile`."""
    global _context
    _context = context


def run_tile(job_id: str, tile: int) -> None:
    """Compute a tile if it is still wanted and free, and the whole map after the last one.

    Raises
    ------
    RuntimeError
        `enter` was not called.
    redis.exceptions.RedisError
        Redis is unavailable; the reconciler will queue the tile again.
    """
    if _context is None:
        raise RuntimeError("run_tile runs in a worker only")
    context: Context = _context
    number: int | None = tile
    while number is not None:
        claim = context.store.tiles.claim(
            job_id, number, context.holder, context.numerics.fingerprint, LEASE_SECONDS, core_version()
        )
        if claim is None:
            return
        structlog.contextvars.bind_contextvars(job_id=job_id, tile=number)
        number = _run(claim, context)


def _run(claim: Claim, context: Context) -> int | None:
    """Compute what was claimed; return the number to claim next (the assembly, after the last tile), if any."""
    from grazemap_core.errors import CoreError

    store = context.store
    try:
        masses = claim.request.oscillator.size
        with compiling_said(partial(store.jobs.say_waiting, claim.job_id), masses):
            remaining = _compute(claim, context)
        if PLANNING[claim.process].compiles:
            with suppress(OSError, RedisError):  # the tile is stored; only an estimate's note needs this
                if remember_compiled(masses):
                    store.workers.say_compiled(context.numerics.fingerprint, [masses])
    except NotWanted:
        return None
    except JobTimeoutException:
        store.tiles.record_failure(claim.job_id, claim.tile, "timeout", claim.holder)
        return None
    except ResultTooLarge as error:
        store.jobs.fail(claim.job_id, refused_problem(str(error)))
        return None
    except CoreError as error:
        pointer = request_pointer(claim.request, getattr(error, "name", None))
        store.jobs.fail(claim.job_id, refused_problem(str(error), pointer))
        return None
    except Exception as error:
        if isinstance(error, RedisError) and is_away(error):
            raise
        log = structlog.get_logger("grazemap_worker")
        verdict = store.tiles.record_failure(claim.job_id, claim.tile, "exception", claim.holder)
        log.exception("tile failed", process=claim.process, verdict=verdict)
        return None
    return ASSEMBLY if remaining == 0 and not claim.assembly else None


def _compute(claim: Claim, context: Context) -> int:
    """Compute and commit; return how many tiles remain (-1: nothing more is wanted)."""
    process, store = PROCESSES[claim.process], context.store
    if process.tile is not None and not claim.assembly:
        began = time.thread_time()
        document = process.tile(claim.request, claim.rectangle)
        took = time.thread_time() - began
        data = encode_npz(document, {**_meta(claim, context), "tile": claim.plan.place(claim.tile)})
        return store.tiles.commit(claim.job_id, claim.tile, data, claim.fingerprint, took)
    if process.assembled is not None:
        tiles, report = _finished_tiles(claim, store), _counted_after_tiles(claim, store)
        compute = partial(process.assembled, claim.request, claim.plan, tiles, report)
    elif process.whole is not None:
        compute = partial(process.whole, claim.request, _counted(claim, store))
    else:
        raise TypeError(f"the process {claim.process} computes nothing")
    began = time.thread_time()
    document = compute()
    took = time.thread_time() - began
    add_deprecated(schema_of(claim.process, document), document)
    notes = [note.model_dump() for note in notes_on(claim.request)]
    data = encode_npz(document, {**_meta(claim, context), "notes": notes})
    store.results.commit(claim.job_id, data, claim.fingerprint, took)
    return -1


def _counted(claim: Claim, store: Store) -> Report:
    """Return a function that stores the completed steps of a job; it raises NotWanted when the job has ended."""

    def report(done: int, total: int) -> None:
        if not store.jobs.progress(claim.job_id, done, total):
            raise NotWanted(claim.job_id)

    return report


def _counted_after_tiles(claim: Claim, store: Store) -> Report:
    """Return the same for an assembly, with its steps scaled to the number of them in the plan."""
    tiles, after, stored = claim.plan.count, claim.plan.after, _counted(claim, store)
    reported = 0

    def report(done: int, total: int) -> None:
        nonlocal reported
        step = after * done // max(1, total)
        if step > reported:
            reported = step
            stored(tiles + step, tiles + after)

    return report


def _finished_tiles(claim: Claim, store: Store) -> list[Document]:
    documents = []
    for index, data in enumerate(store.tiles.many(claim.job_id, range(claim.plan.count))):
        if data is None:
            raise LookupError(f"tile {index} is missing")
        documents.append(decode_npz(data)[0])
    return documents


def _meta(claim: Claim, context: Context) -> dict[str, Any]:
    """Return the metadata of a result: no timings, so that the same request gives the same bytes."""
    return {
        "process": claim.process,
        "schema": VERSION,
        "request": claim.canonical,
        "core_version": claim.core_version,
        "numerics": context.numerics.as_meta(),
        "units": claim.request.oscillator.units,
    }

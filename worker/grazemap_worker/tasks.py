"""What a worker does when a bell rings: it claims tiles, computes and commits them, until there are none to claim.

A tile's input is a request from the store, and its output, in the store, the finished tile, the result or the failure.
Small tiles are computed in the worker, several between two visits to the store; others in a process of their own, which
takes further ones until it has worked for as long as one should take. A process that computes a tile for long is
stopped while its worker computes short ones that wait.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import structlog
from redis.exceptions import RedisError

from grazemap.codec import Document, decode_npz, encode_npz
from grazemap.results import VERSION
from grazemap.wire import notes_on
from grazemap_worker.numerics import Numerics
from grazemap_worker.planning import LANE_WEIGHTS, SHORT_SECONDS, TILE_SECONDS, Lane
from grazemap_worker.processes import PROCESSES, Report
from grazemap_worker.processes.conversion import request_pointer
from grazemap_worker.queue import bells
from grazemap_worker.queue.horse import STORE_FULL, Horse, Now, Slate, memory_text
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import (
    ASSEMBLY,
    Claim,
    Finished,
    ResultTooLarge,
    Store,
    WorkerInfo,
    full_problem,
    is_away,
    is_full,
    refused_problem,
)

# Limits of the processor time of a tile: so many times its estimate, and some seconds more, but never over that of its
# lane. Estimates are true within a factor of 20.
CPU_FACTOR = 20.0
CPU_MORE = 60.0
CPU_MOST: dict[Lane, float] = {"small": 60.0, "short": 600.0, "long": 3600.0}
# The process of a tile that has computed for so long is stopped for short tiles that have waited for so long. Together
# the stopped one and they have the shares of long and short jobs.
STOPPED_AFTER_SECONDS = 2.0
WAITED_SECONDS = 1.5
_ASKED_SECONDS = 1.0
# Seconds between two attempts where the store is full.
STORE_FULL_SECONDS = 2.0
# Seconds between renewals of the lease while a process computes.
_RENEW_SECONDS = 0.5
# What a commit answers to what does not fit into the store.
_NO_SPACE = -2
# What it answers when the job has taken more than its limit of processor time.
_COSTLY = -3


@dataclass(frozen=True)
class Context:
    """What a worker computes its tiles with."""

    store: Store
    """The store."""
    worker: WorkerInfo
    """This worker."""
    numerics: Numerics
    """Its numerics."""
    memory_bytes: int = 2 << 30
    """What its tiles may allocate."""
    watched: Callable[[str], None] = lambda _: None
    """Is called with the job before a tile is computed in this process, and with an empty text after."""
    beat: Callable[[], None] = lambda: None
    """Is called every second or so."""
    stopping: Callable[[], bool] = lambda: False
    """Returns whether no further tile is to be claimed."""


class NotWanted(Exception):
    """The job that is being computed was dismissed, or has ended."""


def drain(context: Context) -> None:
    """Claim and compute tiles until none are left for this worker, or the store is full.

    Raises
    ------
    redis.exceptions.RedisError
        Redis is unavailable; what is claimed is given back when the lease runs out.
    """
    while not context.stopping():
        context.beat()
        try:
            claims = _claim_next(context)
            if not claims:
                return
            if context.worker.small:
                _compute_here(claims, context)
            else:
                _compute_apart(claims[0], context, _Interruptions(context))
        except RedisError as error:
            if not is_full(error):
                raise
            _give_back(context.store.tiles.claims_of(context.worker.name), context)
            return


def _claim_next(context: Context) -> list[Claim]:
    """Claim what is next: a number of small tiles, or one other; wake another worker if there is more."""
    store, worker = context.store, context.worker
    claims, more = store.tiles.claim_next(worker, LEASE_SECONDS)
    if more:
        bells.ring(store.redis, worker.fingerprint, small=worker.small)
    return claims


def _compute_here(claims: list[Claim], context: Context) -> None:
    """Compute small tiles and commit them together."""
    finished, renewed = [], time.monotonic()
    for claim in claims:
        if time.monotonic() - renewed > _RENEW_SECONDS:
            renewed = time.monotonic()
            context.store.workers.renew(context.worker, LEASE_SECONDS)
        context.watched(claim.job_id)
        done = _compute(claim, context)
        context.watched("")
        if done is not None:
            finished.append(done)
    if finished:
        _commit(finished, context)
    context.store.workers.renew(context.worker, LEASE_SECONDS)


def _give_back(lost: Iterable[tuple[str, int, str]], context: Context) -> None:
    """Free tiles whose results do not fit into the full store, uncounted, and wait a little."""
    structlog.get_logger("grazemap_worker").warning("the store is full")
    for job_id, tile, holder in lost:
        context.store.tiles.give_back(job_id, tile, holder)
    time.sleep(STORE_FULL_SECONDS)


class _Interruptions:
    """What a worker does while it has stopped the process of a tile that takes long: short tiles that wait."""

    def __init__(self, context: Context) -> None:
        self._context = context
        self._tile: Now | None = None
        self._not_before = 0.0

    def next(self, now: Now) -> Callable[[], None] | None:
        """Return what computes a tile, which is claimed, and others of its kind; None if none waits long enough."""
        if now != self._tile:
            self._tile, self._not_before = now, time.monotonic() + STOPPED_AFTER_SECONDS
        if time.monotonic() < self._not_before:
            return None
        self._not_before = time.monotonic() + _ASKED_SECONDS
        with suppress(RedisError):  # the tile goes on meanwhile
            claim = self._claim(now.job_id, WAITED_SECONDS)
            return None if claim is None else partial(self._compute, claim, now.job_id)
        return None

    def _claim(self, stopped: str, waited: float) -> Claim | None:
        return self._context.store.tiles.claim_beside(self._context.worker, LEASE_SECONDS, stopped, waited)

    def _compute(self, first: Claim, stopped: str) -> None:
        began = time.monotonic()
        claim: Claim | None = first
        while claim is not None:
            _compute_apart(claim, self._context)
            is_over = self._context.stopping() or time.monotonic() - began > SHORT_SECONDS
            claim = None if is_over else self._claim(stopped, 0.0)
        share = LANE_WEIGHTS["long"] / LANE_WEIGHTS["short"]
        self._not_before = time.monotonic() + share * (time.monotonic() - began)


def _compute_apart(claim: Claim, context: Context, interruptions: _Interruptions | None = None) -> None:
    """Compute and commit a tile in a process of its own.

    With interruptions it also computes others after it; without, it is itself one, and is moved to the long jobs when
    it takes as long as these.
    """
    store, worker = context.store, context.worker
    most = math.inf if interruptions else SHORT_SECONDS
    slate = Slate(_now(claim, 0.0, most))
    renewed = 0.0

    def wanted(job_id: str) -> bool:
        nonlocal renewed
        if time.monotonic() - renewed < _RENEW_SECONDS:
            return True
        renewed = time.monotonic()
        context.beat()
        try:
            return store.workers.renew(worker, LEASE_SECONDS, job_id)
        except RedisError:
            return True  # it goes on, and commits when Redis is back

    turn = partial(_take_turn, claim, context, slate, most)
    watched = Horse(turn, context.memory_bytes, slate)
    ended = watched.watch(wanted, interruptions.next) if interruptions else watched.watch(wanted)
    now = slate.read()
    if ended.kind == "timeout" and now.of_job:
        store.jobs.stop_costly(now.job_id)
    lost = store.tiles.claims_of(worker.name)
    if interruptions is None:  # the tile that is stopped is this worker's too
        lost = [one for one in lost if one[0] == claim.job_id]
    if ended.kind is not None:
        structlog.get_logger("grazemap_worker").warning(
            "process of a tile ended", lost=[one[:2] for one in lost], status=ended.status, kind=ended.kind
        )
    if ended.status == STORE_FULL:
        _give_back(lost, context)
        return
    for job_id, tile, holder in lost:
        if ended.kind == "timeout" and now.seconds == most:
            store.tiles.overran(job_id, tile, holder, most)
        else:
            store.tiles.record_failure(job_id, tile, ended.kind or "lost", holder, ended.limit)


def _now(claim: Claim, began: float, most: float) -> Now:
    """Return what a process does that begins to compute at `began` of its processor time, for so long at most."""
    limit = CPU_MOST["long" if claim.assembly else claim.lane]
    if not claim.assembly:
        limit = min(limit, CPU_MORE + CPU_FACTOR * claim.seconds)
    asked = getattr(claim.request, "time_limit", 0.0)  # a search that ends itself there
    limit = min(max(limit, asked and asked + CPU_MORE), most)
    return Now(claim.job_id, True, began, min(limit, claim.left_seconds), claim.left_seconds < limit)


def _take_turn(claim: Claim, context: Context, slate: Slate, most: float) -> int:
    """Compute and commit a tile in this process, and what comes next; return the exit status.

    It goes on until TILE_SECONDS are over or one fails. With a limit `most` of its seconds it computes no other job's.
    """
    following: Claim | None = claim
    try:
        while following is not None:
            now = _now(following, time.process_time(), most)
            slate.write(now)
            done = _compute(following, context)
            slate.write(now._replace(computing=False))
            following = _committed(done, context, alone=most < math.inf) if done is not None else None
    except RedisError as error:
        if not is_full(error):
            raise
        return STORE_FULL
    return 0


def _committed(done: Finished, context: Context, *, alone: bool) -> Claim | None:
    """Commit what was computed; claim what this process computes next: at once the assembly after a map's last tile."""
    store, worker = context.store, context.worker
    remaining = _commit([done], context)[0]
    if remaining == 0 and not done.whole:
        return store.tiles.claim(done.claim.job_id, ASSEMBLY, worker.name, worker.fingerprint, LEASE_SECONDS)
    if alone or time.process_time() > TILE_SECONDS or context.stopping():
        return None
    return next(iter(_claim_next(context)), None)


def _commit(finished: list[Finished], context: Context) -> list[int]:
    """Commit what was computed; return the tiles that remain of each job, or -1.

    A job whose result does not fit into the store fails, and so does one that has taken too much processor time.
    """
    try:
        answers = context.store.results.commit(finished)
    except RedisError as error:
        if is_away(error):
            raise
        for done in finished:
            _failed(done.claim, context)
        return [-1] * len(finished)
    for done, remaining in zip(finished, answers, strict=True):
        if remaining == _NO_SPACE:
            context.store.jobs.fail(done.claim.job_id, full_problem())
        elif remaining == _COSTLY:
            context.store.jobs.stop_costly(done.claim.job_id)
    return answers


def _compute(claim: Claim, context: Context) -> Finished | None:
    """Compute what was claimed; return None, with the failure stored, when that is not possible."""
    from grazemap_core.errors import CoreError

    store = context.store
    structlog.contextvars.bind_contextvars(job_id=claim.job_id, tile=claim.tile)
    try:
        return _computed(claim, context)
    except NotWanted:
        return None
    except ResultTooLarge as error:
        store.jobs.fail(claim.job_id, refused_problem(str(error)))
        return None
    except CoreError as error:
        pointer = request_pointer(claim.request, getattr(error, "name", None))
        store.jobs.fail(claim.job_id, refused_problem(str(error), pointer))
        return None
    except MemoryError:
        store.tiles.record_failure(claim.job_id, claim.tile, "memory", claim.holder, memory_text(context.memory_bytes))
        return None
    except Exception as error:
        if isinstance(error, RedisError) and is_away(error):
            raise
        _failed(claim, context)
        return None


def _failed(claim: Claim, context: Context) -> None:
    """Count and log the exception that is handled now."""
    verdict = context.store.tiles.record_failure(claim.job_id, claim.tile, "exception", claim.holder)
    structlog.get_logger("grazemap_worker").exception("tile failed", process=claim.process, verdict=verdict)


def _processor_seconds() -> float:
    """Return the processor time of this thread, and of the children that have ended."""
    times = os.times()
    return time.thread_time() + times.children_user + times.children_system


def _computed(claim: Claim, context: Context) -> Finished:
    """Return what was computed, and the processor time that it took."""
    process, store = PROCESSES[claim.process], context.store
    if process.tile is not None and not claim.assembly:
        began = _processor_seconds()
        document = process.tile(claim.request, claim.rectangle)
        took = _processor_seconds() - began
        data = encode_npz(document, {**_meta(claim, context), "tile": claim.plan.place(claim.tile)})
        return Finished(claim, data, took, whole=False)
    if process.assembled is not None:
        tiles, report = _finished_tiles(claim, store), _counted_after_tiles(claim, store)
        compute = partial(process.assembled, claim.request, claim.plan, tiles, report)
    elif process.whole is not None:
        compute = partial(process.whole, claim.request, _counted(claim, store))
    else:
        raise TypeError(f"the process {claim.process} computes nothing")
    began = _processor_seconds()
    document = compute()
    took = _processor_seconds() - began
    notes = [note.model_dump() for note in notes_on(claim.request)]
    data = encode_npz(document, {**_meta(claim, context), "notes": notes})
    return Finished(claim, data, took, lasting=process.lasting(document))


def _counted(claim: Claim, store: Store) -> Report:
    """Return a function that stores the completed steps of a job; it raises NotWanted when the job has ended.

    Those of small jobs are over before anyone could read them.
    """

    def report(done: int, total: int) -> None:
        if claim.lane == "small":
            return
        try:
            is_wanted = store.jobs.progress(claim.job_id, done, total)
        except RedisError as error:
            if not is_full(error):
                raise
            return  # the result may fit later
        if not is_wanted:
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

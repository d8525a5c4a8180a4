"""What a worker does after a wake-up: it claims, computes and commits tiles until there are none to claim.

>>> compute_waiting_tiles(worker_context)  # here the worker takes all tiles, and computes them in its own process
>>> worker_context.store.jobs.get(job.id).status
'successful'

A tile is computed from a request in the store. The finished tile, the result or the failure is written to the store.
A worker for small tiles computes the tiles itself, and commits several together. Any other worker forks a compute
process for a tile; the compute process goes on with further tiles until it has worked for `TILE_SECONDS`. While the
compute process computes a tile, its worker pauses it from time to time for short tiles that wait.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import structlog
from redis.exceptions import RedisError

from grazemap_worker.computation import Computation
from grazemap_worker.numerics import Numerics
from grazemap_worker.planning import LANE_WEIGHTS, SHORT_SECONDS, TILE_SECONDS, Lane
from grazemap_worker.processes import Report
from grazemap_worker.queue import wake_ups
from grazemap_worker.queue.compute_process import STORE_FULL_STATUS, Activity, ComputeProcess, SharedState, memory_text
from grazemap_worker.queue.tile_worker import StopWorker
from grazemap_worker.settings import LEASE_SECONDS
from grazemap_worker.store import (
    ASSEMBLY,
    FULL_PROBLEM,
    Claim,
    Finished,
    ResultTooLarge,
    Store,
    WaitingJob,
    WorkerInfo,
    is_away,
    is_full,
)

# A tile may take CPU_FACTOR times its estimated processor time plus EXTRA_CPU_SECONDS, but at most the maximum of its
# lane. Estimates are correct within a factor of 20.
CPU_FACTOR = 20.0
EXTRA_CPU_SECONDS = 60.0
MAX_CPU_SECONDS: dict[Lane, float] = {"small": 60.0, "short": 600.0, "long": 3600.0}
# A compute process that has computed a tile for STOPPED_AFTER_SECONDS is stopped for short tiles that have waited for
# WAITED_SECONDS. The long tile and the short ones get the shares of long and short jobs.
STOPPED_AFTER_SECONDS = 1.0
WAITED_SECONDS = 0.5
# Seconds between two attempts while the store is full.
STORE_FULL_SECONDS = 2.0
# Seconds between renewals of the lease while a process computes.
_RENEW_SECONDS = 0.5
# The answer of a commit when the tile or result does not fit into the store.
_NO_SPACE = -2
# The answer of a commit when the job has taken more than its limit of processor time.
_COSTLY = -3


@dataclass(frozen=True)
class WorkerContext:
    """What a worker needs to compute tiles."""

    store: Store
    """The store."""
    worker: WorkerInfo
    """This worker."""
    numerics: Numerics
    """Its numerics."""
    memory_bytes: int = 2 << 30
    """Bytes that the computation of a tile may allocate."""
    report_small_tile: Callable[[str], None] = lambda _: None
    """Called with the job id before this process computes a small tile, and with an empty text afterwards."""
    report_job: Callable[[WaitingJob], None] = lambda _: None
    """Called with the job of claimed tiles before they are computed."""
    beat: Callable[[], None] = lambda: None
    """Called about once a second; it tells the supervisor that the worker is alive."""
    stopping: Callable[[], bool] = lambda: False
    """Returns whether the worker is to claim no further tile."""


class UnwantedJob(Exception):
    """The job that is being computed was dismissed, or has ended."""


def compute_waiting_tiles(context: WorkerContext) -> None:
    """Claim and compute tiles until none are left for this worker. If Redis is full, give the tiles back.

    Raises
    ------
    redis.exceptions.RedisError
        Redis is unavailable. The claimed tiles become free when the lease runs out.
    """
    while not context.stopping():
        context.beat()
        try:
            claims = _claim_next(context)
            if not claims:
                if not _free_unknown(context):
                    return
                continue
            context.report_job(WaitingJob(claims[0].process, claims[0].job_id))
            if context.worker.small:
                _compute_small(claims, context)
            else:
                _compute_in_process(claims[0], context, _Interruptions(context))
        except RedisError as error:
            if not is_full(error):
                raise
            _give_back(context.store.tiles.claims_of(context.worker.name), context)
            return


def _claim_next(context: WorkerContext) -> list[Claim]:
    """Claim the next tiles: several small ones, or one tile of another lane; wake another worker if more tiles wait."""
    store, worker = context.store, context.worker
    claims, waiting = store.tiles.claim_next(worker, LEASE_SECONDS)
    if waiting is not None:
        wake_ups.wake_worker(store.redis, worker.fingerprint, waiting, small=worker.small)
    return claims


def _free_unknown(context: WorkerContext) -> bool:
    """Free tiles that this worker holds while it computes none, and return whether there were any.

    The answer to a claim was lost, and the claim was sent again.
    """
    unknown = context.store.tiles.claims_of(context.worker.name)
    _free(unknown, context)
    return bool(unknown)


def _compute_small(claims: list[Claim], context: WorkerContext) -> None:
    """Compute small tiles and commit them together."""
    finished, renewed = [], time.monotonic()
    for claim in claims:
        if time.monotonic() - renewed > _RENEW_SECONDS:
            renewed = time.monotonic()
            context.store.workers.renew(context.worker, LEASE_SECONDS)
        context.report_small_tile(claim.job_id)
        try:
            result = _compute(claim, context)
        finally:
            context.report_small_tile("")
        if result is not None:
            finished.append(result)
    if finished:
        _commit(finished, context)
    context.store.workers.renew(context.worker, LEASE_SECONDS)


def _give_back(lost: Iterable[tuple[str, int, str]], context: WorkerContext) -> None:
    """Free tiles that could not be stored because the store is full, without counting a failure; then wait a little."""
    structlog.get_logger("grazemap_worker").warning("the store is full")
    _free(lost, context)
    time.sleep(STORE_FULL_SECONDS)


def _free(claims: Iterable[tuple[str, int, str]], context: WorkerContext) -> None:
    for job_id, tile, holder in claims:
        context.store.tiles.give_back(job_id, tile, holder)


class _Interruptions:
    """The short tiles that a worker computes while the compute process of a long tile is paused."""

    def __init__(self, context: WorkerContext) -> None:
        self._context = context
        self._activity: Activity | None = None
        self._not_before = 0.0

    def next(self, activity: Activity) -> Callable[[], None] | None:
        """Claim a short tile, and return a function that computes it and further ones; None if none waits long enough.

        `activity` is that of the compute process, which is to be paused while the function runs.
        """
        if activity != self._activity:
            self._activity, self._not_before = activity, time.monotonic() + STOPPED_AFTER_SECONDS
        if time.monotonic() < self._not_before:
            return None
        with suppress(RedisError):  # the compute process goes on meanwhile
            self._free_others(activity.job_id)
            claim = self._claim(activity.job_id, WAITED_SECONDS)
            return None if claim is None else partial(self._compute, claim, activity.job_id)
        return None

    def _claim(self, paused_job: str, min_wait_seconds: float) -> Claim | None:
        tiles, worker = self._context.store.tiles, self._context.worker
        return tiles.claim_beside(worker, LEASE_SECONDS, paused_job, min_wait_seconds)

    def _free_others(self, paused_job: str) -> None:
        """Free the tiles of other jobs, which Redis could not be told of when they ended, or when they were claimed."""
        claimed = self._context.store.tiles.claims_of(self._context.worker.name)
        _free((claim for claim in claimed if claim[0] != paused_job), self._context)

    def _compute(self, first: Claim, paused_job: str) -> None:
        began = time.monotonic()
        claim: Claim | None = first
        with suppress(RedisError):  # the paused process is not lost with a short tile
            while claim is not None:
                _compute_in_process(claim, self._context)
                self._context.beat()
                is_over = self._context.stopping() or time.monotonic() - began > SHORT_SECONDS
                claim = None if is_over else self._claim(paused_job, 0.0)
        share = LANE_WEIGHTS["long"] / LANE_WEIGHTS["short"]
        self._not_before = time.monotonic() + share * (time.monotonic() - began)


def _compute_in_process(claim: Claim, context: WorkerContext, interruptions: _Interruptions | None = None) -> None:
    """Compute and commit a tile in a compute process.

    With `interruptions`, the process also computes tiles after this one. Without, this tile is a short one that
    interrupts a long one: no other follows, and its job is moved to the long jobs if it takes over `SHORT_SECONDS`.
    """
    store, worker = context.store, context.worker
    max_seconds = math.inf if interruptions else SHORT_SECONDS
    state = SharedState(_activity(claim, 0.0, max_seconds))
    renewed = 0.0

    def is_wanted(job_id: str) -> bool:
        nonlocal renewed
        if time.monotonic() - renewed < _RENEW_SECONDS:
            return True
        renewed = time.monotonic()
        try:
            context.beat()
        except StopWorker:
            if job_id:
                raise
            # the process may finish storing
        try:
            return store.workers.renew(worker, LEASE_SECONDS, job_id)
        except RedisError:
            return True  # the process goes on, and commits when Redis is back

    run = partial(_run_tiles, claim, context, state, max_seconds)
    process = ComputeProcess(run, context.memory_bytes, state)
    end = process.watch(is_wanted, interruptions.next if interruptions else None)
    activity = state.read()
    if end.kind == "timeout" and activity.limited_by_job:
        store.jobs.end_costly(activity.job_id)
    lost = store.tiles.claims_of(worker.name)
    if interruptions is None:  # this worker also holds the tile of the compute process that is paused
        lost = [claimed for claimed in lost if claimed[0] == claim.job_id]
    if end.kind is not None:
        structlog.get_logger("grazemap_worker").warning(
            "process of a tile ended", lost=[claimed[:2] for claimed in lost], status=end.status, kind=end.kind
        )
    if end.status == STORE_FULL_STATUS:
        _give_back(lost, context)
        return
    for job_id, tile, holder in lost:
        if end.kind == "timeout" and activity.max_seconds == max_seconds:
            store.tiles.move_to_next_lane(job_id, tile, holder, max_seconds)
        else:
            store.tiles.record_failure(job_id, tile, end.kind or "lost", holder, end.limit)


def _activity(claim: Claim, began: float, max_seconds: float) -> Activity:
    """Return the activity of a process that begins a tile when its processor time is `began`, with its limit."""
    limit = MAX_CPU_SECONDS["long" if claim.assembly else claim.lane]
    if not claim.assembly:
        limit = min(limit, EXTRA_CPU_SECONDS + CPU_FACTOR * claim.plan.tile_seconds)
    time_limit = getattr(claim.request, "time_limit", 0.0)  # of a search that ends by itself after this time
    limit = min(max(limit, time_limit and time_limit + EXTRA_CPU_SECONDS), max_seconds)
    return Activity(claim.job_id, True, began, min(limit, claim.left_seconds), claim.left_seconds < limit)


def _run_tiles(claim: Claim, context: WorkerContext, state: SharedState, max_seconds: float) -> int:
    """Compute and commit a tile in this process, then further ones; return the exit status.

    It goes on until TILE_SECONDS have passed or a tile fails. A finite `max_seconds` limits the processor time of a
    tile; then the only further step is the assembly of the same job.
    """
    following: Claim | None = claim
    try:
        while following is not None:
            activity = _activity(following, time.process_time(), max_seconds)
            state.write(activity)
            finished = _compute(following, context)
            state.write(activity._replace(computing=False))
            following = (
                _commit_and_claim(finished, context, one_job=max_seconds < math.inf) if finished is not None else None
            )
    except RedisError as error:
        if not is_full(error):
            raise
        return STORE_FULL_STATUS
    return 0


def _commit_and_claim(finished: Finished, context: WorkerContext, *, one_job: bool) -> Claim | None:
    """Commit a tile or a result, and claim what this process computes next; None: nothing.

    After the last tile of a map, that is the assembly of the map. With `one_job`, it is nothing else.
    """
    store, worker = context.store, context.worker
    remaining = _commit([finished], context)[0]
    if remaining == 0 and not finished.whole:
        return store.tiles.claim(finished.claim.job_id, ASSEMBLY, worker.name, worker.fingerprint, LEASE_SECONDS)
    if one_job or time.process_time() > TILE_SECONDS or context.stopping():
        return None
    return next(iter(_claim_next(context)), None)


def _commit(finished: list[Finished], context: WorkerContext) -> list[int]:
    """Commit tiles and results; return for each the number of tiles that remain of its job, or a negative number.

    The negative numbers are those of `Results.commit`. A job fails if its result does not fit into the store, or if it
    has taken too much processor time.
    """
    try:
        answers = context.store.results.commit(finished)
    except RedisError as error:
        if is_away(error):
            raise
        for result in finished:
            _record_exception(result.claim, context)
        return [-1] * len(finished)
    for result, remaining in zip(finished, answers, strict=True):
        if remaining == _NO_SPACE:
            context.store.jobs.fail(result.claim.job_id, FULL_PROBLEM)
        elif remaining == _COSTLY:
            context.store.jobs.end_costly(result.claim.job_id)
    return answers


def _compute(claim: Claim, context: WorkerContext) -> Finished | None:
    """Compute a claimed tile; when that fails, store the failure and return None."""
    from grazemap_core.errors import CoreError

    store = context.store
    structlog.contextvars.bind_contextvars(job_id=claim.job_id, tile=claim.tile)
    try:
        return _compute_or_raise(claim, context)
    except UnwantedJob:
        return None
    except (CoreError, ResultTooLarge) as error:
        store.jobs.fail(claim.job_id, _computation(claim, context).refusal(error))
        return None
    except MemoryError:
        store.tiles.record_failure(claim.job_id, claim.tile, "memory", claim.holder, memory_text(context.memory_bytes))
        return None
    except Exception as error:
        if isinstance(error, RedisError) and is_away(error):
            raise
        _record_exception(claim, context)
        return None


def _record_exception(claim: Claim, context: WorkerContext) -> None:
    """Count and log the exception that is being handled as a failure of a tile."""
    verdict = context.store.tiles.record_failure(claim.job_id, claim.tile, "exception", claim.holder)
    structlog.get_logger("grazemap_worker").exception("tile failed", process=claim.process, verdict=verdict)


def _compute_or_raise(claim: Claim, context: WorkerContext) -> Finished:
    """Return the finished tile, or the result of the whole job, with the processor time that it took."""
    computation, store = _computation(claim, context), context.store
    if computation.has_tiles and not claim.assembly:
        tile = computation.tile(claim.tile)
        return Finished(claim, tile.data, tile.seconds, whole=False)
    if computation.has_tiles:
        result = computation.result(_finished_tiles(claim, store), _assembly_progress_report(claim, store))
    else:
        result = computation.result([], _progress_report(claim, store))
    return Finished(claim, result.data, result.seconds, lasting=result.lasting)


def _computation(claim: Claim, context: WorkerContext) -> Computation:
    return Computation(claim.request, claim.canonical, claim.plan, claim.core_version, context.numerics)


def _progress_report(claim: Claim, store: Store) -> Report:
    """Return a function that stores how many steps of a job are done; it raises UnwantedJob when the job has ended.

    For a small job it stores nothing: the job ends before anyone could read it.
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
            raise UnwantedJob(claim.job_id)

    return report


def _assembly_progress_report(claim: Claim, store: Store) -> Report:
    """Return a function that stores the progress of an assembly, scaled to the plan's steps after the tiles."""
    tiles, after, store_progress = claim.plan.tile_count, claim.plan.after, _progress_report(claim, store)
    reported = 0

    def report(done: int, total: int) -> None:
        nonlocal reported
        step = after * done // max(1, total)
        if step > reported:
            reported = step
            store_progress(tiles + step, tiles + after)

    return report


def _finished_tiles(claim: Claim, store: Store) -> Iterator[bytes]:
    for index, data in enumerate(store.tiles.many(claim.job_id, range(claim.plan.tile_count))):
        if data is None:
            raise LookupError(f"tile {index} is missing")
        yield data

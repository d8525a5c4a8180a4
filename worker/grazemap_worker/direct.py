"""Computation without a service: the tiles of a request on any executor, and from a folder that keeps finished tiles.

>>> with Direct() as direct:  # the processes of this machine
...     data = direct.compute(request, listen)  # the npz that a service has for the request

The functions that compute, plan and join are those of the workers (`computation`). A tile is computed by `tile_of`, and
a result without tiles by `result_of`; both take texts and bytes, so that any executor can send them anywhere.
"""

from __future__ import annotations

import json
import os
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple, Self

from grazemap.errors import ComputationError
from grazemap.wire import Problem, ProcessRequest, parse_request
from grazemap_worker.checkpoint import Checkpoint
from grazemap_worker.computation import Computation, Computed
from grazemap_worker.environment import ONE_THREAD, available_cores, default_cache_dir
from grazemap_worker.processes import kernels_of
from grazemap_worker.supervision import kernel_cache

Listen = Callable[[str, dict[str, Any]], object]
"""Called with the name and the data of an event of a job, as clients of a service get them: "waiting", "progress"."""
# A process of the pool that ends, for example because it is killed, is replaced, and its tile is computed again, but
# not more often than this.
_MAX_LOST = 3
# Seconds between two looks at processes that compile kernels.
_LOOK_SECONDS = 0.05
# Of many requests, at most so many are computed before the first of them is taken.
_MOST_AHEAD = 1000


def _nobody(*_: object) -> None:
    """Listen to nothing."""


class _Part(NamedTuple):
    """A tile or a result from some process."""

    fingerprint: str
    """Fingerprint of the numerics of the process that computed it."""
    outcome: bytes | Problem
    """The npz, or the problem of a request that the core cannot compute."""


class Direct:
    """Computes requests by an executor; a context manager that ends the processes which it has started.

    Parameters
    ----------
    executor : Executor, optional
        Computes the tiles, and what follows them. It must be able to send a function of this package and bytes to its
        processes. Left out: a process for each core of this machine computes tiles, and this process what follows them.
    """

    def __init__(self, executor: Executor | None = None) -> None:
        self._executor = executor
        self._pool: Any = None
        self._size = 0

    def compute(self, request: ProcessRequest, listen: Listen, folder: Path | None = None) -> bytes | Problem:
        """Return the npz of the result of a request, or the problem why the core cannot compute it.

        Parameters
        ----------
        request : ProcessRequest
        listen : callable
        folder : Path, optional
            Keeps the finished tiles; those that it has are not computed again.

        Raises
        ------
        CheckpointError
            The folder is that of another request, or of another version.
        ComputationError
            Processes of the executor ended, or they differ.
        """
        process, text = _as_text(request)
        computation = _computation(process, text)
        checkpoint = None if folder is None else Checkpoint.create(folder, computation)
        if self._executor is None:
            _compile_kernels(kernels_of(process, request), listen)
        try:
            tiles = self._tiles(computation, text, listen, checkpoint) if computation.has_tiles else []
            if isinstance(tiles, Problem):
                return tiles
            if self._executor is None:
                return _result(computation, tiles, listen).outcome
            return self._executor.submit(result_of, process, text, tiles).result().outcome
        except BrokenExecutor as error:
            kept = "" if checkpoint is None else f"; the finished tiles are in {folder}"
            raise ComputationError(f"processes that computed have ended ({error}){kept}") from error

    def each(self, requests: Sequence[ProcessRequest]) -> Iterator[bytes | Problem]:
        """Yield what `compute` returns for each request. Requests without tiles are computed side by side."""
        if len(requests) == 1:
            yield self.compute(requests[0], _nobody)
            return
        waiting: deque[tuple[ProcessRequest, Future[_Part] | None]] = deque()
        for request in requests:
            process, text = _as_text(request)
            future = None
            if not _computation(process, text).has_tiles:
                if self._executor is None:
                    _compile_kernels(kernels_of(process, request))
                future = self._executor_for(len(requests)).submit(result_of, process, text, ())
            waiting.append((request, future))
            if len(waiting) >= _MOST_AHEAD:
                yield self._outcome(*waiting.popleft())
        while waiting:
            yield self._outcome(*waiting.popleft())

    def _outcome(self, request: ProcessRequest, future: Future[_Part] | None) -> bytes | Problem:
        if future is None:
            return self.compute(request, _nobody)
        try:
            return future.result().outcome
        except BrokenExecutor:  # with its process: once more
            if self._executor is None:
                self.close()
            return self.compute(request, _nobody)

    def _tiles(
        self, computation: Computation, text: str, listen: Listen, checkpoint: Checkpoint | None
    ) -> list[bytes] | Problem:
        """Return the tiles of a request, in the order of its plan, or the problem of one of them."""
        plan, fingerprint, began = computation.plan, computation.numerics.fingerprint, time.monotonic()
        count, total = plan.tile_count, plan.tile_count + plan.after
        tiles = {index: data for index in range(count) if checkpoint and (data := checkpoint.tile(index, fingerprint))}
        before, kinds, lost = len(tiles), {fingerprint} if tiles else set[str](), Counter[int]()
        missing = [index for index in range(count) if index not in tiles]
        executor = self._executor_for(len(missing))
        running: dict[Future[_Part], int] = {}
        try:
            while missing or running:
                for index in missing:
                    running[executor.submit(tile_of, computation.process, text, index)] = index
                missing = []
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                if self._executor is None and any(_is_lost(future) for future in done):
                    done, _ = wait(running)  # a pool that lost a process ends, and all that it computed is lost
                    self.close()
                    executor = self._executor_for(len(running))
                for future in done:
                    index = running.pop(future)
                    if self._executor is None and _is_lost(future) and lost[index] < _MAX_LOST:
                        lost[index] += 1
                        missing.append(index)
                        continue
                    part = future.result()
                    if isinstance(part.outcome, Problem):
                        return part.outcome
                    kinds.add(part.fingerprint)
                    if len(kinds) > 1:
                        raise ComputationError(
                            "the tiles of a result must be computed by processes of one kind, with the same libraries "
                            "and instructions of the processor (NUMBA_CPU_NAME)"
                        )
                    tiles[index] = part.outcome
                    if checkpoint is not None:
                        checkpoint.write(index, part.fingerprint, part.outcome)
                    spent, computed = time.monotonic() - began, len(tiles) - before
                    left = spent * (count - len(tiles)) / computed
                    listen("progress", {"done": len(tiles), "total": total, "eta_seconds": left})
        finally:
            for future in running:
                future.cancel()
        return [tiles[index] for index in range(count)]

    def _executor_for(self, count: int) -> Any:
        """Return the executor for so many tiles or results: that which was given, or a pool that is large enough."""
        if self._executor is not None:
            return self._executor
        size = min(count, available_cores())
        if self._pool is None or self._size < size:
            self.close()
            self._pool, self._size = _pool(size), size
        return self._pool

    def close(self) -> None:
        """End the processes of the pool; an executor that was given goes on."""
        if self._pool is not None:
            self._pool.shutdown(kill_workers=True)
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _is_lost(future: Future[_Part]) -> bool:
    return isinstance(future.exception(), BrokenExecutor)


def _pool(size: int) -> Any:
    """Return a pool of processes whose libraries use one thread each."""
    # it replaces none of the user's modules and needs no guard around the main program of a script
    from loky import ProcessPoolExecutor  # type: ignore[import-untyped]

    from grazemap_core import kernel_folder

    environment = {**dict.fromkeys(ONE_THREAD, "1"), **kernel_folder.environment()}
    return ProcessPoolExecutor(size, env=environment)


def tile_of(process: str, text: str, index: int) -> _Part:
    """Compute a tile of a request, whose text is JSON, in this process."""
    computation = _computation(process, text)
    return _part(computation, lambda: computation.tile(index))


def result_of(process: str, text: str, tiles: Sequence[bytes]) -> _Part:
    """Compute the result of a request in this process, from its tiles, if it has tiles."""
    return _result(_computation(process, text), tiles)


def _result(computation: Computation, tiles: Sequence[bytes], listen: Listen = _nobody) -> _Part:
    count, after = len(tiles), computation.plan.after

    def report(done: int, total: int) -> None:
        if count:
            done, total = count + after * done // max(1, total), count + after
        listen("progress", {"done": done, "total": total})

    return _part(computation, lambda: computation.result(tiles, report))


def _part(computation: Computation, compute: Callable[[], Computed]) -> _Part:
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    from grazemap_core.errors import CoreError

    _load_kernels(kernels_of(computation.process, computation.request))
    try:
        with threadpool_limits(1):  # the bytes must not depend on the number of cores
            return _Part(computation.numerics.fingerprint, compute().data)
    except CoreError as error:
        return _Part(computation.numerics.fingerprint, computation.refusal(error))


def _as_text(request: ProcessRequest) -> tuple[str, str]:
    """Return the process of a request, and the request as JSON."""
    return request.operation.process, json.dumps(request.canonical(), allow_nan=False)


@lru_cache(maxsize=4)
def _computation(process: str, text: str) -> Computation:
    _use_kernel_folder()
    return Computation.of(parse_request(process, json.loads(text)))


@cache
def _use_kernel_folder() -> None:
    """Have kernels stored where those of a stack are, whatever folder other functions of this process are cached in."""
    from grazemap_core import kernel_folder

    if "NUMBA_CACHE_DIR" not in os.environ:
        root = Path(os.environ.get("GRAZEMAP_CACHE_DIR") or default_cache_dir())
        kernel_folder.choose_folder(kernel_cache.private_folder(root))


def _compile_kernels(step: str, listen: Listen = _nobody) -> None:
    """Compile what is missing of the kernels of a step; of several processes that need it, one does."""
    _use_kernel_folder()
    from grazemap_core import kernel_folder, warmup

    def say(reason: str | None) -> None:
        listen("waiting", {"waiting_for": reason})

    if all(map(kernel_folder.holds, warmup.components_of(step))):
        return
    from grazemap_worker.supervision.kernels import Kernels

    with kernel_cache.one_compiles(kernel_folder.folder(), lambda: say("another process, which compiles kernels")):
        kernels = Kernels([step], load=False)
        while step not in kernels.ready:
            kernels.look()
            kernels.advance()
            say(kernels.status_texts().get(step))
            time.sleep(_LOOK_SECONDS)
    say(None)


@cache
def _load_kernels(step: str) -> None:
    """Load the kernels of a step, and compile first what is missing."""
    _compile_kernels(step)
    from grazemap_core import warmup

    warmup.load(step)

"""Computation without a service: the tiles of a request on any executor, and from a folder that keeps finished tiles.

>>> with Direct() as direct:  # the processes of this machine
...     data = direct.compute(request, listen)  # the npz that a service has for the request

The functions that compute, plan and join are those of the workers (`computation`). A tile is computed by `tile_of`, and
a result by `result_of`; both take texts and bytes, so that any executor can send them anywhere. This process plans, and
computes nothing.
"""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager
from functools import cache, lru_cache
from pathlib import Path
from typing import IO, Any, NamedTuple, Self, cast

from grazemap.errors import CheckpointError, ComputationError, problem_text
from grazemap.wire import Problem, ProcessRequest, parse_request
from grazemap_worker.checkpoint import Checkpoint
from grazemap_worker.computation import Computation, Computed
from grazemap_worker.environment import ONE_THREAD, usable_cache_dir
from grazemap_worker.planning.kernel_steps import components_of
from grazemap_worker.processes import kernels_of
from grazemap_worker.supervision import kernel_cache
from grazemap_worker.system import available_cores

Listen = Callable[[str, dict[str, Any]], object]
"""Called with the name and the data of an event of a job, as clients of a service get them: "waiting", "progress"."""
# The processes of a pool are replaced when one of them ends, for example because it is killed, but not more often than
# this without a tile that is finished in between.
_MOST_LOSSES = 3
# Seconds between two looks at processes that compile kernels, and at the steps of a result.
_LOOK_SECONDS = 0.05
# Seconds between two reports of a process of the pool, and between its looks whether its parent lives.
_REPORT_SECONDS = 0.2
_PARENT_SECONDS = 1.0
# Of many requests, at most so many are computed before the first of them is taken.
_MOST_AHEAD = 1000


def _nobody(*_: object) -> None:
    """Listen to nothing."""


class Kind(NamedTuple):
    """What must be equal in all processes that compute parts of a result."""

    core_version: str
    """Version of the core."""
    fingerprint: str
    """Fingerprint of the numerics."""


class _Part(NamedTuple):
    """A tile or a result from some process."""

    kind: Kind
    """The process."""
    outcome: bytes | Problem
    """The npz, or the problem of a request that the core cannot compute."""


class _Waiting(NamedTuple):
    """A result without tiles that is being computed."""

    process: str
    """Name of the process."""
    text: str
    """The request as JSON."""
    kind: Kind
    """What must compute it."""
    future: Future[_Part]
    """The result."""


@contextmanager
def _failures_named(kept: str = "") -> Iterator[None]:
    """Raise ComputationError in place of what an executor raises; `kept` says what is left."""
    try:
        yield
    except (ComputationError, OSError):
        raise
    except Exception as error:
        raise ComputationError(f"the executor failed: {error!r}{kept}") from error


class Direct:
    """Computes requests by an executor; a context manager that ends the processes which it has started.

    Parameters
    ----------
    executor : Executor, optional
        Computes the tiles, and what follows them. It must be able to send a function of this package and bytes to its
        processes. Left out: a pool of processes of this machine, one for each core.
    """

    def __init__(self, executor: Executor | None = None) -> None:
        self._executor = executor
        self._pool: _Pool | None = None

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
        with _failures_named("" if folder is None else f"; the finished tiles are in {folder}"):
            kind = self._prepared(kernels_of(process, request), listen)
            tiles = self._tiles(computation, text, kind, listen, checkpoint)
            return tiles if isinstance(tiles, Problem) else self._result(process, text, tiles, kind, listen)

    def each(self, requests: Sequence[ProcessRequest]) -> Iterator[bytes | Problem]:
        """Yield what `compute` returns for each request.

        Requests without tiles that follow one another are computed side by side, and those with tiles one by one.
        """
        kinds: dict[str, Kind] = {}
        waiting: deque[_Waiting] = deque()
        try:
            for request in requests:
                process, text = _as_text(request)
                if _computation(process, text).has_tiles:
                    while waiting:
                        yield self._first_outcome(waiting)
                    yield self.compute(request, _nobody)
                    continue
                with _failures_named():
                    step = kernels_of(process, request)
                    if step not in kinds:
                        kinds[step] = self._prepared(step, _nobody)
                    if not waiting:
                        self._have(len(requests))
                    waiting.append(_Waiting(process, text, kinds[step], self._submit(result_of, process, text, ())))
                if len(waiting) >= _MOST_AHEAD:
                    yield self._first_outcome(waiting)
            while waiting:
                yield self._first_outcome(waiting)
        finally:
            for left in waiting:
                left.future.cancel()

    def _first_outcome(self, waiting: deque[_Waiting]) -> bytes | Problem:
        """Return the outcome of the first of the results that are waited for, and remove it."""
        losses = 0
        with _failures_named():
            while True:
                first = waiting[0]
                try:
                    outcome = _of_kind(first.future.result(), first.kind)
                except BrokenExecutor:
                    losses += 1
                    if self._executor is not None or losses > _MOST_LOSSES:
                        raise
                    self._replace_pool()
                    for place, lost in enumerate(waiting):
                        if not lost.future.done() or _has_failed(lost.future):
                            again = self._submit(result_of, lost.process, lost.text, ())
                            waiting[place] = lost._replace(future=again)
                else:
                    waiting.popleft()
                    return outcome

    def _prepared(self, step: str, listen: Listen) -> Kind:
        """Return what the processes of the executor are; have the kernels of a step compiled for a pool."""
        if self._executor is None:
            _compile_kernels(step, listen)
            return kind_of()
        kind = self._executor.submit(kind_of).result()
        if kind.core_version != kind_of().core_version:
            raise ComputationError(f"the executor has grazemap {kind.core_version}, and this process another version")
        return kind

    def _have(self, count: int) -> None:
        """Have a pool that is large enough for so many parts."""
        size = min(count, available_cores())
        if self._executor is None and (self._pool is None or self._pool.size < size):
            self.close()
            self._pool = _Pool(size)

    def _submit(self, function: Callable[..., _Part], *arguments: Any) -> Future[_Part]:
        """Have a part computed; a pool that is broken is replaced."""
        if self._executor is not None:
            return self._executor.submit(function, *arguments)
        assert self._pool is not None
        try:
            return self._pool.submit(function, *arguments)
        except BrokenExecutor:
            self._replace_pool()
            return self._pool.submit(function, *arguments)

    def _replace_pool(self) -> None:
        assert self._pool is not None
        size = self._pool.size
        self.close()
        self._pool = _Pool(size)

    def _tiles(
        self, computation: Computation, text: str, kind: Kind, listen: Listen, checkpoint: Checkpoint | None
    ) -> list[bytes] | Problem:
        """Return the tiles of a request, in the order of its plan, or the problem of one of them."""
        plan, began, losses = computation.plan, time.monotonic(), 0
        count = plan.tile_count if computation.has_tiles else 0
        total = count + plan.after
        kept = {} if checkpoint is None else {index: checkpoint.tile(index, kind.fingerprint) for index in range(count)}
        tiles = {index: data for index, data in kept.items() if data is not None}
        before, missing = len(tiles), [index for index in range(count) if index not in tiles]
        running: dict[Future[_Part], int] = {}
        if missing:
            self._have(len(missing))
        try:
            while missing or running:
                for index in missing:
                    running[self._submit(tile_of, computation.process, text, index)] = index
                missing = []
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                if self._executor is None and any(map(_is_lost, done)):
                    done, _ = wait(running)  # a pool that lost a process ends, and all that it computes is lost
                    losses += 1
                # what is finished is kept, whatever has happened to the others
                for future in sorted(done, key=_has_failed):
                    index = running.pop(future)
                    if self._executor is None and _is_lost(future) and losses <= _MOST_LOSSES:
                        missing.append(index)
                        continue
                    outcome = _of_kind(future.result(), kind)
                    if isinstance(outcome, Problem):
                        return outcome
                    tiles[index], losses = outcome, 0
                    if checkpoint is not None:
                        checkpoint.write(index, kind.fingerprint, outcome)
                    left = (time.monotonic() - began) * (count - len(tiles)) / (len(tiles) - before)
                    listen("progress", {"done": len(tiles), "total": total, "eta_seconds": left})
        finally:
            if running and self._executor is None:
                self.close()
            for future in running:
                future.cancel()
        return [tiles[index] for index in range(count)]

    def _result(self, process: str, text: str, tiles: list[bytes], kind: Kind, listen: Listen) -> bytes | Problem:
        """Return the result of a request, from its tiles, if it has tiles, or its problem."""
        losses = 0
        self._have(1)
        while True:
            future = self._submit(result_of, process, text, tiles, self._executor is None)
            try:
                if self._pool is not None:
                    self._pool.report(future, listen)
                return _of_kind(future.result(), kind)
            except BrokenExecutor:
                losses += 1
                if self._executor is not None or losses > _MOST_LOSSES:
                    raise
            except BaseException:
                if self._executor is None:
                    self.close()
                future.cancel()
                raise

    def close(self) -> None:
        """End the processes of the pool; an executor that was given goes on."""
        if self._pool is not None:
            self._pool.close()
            self._pool = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _is_lost(future: Future[_Part]) -> bool:
    return not future.cancelled() and isinstance(future.exception(), BrokenExecutor)


def _has_failed(future: Future[_Part]) -> bool:
    return future.cancelled() or future.exception() is not None


def _of_kind(part: _Part, kind: Kind) -> bytes | Problem:
    """Return the outcome of a part. Raises ComputationError if a process of another kind has computed it."""
    if part.kind != kind:
        raise ComputationError(
            "the processes of the executor differ in their libraries or in the instructions of their processors; "
            "NUMBA_CPU_NAME=x86-64-v3 in all of them makes the latter equal"
        )
    return part.outcome


class _Pool:
    """Processes of this machine whose libraries use one thread each; they end with this process."""

    def __init__(self, size: int) -> None:
        # loky replaces none of the user's modules, and needs no guard around the main program of a script
        from loky import ProcessPoolExecutor  # type: ignore[import-untyped]
        from loky.backend import get_context  # type: ignore[import-untyped]

        from grazemap_core import kernel_folder

        environment = {**dict.fromkeys(ONE_THREAD, "1"), **kernel_folder.environment()}
        self.size, self._steps = size, get_context("loky").SimpleQueue()
        self._processes = ProcessPoolExecutor(
            size, env=environment, initializer=_begin_process, initargs=(self._steps, os.getpid())
        )

    def submit(self, function: Callable[..., _Part], *arguments: Any) -> Future[_Part]:
        """Have a part computed. Raises BrokenExecutor."""
        return cast("Future[_Part]", self._processes.submit(function, *arguments))

    def report(self, future: Future[_Part], listen: Listen) -> None:
        """Listen to the steps of a result until it is finished."""
        while not future.done():
            wait([future], timeout=_LOOK_SECONDS)
            while not self._steps.empty():
                listen("progress", self._steps.get())

    @property
    def pids(self) -> list[int]:
        """The process ids."""
        return list(self._processes._processes)

    def close(self) -> None:
        """End the processes."""
        self._processes.shutdown(kill_workers=True)


_steps: Any = None
"""The queue for the steps of a result, in a process of a pool; its parent compiles the kernels of a request before."""


def _begin_process(steps: Any, parent: int) -> None:
    """Begin a process of a pool, which ends with its parent."""
    global _steps
    _steps = steps

    def follow() -> None:
        while os.getppid() == parent:
            time.sleep(_PARENT_SECONDS)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def kind_of() -> Kind:
    """Return what this process is."""
    from grazemap.version import __version__
    from grazemap_worker.numerics import numerics

    _use_kernel_folder()
    return Kind(__version__, numerics().fingerprint)


def tile_of(process: str, text: str, index: int) -> _Part:
    """Compute a tile of a request, whose text is JSON, in this process."""
    computation = _computation(process, text)
    return _part(computation, lambda: computation.tile(index))


def result_of(process: str, text: str, tiles: Sequence[bytes], reports: bool = False) -> _Part:
    """Compute the result of a request in this process, from its tiles, if it has tiles."""
    computation, count = _computation(process, text), len(tiles)
    after, reported = computation.plan.after, 0.0

    def report(done: int, total: int) -> None:
        nonlocal reported
        if not reports or _steps is None or time.monotonic() - reported < _REPORT_SECONDS:
            return
        reported = time.monotonic()
        if count:
            done, total = count + after * done // max(1, total), count + after
        _steps.put({"done": done, "total": total})

    return _part(computation, lambda: computation.result(tiles, report))


def _part(computation: Computation, compute: Callable[[], Computed]) -> _Part:
    from grazemap_core.errors import CoreError

    _load_kernels(kernels_of(computation.process, computation.request))
    kind = Kind(computation.core_version, computation.numerics.fingerprint)
    try:
        with _one_thread():
            return _Part(kind, compute().data)
    except CoreError as error:
        return _Part(kind, computation.refusal(error))


_inside, _limits, _limits_change = 0, cast(Any, None), threading.Lock()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limit the libraries that are loaded to one thread: the bytes must not depend on the number of cores.

    The limit holds for the whole process until the last of its threads has left such a block.
    """
    global _inside, _limits
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with _limits_change:
        _inside += 1
        if _inside == 1:
            _limits = threadpool_limits(1)
    try:
        yield
    finally:
        with _limits_change:
            _inside -= 1
            if _inside == 0:
                _limits.restore_original_limits()


def planned(request: ProcessRequest, folder: Path) -> Computation:
    """Return the computation of a request, and make the folder for its tiles. Raises CheckpointError, OSError."""
    computation = _computation(*_as_text(request))
    Checkpoint.create(folder, computation)
    return computation


def compute_tiles(folder: Path, first: int, step: int = 0) -> Iterator[tuple[int, bool]]:
    """Compute every step-th tile of a folder that `planned` made, from the first on; with step 0 the first alone.

    Yields the index of each tile, and whether the folder had it already.

    Raises
    ------
    CheckpointError
        The folder is not that of a computation, the core cannot compute the request, or there is no such single tile.
    """
    computation = _computation(*_as_text(Checkpoint.request(folder)))
    checkpoint = Checkpoint.create(folder, computation)
    process, text = _as_text(computation.request)
    count = computation.plan.tile_count if computation.has_tiles else 0
    if step == 0 and not 0 <= first < count:
        allowed = f"0 to {count - 1}" if count else f"none: {process} has no tiles"
        raise CheckpointError(f"{folder} has no tile {first} (allowed: {allowed})")
    fingerprint = computation.numerics.fingerprint
    for index in range(first, count, step or count):
        kept = checkpoint.tile(index, fingerprint) is not None
        if not kept:
            outcome = tile_of(process, text, index).outcome
            if isinstance(outcome, Problem):
                raise CheckpointError(problem_text(outcome))
            checkpoint.write(index, fingerprint, outcome)
        yield index, kept


def assembled(folder: Path, listen: Listen) -> tuple[ProcessRequest, bytes | Problem]:
    """Return the request of a folder, and what `Direct.compute` returns, from the tiles in the folder.

    Raises
    ------
    CheckpointError
        Tiles are missing, or were computed with other libraries or instructions than those of this process.
    """
    computation = _computation(*_as_text(Checkpoint.request(folder)))
    checkpoint, fingerprint = Checkpoint.create(folder, computation), computation.numerics.fingerprint
    count = computation.plan.tile_count if computation.has_tiles else 0
    tiles = {index: checkpoint.tile(index, fingerprint) for index in range(count)}
    missing = [str(index) for index, data in tiles.items() if data is None]
    if missing:
        why, others = "", checkpoint.others(fingerprint)
        if others:
            why = (
                f"; {folder} has tiles of other libraries or processors ({', '.join(others)}), and those of this "
                f"machine are {fingerprint}: NUMBA_CPU_NAME=x86-64-v3 makes processors equal"
            )
        shown = ", ".join(missing[:8]) + (", ..." if len(missing) > 8 else "")
        raise CheckpointError(f"{len(missing)} of {count} tiles are missing: {shown}{why}")
    with Direct() as direct:
        return computation.request, direct.compute(computation.request, listen, folder)


def _as_text(request: ProcessRequest) -> tuple[str, str]:
    """Return the process of a request, and the request as JSON."""
    return request.operation.process, json.dumps(request.canonical(), allow_nan=False)


@lru_cache(maxsize=4)
def _computation(process: str, text: str) -> Computation:
    _use_kernel_folder()
    return Computation.of(parse_request(process, json.loads(text)))


@cache
def _use_kernel_folder() -> tuple[IO[bytes], Any]:
    """Have kernels stored where a stack has them, whatever folder other functions of this process are cached in.

    Where the environment says where numba's functions are cached, they are there, too. Where the user has no home,
    they are in a temporary folder, which ends with this process. Returns what lives as long as the folder is used.

    Raises
    ------
    ComputationError
        The folder cannot be made private.
    """
    from grazemap_core import kernel_folder

    temporary = None
    if "NUMBA_CACHE_DIR" not in os.environ:
        root = usable_cache_dir()
        if root is None:
            temporary = tempfile.TemporaryDirectory(prefix="grazemap-kernels-")
            root = Path(temporary.name)
        try:
            kernel_folder.choose_folder(kernel_cache.private_folder(root))
        except kernel_cache.CacheFolderError as error:
            raise ComputationError(str(error)) from error
    return kernel_cache.mark_used(kernel_folder.folder()), temporary


def _compile_kernels(step: str, listen: Listen = _nobody) -> None:
    """Compile what is missing of the kernels of a step; of several processes that need it, one does."""
    _use_kernel_folder()
    from grazemap_core import kernel_folder

    def is_compiled() -> bool:
        return all(map(kernel_folder.holds, components_of(step)))

    def say(reason: str | None) -> None:
        listen("waiting", {"waiting_for": reason})

    if is_compiled():
        return
    from grazemap_worker.supervision.kernels import Kernels

    with kernel_cache.one_compiles(kernel_folder.folder()) as may_begin:
        while not may_begin():
            if is_compiled():
                return
            say("another process, which compiles kernels")
            time.sleep(_LOOK_SECONDS)
        kernels = Kernels([step], load=False)
        try:
            while step not in kernels.ready:
                kernels.look()
                kernels.advance()
                say(kernels.status_texts(kernels.waits()).get(step))
                time.sleep(_LOOK_SECONDS)
        finally:
            kernels.stop()
    say(None)


@cache
def _load_kernels(step: str) -> None:
    """Load the kernels of a step, and compile first what is missing, unless the parent of this process has done so."""
    if _steps is None:
        _compile_kernels(step)
    from grazemap_core import warmup

    warmup.load(components_of(step))

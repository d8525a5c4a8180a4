"""The modules that pass on the omega of an unfolding map, from the client to the kernel and back.

`python -m tools.way_of_omega` computes a small map with client, service and worker in one process, and prints the
modules in the order in which they first hold omega: as a number, in a list, an array or a mapping, in a model or a
dataclass, as JSON or in the bytes of a result. It fails where they are more than MOST.

A module counts where one of its functions holds omega while it, or what it calls, hands it to HTTP, to Redis, to
another thread or to the kernel; or where it returns a value with omega in it to such a function, or to a library. Those
that only look at it, as estimates do, do not. The way ends at KERNEL. With NUMBA_DISABLE_JIT=1 nothing is compiled.
"""

from __future__ import annotations

import asyncio
import dataclasses
import io
import sys
import threading
import zipfile
from collections.abc import Iterable, Mapping
from functools import partial
from types import FrameType
from typing import Any

import numpy as np
import structlog
from pydantic import BaseModel

from tools.one_process import client

# These numbers may only decrease, but for a module that a new ability needs: the 26th reads texts with a unit.
MOST = 26
CORE = "grazemap_core"
MOST_HOPS = 9
PACKAGES = ("grazemap", "grazemap_core", "grazemap_worker", "grazemap_service")
# Functions of libraries that take what leaves the process.
_OUT = {
    ("redis.client", "execute_command"),
    ("anyio.to_thread", "run_sync"),
    ("httpx2._transports.asgi", "handle_async_request"),
}
KERNEL = "grazemap_core.maps.kernels.lane_scheduler"
# Numbers that nothing else has.
OMEGA = (0.28123456789012, 0.28123999999013)
_TEXTS = tuple(repr(value) for value in OMEGA)
_BINARY = tuple(np.float64(value).tobytes() for value in OMEGA)
_DEEPEST = 6
_LONGEST = 100


def has_omega(value: Any, depth: int = 0) -> bool:
    """Return whether a value is or contains an omega of the map."""
    if depth > _DEEPEST or value is None:
        return False
    if isinstance(value, float):
        return value in OMEGA
    if isinstance(value, str):
        return any(text in value for text in _TEXTS)
    if isinstance(value, bytes | bytearray):
        return _bytes_have(bytes(value))
    if isinstance(value, np.ndarray):
        return value.dtype == np.float64 and bool(np.isin(value, OMEGA).any())
    if isinstance(value, BaseModel) or (dataclasses.is_dataclass(value) and not isinstance(value, type)):
        return _any_has(_fields(value), depth)
    if isinstance(value, Mapping):
        return _any_has(value.values(), depth)
    if isinstance(value, list | tuple | set | frozenset):
        return _any_has(value, depth)
    if isinstance(value, partial):
        return _any_has(value.args, depth)
    content = getattr(value, "body", None) or getattr(value, "_content", None)
    return isinstance(content, bytes) and _bytes_have(content)


def _fields(value: Any) -> Iterable[Any]:
    # what an application, a client or a store holds is not passed on by passing it
    return vars(value).values() if hasattr(value, "__dict__") and not hasattr(value, "store") else ()


def _any_has(values: Iterable[Any], depth: int) -> bool:
    return any(has_omega(item, depth + 1) for item, _ in zip(values, range(_LONGEST), strict=False))


def _bytes_have(data: bytes) -> bool:
    if data.startswith(b"PK"):
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            data = b"".join(archive.read(name) for name in archive.namelist())
    return any(text.encode() in data for text in _TEXTS) or any(binary in data for binary in _BINARY)


@dataclasses.dataclass
class Call:
    """A call of a function in the packages."""

    module: str
    function: str
    caller: Call | None
    hands_on: bool = False
    returns: bool = False
    above_kernel: bool = False

    @property
    def on_the_way(self) -> bool:
        """Whether omega passes through it."""
        return self.hands_on or (self.returns and (self.caller is None or self.caller.on_the_way))


class Trace:
    """Collects the calls in the packages, until the kernel is called and after it has returned."""

    def __init__(self) -> None:
        self._calls: dict[FrameType | None, Call] = {}
        self._busy = threading.local()
        self._kernel: FrameType | None = None

    def __call__(self, frame: FrameType, event: str, argument: Any) -> None:
        """Look at a call, or a return."""
        if event not in ("call", "return") or getattr(self._busy, "now", False):
            return
        if self._kernel is not None:
            if event == "return" and frame is self._kernel:
                self._kernel = None
            return
        self._busy.now = True
        try:
            self._look(frame, event, argument)
        finally:
            self._busy.now = False

    def way(self) -> dict[str, str]:
        """Return the modules that omega passes, each with the first of its functions that it does."""
        functions: dict[str, str] = {}
        for call in self._calls.values():
            if call.on_the_way:
                functions.setdefault(call.module, call.function)
        return functions

    def hops(self) -> list[tuple[str, str]]:
        """Return the functions of the core that omega passes on its way down to the kernel, each with its module.

        They are those that run when the kernel is called, and those that gave one of them a value with omega in it.
        """
        passed = (
            call
            for call in self._calls.values()
            if call.above_kernel or (call.returns and call.caller is not None and call.caller.above_kernel)
        )
        names = ((call.module, call.function) for call in passed)
        return list(dict.fromkeys(name for name in names if name[0].startswith(CORE)))

    def _look(self, frame: FrameType, event: str, argument: Any) -> None:
        module = frame.f_globals.get("__name__", "")
        if (module, frame.f_code.co_name) in _OUT:
            if event == "call" and _holds(frame):
                self._hand_on(frame.f_back)
        elif module.partition(".")[0] in PACKAGES:
            if frame not in self._calls:
                self._calls[frame] = Call(module, frame.f_code.co_qualname, self._calls.get(frame.f_back))
            if event == "return":
                self._calls[frame].returns |= has_omega(argument)
            elif module == KERNEL and _holds(frame):
                self._kernel = frame
                self._hand_on(frame, to_kernel=True)

    def _hand_on(self, frame: FrameType | None, to_kernel: bool = False) -> None:
        while frame is not None:
            if frame in self._calls and _holds(frame):
                self._calls[frame].hands_on = True
                self._calls[frame].above_kernel |= to_kernel
            frame = frame.f_back


def _holds(frame: FrameType) -> bool:
    return any(has_omega(value) for value in list(frame.f_locals.values()))


async def _ask(trace: Trace) -> None:
    async with client() as made:
        threading.setprofile(trace)
        sys.setprofile(trace)
        try:
            await made.unfolding_map(
                omega=list(OMEGA), clearance=[1.5, 1.6], max_periods=2, max_period=1, progress=False
            )
        finally:
            sys.setprofile(None)
            threading.setprofile(None)


def trace() -> Trace:
    """Return the trace of a small map."""
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(50))
    traced = Trace()
    asyncio.run(_ask(traced))
    return traced


if __name__ == "__main__":
    traced = trace()
    way, hops = traced.way(), traced.hops()
    for place, (module, function) in enumerate(way.items(), 1):
        print(f"{place:3} {module:50} {function}")
    print("\nfunctions of the core, down to the kernel:")
    for place, (module, function) in enumerate(hops, 1):
        print(f"{place:3} {module:50} {function}")
    sys.exit(
        0
        if len(way) <= MOST and len(hops) <= MOST_HOPS
        else f"{len(way)} modules and {len(hops)} functions; at most {MOST} and {MOST_HOPS}"
    )

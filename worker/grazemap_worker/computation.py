"""The computation of a request, tile by tile. The same request gives the same bytes, wherever its tiles are computed.

>>> computation = Computation.of(request)
>>> tiles = [computation.tile(index) for index in range(computation.plan.tile_count)]
>>> computation.result(tiles).data  # the npz of the result

The workers of a stack and computations without a stack (`direct`) call it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import VERSION, class_of
from grazemap.results.documents import array_units
from grazemap.version import __version__
from grazemap.wire import Problem, ProblemError, ProcessRequest, notes_on
from grazemap.wire.problems import make_problem
from grazemap_worker.numerics import Numerics, numerics
from grazemap_worker.planning import Plan
from grazemap_worker.processes import IMPLEMENTATIONS, Report
from grazemap_worker.processes.conversion import request_pointer


class Computed(NamedTuple):
    """A tile, or the result of a request."""

    data: bytes
    """The npz."""
    seconds: float
    """Processor time that it took."""
    lasting: bool = True
    """Whether later submissions of the same request get this result. If not, they compute it again."""


@dataclass(frozen=True, eq=False)
class Computation:
    """A request, with all that the bytes of its result depend on."""

    request: ProcessRequest
    """The parsed request."""
    canonical: dict[str, Any]
    """Its canonical form, as it stands in the result."""
    plan: Plan
    """How it is cut into tiles."""
    core_version: str
    """Version of the core."""
    numerics: Numerics
    """Libraries and processor."""

    @classmethod
    def of(cls, request: ProcessRequest) -> Computation:
        """Return the computation of a request by this process; no limits are checked."""
        plan = IMPLEMENTATIONS[request.operation.process].plan(request)
        return cls(request, request.canonical(), plan, __version__, numerics())

    @property
    def process(self) -> str:
        """Name of the process."""
        return self.request.operation.process

    @property
    def has_tiles(self) -> bool:
        """Whether the result is joined from tiles."""
        return IMPLEMENTATIONS[self.process].tile is not None

    def tile(self, index: int) -> Computed:
        """Compute a tile of a process that has tiles. Raises CoreError, TypeError."""
        compute = IMPLEMENTATIONS[self.process].tile
        if compute is None:
            raise TypeError(f"the process {self.process} has no tiles")
        began = _processor_seconds()
        document = compute(self.request, self.plan.tile(index))
        took = _processor_seconds() - began
        return Computed(encode_npz(document, {**self._meta, "tile": self.plan.place(index)}), took)

    def result(self, tiles: Iterable[bytes], report: Report) -> Computed:
        """Compute the result: from all tiles in the order of the plan, if the process has tiles.

        Parameters
        ----------
        tiles : iterable of bytes
            The npz of each tile; none for a process without tiles.
        report : callable
            Called with the number of steps that are done, and that of all steps, those after the tiles.

        Raises
        ------
        CoreError, TypeError
        """
        process = IMPLEMENTATIONS[self.process]
        if process.assembled is not None:
            documents = [decode_npz(tile)[0] for tile in tiles]
            compute = partial(process.assembled, self.request, self.plan, documents, report)
        elif process.whole is not None:
            compute = partial(process.whole, self.request, report)
        else:
            raise TypeError(f"the process {self.process} computes nothing")
        began = _processor_seconds()
        document = compute()
        took = _processor_seconds() - began
        notes = [*notes_on(self.request), *process.notes(self.request, document)]
        meta = {**self._meta, "notes": [note.model_dump() for note in notes]}
        meta["array_units"] = array_units(class_of(self.process, document).schema, document, meta["units"])
        return Computed(encode_npz(document, meta), took, process.lasting(document))

    def refusal(self, error: Exception) -> Problem:
        """Return the problem of a request that the core cannot compute; the same request fails again.

        The detail is the message of the error, a CoreError, which is about the physics and names no internals. Its
        pointer leads to the field that the message is about.
        """
        pointer, detail = request_pointer(self.request, getattr(error, "name", None)), str(error)
        errors = [ProblemError(pointer=pointer, detail=detail)] if pointer else []
        return make_problem("computation-refused", detail, errors)

    @property
    def _meta(self) -> dict[str, Any]:
        """The metadata of a result: no timings, so that the same request gives the same bytes."""
        return {
            "process": self.process,
            "schema": VERSION,
            "request": self.canonical,
            "core_version": self.core_version,
            "numerics": self.numerics.as_meta(),
            "units": self.request.oscillator.units,
        }


def _processor_seconds() -> float:
    """Return the processor time of this thread, and of the children that have ended."""
    times = os.times()
    return time.thread_time() + times.children_user + times.children_system

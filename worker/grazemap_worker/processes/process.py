"""The implementation of a process: its plan, the counts that a server limits, and the computation of its result."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from grazemap.codec import Document
from grazemap.results.documents import ClassDocument
from grazemap.wire import Estimate, Note
from grazemap_worker.planning import Plan, RequestLimits, Tile
from grazemap_worker.planning.limits import Count, Step

Report = Callable[[int, int], object]
"""Processes that count steps call it with (number of steps done, number of all steps)."""


@dataclass(frozen=True, kw_only=True)
class Process:
    """The functions that plan and compute a process. They take the validated request first, but `lasting` a document.

    A process with one tile has `whole`, `seconds` and, if it simulates, `periods`. A process with several tiles has
    `tile`, `assembled` and `tiling`.
    """

    whole: Callable[[Any, Report], ClassDocument] | None = None
    """(request, report): computes the whole result."""
    tile: Callable[[Any, Tile], Document] | None = None
    """(request, tile): computes a rectangle of the grid."""
    assembled: Callable[[Any, Plan, list[Document], Report], ClassDocument] | None = None
    """(request, plan, tiles, report): joins the documents of the tiles, in the order of the plan; `report` is used for
    plans with steps after the tiles."""
    lasting: Callable[[Document], bool] = lambda document: True
    """(document): whether later submissions of the same request get this result. If not, they compute it again."""

    notes: Callable[[Any, Document], Iterable[Note]] = lambda request, document: ()
    """(request, document): notes on the result, besides those on the request."""

    seconds: Callable[[Any], float] | None = None
    """The expected processor time in seconds."""
    periods: Callable[[Any], float] = lambda request: 0.0
    """The expected number of simulated forcing periods."""
    tiling: Callable[[Any], Plan] | None = None
    """The tiles, with the expected time and forcing periods."""
    after: Callable[[Any], list[Step]] = lambda request: []
    """The steps after the tiles, for example the continuation of the curves that explain the borders of a map."""

    counts: Callable[[Any, RequestLimits], list[Count]] = lambda request, limits: []
    """The counts that the server limits. The service checks them before it makes a plan, so that a range of 10**18
    points costs nothing."""
    longest_period_cost: Callable[[Any], float | None] = lambda request: None
    """The cost of the longest simulated forcing period, as `costs.period_cost` returns it; None without simulation.
    Like the counts, it is checked before the plan is made, because numbers of the plan could overflow."""

    kernels: str = "curves"
    """The step (`kernel_steps`) that has the kernels, for example "diagrams"."""
    runs_lanes: Callable[[Any], bool] = lambda request: False
    """Whether a request needs the kernels of maps besides."""
    own_tables: Callable[[Any], bool] = lambda request: False
    """Whether every point of a map has its own tables of the motion between impacts, which need further kernels."""

    def plan(self, request: Any) -> Plan:
        """Return the tiles of a request, and the estimate of its cost."""
        if self.tiling is not None:
            return self.tiling(request)
        if self.seconds is None:
            raise TypeError("a process needs `tiling` or `seconds`, to plan its requests")
        return Plan(estimate=Estimate(periods=self.periods(request), seconds=self.seconds(request)))

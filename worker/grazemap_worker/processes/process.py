"""A process: how it is planned, what a server limits, and how the worker computes its result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from grazemap.codec import Document
from grazemap.results.documents import ClassDocument
from grazemap.wire import Estimate
from grazemap_worker.planning import Limits, Plan, Tile
from grazemap_worker.planning.limits import Count, Step

Report = Callable[[int, int], object]
"""Called with (steps done, steps in all) by processes that count steps."""


@dataclass(frozen=True, kw_only=True)
class Process:
    """The functions of a process, each of the validated request.

    A process of one tile has `whole`, `seconds` and, if it simulates, `periods`; others have `tile`, `assembled` and
    `tiling`.
    """

    whole: Callable[[Any, Report], ClassDocument] | None = None
    """(request, report): computes everything at once."""
    tile: Callable[[Any, Tile], Document] | None = None
    """(request, tile): computes a rectangle of the grid."""
    assembled: Callable[[Any, Plan, list[Document], Report], ClassDocument] | None = None
    """(request, plan, tiles, report): joins the tiles' documents, in the plan's order; `report` is for plans with steps
    after the tiles."""
    lasting: Callable[[Document], bool] = lambda document: True
    """Whether a result is the answer whenever the request is made again; else it is computed again then."""

    seconds: Callable[[Any], float] | None = None
    """The expected processor time."""
    periods: Callable[[Any], float] = lambda request: 0.0
    """The expected number of forcing periods that are simulated."""
    tiling: Callable[[Any], Plan] | None = None
    """The tiles, with the expected time and forcing periods."""
    after: Callable[[Any], list[Step]] = lambda request: []
    """The steps after the tiles."""

    counts: Callable[[Any, Limits], list[Count]] = lambda request, limits: []
    """The quantities that are limited. The service counts them before it plans, so that a range of 10**18 points costs
    nothing."""
    longest_period: Callable[[Any], float | None] = lambda request: None
    """The cost of the longest forcing period that is simulated, as `costs.period_cost`; None: none is. Like the counts
    it is checked before the plan is made, whose numbers could overflow."""

    kernels: str = "curves"
    """The step of `grazemap_core.warmup` that compiles its kernels, without a number of masses."""
    apart: Callable[[Any], bool] = lambda request: False
    """Whether it has trajectories from rest that share no tables, for which more is compiled."""
    of_masses: bool = False
    """Whether its kernels are compiled for each number of masses."""

    def plan(self, request: Any) -> Plan:
        """Return the tiles of a request, and the estimate of its cost."""
        if self.tiling is not None:
            return self.tiling(request)
        if self.seconds is None:
            raise TypeError("a process says how its requests are planned, by `tiling` or `seconds`")
        return Plan(estimate=Estimate(periods=self.periods(request), seconds=self.seconds(request)))

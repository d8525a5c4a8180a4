"""The JSON document of a run: every figure of every repeat, from which the table and the page are made."""

from __future__ import annotations

from statistics import median, quantiles
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field


class Part(BaseModel):
    """What all parts of the document share."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Machine(Part):
    """Where the run was made, and with what."""

    processor: str
    target: Annotated[str, Field(description="LLVM's name of the processor that code was generated for.")]
    features: list[str]
    cores: int
    system: str
    load: Annotated[float, Field(description="Processes that wanted to run, on average over the minute before.")]
    versions: dict[str, str]


class Spread(Part):
    """Figures of repeats, with their median and quartiles."""

    values: list[float]
    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: list[float]) -> Spread:
        """Return repeats with median and quartiles."""
        low, _, high = quantiles(values, n=4, method="inclusive") if len(values) > 1 else 3 * values
        return cls(values=values, low=low, median=median(values), high=high)


class Throughput(Part):
    """One tool on the reference work."""

    tool: str
    lanes: int
    alike: Annotated[bool, Field(description="Every lane is the reference trajectory; else they differ a little.")]
    periods: int
    cpu_seconds: list[float]
    wall_seconds: list[float]
    rate: Annotated[Spread, Field(description="Forcing periods per CPU second of one core.")]
    impacts_per_period: float
    impacts_of_lane_0: int
    largest_error: Annotated[float, Field(description="Of the first impact times, against 40-digit arithmetic.")]
    impacts_compared: int


class Advantage(Part):
    """The core's rate over another tool's, round by round."""

    tool: str
    alike: Annotated[bool, Field(description="Both with every lane the reference trajectory.")]
    ratio: Spread


class Limit(Part):
    """The operation count of the lockstep scheme on this machine, and the share of it that is reached."""

    peak: Annotated[Spread, Field(description="Fused multiply-adds per second of one core, measured.")]
    masses: int
    degree: int
    cells: int
    impacts: Annotated[float, Field(description="Per forcing period, as this core counted them.")]
    operations_per_cell: int
    operations_per_impact: int
    operations_per_period: float
    rate: Annotated[Spread, Field(description="Periods per second that the peak would allow.")]
    share: Annotated[Spread, Field(description="This core's rate over that limit, round by round.")]


class Stage(Part):
    """A part of the core's time on the reference work."""

    name: str
    nanoseconds: Annotated[Spread, Field(description="Of CPU time, per forcing period of a lane.")]
    share: Annotated[Spread, Field(description="Of the whole, round by round.")]


class GrazingRow(Part):
    """One tool at one overshoot."""

    tool: str
    overshoot: float
    cases: int
    found: int
    invented: int
    largest_error: Annotated[float, Field(description="Radians of the forcing, among those found.")]


class MapRun(Part):
    """A map of the plane, all cores at work."""

    mode: str
    side: int
    periods: int
    processes: int
    wall_seconds: float
    kernel_seconds: Annotated[float, Field(description="CPU seconds inside the core, all processes together.")]
    longest_process: Annotated[float, Field(description="CPU seconds inside the core of the busiest process.")]
    pixels: int
    named: int
    forcing_periods: Annotated[float, Field(description="Run, all pixels together.")]
    impacts: Annotated[int, Field(description="Followed one by one.")]
    operations: Annotated[float, Field(description="By the operation count, of what was run.")]
    share_of_single_point: Annotated[
        float, Field(description="Operations per CPU second, over that of the reference work.")
    ]
    named_as_verified: Annotated[int, Field(description="Pixels named that the verified map names too.")]
    named_otherwise: Annotated[int, Field(description="Of those, the ones with another name.")]


class ServedMap(Part):
    """A map of the plane asked of a stack on this machine, once in every round."""

    mode: str
    side: int
    periods: int
    workers: int
    tiles: int
    cpu_seconds: Annotated[list[float], Field(description="Inside the core, all workers together, as the job says.")]
    wall_seconds: Annotated[list[float], Field(description="From the question to the end of the job.")]


class PixelCost(Part):
    """What single pixels cost per operation of the count, fixed length, over their median."""

    sampled: int
    percentiles: dict[str, float]
    largest: float
    largest_at: Annotated[tuple[float, float], Field(description="omega, clearance")]
    largest_per_cell_and_impact: Annotated[float, Field(description="The same with cells + impacts as the measure.")]


class MassPoint(Part):
    """Chains of one size, with impacts and without."""

    masses: int
    cells: int
    impacts_per_period: float
    free_impacts: Annotated[int, Field(description="Impacts of the lanes that are to have none.")]
    free_rate: Annotated[Spread, Field(description="Forcing periods per CPU second without impacts.")]
    rate: Annotated[Spread, Field(description="The same with them.")]
    cell_seconds: Spread
    impact_seconds: Annotated[Spread, Field(description="Of one impact, on top of its cell.")]


class CoreAlone(Part):
    """The core with other instructions than those of this processor."""

    target: Annotated[str, Field(description="What the kernels are compiled for.")]
    limit: Limit
    stages: list[Stage]
    masses: list[MassPoint]


class SidePoint(Part):
    """Maps of one size."""

    side: int
    periods: int
    wall_seconds: float
    kernel_seconds: float


class Law(Part):
    """A fit to the cost: ``seconds = constant + slope * size``, and ``seconds ~ size ** exponent``."""

    constant: float
    slope: float
    exponent: float
    largest_deviation: Annotated[float, Field(description="Of the straight line, relative.")]


class Bench(Part):
    """A whole run."""

    made: Annotated[str, Field(description="UTC")]
    quick: bool
    seconds: float
    machine: Machine
    kernel: Annotated[str, Field(description="Which kernel of this core ran.")]
    core: Annotated[str, Field(description="The tool that is this core, as the tables name it.")]
    omega: float
    clearance: float
    size_omega: Annotated[float, Field(description="Frequency at which chains of every size are compared.")]
    throughput: list[Throughput]
    advantages: list[Advantage]
    limit: Limit
    stages: list[Stage]
    grazing: list[GrazingRow]
    maps: list[MapRun]
    served: Annotated[list[ServedMap], Field(min_length=1)]
    pixel_cost: PixelCost
    masses: list[MassPoint]
    cell_law: Annotated[Law, Field(description="CPU seconds of a cell against the number of masses.")]
    impact_law: Annotated[Law, Field(description="CPU seconds of an impact, on top of its cell, against the same.")]
    narrow: Annotated[CoreAlone | None, Field(description="Without AVX-512, where the processor has x86-64-v3.")]
    sides: list[SidePoint]
    side_law: Annotated[Law, Field(description="Kernel seconds of a map against its number of pixels.")]

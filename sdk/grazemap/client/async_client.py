"""The asynchronous client: the methods of `Client`, to be awaited, over the same flows."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any, Self, TypeVar, overload

import httpx2
import numpy as np
from numpy.typing import NDArray

from grazemap import constants
from grazemap.client import arguments, operations
from grazemap.client.arguments import CoordinateLike, MotionLike, OscillatorLike, StateLike, Values
from grazemap.client.async_io import AsyncDriver
from grazemap.client.connection import Connection
from grazemap.client.jobs import AsyncJobHandle
from grazemap.client.progress import Listener
from grazemap.client.validation import validated
from grazemap.errors import ProtocolError
from grazemap.results import (
    Basins,
    BifurcationCurves,
    BifurcationDiagram,
    CodimensionTwoPoints,
    DiscontinuityMapping,
    GrazingCurve,
    OrbitBranch,
    PeriodicOrbit,
    Result,
    Trajectories,
    Trajectory,
    UnfoldingDiagram,
    UnfoldingMap,
)
from grazemap.wire import ProcessRequest, Status

R = TypeVar("R", bound=Result)


class AsyncClient:
    """Talks to a grazemap service from asyncio. Parameters and exceptions are those of `Client`."""

    def __init__(
        self,
        base_url: str = constants.DEFAULT_BASE_URL,
        api_key: str | None = None,
        cache_dir: str | os.PathLike[str] | None = None,
        timeout: float = constants.DEFAULT_TIMEOUT,
        retries: int = constants.DEFAULT_RETRIES,
        transport: httpx2.AsyncBaseTransport | None = None,
    ) -> None:
        self._connection = Connection.of(base_url, api_key, cache_dir, timeout, retries)
        self._http = httpx2.AsyncClient(
            base_url=self._connection.base_url,
            headers=self._connection.headers,
            timeout=timeout,
            transport=transport,
            trust_env=self._connection.use_environment,
        )
        self._driver = AsyncDriver(self._http)

    @property
    def base_url(self) -> str:
        """The address this client talks to."""
        return self._connection.base_url

    async def close(self) -> None:
        """Close the connections."""
        await self._http.aclose()

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def describe(self) -> dict[str, Any]:
        """As `Client.describe`."""
        return await self._driver.run(operations.describe(self._connection.settings))

    async def submit(self, process: str, request: ProcessRequest | Mapping[str, Any]) -> AsyncJobHandle:
        """As `Client.submit`."""
        settings = self._connection.settings
        job = await self._driver.run(operations.submit(settings, process, validated(process, request)))
        return AsyncJobHandle(self._driver, settings, job)

    async def job(self, job_id: str) -> AsyncJobHandle:
        """As `Client.job`."""
        settings = self._connection.settings
        return AsyncJobHandle(self._driver, settings, await self._driver.run(operations.look(settings, job_id)))

    async def jobs(
        self, status: Status | None = None, process: str | None = None, limit: int = 50
    ) -> list[AsyncJobHandle]:
        """As `Client.jobs`."""
        settings = self._connection.settings
        found = await self._driver.run(operations.list_jobs(settings, status, process, limit))
        return [AsyncJobHandle(self._driver, settings, job) for job in found]

    async def grazing_curve(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values,
        points: int | None = None,
        max_order: int = 8,
        sequence: bool = False,
        progress: bool = True,
    ) -> GrazingCurve:
        """As `Client.grazing_curve`."""
        request = arguments.grazing_curve(oscillator, omega, points, max_order, sequence)
        return await self._answer(GrazingCurve, request, progress)

    async def codimension_two_points(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: tuple[float, float],
        max_order: int = 8,
        max_multiple: int = 4,
        progress: bool = True,
    ) -> CodimensionTwoPoints:
        """As `Client.codimension_two_points`."""
        request = arguments.codimension_two_points(oscillator, omega, max_order, max_multiple)
        return await self._answer(CodimensionTwoPoints, request, progress)

    async def discontinuity_mapping(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        overshoot: float | Sequence[float] | NDArray[np.float64],
        stop: str = "A",
        order: str = "exact",
        returns: int = 8,
        progress: bool = True,
    ) -> DiscontinuityMapping:
        """As `Client.discontinuity_mapping`."""
        request = arguments.discontinuity_mapping(oscillator, omega, overshoot, stop, order, returns)
        return await self._answer(DiscontinuityMapping, request, progress)

    @overload
    async def trajectory(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        initial: StateLike | None = None,
        periods: int,
        transient_periods: int = 0,
        samples_per_period: int | None = None,
        times: Sequence[float] | NDArray[np.float64] | None = None,
        progress: bool = True,
    ) -> Trajectory: ...

    @overload
    async def trajectory(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        initial: Sequence[StateLike],
        periods: int,
        transient_periods: int = 0,
        samples_per_period: int | None = None,
        times: Sequence[float] | NDArray[np.float64] | None = None,
        progress: bool = True,
    ) -> Trajectories: ...

    async def trajectory(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        initial: StateLike | Sequence[StateLike] | None = None,
        periods: int,
        transient_periods: int = 0,
        samples_per_period: int | None = None,
        times: Sequence[float] | NDArray[np.float64] | None = None,
        progress: bool = True,
    ) -> Trajectory | Trajectories:
        """As `Client.trajectory`."""
        request = arguments.trajectory(
            oscillator, omega, clearance, initial, periods, transient_periods, samples_per_period, times
        )
        if isinstance(request.initial, list):
            return await self._answer(Trajectories, request, progress)
        return await self._answer(Trajectory, request, progress)

    async def bifurcation_diagram(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float | Values,
        clearance: float | Values,
        points: int | None = None,
        policy: str = "rest",
        periods: int = 64,
        transient_periods: int = 300,
        max_period: int = 32,
        progress: bool = True,
    ) -> BifurcationDiagram:
        """As `Client.bifurcation_diagram`."""
        request = arguments.bifurcation_diagram(
            oscillator, omega, clearance, points, policy, periods, transient_periods, max_period
        )
        return await self._answer(BifurcationDiagram, request, progress)

    async def unfolding_map(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values,
        clearance: Values,
        shape: tuple[int, int] | None = None,
        policy: str = "rest",
        max_periods: int = 1000,
        max_period: int = 32,
        initial_conditions: int = 16,
        seed: int = 0,
        adaptive: bool = False,
        preview: bool = False,
        progress: bool = True,
    ) -> UnfoldingMap:
        """As `Client.unfolding_map`."""
        request = arguments.unfolding_map(
            oscillator,
            omega,
            clearance,
            shape,
            policy,
            max_periods,
            max_period,
            initial_conditions,
            seed,
            adaptive,
            preview,
        )
        return await self._answer(UnfoldingMap, request, progress)

    async def unfolding_diagram(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values,
        clearance: Values,
        shape: tuple[int, int] | None = (256, 256),
        max_periods: int = 1000,
        max_period: int = 32,
        max_order: int = 8,
        max_multiple: int = 4,
        borders: bool = False,
        progress: bool = True,
    ) -> UnfoldingDiagram:
        """As `Client.unfolding_diagram`."""
        request = arguments.unfolding_diagram(
            oscillator, omega, clearance, shape, max_periods, max_period, max_order, max_multiple, borders
        )
        return await self._answer(UnfoldingDiagram, request, progress)

    async def basins(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        horizontal: CoordinateLike,
        vertical: CoordinateLike,
        shape: tuple[int, int] | None = None,
        initial: StateLike | None = None,
        max_periods: int = 1000,
        max_period: int = 32,
        progress: bool = True,
    ) -> Basins:
        """As `Client.basins`."""
        request = arguments.basins(
            oscillator, omega, clearance, horizontal, vertical, shape, initial, max_periods, max_period
        )
        return await self._answer(Basins, request, progress)

    async def periodic_orbit(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        motion: MotionLike | None = None,
        initial: StateLike | None = None,
        transient_periods: int = 1000,
        max_period: int = 32,
        progress: bool = True,
    ) -> PeriodicOrbit:
        """As `Client.periodic_orbit`."""
        request = arguments.periodic_orbit(oscillator, omega, clearance, motion, initial, transient_periods, max_period)
        return await self._answer(PeriodicOrbit, request, progress)

    async def orbit_branch(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: float,
        motion: MotionLike | None = None,
        initial: StateLike | None = None,
        transient_periods: int = 1000,
        max_period: int = 32,
        vary: str = "clearance",
        range: tuple[float, float],
        max_points: int = 2000,
        progress: bool = True,
    ) -> OrbitBranch:
        """As `Client.orbit_branch`."""
        request = arguments.orbit_branch(
            oscillator, omega, clearance, motion, initial, transient_periods, max_period, vary, range, max_points
        )
        return await self._answer(OrbitBranch, request, progress)

    async def bifurcation_curves(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: tuple[float, float],
        clearance: tuple[float, float],
        max_multiple: int = 2,
        points: int = 400,
        motions: Sequence[MotionLike] | None = None,
        progress: bool = True,
    ) -> BifurcationCurves:
        """As `Client.bifurcation_curves`."""
        request = arguments.bifurcation_curves(oscillator, omega, clearance, max_multiple, points, motions)
        return await self._answer(BifurcationCurves, request, progress)

    async def _answer(self, result_class: type[R], request: ProcessRequest, progress: bool) -> R:
        process = result_class.process
        with Listener(process, progress) as listener:
            flow = operations.answer(self._connection.settings, process, request, constants.PREFER_WAIT)
            result = await self._driver.run(flow, listener)
        if not isinstance(result, result_class):
            raise ProtocolError("the service answered with the result of another process")
        return result

"""The methods of both clients, one for each process; those of the asynchronous client are awaited.

Each is a function that returns the fields of the request that differ from its arguments. The decorator `method` makes
it send the request and wait for the result. Only `trajectory`, which has two kinds of results, is written in the
client.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from functools import wraps
from inspect import cleandoc, signature
from types import MethodType
from typing import Any, Concatenate, Generic, ParamSpec, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from grazemap.client import arguments, async_jobs, jobs
from grazemap.client.arguments import (
    ClearanceLike,
    CoordinateLike,
    FixedStopLike,
    MotionLike,
    OscillatorLike,
    StateLike,
    StatementLike,
    Values,
)
from grazemap.client.async_connection import AsyncConnection
from grazemap.client.connection import Connection
from grazemap.results import (
    Basins,
    BifurcationCurves,
    BifurcationDiagram,
    CodimensionTwoPoints,
    DiscontinuityMapping,
    GrazingCurve,
    OrbitBranch,
    PeriodicOrbit,
    Proof,
    Result,
    Structure,
    UnfoldingDiagram,
    UnfoldingMap,
)
from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.base import plain

P = ParamSpec("P")
R = TypeVar("R", bound=Result)
Fields = dict[str, Any]
_RAISES = """
Raises
------
ParameterError, JobFailed, JobDismissed, QueueFull, ServiceUnavailable, ConnectionFailed
"""


class Blocking:
    """The base of the client whose methods return results."""

    _connection: Connection


class Awaited:
    """The base of the client whose methods are awaited."""

    _connection: AsyncConnection


class Method(Generic[P, R]):
    """A method of both clients that sends a request and waits for its result.

    Parameters
    ----------
    result : type
        The class of the result.
    fields : function
        Has the parameters of the method, and returns the fields of the request that differ from its arguments.
    """

    def __init__(self, result: type[R], fields: Callable[Concatenate[Any, P], Fields]) -> None:
        @wraps(fields)
        def blocking(client: Blocking, *args: P.args, **kwargs: P.kwargs) -> R:
            return jobs.answer(client._connection, result, *self.asked(*args, **kwargs))

        @wraps(fields)
        async def awaited(client: Awaited, *args: P.args, **kwargs: P.kwargs) -> R:
            return await async_jobs.answer(client._connection, result, *self.asked(*args, **kwargs))

        self._process, self._fields, self._signature = result.process, fields, signature(fields)
        self._optional = {name for name, one in self._signature.parameters.items() if one.default is None}
        functions: tuple[Any, ...] = (blocking, awaited)
        for function in functions:
            function.__annotations__ = {**fields.__annotations__, "return": result.__name__}
            function.__signature__ = self._signature.replace(return_annotation=result.__name__)
        described, _, references = cleandoc(fields.__doc__ or "").partition("\nReferences\n")
        returned = f"\n\nReturns\n-------\n{result.__name__}\n    {(result.__doc__ or '').partition(chr(10))[0]}\n"
        awaited.__doc__ = described.rstrip() + returned + _RAISES + (references and f"\nReferences\n{references}\n")
        blocking.__doc__ = awaited.__doc__.replace("await client.", "client.")
        self._blocking, self._awaited = arguments.naming_arguments(blocking), arguments.naming_arguments(awaited)

    def asked(self, *args: P.args, **kwargs: P.kwargs) -> tuple[ProcessRequest, bool]:
        """Return the request for some arguments, and whether progress is shown. Raises ParameterError."""
        fields = self._fields(None, *args, **kwargs)
        given = self._signature.bind(None, *args, **kwargs)
        given.apply_defaults()
        known = PROCESSES[self._process].model_fields
        body = {name: plain(value) for name, value in given.arguments.items() if name in known} | fields
        # an argument that is None by default is left out of the request
        body = {name: value for name, value in body.items() if value is not None or name not in self._optional}
        return arguments.validated(self._process, body), given.arguments["progress"]

    @overload
    def __get__(self, client: Blocking, owner: type) -> Callable[P, R]: ...

    @overload
    def __get__(self, client: Awaited, owner: type) -> Callable[P, Coroutine[Any, Any, R]]: ...

    @overload
    def __get__(self, client: None, owner: type) -> Callable[..., Any]: ...

    def __get__(self, client: Any, owner: type) -> Callable[..., Any]:
        """Return the method of a client, or the function of its class."""
        function: Callable[..., Any] = self._blocking if issubclass(owner, Blocking) else self._awaited
        return function if client is None else MethodType(function, client)


def method(result: type[R]) -> Callable[[Callable[Concatenate[Any, P], Fields]], Method[P, R]]:
    """Return the decorator that makes a `Method`."""
    return lambda fields: Method(result, fields)


class ProcessMethods:
    """One method for each process; the exceptions that all of them raise are added to their docstrings."""

    @method(Structure)
    def structure(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values = (),
        points: int | None = None,
        times: Sequence[float] | NDArray[np.float64] = (),
        clearance: ClearanceLike | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute what is checked first: natural frequencies, damping ratios, steady response, impulse response.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
            Of any kind; left out, the paper's example.
        omega : (start, stop), or list or array
            Forcing frequencies of the steady response; rad/s in SI.
        points : int, optional
            Number of values from start to stop, both included.
        times : sequence of float
            Times of the impulse response, each >= 0.
        clearance : float, or mapping with right and left, optional
            Distance of the stops from ``q = 0``; the result then has the gaps from the equilibrium.
        progress : bool
            Whether a bar is shown during the computation, as of `grazing_curve`.

        References
        ----------
        docs/theory.md, "Any linear structure".
        """
        return {"omega": arguments.as_grid("omega", omega, points, "points")}

    @method(GrazingCurve)
    def grazing_curve(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values,
        points: int | None = None,
        max_order: int = 8,
        sequence: bool = False,
        clearance: FixedStopLike | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the curve clearance = A(omega) on which the steady motion touches both stops.

        The result is of class StopGrazingCurves where the stops are not alike: with a fixed stop, or a bias.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
            Left out: the paper's example.
        omega : (start, stop) or increasing list or array
            Forcing frequency; rad/s in SI.
        points : int, optional
            Number of values from start to stop, both included.
        max_order : int
            Maximum number of half periods after which a recurrence of the graze is looked for.
        sequence : bool
            Whether the result has xi_m of every point, for all orders.
        clearance : mapping, optional
            The one stop that is fixed, {"left": 1.2}; the other one varies. With None for the number there is only one
            stop. Left out: both stops have one clearance, which varies.
        progress : bool
            Whether a bar is shown on a terminal or below a notebook's cell during the computation, and elsewhere a line
            on stderr for what it waits for longer than 5 s.

        References
        ----------
        Equations (16)-(19) for the curve, (33)-(40) for the recurrence.
        """
        return {"omega": arguments.as_grid("omega", omega, points, "points")}

    @method(CodimensionTwoPoints)
    def codimension_two_points(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: tuple[float, float],
        max_order: int = 8,
        max_multiple: int = 4,
        clearance: FixedStopLike | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute every codimension-two point of the grazing curve over an interval of omega.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega : (start, stop)
        max_order : int
            Recurrences up to this number of half periods.
        max_multiple : int
            Resonances of motions up to this number of forcing periods.
        progress : bool

        References
        ----------
        Equations (42), (45), (57), (58).
        """
        return {"omega": arguments.as_interval("omega", omega)}

    @method(DiscontinuityMapping)
    def discontinuity_mapping(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        overshoot: float | Sequence[float] | NDArray[np.float64],
        stop: str = "A",
        order: str = "exact",
        returns: int = 8,
        progress: bool = True,
    ) -> Fields:
        """Compute the discontinuity mapping at a graze, the Poincare map composed with it, and the next contact.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega : float
        overshoot : float, or list or array of shape (n,)
            Displacement of mass 1 beyond the stop, > 0, if there were no stop; m in SI.
        stop : {"A", "C"}
            The stop that is grazed.
        order : {"leading", "exact"}
            The mapping that is applied and iterated; the errors of both are returned.
        returns : int
            Number of half periods over which the Poincare map is iterated and the motion simulated.
        progress : bool

        References
        ----------
        Equations (26), (27), (31), (32), (46); xi (33)-(40), (45), (57), (58).
        """
        sizes = plain(overshoot)
        return {"overshoot": [sizes] if isinstance(sizes, int | float) else sizes}

    @method(BifurcationDiagram)
    def bifurcation_diagram(
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
    ) -> Fields:
        """Compute the settled motions along clearance or omega.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega, clearance : float, and (start, stop) or increasing list or array
            The one that is a number is fixed, the other one varies.
        points : int, optional
            Number of values from start to stop, both included.
        policy : {"rest", "sweep-up", "sweep-down"}
            Where the trajectories start: at rest, or at the final state for the next smaller or larger value.
        periods, transient_periods : int
            Forcing periods that are shown, and those of the transient before.
        max_period : int
            The maximum period that is looked for, in forcing periods.
        progress : bool
        """
        return arguments.one_varies(omega, clearance, points)

    @method(UnfoldingMap)
    def unfolding_map(
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
        resolve_sensitive: bool = False,
        progress: bool = True,
    ) -> Fields:
        """Compute the motion that each point of a rectangle of (omega, clearance) settles to.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
            Left out: the paper's example.
        omega, clearance : (start, stop) or increasing list or array
            Forcing frequencies, the map's columns, and distances of the stops from the middle, its rows; rad/s and m
            in SI.
        shape : (int, int), optional
            Numbers of clearances and of omegas, where they are given as (start, stop).
        policy : {"rest", "sweep-up", "sweep-down", "ensemble"}
            Where the trajectories start: at rest; at the final state for the next smaller or larger clearance; or at
            several random states, where the map has the motion that most of them settle to.
        max_periods : int
            Forcing periods after which a motion counts as unresolved.
        max_period : int
            The maximum period that is looked for, in forcing periods.
        initial_conditions, seed : int
            Random states per point, 1 to 1000, and their seed; for the policy "ensemble" only.
        adaptive : bool
            Whether points are computed only where neighbours differ, and inferred where they agree. This is for large
            maps, and not possible for a sweep. The result's `computed` is true where a point was computed.
        preview : bool
            Whether only periodic motions are identified, which is faster. Chaotic motions are not distinguished from
            those that have not settled, and multiplier, lyapunov and lyapunov_error are None.
        resolve_sensitive : bool
            Whether the motions of sensitive points are decided in more digits where possible, which takes seconds a
            point. Not for a sweep or an adaptive map. The result's `resolved` is true where it was possible.
        progress : bool
            Whether a bar is shown on a terminal or below a notebook's cell during the computation, and elsewhere a line
            on stderr for what it waits for longer than 5 s.
        """
        return arguments.plane(omega, clearance, shape)

    @method(UnfoldingDiagram)
    def unfolding_diagram(
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
    ) -> Fields:
        """Compute an unfolding map with the curves and points drawn over it, and an explanation of its borders.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega, clearance : (start, stop) or increasing list or array
        shape : (int, int), optional
            Numbers of clearances and of omegas; None where they are given as lists or arrays.
        max_periods, max_period : int
            As for `unfolding_map`; the trajectories start at rest.
        max_order, max_multiple : int
            As for `codimension_two_points`; the curves in closed form are those of motions up to max_multiple.
        borders : bool
            Whether every border of the map's regions is explained, by a continued curve or as a border of basins of
            attraction. This takes as long as the map where there are few motions, and many times as long where there
            are hundreds, as with period-adding and chaos.
        progress : bool
        """
        return arguments.plane(omega, clearance, shape)

    @method(Basins)
    def basins(
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
    ) -> Fields:
        """Compute the motion that every initial state of a rectangle settles to.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega, clearance : float
        horizontal, vertical : (str, int, values) or mapping
            Two initial coordinates: "displacement" or "velocity", the mass (1 to N), and (start, stop) or an increasing
            list or array. Mass 1 must start between the stops.
        shape : (int, int), optional
            Numbers of vertical and of horizontal values, where they are given as (start, stop).
        initial : State, InitialState or mapping, optional
            All other coordinates, and the phase of the forcing; left out: 0.
        max_periods, max_period : int
            As for an unfolding map.
        progress : bool
        """
        return {**arguments.rectangle(horizontal, vertical, shape), "initial": arguments.as_states(initial)}

    @method(PeriodicOrbit)
    def periodic_orbit(
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
    ) -> Fields:
        """Solve for a periodic motion with impacts.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega, clearance : float
        motion : (period, stops), mapping or PeriodicOrbit, optional
            Forcing periods, and +1 (A) or -1 (C) for every impact in order. A mapping or an orbit may also have phases
            and velocities, the initial guess of Newton's method. Left out: the motion that the trajectory from
            `initial`, or from rest, settles to.
        initial : State, InitialState or mapping, optional
        transient_periods, max_period : int
            Length of the transient and maximum period that is looked for, in forcing periods.
        progress : bool
        """
        return arguments.start(motion, initial)

    @method(OrbitBranch)
    def orbit_branch(
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
    ) -> Fields:
        """Continue the branch of a periodic motion over clearance, omega or restitution.

        A branch that meets this one at a special point is another request: with ``beyond = point.beyond[0].request``,
        ``await client.orbit_branch(**beyond, range=...)`` computes the branch of twice the period, of lost symmetry, or
        beyond a graze.

        Parameters
        ----------
        oscillator, omega, clearance, motion, initial, transient_periods, max_period, progress
            As for `periodic_orbit`: an orbit of the branch.
        vary : {"clearance", "omega", "restitution"}
        range : (start, stop)
            Interval of the parameter that varies, which contains the orbit's value; for restitution within [0, 1].
        max_points : int
            Maximum number of points in each direction.
        """
        return {**arguments.start(motion, initial), "range": arguments.as_interval("range", range)}

    @method(BifurcationCurves)
    def bifurcation_curves(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: tuple[float, float],
        clearance: tuple[float, float],
        max_multiple: int = 2,
        points: int = 400,
        motions: Sequence[MotionLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the curves of saddle-nodes, period doublings, symmetry breakings and grazes in a window of the plane.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        omega, clearance : (start, stop)
        max_multiple : int
            Maximum period, in forcing periods, of the motions with one impact, or one on each stop.
        points : int
            Number of frequencies across the window.
        motions : sequence of (period, stops), mappings or PeriodicOrbits, optional
            Motions whose curves are continued instead, with Neimark-Sacker curves. A mapping may have omega and
            clearance of an orbit in the window, and phases and velocities, the initial guess of Newton's method.
        progress : bool
        """
        window = {
            "omega": arguments.as_interval("omega", omega),
            "clearance": arguments.as_interval("clearance", clearance),
        }
        return {**window, "motions": arguments.as_motions(motions)}

    @method(Proof)
    def prove(
        self,
        oscillator: OscillatorLike = None,
        *,
        statement: StatementLike,
        digits: int = 30,
        time_limit: float = 60.0,
        progress: bool = True,
    ) -> Fields:
        """Prove or disprove one statement in ball arithmetic (needs the extra "proofs" where the worker runs).

        The result saved as .json is a certificate that ``grazemap check`` verifies without the core. Every number
        stands for its shortest decimal: 0.05 is 1/20.

        Parameters
        ----------
        oscillator : Oscillator or mapping, optional
        statement : Statement or mapping
            ``kind`` and its numbers. orbit: omega, clearance, motion, stable; attraction: omega, clearance, initial,
            label; bifurcation: omega, clearance, motion, type, vary, range; codimension-two: type, order, range. A
            motion, an initial state and a range are written as for the other methods.
        digits : int
            Digits of the enclosures.
        time_limit : float
            Seconds after which the statement is undecided.
        progress : bool
        """
        return {"statement": arguments.as_statement(statement)}

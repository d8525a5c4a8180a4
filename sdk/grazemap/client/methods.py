"""The methods of both clients, one for each process; those of the asynchronous client are awaited.

Each is a function that returns the fields of the request that differ from its arguments. The decorator `method` makes
it send the request and wait for the result. Its docstring explains the arguments that have other forms than the fields
of these names; help() has the descriptions of the fields for the others.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Coroutine, Mapping, Sequence
from functools import wraps
from inspect import Signature, cleandoc, signature
from textwrap import fill, indent
from types import MethodType
from typing import (
    Any,
    Concatenate,
    Generic,
    ParamSpec,
    Protocol,
    TypeVar,
    Unpack,
    cast,
    get_args,
    overload,
    runtime_checkable,
)

import numpy as np
from numpy.typing import NDArray

from grazemap.client import arguments, async_jobs, jobs
from grazemap.client.arguments import (
    AxisLike,
    ClearanceLike,
    CoordinateLike,
    FixedStopLike,
    MotionLike,
    OscillatorLike,
    OutputLike,
    PathOptions,
    RangesLike,
    StateLike,
    StatementLike,
    Values,
    WindowAxisLike,
)
from grazemap.client.async_connection import AsyncConnection
from grazemap.client.connection import Connection
from grazemap.results import (
    BasinFractions,
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
    Trajectories,
    Trajectory,
    UnfoldingDiagram,
    UnfoldingMap,
)
from grazemap.wire import PROCESSES, ProcessRequest
from grazemap.wire.base import plain

P = ParamSpec("P")
R = TypeVar("R", bound=Result)
One = TypeVar("One", covariant=True)
Many = TypeVar("Many", covariant=True)
Fields = dict[str, Any]
# Arguments that are no fields.
_ARGUMENTS = {
    "points": "Number of values from start to stop, both included.",
    "shape": "Numbers of vertical and of horizontal values, where they are given as (start, stop).",
    "progress": "Whether a bar is shown on a terminal or below a notebook's cell during the computation, and elsewhere "
    "a line on stderr for what it waits for longer than 5 s.",
}
_PARAMETERS = "\n\nParameters\n----------\n"
_RAISES = """
Raises
------
ParameterError, JobFailed, JobDismissed, QueueFull, ServiceUnavailable, ConnectionFailed
"""


@runtime_checkable
class Provable(Protocol):
    """A part of a result that knows the statement which proves it, and its oscillator."""

    @property
    def oscillator(self) -> dict[str, Any] | None:
        """The oscillator of the request."""

    def statement(self) -> dict[str, Any]:
        """Return the statement of proofs."""


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
        described, _, explained = described.rstrip().partition(_PARAMETERS)
        parameters = _PARAMETERS + _parameters(explained, PROCESSES[result.process], self._signature)
        returned = f"\n\nReturns\n-------\n{result.__name__}\n    {(result.__doc__ or '').partition(chr(10))[0]}\n"
        awaited.__doc__ = described + parameters + returned + _RAISES + (references and f"\nReferences\n{references}\n")
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


def _parameters(explained: str, request: type[ProcessRequest], of: Signature) -> str:
    """Return the section on all parameters: those that are explained, and others as the fields of the request."""
    entries: dict[str, str] = {}
    for entry in re.split(r"\n(?=\S)", explained):
        entries |= dict.fromkeys(entry.partition(" : ")[0].split(", "), entry)
    known = _ARGUMENTS | {name: one.description or "" for name, one in request.model_fields.items()}
    for name, one in of.parameters.items():
        if name in known and name not in entries:
            choices = get_args(request.model_fields[name].annotation) if name in request.model_fields else ()
            kind = str(one.annotation).removesuffix(" | None") + ", optional" * (one.default is None)
            if one.default in choices:
                kind = f"{{{', '.join(map(json.dumps, choices))}}}"
            entries[name] = f"{name} : {kind}\n{indent(fill(known[name], 108), '    ')}"
    return "\n".join(dict.fromkeys(entries[name] for name in of.parameters if name in entries))


def method(result: type[R]) -> Callable[[Callable[Concatenate[Any, P], Fields]], Method[P, R]]:
    """Return the decorator that makes a `Method`."""
    return lambda fields: Method(result, fields)


class _Paths(Protocol[One, Many]):
    """The types of `trajectory`: one result of one state, another one of several."""

    @overload
    def __call__(
        self, oscillator: OscillatorLike = None, *, initial: StateLike | None = None, **options: Unpack[PathOptions]
    ) -> One: ...

    @overload
    def __call__(
        self, oscillator: OscillatorLike = None, *, initial: Sequence[StateLike], **options: Unpack[PathOptions]
    ) -> Many: ...


class _PathMethod(Protocol):
    """The types of a `Method` whose result depends on its arguments."""

    @overload
    def __get__(self, client: Blocking, owner: type) -> _Paths[Trajectory, Trajectories]: ...

    @overload
    def __get__(
        self, client: Awaited, owner: type
    ) -> _Paths[Coroutine[Any, Any, Trajectory], Coroutine[Any, Any, Trajectories]]: ...

    @overload
    def __get__(self, client: None, owner: type) -> Callable[..., Any]: ...


_paths: Callable[[Callable[..., Fields]], _PathMethod] = cast(Any, method(Trajectory))


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
        omega : (start, stop), or list or array
            Forcing frequencies of the steady response; rad/s in SI.
        clearance : float, or mapping with right and left, optional
            Distance of the stops from ``q = 0``; the result then has the gaps from the equilibrium.

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

        The result is of class StopGrazingCurves where the stops are not alike: with a fixed stop, a bias, or even and
        odd harmonics.

        Parameters
        ----------
        omega : (start, stop) or increasing list or array
            Forcing frequency; rad/s in SI.
        clearance : mapping, optional
            The one stop that is fixed, {"left": 1.2}; the other one varies. With None for the number there is only one
            stop. Left out: both stops have one clearance, which varies.

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
        omega : (start, stop)

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
        clearance: FixedStopLike | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the discontinuity mapping at a graze, the Poincare map composed with it, and the next contact.

        Parameters
        ----------
        overshoot : float, or list or array of shape (n,)
            Displacement of the contact beyond the stop, > 0, if there were no stop; m in SI.
        order : {"leading", "exact"}
            The mapping that is applied and iterated; the errors of both are returned.

        References
        ----------
        Equations (26), (27), (31), (32), (46); xi (33)-(40), (45), (57), (58).
        """
        sizes = plain(overshoot)
        return {"overshoot": [sizes] if isinstance(sizes, int | float) else sizes}

    @_paths
    def trajectory(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: ClearanceLike,
        initial: StateLike | Sequence[StateLike] | None = None,
        periods: int,
        transient_periods: int = 0,
        samples_per_period: int | None = None,
        times: Sequence[float] | NDArray[np.float64] | None = None,
        observables: Sequence[str] = (),
        outputs: Mapping[str, OutputLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute one trajectory with every impact, or one from each of several states.

        The result is of class Trajectories for a sequence of states.

        Parameters
        ----------
        initial : State, InitialState or mapping, or a sequence of up to 1000 of them, optional
            Displacement and velocity of all masses and the phase of the forcing, for example the `final` of another
            trajectory; left out: at rest.
        samples_per_period : int, optional
            200 unless `times` are given.
        """
        return {"initial": arguments.as_states(initial)}

    @method(BifurcationDiagram)
    def bifurcation_diagram(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float | Values | None = None,
        clearance: ClearanceLike | Values | None = None,
        vary: str | None = None,
        range: Values | None = None,
        points: int | None = None,
        policy: str = "rest",
        periods: int = 64,
        transient_periods: int = 300,
        max_period: int = 32,
        observables: Sequence[str] = (),
        outputs: Mapping[str, OutputLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the settled motions along clearance or omega, or along another parameter.

        Parameters
        ----------
        omega, clearance : float, and (start, stop) or increasing list or array
            The one that is a number is fixed, the other one varies. With `vary` both are numbers, unless they vary.
        vary, range : str, and (start, stop) or increasing list or array
            Another parameter, such as "restitution", "clearance_right", "damping" or "masses[2]", and its values.
        """
        return arguments.one_varies(omega, clearance, vary, range, points)

    @method(UnfoldingMap)
    def unfolding_map(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values | float | None = None,
        clearance: Values | ClearanceLike | None = None,
        horizontal: AxisLike | None = None,
        vertical: AxisLike | None = None,
        shape: tuple[int, int] | None = None,
        policy: str = "rest",
        max_periods: int = 1000,
        max_period: int = 32,
        initial_conditions: int = 16,
        seed: int = 0,
        adaptive: bool = False,
        preview: bool = False,
        resolve_sensitive: bool = False,
        observables: Sequence[str] = (),
        outputs: Mapping[str, OutputLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the motion that each point of a rectangle of two parameters settles to.

        Parameters
        ----------
        omega, clearance : (start, stop) or increasing list or array
            Forcing frequencies, the map's columns, and distances of both stops from q = 0, its rows; rad/s and m in SI.
            ``clearance={"right": (start, stop), "left": None}`` is of one stop; a number in place of None is the
            clearance of the other one. With axes they are numbers, unless they vary.
        horizontal, vertical : (str, start, stop) or (str, list or array), optional
            Two parameters in place of omega and clearance: ``horizontal=("omega", 0.26, 0.30)``,
            ``vertical=("restitution", 0.5, 0.9)``. Others are clearance_right, clearance_left, restitution_right,
            restitution_left, the factors bias, forcing and damping, and masses[i], stiffnesses[i], dampings[i].
        adaptive : bool
            Whether points are computed only where neighbours differ, and inferred where they agree. This is for large
            maps, and not possible for a sweep. The result's `computed` is true where a point was computed.
        preview : bool
            Whether only periodic motions are identified, which is faster. Chaotic motions are not distinguished from
            those that have not settled, and multiplier, lyapunov and lyapunov_error are None.
        resolve_sensitive : bool
            Whether the motions of sensitive points are decided in more digits where possible, which takes seconds a
            point. Not for a sweep or an adaptive map. The result's `resolved` is true where it was possible.
        observables : sequence of str
            Quantities of the contact that the result has for every motion, by name: "impact_rate", "peak_impact_speed",
            "mean_impact_speed", "impulse", "dissipated_power", each also with _right or _left for one stop;
            "rms_displacement", "peak_displacement", which also has _right and _left.
        outputs : mapping, optional
            Names of outputs and their rows: ``{"spring": {"displacement": [..], "unit": "N"}}``, or ``velocity``. The
            result has rms, mean and peak of each in `outputs`.
        """
        return arguments.plane(omega, clearance, horizontal, vertical, shape)

    @method(UnfoldingDiagram)
    def unfolding_diagram(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: Values | float | None = None,
        clearance: Values | ClearanceLike | None = None,
        horizontal: AxisLike | None = None,
        vertical: AxisLike | None = None,
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
        omega, clearance : (start, stop) or increasing list or array
            As for `unfolding_map`; ``clearance={"right": (start, stop), "left": None}`` is of one stop, a number in
            place of None the clearance of the other one.
        horizontal, vertical : (str, start, stop) or (str, list or array), optional
            Two parameters in place of omega and clearance, as for `unfolding_map`.
        shape : (int, int), optional
            Numbers of vertical and of horizontal values; None where they are given as lists or arrays.
        borders : bool
            Whether every border of the map's regions is explained, by a continued curve or as a border of basins of
            attraction. This takes as long as the map where there are few motions, and many times as long where there
            are hundreds, as with period-adding and chaos.
        """
        return arguments.plane(omega, clearance, horizontal, vertical, shape)

    @method(Basins)
    def basins(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: ClearanceLike,
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
        horizontal, vertical : (str, int, values) or mapping
            Two initial coordinates: "displacement" or "velocity", the mass (1 to N), and (start, stop) or an increasing
            list or array. The contact must start between the stops.
        initial : State, InitialState or mapping, optional
            All other coordinates, and the phase of the forcing; left out: at rest.
        """
        return {**arguments.rectangle(horizontal, vertical, shape), "initial": arguments.as_states(initial)}

    @method(BasinFractions)
    def basin_fractions(
        self,
        oscillator: OscillatorLike = None,
        *,
        vary: str,
        range: Values,
        points: int | None = None,
        omega: float | None = None,
        clearance: ClearanceLike | None = None,
        states: int = 200,
        seed: int = 0,
        displacement: RangesLike | None = None,
        velocity: RangesLike | None = None,
        phase: float = 0.0,
        max_periods: int = 1000,
        max_period: int = 32,
        progress: bool = True,
    ) -> Fields:
        """Compute the shares of random initial states that lead to each attractor, along one parameter.

        The same states are used at every value. An attractor has the same number at all values at which it has the same
        name; of several with one name, those whose means are nearest have the same number.

        Parameters
        ----------
        displacement, velocity : sequence of (float, float) or float, optional
            For each mass a range, or one value. States are uniform in these ranges, of those with the contact between
            the stops at all values. Left out: the equilibrium plus or minus the smallest clearance, and plus or minus
            the smallest omega times as much; the result has the ranges.

        References
        ----------
        Menck, Heitzig, Marwan, Kurths, Nature Physics 9 (2013) 89-92; Datseris, Rossi, Wagemakers, Chaos 33 (2023)
        073151.
        """
        return {
            "range": arguments.as_grid("range", range, points, "points"),
            "displacement": arguments.as_ranges(displacement),
            "velocity": arguments.as_ranges(velocity),
        }

    @method(PeriodicOrbit)
    def periodic_orbit(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: ClearanceLike,
        motion: MotionLike | None = None,
        initial: StateLike | None = None,
        transient_periods: int = 1000,
        max_period: int = 32,
        observables: Sequence[str] = (),
        outputs: Mapping[str, OutputLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Solve for a periodic motion with impacts.

        Parameters
        ----------
        motion : (period, stops), mapping or PeriodicOrbit, optional
            Forcing periods, and +1 (A) or -1 (C) for every impact in order. A mapping or an orbit may also have phases
            and velocities, the initial guess of Newton's method. Left out: the motion that the trajectory from
            `initial`, or from rest, settles to.
        """
        return arguments.start(motion, initial)

    @method(OrbitBranch)
    def orbit_branch(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: float,
        clearance: ClearanceLike,
        motion: MotionLike | None = None,
        initial: StateLike | None = None,
        transient_periods: int = 1000,
        max_period: int = 32,
        vary: str = "clearance",
        range: tuple[float, float],
        max_points: int = 2000,
        observables: Sequence[str] = (),
        outputs: Mapping[str, OutputLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Continue the branch of a periodic motion over a parameter.

        A branch that meets this one at a special point is another request: with ``beyond = point.beyond[0].request``,
        ``await client.orbit_branch(**beyond, range=...)`` computes the branch of twice the period, of lost symmetry, or
        beyond a graze.

        Parameters
        ----------
        motion : (period, stops), mapping or PeriodicOrbit, optional
            As for `periodic_orbit`: an orbit of the branch.
        vary : {"clearance", "omega", "restitution", "clearance_right", "clearance_left", "restitution_right", \
                "restitution_left", "bias", "forcing"}
            "clearance" and "restitution" of both stops, or of one; "bias" and "forcing" are factors, 1 at the orbit.
        range : (start, stop)
            Interval of the parameter that varies, which contains the orbit's value; for restitution within [0, 1].
        """
        return {**arguments.start(motion, initial), "range": arguments.as_interval("range", range)}

    @method(BifurcationCurves)
    def bifurcation_curves(
        self,
        oscillator: OscillatorLike = None,
        *,
        omega: tuple[float, float] | float | None = None,
        clearance: tuple[float, float] | ClearanceLike | None = None,
        horizontal: WindowAxisLike | None = None,
        vertical: WindowAxisLike | None = None,
        max_multiple: int = 2,
        points: int = 400,
        motions: Sequence[MotionLike] | None = None,
        progress: bool = True,
    ) -> Fields:
        """Compute the curves of saddle-nodes, period doublings, symmetry breakings and grazes in a window of the plane.

        Parameters
        ----------
        omega, clearance : (start, stop)
            ``clearance={"right": (start, stop), "left": None}`` is of one stop; a number in place of None is the
            clearance of the other one. With axes they are numbers, unless they vary.
        horizontal, vertical : (str, start, stop), optional
            Two parameters in place of omega and clearance, with their intervals: ``horizontal=("omega", 0.26, 0.30)``,
            ``vertical=("forcing", 0.8, 1.2)``; names as for `unfolding_map`.
        max_multiple : int
            Maximum period, in forcing periods, of the motions with one impact or, between symmetric stops, one on
            each. Over omega and a clearance, the forces or the bias their curves are in closed form, over omega and a
            restitution they are continued; in other planes `motions` are required.
        motions : sequence of (period, stops), mappings or PeriodicOrbits, optional
            Motions whose curves are continued instead, with Neimark-Sacker curves. A mapping may have omega and
            clearance (that which varies) of an orbit in the window, or its horizontal and vertical values, and phases
            and velocities, the initial guess of Newton's method.
        """
        window = arguments.window(omega, clearance, horizontal, vertical)
        return {**window, "motions": arguments.as_motions(motions, window)}

    @method(Proof)
    def prove(
        self,
        oscillator: OscillatorLike | Provable = None,
        *,
        statement: StatementLike | None = None,
        digits: int = 30,
        time_limit: float = 60.0,
        progress: bool = True,
    ) -> Fields:
        """Prove or disprove one statement in ball arithmetic (needs the extra "proofs" where the worker runs).

        The result saved as .json is a certificate that ``grazemap check`` verifies without the core. Every number
        stands for its shortest decimal: 0.05 is 1/20. Instead of an oscillator and a statement, a codimension-two
        point or a periodic orbit of a result can be given, which is proven with its own numbers.

        Parameters
        ----------
        statement : Statement or mapping
            ``kind`` and its numbers. orbit: omega, clearance, motion, stable; attraction: omega, clearance, initial,
            label; bifurcation: omega, clearance, motion, type, vary, range; codimension-two: type, order, range, stop.
            A motion, an initial state and a range are written as for the other methods.
        """
        if isinstance(oscillator, Provable):
            return {"oscillator": oscillator.oscillator, "statement": arguments.as_statement(oscillator.statement())}
        return {"statement": arguments.as_statement(statement)}

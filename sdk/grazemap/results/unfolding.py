"""Unfolding maps: which motion each point of a rectangle of two parameters settles to.

>>> from grazemap.results.base import decode_result
>>> umap = decode_result(http.get(f"/v1/jobs/{job.id}/result?f=npz").content)
>>> umap.at(0.28, 1.5).label
'1-2r-2l'
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.colours import COLOURED, OTHER, colours_of_map
from grazemap.described import described
from grazemap.results.base import Result, counted, counted_points, outside, quantities, value_of
from grazemap.results.common_records import CHANCE, ChanceToSettle, Common, InferredWrong, MotionShare
from grazemap.results.curves import BifurcationCurves, PlaneCurve
from grazemap.results.explorer import ExplorerPage
from grazemap.results.grazing import CodimensionTwoPoints, GrazingCurve, StopGrazingCurves
from grazemap.results.motions import more_first, motions_of
from grazemap.results.observables import Observed, quantity_of
from grazemap.results.other_motions import OtherStartsOfMap
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, FloatArray, IntArray, Record, changed, field, stored
from grazemap.units import in_si
from grazemap.wire import UnfoldingMapsRequest, canonical_id, motion_label
from grazemap.wire.planes import Plane

_PLANE = "vertical horizontal"
_JSON_ONLY = "in JSON"
_FULL_MAPS, _ADAPTIVE_MAPS = "of maps that are not adaptive", "of adaptive maps"
_RANGE_MAPS, _AXIS_MAPS = "of maps over ranges of omega and clearance", "of maps with axes"
_NO_PREVIEWS, _ENSEMBLES = "of maps that are not previews", "of ensembles"
_MEASURED, _FULL_ENSEMBLES = "of maps that are neither previews nor adaptive", "of ensembles that are not adaptive"
_MARGIN = (
    "from the steady motion, 0 on its grazing curve; null for an absent stop. That motion exists without impacts where "
    "no margin is negative."
)
# Part of the distance to an orbit that remains when a trajectory is closed.
_CLOSED = 1e-10
# Forcing periods that take a second or so; a service may allow no more.
_MOST_TRANSIENT_PERIODS = 100_000
_PLANE_FIELDS = ("oscillator", "omega", "clearance", "horizontal", "vertical")

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@described
@dataclass(frozen=True, slots=True)
class MapPoint:
    """One point of an unfolding map."""

    horizontal: float
    """Value of the horizontal parameter."""
    vertical: float
    """Value of the vertical parameter."""
    label: str
    """n-p_r-q_l as plain text, such as 1-2r-2l: n forcing periods, p impacts on the right stop and q on the left. For a
    motion that is not periodic, the name of the kind."""
    kind: str
    """The kind of motion."""
    verified: bool
    """Whether the motion is verified."""
    reason: str
    """Why the motion is unresolved, or periodic and not verified; else empty."""
    computed: bool
    """False: inferred from the points around it."""
    horizontal_offset: float
    """This point minus the place that was asked for: at most half a step of the grid."""
    vertical_offset: float
    """Likewise along the vertical axis."""
    request: dict[str, Any] | None
    """The keywords with which `client.periodic_orbit` computes the orbit. None for a motion that is not periodic or
    touches no stop, and unless the map's trajectories start at rest."""
    omega: float
    """The frequency there."""
    clearance: float | dict[str, float | None]
    """The clearance there, or that of each stop."""


class FiguresAtComputedPoints(Record):
    """The values at the computed points of an adaptive map, in the order of the rows of `computed`."""

    multiplier: FloatArray | None = field(
        "Largest modulus of the multipliers over one period of a periodic motion.",
        "computed_point",
        null=True,
        when=_NO_PREVIEWS,
    )
    lyapunov: FloatArray | None = field(
        "Largest Lyapunov exponent per forcing period: ln(multiplier)/n for a periodic motion, otherwise measured; "
        "null where it was not measured, and where all perturbations vanish.",
        "computed_point",
        null=True,
        when=_NO_PREVIEWS,
    )
    lyapunov_error: FloatArray | None = field(
        "Standard error of an exponent that was measured along the trajectory, from its spread between windows.",
        "computed_point",
        null=True,
        when=_NO_PREVIEWS,
    )
    least_impact_velocity: FloatArray = field(
        "Minimum impact speed of a periodic motion with impacts; 0 in complete chatter.",
        "computed_point",
        "m/s",
        null=True,
    )
    settled_after: IntArray = field(
        "Forcing periods after which the trajectory had settled, or was close enough for its orbit to be solved for; "
        "-1 unless periodic.",
        "computed_point",
        "forcing periods",
        dtype="int32",
    )
    share: FloatArray | None = field(
        "Fraction of the initial states that lead to this motion or, between symmetric stops, to its mirror image.",
        "computed_point",
        when=_ENSEMBLES,
    )
    motions_found: IntArray | None = field(
        "Number of different motions found; between symmetric stops, mirror images count once.",
        "computed_point",
        dtype="int32",
        when=_ENSEMBLES,
    )
    verified: BoolArray = field(
        Common,
        "computed_point",
        description="The orbit is isolated, admissible and stable, with the minimum period; it captures the "
        "trajectory, which is not sensitive.",
    )
    sensitive: BoolArray = field(Common, "computed_point")
    transient_growth: FloatArray = field(Common, "computed_point")


LABEL = field("The name of the motion, or its kind.", _PLANE, type="str")
# in JSON the motions without a colour are grey
_COLOUR = {"description": "Its colour in the picture of the map, #RRGGBB; grey for the smallest ones.", "null": False}
_SHARE_IN_JSON = MotionShare.schema.varied(omitted=("mirror_images",), colour=_COLOUR)


class UnfoldingMap(
    Observed,
    Result,
    process="unfolding-maps",
    roles={"vertical": "clearance", "horizontal": "omega"},
    dimensions=_PLANE,
    outputs="OutputOfMap",
    derived={"label": LABEL},
    in_json={
        "motions": field(
            "The motions of the map, the largest share first.", "motion", type=_SHARE_IN_JSON, when=_JSON_ONLY
        ),
        "motion": field("The motion of the point.", _PLANE, type="int", index_of="motions", when=_JSON_ONLY),
    },
):
    """The motion that each point of a rectangle of the plane settles to."""

    omega: FloatArray | None = field(Common, "omega", when=_RANGE_MAPS)
    clearance: FloatArray | None = field(Common, "clearance", when=_RANGE_MAPS)
    horizontal: FloatArray = field(PlaneCurve, "horizontal", when=_AXIS_MAPS, variable=None)
    vertical: FloatArray = field(PlaneCurve, "vertical", when=_AXIS_MAPS, variable=None)
    margin_right: FloatArray | None = field(
        f"Gap of the right stop {_MARGIN}",
        _PLANE,
        "m",
        null=True,
        when=_AXIS_MAPS,
    )
    margin_left: FloatArray | None = field(
        f"Gap of the left stop {_MARGIN}",
        _PLANE,
        "m",
        null=True,
        when=_AXIS_MAPS,
    )
    kind: IntArray = field(
        "Whether the motion is unresolved, periodic, quasi-periodic or chaotic.", _PLANE, dtype="int8", index_of="kinds"
    )
    kinds: tuple[str, ...] = field("The names of the kinds.", "kind", variable=None)
    period: IntArray = field(Common, _PLANE, dtype="int32")
    impacts_right: IntArray = field(Common, _PLANE, dtype="int32")
    impacts_left: IntArray = field(Common, _PLANE, dtype="int32")
    symmetric: BoolArray = field(Common, _PLANE)
    sticking: BoolArray = field(Common, _PLANE)
    multiplier: FloatArray | None = field(FiguresAtComputedPoints, _PLANE, when=_MEASURED)
    lyapunov: FloatArray | None = field(FiguresAtComputedPoints, _PLANE, when=_MEASURED)
    lyapunov_error: FloatArray | None = field(FiguresAtComputedPoints, _PLANE, when=_MEASURED)
    least_impact_velocity: FloatArray = field(FiguresAtComputedPoints, _PLANE, when=_FULL_MAPS)
    settled_after: IntArray = field(FiguresAtComputedPoints, _PLANE, when=_FULL_MAPS)
    share: FloatArray | None = field(FiguresAtComputedPoints, _PLANE, when=_FULL_ENSEMBLES)
    motions_found: IntArray | None = field(FiguresAtComputedPoints, _PLANE, when=_FULL_ENSEMBLES)
    verified: BoolArray = field(FiguresAtComputedPoints, _PLANE, when=_FULL_MAPS)
    sensitive: BoolArray = field(FiguresAtComputedPoints, _PLANE, when=_FULL_MAPS)
    transient_growth: FloatArray = field(FiguresAtComputedPoints, _PLANE, when=_FULL_MAPS)
    resolved: BoolArray | None = field(
        "Whether the point is sensitive and its motion was decided in more digits.",
        _PLANE,
        when="of maps with resolve_sensitive",
    )
    reason: IntArray = field(
        "Why a motion is unresolved, or is periodic and not verified.", _PLANE, dtype="int8", index_of="reasons"
    )
    reasons: tuple[str, ...] = field("The reasons.", "reason", variable=None)
    computed: BoolArray | None = field(
        "Whether the point was computed, or inferred from its neighbours.", _PLANE, when=_ADAPTIVE_MAPS
    )
    at_computed = stored(
        "The values at computed points only.",
        type=FiguresAtComputedPoints.schema,
        when=_ADAPTIVE_MAPS,
        variable=None,
    )
    inferred_wrong: InferredWrong | None = field(
        "How many of the inferred points are wrong.",
        when="of adaptive maps with inferred motions",
        variable=None,
    )
    chance_to_settle: ChanceToSettle | None = field(CHANCE, when="of maps with chaotic points")
    other_starts: OtherStartsOfMap | None = field(
        "What other starts lead to at a sample of the points.",
        when="of maps from rest with 2000 points or more that are not previews",
        variable=None,
    )

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        whole = super()._attributes(document, meta)
        whole |= _axes(whole, _plane(meta))
        if document.get("at_computed") is None:
            return whole
        figures = value_of(cls.schema["at_computed"], document["at_computed"])
        # an adaptive map is large: four bytes suffice for its whole numbers
        whole = {name: _small(value) if isinstance(value, np.ndarray) else value for name, value in whole.items()}
        names = (member.name for member in FiguresAtComputedPoints.schema)
        return whole | {name: _spread(getattr(figures, name), whole["computed"]) for name in names}

    @classmethod
    def json_document(cls, document: Document) -> Document:
        """Return a document of the codec with the motions of the map, which only JSON has."""
        motions, motion = motions_of(document)
        shown = [{**entry, "colour": entry["colour"] or OTHER} for entry in motions]
        return {**document, "motions": shown, "motion": motion}

    @property
    def preview(self) -> bool:
        """Whether only periodic motions are identified."""
        return bool(self.meta["request"].get("preview"))

    @property
    def inferred(self) -> BoolArray:
        """Where points are inferred from their neighbours, not computed: nowhere unless the map is adaptive."""
        return np.zeros(self.kind.shape, dtype=np.bool_) if self.computed is None else ~self.computed

    def motions(self, *, merge_mirror_images: bool = False) -> list[MotionShare]:
        """Return the motions of the map, the largest share first.

        With `merge_mirror_images` n-p_r-q_l and n-q_r-p_l are one motion, with the label that has more impacts on the
        right: between symmetric stops every motion has a mirror image. Raises ValueError where the stops or the forces
        are not symmetric.
        """
        shares, _ = self._coded()
        if merge_mirror_images and not self.plane.mirrors:
            raise ValueError("the stops or the forces are not symmetric: motions have no mirror images")
        return _merged(shares, self.kind.size) if merge_mirror_images else shares

    def colours(self) -> dict[str, str]:
        """Return the colours #RRGGBB of the map's picture by label or kind, for `colours=` of another picture."""
        return {motion.label: motion.colour for motion in self.motions() if motion.colour is not None}

    def _coded(self) -> tuple[list[MotionShare], IntArray]:
        """Return the motions, the largest share first, and the position of each point's motion among them."""
        motions, codes = motions_of(vars(self))
        return [MotionShare(**motion) for motion in motions], codes

    def labels(self) -> NDArray[np.str_]:
        """Return the label of every point, shape (vertical, horizontal)."""
        motions, codes = self._coded()
        return np.array([motion.label for motion in motions], dtype="<U32")[codes]

    @cached_property
    def plane(self) -> Plane:
        """The parameters that vary, with their values, and the values of the others."""
        return _plane(self.meta)

    @property
    def parameters(self) -> tuple[str, str]:
        """The names of the horizontal and of the vertical parameter, for example "omega" and "clearance"."""
        return self.plane.names

    @property
    def roles(self) -> dict[str, str]:
        """The names of dimensions in a Dataset by their roles; of a map with axes they are the two parameters."""
        if self._is_of_ranges:
            return dict(self.schema.roles)
        return dict(zip(("horizontal", "vertical"), self.parameters, strict=True))

    def at(self, horizontal: float | str, vertical: float | str) -> MapPoint:
        """Return the point of the grid that is nearest to a place, such as an omega and a clearance.

        In SI these may be texts with a unit, as "8 Hz" and "5 mm". Raises ValueError for a place outside the map.
        """
        across, up = self.parameters
        right = quantities(horizontal, across, self.units).item()
        high = quantities(vertical, up, self.units).item()
        column = _nearest(across, self.horizontal, right, self.units)
        row = _nearest(up, self.vertical, high, self.units)
        place = float(self.horizontal[column]), float(self.vertical[row])
        kind = self.kinds[self.kind[row, column]]
        period = int(self.period[row, column])
        counts = int(self.impacts_right[row, column]), int(self.impacts_left[row, column])
        settings, request = self.meta["request"], None
        parameters = self.plane.parameters.at({across: place[0], up: place[1]})
        clearance = parameters.clearance.model_dump()
        if kind == "periodic" and settings.get("policy", "rest") == "rest" and counts != (-1, -1):
            request = {
                "oscillator": parameters.oscillator.model_dump(),
                "omega": parameters.omega,
                "clearance": clearance,
                "transient_periods": max(settings["max_periods"], self._closed_after(row, column)),
                "max_period": settings["max_period"],
            }
        return MapPoint(
            *place,
            motion_label(period, *counts) if kind == "periodic" else kind,
            kind,
            bool(self.verified[row, column]),
            self.reasons[self.reason[row, column]],
            self.computed is None or bool(self.computed[row, column]),
            place[0] - right,
            place[1] - high,
            request,
            parameters.omega,
            clearance,
        )

    def _closed_after(self, row: int, column: int) -> int:
        """Return the forcing periods until the trajectory of a point is closed to round-off; 0 where nothing tells.

        A map solves for the orbit long before, as near a bifurcation, and `periodic_orbit` waits until then.
        """
        multiplier = np.nan if self.multiplier is None else float(self.multiplier[row, column])
        if not 0.0 < multiplier < 1.0:
            return 0
        decay = int(self.period[row, column]) * math.log(_CLOSED) / math.log(multiplier)
        return min(int(self.settled_after[row, column]) + math.ceil(decay), _MOST_TRANSIENT_PERIODS)

    def zoom(
        self,
        horizontal: tuple[float | str, float | str],
        vertical: tuple[float | str, float | str],
        shape: tuple[int, int] | None = None,
    ) -> dict[str, Any]:
        """Return the keywords with which `client.unfolding_map` computes a part of the map, with the same settings.

        Parameters
        ----------
        horizontal, vertical
            The ends of the part along both axes, at most a step outside the map. Those of omega and of clearances are
            in rad/s and m, whatever the pictures show, or texts with a unit such as "9 Hz".
        shape
            (vertical points, horizontal points); left out: that of this map.

        Raises
        ------
        ValueError
            An end is outside the map.
        """
        across, up = self.parameters
        _check_inside(across, self.horizontal, horizontal, self.units)
        _check_inside(up, self.vertical, vertical, self.units)
        axes = {"horizontal": (across, *horizontal), "vertical": (up, *vertical)}
        return {**self.meta["request"], **axes, "shape": shape or self.kind.shape}

    def explore(self, *, height: int = 640) -> ExplorerPage:
        """Return the map in the page of the service that computed it, where one drags, zooms and clicks.

        Below a notebook's cell the page is shown; in a terminal its address is. The page shows maps over ranges of two
        parameters, from rest, swept, or from random states, and says so of others.

        Parameters
        ----------
        height : int
            Its height in a notebook, in pixels.

        Raises
        ------
        ValueError
            The map was computed without a service, or read from a file.
        """
        if self._service is None:
            raise ValueError(
                "this map is of no service: a page shows maps that a client of one has computed, such as "
                "grazemap.local() or grazemap.Client(url)"
            )
        job = canonical_id(self.process, self.meta["request"], self.meta["core_version"])
        return ExplorerPage(f"{self._service.rstrip('/')}/#map={job}", height)

    @property
    def _is_of_ranges(self) -> bool:
        return self.plane.fields == ("omega", "clearance")

    def mask(self, motion: MotionShare | str) -> BoolArray:
        """Return where a motion is, shape (vertical, horizontal).

        The motion is one of `motions`, or its label. Raises ValueError for a label that the map does not have.
        """
        if isinstance(motion, str):
            labelled = {entry.label: entry for entry in self.motions()}
            if motion not in labelled:
                raise ValueError(f"the map has no motion {motion!r}; it has {', '.join(labelled)}")
            motion = labelled[motion]
        mask: BoolArray = self.kind == self._code(motion.kind)
        if motion.period is not None:
            right, left = motion.impacts_right, motion.impacts_left
            counted = (self.impacts_right == right) & (self.impacts_left == left)
            if motion.mirror_images:
                counted |= (self.impacts_right == left) & (self.impacts_left == right)
            mask &= (self.period == motion.period) & counted
        return mask

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """Return the table "motions"."""
        return {"motions": self.motions()}

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """Return the label of every point as codes and texts."""
        motions, codes = self._coded()
        return {"label": (codes, [motion.label for motion in motions])}

    @picture
    def plot(
        self,
        quantity: str | Axes | None = None,
        ax: Axes | None = None,
        *,
        curve: GrazingCurve | StopGrazingCurves | None = None,
        points: CodimensionTwoPoints | None = None,
        curves: BifurcationCurves | Sequence[BifurcationCurves] | None = None,
        motions: int = COLOURED,
        colours: Mapping[str, str] | None = None,
        merge_mirror_images: bool = False,
        hatching: bool = True,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the regions of the motions with a legend, and the curves and codimension-two points that are given.

        With a `quantity`, an observable such as "dissipated_power" or an output such as "spring_rms", its values are
        drawn instead, with a scale; grey where there are none. `motions` is the number of motions with a colour.
        `colours` gives colours by label or kind, such as those of another map (`other.colours()`).
        `merge_mirror_images` is that of the method `motions`. `hatching` marks the sensitive points. Raises
        TypeError for other results, and ValueError for a quantity that the request did not ask for, and for bifurcation
        curves of another plane.
        """
        if quantity is not None and not isinstance(quantity, str):
            quantity, ax = None, quantity

        _expect("curve", curve, GrazingCurve, StopGrazingCurves)
        _expect("points", points, CodimensionTwoPoints)
        across, up = self.parameters
        if (curve or points) is not None and not (across == "omega" and up.startswith("clearance")):
            raise ValueError(f"curve and points are over omega and clearance, and the map is over {across} and {up}")
        for result in curves if isinstance(curves, Sequence) else [curves]:
            _expect("curves", result, BifurcationCurves)
            if result is not None and result.parameters != self.parameters:
                own, others = (" and ".join(names) for names in (self.parameters, result.parameters))
                raise ValueError(f"curves are over {others}, and the map is over {own}")
        return draw(
            self,
            ax,
            options,
            quantity=None if quantity is None else quantity_of(self, quantity),
            curve=curve,
            points=points,
            curves=curves,
            motions=motions,
            colours=colours,
            merge_mirror_images=merge_mirror_images,
            hatching=hatching,
        )

    @picture
    def plot_computed(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw which points of an adaptive map were computed. Raises ValueError for other maps."""
        return draw(self, ax, options, "plot_computed")

    def _code(self, kind: str) -> int:
        return self.kinds.index(kind) if kind in self.kinds else -1

    def _summary(self) -> str:
        computed = "" if self.computed is None else f" ({self.computed.mean():.1%} computed)"
        periodic = self.kind == self._code("periodic")
        share = self.verified[periodic].mean() if periodic.any() else 1.0
        parts = [
            f"{len(self.vertical)} x {len(self.horizontal)} points{computed}",
            counted(self.motions(), "motion"),
            f"{share:.1%} of the periodic points verified",
            counted_points(self.kind == self._code("unresolved"), "unresolved"),
            counted_points(self.sensitive, "sensitive"),
        ]
        parts += [] if self.resolved is None else [f"{np.count_nonzero(self.resolved)} resolved in more digits"]
        parts += ["a preview"] if self.preview else []
        samples = (self.inferred_wrong, self.chance_to_settle, self.other_starts)
        parts += [str(record) for record in samples if record is not None]
        return ", ".join(parts)


def _merged(shares: Sequence[MotionShare], total: int) -> list[MotionShare]:
    """Return motions and their mirror images as one, the largest share first."""
    merged: dict[str, MotionShare] = {}
    for motion in shares:
        combined = motion
        if motion.period is not None and motion.impacts_right != motion.impacts_left:
            counts = (motion.impacts_right or 0, motion.impacts_left or 0)
            right, left = (count.item() for count in more_first(*map(np.asarray, counts)))
            label = motion_label(motion.period, right, left)
            combined = changed(motion, label=label, impacts_right=right, impacts_left=left, mirror_images=True)
        pixels = combined.pixels + (merged[combined.label].pixels if combined.label in merged else 0)
        merged[combined.label] = changed(combined, pixels=pixels, share=pixels / total)
    largest = sorted(merged.values(), key=lambda motion: (-motion.pixels, motion.label))
    colours = colours_of_map([motion.label for motion in largest], [motion.kind for motion in largest])
    return [changed(motion, colour=colour) for motion, colour in zip(largest, colours, strict=True)]


def _plane(meta: Mapping[str, Any]) -> Plane:
    """Return the plane of a map from its request."""
    request = meta["request"]
    return UnfoldingMapsRequest(**{name: request[name] for name in _PLANE_FIELDS if name in request}).plane


def _axes(whole: Mapping[str, Any], plane: Plane) -> dict[str, Any]:
    """Return the values of the axes by their roles, and omega and clearance where they vary."""
    if whole["horizontal"] is None:
        return {"horizontal": whole["omega"], "vertical": whole["clearance"]}
    values = {plane.horizontal.vary: whole["horizontal"], plane.vertical.vary: whole["vertical"]}
    return {name: values.get(name) for name in ("omega", "clearance")}


def _expect(name: str, argument: object, *kinds: type[Result]) -> None:
    """Raise TypeError for an argument of `plot` that is not a result of one of the kinds, or None."""
    if argument is not None and not isinstance(argument, kinds):
        raise TypeError(f"{name} is a {type(argument).__name__}, and plot draws {kinds[0].__name__} there")


def _nearest(name: str, values: FloatArray, value: float, units: str) -> int:
    """Return the index of the nearest of increasing values. Raises ValueError outside of them."""
    if not values[0] <= value <= values[-1]:
        raise outside("map", name, value, (float(values[0]), float(values[-1])), units)
    return int(np.abs(values - value).argmin())


def _check_inside(name: str, values: FloatArray, ends: tuple[float | str, float | str], units: str) -> None:
    """Raise ValueError for an end of a part of a map that is more than a step outside of increasing values."""
    low, high = 2.0 * values[0] - values[1], 2.0 * values[-1] - values[-2]
    for end in in_si({name: ends}, units, [])[name]:
        # the client refuses texts that are no numbers
        if not isinstance(end, str) and not low <= end <= high:
            raise outside("map", name, end, (float(values[0]), float(values[-1])), units)


def _small(values: NDArray[Any]) -> NDArray[Any]:
    """Return whole numbers in four bytes."""
    return values.astype(np.int32) if values.dtype.kind == "i" else values


def _spread(figures: NDArray[Any] | None, computed: BoolArray) -> NDArray[Any] | None:
    """Return an array of the grid from the values at its computed points, in the order of its rows."""
    if figures is None:
        return None
    nothing: Any = {"f": np.nan, "i": -1, "b": False}[figures.dtype.kind]
    whole = np.full(computed.shape, nothing, dtype=_small(figures).dtype)
    whole[computed] = figures
    return whole

"""Unfolding diagrams: a map, the curves and points over it, and the explanation of every border of its regions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import Document
from grazemap.colours import COLOURED
from grazemap.described import described
from grazemap.results.base import Result, counted_points, value_of
from grazemap.results.common_records import BIFURCATIONS, Common
from grazemap.results.curves import BifurcationCurves, PlaneCurve
from grazemap.results.documents import meta_of_part
from grazemap.results.fields import ResultSchema
from grazemap.results.grazing import CodimensionTwoPoints, GrazingCurve, StopGrazingCurves
from grazemap.results.motions import more_first
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import BoolArray, FloatArray, IntArray, Record, field
from grazemap.results.unfolding import LABEL, UnfoldingMap
from grazemap.wire import UnfoldingDiagramsRequest, motion_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_DIAGRAM_OF_RANGES = "of diagrams over ranges of omega and clearance"
_REQUESTS = {"stop_grazing_curves": "grazing_curve"}
"""Parts of the result whose request is an attribute of another name in the diagram's request, by part."""


class GrazingCurveOfPlane(Record):
    """A curve of a plane of any two parameters on which the steady motion touches a stop."""

    stop: int = field("The stop that is touched: +1 the right one, or both if they are alike; -1 the left one.")
    horizontal: FloatArray = field(PlaneCurve, when="")
    vertical: FloatArray = field(PlaneCurve, when="")
    admissible: BoolArray = field("Whether the steady motion does not reach beyond the other stop.", "point")


class BorderCurve(PlaneCurve):
    """A curve that explains borders of a map.

    Between symmetric stops mirror images count as one motion, named with more impacts first.
    """

    omega: FloatArray | None = field(PlaneCurve)
    clearance: FloatArray | None = field(PlaneCurve)
    horizontal: FloatArray | None = field(PlaneCurve)
    vertical: FloatArray | None = field(PlaneCurve)
    admissible: BoolArray = field(Common, "point")
    pairs: int = field("Number of pairs of neighbouring points that it explains.")
    ends: tuple[str, ...] = field(PlaneCurve)

    @property
    def label(self) -> str:
        """The label of the motion, with "asymmetric" where equal numbers of impacts would suggest symmetry."""
        return _label(self.motion, self.impacts_right, self.impacts_left, self.symmetric)


@described
@dataclass(frozen=True, slots=True)
class Border:
    """Pairs of neighbouring points with the same two motions and the same explanation."""

    motions: tuple[str, str]
    """The labels of the two motions, sorted; of a motion that is not periodic, its kind. Between symmetric stops mirror
    images have one label."""
    explanation: str
    """"curve", "coexistence", "goes on" or "unexplained"; see `MapBorders`."""
    curve: str
    """Type of the curve, and the motion that ends on it, such as "SN of 1-1r-(-1)l"; empty without a curve."""
    reason: str
    """Why the border is unexplained; empty if it is explained."""
    pairs: int
    """Number of the pairs."""


class MapBorders(Record):
    """The borders of a map's regions: pairs of neighbouring points with different motions, at least one periodic.

    Between symmetric stops mirror images are one motion.
    """

    row: IntArray = field("Row of the first point of a pair.", "border")
    column: IntArray = field("Column of the same point.", "border")
    along: IntArray = field(
        "0: the other point has the next larger vertical value, 1: the next larger horizontal one.", "border"
    )
    regular: BoolArray = field("Whether both motions are periodic.", "border")
    explanation: IntArray = field(
        "curve: one of the motions ends between the points; coexistence: both motions exist at both points, stable "
        "and admissible; goes on: the one motion of the pair that is periodic exists at both points.",
        "border",
        index_of="explanations",
    )
    reason: IntArray = field("Why a pair is unexplained.", "border", index_of="reasons")
    explanations: tuple[str, ...] = field("The explanations.", "explanation", variable=None)
    reasons: tuple[str, ...] = field("The reasons.", "reason", variable=None)
    curve: IntArray = field("Position in `curves`; -1: none.", "border")
    distance: FloatArray = field(
        "Distance of the curve from the middle between the points, in steps of the map.", "border", null=True
    )
    curves: tuple[BorderCurve, ...] = field("The curves.", "curve", variable=None)
    without_orbit: int = field("Number of points with a periodic motion for which no orbit was found.", variable=None)
    irregular_pairs: int = field(
        "Number of further pairs, of motions of two different kinds, neither of them periodic.", variable=None
    )

    def __len__(self) -> int:
        return len(self.row)

    def count(self, explanation: str, regular: bool = True) -> int:
        """Return how many pairs of two periodic motions, or else of one and another motion, have an explanation."""
        return int(np.count_nonzero(self.where(explanation) & (self.regular == regular)))

    def count_of(self, type: str) -> int:
        """Return how many curves are of a type."""
        return sum(curve.type == type for curve in self.curves)

    def where(self, explanation: str) -> NDArray[np.bool_]:
        """Return which pairs have an explanation, shape (p,)."""
        known = explanation in self.explanations
        mask: NDArray[np.bool_] = self.explanation == (self.explanations.index(explanation) if known else -1)
        return mask

    def others(self) -> tuple[IntArray, IntArray]:
        """Return row and column of the second points, shape (p,) each."""
        return self.row + (self.along == 0), self.column + (self.along == 1)


class UnfoldingDiagram(Result, process="unfolding-diagrams", roles=UnfoldingMap.schema.roles, derived={"label": LABEL}):
    """An unfolding map from rest and the results drawn over it, each equal to that of its own process."""

    unfolding_map: UnfoldingMap = field("The map.")
    grazing_curve: GrazingCurve | None = field(
        "The curve, at 400 values of omega, or at two for each column of the map if these are more.",
        when=f"{_DIAGRAM_OF_RANGES}, where the stops are grazed at once",
        prefix="grazing_",
    )
    stop_grazing_curves: StopGrazingCurves | None = field(
        "The curves of the stops, at the same values of omega.",
        when=f"{_DIAGRAM_OF_RANGES}, where the stops are not alike",
        prefix="grazing_",
    )
    grazing_curves: tuple[GrazingCurveOfPlane, ...] | None = field(
        "The curves on which the steady motion touches a stop.", "graze", when="of diagrams with axes", variable=None
    )
    codimension_two_points: CodimensionTwoPoints | None = field(
        "The points on the grazing curve.", when=_DIAGRAM_OF_RANGES, variable=None
    )
    bifurcation_curves: BifurcationCurves | None = field(
        "The curves of motions with one impact.",
        when="over omega and a parameter of the stops or the forces",
        variable=None,
    )
    borders: MapBorders | None = field(
        "The borders of the map's regions, each with its explanation.", when="with borders", prefix="border_"
    )

    @classmethod
    def _attributes(cls, document: Document, meta: dict[str, Any]) -> dict[str, Any]:
        # the parts have the meta that their own requests would have
        diagram_request = UnfoldingDiagramsRequest.model_validate(meta["request"])
        parts: dict[str, Any] = {}
        for member in cls.schema:
            if isinstance(member.type, ResultSchema):
                parts[member.name] = None
                if member.name in document or not member.optional:
                    request = getattr(diagram_request, _REQUESTS.get(member.name, member.name))
                    part, own = document[member.name], {"process": member.type.process, "request": request.canonical()}
                    its_meta = meta_of_part(member.type, part, meta, **own)
                    parts[member.name] = member.type.kind.from_document(part, its_meta)
        for name in ("grazing_curves", "borders"):
            part = document.get(name)
            parts[name] = None if part is None else value_of(cls.schema[name], part)
        return parts

    @classmethod
    def json_document(cls, document: Document) -> Document:
        """Return a document of the codec with the motions of the map, which are in the JSON form only."""
        return document | {"unfolding_map": UnfoldingMap.json_document(document["unfolding_map"])}

    @property
    def horizontal(self) -> FloatArray:
        """The horizontal values of the map."""
        return self.unfolding_map.horizontal

    @property
    def vertical(self) -> FloatArray:
        """The vertical values of the map."""
        return self.unfolding_map.vertical

    @property
    def roles(self) -> dict[str, str]:
        """The names of dimensions in a Dataset by their roles, as of the map."""
        return self.unfolding_map.roles

    @property
    def mirrors(self) -> bool:
        """Whether the mirror image of every motion is a motion too. In the borders the two count as one."""
        return UnfoldingDiagramsRequest.model_validate(self.meta["request"]).plane.mirrors

    def derived(self) -> dict[str, tuple[NDArray[Any], list[str]]]:
        """Return the label of every point of the map as codes and texts."""
        return self.unfolding_map.derived()

    def border_list(self) -> list[Border]:
        """Return the borders by motions and explanation, most pairs first; an empty list without borders.

        Those with a motion that is not periodic come last.
        """
        if self.borders is None:
            return []
        counts: Counter[tuple[bool, Border]] = Counter()
        labels, borders = self._one_label_each(), self.borders
        rows, columns = borders.others()
        for k in range(len(borders)):
            ends = ((borders.row[k], borders.column[k]), (rows[k], columns[k]))
            first, second = sorted(str(labels[end]) for end in ends)
            curve = borders.curves[borders.curve[k]] if borders.curve[k] >= 0 else None
            border = Border(
                motions=(first, second),
                explanation=borders.explanations[borders.explanation[k]],
                curve="" if curve is None else f"{curve.type} of {curve.label}",
                reason=borders.reasons[borders.reason[k]],
                pairs=0,
            )
            counts[not borders.regular[k], border] += 1
        listed = sorted(counts.items(), key=lambda item: (item[0][0], -item[1], item[0][1].motions))
        return [replace(border, pairs=pairs) for (_, border), pairs in listed]

    def summary(self) -> str:
        """Return a summary in a few lines: how the borders of the map are explained, and how many are not."""
        umap = self.unfolding_map
        shares: Counter[str] = Counter()
        for motion in umap.motions():
            shares[motion.kind] += motion.pixels
        rest, unresolved = umap.kind.size - shares["chaotic"], shares["unresolved"]
        lines = [
            f"{umap.kind.shape[0]} x {umap.kind.shape[1]} points: "
            + ", ".join(f"{pixels} {kind}" for kind, pixels in sorted(shares.items(), key=lambda entry: -entry[1])),
            f"unresolved: {unresolved} of the {rest} points that are not chaotic ({unresolved / max(1, rest):.2%})",
            counted_points(umap.sensitive, "sensitive"),
        ]
        if umap.chance_to_settle is not None:
            lines.append(str(umap.chance_to_settle))
        if self.borders is None:
            return "\n".join(lines)
        borders = self.borders
        for regular, title in ((True, "two periodic motions"), (False, "a motion that is not periodic")):
            parts = [f"{borders.count(name, regular)} {name}" for name in borders.explanations[1:]]
            parts.append(f"{borders.count('unexplained', regular)} unexplained")
            pairs = int(np.count_nonzero(borders.regular == regular))
            lines.append(f"{pairs} pairs of neighbouring points with {title}: " + ", ".join(parts))
        types = [f"{borders.count_of(kind)} {kind}" for kind in BIFURCATIONS]
        lines.append(f"{len(borders.curves)} curves: " + ", ".join(types))
        lines += [
            f"unexplained, {border.pairs} x {' | '.join(border.motions)}: {border.reason}"
            for border in self.border_list()
            if border.reason
        ]
        return "\n".join(lines)

    @picture
    def plot(
        self,
        ax: Axes | None = None,
        *,
        motions: int = COLOURED,
        colours: Mapping[str, str] | None = None,
        merge_mirror_images: bool = False,
        hatching: bool = True,
        **options: Unpack[PictureOptions],
    ) -> Axes:
        """Draw the regions of the motions, the curves that explain their borders, the grazing curve and its points.

        `motions`, `colours`, `merge_mirror_images` and `hatching` are those of `UnfoldingMap.plot`.
        """
        return draw(
            self,
            ax,
            options,
            motions=motions,
            colours=colours,
            merge_mirror_images=merge_mirror_images,
            hatching=hatching,
        )

    def _one_label_each(self) -> NDArray[np.str_]:
        """Return the label of every point. Mirror images that are motions share a label, with more impacts first."""
        umap = self.unfolding_map
        periodic = umap.kind == umap.kinds.index("periodic")
        labels = np.array(umap.kinds)[umap.kind].astype("<U32")
        impacts = [umap.impacts_right, umap.impacts_left]
        if self.mirrors:
            impacts = [*more_first(*impacts)]
        codes = np.stack([umap.period, *impacts, umap.symmetric], axis=-1)
        for period, right, left, symmetric in np.unique(codes[periodic], axis=0).tolist():
            selected = periodic & np.all(codes == (period, right, left, symmetric), axis=-1)
            labels[selected] = _label(motion_label(period, right, left), right, left, bool(symmetric))
        return labels

    def _summary(self) -> str:
        umap = self.unfolding_map
        points = f"{len(umap.vertical)} x {len(umap.horizontal)} points, {len(umap.motions())} motions"
        if self.borders is None:
            return points
        left = self.borders.count("unexplained")
        return f"{points}, {len(self.borders.curves)} curves, {left} pairs of periodic motions unexplained"


def _label(motion: str, right: int, left: int, symmetric: bool) -> str:
    """Return the label of a motion, marked if it has as many impacts on both stops and is not symmetric."""
    return motion if symmetric or right != left or right == -1 else f"{motion} asymmetric"

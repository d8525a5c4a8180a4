"""The results of the processes as objects with numpy arrays; saving and loading them.

A result keeps the document it was made from, so a saved file has all that the service sent, including fields of a newer
service. npz is the service's format (`codec.py`); JSON is the same document as text, with null for NaN. Every module of
this folder is imported here, so that its classes are in `RESULTS`; the names below are those that others
import from the package.
"""

from importlib import import_module
from pkgutil import iter_modules

from grazemap.results.base import RESULTS, Result, class_of, decode_result, load, schema_of
from grazemap.results.basins import Attractor, BasinEntropy, BasinFractions, Basins, ContinuedAttractor, Uncertainty
from grazemap.results.common_records import ChanceToSettle, Impacts, InferredWrong, Motion, MotionShare, State, Sticking
from grazemap.results.curves import BifurcationCurve, BifurcationCurves, FollowedMotion
from grazemap.results.diagrams import BifurcationDiagram, Section
from grazemap.results.discontinuity import DiscontinuityMapping, Grazing, NextContact, Returns
from grazemap.results.fields import VERSION, ResultSchema
from grazemap.results.grazing import (
    CodimensionTwoPoint,
    CodimensionTwoPoints,
    Corner,
    Family,
    GrazingCurve,
    StopGrazingCurves,
    Unfolding,
)
from grazemap.results.orbits import Beyond, OrbitBranch, PeriodicOrbit, SpecialPoint
from grazemap.results.other_motions import MotionElsewhere, OtherMotion, OtherStarts, OtherStartsOfMap
from grazemap.results.proofs import Proof
from grazemap.results.structures import Gaps, HarmonicResponse, Structure
from grazemap.results.trajectory import Trajectories, Trajectory
from grazemap.results.unfolding import UnfoldingMap
from grazemap.results.unfolding_diagram import Border, BorderCurve, GrazingCurveOfPlane, MapBorders, UnfoldingDiagram
from grazemap.wire import PROCESSES

__all__ = [
    "RESULTS",
    "SCHEMAS",
    "VERSION",
    "Attractor",
    "BasinEntropy",
    "BasinFractions",
    "Basins",
    "Beyond",
    "BifurcationCurve",
    "BifurcationCurves",
    "BifurcationDiagram",
    "Border",
    "BorderCurve",
    "ChanceToSettle",
    "CodimensionTwoPoint",
    "CodimensionTwoPoints",
    "ContinuedAttractor",
    "Corner",
    "DiscontinuityMapping",
    "Family",
    "FollowedMotion",
    "Gaps",
    "Grazing",
    "GrazingCurve",
    "GrazingCurveOfPlane",
    "HarmonicResponse",
    "Impacts",
    "InferredWrong",
    "MapBorders",
    "Motion",
    "MotionElsewhere",
    "MotionShare",
    "NextContact",
    "OrbitBranch",
    "OtherMotion",
    "OtherStarts",
    "OtherStartsOfMap",
    "PeriodicOrbit",
    "Proof",
    "Result",
    "Returns",
    "Section",
    "SpecialPoint",
    "State",
    "Sticking",
    "StopGrazingCurves",
    "Structure",
    "Trajectories",
    "Trajectory",
    "Uncertainty",
    "Unfolding",
    "UnfoldingDiagram",
    "UnfoldingMap",
    "class_of",
    "decode_result",
    "load",
    "schema_of",
]

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)

# In the order of their processes; several forms of a result are in the order of their module.
SCHEMAS: tuple[ResultSchema, ...] = tuple(
    sorted((kind.schema for kind in RESULTS.values()), key=lambda schema: list(PROCESSES).index(schema.process))
)

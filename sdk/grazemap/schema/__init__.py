"""The schemas of all results: which fields they have, with dimensions, units and descriptions."""

from __future__ import annotations

from collections.abc import Container

from grazemap.schema.basins import BASINS
from grazemap.schema.curves import BIFURCATION_CURVES, UNFOLDING_DIAGRAMS
from grazemap.schema.discontinuity import DISCONTINUITY_MAPPINGS
from grazemap.schema.fields import VERSION, Field, Record, Request, ResultSchema
from grazemap.schema.grazing import CODIMENSION_TWO_POINTS, GRAZING_CURVES
from grazemap.schema.maps import UNFOLDING_MAPS
from grazemap.schema.orbits import ORBIT_BRANCHES, PERIODIC_ORBITS
from grazemap.schema.trajectories import BIFURCATION_DIAGRAMS, TRAJECTORIES, TRAJECTORY

__all__ = ["SCHEMAS", "VERSION", "Field", "Record", "Request", "ResultSchema", "schema_of"]

SCHEMAS: tuple[ResultSchema, ...] = (
    GRAZING_CURVES,
    CODIMENSION_TWO_POINTS,
    DISCONTINUITY_MAPPINGS,
    TRAJECTORY,
    TRAJECTORIES,
    BIFURCATION_DIAGRAMS,
    UNFOLDING_MAPS,
    UNFOLDING_DIAGRAMS,
    BASINS,
    PERIODIC_ORBITS,
    ORBIT_BRANCHES,
    BIFURCATION_CURVES,
)


def schema_of(process: str, names: Container[str]) -> ResultSchema:
    """Return the schema of a process's result, of several forms the one whose first field is among the names.

    Raises
    ------
    KeyError
        There is no such process.
    """
    forms = [schema for schema in SCHEMAS if schema.process == process]
    if not forms:
        raise KeyError(process)
    return next((schema for schema in forms if schema.fields[0].name in names), forms[0])

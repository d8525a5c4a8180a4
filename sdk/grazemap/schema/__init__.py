"""The schemas of all results: which fields they have, with dimensions, units and descriptions.

A schema needs no line here: every module of this folder is searched for them.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from importlib import import_module
from pkgutil import iter_modules

from grazemap.schema.fields import VERSION, Field, Record, Request, ResultSchema

__all__ = ["SCHEMAS", "VERSION", "Field", "Record", "Request", "ResultSchema", "schema_of"]

# The order in which documents name the results; others follow, in the order of their names.
_ORDER = (
    "GrazingCurve",
    "CodimensionTwoPoints",
    "DiscontinuityMapping",
    "Trajectory",
    "Trajectories",
    "BifurcationDiagram",
    "UnfoldingMap",
    "UnfoldingDiagram",
    "Basins",
    "PeriodicOrbit",
    "OrbitBranch",
    "BifurcationCurves",
)


def _schemas() -> Iterator[ResultSchema]:
    for module in iter_modules(__path__, f"{__name__}."):
        for value in vars(import_module(module.name)).values():
            if isinstance(value, ResultSchema):
                yield value


def _in_order(name: str) -> tuple[int, str]:
    return _ORDER.index(name) if name in _ORDER else len(_ORDER), name


_FOUND = {schema.name: schema for schema in _schemas()}
SCHEMAS: tuple[ResultSchema, ...] = tuple(_FOUND[name] for name in sorted(_FOUND, key=_in_order))


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

"""The schemas of all results: which fields they have, with dimensions, units and descriptions.

The modules of this folder are searched for schemas, so none is listed here.
"""

from __future__ import annotations

from collections.abc import Container, Iterator
from importlib import import_module
from pkgutil import iter_modules

from grazemap.schema.fields import VERSION, Field, Record, Request, ResultSchema
from grazemap.wire import PROCESSES

__all__ = ["SCHEMAS", "VERSION", "Field", "Record", "Request", "ResultSchema", "schema_of"]


def _schemas() -> Iterator[ResultSchema]:
    for module in iter_modules(__path__, f"{__name__}."):
        for value in vars(import_module(module.name)).values():
            if isinstance(value, ResultSchema):
                yield value


# In the order of their processes; several forms of a result are in the order of their module.
SCHEMAS: tuple[ResultSchema, ...] = tuple(
    sorted(
        {schema.name: schema for schema in _schemas()}.values(),
        key=lambda schema: list(PROCESSES).index(schema.process),
    )
)


def schema_of(process: str, names: Container[str]) -> ResultSchema:
    """Return the schema of a process's result; of several forms, the one whose fields are among the names.

    Raises
    ------
    KeyError
        There is no such process.
    """
    forms = [schema for schema in SCHEMAS if schema.process == process]
    if not forms:
        raise KeyError(process)
    whole = (schema for schema in forms if all(one.optional or one.name in names for one in schema.fields))
    # a form of an older version may lack fields
    return next(whole, next((schema for schema in forms if schema.fields[0].name in names), forms[0]))

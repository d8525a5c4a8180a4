"""Schemas of results and jobs in the OpenAPI document, made for each process from the schema of its result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from grazemap.results import SCHEMAS, UnfoldingMap
from grazemap.results.basins import TILE_OF_BASINS
from grazemap.results.fields import Field, RecordSchema, RequestDocument, ResultSchema
from grazemap.wire import PROCESSES

Schema = dict[str, Any]
_TYPES = {"float": "number", "int": "integer", "bool": "boolean", "str": "string"}
_TEXT: Schema = {"type": "string"}
_PAIR: Schema = {"type": "array", "items": {"type": "integer"}, "minItems": 2, "maxItems": 2}
NUMERICS = ("numba", "llvmlite", "numpy", "scipy", "cpu", "cpu_features", "fingerprint")
"""The fields of the worker's `Numerics`, which a test compares with them: the service does not import that class."""
RESULT, TILE, JOB, BATCH_ITEM = "Result", "Tile", "Job", "BatchItem"
# Processes whose tiles can be fetched, with the schema of a tile. A tile of an unfolding diagram is a tile of the
# unfolding map from which the diagram is made.
_TILES: Mapping[str, RecordSchema] = {
    "unfolding-maps": UnfoldingMap.schema,
    "unfolding-diagrams": UnfoldingMap.schema,
    "basins": TILE_OF_BASINS,
    "basin-fractions": TILE_OF_BASINS,
}


def reference(name: str) -> Schema:
    """Return a reference to a component."""
    return {"$ref": f"#/components/schemas/{name}"}


def result_components() -> dict[str, Schema]:
    """Return the components of results and tiles; `Result` and `Tile` are unions, distinguished by `process`."""
    numerics = _object("The software and the processor that computed a result.", dict.fromkeys(NUMERICS, _TEXT))
    components: dict[str, Schema] = {"Numerics": numerics}
    results: dict[str, list[str]] = {}
    for schema in SCHEMAS:
        components |= _records(schema)
        components[f"{schema.name}Result"] = _result(schema, schema.process, components)
        results.setdefault(schema.process, []).append(schema.name)
    result_names = {process: f"{'Or'.join(names)}Result" for process, names in results.items()}
    for process, names in results.items():
        if len(names) > 1:
            # a discriminator leads to objects that have its property
            either = [reference(f"{name}Result") for name in names]
            components[result_names[process]] = {
                **_object(f"A result of {process}.", {"process": {"type": "string", "const": process}}),
                "oneOf": either,
            }
    components[RESULT] = one_of(result_names)
    tile_names = {process: f"{_stem(process)}Tile" for process in _TILES}
    for process, record in _TILES.items():
        components[tile_names[process]] = _result(record, process, components, tile=True)
    components[TILE] = one_of(tile_names)
    return components


def job_components(job: Schema) -> dict[str, Schema]:
    """Return a component for the jobs of each process. `Job` is the union of them, distinguished by `process`.

    `job` is the schema of a job of any process.
    """
    components: dict[str, Schema] = {}
    names = {process: job_name(process) for process in PROCESSES}
    for process, model in PROCESSES.items():
        own_properties = {
            "process": {"type": "string", "const": process, "title": "Process"},
            "request": {"anyOf": [reference(model.__name__), {"type": "null"}], "title": "Request"},
        }
        properties = {**job["properties"], **own_properties}
        components[names[process]] = {**job, "title": names[process], "properties": properties}
    components[JOB] = one_of(names)
    return components


def job_name(process: str) -> str:
    """Return the name of the component of a process's job."""
    return f"{_stem(process)}Job"


def one_of(names: Mapping[str, str]) -> Schema:
    """Return the schema of a union of components, distinguished by `process`."""
    mapping = {process: reference(name)["$ref"] for process, name in names.items()}
    return {
        "oneOf": [reference(name) for name in names.values()],
        "discriminator": {"propertyName": "process", "mapping": mapping},
    }


def _stem(process: str) -> str:
    """Return the name of the request class without `Request`, for example "UnfoldingMaps" for unfolding-maps."""
    return PROCESSES[process].__name__.removesuffix("Request")


def _result(record: RecordSchema, process: str, components: dict[str, Schema], tile: bool = False) -> Schema:
    """Return the schema of a result or of a tile in JSON: its fields, and `process`, `schema` and `meta`.

    The schema of `meta` is added to `components`.
    """
    meta = f"{_stem(process)}{'Tile' if tile else ''}Meta"
    head: dict[str, Schema] = {
        "process": {"type": "string", "const": process},
        "schema": {"type": "integer", "description": "The version of the layout of results."},
    }
    meta_fields = {
        "request": reference(PROCESSES[process].__name__),
        "core_version": _TEXT,
        "numerics": reference("Numerics"),
        "units": {"type": "string", "enum": ["nondimensional", "SI"]},
    }
    if tile:
        place = {"index": {"type": "integer"}, "rows": _PAIR, "columns": _PAIR}
        meta_fields["tile"] = _object("Position of the tile in the grid, as half-open ranges.", place)
    else:
        meta_fields["notes"] = {"type": "array", "items": reference("Note")}
        units = {"type": "object", "additionalProperties": {"type": "string"}}
        meta_fields["array_units"] = {**units, "description": "The units of the fields that have one, by name."}
    components[meta] = _object(f"The metadata of a {'tile' if tile else 'result'}.", {**head, **meta_fields})
    json_fields = _json_fields(record) if not tile else ()
    fields = {field.name: _property(field) for field in (*record, *json_fields)}
    required = [*head, *(field.name for field in (*record, *json_fields) if not field.optional), "meta"]
    return _object(record.description, {**head, **fields, "meta": reference(meta)}, required)


def _json_fields(record: RecordSchema) -> tuple[Field, ...]:
    """Return the fields that only the JSON of a result has.

    `when` is removed, because in JSON these fields are always there.
    """
    return tuple(field.varied(when="") for field in record.in_json) if isinstance(record, ResultSchema) else ()


def _records(record: RecordSchema) -> Iterator[tuple[str, Schema]]:
    """Yield (name, schema) of every record type that the fields of a record use, nested record types first."""
    for field in (*record, *_json_fields(record)):
        if isinstance(field.type, RecordSchema):
            yield from _records(field.type)
            fields = (*field.type, *_json_fields(field.type))
            required = [inner.name for inner in fields if not inner.optional]
            properties = {inner.name: _property(inner) for inner in fields}
            yield field.type.name, _object(field.type.description, properties, required)


def _object(description: str, properties: Mapping[str, Schema], required: Sequence[str] | None = None) -> Schema:
    """Return the schema of an object; if `required` is left out, all properties are required."""
    names = properties if required is None else required
    return {"type": "object", "description": description, "properties": dict(properties), "required": list(names)}


def _property(field: Field) -> Schema:
    schema: Schema
    if isinstance(field.type, RecordSchema | RequestDocument):
        name = field.type.name if isinstance(field.type, RecordSchema) else PROCESSES[field.type.process].__name__
        schema = reference(name)
        nullable = (field.null or field.optional) and not field.dims
        if nullable:
            schema = {"anyOf": [schema, {"type": "null"}]}
    elif field.type == "complex":
        schema = {"type": "array", "items": {"type": ["number", "null"]}, "minItems": 2, "maxItems": 2}
    else:
        schema = {"type": _TYPES[field.type]}
        if field.type == "str" and field.values:
            schema["enum"] = list(field.values)
        if field.null or (field.optional and not field.dims):
            schema = {"anyOf": [schema, {"type": "null"}]} if "enum" in schema else {"type": [schema["type"], "null"]}
    for _ in field.dims:
        schema = {"type": "array", "items": schema}
    if field.dims and field.optional:
        schema = {"anyOf": [schema, {"type": "null"}]}
    schema["description"] = _description(field)
    return schema


def _description(field: Field) -> str:
    """Return what a field is, for example "Displacement of the contact beyond the stop. Unit: m in SI. [overshoot]"."""
    dims = f" [{', '.join(field.dims)}]" if field.dims else ""
    when = f" Only {field.when}." if field.when else ""
    index = f" A position in `{field.index_of}`." if field.index_of else ""
    return field.description + index + field.unit_sentence + when + dims

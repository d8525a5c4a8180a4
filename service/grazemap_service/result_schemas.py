"""Results and jobs in the OpenAPI document: a schema for each process, from the schema of its result."""

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
"""The fields of the worker's `Numerics`."""
RESULT, TILE, JOB = "Result", "Tile", "Job"
# Processes whose tiles can be fetched, with the schema of a tile; a tile of a diagram is one of its map.
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
    """Return the components of results and tiles: `Result` and `Tile` are one of them, distinguished by `process`."""
    components: dict[str, Schema] = {"Numerics": _object("What computed a result.", dict.fromkeys(NUMERICS, _TEXT))}
    results: dict[str, list[str]] = {}
    for schema in SCHEMAS:
        components |= _records(schema)
        components[f"{schema.name}Result"] = _result(schema, schema.process, components)
        results.setdefault(schema.process, []).append(schema.name)
    forms = {process: f"{'Or'.join(names)}Result" for process, names in results.items()}
    for process, names in results.items():
        if len(names) > 1:
            components[forms[process]] = {"oneOf": [reference(f"{name}Result") for name in names]}
    components[RESULT] = one_of(forms)
    tiles = {process: f"{_stem(process)}Tile" for process in _TILES}
    for process, record in _TILES.items():
        components[tiles[process]] = _result(record, process, components, tile=True)
    components[TILE] = one_of(tiles)
    return components


def job_components(job: Schema) -> dict[str, Schema]:
    """Return the components of all jobs, from the schema of any: `Job` is one of them, distinguished by `process`."""
    components: dict[str, Schema] = {}
    names = {process: f"{_stem(process)}Job" for process in PROCESSES}
    for process, model in PROCESSES.items():
        own = {
            "process": {"type": "string", "const": process, "title": "Process"},
            "request": {"anyOf": [reference(model.__name__), {"type": "null"}], "title": "Request"},
        }
        components[names[process]] = {**job, "title": names[process], "properties": {**job["properties"], **own}}
    components[JOB] = one_of(names)
    return components


def job_name(process: str) -> str:
    """Return the name of the component of a process's job."""
    return f"{_stem(process)}Job"


def one_of(names: Mapping[str, str]) -> Schema:
    """Return the schema of what is one of some components, distinguished by `process`."""
    mapping = {process: reference(name)["$ref"] for process, name in names.items()}
    return {
        "oneOf": [reference(name) for name in names.values()],
        "discriminator": {"propertyName": "process", "mapping": mapping},
    }


def _stem(process: str) -> str:
    return PROCESSES[process].__name__.removesuffix("Request")


def _result(record: RecordSchema, process: str, components: dict[str, Schema], tile: bool = False) -> Schema:
    """Return the schema of a result in JSON, with process, schema and meta; its meta becomes a component."""
    meta = f"{_stem(process)}{'Tile' if tile else ''}Meta"
    own: dict[str, Schema] = {
        "process": {"type": "string", "const": process},
        "schema": {"type": "integer", "description": "The version of the layout of results."},
    }
    of_meta = {
        "request": reference(PROCESSES[process].__name__),
        "core_version": _TEXT,
        "numerics": reference("Numerics"),
        "units": {"type": "string", "enum": ["nondimensional", "SI"]},
    }
    if tile:
        place = {"index": {"type": "integer"}, "rows": _PAIR, "columns": _PAIR}
        of_meta["tile"] = _object("Position of the tile in the grid, stops excluded.", place)
    else:
        of_meta["notes"] = {"type": "array", "items": reference("Note")}
    components[meta] = _object("The metadata of a result.", {**own, **of_meta})
    in_json = _in_json(record) if not tile else ()
    fields = {one.name: _property(one) for one in (*record, *in_json) if not (tile and one.replaces)}
    required = [*own, *(one.name for one in (*record, *in_json) if not one.optional), "meta"]
    return _object(record.description, {**own, **fields, "meta": reference(meta)}, required)


def _in_json(record: RecordSchema) -> tuple[Field, ...]:
    """Return the fields that only the JSON of a result has."""
    return tuple(one.varied(when="") for one in record.in_json) if isinstance(record, ResultSchema) else ()


def _records(record: RecordSchema) -> Iterator[tuple[str, Schema]]:
    """Yield the components of the records in a record, however deep."""
    for one in (*record, *_in_json(record)):
        if isinstance(one.type, RecordSchema):
            yield from _records(one.type)
            fields = (*one.type, *_in_json(one.type))
            required = [inner.name for inner in fields if not inner.optional]
            properties = {inner.name: _property(inner) for inner in fields}
            yield one.type.name, _object(one.type.description, properties, required)


def _object(description: str, properties: Mapping[str, Schema], required: Sequence[str] | None = None) -> Schema:
    """Return the schema of an object; `required` is all properties where it is left out."""
    names = properties if required is None else required
    return {"type": "object", "description": description, "properties": dict(properties), "required": list(names)}


def _property(one: Field) -> Schema:
    schema: Schema
    if isinstance(one.type, RecordSchema | RequestDocument):
        name = one.type.name if isinstance(one.type, RecordSchema) else PROCESSES[one.type.process].__name__
        schema = reference(name)
        nullable = (one.null or one.optional) and not one.dims
        if nullable:
            schema = {"anyOf": [schema, {"type": "null"}]}
    elif one.type == "complex":
        schema = {"type": "array", "items": {"type": ["number", "null"]}, "minItems": 2, "maxItems": 2}
    else:
        schema = {"type": _TYPES[one.type]}
        if one.type == "str" and one.values:
            schema["enum"] = list(one.values)
        if one.null or (one.optional and not one.dims):
            schema = {"anyOf": [schema, {"type": "null"}]} if "enum" in schema else {"type": [schema["type"], "null"]}
    for _ in one.dims:
        schema = {"type": "array", "items": schema}
    if one.dims and one.optional:
        schema = {"anyOf": [schema, {"type": "null"}]}
    schema["description"] = _description(one)
    if one.replaces:
        schema["deprecated"] = True
    return schema


def _description(one: Field) -> str:
    dims = f" [{', '.join(one.dims)}]" if one.dims else ""
    unit = f" {one.unit} in SI." if one.unit else ""
    when = f" Only {one.when}." if one.when else ""
    index = f" A position in `{one.index_of}`." if one.index_of else ""
    return one.description + index + unit + when + dims

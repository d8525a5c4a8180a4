"""Documents of requests, computed in this process as a worker does, and checked by their schemas; and their results."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import VERSION, Result, schema_of
from grazemap.results.base import decode_result
from grazemap.results.basins import TILE_OF_BASINS
from grazemap.wire import ProcessRequest, parse_request
from grazemap_worker.computation import Computation
from grazemap_worker.processes import IMPLEMENTATIONS
from tests.support.document_problems import problems


def silent(done: int, total: int) -> None:
    """Nobody waits."""


def whole(process: str, body: dict[str, Any]) -> dict[str, Any]:
    """Return the document of a request that is computed at once, as clients decode it."""
    compute = IMPLEMENTATIONS[process].whole
    assert compute is not None
    document = compute(parse_request(process, body), silent)
    assert problems(schema_of(process, document), document) == []
    return decode_npz(encode_npz(document, {}))[0]


def as_job(request: ProcessRequest) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the document and the meta of a request, computed as a job is."""
    computation = Computation.of(request)
    count = computation.plan.tile_count if computation.has_tiles else 0
    return decode_npz(computation.result([computation.tile(index).data for index in range(count)], silent).data)


def tiled(process: str, body: dict[str, Any], *tile: int) -> dict[str, Any]:
    """Return the document of a request that is computed in tiles, of so many rows and columns, or as it is planned."""
    request, computes = parse_request(process, body), IMPLEMENTATIONS[process]
    plan = computes.plan(request)
    if tile:
        plan = plan.model_copy(update=dict(zip(("tile_rows", "tile_columns"), tile, strict=True)))
    assert computes.tile is not None
    assert computes.assembled is not None
    tiles = [computes.tile(request, rectangle) for rectangle in plan.tiles]
    of_tile = TILE_OF_BASINS if process.startswith("basin") else schema_of("unfolding-maps", tiles[0])
    assert [problems(of_tile, document) for document in tiles] == [[]] * len(tiles)
    document = computes.assembled(request, plan, tiles, silent)
    assert problems(schema_of(process, document), document) == []
    return document


def refused_at(process: str, body: dict[str, Any]) -> tuple[str, ...]:
    """Return where the error is for which a request is refused: the names of fields down to it."""
    with pytest.raises(ValidationError) as refused:
        parse_request(process, body)
    (error,) = refused.value.errors()
    where = (str(part) for part in error["loc"] if not str(part).startswith("["))
    return (*where, *error.get("ctx", {}).get("at", ()))


def result_of(process: str, body: dict[str, Any], document: dict[str, Any]) -> Result:
    """Return the result that a client makes of the document of a request."""
    meta = {"process": process, "schema": VERSION, "request": parse_request(process, body).canonical()}
    return decode_result(encode_npz(document, {**meta, "core_version": "0"}))

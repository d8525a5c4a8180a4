"""Documents of requests, computed in this process as a worker does, and checked by their schemas; and their results."""

from __future__ import annotations

from typing import Any

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import VERSION, Result, schema_of
from grazemap.results.base import decode_result
from grazemap.results.basins import TILE_OF_BASINS
from grazemap.wire import ProcessRequest, canonical, parse_request
from grazemap_worker.planning import Plan
from grazemap_worker.processes import PROCESSES
from tests.support.document_problems import problems


def silent(done: int, total: int) -> None:
    """Nobody waits."""


def whole(process: str, body: dict[str, Any]) -> dict[str, Any]:
    """Return the document of a request that is computed at once, as clients decode it."""
    compute = PROCESSES[process].whole
    assert compute is not None
    document = compute(parse_request(process, body), silent)
    assert problems(schema_of(process, document), document) == []
    return decode_npz(encode_npz(document, {}))[0]


def tiled(request: ProcessRequest, cut: Plan, name: str = "unfolding-maps") -> dict[str, Any]:
    """Return the document of a request that is computed in tiles."""
    process = PROCESSES[name]
    assert process.tile is not None
    assert process.assembled is not None
    tiles = [process.tile(request, tile) for tile in cut.tiles]
    of_tile = TILE_OF_BASINS if name.startswith("basin") else schema_of("unfolding-maps", tiles[0])
    assert [problems(of_tile, tile) for tile in tiles] == [[]] * len(tiles)
    document = process.assembled(request, cut, tiles, silent)
    assert problems(schema_of(name, document), document) == []
    return document


def result_of(process: str, body: dict[str, Any], document: dict[str, Any]) -> Result:
    """Return the result that a client makes of the document of a request."""
    meta = {"process": process, "schema": VERSION, "request": canonical(parse_request(process, body))}
    return decode_result(encode_npz(document, {**meta, "core_version": "0"}))

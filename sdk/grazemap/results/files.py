"""From bytes to results: the table of result classes, and reading files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from grazemap.codec import CodecError, Document, decode_npz
from grazemap.errors import ResultFormatError
from grazemap.results.base import RESULTS, Result
from grazemap.schema import schema_of
from grazemap.schema.documents import from_json


def result_class(process: str, document: Document) -> type[Result]:
    """Return the class of a process's result; trajectories come one by one or as a list. KeyError: no such process."""
    return RESULTS[schema_of(process, document).name]


def result_from(document: Document, meta: Mapping[str, Any]) -> Result:
    """Return the result object of a document. Raises ResultFormatError."""
    try:
        result = result_class(meta["process"], document).from_document(document, dict(meta))
        _ = result.units  # pictures and Datasets need the request
        return result
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise ResultFormatError("the document is no result that this version can read") from error


def decode_result(data: bytes) -> Result:
    """Return the result object of npz bytes. Raises ResultFormatError."""
    try:
        document, meta = decode_npz(data)
    except CodecError as error:
        raise ResultFormatError(str(error)) from error
    return result_from(document, meta)


def load(path: str | os.PathLike[str]) -> Result:
    """Read a result from a .npz or .json file, as `Result.save` and the service write them.

    Raises
    ------
    ResultFormatError
        The file, which is named, is not a result.
    OSError
        The file cannot be read.
    """
    data = Path(path).read_bytes()
    try:
        return _read(data)
    except ResultFormatError as error:
        raise ResultFormatError(f"{os.fspath(path)}: {error}") from error


def _read(data: bytes) -> Result:
    if not data.lstrip().startswith(b"{"):
        return decode_result(data)
    try:
        document = json.loads(data)
        meta = document.pop("meta")
        # these say in JSON what the meta says
        for name in ("process", "schema"):
            document.pop(name, None)
        arrays = from_json(schema_of(meta["process"], document), document)
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise ResultFormatError("not a grazemap result") from error
    return result_from(arrays, meta)

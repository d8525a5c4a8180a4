"""From bytes to results: the table of result classes, and reading files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from grazemap.codec import CodecError, Document, decode_npz
from grazemap.errors import ResultFormatError
from grazemap.results.base import Result
from grazemap.results.basins import Basins
from grazemap.results.curves import BifurcationCurves
from grazemap.results.diagrams import BifurcationDiagram
from grazemap.results.discontinuity import DiscontinuityMapping
from grazemap.results.grazing import CodimensionTwoPoints, GrazingCurve
from grazemap.results.orbits import OrbitBranch, PeriodicOrbit
from grazemap.results.trajectory import Trajectories, Trajectory
from grazemap.results.unfolding import UnfoldingMap
from grazemap.results.unfolding_diagram import UnfoldingDiagram

_CLASSES: tuple[type[Result], ...] = (
    GrazingCurve,
    CodimensionTwoPoints,
    DiscontinuityMapping,
    Trajectory,
    BifurcationDiagram,
    UnfoldingMap,
    UnfoldingDiagram,
    Basins,
    PeriodicOrbit,
    OrbitBranch,
    BifurcationCurves,
)
RESULTS: dict[str, type[Result]] = {cls.process: cls for cls in _CLASSES}


def result_class(process: str, document: Document) -> type[Result]:
    """Return the class of a process's result; trajectories come one by one or as a list. KeyError: no such process."""
    return Trajectories if process == Trajectories.process and "trajectories" in document else RESULTS[process]


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
        arrays = {name: _arrays(name, value) for name, value in document.items()}
    except (ValueError, KeyError, RecursionError, OverflowError) as error:
        raise ResultFormatError("not a grazemap result") from error
    return result_from(arrays, meta)


def _arrays(name: str, value: Any) -> Any:
    """Return a JSON value with its lists of numbers as arrays, as a document of the codec has them."""
    if isinstance(value, dict):
        return {key: _arrays(key, item) for key, item in value.items()}
    if not isinstance(value, list) or name in ("points", "attractors", "beyond"):
        return value
    if value and isinstance(value[0], dict):
        return [_arrays(name, item) for item in value]
    array = np.asarray(value)
    return np.asarray(value, dtype=np.float64) if array.dtype == object else array

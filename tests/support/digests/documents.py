"""Documents of requests as a client gets them, computed in this process, and their fields.

`python -m tests.support.digests.documents FOLDER --tiers quick maps more` computes those of some parts of the requests
in a process of its own, and writes a file for each; with `--plant NAME` with one error of `planted`, of `--only` some
processes.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from grazemap.codec import decode_npz, encode_npz, unpacked
from grazemap.wire import parse_request
from grazemap_core.numerics.jit.quick_compiler import hurry
from grazemap_worker.processes import IMPLEMENTATIONS
from tests.support.digests.requests import TIERS, Body
from tests.support.narrow import SETTINGS

ROOT = Path(__file__).parents[3]
# the text of a certificate is a document of its own
_CERTIFICATE = "certificate"


class Field(NamedTuple):
    """A field of a document: how the document has it ("array" where it is one), and its values, if it has any."""

    kind: str
    values: NDArray[Any] | None


Fields = dict[str, Field]
Results = dict[str, dict[str, Fields]]
"""Fields by their names, by the result's name, by the process."""


def named(*tiers: str) -> Iterator[tuple[str, str, Body]]:
    """Yield the process, the name and the request of each result of some parts."""
    for tier in tiers:
        for process, bodies in TIERS[tier].items():
            for name, body in bodies.items():
                yield process, name, body


def document(process: str, body: Body) -> bytes:
    """Return the document of a request, computed as a worker does, as npz."""
    request, computes = parse_request(process, body), IMPLEMENTATIONS[process]
    if computes.whole is not None:
        result = computes.whole(request, _silent)
    else:
        assert computes.tile is not None
        assert computes.assembled is not None
        plan = IMPLEMENTATIONS[process].plan(request)
        tiles = [decode_npz(encode_npz(computes.tile(request, tile), {}))[0] for tile in plan.tiles]
        result = computes.assembled(request, plan, tiles, _silent)
    return encode_npz(result, {})


def _silent(done: int, total: int) -> None:
    """Nobody waits."""


def fields(data: bytes) -> Fields:
    """Return the fields of a document."""
    arrays, meta = unpacked(data)
    kinds = meta["structure"]
    if _CERTIFICATE in arrays:
        certificate = _with_arrays(json.loads(str(arrays.pop(_CERTIFICATE))))
        return fields(encode_npz({_CERTIFICATE: certificate}, {})) | _fields(arrays, kinds)
    return _fields(arrays, kinds)


def _fields(arrays: Mapping[str, NDArray[Any]], kinds: Mapping[str, str]) -> Fields:
    return {name: Field(kinds.get(name, "array"), arrays.get(name)) for name in sorted({*arrays, *kinds})}


def _with_arrays(value: Any) -> Any:
    """Return what JSON has as a document: lists of values as arrays, uneven ones by their places."""
    if isinstance(value, dict):
        return {key: _with_arrays(item) for key, item in value.items()}
    if not isinstance(value, list):
        return value
    try:
        array = np.array(value)
    except ValueError:  # of several lengths
        return {str(place): _with_arrays(item) for place, item in enumerate(value)}
    return {str(place): _with_arrays(item) for place, item in enumerate(value)} if array.dtype == object else array


def here(*tiers: str) -> Results:
    """Return results that are computed in this process."""
    results: Results = {}
    for process, name, body in named(*tiers):
        results.setdefault(process, {})[name] = fields(document(process, body))
    return results


def at_the_level(folder: Path, *options: str) -> Results:
    """Return results that a process computes with the instructions of x86-64-v3 (`tests.support.narrow`)."""
    command = [sys.executable, "-m", "tests.support.digests.documents", str(folder), *options]
    subprocess.run(command, cwd=ROOT, env=os.environ | SETTINGS, check=True, timeout=3600)
    results: Results = {}
    for path in sorted(folder.glob("*/*.npz")):
        results.setdefault(path.parent.name, {})[path.stem] = fields(path.read_bytes())
    return results


def main() -> None:
    """Compute every result into the folder of the first argument."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.digests.documents")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--tiers", nargs="+", choices=TIERS, required=True)
    parser.add_argument("--only", nargs="+", choices=IMPLEMENTATIONS, help="these processes alone")
    parser.add_argument("--plant", help="the name of an error that is planted first")
    arguments = parser.parse_args()
    hurry()  # to compile what is not stored
    if arguments.plant:
        from tests.support.digests.planted import plant

        plant(arguments.plant)
    for process, name, body in named(*arguments.tiers):
        if process not in (arguments.only or IMPLEMENTATIONS):
            continue
        path = arguments.folder / process / f"{name}.npz"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(document(process, body))


if __name__ == "__main__":
    main()

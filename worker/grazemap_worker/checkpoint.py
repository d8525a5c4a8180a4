"""A folder that keeps the request and the finished tiles of a computation, so that it can go on, here or elsewhere.

    request.json              the process, the version of the core, and the canonical request
    tiles/12.0a1b2c3d4e5f.npz   tile 12, computed with the numerics of this fingerprint

A tile is renamed into its place when it is complete. Tiles of other numerics are kept beside one another and never
joined.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any
from uuid import uuid4

from grazemap.errors import CheckpointError
from grazemap.wire import ProcessRequest, parse_request
from grazemap_worker.computation import Computation

_REQUEST, _TILES = "request.json", "tiles"


class Checkpoint:
    """A folder with the request and the finished tiles of a computation."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @classmethod
    def create(cls, folder: Path, computation: Computation) -> Checkpoint:
        """Return the folder of a computation; it is made, or has the same request. Raises CheckpointError, OSError."""
        checkpoint, content = cls(folder), _content(computation)
        (folder / _TILES).mkdir(parents=True, exist_ok=True)
        if not (folder / _REQUEST).exists():
            _write(folder / _REQUEST, json.dumps(content, indent=1).encode())
        stored = checkpoint._read()
        for name, value in content.items():
            if stored.get(name) != value:
                raise CheckpointError(f"{folder} is the folder of another computation: its {name} differs")
        return checkpoint

    def request(self) -> ProcessRequest:
        """Return the request of the folder. Raises CheckpointError."""
        stored = self._read()
        try:
            return parse_request(stored["process"], stored["request"])
        except (LookupError, ValueError) as error:
            raise CheckpointError(f"{self._folder / _REQUEST} has no request of this version") from error

    def tile(self, index: int, fingerprint: str) -> bytes | None:
        """Return the npz of a tile that was computed with these numerics; None if there is none."""
        try:
            return self._path(index, fingerprint).read_bytes()
        except FileNotFoundError:
            return None

    def write(self, index: int, fingerprint: str, data: bytes) -> None:
        """Keep a tile. Raises OSError."""
        _write(self._path(index, fingerprint), data)

    def others(self, fingerprint: str) -> list[str]:
        """Return the fingerprints of other numerics of which there are tiles."""
        names = {path.name.split(".")[1] for path in (self._folder / _TILES).glob("*.*.npz")}
        return sorted(names - {fingerprint})

    def _path(self, index: int, fingerprint: str) -> Path:
        return self._folder / _TILES / f"{index}.{fingerprint}.npz"

    def _read(self) -> dict[str, Any]:
        path = self._folder / _REQUEST
        try:
            stored = json.loads(path.read_bytes())
        except FileNotFoundError:
            raise CheckpointError(f"{self._folder} has no {_REQUEST}: it is not the folder of a computation") from None
        except ValueError as error:
            raise CheckpointError(f"{path} is not JSON: {error}") from None
        if not isinstance(stored, dict):
            raise CheckpointError(f"{path} is not an object")
        return stored


def _content(computation: Computation) -> dict[str, Any]:
    return {
        "process": computation.process,
        "core_version": computation.core_version,
        "request": computation.canonical,
    }


def _write(path: Path, content: bytes) -> None:
    """Write a file that is complete or not there."""
    unfinished = path.with_name(f"{path.name}.{uuid4().hex[:16]}.tmp")
    try:
        unfinished.write_bytes(content)
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise

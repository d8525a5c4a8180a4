"""A folder that keeps the request and the finished tiles of a computation, so that it can go on, here or elsewhere.

    request.json                    the process, the version of the core, and the canonical request
    tiles/12.0a1b2c3d4e5f6071.npz   tile 12, computed with the numerics of this fingerprint

A file is renamed into its place when it is complete. Tiles of different numerics lie beside one another, and are never
joined. A tile that is damaged, or that is of another request, counts as missing.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from grazemap.codec import CodecError, decode_npz
from grazemap.errors import CheckpointError
from grazemap.whole_files import unfinished
from grazemap.wire import ProcessRequest, parse_request
from grazemap_worker.computation import Computation

_REQUEST, _TILES = "request.json", "tiles"


class Checkpoint:
    """The folder of a computation."""

    def __init__(self, folder: Path, computation: Computation) -> None:
        self._folder, self._computation = folder, computation

    @classmethod
    def create(cls, folder: Path, computation: Computation) -> Checkpoint:
        """Return the folder of a computation; it is made, or has the same request. Raises CheckpointError, OSError."""
        (folder / _TILES).mkdir(parents=True, exist_ok=True)
        content = {
            "process": computation.process,
            "core_version": computation.core_version,
            "request": computation.canonical,
        }
        # of two processes that make the folder at once, the first has it
        with _unfinished(folder / _REQUEST, json.dumps(content, indent=1).encode()) as path:
            try:
                os.link(path, folder / _REQUEST)
            except FileExistsError:
                pass
            except OSError:  # a file system without links
                if not (folder / _REQUEST).exists():
                    os.replace(path, folder / _REQUEST)
        stored = _read(folder)
        for name, value in content.items():
            if stored.get(name) != value:
                raise CheckpointError(f"{folder} is the folder of another computation: its {name} differs")
        return cls(folder, computation)

    @staticmethod
    def request(folder: Path) -> ProcessRequest:
        """Return the request of a folder. Raises CheckpointError."""
        stored = _read(folder)
        try:
            return parse_request(stored["process"], stored["request"])
        except (LookupError, ValueError) as error:
            raise CheckpointError(f"{folder / _REQUEST} has no request of this version") from error

    def tile(self, index: int, fingerprint: str) -> bytes | None:
        """Return the npz of a tile that was computed with these numerics; None if there is none that is undamaged."""
        try:
            data = self._path(index, fingerprint).read_bytes()
            meta = decode_npz(data)[1]
        except (FileNotFoundError, CodecError):
            return None
        of_this = meta.get("request") == self._computation.canonical
        return data if of_this and meta.get("tile") == self._computation.plan.place(index) else None

    def write(self, index: int, fingerprint: str, data: bytes) -> None:
        """Keep a tile. Raises OSError."""
        path = self._path(index, fingerprint)
        with _unfinished(path, data) as beside:
            os.replace(beside, path)

    def others(self, fingerprint: str) -> list[str]:
        """Return the fingerprints of other numerics of which there are tiles."""
        names = {path.name.split(".")[1] for path in (self._folder / _TILES).glob("[0-9]*.*.npz")}
        return sorted(names - {fingerprint})

    def _path(self, index: int, fingerprint: str) -> Path:
        return self._folder / _TILES / f"{index}.{fingerprint}.npz"


def _read(folder: Path) -> dict[str, Any]:
    path = folder / _REQUEST
    try:
        stored = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise CheckpointError(f"{folder} has no {_REQUEST}: it is not the folder of a computation") from None
    except ValueError as error:
        raise CheckpointError(f"{path} is not JSON: {error}") from None
    if not isinstance(stored, dict):
        raise CheckpointError(f"{path} is not an object")
    return stored


@contextmanager
def _unfinished(path: Path, content: bytes) -> Iterator[Path]:
    """Write a file, to the disk, beside another one, to be renamed in this block; remove it if it was not."""
    with unfinished(path) as beside:
        with beside.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        yield beside

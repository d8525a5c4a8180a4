"""The append-only file of a Redis server: its parts, and the repair of a damaged end.

From Redis 7 on the file has several parts, which a manifest lists; before, it was one file. After a power cut, a part
may end with zeros, with garbage or with half a command. The server itself repairs only half a command. Its check
reports how many bytes of a part are intact. The repair cuts off everything that follows, including later parts. The
data are then those of an earlier moment.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

MANIFEST = "appendonlydir/appendonly.aof.manifest"
SINGLE_FILE = "appendonly.aof"
SNAPSHOTS = (b"REDIS", b"VALKEY")
"""The first bytes of a snapshot. The server's check of an append-only file does not recognise every snapshot."""
KEPT = "damaged"
"""The folder, beside the file, for copies of damaged parts."""
MAX_KEPT = 3


class StorageError(RuntimeError):
    """The data folder cannot be used as asked; the message is for users."""


class Repair(NamedTuple):
    """A repair of a damaged append-only file."""

    file: Path
    """The first damaged part."""
    lost_bytes: int
    """Number of bytes that were cut off."""
    original: Path
    """The folder with copies of the damaged parts."""


def parts(folder: Path) -> list[Path]:
    """Return the parts of the append-only file in a folder, in the order in which the server reads them.

    Raises StorageError where the manifest lists none.
    """
    manifest, paths = folder / MANIFEST, [folder / SINGLE_FILE]
    if manifest.is_file():
        lines = [line.split() for line in manifest.read_text("utf-8", "replace").splitlines()]
        # files of type h, for history, are not read
        paths = [manifest.with_name(words[1]) for words in lines if words[:1] == ["file"] and words[-1] != "h"]
        if not paths:
            raise StorageError(f"{manifest} is damaged, as it lists no file: restore a backup")
    return [path for path in paths if path.is_file()]


def repair(folder: Path, program: Path) -> Repair | None:
    """Copy the damaged parts of the append-only file in a folder, and cut off the damaged end; None: no damage.

    `program` is the server, which also checks the file. Raises StorageError if the file cannot be checked or copied,
    for example on a full disk; then nothing is cut off.
    """
    intact: dict[Path, int] = {}
    for part in parts(folder):
        length = 0 if intact else _intact(part, program)
        if length < part.stat().st_size:
            intact[part] = length
    if not intact:
        return None
    kept = folder / KEPT / f"{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}"
    try:
        kept.mkdir(parents=True)
        for old in sorted(kept.parent.iterdir())[:-MAX_KEPT]:
            shutil.rmtree(old)
        for part in intact:
            shutil.copy2(part, kept)
    except OSError as error:
        raise StorageError(f"{kept} cannot have copies of the damaged files: {error.strerror}") from None
    lost = sum(part.stat().st_size - length for part, length in intact.items())
    for part, length in intact.items():
        os.truncate(part, length)
    return Repair(next(iter(intact)), lost, kept)


def _intact(part: Path, program: Path) -> int:
    """Return the number of intact bytes at the beginning of a part, which the server can read."""
    size = part.stat().st_size
    if not size:
        return 0  # as in a new folder; some versions refuse to check an empty file
    with part.open("rb") as stream:
        if stream.read(6).startswith(SNAPSHOTS):
            raise StorageError(f"{part} is a snapshot, of which no end can be cut off")
    # the server program, also of Valkey, checks the file if it is called by this name
    command = ["redis-check-aof", str(part)]
    done = subprocess.run(command, executable=program, capture_output=True, text=True, errors="replace", check=False)
    analyzed = re.search(r"\bok_up_to=(\d+)", done.stdout)
    if done.returncode != 0 and analyzed is None:
        raise StorageError(f"{part} cannot be checked:\n{(done.stdout + done.stderr).strip()}")
    return int(analyzed[1]) if done.returncode != 0 and analyzed else size

"""The append-only file of a Redis server: its parts, and the repair of a damaged end.

From Redis 7 on the file has several parts, which a manifest lists; before, it was one file. After a power cut, a part
may end with zeros, with garbage or with an incomplete command, and the server itself repairs only the last of these.
The program redis-check-aof reports how many bytes of a part are intact. The repair cuts off everything that follows,
including later parts. The data are then as they were a little earlier.
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
"""The first bytes of a snapshot. `_intact` looks for them, as the server's check does not recognise every snapshot."""
COPIES_FOLDER = "damaged"
"""The folder for copies of damaged parts, in the folder of the server's data."""
MAX_COPIES = 3
"""Number of repairs whose copies are kept."""


class StorageError(RuntimeError):
    """The data folder cannot be used as asked; the message is for users."""


class Repair(NamedTuple):
    """A repair of a damaged append-only file."""

    first_damaged: Path
    """The first damaged part."""
    lost_bytes: int
    """Number of bytes that were cut off."""
    copies: Path
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
    kept_lengths: dict[Path, int] = {}  # of the damaged parts, and of all parts after the first of them
    for part in parts(folder):
        length = 0 if kept_lengths else _intact(part, program)
        if length < part.stat().st_size:
            kept_lengths[part] = length
    if not kept_lengths:
        return None
    copies = folder / COPIES_FOLDER / f"{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}"
    try:
        copies.mkdir(parents=True)
        for part in kept_lengths:
            shutil.copy2(part, copies)
        for old in sorted(copies.parent.iterdir())[:-MAX_COPIES]:
            shutil.rmtree(old)
    except OSError as error:
        shutil.rmtree(copies, ignore_errors=True)  # an incomplete copy must not count as one of `MAX_COPIES`
        raise StorageError(f"the damaged files cannot be copied to {copies}: {error.strerror}") from None
    lost = sum(part.stat().st_size - length for part, length in kept_lengths.items())
    for part, length in kept_lengths.items():
        os.truncate(part, length)
    return Repair(next(iter(kept_lengths)), lost, copies)


def _intact(part: Path, program: Path) -> int:
    """Return the number of intact bytes at the beginning of a part, which the server can read."""
    size = part.stat().st_size
    if not size:
        return 0  # as in a new folder; some versions refuse to check an empty file
    with part.open("rb") as stream:
        if stream.read(6).startswith(SNAPSHOTS):
            raise StorageError(f"{part} is a snapshot, whose end cannot be cut off: restore a backup")
    # the program of the server, Redis or Valkey, is redis-check-aof if it is started under this name
    command = ["redis-check-aof", str(part)]
    done = subprocess.run(command, executable=program, capture_output=True, text=True, errors="replace", check=False)
    if done.returncode == 0:
        return size
    analyzed = re.search(r"\bok_up_to=(\d+)", done.stdout)
    if analyzed is None:
        raise StorageError(f"{part} cannot be checked:\n{(done.stdout + done.stderr).strip()}")
    return int(analyzed[1])

"""The append-only file of a Redis server: its parts, what is damaged in them, and its repair.

From Redis 7 on it has several parts, which a manifest lists; before, it was one file. A power cut can leave a part with
a tail of zeros, of garbage or of half a command. The server's own check says how much of a part is intact, and whatever
follows that is cut off, later parts included: the data are those of an earlier moment.
"""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

MANIFEST = "appendonlydir/appendonly.aof.manifest"
SINGLE_FILE = "appendonly.aof"
KEPT = "damaged"
"""The folder, beside the file, of the originals of damaged parts."""
MOST_KEPT = 3


class StorageError(RuntimeError):
    """The data folder cannot be used as asked; the message is for users."""


def listed(manifest: str) -> dict[str, str]:
    """Return the names of the parts in a manifest, in the order in which they are read, each with its line."""
    lines = (line.split() for line in manifest.splitlines() if line.startswith("file "))
    return {words[1]: " ".join(words) for words in lines if words[-1] != "h"}  # history, which is not read


def parts(folder: Path) -> list[Path]:
    """Return the parts of the append-only file in a folder, in the order in which the server reads them.

    Raises
    ------
    StorageError
        The manifest lists none.
    """
    manifest, paths = folder / MANIFEST, [folder / SINGLE_FILE]
    if manifest.is_file():
        paths = [manifest.with_name(name) for name in listed(manifest.read_text("utf-8", "replace"))]
        if not paths:
            raise StorageError(f"{manifest} is damaged, as it lists no file: restore a backup")
    return [path for path in paths if path.is_file()]


def damage(folder: Path, program: Path) -> dict[Path, int]:
    """Return the damaged part, with the number of its first bytes that are intact, and with 0 all parts after it.

    Parameters
    ----------
    folder : Path
        Of the append-only file.
    program : Path
        The server, which is also the tool that checks.

    Raises
    ------
    StorageError
        The check fails.
    """
    found: dict[Path, int] = {}
    for part in parts(folder):
        intact = 0 if found else _intact(part, program)
        if intact < part.stat().st_size:
            found[part] = intact
    return found


def cut(damaged: Mapping[Path, int]) -> int:
    """Cut off what is damaged; return how many bytes that are."""
    lost = 0
    for part, intact in damaged.items():
        lost += part.stat().st_size - intact
        with part.open("r+b") as stream:
            stream.truncate(intact)
    return lost


def keep(folder: Path, damaged: Mapping[Path, int]) -> Path:
    """Copy damaged parts into a new folder and return it; of such folders the last `MOST_KEPT` remain.

    Raises
    ------
    StorageError
        The copies cannot be written, for example on a full disk.
    """
    kept = folder / KEPT / f"{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}"
    try:
        kept.mkdir(parents=True)
        for old in sorted(kept.parent.iterdir())[:-MOST_KEPT]:
            shutil.rmtree(old)
        for part in damaged:
            shutil.copy2(part, kept)
    except OSError as error:
        raise StorageError(f"{kept} cannot have copies of the damaged files: {error.strerror}") from None
    return kept


def _intact(part: Path, program: Path) -> int:
    """Return how many of the first bytes of a part the server can read."""
    size = part.stat().st_size
    if not size:
        return 0  # as of a new folder; checks of some versions refuse it
    # a server is the check when it is called by this name, Valkey too
    command = ["redis-check-aof", str(part)]
    done = subprocess.run(command, executable=program, capture_output=True, text=True, errors="replace", check=False)
    analyzed = re.search(r"\bok_up_to=(\d+)", done.stdout)
    if done.returncode != 0 and analyzed is None:
        raise StorageError(f"{part} cannot be checked:\n{(done.stdout + done.stderr).strip()}")
    return int(analyzed[1]) if done.returncode != 0 and analyzed else size

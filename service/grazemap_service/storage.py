"""`python -m grazemap_service.storage repair | backup | restore`: a stack's data folder, kept and mended.

A backup is a tar archive of the append-only file. It is made of open files, so that a server which writes meanwhile, or
replaces the file by a shorter one, does not disturb it: at most the last command in it is incomplete.
"""

from __future__ import annotations

import argparse
import fcntl
import io
import os
import shutil
import sys
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO, TextIO

from grazemap_service import append_only
from grazemap_service.append_only import MANIFEST, SINGLE_FILE, StorageError
from grazemap_service.redis_server import NoRedisError, find_redis_server

REDIS = "redis"
"""The folder of the embedded Redis in a data folder."""
_LOCK = "lock"
# Attempts to open the parts before the server, which has made new ones, removes them.
_ATTEMPTS = 10


def opened_lock(data: Path) -> TextIO:
    """Make the data folder and return the file in it that its stack keeps locked. Raises StorageError."""
    try:
        data.mkdir(parents=True, exist_ok=True, mode=0o700)
        return (data / _LOCK).open("w")
    except OSError as error:
        raise StorageError(f"cannot use the data folder {data}: {error.strerror}") from None


def locked(lock: TextIO) -> bool:
    """Lock the file of `opened_lock`; return whether that succeeded, as no stack and no Redis of one holds it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def repair(data: Path) -> str:
    """Cut off the damaged end of the append-only file, after copying it; return a sentence that says what was done."""
    with _alone(_existing(data)):
        redis = data / REDIS
        damaged = append_only.damage(redis, find_redis_server())
        if not damaged:
            return f"{data}: nothing is damaged"
        kept, lost = append_only.keep(redis, damaged), append_only.cut(damaged)
        return f"{next(iter(damaged))} is damaged: {lost} bytes are cut off; the original is in {kept}"


def backup(data: Path, output: Path) -> str:
    """Write the data of a folder into a tar archive, also while a stack runs on it; return a sentence about it."""
    partial = output.with_name(f"{output.name}.part")
    with ExitStack() as opened:
        files = _opened_parts(_existing(data) / REDIS, opened)
        try:
            with partial.open("wb") as target, tarfile.open(fileobj=target, mode="w") as archive:
                os.fchmod(target.fileno(), 0o600)
                for name, stream in files.items():
                    entry = tarfile.TarInfo(name)
                    entry.mode, entry.size = 0o600, stream.seek(0, os.SEEK_END)
                    stream.seek(0)
                    archive.addfile(entry, stream)
                archive.close()
                os.fsync(target.fileno())
            partial.replace(output)
        finally:
            partial.unlink(missing_ok=True)
    return f"{output}: {output.stat().st_size} bytes"


def restore(archive: Path, data: Path, force: bool = False) -> str:
    """Make a data folder of a backup; return a sentence about it. With `force` the folder of before is renamed."""
    replaced = data.exists() and any(data.iterdir())
    if replaced and not force:
        raise StorageError(f"{data} is not empty: give another folder, or --force, which renames this one")
    data.parent.mkdir(parents=True, exist_ok=True)
    new = Path(tempfile.mkdtemp(prefix=f"{data.name}.restored-", dir=data.parent))
    try:
        _extract(archive, new / REDIS)
        left_out = append_only.cut(append_only.damage(new / REDIS, find_redis_server()))
        said = f"{data}: restored from {archive}"
        if left_out:
            said += f"; its last {left_out} bytes are no whole command and are left out"
        if replaced:
            aside = data.with_name(f"{data.name}.before-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}")
            with _alone(data):
                data.rename(aside)
            said += f"; the folder of before is {aside}"
        new.rename(data)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return said


@contextmanager
def _alone(data: Path) -> Iterator[None]:
    """Lock a data folder for the duration of a block. Raises StorageError where a stack runs on it."""
    with opened_lock(data) as lock:
        if not locked(lock):
            raise StorageError(f"a stack runs on the data folder {data}: stop it first")
        yield


def _existing(data: Path) -> Path:
    """Return a data folder that has an append-only file. Raises StorageError for another."""
    if not append_only.parts(data / REDIS):
        raise StorageError(f"{data} is not the data folder of a stack with an embedded Redis")
    return data


def _opened_parts(folder: Path, opened: ExitStack) -> dict[str, BinaryIO]:
    """Return the files of an append-only file by their names, open.

    The server appends to the last part alone, and makes new files in place of old ones: those in one manifest belong
    together, even if they are removed meanwhile. Raises StorageError where one is missing.
    """
    manifest = folder / MANIFEST
    for _ in range(_ATTEMPTS):
        try:
            if not manifest.exists():
                return {SINGLE_FILE: opened.enter_context((folder / SINGLE_FILE).open("rb"))}
            read = append_only.listed(manifest.read_text("utf-8"))
            files: dict[str, BinaryIO] = {MANIFEST: io.BytesIO("".join(f"{line}\n" for line in read.values()).encode())}
            for name in read:
                path = manifest.with_name(name)
                files[str(path.relative_to(folder))] = opened.enter_context(path.open("rb"))
            return files
        except FileNotFoundError:  # replaced meanwhile
            continue
    raise StorageError(f"{manifest} lists files that are missing: restore a backup")


def _extract(archive: Path, folder: Path) -> None:
    """Write the files of a backup into a new folder. Raises StorageError where it is none."""
    allowed = {Path(MANIFEST).parent, Path(SINGLE_FILE).parent}
    try:
        with tarfile.open(archive) as entries:
            for entry in entries:
                path, content = Path(entry.name), entries.extractfile(entry) if entry.isreg() else None
                if content is None or path.parent not in allowed or not path.name.startswith(SINGLE_FILE):
                    raise StorageError(f"{archive} is not a backup: it has {entry.name}")
                (folder / path).parent.mkdir(parents=True, exist_ok=True, mode=0o700)
                with (folder / path).open("xb") as target:
                    shutil.copyfileobj(content, target)
    except (tarfile.TarError, EOFError) as error:
        raise StorageError(f"{archive} is not a backup: {error}") from None
    if not append_only.parts(folder):
        raise StorageError(f"{archive} is not a backup: it has no append-only file")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m grazemap_service.storage", description=__doc__)
    parser.add_argument("command", choices=("repair", "backup", "restore"))
    parser.add_argument("file", type=Path, nargs="?", help="the backup to write or to read")
    parser.add_argument("--data", type=Path, required=True, help="the data folder")
    parser.add_argument("--force", action="store_true", help="restore into a folder that is not empty; it is renamed")
    given = parser.parse_args(arguments)
    if given.file is None and given.command != "repair":
        parser.error("the backup is missing")
    data = given.data.resolve()
    try:
        match given.command:
            case "repair":
                said = repair(data)
            case "backup":
                said = backup(data, given.file)
            case _:
                said = restore(given.file, data, given.force)
    except (StorageError, NoRedisError, OSError) as error:
        sys.stderr.write(f"grazemap: {error}\n")
        return 1
    sys.stdout.write(f"{said}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

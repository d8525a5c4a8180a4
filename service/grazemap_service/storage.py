"""`python -m grazemap_service.storage repair | backup | restore`: repair and backup of a stack's data folder.

A backup is a snapshot that the embedded Redis makes, also while a stack runs on the folder.
"""

from __future__ import annotations

import argparse
import fcntl
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from redis import Redis
from redis.exceptions import RedisError, ResponseError

from grazemap_service import append_only
from grazemap_service.append_only import SINGLE_FILE, SNAPSHOTS, StorageError
from grazemap_service.redis_server import SOCKET_LINK, NoRedisError, RedisServer, find_redis_server
from grazemap_worker.store import connect

REDIS = "redis"
"""The folder of the embedded Redis in a data folder."""
_LOCK = "lock"
# The file in the folder of Redis to which Redis writes a snapshot.
_SNAPSHOT = "dump.rdb"
_POLL_SECONDS = 0.05
# Maximum number of refusals of Redis to write a file while it writes no other file. Some are normal, because it may
# just have finished another one.
_MAX_REFUSED = 20


def opened_lock(data: Path) -> TextIO:
    """Create the data folder; return the open lock file in it, which a stack keeps locked. Raises StorageError."""
    try:
        data.mkdir(parents=True, exist_ok=True, mode=0o700)
        return (data / _LOCK).open("w")
    except OSError as error:
        raise StorageError(f"cannot use the data folder {data}: {error.strerror}") from None


def locked(lock: TextIO) -> bool:
    """Lock a file of `opened_lock`; return False if a stack, or the Redis of a stack, holds the lock."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def repair(data: Path) -> str:
    """Copy the append-only file and cut off its damaged end; return a sentence that says what was done."""
    with _locked_folder(_existing(data)):
        done = append_only.repair(data / REDIS, find_redis_server())
    if done is None:
        return f"{data}: nothing is damaged"
    return f"{done.first_damaged} is damaged: {done.lost_bytes} bytes are cut off; the original is in {done.copies}"


def backup(data: Path, output: Path) -> str:
    """Write a snapshot of the data of a folder, also while a stack runs on it; return a sentence that says so."""
    partial = output.with_name(f"{output.name}.part")
    snapshot = _existing(data) / REDIS / _SNAPSHOT
    with _redis_of(data) as redis:
        _write(redis, "BGSAVE", "rdb_bgsave_in_progress", "rdb_last_bgsave_status")
        try:
            with snapshot.open("rb") as source, partial.open("wb") as target:
                os.fchmod(target.fileno(), 0o600)
                shutil.copyfileobj(source, target)
                target.flush()
                os.fsync(target.fileno())
            partial.replace(output)
        finally:
            partial.unlink(missing_ok=True)
            snapshot.unlink(missing_ok=True)
    return f"{output}: {output.stat().st_size} bytes"


def restore(file: Path, data: Path, force: bool = False) -> str:
    """Create a data folder from a backup; return a sentence that says so. With `force`, an old folder is renamed."""
    replaced = data.exists() and any(data.iterdir())
    if replaced and not force:
        raise StorageError(f"{data} is not empty: give another folder, or --force, which renames this one")
    data.parent.mkdir(parents=True, exist_ok=True)
    new = Path(tempfile.mkdtemp(prefix=f"{data.name}.restored-", dir=data.parent))
    try:
        _load(file, new / REDIS)
        message = f"{data}: restored from {file}"
        if replaced:
            aside = data.with_name(f"{data.name}.before-{datetime.now(UTC):%Y%m%dT%H%M%S.%fZ}")
            with _locked_folder(data):
                data.rename(aside)
            message += f"; the folder of before is {aside}"
        new.rename(data)
    finally:
        shutil.rmtree(new, ignore_errors=True)
    return message


@contextmanager
def _locked_folder(data: Path) -> Iterator[None]:
    """Lock a data folder during a block. Raises StorageError if a stack runs on it."""
    with opened_lock(data) as lock:
        if not locked(lock):
            raise StorageError(f"a stack runs on the data folder {data}: stop it first")
        yield


@contextmanager
def _redis_of(data: Path) -> Iterator[Redis]:
    """Yield a client of the Redis on a data folder. If no stack runs on it, start a Redis for this block."""
    with opened_lock(data) as lock:
        if locked(lock):
            with RedisServer(data / REDIS, inherited=(lock.fileno(),)) as server, connect(server.url) as redis:
                yield redis
        else:
            with connect(f"unix://{(data / REDIS / SOCKET_LINK).readlink()}") as redis:
                yield redis


def _existing(data: Path) -> Path:
    """Return a data folder. Raises StorageError if it has no append-only file."""
    if not append_only.parts(data / REDIS):
        raise StorageError(f"{data} is not the data folder of a stack with an embedded Redis")
    return data


def _write(redis: Redis, command: str, running: str, status: str) -> None:
    """Have Redis write a file, and wait for the end; if Redis writes another file, that is finished first.

    `running` and `status` are the fields of INFO for the progress and the outcome. Raises StorageError.
    """
    refused = 0
    while True:
        try:
            redis.execute_command(command)  # type: ignore[no-untyped-call]
            break
        except ResponseError:
            info = redis.info("persistence")
            refused += not (info["rdb_bgsave_in_progress"] or info["aof_rewrite_in_progress"])
            if refused > _MAX_REFUSED:
                raise
        time.sleep(_POLL_SECONDS)
    while (info := redis.info("persistence"))[running]:
        time.sleep(_POLL_SECONDS)
    if info[status] != "ok":
        raise StorageError("Redis cannot write, for example as its disk is full: its log says why")


def _load(file: Path, folder: Path) -> None:
    """Create the folder of a Redis from a backup, which the server checks when it reads it. Raises StorageError."""
    with file.open("rb") as stream:
        if not stream.read(6).startswith(SNAPSHOTS):
            raise StorageError(f"{file} is not a backup")
    folder.mkdir(mode=0o700)
    # every version reads a snapshot as the beginning of its append-only file
    shutil.copyfile(file, folder / SINGLE_FILE)
    try:
        with RedisServer(folder) as server, connect(server.url) as redis:
            # replace the snapshot by a file of commands
            _write(redis, "BGREWRITEAOF", "aof_rewrite_in_progress", "aof_last_bgrewrite_status")
    except (NoRedisError, StorageError) as error:
        raise StorageError(f"{file} is not a backup that this Redis can read: {error}") from None


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m grazemap_service.storage", description=__doc__)
    parser.add_argument("command", choices=("repair", "backup", "restore"))
    parser.add_argument("file", type=Path, nargs="?", help="the backup to write or to read")
    parser.add_argument("--data", type=Path, required=True, help="the data folder")
    parser.add_argument("--force", action="store_true", help="restore into a folder that is not empty; it is renamed")
    options = parser.parse_args(arguments)
    if options.file is None and options.command != "repair":
        parser.error("the backup is missing")
    data = options.data.resolve()
    try:
        match options.command:
            case "repair":
                message = repair(data)
            case "backup":
                message = backup(data, options.file)
            case _:
                message = restore(options.file, data, options.force)
    except (StorageError, NoRedisError, RedisError, OSError) as error:
        sys.stderr.write(f"grazemap: {error}\n")
        return 1
    sys.stdout.write(f"{message}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

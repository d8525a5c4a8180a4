"""The data folder: damaged tails of the append-only file, repair, backup and restore, bounded logs and memory."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import random
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import redis.exceptions

from grazemap_service import append_only, children, storage
from grazemap_service.append_only import StorageError
from grazemap_service.children import PythonChild
from grazemap_service.redis_server import NoRedisError, RedisServer, find_redis_server
from grazemap_service.settings import StackSettings
from grazemap_worker.store import connect
from grazemap_worker.watchdog import WatchdogSocket
from tests.support.watching import until

MANIFEST = "appendonlydir/appendonly.aof.manifest"
BASE = "appendonlydir/appendonly.aof.1.base.aof"
PART = "appendonlydir/appendonly.aof.1.incr.aof"
SEEDS = [seed if seed < 3 else pytest.param(seed, marks=pytest.mark.thorough) for seed in range(100)]


class Written(NamedTuple):
    """An append-only file: its parts, and how long the last one was after each key."""

    manifest: bytes
    part: bytes
    ends: dict[bytes, int]

    def put(self, folder: Path, part: bytes) -> Path:
        """Make a data folder of it, with another part; return the path of that part."""
        (folder / MANIFEST).parent.mkdir(parents=True)
        (folder / MANIFEST).write_bytes(self.manifest)
        (folder / BASE).touch()
        (folder / PART).write_bytes(part)
        return folder / PART

    def kept(self, length: int) -> set[bytes]:
        """The keys that the first bytes of the part have."""
        return {key for key, end in self.ends.items() if end <= length}


class Ended(NamedTuple):
    """How a command has ended."""

    code: int
    output: str


def keys_in(folder: Path) -> set[bytes]:
    """The keys that a server on a data folder has."""
    with RedisServer(folder) as server:
        return set(connect(server.url).keys("key-*"))


Command = Callable[..., Ended]


@pytest.fixture
def command(capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a command as the command line does, but for the process of its own."""

    def run(*words: object) -> Ended:
        return Ended(storage.main([*map(str, words)]), "".join(capsys.readouterr()))

    return run


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """What a server has written of forty values, every other one by a script, which is a transaction in the file."""
    folder = tmp_path_factory.mktemp("written")
    ends, numbers = {}, random.Random(0)
    with RedisServer(folder) as server:
        client = connect(server.url)
        client.config_set("appendfsync", "always")  # otherwise a write may wait for the last one to reach the disk
        for k in range(40):
            key, value = b"key-%d" % k, numbers.randbytes(numbers.randrange(1, 3000))
            if k % 2:
                client.eval("redis.call('INCR', 'clock') redis.call('SET', ARGV[1], ARGV[2])", 0, key, value)
            else:
                client.set(key, value)
            ends[key] = (folder / PART).stat().st_size
    return Written((folder / MANIFEST).read_bytes(), (folder / PART).read_bytes(), ends)


def damaged(written: Written, seed: int) -> tuple[bytes, int]:
    """A part as a power cut leaves it, with a tail of zeros, of garbage or of half a command, and its intact length."""
    numbers = random.Random(seed)
    intact = len(written.part) - numbers.choice((0, numbers.randrange(1, 8000)))
    match seed % 3:
        case 0:
            tail = bytes(numbers.randrange(1, 9000))
        case 1:
            tail = numbers.randbytes(numbers.randrange(1, 9000))
        case _:
            intact, tail = numbers.choice(sorted(set(range(1, len(written.part))) - set(written.ends.values()))), b""
    return written.part[:intact] + tail, intact


@pytest.mark.parametrize("seed", SEEDS)
def test_a_damaged_tail_is_cut_off_and_nothing_else(
    written: Written, tmp_path: Path, logs: list[Any], seed: int
) -> None:
    content, intact = damaged(written, seed)
    part = written.put(tmp_path, content)
    assert keys_in(tmp_path) == written.kept(intact)
    (warning,) = [entry for entry in logs if "damaged" in entry["event"]]
    assert warning["log_level"] == "warning"
    assert warning["lost_bytes"] == len(content) - part.stat().st_size >= len(content) - intact
    assert (Path(warning["original"]) / part.name).read_bytes() == content


def test_the_stack_repairs_a_file_that_its_redis_refuses(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path, written.part + bytes(100))
    server = RedisServer(tmp_path)
    try:
        server.start()
        until(lambda: server.look() or server.answers(0.5), 10)
        until(lambda: server.look() is None or server.answers(0.5), 10)
        assert connect(server.url).exists("key-39")
        assert server.restarts.deaths == 1
    finally:
        server.close()


def test_parts_after_a_damaged_one_are_dropped_too_and_kept(written: Written, tmp_path: Path, command: Command) -> None:
    damaged_part = written.put(tmp_path / "redis", written.part[:-3])
    later = damaged_part.with_name("appendonly.aof.2.incr.aof")
    content = b"*3\r\n$3\r\nSET\r\n$5\r\nlater\r\n$1\r\n1\r\n"
    later.write_bytes(content)
    with (tmp_path / "redis" / MANIFEST).open("a") as manifest:
        manifest.write(f"file {later.name} seq 2 type i\n")
    done = command("repair", "--data", tmp_path)
    assert done.code == 0
    (kept,) = (tmp_path / "redis" / append_only.COPIES_FOLDER).iterdir()
    lost = len(written.part[:-3]) - damaged_part.stat().st_size + len(content)
    assert f"{lost} bytes are cut off" in done.output
    assert {path.name: path.stat().st_size for path in kept.iterdir()} == {
        damaged_part.name: len(written.part) - 3,
        later.name: len(content),
    }
    assert keys_in(tmp_path / "redis") == written.kept(len(written.part) - 3)
    assert "nothing is damaged" in command("repair", "--data", tmp_path).output


def test_the_originals_of_three_repairs_are_kept(written: Written, tmp_path: Path) -> None:
    part = written.put(tmp_path, written.part)
    for k in range(5):
        part.write_bytes(written.part + bytes(k + 1))
        with RedisServer(tmp_path):
            pass
    kept = sorted((tmp_path / append_only.COPIES_FOLDER).iterdir())
    assert [(path / part.name).stat().st_size - len(written.part) for path in kept] == [3, 4, 5]


def test_without_room_for_the_original_nothing_is_cut_off(written: Written, tmp_path: Path) -> None:
    part = written.put(tmp_path, written.part + b"x")
    (tmp_path / append_only.COPIES_FOLDER).touch()
    with pytest.raises(StorageError, match="damaged files cannot be copied"), RedisServer(tmp_path):
        pass
    assert part.read_bytes() == written.part + b"x"


def test_repairs_that_cannot_copy_leave_the_copies_of_earlier_ones(
    written: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = written.put(tmp_path, written.part + b"x")
    assert append_only.repair(tmp_path, find_redis_server()) is not None
    before = {path: path.stat().st_size for path in (tmp_path / append_only.COPIES_FOLDER).rglob("*")}

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(append_only.shutil, "copy2", full)
    part.write_bytes(written.part + b"xx")
    for _ in range(4):
        with pytest.raises(StorageError, match="No space left"):
            append_only.repair(tmp_path, find_redis_server())
    assert part.read_bytes() == written.part + b"xx"
    assert {path: path.stat().st_size for path in (tmp_path / append_only.COPIES_FOLDER).rglob("*")} == before


def test_a_start_that_succeeds_checks_nothing(
    written: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("checked")

    monkeypatch.setattr(append_only, "repair", refuse)
    written.put(tmp_path, written.part)
    assert b"key-39" in keys_in(tmp_path)


def test_a_manifest_that_lists_nothing_is_an_error_that_names_it(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path, written.part)
    (tmp_path / MANIFEST).write_bytes(bytes(len(written.manifest)))
    with pytest.raises((StorageError, NoRedisError), match=r"manifest is damaged"), RedisServer(tmp_path):
        pass


def test_a_backup_of_a_folder_in_use_has_everything_until_then_and_is_restored(
    tmp_path: Path, command: Command
) -> None:
    data, archive, restored = tmp_path / "data", tmp_path / "backup.rdb", tmp_path / "restored"
    count, ended = 0, threading.Event()
    with storage.opened_lock(data) as lock, RedisServer(data / "redis", inherited=(lock.fileno(),)) as server:
        assert storage.locked(lock)

        def write() -> None:
            nonlocal count
            with connect(server.url) as writer:
                while not ended.wait(0.002):
                    writer.set(f"{count:06d}", bytes(5000))
                    count += 1
                    with contextlib.suppress(redis.exceptions.ResponseError):  # one is being made
                        writer.bgrewriteaof()

        thread = threading.Thread(target=write)
        thread.start()
        try:
            for k in range(3):
                until(lambda: count > 50, 20)
                before = count
                assert command("backup", archive, "--data", data).code == 0
                assert command("restore", archive, "--data", restored / str(k)).code == 0
                with RedisServer(restored / str(k) / "redis") as copy:
                    keys = sorted(connect(copy.url).keys())
                assert keys == [b"%06d" % number for number in range(len(keys))]
                assert before <= len(keys) <= count + 1
        finally:
            ended.set()
            thread.join()
    assert archive.stat().st_mode & 0o777 == 0o600
    assert {path.name for path in tmp_path.iterdir()} == {"data", "backup.rdb", "restored"}


def test_the_command_line_saves_and_restores(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path / "data" / "redis", written.part)
    for words in (["backup", "--data", "data", "-o", "a.rdb"], ["restore", "a.rdb", "--data", "new"]):
        subprocess.run([sys.executable, "-m", "grazemap.cli", *words], cwd=tmp_path, check=True, timeout=60)
    assert keys_in(tmp_path / "new" / "redis") == set(written.ends)


def test_a_folder_with_data_is_renamed_by_force_and_never_lost(
    written: Written, tmp_path: Path, command: Command
) -> None:
    archive, other = snapshot(written, tmp_path, command), tmp_path / "other"
    written.put(other / "redis", b"")
    refused = command("restore", archive, "--data", other)
    assert refused.code == 1
    assert "--force" in refused.output
    assert (other / "redis" / PART).read_bytes() == b""

    with (other / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for words in (("restore", archive, "--force"), ("repair",)):
            refused = command(*words, "--data", other)
            assert refused.code == 1
            assert "a stack runs on the data folder" in refused.output

    assert command("restore", archive, "--data", other, "--force").code == 0
    assert keys_in(other / "redis") == set(written.ends)
    (before,) = tmp_path.glob("other.before-*")
    assert (before / "redis" / PART).read_bytes() == b""
    assert len(list(tmp_path.iterdir())) == 4  # nothing of what was refused


def snapshot(written: Written, folder: Path, command: Command) -> Path:
    """A backup of what was written."""
    written.put(folder / "before" / "redis", written.part)
    assert command("backup", folder / "whole.rdb", "--data", folder / "before").code == 0
    return folder / "whole.rdb"


def test_a_backup_of_a_folder_without_a_stack_is_complete_and_what_is_restored_is_repaired_as_any(
    written: Written, tmp_path: Path, command: Command, logs: list[Any]
) -> None:
    file, restored = snapshot(written, tmp_path, command), tmp_path / "new" / "redis"
    assert file.stat().st_mode & 0o777 == 0o600
    assert not list((tmp_path / "before").rglob("*.rdb"))
    with (tmp_path / "before" / "lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)  # which a server would hold
    assert command("restore", file, "--data", tmp_path / "new").code == 0
    # it is a file of commands
    assert not any(part.read_bytes().startswith(append_only.SNAPSHOTS) for part in append_only.parts(restored))
    with append_only.parts(restored)[-1].open("ab") as stream:
        stream.write(bytes(100))
    assert keys_in(restored) == set(written.ends)
    assert [entry["lost_bytes"] for entry in logs if "damaged" in entry["event"]] == [100]


@pytest.mark.parametrize("content", ["nothing", "text", "half", "flipped"])
def test_what_is_no_backup_is_refused_and_writes_nothing(
    written: Written, tmp_path: Path, command: Command, content: str
) -> None:
    whole = snapshot(written, tmp_path, command).read_bytes()
    file, data = tmp_path / "file", tmp_path / "below" / "data"
    file.write_bytes(
        {
            "nothing": b"",
            "text": b"no backup",
            "half": whole[: len(whole) // 2],
            "flipped": whole[:1000] + bytes([whole[1000] ^ 1]) + whole[1001:],
        }[content]
    )
    refused = command("restore", file, "--data", data)
    assert refused.code == 1
    assert f"{file} is not a backup" in refused.output
    assert list(data.parent.iterdir()) == []


def test_of_a_damaged_snapshot_nothing_is_cut_off(written: Written, tmp_path: Path, command: Command) -> None:
    whole = snapshot(written, tmp_path, command).read_bytes()
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / append_only.SINGLE_FILE).write_bytes(whole[:-1])
    with pytest.raises((StorageError, NoRedisError)), RedisServer(tmp_path / "folder"):
        pass
    (part,) = append_only.parts(tmp_path / "folder")
    assert part.read_bytes() == whole[:-1]


@pytest.mark.parametrize("words", [("repair",), ("backup", "file.rdb")])
def test_a_folder_without_data_is_refused_by_name(tmp_path: Path, command: Command, words: tuple[str, ...]) -> None:
    refused = command(*words, "--data", tmp_path)
    assert refused.code == 1
    assert f"{tmp_path} is not the data folder of a stack" in refused.output
    assert list(tmp_path.iterdir()) == []


def test_logs_are_bounded_while_their_processes_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(children, "MAX_LOG_BYTES", 50_000)
    # the child writes a line when it is asked to, so that the machine's load does not decide what a look finds
    asked, written = tmp_path / "asked", tmp_path / "written"
    for pipe in (asked, written):
        os.mkfifo(pipe)
    code = (
        f"import time\nasked, written = open({str(asked)!r}, 'rb'), open({str(written)!r}, 'wb', buffering=0)\n"
        "for k in range(100):\n    asked.read(1)\n    print(str(k) * 4000, flush=True)\n    written.write(b'.')\n"
        "print('the end', flush=True)\ntime.sleep(60)"
    )
    log = tmp_path / "child.log"
    child = PythonChild("child", [sys.executable, "-c", code], {}, log, WatchdogSocket(tmp_path / "socket"))
    child.start()
    largest = 0
    try:
        with asked.open("wb", buffering=0) as ask, written.open("rb", buffering=0) as answer:
            for _ in range(100):
                ask.write(b"?")
                answer.read(1)
                child.look()
                largest = max(largest, log.stat().st_size)
        until(lambda: "the end" in child.log_tail(), 30)
    finally:
        child.end(0)
    assert 0 < largest < 150_000
    assert 50_000 < (tmp_path / "child.log.1").stat().st_size < 150_000


def test_a_log_that_cannot_be_emptied_ends_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def truncate(path: Path, length: int) -> None:
        raise OSError

    log = tmp_path / "child"
    log.write_bytes(b"said\n")
    monkeypatch.setattr(children, "MAX_LOG_BYTES", 1)
    with monkeypatch.context() as broken:
        broken.setattr(children.os, "truncate", truncate)
        children.rotate_log(log)
    assert log.read_bytes() == b"said\n"
    children.rotate_log(log)
    assert (log.read_bytes(), (tmp_path / "child.1").read_bytes()) == (b"", b"said\n")
    children.rotate_log(tmp_path / "none")


def test_the_log_of_redis_is_bounded_while_it_runs(
    own_redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(children, "MAX_LOG_BYTES", own_redis_server.log.stat().st_size - 1)
    own_redis_server.look()
    assert own_redis_server.log.stat().st_size == 0
    connect(own_redis_server.url).config_set("maxmemory", 1)  # it warns of this
    assert b"\0" not in own_redis_server.log.read_bytes()
    assert "maxmemory" in own_redis_server.log_tail()


def test_the_memory_of_an_embedded_redis_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAZEMAP_RESULT_BYTES", "1000")
    assert StackSettings().max_redis_bytes == 1000 + (1 << 30)
    monkeypatch.setenv("GRAZEMAP_REDIS_BYTES", str(64 << 20))
    with RedisServer(tmp_path, max_memory=StackSettings().max_redis_bytes) as server:
        settings = connect(server.url).config_get("maxmemory*")
    assert (settings["maxmemory"], settings["maxmemory-policy"]) == (str(64 << 20), "noeviction")

"""The data folder: damaged tails of the append-only file, repair, backup and restore, bounded logs and memory."""

from __future__ import annotations

import contextlib
import fcntl
import io
import os
import random
import subprocess
import sys
import tarfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import redis.exceptions
from watching import until

from grazemap_service import append_only, children, storage
from grazemap_service.append_only import StorageError
from grazemap_service.children import PythonChild
from grazemap_service.liveness import Liveness
from grazemap_service.redis_server import NoRedisError, RedisServer
from grazemap_service.settings import StackSettings
from grazemap_worker.store import connect

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
    said: str


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
    with RedisServer(tmp_path) as server:
        assert set(connect(server.url).keys("key-*")) == written.kept(intact)
    (said,) = [entry for entry in logs if "damaged" in entry["event"]]
    assert said["log_level"] == "warning"
    assert said["lost_bytes"] == len(content) - part.stat().st_size >= len(content) - intact
    assert (Path(said["original"]) / part.name).read_bytes() == content


def test_the_stack_repairs_a_file_that_its_redis_refuses(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path, written.part + bytes(100))
    server = RedisServer(tmp_path)
    try:
        server.start()
        until(lambda: server.look() or server.answers(0.5), 10)
        until(lambda: server.look() is None or server.answers(0.5), 10)
        assert connect(server.url).exists("key-39")
        assert server.deaths == 1
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
    (kept,) = (tmp_path / "redis" / append_only.KEPT).iterdir()
    lost = len(written.part[:-3]) - damaged_part.stat().st_size + len(content)
    assert f"{lost} bytes are cut off" in done.said
    assert {path.name: path.stat().st_size for path in kept.iterdir()} == {
        damaged_part.name: len(written.part) - 3,
        later.name: len(content),
    }
    with RedisServer(tmp_path / "redis") as server:
        assert set(connect(server.url).keys()) == written.kept(len(written.part) - 3) | {b"clock"}
    assert "nothing is damaged" in command("repair", "--data", tmp_path).said


def test_the_originals_of_three_repairs_are_kept(written: Written, tmp_path: Path) -> None:
    part = written.put(tmp_path, written.part)
    for k in range(5):
        part.write_bytes(written.part + bytes(k + 1))
        with RedisServer(tmp_path):
            pass
    kept = sorted((tmp_path / append_only.KEPT).iterdir())
    assert [(path / part.name).stat().st_size - len(written.part) for path in kept] == [3, 4, 5]


def test_without_room_for_the_original_nothing_is_cut_off(written: Written, tmp_path: Path) -> None:
    part = written.put(tmp_path, written.part + b"x")
    (tmp_path / append_only.KEPT).touch()
    with pytest.raises(StorageError, match="copies of the damaged files"), RedisServer(tmp_path):
        pass
    assert part.read_bytes() == written.part + b"x"


def test_a_start_that_succeeds_checks_nothing(
    written: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("checked")

    monkeypatch.setattr(append_only, "damage", refuse)
    written.put(tmp_path, written.part)
    with RedisServer(tmp_path) as server:
        assert connect(server.url).exists("key-39")


def test_a_manifest_that_lists_nothing_is_an_error_that_names_it(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path, written.part)
    (tmp_path / MANIFEST).write_bytes(bytes(len(written.manifest)))
    with pytest.raises((StorageError, NoRedisError), match=r"manifest is damaged"), RedisServer(tmp_path):
        pass


def test_a_backup_of_a_folder_in_use_has_everything_until_then_and_is_restored(
    tmp_path: Path, command: Command
) -> None:
    data, archive, restored = tmp_path / "data", tmp_path / "backup.tar", tmp_path / "restored"
    count, ended = 0, threading.Event()
    with RedisServer(data / "redis") as server:
        connect(server.url).config_set("appendfsync", "always")

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
    assert {path.name for path in tmp_path.iterdir()} == {"data", "backup.tar", "restored"}


def test_a_part_that_is_replaced_while_it_is_opened_is_looked_for_again_and_a_lost_one_is_an_error(
    written: Written, tmp_path: Path, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    part, listed = written.put(tmp_path / "redis", written.part), append_only.listed
    first = iter(["file replaced.aof seq 1 type b"])
    monkeypatch.setattr(append_only, "listed", lambda text: listed(next(first, text)))
    monkeypatch.setattr(storage, "_existing", lambda data: data)  # which reads the manifest too
    assert command("backup", tmp_path / "a.tar", "--data", tmp_path).code == 0
    with tarfile.open(tmp_path / "a.tar") as entries:
        assert entries.getnames() == [MANIFEST, BASE, PART]
    part.unlink()
    refused = command("backup", tmp_path / "b.tar", "--data", tmp_path)
    assert refused.code == 1
    assert "lists files that are missing" in refused.said


def test_a_backup_that_ends_in_half_a_command_is_restored_without_it(
    written: Written, tmp_path: Path, command: Command
) -> None:
    part = written.put(tmp_path / "data" / "redis", written.part[:-10])
    command("backup", tmp_path / "backup.tar", "--data", tmp_path / "data")
    done = command("restore", tmp_path / "backup.tar", "--data", tmp_path / "restored")
    left = (tmp_path / "restored" / "redis" / PART).stat().st_size
    assert left == max(end for end in written.ends.values() if end < len(written.part))
    assert f"its last {part.stat().st_size - left} bytes" in done.said


def test_the_command_line_saves_and_restores(written: Written, tmp_path: Path) -> None:
    written.put(tmp_path / "data" / "redis", written.part)
    for words in (["backup", "--data", "data", "-o", "a.tar"], ["restore", "a.tar", "--data", "new"]):
        subprocess.run([sys.executable, "-m", "grazemap.cli", *words], cwd=tmp_path, check=True, timeout=60)
    assert (tmp_path / "new" / "redis" / PART).read_bytes() == written.part
    again = [sys.executable, "-m", "grazemap.cli", "restore", "a.tar", "--data", "new"]
    assert subprocess.run(again, cwd=tmp_path, check=False, capture_output=True, timeout=60).returncode == 1


def test_a_folder_with_data_is_renamed_by_force_and_never_lost(
    written: Written, tmp_path: Path, command: Command
) -> None:
    data, other, archive = tmp_path / "data", tmp_path / "other", tmp_path / "backup.tar"
    written.put(data / "redis", written.part)
    written.put(other / "redis", b"")
    assert command("backup", archive, "--data", data).code == 0
    refused = command("restore", archive, "--data", other)
    assert refused.code == 1
    assert "--force" in refused.said
    assert (other / "redis" / PART).read_bytes() == b""

    with (other / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for words in (("restore", archive, "--force"), ("repair",)):
            refused = command(*words, "--data", other)
            assert refused.code == 1
            assert "a stack runs on the data folder" in refused.said
        assert command("backup", tmp_path / "in-use.tar", "--data", other).code == 0

    assert command("restore", archive, "--data", other, "--force").code == 0
    assert (other / "redis" / PART).read_bytes() == written.part
    (before,) = tmp_path.glob("other.before-*")
    assert (before / "redis" / PART).read_bytes() == b""
    assert len(list(tmp_path.iterdir())) == 5  # nothing of what was refused


@pytest.mark.parametrize("name", ["notes.txt", "../../../escaped", "{}/escaped", "appendonlydir/../../../../x", ""])
def test_what_is_no_backup_is_refused_and_writes_nothing(tmp_path: Path, command: Command, name: str) -> None:
    archive, data = tmp_path / "backup.tar", tmp_path / "below" / "data"
    if name:
        with tarfile.open(archive, "w") as entries:
            for one in (append_only.SINGLE_FILE, name.format(tmp_path)):
                entries.addfile(tarfile.TarInfo(one), io.BytesIO())
    else:
        archive.write_bytes(b"no archive")
    refused = command("restore", archive, "--data", data)
    assert refused.code == 1
    assert f"{archive} is not a backup" in refused.said
    assert list(data.parent.iterdir()) == []
    assert set(tmp_path.iterdir()) == {archive, data.parent}


@pytest.mark.parametrize("words", [("repair",), ("backup", "file.tar")])
def test_a_folder_without_data_is_refused_by_name(tmp_path: Path, command: Command, words: tuple[str, ...]) -> None:
    refused = command(*words, "--data", tmp_path)
    assert refused.code == 1
    assert f"{tmp_path} is not the data folder of a stack" in refused.said
    assert list(tmp_path.iterdir()) == []


def test_logs_are_bounded_while_their_processes_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(children, "MOST_LOG_BYTES", 50_000)
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
    child = PythonChild("child", [sys.executable, "-c", code], {}, log, Liveness(tmp_path / "socket"))
    child.start()
    largest = 0
    try:
        with asked.open("wb", buffering=0) as ask, written.open("rb", buffering=0) as answer:
            for _ in range(100):
                ask.write(b"?")
                answer.read(1)
                child.look()
                largest = max(largest, log.stat().st_size)
        deadline = time.monotonic() + 30
        while "the end" not in child.last_words() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert "the end" in child.last_words()
    finally:
        child.end(0)
    assert 0 < largest < 150_000
    assert 50_000 < (tmp_path / "child.log.1").stat().st_size < 150_000


def test_the_log_of_redis_is_bounded_while_it_runs(
    own_redis_server: RedisServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(children, "MOST_LOG_BYTES", own_redis_server.log.stat().st_size - 1)
    own_redis_server.look()
    assert own_redis_server.log.stat().st_size == 0
    connect(own_redis_server.url).config_set("maxmemory", 1)  # it warns of this
    assert b"\0" not in own_redis_server.log.read_bytes()
    assert "maxmemory" in own_redis_server.last_words()


def test_the_memory_of_an_embedded_redis_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GRAZEMAP_RESULT_BYTES", "1000")
    assert StackSettings().most_redis_bytes == 1000 + (1 << 30)
    monkeypatch.setenv("GRAZEMAP_REDIS_BYTES", str(64 << 20))
    with RedisServer(tmp_path, most_memory=StackSettings().most_redis_bytes) as server:
        found = connect(server.url).config_get("maxmemory*")
    assert (found["maxmemory"], found["maxmemory-policy"]) == (str(64 << 20), "noeviction")

"""Temporary folders and locks: the next stack removes what a killed one left, and no stack removes what is in use."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from pathlib import Path

import pytest

from grazemap_service import temporary
from grazemap_service.redis_server import RedisServer
from grazemap_service.temporary import LOCK, TemporaryFolder, remove_abandoned


@pytest.fixture(autouse=True)
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for temporary folders of the test's own; /tmp is looked at as well."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def age(folder: Path) -> None:
    os.utime(folder, (1, 1))


def test_only_abandoned_folders_are_removed(base: Path) -> None:
    used, closed, abandoned, young = (TemporaryFolder(name) for name in ("used", "closed", "abandoned", "young"))
    closed.close()
    assert not closed.path.exists()
    for folder in (abandoned, young):
        folder._lock.close()
    ours = base / "grazemap-my-data"  # given by a person: no lock of ours in it
    ours.mkdir()
    (ours / "lock").touch()
    link = base / "grazemap-link"
    link.symlink_to(ours)
    for path in (used.path, abandoned.path, ours):
        age(path)
    remove_abandoned()
    assert {path.name for path in base.iterdir()} == {used.path.name, young.path.name, ours.name, link.name}
    used.close()


def test_a_folder_that_is_removed_in_part_is_removed_later(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = TemporaryFolder("closed"), TemporaryFolder("abandoned")
    for folder in folders:
        (folder.path / "data").mkdir()

    def refused(path: Path, ignore_errors: bool = False) -> None:
        (path / LOCK).unlink(missing_ok=True)  # it may be the first to go
        if not ignore_errors:
            raise OSError("busy")

    with monkeypatch.context() as patch:
        patch.setattr(shutil, "rmtree", refused)
        folders[0].close()
        folders[1]._lock.close()
        age(folders[1].path)
        remove_abandoned()
    for folder in folders:
        age(folder.path)
    remove_abandoned()
    assert list(base.iterdir()) == []


def test_a_folder_in_use_by_redis_stays(base: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(temporary, "YOUNG_SECONDS", -1.0)
    with (base / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        server = RedisServer(base / "redis", inherited=(lock.fileno(),))
        server.start()
        server.wait()
    server._folder._lock.close()  # as if this process had been killed
    remove_abandoned()
    assert server.socket.exists()
    with (base / "lock").open("w") as lock, pytest.raises(BlockingIOError):
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    server.stop()
    with (base / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    assert (server.socket.parent / LOCK).exists()
    remove_abandoned()
    assert not server.socket.parent.exists()

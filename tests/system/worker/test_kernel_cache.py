"""The folder of compiled kernels: private, marked while it is used, removed when it is not."""

from __future__ import annotations

import os
import stat
import time
from pathlib import Path

import pytest

from grazemap_worker.supervision import kernel_cache
from grazemap_worker.supervision.kernel_cache import UNUSED_SECONDS, mark_used


def test_the_folder_is_private(tmp_path: Path) -> None:
    folder = kernel_cache.private_folder(tmp_path)
    assert folder.parent == tmp_path / "kernels"
    assert stat.S_IMODE(folder.parent.stat().st_mode) == 0o700


def test_one_process_at_a_time_may_compile(tmp_path: Path) -> None:
    with kernel_cache.one_compiles(tmp_path) as may_begin:
        assert may_begin()
        assert may_begin()
        with kernel_cache.one_compiles(tmp_path) as may_other_begin:
            assert not may_other_begin()
    with kernel_cache.one_compiles(tmp_path) as may_begin:
        assert may_begin()


def test_a_link_to_another_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "kernels").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(kernel_cache.CacheFolderError):
        kernel_cache.private_folder(tmp_path)


def test_folders_that_nobody_has_used_for_long_are_removed_but_not_those_in_use(tmp_path: Path) -> None:
    running, ended, recent = (tmp_path / f"kernels-{name}" for name in ("running", "ended", "recent"))
    earlier = tmp_path / "kernels-of-an-earlier-version"
    earlier.mkdir()
    marks = [mark_used(folder) for folder in (running, ended, recent)]
    marks[1].close()
    long_ago = time.time() - UNUSED_SECONDS - 60.0
    for folder in (running, ended):
        os.utime(folder / "used", (long_ago, long_ago))
    with mark_used(tmp_path / "kernels-new"):
        assert running.exists()
        assert not ended.exists()
        assert recent.exists()
        assert earlier.exists()
    for mark in marks:
        mark.close()


def test_two_workers_mark_the_same_folder_and_none_waits(tmp_path: Path) -> None:
    with mark_used(tmp_path / "kernels-1"), mark_used(tmp_path / "kernels-1"):
        pass  # one that waits would wait for ever

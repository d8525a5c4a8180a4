"""Which stacks that run on this machine a process joins, and what a stack knows of those that have joined it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from grazemap import running_stacks
from grazemap.running_stacks import announce, is_used, memberships, withdraw

URL = "http://127.0.0.1:9"


@pytest.fixture(autouse=True)
def runtime(tmp_path, monkeypatch):
    """The folder of announcements lies in a folder of the test."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("GRAZEMAP_LOCAL")
    return tmp_path


def announced():
    """Announce a stack."""
    made = announce(URL)
    assert made is not None
    return made


def joined():
    """Join what can be joined, and return the addresses."""
    urls = []
    for membership in memberships():
        urls.append(membership.url)
        membership.close()
    return urls


def test_a_stack_of_the_same_kind_is_joined_until_its_announcement_is_taken_back():
    assert joined() == []
    stack = announced()
    assert joined() == [URL]
    stack.close()
    assert joined() == []
    assert not stack.path.exists()


def test_a_stack_of_other_settings_or_of_another_version_is_not(monkeypatch):
    stack = announced()
    monkeypatch.setenv("GRAZEMAP_MAX_POINTS", "7")
    assert joined() == []
    monkeypatch.delenv("GRAZEMAP_MAX_POINTS")
    monkeypatch.setenv("GRAZEMAP_URL", "http://127.0.0.1:10")  # of clients, not of stacks
    assert joined() == [URL]
    monkeypatch.setattr(running_stacks, "__version__", "0")
    assert joined() == []
    stack.close()


def test_a_stack_knows_whether_it_is_used_and_is_not_joined_once_it_is_withdrawn():
    stack = announced()
    (membership,) = memberships()
    assert is_used(stack.path)
    assert not withdraw(stack.path)
    assert joined() == [URL]
    membership.close()
    assert not is_used(stack.path)
    assert withdraw(stack.path)
    assert joined() == []
    assert withdraw(stack.path)
    stack.close()


def test_what_a_killed_process_leaves_is_believed_by_nobody(runtime):
    code = (
        f"from grazemap.running_stacks import announce; import time; stack = announce({URL!r});"
        "print(1, flush=True); time.sleep(60)"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment) as stack:
        assert stack.stdout is not None
        stack.stdout.readline()
        assert joined() == [URL]
        stack.send_signal(signal.SIGKILL)
    assert joined() == []
    assert list(next(runtime.iterdir()).iterdir()) == []


def test_a_stack_that_announces_itself_while_another_process_looks_is_left_alone(monkeypatch):
    other = announced()
    path = other.path.parent / "begins"
    path.mkdir()
    now = running_stacks.time.time

    def announces() -> float:
        (path / "stack.json").write_text("{}")
        return now()

    assert (other.path / "stack.json").exists()
    monkeypatch.setattr(running_stacks.time, "time", announces)
    joined()
    assert (path / "stack.json").exists()
    other.close()


def test_a_stack_with_keys_is_not_announced(monkeypatch):
    monkeypatch.setenv("grazemap_api_keys", "a" * 40)
    assert announce(URL) is None
    monkeypatch.delenv("grazemap_api_keys")
    monkeypatch.setenv("GRAZEMAP_LOCAL", "own")
    assert announce(URL) is None


def test_a_folder_that_others_may_write_is_not_used(runtime):
    stack = announced()
    stack.path.parent.chmod(0o777)
    assert joined() == []
    assert announce(URL) is None
    stack.path.parent.chmod(0o700)
    stack.path.parent.rename(runtime / "elsewhere")
    Path(stack.path.parent).symlink_to(runtime / "elsewhere")
    assert joined() == []
    stack.close()

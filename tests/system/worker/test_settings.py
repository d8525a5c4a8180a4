"""Settings that are wrong are refused by name; a password of Redis may hold any character."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import pytest
from redis.exceptions import AuthenticationError
from redis.exceptions import ConnectionError as AwayError

from grazemap_service.redis_server import RedisServer
from grazemap_worker.environment import CHOOSE_CACHE_DIR, default_cache_dir
from grazemap_worker.settings import WorkerSettings
from grazemap_worker.store import connect, trouble
from tests.support.thorough import every_fourth

PASSWORD = "a+b/c#d=e@f:g?"


@pytest.fixture
def locked(tmp_path: Path) -> Iterator[RedisServer]:
    """A Redis that asks for a password."""
    with RedisServer(tmp_path / "redis") as server:
        client = connect(server.url)
        client.config_set("requirepass", PASSWORD)
        client.close()
        yield server


def run(module: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", module],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


WRONG = [("REDIS_URL", "redis://:se/cret@redis:6379/0"), ("REDIS_URL", "http://redis"), ("LOG_LEVEL", "LOUD")]
MODULES = ["grazemap_worker", "grazemap_service", "grazemap_worker.supervision.healthcheck"]


@pytest.mark.parametrize(
    ("module", "name", "value"),
    every_fourth([*((module, *wrong) for module in MODULES for wrong in WRONG), ("grazemap_worker", "WORKERS", "no")]),
)
def test_a_wrong_setting_is_refused_by_name(module: str, name: str, value: str) -> None:
    answer = run(module, **{f"GRAZEMAP_{name}": value})
    assert answer.returncode == (1 if module.endswith("healthcheck") else 2)
    assert f"GRAZEMAP_{name}" in answer.stderr
    assert "Traceback" not in answer.stderr
    assert "cret" not in answer.stderr


def test_the_workers_refuse_a_cache_that_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "kernels").symlink_to(tmp_path)
    answer = run("grazemap_worker", GRAZEMAP_CACHE_DIR=str(tmp_path))
    assert answer.returncode == 2
    assert "must be a folder" in answer.stderr
    assert "Traceback" not in answer.stderr


def test_a_cache_that_cannot_be_made_is_refused_with_the_setting_that_names_another(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    # an empty variable is none, so the default is taken
    answer = run("grazemap_worker", GRAZEMAP_CACHE_DIR="", XDG_CACHE_HOME=f"{tmp_path}/file")
    assert answer.returncode == 2
    assert CHOOSE_CACHE_DIR in answer.stderr
    assert "Traceback" not in answer.stderr


def test_where_the_home_is_not_known_the_setting_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Path, "expanduser", Mock(side_effect=RuntimeError))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    with pytest.raises(RuntimeError, match="GRAZEMAP_CACHE_DIR"):
        default_cache_dir()


@pytest.mark.parametrize("module", ["grazemap_worker", "grazemap_service"])
def test_a_variable_that_is_no_setting_has_a_warning_in_the_log(tmp_path: Path, module: str) -> None:
    (tmp_path / "kernels").symlink_to(tmp_path)
    # neither starts: the workers have no folder, and the address of the service is in use
    with socket.create_server(("127.0.0.1", 0)) as used:
        port = str(used.getsockname()[1])
        answer = run(module, GRAZEMAP_WORKERZ="2", GRAZEMAP_CACHE_DIR=str(tmp_path), GRAZEMAP_PORT=port)
    assert answer.returncode in (1, 2)
    assert "GRAZEMAP_WORKERZ" in answer.stderr
    assert "GRAZEMAP_PORT" not in answer.stderr


def test_a_password_may_hold_any_character(locked: RedisServer) -> None:
    settings = WorkerSettings(redis_url=locked.url, redis_password=PASSWORD)
    assert PASSWORD not in repr(settings)
    client = settings.connect()
    assert client.ping()
    client.close()


def test_a_wrong_password_is_reported(locked: RedisServer) -> None:
    for password in ("wrong", ""):
        client = WorkerSettings(redis_url=locked.url, redis_password=password).connect()
        with pytest.raises(AuthenticationError) as caught:
            client.ping()
        assert trouble(caught.value) == "Redis refuses the password"
        client.close()
    assert trouble(AwayError()) == "Redis is unavailable"
    answer = run(
        "grazemap_worker.supervision.healthcheck",
        GRAZEMAP_REDIS_URL=locked.url,
        GRAZEMAP_REDIS_PASSWORD="wrong",
    )
    assert answer.returncode == 1
    assert "refuses the password" in answer.stderr

"""The compose file: its settings of Redis are tried with a real server."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
import yaml
from redis import Redis
from redis.exceptions import RedisError

from grazemap_service.redis_server import find_redis_server
from tests.support.digests.record import core_version

COMPOSE: dict[str, Any] = yaml.safe_load((Path(__file__).parents[3] / "docker-compose.yml").read_text("utf-8"))
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_no_container_has_more_rights_than_it_needs(name: str) -> None:
    service = SERVICES[name]
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert service["read_only"] is True
    assert "start_period" in service["healthcheck"]
    assert not any(
        "PASSWORD" in str(value) for key, value in service.get("environment", {}).items() if key.endswith("_URL")
    )
    assert not any(entry.startswith("redis") for entry in service.get("ports", []))


def test_the_image_has_the_version_of_the_product() -> None:
    assert {service["image"] for service in (SERVICES["service"], SERVICES["worker"])} == {f"grazemap:{core_version()}"}


def test_redis_is_the_version_that_is_embedded_by_its_digest() -> None:
    version = subprocess.run([find_redis_server(), "--version"], capture_output=True, text=True, check=True).stdout
    image = re.fullmatch(r"valkey/valkey:([\d.]+)@sha256:[0-9a-f]{64}", SERVICES["redis"]["image"])
    assert image
    assert f"v={image[1]} " in version


def test_redis_takes_any_password_and_does_not_show_it(tmp_path: Path) -> None:
    program, password = tmp_path / "valkey-server", """a/b+c='"\\$(id) d"""
    program.symlink_to(find_redis_server())
    assert SERVICES["redis"]["user"] == "valkey"
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    *shell, script = (part.replace("$$", "$") for part in SERVICES["redis"]["command"])
    process = subprocess.Popen(
        [*shell, script.replace("--appendonly", f"--bind 127.0.0.1 --port {port} --appendonly")],
        env={
            "PATH": f"{tmp_path}:{os.environ['PATH']}",
            "TMPDIR": str(tmp_path),
            "REDISCLI_AUTH": password,
        },
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
    )
    client = Redis(port=port, password=password)
    try:
        for _ in range(100):
            try:
                assert client.ping()
                break
            except RedisError:
                assert process.poll() is None
                time.sleep(0.05)
        else:
            raise AssertionError("it takes another password")
        assert client.config_get("maxmemory-policy") == {"maxmemory-policy": "noeviction"}
        arguments = Path(f"/proc/{process.pid}/cmdline").read_bytes()
        assert b"valkey-server" in arguments  # not a shell: signals reach it
        assert password.encode() not in arguments
        with pytest.raises(RedisError):
            Redis(port=port).ping()
    finally:
        client.close()
        process.terminate()
        process.wait(5)

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
from grazemap_service.settings_list import settings
from grazemap_worker.settings import default_memory
from grazemap_worker.store.store import DEFAULT_RESULT_BYTES
from tests.support.digests.record import core_version

ROOT = Path(__file__).parents[3]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text("utf-8"))
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
# What the image sets, and what another process hands over.
ELSEWHERE = {"GRAZEMAP_CACHE_DIR", "GRAZEMAP_FD"}


def bytes_of(value: str) -> int:
    """The default of `${NAME:-VALUE}` in bytes."""
    number, unit = re.fullmatch(r"\$\{\w+:-(\d+)([mg]?)\}", value).groups()  # type: ignore[union-attr]
    return int(number) << {"": 0, "m": 20, "g": 30}[unit]


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


@pytest.mark.parametrize("name", ["service", "worker"])
def test_every_setting_of_a_process_is_set_or_passed_on(name: str) -> None:
    variables = {setting.variable for setting in settings() if setting.readers in ("both", name)} - ELSEWHERE
    assert {key for key in SERVICES[name]["environment"] if key.startswith("GRAZEMAP_")} == variables


def test_the_image_keeps_kernels_in_the_volume_of_the_workers() -> None:
    (volume,) = SERVICES["worker"]["volumes"]
    assert f"GRAZEMAP_CACHE_DIR={volume.partition(':')[2]}\n" in (ROOT / "Dockerfile").read_text()


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_every_container_has_a_limit_of_memory_that_can_be_set(name: str) -> None:
    assert bytes_of(SERVICES[name]["mem_limit"]) >= 256 << 20


def test_the_memory_of_redis_fits_into_its_container_and_holds_the_results() -> None:
    most = bytes_of(SERVICES["redis"]["environment"]["MAXMEMORY"])
    assert most == DEFAULT_RESULT_BYTES + (1 << 30)
    assert bytes_of(SERVICES["redis"]["mem_limit"]) == 2 * most


def test_a_worker_gets_its_default_memory_in_its_container() -> None:
    workers = bytes_of(SERVICES["worker"]["environment"]["GRAZEMAP_WORKERS"])
    in_container = default_memory(workers, bytes_of(SERVICES["worker"]["mem_limit"]))
    assert in_container == default_memory(workers, None)


def test_images_are_pinned_by_digest() -> None:
    texts = [(ROOT / "Dockerfile").read_text(), SERVICES["proxy"]["build"]["dockerfile_inline"]]
    bases = [base for text in texts for base in re.findall(r"^(?:FROM |ARG PYTHON_IMAGE=)(\S+)", text, re.MULTILINE)]
    assert [base for base in bases if not re.search(r"@sha256:[0-9a-f]{64}$", base)] == ["${PYTHON_IMAGE}"] * 2
    assert len(bases) == 4


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
            "MAXMEMORY": str(64 << 20),
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
        kept = client.config_get("maxmemory", "maxmemory-policy")
        assert kept == {"maxmemory": str(64 << 20), "maxmemory-policy": "noeviction"}
        arguments = Path(f"/proc/{process.pid}/cmdline").read_bytes()
        assert b"valkey-server" in arguments  # not a shell: signals reach it
        assert password.encode() not in arguments
        with pytest.raises(RedisError):
            Redis(port=port).ping()
    finally:
        client.close()
        process.terminate()
        process.wait(5)

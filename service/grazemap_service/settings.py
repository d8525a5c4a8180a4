"""Settings of the HTTP service and of the stack, from environment variables with the prefix GRAZEMAP_.

`ServiceSettings` has every limit and address of the service. It is read once from environment variables (tests pass
keyword arguments). This module also decides which addresses and host names need keys.
"""

from __future__ import annotations

import ipaddress
import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, SecretStr, field_validator
from pydantic_settings import NoDecode

from grazemap_service import keys
from grazemap_worker.redis_settings import RedisSettings, shown
from grazemap_worker.settings import WorkerSettings
from grazemap_worker.store.store import DEFAULT_RESULT_BYTES
from grazemap_worker.system import machine_memory

LOOPBACK_HOSTS = ("localhost", "127.0.0.1", "[::1]")
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://([^\s/?#@:\[\]]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")
# what stands in a Content-Security-Policy, which has no addresses of IPv6
_FRAMING_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://(\*\.)?[a-z0-9._-]+(:([0-9]{1,5}|\*))?")


class SettingsError(ValueError):
    """The settings are unsafe, because keys are missing; the service refuses to start."""


class ServiceSettings(RedisSettings):
    """The settings of the service. Lists are written with commas: ``GRAZEMAP_API_KEYS=one,two``."""

    host: Annotated[
        str,
        Field(
            description="address to listen at; any address except loopback needs keys, and so do host names other than "
            "loopback. `grazemap up` listens there too, unless `--host` is given"
        ),
    ] = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535, description="port, 0 any free one; `--port` takes precedence")] = 8000
    fd: Annotated[
        int | None,
        Field(ge=0, description="an inherited listening socket, instead of host and port. `grazemap up` opens its own"),
    ] = None

    api_keys: Annotated[
        tuple[SecretStr, ...], NoDecode, Field(description="keys, separated by commas: `key` or `name=key`")
    ] = ()
    api_keys_file: Annotated[Path | None, Field(description="a file of further keys, read again when it changes")] = (
        None
    )
    allowed_hosts: Annotated[
        tuple[str, ...], NoDecode, Field(description="accepted Host headers, also `*.lab.example` and `*`")
    ] = LOOPBACK_HOSTS
    cors_origins: Annotated[
        tuple[str, ...],
        NoDecode,
        Field(
            description="origins whose pages may call the service from a browser (CORS), as `https://lab.example` or "
            "`http://localhost:8181`, or `*`. `localhost` and `127.0.0.1` are different origins"
        ),
    ] = ()

    frame_origins: Annotated[
        tuple[str, ...],
        NoDecode,
        Field(
            description="origins whose pages may show the explorer in a frame, as `https://course.example`, "
            "`https://*.course.example` or `http://localhost:*`, or `*`; a comma alone: pages of the service only"
        ),
    ] = tuple(f"http://{host}:*" for host in LOOPBACK_HOSTS[:2])

    max_body_bytes: Annotated[int, Field(gt=0, description="maximum bytes of a request's body")] = 1 << 20
    max_depth: Annotated[int, Field(gt=0, lt=500, description="maximum nesting of a JSON body")] = 32
    max_masses: Annotated[int, Field(gt=0, description="maximum masses of an oscillator")] = 64
    max_points: Annotated[
        int, Field(gt=0, description="maximum values of a curve, or samples of the trajectories of a job or a diagram")
    ] = 1_000_000
    max_pixels: Annotated[
        int,
        Field(gt=0, description="maximum points of a map, states of basins, values times states of basin fractions"),
    ] = 1 << 22
    max_adaptive_pixels: Annotated[int, Field(gt=0, description="maximum points of an adaptive map")] = 1 << 24
    max_work: Annotated[float, Field(gt=0, description="maximum forcing periods of one job, as estimated")] = 1e9
    max_seconds: Annotated[
        float,
        Field(
            gt=0,
            description="maximum seconds of one job on one core, as estimated; a job whose processor time exceeds it, "
            "and four times its estimate, is stopped",
        ),
    ] = 86_400.0
    max_tile_periods: Annotated[
        int,
        Field(
            gt=0, description="maximum forcing periods of the trajectories of one job, except those of maps and basins"
        ),
    ] = 1_000_000
    max_pending_tiles: Annotated[
        int, Field(gt=0, description="maximum unfinished tiles of all jobs; above it, 429")
    ] = 100_000
    max_wait_seconds: Annotated[float, Field(ge=0, le=300, description="longest `Prefer: wait`")] = 30.0

    hot_bytes: Annotated[
        int, Field(ge=0, description="maximum bytes of copies of results in the memory of the process")
    ] = 64 << 20
    sent_bytes: Annotated[
        int, Field(ge=0, description="results that are being sent; above it, further large ones wait")
    ] = 256 << 20

    @field_validator("api_keys", "allowed_hosts", "cors_origins", "frame_origins", mode="before")
    @classmethod
    def _split(cls, value: Any) -> Any:
        if isinstance(value, str):
            return tuple(item for item in (part.strip() for part in value.split(",")) if item)
        return value

    @field_validator("api_keys")
    @classmethod
    def _check_strength(cls, value: tuple[SecretStr, ...]) -> tuple[SecretStr, ...]:
        keys.setting_keys(value)
        return value

    @field_validator("cors_origins")
    @classmethod
    def _check_origins(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_origin(item) for item in value)

    @field_validator("frame_origins")
    @classmethod
    def _check_frame_origins(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(_origin(item, _FRAMING_ORIGIN) for item in value)

    @field_validator("api_keys_file")
    @classmethod
    def _check_file(cls, value: Path | None) -> Path | None:
        if value is not None:
            keys.file_keys(value)
        return value

    @property
    def needs_keys(self) -> bool:
        """Whether requests need a key."""
        return bool(self.api_keys) or self.api_keys_file is not None

    def check_exposed(self, host: str) -> None:
        """Raise SettingsError if other machines can reach the service and there are no keys.

        `host` is the address on which the service listens. If `host` is a loopback address, but an allowed host is not
        one, a proxy on this machine is taken to forward requests of other machines.
        """
        if self.needs_keys:
            return
        remedy = "set GRAZEMAP_API_KEYS or GRAZEMAP_API_KEYS_FILE"
        if not is_loopback(host):
            raise SettingsError(
                f"refusing to listen on {host or 'every address'} without keys: {remedy}, or listen on 127.0.0.1"
            )
        public = [name for name in self.allowed_hosts if not is_loopback(name)]
        if public:
            raise SettingsError(
                f"refusing to serve the hosts {', '.join(public)} of GRAZEMAP_ALLOWED_HOSTS without keys: {remedy}, or "
                f"allow {', '.join(LOOPBACK_HOSTS)} alone"
            )


class StackSettings(WorkerSettings):
    """The settings of the workers of a stack, and the memory of its embedded Redis.

    The defaults of the memory are smaller on a machine with little memory.
    """

    result_bytes: int = Field(
        default_factory=lambda: _share_of_memory(DEFAULT_RESULT_BYTES, 4),
        gt=0,
    )
    redis_bytes: Annotated[
        int | None,
        Field(
            ge=64 << 20,
            description=f"maximum memory of an embedded Redis, at least {64 << 20}; above it, 507. In place of 1 GiB "
            "at most an eighth of the memory",
        ),
    ] = Field(default=None, json_schema_extra=shown("`GRAZEMAP_RESULT_BYTES` and 1 GiB"))

    @property
    def max_redis_bytes(self) -> int:
        """Maximum bytes of memory of the embedded Redis.

        They are the setting or, by default, the budget of results and an eighth of the memory of the machine, but of
        this at most 1 GiB.
        """
        return self.redis_bytes if self.redis_bytes is not None else self.result_bytes + _share_of_memory(1 << 30, 8)


def _origin(text: str, form: re.Pattern[str] = _ORIGIN) -> str:
    """Return an origin as browsers send it: in small letters, and without a slash. Raises ValueError."""
    origin = text.lower().removesuffix("/")
    if origin != "*" and not form.fullmatch(origin):
        raise ValueError(
            "origins are scheme://host:port without a path, as http://localhost:8181 or https://lab.example, or *"
        )
    return origin


def _share_of_memory(max_bytes: int, parts: int) -> int:
    """Return the smaller of `max_bytes` and the memory of the machine divided by `parts`, of which at least 64 MiB."""
    memory = machine_memory()
    return max_bytes if memory is None else min(max_bytes, max(64 << 20, memory // parts))


def is_loopback(host: str) -> bool:
    """Return whether an address or host name can be reached from this machine only."""
    name = host.strip("[]").split("%")[0]
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name.lower() == "localhost"

"""Settings that service and workers share: address and password of Redis, and the level of the log."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from difflib import get_close_matches
from typing import Annotated

import redis.asyncio
from pydantic import Field, JsonValue, SecretStr, ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from redis import Redis
from redis.connection import parse_url

from grazemap.running_stacks import OF_CLIENTS
from grazemap_worker.store import connect
from grazemap_worker.store.connection import SOCKET_TIMEOUT

USAGE_ERROR = 2
"""Exit status of a process with invalid settings; it is not started again."""

_LEVELS = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")
_PREFIX = "GRAZEMAP_"
# No settings: variables of clients, and what `system.LINUX` reads.
_OTHERS = OF_CLIENTS | {"GRAZEMAP_SYSTEM"}
# Similarities of names, as difflib has them: of one that may be suggested, and of one that differs by a letter or two.
_SIMILAR, _NEARLY = 0.6, 0.8


def shown(default: str) -> dict[str, JsonValue]:
    """Return the extra of a field whose default depends on the machine: the words that stand for it."""
    return {"shown": default}


class RedisSettings(BaseSettings):
    """Where Redis is, and how much is logged."""

    # A variable that is empty is not set: compose passes on those that the user has not set as empty ones.
    model_config = SettingsConfigDict(
        env_prefix=_PREFIX, env_ignore_empty=True, frozen=True, extra="ignore", hide_input_in_errors=True
    )

    redis_url: Annotated[str, Field(description="Redis, as `redis://`, `rediss://` or `unix://`")] = (
        "redis://127.0.0.1:6379/0"
    )
    redis_password: Annotated[
        SecretStr | None,
        Field(description="password of Redis, of any characters; a password in the URL takes precedence"),
    ] = None
    log_level: Annotated[
        str, Field(description=f"least level of the log: {', '.join(_LEVELS[:-1])} or {_LEVELS[-1]}")
    ] = "INFO"

    @field_validator("redis_url")
    @classmethod
    def _address(cls, value: str) -> str:
        try:
            parse_url(value)  # type: ignore[no-untyped-call]
        except ValueError:
            # without the value: a password may be in it
            raise ValueError(
                "not an address that begins with redis://, rediss:// or unix:// "
                "(a password with special characters goes into GRAZEMAP_REDIS_PASSWORD)"
            ) from None
        return value

    @field_validator("log_level")
    @classmethod
    def _level(cls, value: str) -> str:
        if value.upper() not in _LEVELS:
            raise ValueError(f"one of {', '.join(_LEVELS)}")
        return value.upper()

    def connect(self, tries: int = 1, socket_timeout: float = SOCKET_TIMEOUT) -> Redis:
        """Return a client; nothing is sent yet. `tries` and `socket_timeout` as in `store.connect`."""
        return connect(self.redis_url, socket_timeout, tries, self._password)

    def connect_async(self) -> redis.asyncio.Redis:
        """Return a client for an event loop; nothing is sent yet."""
        return redis.asyncio.Redis.from_url(self.redis_url, password=self._password, health_check_interval=10)

    @property
    def _password(self) -> str | None:
        return (self.redis_password.get_secret_value() or None) if self.redis_password else None


def refusal_text(error: ValidationError) -> str:
    """Return what is wrong with the settings, by the names of their variables and without their values."""
    return "; ".join(
        f"{variable_of(str(item['loc'][0]))}: {item['msg']}"
        for item in error.errors()
        if item["type"] != "default_factory_not_called"  # it depends on another one, which is named
    )


def variable_of(field: str) -> str:
    """Return the environment variable of a setting."""
    return _PREFIX + field.upper()


def unknown_variables(environment: Mapping[str, str], *kinds: type[RedisSettings], near: bool = False) -> Iterator[str]:
    """Yield the names of variables that are no setting, each with the setting that may have been meant.

    They do not keep a process from starting: Kubernetes, for example, sets such variables for a service that is named
    `grazemap`.

    Parameters
    ----------
    environment : Mapping
        The variables of the process.
    *kinds : type
        The settings that are known.
    near : bool
        Yield only names that nearly are those of settings, where the process does not know all settings.
    """
    known = {variable_of(field).removeprefix(_PREFIX) for kind in kinds for field in kind.model_fields}
    for name in sorted(environment):
        written = name.upper()
        bare = written.removeprefix(_PREFIX)
        if bare == written or bare in known or written in _OTHERS:
            continue
        meant = get_close_matches(bare, known, 1, _NEARLY if near else _SIMILAR)
        if meant or not near:
            yield f"{name} is no setting" + (f"; did you mean {_PREFIX}{meant[0]}" if meant else "")

"""Settings that service and workers share: address and password of Redis, and the level of the log."""

from __future__ import annotations

import redis.asyncio
from pydantic import SecretStr, ValidationError, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict
from redis import Redis
from redis.connection import parse_url

from grazemap_worker.store import connect
from grazemap_worker.store.connection import SOCKET_TIMEOUT

USAGE_ERROR = 2
"""Exit status of a process with invalid settings; it is not started again."""

_LEVELS = ("DEBUG", "INFO", "WARNING", "ERROR", "CRITICAL")


class RedisSettings(BaseSettings):
    """Where Redis is, and how much is logged."""

    model_config = SettingsConfigDict(env_prefix="GRAZEMAP_", frozen=True, extra="ignore", hide_input_in_errors=True)

    redis_url: str = "redis://127.0.0.1:6379/0"
    redis_password: SecretStr | None = None
    log_level: str = "INFO"

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
    return "; ".join(f"GRAZEMAP_{str(item['loc'][0]).upper()}: {item['msg']}" for item in error.errors())

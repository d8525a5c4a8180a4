"""Connections to Redis, and the scripts that run in it."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import Any

from redis import Redis
from redis.backoff import NoBackoff
from redis.retry import Retry

from grazemap_worker.store.keys import PREFIX

# Longer than any script takes, shorter than a client's patience. RQ's workers set their own for blocking reads.
SOCKET_TIMEOUT = 5.0


def connect(url: str, socket_timeout: float = SOCKET_TIMEOUT) -> Redis:
    """Return a client for a redis://, rediss:// or unix:// URL; nothing is sent yet.

    A command fails at once when Redis is away: whoever asks decides whether to try again.
    """
    return Redis.from_url(
        url,
        socket_timeout=socket_timeout,
        socket_connect_timeout=socket_timeout,
        retry=Retry(NoBackoff(), 0),
        decode_responses=False,
    )


@cache
def script_text(name: str) -> str:
    """Return the text of a script, what all scripts share in front."""
    folder = files("grazemap_worker.store").joinpath("lua")
    return "\n".join(folder.joinpath(f"{part}.lua").read_text("utf-8") for part in ("prelude", name))


class Scripts:
    """Runs the store's scripts; each is one atomic step."""

    def __init__(self, redis: Redis) -> None:
        self.redis = redis
        self._scripts: dict[str, Any] = {}

    def run(self, name: str, *arguments: str | bytes | int | float) -> Any:
        """Return what the script answers; `arguments` follow the key prefix."""
        script = self._scripts.get(name)
        if script is None:
            script = self._scripts[name] = self.redis.register_script(script_text(name))
        return script(args=[PREFIX, *arguments])

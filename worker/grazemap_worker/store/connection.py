"""Connections to Redis, and the scripts that run in it."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from typing import Any

from redis import Redis
from redis.backoff import ExponentialBackoff
from redis.exceptions import (
    AuthenticationError,
    ConnectionError,
    NoScriptError,
    OutOfMemoryError,
    ReadOnlyError,
    RedisError,
    TimeoutError,
)
from redis.retry import Retry

from grazemap_worker.store.keys import PREFIX

# Seconds until a command fails: longer than any script takes, short enough for a client. RQ's workers set their own
# timeout for blocking reads.
SOCKET_TIMEOUT = 5.0
# Codes of errors after which a later attempt may succeed.
_AWAY = re.compile(r"\b(?:MISCONF|OOM|LOADING|READONLY|BUSY|MASTERDOWN|NOREPLICAS|TRYAGAIN)\b")
# Errors of writes for lack of memory or disk space. Redis does not say why a snapshot failed, so all count.
_FULL = re.compile(r"\bOOM\b|\bMISCONF\b.*(?:No space left|quota exceeded|File too large|RDB snapshots)")


def connect(url: str, socket_timeout: float = SOCKET_TIMEOUT, tries: int = 1, password: str | None = None) -> Redis:
    """Return a client for a redis://, rediss:// or unix:// URL; nothing is sent yet.

    Parameters
    ----------
    tries : int
        1 for the service: a command fails at once when Redis is unavailable. More for the workers: it is sent again
        after 0.05, 0.1, ... 1 s, so that no finished tile is lost. A step of the store may safely run twice.
    password : str, optional
        A password in the URL overrides it.
    """
    return Redis.from_url(
        url,
        password=password,
        socket_timeout=socket_timeout,
        socket_connect_timeout=socket_timeout,
        retry=Retry(ExponentialBackoff(cap=1.0, base=0.05), tries - 1),
        decode_responses=False,
    )


def trouble(error: RedisError) -> str:
    """Return a short text for logs that says why Redis cannot be used."""
    return "Redis refuses the password" if isinstance(error, AuthenticationError) else "Redis is unavailable"


@cache
def script_text(name: str) -> str:
    """Return the text of a script, after the prelude that all scripts share."""
    folder = files("grazemap_worker.store").joinpath("lua")
    return "\n".join(folder.joinpath(f"{part}.lua").read_text("utf-8") for part in ("prelude", name))


def is_away(error: RedisError) -> bool:
    """Return whether a later attempt may succeed: Redis is down, loading, full, read-only, or refuses the password.

    A password counts, because it is changed in Redis and in the settings one after the other.
    """
    if isinstance(error, ConnectionError | TimeoutError | OutOfMemoryError | ReadOnlyError):
        return True
    # the text of an error inside a script has the code anywhere in it
    return _AWAY.search(str(error)) is not None


def is_full(error: RedisError) -> bool:
    """Return whether Redis refuses writes for lack of disk or memory, but answers reads; `is_away` is true too."""
    return isinstance(error, OutOfMemoryError) or _FULL.search(str(error)) is not None


class Scripts:
    """Runs the store's Lua scripts; each call of a script is one atomic step."""

    def __init__(self, redis: Redis) -> None:
        # redis-py types every answer as bytes | str; after `connect` it is bytes
        self.redis: Any = redis
        self._script = cache(lambda name: redis.register_script(script_text(name)))

    def run(self, name: str, *data: bytes, **arguments: Any) -> Any:
        """Return the answer of a script. Arguments that are not None are sent as JSON, then `data` as bytes."""
        return self._script(name)(args=_encoded(data, arguments))

    def run_each(self, name: str, calls: Sequence[tuple[Sequence[bytes], Mapping[str, Any]]]) -> list[Any]:
        """Return the answers of a script to several calls (bytes, arguments), or a RedisError in place of an answer.

        The calls are sent together. Commands of other clients may run between them.
        """
        script, pipeline = self._script(name), self.redis.pipeline(transaction=False)
        encoded = [_encoded(data, arguments) for data, arguments in calls]
        for arguments in encoded:
            pipeline.evalsha(script.sha, 0, *arguments)
        # Redis does not keep its scripts over a restart
        return [
            script(args=arguments) if isinstance(answer, NoScriptError) else answer
            for answer, arguments in zip(pipeline.execute(raise_on_error=False), encoded, strict=True)
        ]


def _encoded(data: Sequence[bytes], arguments: Mapping[str, Any]) -> list[str | bytes]:
    return [PREFIX, json.dumps({key: value for key, value in arguments.items() if value is not None}), *data]

"""Workers and their leases: which workers are alive, and with which numerics."""

from __future__ import annotations

import json
from collections.abc import Collection

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import FINGERPRINT_REMEMBERED, PREFIX
from grazemap_worker.store.records import WorkerInfo

_STARTING = f"{PREFIX}starting"
_STARTING_SECONDS = 5


class Workers:
    """Leases: a worker holds its tiles as long as it renews its lease; then they are free."""

    def __init__(self, scripts: Scripts) -> None:
        self._scripts = scripts

    def register(self, name: str, fingerprint: str, ttl: float, core_version: str = "") -> None:
        """Register a live worker for `ttl` seconds; `renew` prolongs that."""
        description = json.dumps({"fingerprint": fingerprint, "core_version": core_version})
        milliseconds = round(1000 * ttl)
        self._scripts.run(
            "register", name, fingerprint, milliseconds, FINGERPRINT_REMEMBERED, description, core_version
        )

    def renew(self, holder: str, lease_seconds: float) -> bool:
        """Renew a lease. Returns False if it has expired: the worker has to register, and may have lost its tiles."""
        return bool(self._scripts.run("renew", holder, round(1000 * lease_seconds), FINGERPRINT_REMEMBERED))

    def remove(self, name: str, *, return_claims: bool = False) -> None:
        """End the lease of a worker that has ended.

        With `return_claims` its tiles are free and nothing is counted (an orderly stop); without, they count as lost.
        """
        self._scripts.run("leave", name, int(return_claims))

    def live(self) -> list[WorkerInfo]:
        """Return the live workers, by name."""
        answer = self._scripts.run("workers")
        found = []
        for name, text in zip(answer[::2], answer[1::2], strict=True):
            description = json.loads(text)
            # by field, as another release may store more
            found.append(WorkerInfo(name.decode(), description["fingerprint"], description["core_version"]))
        return sorted(found, key=lambda worker: worker.name)

    def say_starting(self, text: str) -> None:
        """Store what workers that are not ready yet are doing, for a few seconds; empty: nothing."""
        if text:
            self._scripts.redis.set(_STARTING, text.encode(), ex=_STARTING_SECONDS)
        else:
            self._scripts.redis.delete(_STARTING)

    def starting(self) -> str:
        """Return what workers that are not ready yet are doing; empty if nothing is known."""
        value = self._scripts.redis.get(_STARTING)
        return value.decode() if value else ""

    def say_compiled(self, fingerprint: str, masses: Collection[int]) -> None:
        """Store for which numbers of masses workers with this fingerprint have the kernels of maps."""
        self._scripts.redis.sadd(f"{PREFIX}compiled:{fingerprint}", *masses)

    def compiles_first(self, masses: int, core_version: str) -> bool:
        """Return whether every live worker of a core version has to compile the kernels of maps for so many masses.

        False if no worker is ready, as nothing is known then.
        """
        found = {worker.fingerprint for worker in self.live() if worker.core_version == core_version}
        compiled = [self._scripts.redis.smembers(f"{PREFIX}compiled:{fingerprint}") for fingerprint in found]
        return any(compiled) and not any(str(masses).encode() in numbers for numbers in compiled)

    def lead(self, role: str, holder: str, seconds: float) -> bool:
        """Return whether `holder` has a role, which one process has at a time, for some seconds after each call."""
        return bool(self._scripts.run("lead", role, holder, round(1000 * seconds)))

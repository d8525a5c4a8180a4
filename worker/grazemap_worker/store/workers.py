"""Workers and their leases: who is alive, and with which numerics."""

from __future__ import annotations

import json
from collections.abc import Mapping

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import FINGERPRINT_REMEMBERED
from grazemap_worker.store.records import WorkerInfo


class WorkerStore:
    """Leases: a worker holds its tiles for as long as it renews; a dead one loses them by itself."""

    def __init__(self, scripts: Scripts) -> None:
        self._scripts = scripts

    def ping(self) -> bool:
        """Return True, or raise redis.exceptions.RedisError when Redis is away or still loading."""
        return bool(self._scripts.redis.ping())

    def register_worker(self, name: str, fingerprint: str, ttl: float, core_version: str = "") -> None:
        """Announce a live worker, for `ttl` seconds unless it renews."""
        description = json.dumps({"fingerprint": fingerprint, "core_version": core_version})
        milliseconds = round(1000 * ttl)
        self._scripts.run(
            "register", name, fingerprint, milliseconds, FINGERPRINT_REMEMBERED, description, core_version
        )

    def renew(self, holder: str, lease_seconds: float) -> bool:
        """Renew a lease. Returns False when it had run out: register again, the tiles may be somebody else's."""
        return bool(self._scripts.run("renew", holder, round(1000 * lease_seconds), FINGERPRINT_REMEMBERED))

    def remove_worker(self, name: str, *, return_claims: bool = False) -> None:
        """End the lease of a worker that is known to be gone.

        With `return_claims` its tiles are given back (an orderly stop); without, they count as lost.
        """
        self._scripts.run("leave", name, int(return_claims))

    def workers(self) -> list[WorkerInfo]:
        """Return the live workers, by name."""
        answer = self._scripts.run("workers")
        pairs = zip(answer[::2], answer[1::2], strict=True)
        return sorted(
            (_worker(name.decode(), json.loads(description)) for name, description in pairs),
            key=lambda worker: worker.name,
        )

    def lead(self, role: str, holder: str, seconds: float) -> bool:
        """Return whether `holder` has a role that one process has at a time; it keeps it by asking again in time."""
        return bool(self._scripts.run("lead", role, holder, round(1000 * seconds)))


def _worker(name: str, description: Mapping[str, str]) -> WorkerInfo:
    # by field: another release may say more
    return WorkerInfo(name, description["fingerprint"], description["core_version"])

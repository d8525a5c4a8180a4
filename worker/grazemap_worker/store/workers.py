"""Workers and their leases: which workers are alive, and with which numerics."""

from __future__ import annotations

import json
from dataclasses import asdict, fields

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import FINGERPRINT_REMEMBERED, PREFIX
from grazemap_worker.store.records import WorkerInfo

_FIELDS = {field.name for field in fields(WorkerInfo)} - {"name"}
_STARTING = f"{PREFIX}starting"
# What is said of workers and kernels is of now.
_SAID_SECONDS = 5


class Workers:
    """Leases: a worker holds its tiles as long as it renews its lease; then they are free."""

    def __init__(self, scripts: Scripts) -> None:
        self._scripts = scripts

    def renew(self, worker: WorkerInfo, seconds: float, job_id: str = "") -> bool:
        """Register a live worker, or renew its lease, for so many seconds.

        Returns whether the job that it computes is still wanted; True without one.
        """
        description = {**asdict(worker), "kernels": sorted(worker.kernels)}
        del description["name"]
        milliseconds = round(1000 * seconds)
        answer = self._scripts.run(
            "renew",
            holder=worker.name,
            lease=milliseconds,
            description=description,
            remembered=FINGERPRINT_REMEMBERED,
            job=job_id,
        )
        return bool(answer)

    def remove(self, name: str, *, return_claims: bool = False) -> None:
        """End the lease of a worker that has ended.

        With `return_claims` its tiles are free and nothing is counted (an orderly stop); without, they count as lost.
        """
        self._scripts.run("leave", holder=name, give_back=return_claims)

    def live(self) -> list[WorkerInfo]:
        """Return the live workers, by name."""
        found = []
        for name, text in self._scripts.run("workers"):
            described = json.loads(text)
            # a later release may store more
            described = {field: value for field, value in described.items() if field in _FIELDS}
            described["kernels"] = frozenset(described.get("kernels", ()))
            found.append(WorkerInfo(name.decode(), **described))
        return sorted(found, key=lambda worker: worker.name)

    def say_starting(self, text: str) -> None:
        """Store what workers that are not ready yet are doing, for a few seconds; empty: nothing."""
        self._say(_STARTING, text)

    def starting(self) -> str:
        """Return what workers that are not ready yet are doing; empty if nothing is known."""
        value = self._scripts.redis.get(_STARTING)
        return value.decode() if value else ""

    def say_compiling(self, kernels: str, text: str) -> None:
        """Store for a few seconds what is done for kernels that jobs wait for; empty: nothing."""
        self._say(f"{PREFIX}compiling:{kernels}", text)

    def _say(self, key: str, text: str) -> None:
        if text:
            self._scripts.redis.set(key, text.encode(), ex=_SAID_SECONDS)
        else:
            self._scripts.redis.delete(key)

    def compiles_first(self, kernels: str, core_version: str) -> bool:
        """Return whether every live worker of a core version lacks some kernels; False if no worker is ready."""
        live = [worker for worker in self.live() if worker.core_version == core_version]
        return bool(live) and not any(kernels in worker.kernels for worker in live)

    def lead(self, role: str, holder: str, seconds: float) -> bool:
        """Return whether `holder` has a role, which one process has at a time, for some seconds after each call."""
        return bool(self._scripts.run("lead", role=role, holder=holder, milliseconds=round(1000 * seconds)))

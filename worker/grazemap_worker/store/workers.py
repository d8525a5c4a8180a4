"""Workers and their leases: which workers are alive, with which fingerprint and kernels."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, fields

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import FINGERPRINT_REMEMBERED, PREFIX
from grazemap_worker.store.records import WorkerInfo

_FIELDS = {field.name for field in fields(WorkerInfo)} - {"name"}
_STARTING, _WAITS = f"{PREFIX}starting", f"{PREFIX}kernel-waits"
# Seconds for which a text about starting workers or compiling kernels is valid.
_TEXT_SECONDS = 5


class Workers:
    """The leases of workers. A worker holds its tiles until its lease runs out."""

    def __init__(self, scripts: Scripts) -> None:
        self._scripts = scripts

    def renew(self, worker: WorkerInfo, seconds: float, job_id: str = "") -> bool:
        """Register a worker, or renew its lease, for so many seconds.

        Returns whether the job that the worker computes is unfinished; True without a job.
        """
        description = {**asdict(worker), "kernels": sorted(worker.kernels)}
        del description["name"]
        answer = self._scripts.run(
            "renew",
            holder=worker.name,
            lease=round(1000 * seconds),
            description=description,
            remembered=FINGERPRINT_REMEMBERED,
            job=job_id,
        )
        return bool(answer)

    def remove(self, name: str, *, return_claims: bool = False) -> None:
        """End the lease of a worker that has ended.

        With `return_claims`, its tiles are freed and no failure is counted, as after an orderly stop. Without, they
        count as lost.
        """
        self._scripts.run("leave", holder=name, give_back=return_claims)

    def live(self) -> list[WorkerInfo]:
        """Return the live workers, by name."""
        workers = []
        for name, text in self._scripts.run("workers"):
            description = json.loads(text)
            # a later release may store more fields
            description = {field: value for field, value in description.items() if field in _FIELDS}
            description["kernels"] = frozenset(description.get("kernels", ()))
            workers.append(WorkerInfo(name.decode(), **description))
        return sorted(workers, key=lambda worker: worker.name)

    def set_starting(self, text: str) -> None:
        """Store for a few seconds a text about workers that are not ready yet; an empty one removes it."""
        self._set_text(_STARTING, text)

    def starting(self) -> str:
        """Return the text about workers that are not ready yet; empty if there is none."""
        value = self._scripts.redis.get(_STARTING)
        return value.decode() if value else ""

    def set_compiling(self, kernels: str, text: str) -> None:
        """Store for a few seconds a text about kernels that jobs wait for; an empty one removes it."""
        self._set_text(f"{PREFIX}compiling:{kernels}", text)

    def set_waits(self, seconds: Mapping[str, float]) -> None:
        """Store for a few seconds in how many seconds kernels that no worker has are ready, if a job needs them."""
        self._set_text(_WAITS, json.dumps(dict(seconds)))

    def wait(self, kernels: str) -> float:
        """Return in how many seconds kernels are ready; 0 where that is not known, or they are."""
        value = self._scripts.redis.get(_WAITS)
        seconds: dict[str, float] = json.loads(value) if value else {}
        return seconds.get(kernels, 0.0)

    def _set_text(self, key: str, text: str) -> None:
        if text:
            self._scripts.redis.set(key, text.encode(), ex=_TEXT_SECONDS)
        else:
            self._scripts.redis.delete(key)

    def kernels(self, core_version: str) -> set[str] | None:
        """Return the kernels that live workers of a core version have; None if there is no live worker."""
        live = [worker for worker in self.live() if worker.core_version == core_version]
        return {name for worker in live for name in worker.kernels} if live else None

    def lead(self, role: str, holder: str, seconds: float) -> bool:
        """Return whether `holder` has a role, which only one process has at a time; it keeps it for `seconds`."""
        return bool(self._scripts.run("lead", role=role, holder=holder, milliseconds=round(1000 * seconds)))

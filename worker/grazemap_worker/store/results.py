"""Results: whole npz files, content-addressed, the least recently used ones forgotten over a byte budget.

A result is a function of its request, the core version and the numerics fingerprint, which are all in its key;
one that is lost is computed again.
"""

from __future__ import annotations

import hashlib

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import MOST_RESULT_BYTES, TILES_KEPT_AFTER_SUCCESS, job_key
from grazemap_worker.store.records import ResultInfo, ResultTooLarge


class Results:
    """The results of finished jobs.

    Parameters
    ----------
    scripts : Scripts
        On the Redis that holds them.
    budget : int
        Bytes of all results together.
    """

    def __init__(self, scripts: Scripts, budget: int) -> None:
        self._scripts = scripts
        self._redis = scripts.redis
        self._budget = budget

    def commit(self, identity: str, data: bytes, fingerprint: str, cpu_seconds: float) -> bool:
        """Store the whole result and end the job; the first commit wins. `cpu_seconds` are added to those of the tiles.

        Results that were used longest ago are dropped until all fit the byte budget, this one excepted.

        Returns
        -------
        bool
            Whether this call ended the job; False when it is finished, gone, or bound to other numerics.

        Raises
        ------
        ResultTooLarge
            Over `MOST_RESULT_BYTES`.
        """
        check_size(data)
        etag = hashlib.sha256(data).hexdigest()
        return bool(
            self._scripts.run(
                "commit_result",
                identity,
                data,
                fingerprint,
                etag,
                self._budget,
                TILES_KEPT_AFTER_SUCCESS,
                cpu_seconds,
            )
        )

    def data(self, identity: str) -> bytes | None:
        """Return the npz bytes of a job's result, or None when it has none (any more)."""
        data: bytes | None = self._scripts.run("result", identity)
        return data

    def info(self, identity: str) -> ResultInfo | None:
        """Return size and entity tag of a job's result without loading it, or None.

        The result becomes the most recently used one: a client that has it, or the service with a copy in its memory,
        does not ask for the bytes.
        """
        answer = self._scripts.run("result_info", identity)
        return ResultInfo(size=int(answer[0]), etag=answer[1].decode()) if answer else None

    def etag(self, identity: str) -> str | None:
        """Return the entity tag of a job's result, evicted or not, or None when it has not ended with one."""
        value = self._redis.hget(job_key(identity), "etag")
        return value.decode() if value else None


def check_size(data: bytes) -> None:
    """Raise ResultTooLarge when a result, or a part of one, is over `MOST_RESULT_BYTES`."""
    if len(data) > MOST_RESULT_BYTES:
        raise ResultTooLarge(len(data), MOST_RESULT_BYTES)

"""Jobs that an earlier version of grazemap stored: their records are taken over, and everything else is removed.

A finished job stays finished. Its result belongs to another version of the core, so it is not kept; it is computed
again when it is requested. An unfinished job fails, with a problem that says why.
"""

from __future__ import annotations

import re

import structlog
from redis.exceptions import NoPermissionError

from grazemap_worker.store.connection import Scripts
from grazemap_worker.store.keys import OLDER_PREFIXES
from grazemap_worker.store.problems import outdated_problem

_JOBS_A_SCRIPT = 200
_KEYS_A_STEP = 500
_NUMBER = re.compile(rb"\d+:")


class OlderLayouts:
    """The keys of earlier layouts in a Redis."""

    def __init__(self, scripts: Scripts) -> None:
        self._scripts = scripts
        self._redis = scripts.redis

    def abandoned(self) -> list[str]:
        """Return the key prefixes of the earlier layouts that are there and have no live worker."""
        found = [prefix for prefix in OLDER_PREFIXES if self._redis.exists(_mark(prefix))]
        return [prefix for prefix in found if not self._has_workers(prefix)]

    def adopt(self, prefix: str) -> tuple[int, int]:
        """Take over the jobs of a layout and remove its keys. An interrupted call may be made again.

        Returns how many jobs were taken over, and how many of them had not been finished.
        """
        problem, jobs, unfinished, remaining = outdated_problem().model_dump_json(), 0, 0, 1
        while remaining:
            moved, ended, remaining = self._scripts.run("adopt", old=prefix, most=_JOBS_A_SCRIPT, problem=problem)
            jobs, unfinished = jobs + moved, unfinished + ended
        self._remove(prefix)
        return jobs, unfinished

    def _has_workers(self, prefix: str) -> bool:
        leases = [f"{prefix}worker:{name.decode()}" for name in self._redis.hkeys(f"{prefix}workers")]
        return bool(leases) and self._redis.exists(*leases) > 0

    def _remove(self, prefix: str) -> None:
        """Remove every key of a layout, and last the one by which it is recognised.

        A user that may not list keys leaves them to an administrator.
        """
        mark, length = _mark(prefix).encode(), len(prefix)
        try:
            keys = [*self._redis.scan_iter(f"{prefix}*", count=_KEYS_A_STEP)]
        except NoPermissionError:
            structlog.get_logger("grazemap_worker").warning("keys of an earlier version remain", prefix=prefix)
            keys = []
        # a key that continues with a number is of another layout
        removed = [key for key in keys if key != mark and not _NUMBER.match(key, length)]
        for start in range(0, len(removed), _KEYS_A_STEP):
            self._redis.unlink(*removed[start : start + _KEYS_A_STEP])
        self._redis.unlink(mark)


def _mark(prefix: str) -> str:
    """Return the key that a layout has once a job was submitted to it."""
    return f"{prefix}sequence"

"""Settings of the workers and their supervisor, from environment variables with the prefix GRAZEMAP_."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from grazemap_worker.environment import default_cache_dir
from grazemap_worker.redis_settings import RedisSettings, shown
from grazemap_worker.store.store import DEFAULT_RESULT_BYTES
from grazemap_worker.system import available_cores, machine_memory

# A worker renews its lease about once a second. The tiles of a killed worker become free when its supervisor notices
# this, at the latest when the lease runs out.
LEASE_SECONDS = 5.0
# Bytes that the computation of a tile may allocate on a large machine. On a smaller one, the memory is divided by the
# number of workers plus two: one share for the store, and one for the processes that compile. Workers for small tiles
# are not counted.
_MAX_MEMORY = 2 << 30
_MIN_MEMORY = 1 << 26


def default_memory(workers: int, machine_bytes: int | None) -> int:
    """Return the bytes that the computation of a tile may allocate; `machine_bytes` is the memory of the machine."""
    if machine_bytes is None:
        return _MAX_MEMORY
    return min(_MAX_MEMORY, max(_MIN_MEMORY, machine_bytes // (workers + 2)))


def _default_memory(validated_fields: dict[str, Any]) -> int:
    return default_memory(validated_fields.get("workers", 1), machine_memory())


class WorkerSettings(RedisSettings):
    """The settings of the workers of one machine."""

    workers: Annotated[int, Field(ge=1, le=1024, description="worker processes")] = Field(
        default_factory=available_cores, json_schema_extra=shown("one per core")
    )
    cache_dir: Annotated[
        Path,
        Field(
            description="folder for compiled kernels, in $XDG_CACHE_HOME where that is set, made private to the user; "
            "`grazemap up` keeps them in its data folder where the home cannot be written. One folder for each version "
            "of grazemap, Python, numba and processor; one that no worker was started with for 90 days, and none runs "
            "with, is removed"
        ),
    ] = Field(default_factory=default_cache_dir, json_schema_extra=shown("~/.cache/grazemap"))
    # read by grazemap_core.compiled_ahead, before anything else is imported
    kernels: Annotated[
        Literal["ahead", "native"],
        Field(description="`ahead`: kernels of `grazemap-kernels` are used where they fit; `native`: never"),
    ] = "ahead"
    result_bytes: Annotated[
        int,
        Field(
            gt=0,
            description="maximum bytes of results and tiles in Redis; `grazemap up` takes at most a quarter "
            "of the memory",
        ),
    ] = DEFAULT_RESULT_BYTES
    memory_bytes: Annotated[
        int,
        Field(
            ge=_MIN_MEMORY,
            description="what the computation of a tile may allocate; above it, the job fails with `too-much-memory`. "
            "The default is at most M/(workers + 2), where M is the memory of the machine or of its control group",
        ),
    ] = Field(default_factory=_default_memory, json_schema_extra=shown(f"{_MAX_MEMORY}, or a share of the memory"))

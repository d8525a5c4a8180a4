"""Settings of workers and their supervisor, from the environment under the prefix GRAZEMAP_."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from grazemap_worker.redis_settings import RedisSettings

# A worker renews its lease every second while it works and every three while it waits; one that is killed loses its
# tile when the lease runs out.
LEASE_SECONDS = 5.0


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def default_cache_dir() -> Path:
    """Return the folder for compiled kernels: GRAZEMAP_CACHE_DIR, else in XDG_CACHE_HOME, else in ~/.cache."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "grazemap"


class WorkerSettings(RedisSettings):
    """The settings of the workers of one machine."""

    workers: Annotated[int, Field(ge=1, le=1024, description="Worker processes.")] = Field(
        default_factory=available_cores
    )
    cache_dir: Annotated[Path, Field(description="Folder for compiled kernels; made private.")] = Field(
        default_factory=default_cache_dir
    )
    # read by grazemap_core.compiled_ahead, before anything else is imported
    kernels: Annotated[Literal["ahead", "native"], Field(description="Whether those compiled ahead are used.")] = (
        "ahead"
    )
    result_bytes: Annotated[int, Field(gt=0, description="Budget of the finished results in Redis.")] = 2 << 30
    memory_bytes: Annotated[int, Field(ge=1 << 26, description="Memory for the computation of a tile.")] = 2 << 30

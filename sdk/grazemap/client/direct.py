"""Computation in a script, without a service: `compute`, and `direct`, whose client has a method for each process."""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from typing import Any

from grazemap.client.direct_client import DirectClient
from grazemap.wire import ProcessRequest


def direct(executor: Executor | None = None) -> DirectClient:
    """Return a client that computes in this script, without a service; use it in a `with` block, or close it.

    The arguments and the exceptions are those of `DirectClient`.
    """
    return DirectClient(executor)


def compute(
    process: str,
    request: ProcessRequest | Mapping[str, Any],
    executor: Executor | None = None,
    *,
    progress: bool = True,
    checkpoint: str | os.PathLike[str] | None = None,
) -> Any:
    """Compute a request in this script, without a service, and return its result.

    `executor` is as of `DirectClient`; the other arguments and the exceptions are those of `DirectClient.compute`.
    """
    with direct(executor) as client:
        return client.compute(process, request, progress=progress, checkpoint=checkpoint)

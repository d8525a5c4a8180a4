"""A map has the same bytes whatever computes it: workers side by side, and tiles of any size, by the real workers."""

from __future__ import annotations

import signal
import subprocess
import sys

import numpy as np
import pytest

from grazemap.codec import decode_npz
from grazemap.wire import UnfoldingMapsRequest
from grazemap_service.redis_server import RedisServer
from grazemap_worker.numerics import numerics
from grazemap_worker.planning import Plan
from grazemap_worker.store import Store, core_version
from tests.support import submitting
from tests.support.watching import until

REQUEST = UnfoldingMapsRequest.model_validate(
    {
        "omega": {"start": 0.27, "stop": 0.30, "points": 6},
        "clearance": {"start": 1.3, "stop": 2.1, "points": 128},
        "max_periods": 120,
    }
)


def computed(server: RedisServer, store: Store, workers: int, tile: tuple[int, int]) -> tuple[bytes, int]:
    """The map by so many workers in tiles of (clearances, frequencies), and the number of tiles."""
    store.redis.flushall()
    plan = Plan(rows=128, columns=6, tile_rows=tile[0], tile_columns=tile[1])
    job, _ = submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 1000)
    command = [sys.executable, "-m", "grazemap_worker", "--workers", str(workers), "--redis-url", server.url]
    with subprocess.Popen(command) as process:
        try:
            until(lambda: store.results.data(job.id) is not None, 200)
        finally:
            process.send_signal(signal.SIGTERM)
    data = store.results.data(job.id)
    assert data is not None
    return data, plan.count


@pytest.mark.parametrize(
    ("workers", "tile", "count"), [(4, (32, 1), 24), pytest.param(2, (64, 2), 6, marks=pytest.mark.thorough)]
)
def test_workers_side_by_side_give_the_bytes_of_one_in_tiles_of_any_size(
    redis_server: RedisServer, store: Store, workers: int, tile: tuple[int, int], count: int
) -> None:
    whole, tiles = computed(redis_server, store, 1, (128, 6))
    assert tiles == 1
    data, tiles = computed(redis_server, store, workers, tile)
    assert tiles == count
    assert data == whole
    document, meta = decode_npz(whole)
    assert meta["numerics"] == numerics().as_meta()
    # there is something to differ: several motions, and points that are none
    named = document["kind"] == 1
    assert named.any()
    assert not named.all()
    assert len(np.unique(document["impacts_right"][named])) >= 3

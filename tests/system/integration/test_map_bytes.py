"""A map has the same bytes whatever computes it: workers side by side, and tiles of any size, by the real workers."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator

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


def computed(store: Store, *tile: int) -> tuple[bytes, int]:
    """The map in tiles of so many clearances and frequencies, and the number of tiles."""
    store.redis.flushall()
    plan = Plan(rows=128, columns=6, tile_rows=tile[0], tile_columns=tile[1])
    job, _ = submitting.submit(store, "unfolding-maps", REQUEST, core_version(), plan, 1000)
    until(lambda: store.results.data(job.id) is not None, 300)
    data = store.results.data(job.id)
    assert data is not None
    return data, plan.tile_count


@pytest.fixture
def workers(redis_server: RedisServer, store: Store) -> Iterator[None]:
    """Four workers of the store."""
    command = [sys.executable, "-m", "grazemap_worker", "--workers", "4", "--redis-url", redis_server.url]
    with subprocess.Popen(command) as process:
        yield
        process.send_signal(signal.SIGTERM)


def test_workers_side_by_side_give_the_bytes_of_one_in_tiles_of_any_size(store: Store, workers: None) -> None:
    whole, tiles = computed(store, 128, 6)  # by one worker
    assert tiles == 1
    for tile, count in (((32, 1), 24), ((64, 2), 6)):
        assert computed(store, *tile) == (whole, count)
    document, meta = decode_npz(whole)
    assert meta["numerics"] == numerics().as_meta()
    # there is something to differ: several motions, and points that are none
    named = document["kind"] == 1
    assert named.any()
    assert not named.all()
    assert len(np.unique(document["impacts_right"][named])) >= 3

"""A store that is emptied while a client waits: the client submits its request again, and has its result."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

import grazemap
from grazemap_worker.store import Store
from tests.support.sdk_documents import REQUESTS, npz
from tests.support.service_running import PlayedWorker
from tests.support.watching import until

CURVE = REQUESTS["grazing-curves"]
CALLS: dict[str, Callable[[grazemap.Client], Any]] = {
    "one": lambda client: client.submit("grazing-curves", CURVE).wait(60).result(),
    "many": lambda client: next(iter(client.map("grazing-curves", [CURVE]))),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_the_result_comes_after_all(
    live_url: str, store: Store, worker: PlayedWorker, call: Callable[[grazemap.Client], Any]
) -> None:
    def waiting() -> list[str]:
        return [job.id for job in store.jobs.page()[0] if job.status == "accepted"]

    with grazemap.Client(live_url) as client, ThreadPoolExecutor(1) as others:
        result = others.submit(call, client)
        until(lambda: bool(waiting()), 20)
        store.redis.flushall()
        worker.register()
        until(lambda: bool(waiting()) or result.done(), 60)
        for job_id in waiting():
            worker.commit(job_id, npz("grazing-curves"), 0, whole=True)
        assert result.result(60).process == "grazing-curves"

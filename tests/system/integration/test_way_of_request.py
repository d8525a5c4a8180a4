"""The ten files of docs/way.md: each opens with an example, and the examples are one request on its way."""

from __future__ import annotations

import doctest
import importlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from structlog.testing import capture_logs

from grazemap.wire import UnfoldingMapsRequest
from grazemap_service.redis_server import RedisServer
from grazemap_worker.numerics import numerics
from grazemap_worker.planning import LANE_WEIGHTS
from grazemap_worker.planning.kernel_steps import FIRST_STEPS
from grazemap_worker.processes.conversion import core_oscillator
from grazemap_worker.store import ANONYMOUS, Store, WorkerInfo, core_version
from grazemap_worker.store.ledger import LANES
from grazemap_worker.tasks import WorkerContext
from tests.support.service_running import client_of

ROOT = Path(__file__).parents[3]
WAY = re.findall(
    r"^\| \d+ \| \[`.*`\]\(\.\./(?:sdk|service|worker|core)/(.+)\.py\)", (ROOT / "docs/way.md").read_text("utf-8"), re.M
)
REQUEST = UnfoldingMapsRequest(omega=[0.28, 0.29], clearance=[1.5, 1.6])


@pytest.fixture
def names(redis_server: RedisServer, store: Store) -> Iterator[dict[str, Any]]:
    """What the examples use besides the names of their own files. The worker computes every tile as a small one."""
    ours = numerics()
    worker = WorkerInfo("here", ours.fingerprint, core_version(), frozenset(FIRST_STEPS), small=True)
    store.workers.renew(worker, 600)
    with capture_logs(), client_of(redis_server) as http, patch.dict(LANES, {True: list(LANE_WEIGHTS)}):
        yield {
            "http": http,
            "context": http.app.state.context,  # type: ignore[attr-defined]
            "requester": ANONYMOUS,
            "request": REQUEST,
            "store": store,
            "redis": store.redis,
            "fingerprint": ours.fingerprint,
            "worker_context": WorkerContext(store, worker, ours),
            "oscillator": core_oscillator(REQUEST.oscillator),
        }


def test_the_examples_of_the_ten_files_are_one_request_on_its_way(names: dict[str, Any]) -> None:
    assert len(WAY) == 10
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    for path in WAY:
        module = importlib.import_module(path.replace("/", "."))
        example = doctest.DocTestParser().get_doctest(
            module.__doc__ or "", vars(module) | names, module.__name__, module.__file__, 0
        )
        assert example.examples, path
        runner.run(example, clear_globs=False)
        if "job" in example.globs:
            names["job"] = example.globs["job"]
    assert runner.summarize(verbose=False).failed == 0

"""Requests that schemathesis generates from the API's document, against a service of its own: `make schemathesis`.

`python -m tests.slow.described_requests SCHEMATHESIS EXAMPLES` starts a Redis and a service, and runs the program with
this many examples for each operation, and with sequences of operations. No worker computes: a job of an example has a
made-up result, and others are dismissed, so that streams of events end. It exits with the program's status.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

import redis

from grazemap.codec import decode_npz, encode_npz
from grazemap.wire import PROCESSES, parse_request
from grazemap_service.redis_server import RedisServer
from grazemap_service.result_schemas import NUMERICS
from grazemap_worker.store import Finished, Store, WorkerInfo, connect, core_version
from tests.support.sdk_documents import npz
from tools.latency import standalone

_CHECKS = Path(__file__).with_name("described_requests_checks.py")
_WORKER, _FINGERPRINT = "played", "f00d"
_LEASE_SECONDS = 86_400
_LOOK_SECONDS = 0.1
# Left out: what a schema cannot say is refused too, which the check of our own looks at more closely; and a job that
# was deleted is still there, dismissed.
_LEFT_OUT = "positive_data_acceptance,use_after_free"


def play(store: Store, stop: threading.Event) -> None:
    """Finish the jobs of examples and dismiss all others, until `stop` is set."""
    store.workers.renew(WorkerInfo(_WORKER, _FINGERPRINT, core_version()), _LEASE_SECONDS)
    examples = {
        process: [parse_request(process, dict(example)).canonical() for example in model.operation.examples.values()]
        for process, model in PROCESSES.items()
    }
    while not stop.wait(_LOOK_SECONDS):
        with contextlib.suppress(redis.exceptions.RedisError):  # it has ended
            for status in ("accepted", "running"):
                for job in store.jobs.page(status, None, 500, None)[0]:  # type: ignore[arg-type]
                    if job.request not in examples[job.process] or not _finish(store, job.id, job.process):
                        store.jobs.dismiss(job.id, "", everyone=True)


def _finish(store: Store, job_id: str, process: str) -> bool:
    """Commit a made-up result of a job, and return whether that was possible."""
    document, meta = decode_npz(npz(process))
    data = encode_npz(document, {**meta, "numerics": dict.fromkeys(NUMERICS, "played")})
    claim = store.tiles.claim(job_id, 0, _WORKER, _FINGERPRINT, _LEASE_SECONDS)
    return claim is not None and store.results.commit([Finished(claim, data, 0.0, whole=True)])[0] >= 0


def main() -> int:
    """Run schemathesis; return its status."""
    program, examples = Path(sys.argv[1]).absolute(), sys.argv[2]
    with (
        tempfile.TemporaryDirectory() as folder,
        RedisServer(Path(folder)) as server,
        (Path(folder) / "service.log").open("w") as log,
        standalone(server.url, log) as address,
    ):
        store, stop = Store(connect(server.url)), threading.Event()
        played = threading.Thread(target=play, args=(store, stop))
        played.start()
        try:
            line = [str(program), "run", f"http://{address}/openapi.json", "--max-examples", examples, "--seed", "1"]
            line += ["--exclude-checks", _LEFT_OUT, "--continue-on-failure", "--output-truncate", "false"]
            environment = {**os.environ, "SCHEMATHESIS_HOOKS": _CHECKS.stem, "PYTHONPATH": str(_CHECKS.parent)}
            status = subprocess.run(line, cwd=folder, env=environment, check=False).returncode
        finally:
            stop.set()
            played.join()
        _print_exceptions(Path(log.name))
        return status


def _print_exceptions(log: Path) -> None:
    """Print the exceptions that a service has logged."""
    for line in log.read_text("utf-8").splitlines():
        if line.startswith("{") and (exception := json.loads(line).get("exception")):
            print(exception)


if __name__ == "__main__":
    sys.exit(main())

"""The latency of small requests on a kept connection: a service that is started by itself, beside `grazemap up`.

`python -m tools.latency` (`make latency`) starts both, the service as docker-compose does, with a Redis of its own. It
sends requests to them in turn and prints the median of each, without the first of a connection. It exits with 1 when
the service that is started by itself takes longer than it may.
"""

from __future__ import annotations

import http.client
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from typing import TextIO
from urllib.parse import urlsplit

from grazemap.module_command import module_command
from grazemap_service.redis_server import RedisServer
from tools.first_start import started

LIMIT_SECONDS = 0.010
REQUESTS = 200
# One with a body too: without TCP_NODELAY an answer in two packets to a request in two packets waits for the client's
# delayed acknowledgement, 40 ms.
_ASKED: tuple[tuple[str, str, bytes | None], ...] = (
    ("GET", "/v1", None),
    ("POST", "/v1/grazing-curves/estimate", b'{"omega": [0.1, 0.2, 0.3]}'),
)
_START_SECONDS = 120.0


@contextmanager
def standalone(redis_url: str, log: TextIO | None = None) -> Iterator[str]:
    """Run a service by itself within the block, its log on stderr or in a file; yield its host and port."""
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    environment = {**os.environ, "GRAZEMAP_REDIS_URL": redis_url, "GRAZEMAP_PORT": str(port)}
    with subprocess.Popen(module_command("grazemap_service"), env=environment, stderr=log) as service:
        try:
            deadline = time.monotonic() + _START_SECONDS
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except ConnectionRefusedError:
                    if time.monotonic() > deadline:
                        raise
                    time.sleep(0.05)
            yield f"127.0.0.1:{port}"
        finally:
            service.terminate()


def medians(services: Mapping[str, str], requests: int = REQUESTS) -> dict[tuple[str, str], float]:
    """Return the median seconds of an answer by the name of the service and the request.

    Parameters
    ----------
    services : mapping
        Host and port of each service by its name. They are asked in turn, each on one connection.
    requests : int
        How often each request is measured.
    """
    took: dict[tuple[str, str], list[float]] = {}
    with ExitStack() as stack:
        connections = {
            name: stack.enter_context(closing(http.client.HTTPConnection(address, timeout=30)))
            for name, address in services.items()
        }
        for connection in connections.values():
            _seconds(connection, *_ASKED[0])
        for _ in range(requests):
            for name, connection in connections.items():
                for method, path, body in _ASKED:
                    took.setdefault((name, f"{method} {path}"), []).append(_seconds(connection, method, path, body))
    return {key: statistics.median(seconds) for key, seconds in took.items()}


def _seconds(connection: http.client.HTTPConnection, method: str, path: str, body: bytes | None) -> float:
    """Return the seconds until a request is answered with success."""
    began = time.perf_counter()
    connection.request(method, path, body, {"Content-Type": "application/json"} if body else {})
    answer = connection.getresponse()
    answer.read()
    took = time.perf_counter() - began
    if answer.status != http.client.OK:
        raise RuntimeError(f"{method} {path} answers {answer.status}")
    return took


def main() -> int:
    """Measure both and print the table; return the exit status."""
    up = module_command("grazemap.cli", "up", "--port", "0")
    with (
        tempfile.TemporaryDirectory() as folder,
        RedisServer(Path(folder)) as redis,
        (Path(folder) / "service.log").open("w") as log,
        standalone(redis.url, log) as alone,
        started(up, os.environ, Path(folder)) as start,
    ):
        times = medians({"by itself": alone, "grazemap up": urlsplit(start.url).netloc})
    for (name, request), seconds in times.items():
        print(f"{name:<14}{request:<34}{1000 * seconds:8.2f} ms")
    return int(any(seconds >= LIMIT_SECONDS for (name, _), seconds in times.items() if name == "by itself"))


if __name__ == "__main__":
    sys.exit(main())

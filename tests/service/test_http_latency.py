"""The time of small requests on a connection that is kept, to a service that is started by itself."""

from __future__ import annotations

import http.client
import os
import socket
import statistics
import subprocess
import sys
import time
from contextlib import closing

from grazemap_service.redis_server import RedisServer


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


def test_the_second_request_of_a_kept_connection_takes_no_forty_milliseconds(redis_server: RedisServer) -> None:
    """Without TCP_NODELAY each answer after the first waits for the client's delayed acknowledgement."""
    port = free_port()
    environment = {**os.environ, "GRAZEMAP_REDIS_URL": redis_server.url, "GRAZEMAP_PORT": str(port)}
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    with subprocess.Popen([sys.executable, "-m", "grazemap_service"], env=environment) as service, closing(connection):
        try:
            took = []
            for _ in range(21):
                began = time.perf_counter()
                answer(connection)
                took.append(time.perf_counter() - began)
        finally:
            service.terminate()
    assert statistics.median(took[1:]) < 0.02


def answer(connection: http.client.HTTPConnection) -> None:
    deadline = time.monotonic() + 30.0
    while True:
        try:
            # with a body, as the delay is that of an answer in two packets to a request in two packets
            connection.request("POST", "/v1/grazing-curves/estimate", b'{"omega": [0.1, 0.2, 0.3]}', _JSON)
            assert connection.getresponse().read()
            return
        except ConnectionRefusedError:  # it is still starting
            connection.close()
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


_JSON = {"Content-Type": "application/json"}

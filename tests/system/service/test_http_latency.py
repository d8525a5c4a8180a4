"""The time of small requests on a connection that is kept, to a service that is started by itself."""

from __future__ import annotations

from grazemap_service.redis_server import RedisServer
from tools import latency


def test_the_second_request_of_a_kept_connection_takes_no_forty_milliseconds(redis_server: RedisServer) -> None:
    """Without TCP_NODELAY each answer after the first waits for the client's delayed acknowledgement."""
    with latency.standalone(redis_server.url) as address:
        found = latency.medians({"by itself": address}, requests=20)
    assert len(found) == 2
    # other tests may run beside this one; `make latency` demands less
    assert max(found.values()) < 0.02

"""`python -m grazemap_worker.supervision.healthcheck`: exit 0 when a worker of this host holds its lease, 1 otherwise.

A health check for containers. It reads the leases in Redis and inspects no processes.
"""

from __future__ import annotations

import socket
import sys

from pydantic import ValidationError
from redis.exceptions import RedisError

from grazemap_worker.redis_settings import RedisSettings, refusal_text
from grazemap_worker.store import Store, trouble


def main() -> int:
    """Return the exit status."""
    try:
        # a worker is called <host>-<supervisor>-<worker>
        hosts = {worker.name.rsplit("-", 2)[0] for worker in Store(RedisSettings().connect()).workers.live()}
        reason = "" if socket.gethostname() in hosts else "no worker of this host holds a lease"
    except ValidationError as error:
        reason = refusal_text(error)
    except RedisError as error:
        reason = f"{trouble(error)}: {error}"
    if reason:
        sys.stderr.write(f"grazemap_worker.supervision.healthcheck: {reason}\n")
    return int(bool(reason))


if __name__ == "__main__":
    sys.exit(main())

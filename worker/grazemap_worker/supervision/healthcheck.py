"""`python -m grazemap_worker.supervision.healthcheck`: exit 0 when a worker of this host holds its lease, 1 otherwise.

A health check for containers: it asks Redis, as everybody else would, rather than the processes themselves.
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
        workers = Store(RedisSettings().connect()).workers.live()
    except ValidationError as error:
        sys.stderr.write(f"grazemap_worker.supervision.healthcheck: {refusal_text(error)}\n")
        return 1
    except RedisError as error:
        sys.stderr.write(f"grazemap_worker.supervision.healthcheck: {trouble(error)}: {error}\n")
        return 1
    # a worker is called <host>-<supervisor>-<worker>
    if any(worker.name.rsplit("-", 2)[0] == socket.gethostname() for worker in workers):
        return 0
    sys.stderr.write("grazemap_worker.supervision.healthcheck: no worker of this host holds a lease\n")
    return 1


if __name__ == "__main__":
    sys.exit(main())

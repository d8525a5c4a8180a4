"""``python -m grazemap_service``: the HTTP service alone, configured by the environment (see `settings`).

It listens on GRAZEMAP_HOST and GRAZEMAP_PORT, or on a socket that its parent opened (GRAZEMAP_FD), so that a
restart keeps the address. Without keys it refuses to be reached from other machines; see
`ServiceSettings.check_exposed`. `grazemap up` runs the whole stack.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
from collections.abc import Sequence

import structlog
from pydantic import ValidationError

from grazemap_service.app import create_app
from grazemap_service.connections import bounded_server
from grazemap_service.settings import ServiceSettings, SettingsError, StackSettings
from grazemap_worker.logs import configure
from grazemap_worker.redis_settings import USAGE_ERROR, refusal_text, unknown_variables


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until SIGINT or SIGTERM; return the exit status."""
    argparse.ArgumentParser(prog="python -m grazemap_service", description=__doc__).parse_args(arguments)
    try:
        settings = ServiceSettings()
        configure(settings.log_level)
        log = structlog.get_logger("grazemap_service")
        for unknown in unknown_variables(os.environ, ServiceSettings, StackSettings):
            log.warning(unknown)
        listener = _listener(settings)
    except (SettingsError, ValidationError) as error:
        text = refusal_text(error) if isinstance(error, ValidationError) else str(error)
        sys.stderr.write(f"grazemap_service: {text}\n")
        return USAGE_ERROR
    except OSError as error:
        sys.stderr.write(f"grazemap_service: cannot listen: {error}\n")
        return 1
    server = bounded_server(create_app(settings), listener)
    log.info("listening", address=str(listener.getsockname()))
    server.run(sockets=[listener])
    return 0 if server.started else 1


def _listener(settings: ServiceSettings) -> socket.socket:
    """Return the listening socket. Raises SettingsError when it is exposed and there are no keys."""
    if settings.fd is not None:
        listener = socket.socket(fileno=settings.fd)
        # only this machine can reach a unix socket
        settings.check_exposed("localhost" if listener.family == socket.AF_UNIX else listener.getsockname()[0])
        return listener
    settings.check_exposed(settings.host)
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    listener = socket.create_server((settings.host.strip("[]"), settings.port), family=family)
    # asyncio does not recognise these connections as TCP, because create_server names no protocol; they inherit this
    # option from the listener
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listener


if __name__ == "__main__":
    sys.exit(main())

"""The client of the service that a command uses."""

from __future__ import annotations

import os

from grazemap import constants
from grazemap.cli.exit_codes import InvalidCommand, say
from grazemap.client import Client
from grazemap.errors import GrazemapError
from grazemap.local_client import LocalClient
from grazemap.local_stack import LocalStack, joined_stack

# Seconds that a service on this machine has to answer.
_PROBE_TIMEOUT = 2.0


def service_or_stack(url: str | None, quiet: bool) -> Client:
    """Return a client of the service at an address, else of one at the default address, else of a stack.

    The stack is one of this user that runs already (`joined_stack`), or a temporary one.
    """
    if url or os.environ.get("GRAZEMAP_URL"):
        return client_of(url)
    with client_of(None, retries=0, timeout=_PROBE_TIMEOUT) as probe:
        try:
            running = "processes" in probe.describe()
        except GrazemapError:
            running = False
    if not running:
        return LocalClient(joined_stack(quiet) or LocalStack(quiet=quiet))
    if not quiet:
        say(f"using the service at {constants.DEFAULT_BASE_URL}")
    return client_of(None)


def client_of(
    url: str | None, retries: int = constants.DEFAULT_RETRIES, timeout: float = constants.DEFAULT_TIMEOUT
) -> Client:
    """Return a client of the service at an address, or at the default address. Raises InvalidCommand."""
    try:
        return Client(url, retries=retries, timeout=timeout)
    except ValueError as error:
        raise InvalidCommand(str(error)) from error

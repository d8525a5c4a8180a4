"""The command lines of the stack and of its tools, where their packages are installed."""

from __future__ import annotations

from importlib.util import find_spec

from grazemap.errors import MissingExtra
from grazemap.module_command import module_command

# What the stack needs besides the package itself.
_SERVER_PARTS = ("fastapi", "uvicorn", "redis", "rq", "numba", "scipy", "structlog")


def stack_command(*options: str) -> list[str]:
    """Return the command line of the stack. Raises MissingExtra where its parts are not installed."""
    return server_command("grazemap_service.stack", *options)


def server_command(module: str, *options: str) -> list[str]:
    """Return the command line of a module of the service. Raises MissingExtra where its parts are not installed."""
    if any(find_spec(part) is None for part in _SERVER_PARTS):
        raise MissingExtra("a stack on this machine, or its data folder,", "server")
    return module_command(module, *options)

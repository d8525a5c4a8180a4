"""What runs on this machine, where its packages are installed: the stack and its tools, and the modules of workers."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import Any

from grazemap.errors import MissingExtra
from grazemap.module_command import module_command

# What a computation needs besides the package itself, and what the stack needs.
_COMPUTE_PARTS = ("numba", "scipy", "loky", "threadpoolctl", "structlog")
_SERVER_PARTS = (*_COMPUTE_PARTS, "fastapi", "uvicorn", "redis", "rq")


def stack_command(*options: str) -> list[str]:
    """Return the command line of the stack. Raises MissingExtra where its parts are not installed."""
    return server_command("grazemap_service.stack", *options)


def server_command(module: str, *options: str) -> list[str]:
    """Return the command line of a module of the service. Raises MissingExtra where its parts are not installed."""
    if not serves():
        raise MissingExtra("a stack on this machine, or its data folder,", "server")
    return module_command(module, *options)


def serves() -> bool:
    """Return whether the parts of the stack are installed."""
    return all(find_spec(part) is not None for part in _SERVER_PARTS)


def worker_module(name: str) -> Any:
    """Return a module of the workers. Raises MissingExtra where what a computation needs is not installed."""
    if any(find_spec(part) is None for part in _COMPUTE_PARTS):
        raise MissingExtra("a computation without a service", "compute")
    return import_module(f"grazemap_worker.{name}")

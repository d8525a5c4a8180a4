"""Modules that are imported when they are used for the first time: numpy takes a quarter of a command's time."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class Later:
    """Stands for a module; an attribute is that of the module, which is imported then."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self._name), name)

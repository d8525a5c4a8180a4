"""The command line with which grazemap starts a process of its own."""

from __future__ import annotations

import sys


def module_command(module: str, *options: str) -> list[str]:
    """Return the command that runs a module with this interpreter, whatever modules the current folder has."""
    # -P: a file such as numpy.py in the current folder is not imported in place of the package
    return [sys.executable, "-P", "-m", module, *options]

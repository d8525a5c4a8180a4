"""The command `up`, which runs a stack on this machine."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import signal
import subprocess
import sys
from importlib import import_module
from pathlib import Path

from grazemap.cli.exit_codes import DONE, FAILED
from grazemap.errors import ProtocolError
from grazemap.server_command import serves, stack_command
from grazemap.start_display import StartLine, ready_line

# Default address of `up`, as in the service's settings; environment variables override it.
_DEFAULT_ADDRESS = {"GRAZEMAP_HOST": "127.0.0.1", "GRAZEMAP_PORT": "8000"}


def add_arguments(up: argparse.ArgumentParser, _: str) -> None:
    """Add the arguments of the command to its parser."""
    host, port = (_setting(name, default) for name, default in _DEFAULT_ADDRESS.items())
    up.add_argument("--host", default=host, help="address to listen on; overrides GRAZEMAP_HOST (default: %(default)s)")
    # a default is text, so that argparse checks it like an argument
    up.add_argument(
        "--port", type=_port, default=port, help="port, 0 any free one; overrides GRAZEMAP_PORT (default: %(default)s)"
    )
    up.add_argument(
        "--data",
        type=Path,
        metavar="FOLDER",
        help="folder for jobs and results (default: a temporary one, removed at the end)",
    )
    up.add_argument("--workers", type=_positive, help="worker processes (default: one per processor)")
    up.set_defaults(command=_up)


def after_help() -> str:
    """Return the settings of the stack, where its parts are installed."""
    if not serves():
        return ""
    text: str = import_module("grazemap_service.settings_list").help_text(shutil.get_terminal_size().columns - 2)
    return f"\n{text}"


def _setting(name: str, default: str) -> str:
    # the case of names does not matter, as in the service's settings
    return next((value for key, value in os.environ.items() if key.upper() == name), default)


def _positive(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError("must be a whole number of at least 1")
    return int(text)


def _port(text: str) -> int:
    if not text.isascii() or not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError("this port, or GRAZEMAP_PORT, must be a whole number from 0 to 65535")
    return int(text)


def _up(options: argparse.Namespace) -> int:
    shown = StartLine(sys.stderr)
    shown.show("starting")
    address = ("--host", options.host, "--port", str(options.port))
    command = stack_command(*address, "--talk", "--die-with-parent", str(os.getpid()))
    for name in ("data", "workers"):
        if getattr(options, name) is not None:
            command += [f"--{name}", str(getattr(options, name))]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as stack:
        previous_handler = signal.signal(signal.SIGTERM, lambda *_: stack.terminate())
        try:
            assert stack.stdout is not None
            line = ready_line(stack.stdout, shown)
            shown.close(ready=bool(line))
            if line:
                print(_addresses(line), flush=True)
            code = stack.wait()
        except KeyboardInterrupt:
            # The terminal sends the signal to the stack as well, and the stack stops.
            stack.wait()
            return DONE
        finally:
            signal.signal(signal.SIGTERM, previous_handler)
    return DONE if code in (0, -signal.SIGTERM) else FAILED


def _addresses(line: bytes) -> str:
    try:
        url = json.loads(line)["url"]
    except (ValueError, KeyError, TypeError) as error:
        raise ProtocolError("the stack did not print its address") from error
    return f"explorer  {url}/\nguide     {url}/guide/\ndocs      {url}/docs\nmetrics   {url}/metrics\nCtrl-C stops it."

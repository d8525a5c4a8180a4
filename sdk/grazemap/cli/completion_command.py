"""The command `completion`, which prints a script for a shell."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

from grazemap.cli.exit_codes import DONE

_SHELLS = ("bash", "zsh", "tcsh")


def add_command(commands: Any, parser: Callable[[], argparse.ArgumentParser]) -> None:
    """Add the command to those of the parser; `parser` returns the parser of all commands."""
    completion = commands.add_parser("completion", help="print the completion script of a shell")
    completion.add_argument("shell", choices=_SHELLS)
    completion.set_defaults(command=lambda options: _completion(options.shell, parser()))


def _completion(shell: str, parser: argparse.ArgumentParser) -> int:
    import shtab

    _complete_files(parser, {"FILE": shtab.FILE, "FOLDER": shtab.DIRECTORY})
    print(shtab.complete(parser, shell))
    return DONE


def _complete_files(parser: argparse.ArgumentParser, kinds: dict[str, Any]) -> None:
    """Mark the arguments that are files and folders, of all commands, as shtab reads them."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for subparser in action.choices.values():
                _complete_files(subparser, kinds)
        elif action.metavar in kinds:
            action.complete = kinds[action.metavar]  # type: ignore[attr-defined]

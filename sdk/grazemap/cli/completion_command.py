"""The command `completion`, which prints a script for a shell."""

from __future__ import annotations

import argparse
from typing import Any

from grazemap.cli import commands
from grazemap.cli.exit_codes import DONE, printing

_SHELLS = ("bash", "zsh", "tcsh")


def add_arguments(completion: argparse.ArgumentParser, _: str) -> None:
    """Add the arguments of the command to its parser."""
    completion.add_argument("shell", choices=_SHELLS)
    completion.set_defaults(command=_completion)


def _completion(options: argparse.Namespace) -> int:
    import shtab

    parser = commands.parser()
    _complete_files(parser, {"FILE": shtab.FILE, "FOLDER": shtab.DIRECTORY})
    with printing():
        print(shtab.complete(parser, options.shell))
    return DONE


def _complete_files(parser: argparse.ArgumentParser, kinds: dict[str, Any]) -> None:
    """Mark the arguments that are files and folders, of all commands, as shtab reads them."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for subparser in action.choices.values():
                _complete_files(subparser, kinds)
        elif action.metavar in kinds:
            action.complete = kinds[action.metavar]  # type: ignore[attr-defined]

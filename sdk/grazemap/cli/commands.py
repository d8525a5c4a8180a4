"""The parser of all commands, and the options of a command."""

from __future__ import annotations

import argparse
import re
from collections.abc import Collection, Sequence
from difflib import get_close_matches
from typing import Any

from grazemap.cli import completion, computing, saved, stack
from grazemap.version import __version__
from grazemap.wire import PROCESSES

# Column of the descriptions of the commands.
_COLUMN = 28


class _OneLine(argparse.HelpFormatter):
    """One line for each command: argparse computes their column without the indentation of their names."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=_COLUMN)
        self._action_max_length = _COLUMN - 2


class _Parser(argparse.ArgumentParser):
    """A parser whose flags are written in full, as a new field would make an abbreviation ambiguous."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(allow_abbrev=False, **keywords)
        self.set_defaults(parser=self)


def parser(processes: Collection[str] = tuple(PROCESSES)) -> argparse.ArgumentParser:
    """Return the parser of all commands; each of them sets `command`, the function that runs it.

    Only these processes have their flags, as those of all of them take a tenth of a second.
    """
    top = _Parser(
        prog="grazemap",
        description="Grazing bifurcations of impact oscillators.",
        formatter_class=_OneLine,
    )
    top.add_argument("--version", action="version", version=f"grazemap {__version__}")
    commands = top.add_subparsers(title="commands", required=True, metavar="COMMAND")
    computing.add_processes(commands, processes)
    stack.add_commands(commands)
    saved.add_commands(commands)
    completion.add_command(commands, parser)
    return top


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command, with its `command`. Ends this process where the command is invalid.

    A process has the unknown flags among its options, as `unknown`, and names them with its other errors.
    """
    options, left = parser(set(arguments)).parse_known_args(_with_negative_values(arguments))
    options.unknown = {name: _suggestion(name, options.parser) for name in _names(left)}
    if options.unknown and options.command is not computing.compute:
        options.parser.error("; ".join(f"unknown: {name}{said}" for name, said in options.unknown.items()))
    return options


def _with_negative_values(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with values such as -1,0,0 joined to their flag, as argparse takes these for flags."""
    joined: list[str] = []
    for text in arguments:
        if re.match(r"-\.?\d", text) and joined and re.match(r"--[^=]+$", joined[-1]):
            joined[-1] += "=" + text
        else:
            joined.append(text)
    return joined


def _names(left: Sequence[str]) -> list[str]:
    """Return the names of the arguments that are left over; a word after a flag is taken for its value."""
    return [
        text.partition("=")[0] if text.startswith("-") else text
        for before, text in zip(["", *left], left, strict=False)
        if text.startswith("-") or not before.startswith("-") or "=" in before
    ]


def _suggestion(name: str, parser: argparse.ArgumentParser) -> str:
    # argparse has no public list of its flags
    near = get_close_matches(name, parser._option_string_actions, n=1)
    return f"; did you mean {near[0]}" if near else ""

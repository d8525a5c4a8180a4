"""The parser of all commands, and the options of a command."""

from __future__ import annotations

import argparse
import re
from collections.abc import Collection, Sequence
from typing import Any

from grazemap.cli import checking, completion, computing, saved, stack, status, storage
from grazemap.version import __version__
from grazemap.wire import PROCESSES, ProblemError
from grazemap.wire.error_texts import suggestion

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
    stack.add_command(commands)
    status.add_command(commands)
    storage.add_commands(commands)
    saved.add_commands(commands)
    checking.add_command(commands)
    completion.add_command(commands, parser)
    return top


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command, with its `command`. Ends this process where the command is invalid.

    A process has the errors of its flags among its options, as `errors`, and names them with those of its request.
    """
    words = _with_hyphens(arguments)
    top = parser(set(words))
    command = _command(top, words)
    words, valued = _switches_apart(_with_negative_values(words), command)
    options, left = top.parse_known_args(words)
    computes = options.command is computing.compute
    options.errors = [*valued, *(_left_over(name, command, computes) for name in _names(left))]
    if options.errors and not computes:
        command.error("; ".join(f"{one.pointer}: {one.detail}" for one in options.errors))
    return options


def _with_hyphens(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with hyphens for underscores in the names of commands, processes and flags."""
    named = 2 if arguments[:1] in (["run"], ["schema"]) else 1
    parts = [
        text.partition("=") if text.startswith("--") or place < named else ("", "", text)
        for place, text in enumerate(arguments)
    ]
    return [name.replace("_", "-") + equals + value for name, equals, value in parts]


def _command(top: argparse.ArgumentParser, words: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the command in the first words. Ends this process where there is none of this name."""
    found = top
    for word in words[:2]:
        # argparse has no public list of what a parser takes
        chosen = next((one for one in found._actions if one.choices is not None and not one.option_strings), None)
        if chosen is None or chosen.choices is None or word.startswith("-"):
            break
        if word not in chosen.choices:
            near = suggestion(word, chosen.choices) or f" (allowed: {', '.join(chosen.choices)})"
            found.error(f"there is no {str(chosen.metavar or chosen.dest).lower()} {word}{near}")
        found = chosen.choices[word] if isinstance(chosen.choices, dict) else found
    return found


def _switches_apart(words: Sequence[str], command: argparse.ArgumentParser) -> tuple[list[str], list[ProblemError]]:
    """Return the words without those flags that have a value and take none, and an error for each of them."""
    switches = {name: one.option_strings for name, one in command._option_string_actions.items() if one.nargs == 0}
    takes_words = any(not one.option_strings and not isinstance(one.choices, dict) for one in command._actions)
    rest: list[str] = []
    errors = []
    for word in words:
        name, equals, value = word.partition("=")
        if not equals and rest and not word.startswith("-") and not takes_words:
            name, value = rest[-1], word
        if value and name in switches:
            allowed = " or ".join(switches[name])
            errors.append(ProblemError(pointer=f"{name} {value}", detail="A switch has no value", allowed=allowed))
        else:
            rest.append(word)
    return rest, errors


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


def _left_over(name: str, command: argparse.ArgumentParser, computes: bool) -> ProblemError:
    if name.startswith("-"):
        return ProblemError(pointer=name, detail=f"Unknown flag{suggestion(name, command._option_string_actions)}")
    spaces = "; ranges and lists are written without spaces" if computes else ""
    return ProblemError(pointer=name, detail=f"Unexpected argument{spaces}")

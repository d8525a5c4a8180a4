"""The parser of all commands, and the options of a command.

The models of requests and the client take half a second to import. They are imported only for commands that need them.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

from grazemap.cli import storage_commands, up_command
from grazemap.version import __version__

if TYPE_CHECKING:
    from grazemap.wire import ProblemError

# Column of the descriptions of the commands.
_COLUMN = 28


class _OneLineHelp(argparse.HelpFormatter):
    """Help with one line for each command: the width that argparse computes lacks the indentation of the names."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=_COLUMN)
        self._action_max_length = _COLUMN - 2


class _Parser(argparse.ArgumentParser):
    """A parser without abbreviated flags: with a new field, an abbreviation could become ambiguous."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(allow_abbrev=False, **keywords)


def parser(processes: Collection[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of all commands; each of them sets `command`, the function that runs it.

    Only the commands of `processes` (None: of all) have their flags: making the flags of all processes takes a tenth of
    a second.
    """
    from grazemap.cli import check_command, completion_command, process_commands, result_commands, status_command

    top, commands = _top()
    process_commands.add_processes(commands, processes)
    up_command.add_command(commands)
    status_command.add_command(commands)
    storage_commands.add_commands(commands)
    result_commands.add_commands(commands)
    check_command.add_command(commands)
    completion_command.add_command(commands, parser)
    return top


def _parser_of(words: Sequence[str]) -> argparse.ArgumentParser:
    """Return a parser that has the command of some words."""
    top, commands = _top()
    up_command.add_command(commands)
    storage_commands.add_commands(commands)
    return top if words and words[0] in commands.choices else parser(set(words))


def _top() -> tuple[argparse.ArgumentParser, Any]:
    """Return a parser without commands, and what commands are added to."""
    top = _Parser(
        prog="grazemap",
        description="Grazing bifurcations of impact oscillators.",
        formatter_class=_OneLineHelp,
    )
    top.add_argument("--version", action="version", version=f"grazemap {__version__}")
    return top, top.add_subparsers(title="commands", required=True, metavar="COMMAND")


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command, with its `command`. Ends this process where the command is invalid.

    For a command that computes, invalid flags are not fatal here. They are in the option `errors`, so that the command
    reports them together with the errors of its request.
    """
    words = _with_hyphens(arguments)
    top = _parser_of(words)
    command = _command(top, words)
    words, errors_of_switches = _without_switch_values(_with_negative_values(words), command)
    options, unknown = top.parse_known_args(words)
    computes = "computes" in options
    options.errors = [
        *errors_of_switches,
        *(_unknown_argument(name, command, computes) for name in _argument_names(unknown)),
    ]
    if options.errors and not computes:
        command.error("; ".join(f"{error.pointer}: {error.detail}" for error in options.errors))
    return options


def _with_hyphens(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with hyphens for underscores in the names of commands, processes and flags."""
    name_count = 2 if arguments[:1] in (["run"], ["schema"]) else 1
    parts = [
        text.partition("=") if text.startswith("--") or place < name_count else ("", "", text)
        for place, text in enumerate(arguments)
    ]
    return [name.replace("_", "-") + equals + value for name, equals, value in parts]


def _command(top: argparse.ArgumentParser, words: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the command that the first words name. Ends this process if there is no such command."""
    current = top
    for word in words[:2]:
        # argparse has no public list of the arguments of a parser
        positional = (action for action in current._actions if not action.option_strings)
        chosen = next((action for action in positional if action.choices is not None), None)
        if chosen is None or chosen.choices is None or word.startswith("-"):
            break
        if word not in chosen.choices:
            from grazemap.wire.error_texts import suggestion

            near = suggestion(word, chosen.choices) or f" (allowed: {', '.join(chosen.choices)})"
            current.error(f"there is no {str(chosen.metavar or chosen.dest).lower()} {word}{near}")
        current = chosen.choices[word] if isinstance(chosen.choices, dict) else current
    return current


def _without_switch_values(
    words: Sequence[str], command: argparse.ArgumentParser
) -> tuple[list[str], list[ProblemError]]:
    """Return the words without switches that are given a value, and an error for each of these."""
    flags = command._option_string_actions.items()
    switches = {name: action.option_strings for name, action in flags if action.nargs == 0}
    takes_words = any(not action.option_strings and not isinstance(action.choices, dict) for action in command._actions)
    rest: list[str] = []
    errors = []
    for word in words:
        name, equals, value = word.partition("=")
        if not equals and rest and not word.startswith("-") and not takes_words:
            name, value = rest[-1], word
        if value and name in switches:
            from grazemap.wire import ProblemError

            allowed = " or ".join(switches[name])
            errors.append(ProblemError(pointer=f"{name} {value}", detail="A switch has no value", allowed=allowed))
        else:
            rest.append(word)
    return rest, errors


def _with_negative_values(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with values such as -1,0,0 joined to their flag: argparse would take them for flags."""
    joined: list[str] = []
    for text in arguments:
        if re.match(r"-\.?\d", text) and joined and re.match(r"--[^=]+$", joined[-1]):
            joined[-1] += "=" + text
        else:
            joined.append(text)
    return joined


def _argument_names(unknown: Sequence[str]) -> list[str]:
    """Return the names of unknown arguments; a word after an unknown flag is taken for its value."""
    return [
        text.partition("=")[0] if text.startswith("-") else text
        for previous, text in zip(["", *unknown], unknown, strict=False)
        if text.startswith("-") or not previous.startswith("-") or "=" in previous
    ]


def _unknown_argument(name: str, command: argparse.ArgumentParser, computes: bool) -> ProblemError:
    from grazemap.wire import ProblemError
    from grazemap.wire.error_texts import suggestion

    if name.startswith("-"):
        return ProblemError(pointer=name, detail=f"Unknown flag{suggestion(name, command._option_string_actions)}")
    spaces = "; ranges and lists are written without spaces" if computes else ""
    return ProblemError(pointer=name, detail=f"Unexpected argument{spaces}")

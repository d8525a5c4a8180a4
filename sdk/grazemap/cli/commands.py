"""The parser of all commands, and the options of a command.

The models of requests and the client take a third of a second to import. The modules of commands import them, and are
imported only for the command of the command line: listing the commands, `--version` and a wrong name need none.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Collection, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from grazemap.process_names import SUMMARIES
from grazemap.suggestions import suggestion
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

    after_help: Callable[[], str] | None = None
    """Returns what follows the help; it takes longer to make than all else, so it is called for the help alone."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(allow_abbrev=False, **keywords)

    def format_help(self) -> str:
        """Return the help, with what follows it."""
        return super().format_help() + (self.after_help() if self.after_help else "")


# The commands that are not processes: the modules that add their arguments, and what the commands do.
_OTHERS = {
    "tile": ("tile_commands", "compute a tile of a plan"),
    "assemble": ("tile_commands", "join the tiles of a plan to its result"),
    "up": ("up_command", "run a service with its workers on this machine"),
    "status": ("status_command", "show a running service and its jobs"),
    "repair": ("storage_commands", "cut off the damaged end of an append-only file"),
    "backup": ("storage_commands", "save a data folder, also while a stack runs on it"),
    "restore": ("storage_commands", "create a data folder from a backup"),
    "plot": ("result_commands", "draw a saved result"),
    "show": ("result_commands", "say what a saved result is"),
    "schema": ("result_commands", "print the JSON schema of a request"),
    "check": ("check_command", "verify the certificate of a proof"),
    "completion": ("completion_command", "print the completion script of a shell"),
}


# The commands that are followed by a process.
_OF_PROCESSES = {
    "run": "compute a process; the same as its own command",
    "plan": "cut a computation into tiles",
}


def parser(named: Collection[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of all commands; each of them sets `command`, the function that runs it.

    Only the commands that are named (None: all) have their arguments, because loading what they need takes longer than
    to list all commands.
    """
    top = _Parser(
        prog="grazemap",
        description="Grazing bifurcations of impact oscillators.",
        formatter_class=_OneLineHelp,
    )
    top.add_argument("--version", action="version", version=f"grazemap {__version__}")
    commands = top.add_subparsers(title="commands", required=True, metavar="COMMAND")
    _add_processes(commands, named)
    for name, what in _OF_PROCESSES.items():
        command = commands.add_parser(name, help=what)
        _add_processes(command.add_subparsers(required=True, metavar="PROCESS"), named, plans=name == "plan")
    for name, (module, what) in _OTHERS.items():
        added = commands.add_parser(name, help=what)
        if named is None or name in named:
            arguments = import_module(f"grazemap.cli.{module}")
            arguments.add_arguments(added, name)
            added.after_help = getattr(arguments, "after_help", None)
    return top


def _add_processes(commands: Any, named: Collection[str] | None, plans: bool = False) -> None:
    """Add a command for each process."""
    for process, summary in SUMMARIES.items():
        options: dict[str, Any] = {}
        if named is None or process in named:
            from grazemap.cli import process_commands

            options = process_commands.options_of_parser(process, plans)
        commands.add_parser(process, help=summary, **options)


def parsed(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options of a command, with its `command`. Ends this process where the command is invalid.

    For a command that computes, invalid flags are not fatal here. They are in the option `errors`, so that the command
    reports them together with the errors of its request.
    """
    words = _with_hyphens(arguments)
    top = parser(words[: 2 if words[:1] and words[0] in _OF_PROCESSES else 1])
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
    name_count = 2 if arguments[:1] and arguments[0] in (*_OF_PROCESSES, "schema") else 1
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

    if name.startswith("-"):
        known = command._option_string_actions
        parts = ", ".join(flag for flag in known if flag.startswith(f"{name}-"))
        near = f"; its parts have flags: {parts}" if parts else suggestion(name, known)
        return ProblemError(pointer=name, detail=f"Unknown flag{near}")
    spaces = "; ranges and lists are written without spaces" if computes else ""
    return ProblemError(pointer=name, detail=f"Unexpected argument{spaces}")

"""The command `check`, which verifies a certificate without a service."""

from __future__ import annotations

import argparse
import json
import subprocess
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from grazemap.cli import files
from grazemap.cli.exit_codes import DONE, FAILED, InvalidCommand, fail, printing
from grazemap.module_command import module_command

_MAX_BYTES = 50_000_000
_SECONDS = 3600.0
_MAX_SECONDS = 1e6


def add_arguments(check: argparse.ArgumentParser, _: str) -> None:
    """Add the arguments of the command to its parser."""
    check.add_argument("certificate", type=Path, metavar="FILE", help="a result of proofs saved as .json")
    check.add_argument(
        "--seconds",
        type=float,
        default=_SECONDS,
        metavar="S",
        help=f"give up after so many seconds (default {_SECONDS:g})",
    )
    check.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    if find_spec("flint") is None:
        raise InvalidCommand("the checker needs python-flint: pip install 'grazemap[proofs]'")
    if not 0 < options.seconds <= _MAX_SECONDS:
        raise InvalidCommand(f"--seconds must be above 0 and at most {_MAX_SECONDS:g}")
    with files.naming_errors("the certificate", options.certificate), options.certificate.open("rb") as stream:
        data = stream.read(_MAX_BYTES + 1)
    if len(data) > _MAX_BYTES:
        raise InvalidCommand("the file is too large for a certificate")
    # in a process of its own, which can be ended during a long step of the arithmetic
    try:
        done = subprocess.run(
            module_command("grazemap.checker"),
            input=data,
            stdout=subprocess.PIPE,
            timeout=options.seconds,
            check=False,
            start_new_session=True,  # Ctrl-C reaches this process alone, which then ends the other
        )
    except subprocess.TimeoutExpired:
        return fail(f"undecided: the certificate is not verified within {options.seconds:g} s", FAILED)
    if done.returncode:
        return fail("the checker ended before its verdict", FAILED)
    return _print(json.loads(done.stdout))


def _print(answer: dict[str, Any]) -> int:
    """Print the verdict of the checker; return the exit status."""
    if answer["outcome"] == "no certificate":
        raise InvalidCommand(f"the file is not a certificate: {answer['reason']}")
    if answer["outcome"] == "undecided":
        return fail("the certificate says that its statement is undecided", FAILED)
    if answer["outcome"] == "refused":
        return fail(f"not verified: {answer['reason']}", FAILED)
    with printing():
        print(f"verified: the statement is {answer['verdict']}")
        for name, value in (answer["statement"] | answer["oscillator"]).items():
            print(f"  {name}: {json.dumps(value)}")
        for name, value in answer["enclosures"].items():
            print(f"  shown, {name}: {json.dumps(value)}")
    return DONE

"""The command `check`, which verifies a certificate without a service."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from grazemap.cli import files
from grazemap.cli.outcome import DONE, FAILED, InvalidCommand, fail

_MOST_BYTES = 50_000_000


def add_command(commands: Any) -> None:
    """Add the command to the parser's."""
    check = commands.add_parser("check", help="verify the certificate of a proof")
    check.add_argument("certificate", type=Path, metavar="FILE", help="a result of proofs saved as .json")
    check.set_defaults(command=_check)


def _check(options: argparse.Namespace) -> int:
    try:
        from grazemap.checker import check
    except ModuleNotFoundError as error:
        if error.name != "flint":
            raise
        raise InvalidCommand("the checker needs python-flint: pip install 'grazemap[proofs]'") from None
    certificate = _read(options.certificate)
    if certificate["verdict"] == "undecided":
        return fail(f"the certificate says that its statement is undecided: {certificate.get('reason')}", FAILED)
    answer = check(certificate)
    if not answer.accepted:
        return fail(f"not verified: {answer.reason}", FAILED)
    print(f"verified: the statement is {certificate['verdict']}")
    inputs = {name: certificate["theorem"][name] for name in ("gaps", "restitutions")}
    for name, value in (certificate["statement"] | inputs | certificate["oscillator"]).items():
        print(f"  {name}: {value}")
    for name, value in answer.enclosures.items():
        print(f"  shown, {name}: {value}")
    return DONE


def _read(path: Path) -> dict[str, Any]:
    """Return the certificate in a file, or in a result that was saved as JSON."""
    with files.named("the certificate", path):
        if path.stat().st_size > _MOST_BYTES:
            raise InvalidCommand(f"{path} is too large for a certificate")
        data = path.read_bytes()
    try:
        document = json.loads(data)
        found = json.loads(document["certificate"]) if "certificate" in document else document
        if isinstance(found, dict) and isinstance(found["statement"], dict) and isinstance(found["verdict"], str):
            return found
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise InvalidCommand(f"{path} is not a certificate")

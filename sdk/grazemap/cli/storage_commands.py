"""The commands `repair`, `backup` and `restore` for the data folder of a stack."""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path
from typing import Any

from grazemap.cli.exit_codes import DONE, FAILED
from grazemap.server_command import server_command


def add_commands(commands: Any) -> None:
    """Add the three commands to the subcommands of the parser."""
    repair = commands.add_parser("repair", help="cut off the damaged end of an append-only file")
    backup = commands.add_parser("backup", help="save a data folder, also while a stack runs on it")
    restore = commands.add_parser("restore", help="create a data folder from a backup")
    for name, parser in (("repair", repair), ("backup", backup), ("restore", restore)):
        parser.set_defaults(command=_storage, name=name, file=None, force=False)
        parser.add_argument("--data", type=Path, metavar="FOLDER", required=True, help="folder for jobs and results")
    backup.add_argument("-o", "--output", dest="file", type=Path, metavar="FILE", required=True, help="the backup")
    restore.add_argument("file", type=Path, metavar="FILE", help="the backup to restore")
    restore.add_argument("--force", action="store_true", help="rename a folder that has data, and restore")


def _storage(options: argparse.Namespace) -> int:
    arguments = [options.name, *([str(options.file)] if options.file else []), "--data", str(options.data)]
    arguments += ["--force"] if options.force else []
    code = subprocess.run(server_command("grazemap_service.storage", *arguments), check=False).returncode
    return DONE if code == 0 else FAILED

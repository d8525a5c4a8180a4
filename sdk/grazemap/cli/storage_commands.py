"""The commands `repair`, `backup` and `restore`, which keep and mend the data folder of a stack."""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path
from typing import Any

from grazemap.cli.exit_codes import DONE, FAILED
from grazemap.local_stack import server_command


def add_commands(commands: Any) -> None:
    """Add the commands to those of the parser."""
    repair = commands.add_parser("repair", help="cut off a damaged end of a data folder's file")
    backup = commands.add_parser("backup", help="save a data folder, also while a stack runs on it")
    restore = commands.add_parser("restore", help="make a data folder of a backup")
    for command in (repair, backup, restore):
        command.add_argument("--data", type=Path, metavar="FOLDER", required=True, help="folder for jobs and results")
    backup.add_argument("-o", "--output", dest="file", type=Path, metavar="FILE", required=True, help="a snapshot")
    restore.add_argument("file", type=Path, metavar="FILE", help="the backup")
    restore.add_argument("--force", action="store_true", help="also into a folder with data, which is renamed")
    for name, command in (("repair", repair), ("backup", backup), ("restore", restore)):
        command.set_defaults(command=_storage, name=name, file=None, force=False)


def _storage(options: argparse.Namespace) -> int:
    words = [options.name, *([str(options.file)] if options.file else []), "--data", str(options.data)]
    words += ["--force"] if options.force else []
    code = subprocess.run(server_command("grazemap_service.storage", *words), check=False).returncode
    return DONE if code == 0 else FAILED

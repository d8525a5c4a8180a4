"""The commands `repair`, `backup` and `restore` for the data folder of a stack."""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

from grazemap.cli.exit_codes import DONE, FAILED
from grazemap.server_command import server_command


def add_arguments(command: argparse.ArgumentParser, name: str) -> None:
    """Add the arguments of one of the three commands to its parser."""
    command.set_defaults(command=_storage, name=name, file=None, force=False)
    command.add_argument("--data", type=Path, metavar="FOLDER", required=True, help="folder for jobs and results")
    if name == "backup":
        command.add_argument("-o", "--output", dest="file", type=Path, metavar="FILE", required=True, help="the backup")
    elif name == "restore":
        command.add_argument("file", type=Path, metavar="FILE", help="the backup to restore")
        command.add_argument("--force", action="store_true", help="rename a folder that has data, and restore")


def _storage(options: argparse.Namespace) -> int:
    arguments = [options.name, *([str(options.file)] if options.file else []), "--data", str(options.data)]
    arguments += ["--force"] if options.force else []
    code = subprocess.run(server_command("grazemap_service.storage", *arguments), check=False).returncode
    return DONE if code == 0 else FAILED

"""Files that commands read and write."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grazemap import constants
from grazemap.cli.exit_codes import InvalidCommand, printing

if TYPE_CHECKING:
    from grazemap.results import Result
    from grazemap.wire import ProcessRequest

PICTURES = constants.PICTURE_FILES
OUTPUTS = (".npz", ".json", *constants.TABLE_FILES, *PICTURES)


@contextmanager
def naming_errors(what: str, path: Path | str) -> Iterator[None]:
    """Within this block, put the name of a file in front of the text of an OSError."""
    try:
        yield
    except OSError as error:
        raise OSError(f"{what} {path}: {error.strerror or error}") from error


def check_output(what: str, path: Path, endings: tuple[str, ...]) -> None:
    """Raise InvalidCommand, before the computation, for an output that cannot be written."""
    if path.suffix not in endings:
        raise InvalidCommand(f"{what} must end in one of {', '.join(endings)}")
    if path.is_dir():
        raise InvalidCommand(f"{what} {path} is a folder")
    if not path.parent.is_dir():
        raise InvalidCommand(f"{what}: the folder {path.parent} does not exist")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise InvalidCommand(f"{what} {path} cannot be written")
    if path.suffix in PICTURES:
        from grazemap.plots.axes import kept_from_pyplot, new_figure

        with kept_from_pyplot():
            new_figure(1.0, 1.0)
    if path.suffix in constants.TABLE_FILES:
        from grazemap.results.tables import require_writer

        require_writer(path.suffix)


def check_rows(what: str, path: Path, request: ProcessRequest) -> None:
    """Raise InvalidCommand, before the computation, for a table that cannot have all points of a plane."""
    from grazemap.results.tables import POINTS, require_rows
    from grazemap.wire.planes import PlaneRequest

    if isinstance(request, PlaneRequest):
        try:
            require_rows(path.suffix, math.prod(request.plane.shape), POINTS)
        except ValueError as error:
            raise InvalidCommand(f"{what} {path}: {error}") from error


def check_tables(process: str) -> None:
    """Raise InvalidCommand for a process whose results have no table."""
    from grazemap.results import RESULTS, Result
    from grazemap.results.tables import is_table

    def has_tables(result: type[Result]) -> bool:
        derived = result.derived_tables is not Result.derived_tables
        return derived or bool(result.schema.rows) or any(map(is_table, result.schema))

    if not any(has_tables(result) for result in RESULTS.values() if result.process == process):
        raise InvalidCommand(f"there is no table of {process}")


def check_drawn(process: str) -> None:
    """Raise InvalidCommand for a process whose results have no picture."""
    from grazemap.results import RESULTS

    if not any(hasattr(result, "plot") for result in RESULTS.values() if result.process == process):
        raise InvalidCommand(f"there is no picture of {process}")


def read(path: Path) -> Result:
    """Return the result in a file. Raises OSError."""
    from grazemap.results import load

    with naming_errors("the result", path):
        return load(path)


def add_style(command: argparse._ActionsContainer) -> None:
    """Add the flag of the style of pictures to a command."""
    command.add_argument(
        "--style",
        choices=constants.PICTURE_STYLES,
        default=constants.PICTURE_STYLES[0],
        help="the style of pictures: screen, or column for a column of a journal, 3.4 inches wide",
    )


def write(
    what: str,
    path: Path,
    result: Result,
    style: constants.PictureStyle = constants.PICTURE_STYLES[0],
    **drawn: Any,
) -> None:
    """Write a result as the ending of the path says, and print the path. Raises OSError, InvalidCommand.

    `style` is that of a picture, and `drawn` are further keywords of the result's `plot`.
    """
    with naming_errors(what, path):
        try:
            if path.suffix in PICTURES:
                from grazemap.plots import save_picture

                save_picture(result, path, style=style, **drawn)
            else:
                result.save(path)
        except ValueError as error:
            raise InvalidCommand(f"{what} {path}: {error}") from error
    with printing():
        print(path)

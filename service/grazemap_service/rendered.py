"""Results as tables and pictures, made by the command line in a process of its own.

Drawing takes seconds and memory that the service does not have for it, and the libraries that draw are loaded by this
process alone.
"""

from __future__ import annotations

import os
import subprocess
from contextlib import closing

from grazemap.constants import TABLE_FILES
from grazemap.module_command import module_command
from grazemap_service.problems import ProblemException
from grazemap_service.temporary import TemporaryFolder
from grazemap_worker.system import tied

RENDERED_TYPES = {
    "csv": "text/csv; charset=utf-8",
    "xlsx": "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet",
    "parquet": "application/vnd.apache.parquet",
    "png": "image/png",
    "svg": "image/svg+xml",
    "pdf": "application/pdf",
}
"""Names and media types of tables and pictures."""
# Seconds after which a table or a picture is given up, and its most bytes.
_SECONDS, _MAX_BYTES = 120.0, 1 << 28
_NICENESS = 10
_PREFIX = "grazemap: "


def rendered(npz: bytes, form: str, variant: str = "") -> bytes:
    """Return a table or a picture of a stored result; this takes seconds.

    Parameters
    ----------
    form : str
        A key of `RENDERED_TYPES`.
    variant : str
        The name of a table, or the style of a picture; without one, they are those of `Result.save` and `plot`.

    Raises
    ------
    ProblemException
        "not-acceptable": the result has no such table or picture, what writes it is not installed here, or it is too
        large.
    """
    with closing(TemporaryFolder("result")) as folder:
        result, output = folder.path / "result.npz", folder.path / f"result.{form}"
        result.write_bytes(npz)
        is_table = output.suffix in TABLE_FILES
        options = ["show" if is_table else "plot", str(result), "-o", str(output)]
        if variant:
            options.append(f"--{'table' if is_table else 'style'}={variant}")
        tie = tied()

        def begin() -> None:
            tie()
            os.nice(_NICENESS)

        try:
            run = subprocess.run(
                module_command("grazemap.cli", *options),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                timeout=_SECONDS,
                check=False,
                preexec_fn=begin,
            )
        except subprocess.TimeoutExpired:
            raise ProblemException("not-acceptable", f"It is not made within {_SECONDS:.0f} s: ask for npz.") from None
        if run.returncode != 0:
            reason = next((line for line in run.stderr.splitlines()[::-1] if line.startswith(_PREFIX)), "")
            raise ProblemException("not-acceptable", reason.removeprefix(_PREFIX) or "It cannot be made here.")
        if output.stat().st_size > _MAX_BYTES:
            raise ProblemException("not-acceptable", f"It is over {_MAX_BYTES >> 20} MiB: ask for npz.")
        return output.read_bytes()

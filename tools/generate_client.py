"""Generates the blocking client from the asynchronous one: `make client`.

python tools/generate_client.py          write the modules
python tools/generate_client.py FOLDER   write them into another folder
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

import unasync

CLIENT = Path(__file__).parents[1] / "sdk" / "grazemap" / "client"
MODULES = ("client", "connection", "jobs", "watch")
_HEADER = "# Generated from {source} by `make client`: do not edit.\n"
# Names, beside those that unasync knows and those of the modules' own classes.
_NAMES = {
    "asyncio": "time",
    "aclose": "close",
    "aclosing": "closing",
    "aiter_bytes": "iter_bytes",
    "aiter_lines": "iter_lines",
    "aread": "read",
    "aiter_text": "iter_text",
    "AbstractAsyncContextManager": "AbstractContextManager",
    "AsyncBaseTransport": "BaseTransport",
    "Awaited": "Blocking",
}
# Phrases of docstrings, and of what only an event loop needs.
_PHRASES = {" from asyncio": "", "await client.": "client.", "await asyncio.to_thread(function, ": "function("}
_OWN_NAME = re.compile(
    r"\b[Aa]sync_?(?=(?:Client|JobHandle|Follower|Connection|BaseTransport|client|jobs|watch|connection)\b)"
)
_CONFIGURATION = Path(__file__).parents[1] / "pyproject.toml"


def generate(folder: Path) -> None:
    """Write the blocking modules into a folder."""
    with tempfile.TemporaryDirectory() as temporary:
        written, generated = Path(temporary, "written"), Path(temporary, "generated")
        written.mkdir()
        for module in MODULES:
            text = (CLIENT / f"async_{module}.py").read_text()
            for phrase, replacement in _PHRASES.items():
                text = text.replace(phrase, replacement)
            (written / f"{module}.py").write_text(_OWN_NAME.sub("", text))
        rule = unasync.Rule("/written/", "/generated/", additional_replacements=_NAMES)
        unasync.unasync_files([str(path) for path in written.iterdir()], [rule])
        for module in MODULES:
            text = _formatted((generated / f"{module}.py").read_text())
            (folder / f"{module}.py").write_text(_HEADER.format(source=f"async_{module}.py") + text)


def _formatted(text: str) -> str:
    """Return a module as ruff writes it: imports sorted, `yield from` where nothing is awaited, short lines joined."""
    ruff = Path(sys.executable).with_name("ruff")
    for command in (["check", "--select", "I,UP028", "--fix", "--unsafe-fixes", "--quiet"], ["format", "--quiet"]):
        line = [*command, "--config", str(_CONFIGURATION), "--stdin-filename", str(CLIENT / "module.py"), "-"]
        text = subprocess.run([ruff, *line], input=text, capture_output=True, text=True, check=True).stdout
    return text


if __name__ == "__main__":
    generate(Path(sys.argv[1]) if len(sys.argv) > 1 else CLIENT)

"""Pin the newest version of every dependency, with hashes, into requirements.lock: `make lock`.

The lock has parts (`PARTS`), each with what the parts before it lack.
Without addresses, it holds for any index of packages.
"""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Sequence

from tools.first_start import PYTHONS, ROOT

LOCK = ROOT / "requirements.lock"
PARTS = {
    "what runs": ("server", "plot", "proofs", "guide"),
    "what tests need": ("test",),
    "what style and pages need": ("dev",),
    "what benchmarks need": ("dev", "bench"),
}
"""From the heading of a part to the extras that are installed with it and the parts before it."""
# What builds the package, which `pip install` without isolation needs.
BUILDS = "hatchling"
_COMPILE = ("--quiet", "--universal", "--generate-hashes", "--no-header", "--no-annotate")


def compiled(extras: Sequence[str], *options: str) -> list[str]:
    """Return the pinned requirements of some extras, each with the lines of its hashes."""
    chosen = [word for extra in extras for word in ("--extra", extra)]
    command = [".venv/bin/uv", "pip", "compile", *_COMPILE, "--python-version", PYTHONS[0]]
    command += ["--no-emit-index-url", *options, *chosen]
    done = subprocess.run(
        [*command, "pyproject.toml", "-"], cwd=ROOT, input=BUILDS, capture_output=True, text=True, check=True
    )
    return requirements(done.stdout)


def requirements(text: str) -> list[str]:
    """Return the requirements of a lock, each with the lines of its hashes."""
    entries: list[str] = []
    for line in text.splitlines(keepends=True):
        if line.startswith(" "):
            entries[-1] += line
        elif line.strip() and not line.startswith("#"):
            entries.append(line)
    return entries


def main() -> None:
    """Write the lock."""
    everything = compiled(PARTS["what benchmarks need"], "--upgrade")
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as pins:
        pins.write("".join(everything))
        pins.flush()
        lines: list[str] = []
        for heading, extras in PARTS.items():
            part = compiled(extras, "--constraint", pins.name)
            lines += [f"# {heading}\n", *(pinned for pinned in part if pinned not in lines)]
    LOCK.write_text("".join(lines))


if __name__ == "__main__":
    main()

"""The unit tests on every further Python on the PATH, each in an environment of its own: part of `make ci`.

`python -m tools.other_pythons` runs the tests of UNIT, which need no kernels, with the versions of the lock. It exits
with 1 where one fails, and says which Pythons there are not.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from tools.first_start import PYTHONS, ROOT
from tools.lock import LOCK, PARTS

UNIT = ("tests/unit/contract", "tests/unit/sdk")
FOLDER = ROOT / ".cache" / "pythons"
_PIP = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check")


def installed(version: str) -> Path | None:
    """Return the Python of an environment in which the tests can run; None where this version is not on the PATH."""
    python = shutil.which(f"python{version}")
    # a shim of pyenv may stand for a version that is not chosen
    if python is None or subprocess.run([python, "-c", "import ensurepip, venv"], capture_output=True).returncode:
        return None
    environment = FOLDER / version
    own, complete = environment / "bin" / "python", environment / "complete"
    if not complete.exists() or complete.read_text() != LOCK.read_text():
        shutil.rmtree(environment, ignore_errors=True)
        subprocess.run([python, "-m", "venv", environment], check=True)
        pins = LOCK.read_text().partition(f"# {list(PARTS)[-1]}\n")[0]
        subprocess.run([own, *_PIP, "--require-hashes", "-r", "/dev/stdin"], input=pins, text=True, check=True)
        subprocess.run([own, *_PIP, "--no-deps", "--no-build-isolation", "-e", ROOT], check=True)
        complete.write_text(LOCK.read_text())
    return own


def main() -> int:
    """Run the tests; return 1 where some fail."""
    failed = False
    for version in PYTHONS:
        if version == f"{sys.version_info.major}.{sys.version_info.minor}":
            continue
        python = installed(version)
        print(f"Python {version}: {'the unit tests' if python else 'not here'}", flush=True)
        if python is not None:
            done = subprocess.run([python, "-m", "pytest", "-q", *UNIT], cwd=ROOT, check=False)
            failed = failed or done.returncode != 0
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())

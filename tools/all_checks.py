"""Every long check, one after another, with a record of the outcomes.

`python -m tools.all_checks` (`make all-checks`) runs the targets below with `make`, goes on after a failure, and writes
docs/checks.md after each of them. It exits with 1 when one has failed. `--age` prints how old the record is.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "checks.md"
TARGETS = (
    "lint",
    "types",
    "test",
    "test-newest",
    "browser",
    "hardware",
    "verify",
    "borders",
    "reproduce",
    "bench-quick",
)
_HEAD = """# Checks

The record of the last `make all-checks`, which runs every long check and writes this page; do not edit it.

| target | outcome | minutes | commit | finished, UTC |
| --- | --- | --- | --- | --- |
"""
_ROW = re.compile(r"^\| [\w-]+ \| \w+ \| [\d.]+ \| ([0-9a-f]+)[^|]*\| (\S+) ", re.MULTILINE)


class Outcome(NamedTuple):
    """How a target ended."""

    target: str
    passed: bool
    minutes: float
    commit: str
    finished: datetime


def run(targets: Sequence[str], page: Path = PAGE, make: Sequence[str] = ("make", "--no-print-directory")) -> bool:
    """Run the targets, write the page after each, and return whether all have passed."""
    commit = _commit()
    outcomes: list[Outcome] = []
    for target in targets:
        began = time.monotonic()
        done = subprocess.run([*make, target], cwd=ROOT, check=False)
        minutes = (time.monotonic() - began) / 60.0
        outcomes.append(Outcome(target, done.returncode == 0, minutes, commit, datetime.now(UTC)))
        page.write_text(written(outcomes), "utf-8")
    for outcome in outcomes:
        print(f"{outcome.target}: {'passed' if outcome.passed else 'failed'}")
    return all(outcome.passed for outcome in outcomes)


def written(outcomes: Sequence[Outcome]) -> str:
    """Return the page of the outcomes."""
    return _HEAD + "".join(
        f"| {target} | {'passed' if passed else 'failed'} | {minutes:.1f} | {commit} | {finished:%Y-%m-%d %H:%M} |\n"
        for target, passed, minutes, commit, finished in outcomes
    )


def age(page: Path = PAGE, now: datetime | None = None) -> str:
    """Return a line that says how many commits and days old the record is, and what has failed."""
    rows = _ROW.findall(page.read_text("utf-8")) if page.exists() else []
    if not rows:
        return "make all-checks has no record in docs/checks.md"
    commit, finished = rows[0]
    days = ((now or datetime.now(UTC)).date() - datetime.fromisoformat(finished).date()).days
    distance = _git("rev-list", "--count", f"{commit}..HEAD")
    commits = f"{distance} commits" if distance else "an unknown number of commits"
    failed = page.read_text("utf-8").count("| failed |")
    return f"the last make all-checks is {commits} and {days} days old; {len(rows)} targets, {failed} failed"


def _commit() -> str:
    """Return the commit that is checked out, and whether files differ from it."""
    head = _git("rev-parse", "--short=12", "HEAD") or "unknown"
    return f"{head} with changes" if _git("status", "--porcelain", "--untracked-files=no") else head


def _git(*arguments: str) -> str:
    """Return what git answers, or nothing where it cannot."""
    try:
        return subprocess.run(
            ["git", *arguments], cwd=ROOT, check=True, capture_output=True, text=True, timeout=60
        ).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""


def main() -> int:
    """Run every target, or those named; or print the age of the record."""
    parser = argparse.ArgumentParser(prog="python -m tools.all_checks", description="Every long check.")
    parser.add_argument("targets", nargs="*", default=TARGETS, help="targets of the Makefile; by default the long ones")
    parser.add_argument("--age", action="store_true", help="run nothing; print how old the record is")
    given = parser.parse_args()
    if given.age:
        print(age())
        return 0
    return 0 if run(given.targets) else 1


if __name__ == "__main__":
    sys.exit(main())

"""Every long check, one after another, with a record of the outcomes.

`python -m tools.all_checks` (`make all-checks`) runs the targets below with `make`, continues after a failure, and
writes tests/slow/checks.md after each of them. It exits with 1 when one has failed. With targets as arguments it runs
these, and keeps the rows of the others. `--age` prints how old the record is.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import time
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "tests" / "slow" / "checks.md"
TARGETS = (
    "lint",
    "types",
    "lint-page",
    "test",
    "test-native",
    "test-portable",
    "test-newest",
    "first-start",
    "latency",
    "browser",
    "pictures",
    "check-pages",
    "thorough",
    "general",
    "hardware",
    "digests-all",
    "verify",
    "resonance",
    "beside-borders",
    "chaotic-transients",
    "long-transients",
    "one-period",
    "two-motions",
    "tolerance-sizes",
    "resolve",
    "memory",
    "small-machine",
    "schemathesis",
    "slips",
    "storage",
    "chaos",
    "executors",
    "fairness",
    "unfair",
    "load",
    "small-questions",
    "cold-start",
    "first-window",
    "estimates",
    "planes",
    "large-models",
    "proofs",
    "mutants",
    "borders",
    "reproduce",
    "published",
    "bench-quick",
)
_HEAD = """# Checks

The record of the last `make all-checks`, which runs every long check and writes this page; do not edit it.

| target | outcome | minutes | commit | finished, UTC |
| --- | --- | --- | --- | --- |
"""
_ROW = re.compile(r"^\| ([\w-]+) \| (passed|failed) \| ([\d.]+) \| (\w[^|]*) \| (\S+ \S+) \|$", re.MULTILINE)


class Outcome(NamedTuple):
    """How a target ended."""

    target: str
    passed: bool
    minutes: float
    commit: str
    finished: datetime


def run(targets: Sequence[str], page: Path = PAGE, make: Sequence[str] = ("make", "--no-print-directory")) -> bool:
    """Run the targets, write the page after each, and return whether all of them have passed.

    Rows that another run has written meanwhile stay.
    """
    commit, outcomes = _commit(), {}
    for target in targets:
        began = time.monotonic()
        done = subprocess.run([*make, target], cwd=ROOT, check=False)
        minutes = (time.monotonic() - began) / 60.0
        outcomes[target] = Outcome(target, done.returncode == 0, minutes, commit, datetime.now(UTC))
        rows = {outcome.target: outcome for outcome in recorded(page)} | {target: outcomes[target]}
        page.write_text(written(rows.values()), "utf-8")
    for target in targets:
        print(f"{target}: {'passed' if outcomes[target].passed else 'failed'}")
    return all(outcomes[target].passed for target in targets)


def recorded(page: Path) -> list[Outcome]:
    """Return the outcomes on the page, none if there is no page."""
    rows = _ROW.findall(page.read_text("utf-8")) if page.exists() else []
    return [
        Outcome(target, outcome == "passed", float(minutes), commit, datetime.fromisoformat(f"{finished}+00:00"))
        for target, outcome, minutes, commit, finished in rows
    ]


def written(outcomes: Iterable[Outcome]) -> str:
    """Return the page of the outcomes."""
    return _HEAD + "".join(
        f"| {target} | {'passed' if passed else 'failed'} | {minutes:.1f} | {commit} | {finished:%Y-%m-%d %H:%M} |\n"
        for target, passed, minutes, commit, finished in outcomes
    )


def age(page: Path = PAGE, now: datetime | None = None) -> str:
    """Return a line with the age of the oldest outcome, in commits and days, and the number of failures."""
    outcomes = recorded(page)
    if not outcomes:
        return "make all-checks has no record in tests/slow/checks.md"
    oldest = min(outcomes, key=lambda outcome: outcome.finished)
    days = ((now or datetime.now(UTC)).date() - oldest.finished.date()).days
    distance = _git("rev-list", "--count", f"{oldest.commit.split()[0]}..HEAD")
    commits = f"{distance} commits" if distance else "an unknown number of commits"
    failed = sum(not outcome.passed for outcome in outcomes)
    return f"the last make all-checks is {commits} and {days} days old; {len(outcomes)} targets, {failed} failed"


def _commit() -> str:
    """Return the commit that is checked out, and whether files other than the page differ from it."""
    head = _git("rev-parse", "--short=12", "HEAD") or "unknown"
    changes = _git("status", "--porcelain", "--untracked-files=no", "--", ".", f":!{PAGE.relative_to(ROOT)}")
    return f"{head} with changes" if changes else head


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
    arguments = parser.parse_args()
    if arguments.age:
        print(age())
        return 0
    return 0 if run(arguments.targets) else 1


if __name__ == "__main__":
    sys.exit(main())

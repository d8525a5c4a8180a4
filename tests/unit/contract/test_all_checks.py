"""`make all-checks` continues after a failure and records every outcome; its record gives its age."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path

from tools import all_checks

# stands in for make: the target "false" fails, "true" does not
MAKE = ("/usr/bin/env",)


def test_a_failure_is_recorded_and_the_next_target_is_run(tmp_path: Path) -> None:
    page = tmp_path / "checks.md"
    assert not all_checks.run(["false", "true"], page, MAKE)
    text = page.read_text()
    assert "| false | failed |" in text
    assert "| true | passed |" in text


def test_named_targets_replace_their_own_rows(tmp_path: Path) -> None:
    page = tmp_path / "checks.md"
    before = datetime(2026, 3, 1, 23, 5, tzinfo=UTC)
    rows = [all_checks.Outcome(name, False, 0.5, "0123456789ab with changes", before) for name in ("false", "true")]
    page.write_text(all_checks.written(rows))
    assert all_checks.recorded(page) == rows
    assert all_checks.run(["true"], page, MAKE)
    kept, replaced = all_checks.recorded(page)
    assert kept == rows[0]
    assert (replaced.target, replaced.passed) == ("true", True)


def test_rows_of_another_run_at_the_same_time_are_kept(tmp_path: Path) -> None:
    page = tmp_path / "checks.md"
    other = all_checks.Outcome("other", True, 1.5, "0123456789ab", datetime(2026, 3, 1, tzinfo=UTC))
    writes = f"from pathlib import Path; Path({str(page)!r}).write_text({all_checks.written([other])!r})"
    assert all_checks.run(["true"], page, (sys.executable, "-c", writes))
    assert [row.target for row in all_checks.recorded(page)] == ["other", "true"]


def test_the_age_counts_commits_and_days(tmp_path: Path) -> None:
    page = tmp_path / "checks.md"
    assert "no record" in all_checks.age(page)
    commit = all_checks._git("rev-parse", "HEAD~2") or "0000000"
    outcome = all_checks.Outcome("lint", False, 0.5, commit, datetime(2026, 3, 1, 23, tzinfo=UTC))
    page.write_text(all_checks.written([outcome]))
    age = all_checks.age(page, datetime(2026, 3, 4, 1, tzinfo=UTC))
    assert "3 days old; 1 targets, 1 failed" in age
    distance = all_checks._git("rev-list", "--count", f"{commit}..HEAD")
    assert (f"{distance} commits" if distance else "an unknown number") in age


def test_every_target_is_in_the_makefile() -> None:
    makefile = (Path(__file__).parents[3] / "Makefile").read_text()
    assert [name for name in all_checks.TARGETS if f"\n{name}:" not in makefile] == []

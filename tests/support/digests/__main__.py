"""`make digests`: say which results changed against the record, and by how much, and record them.

It refuses to change what is recorded for a version that has a section in CHANGELOG.md: who changes the bytes of a
result changes the version in pyproject.toml first. With `--check` (`make digests-all`) it records nothing, computes
all results with the instructions of this processor too, and fails where bytes changed, or labels and flags differ.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

from tests.support.digests import record
from tests.support.digests.documents import Results, at_the_level, here
from tests.support.digests.requests import TIERS


def main(check: bool) -> int:
    """Compute all results; compare them with the record, or record them. Return the exit status."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        results = at_the_level(Path(folder), "--tiers", *TIERS)
    count = sum(map(len, results.values()))
    print(f"{count} results of {len(results)} processes with the instructions of x86-64-v3: {_since(began)}")
    known = record.read() if record.DIGESTS.exists() else record.Record("", {}, {}, {})
    changes = list(record.changes(known, results))
    for change in changes:
        print(change)
    print(f"{len(changes)} fields are not as recorded for {known.version or 'any version'}")
    if check:
        return int(_disagree(results) or bool(changes) or known.version != record.core_version())
    if changes and known.version == record.core_version() and not record.is_unreleased():
        sys.stderr.write(f"version {known.version} is released: change the version in pyproject.toml\n")
        return 1
    record.write(results)
    print(f"recorded for {record.core_version()}")
    return 0


def _disagree(results: Results) -> bool:
    """Compare results with those of this processor's own instructions; return whether labels or flags differ."""
    began = time.monotonic()
    labels, numbers = record.disagreements(results, here(*TIERS))
    print(f"the same with the instructions of this processor: {_since(began)}")
    for change in labels:
        print(change)
    print(f"{len(labels)} labels and flags differ, and {len(numbers)} fields of numbers; the largest differences:")
    for _, change in numbers[:10]:
        print(f"  {change}")
    return bool(labels)


def _since(began: float) -> str:
    return f"{time.monotonic() - began:.0f} s"


if __name__ == "__main__":
    sys.exit(main("--check" in sys.argv[1:]))

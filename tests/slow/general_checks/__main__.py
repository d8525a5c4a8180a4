"""Run the checks that are named, or all of them, and print a table of what they found."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable

from . import borders, branches, events, families, images, labels, near_grazing, resonances, transients
from .table import Row, written

# a check of balances of momentum and energy, over orbits and over motions with rests, belongs here too
CHECKS: dict[str, Callable[[float, int], list[Row]]] = {
    "events": events.check,
    "near-grazing": near_grazing.check,
    "labels": labels.check,
    "borders": borders.check,
    "transients": transients.check,
    "resonances": resonances.check,
    "families": families.check,
    "images": images.check,
    "branches": branches.check,
}


def main() -> int:
    """Run the checks; return 1 if anything is wrong."""
    parser = argparse.ArgumentParser(prog="python -m general_checks", description="Long checks of general systems.")
    parser.add_argument("names", nargs="*", choices=[[], *CHECKS], help="checks; by default all of them")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    share, rows = float(os.environ.get("SHARE") or 1.0), []
    for name in arguments.names or CHECKS:
        began = time.monotonic()
        print(f"{name}:", flush=True)
        rows += CHECKS[name](share, arguments.processes)
        print(f"{name} took {time.monotonic() - began:.0f} s", flush=True)
    print(written(rows))
    return int(any(row.wrong for row in rows))


if __name__ == "__main__":
    sys.exit(main())

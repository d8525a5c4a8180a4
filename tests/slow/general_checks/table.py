"""The table at the end."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple


class Row(NamedTuple):
    """What was compared, how many cases, how many of them are wrong, and a figure in words."""

    compared: str
    cases: int
    wrong: int
    figure: str = ""


def part(cases: int, share: float) -> int:
    """Return how many of so many cases are computed, at least one."""
    return max(1, round(cases * share))


def written(rows: Iterable[Row]) -> str:
    """Return the table as text."""
    lines = [f"{'compared':66s} {'cases':>7s} {'wrong':>6s}  figure"]
    return "\n".join([*lines, *(f"{row.compared:66s} {row.cases:7d} {row.wrong:6d}  {row.figure}" for row in rows)])

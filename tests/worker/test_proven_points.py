"""Codimension-two points are proven with the numbers of their records, whatever the period of the forces."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.proven_points import proofs_of


@pytest.mark.parametrize("seed", [1, 2])
def test_points_are_proven_from_their_records(seed: int) -> None:
    divisor, verdicts = proofs_of(seed)
    counts = Counter(verdict for verdict, _ in verdicts)
    assert divisor == 1 + seed
    assert counts["disproven"] == 0
    assert counts["proven"] >= 0.9 * len(verdicts) > 0, verdicts

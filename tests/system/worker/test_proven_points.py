"""Codimension-two points are proven with the numbers of their records, whatever the period of the forces."""

from __future__ import annotations

from collections import Counter

import pytest

from tests.slow.proven_points import proofs_of


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_points_are_proven_from_their_records(seed: int) -> None:
    divisor, proofs = proofs_of(seed)
    counts = Counter(proof["verdict"] for proof in proofs)
    assert divisor == 1 + seed
    assert counts["disproven"] == 0
    assert counts["proven"] >= 0.9 * len(proofs) > 0, [proof["reason"] for proof in proofs]

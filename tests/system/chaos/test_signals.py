"""A few of the signals that `make chaos` sends; `make test` kills and stops each process once (test_stack.py)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.slow import signals_at_random
from tests.slow.signals_at_random import disturbed, undisturbed


@pytest.mark.thorough
def test_signals_at_random_do_not_change_a_byte(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(signals_at_random, "ROWS", 8)
    monkeypatch.setattr(signals_at_random, "MOST_MAPS", 3)
    maps, _ = disturbed(1, 3, tmp_path / "disturbed")
    assert maps == undisturbed(len(maps), tmp_path / "undisturbed", [])

"""`make first-start` measures the silence of a start, and notices one that does not answer."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from tools import first_start

WORDS = (
    "import signal, sys, time; signal.signal(signal.SIGINT, lambda *_: sys.exit(0)); print('starting', flush=True);"
    "time.sleep(0.6); print('explorer  http://127.0.0.1:9/', flush=True);"
    # a signal just before one long sleep would be handled after it
    "[time.sleep(0.1) for _ in range(600)]"
)


def test_the_longest_time_without_a_line_is_measured(tmp_path: Path) -> None:
    with first_start.started([sys.executable, "-c", WORDS], os.environ, tmp_path) as start:
        assert start.url == "http://127.0.0.1:9"
    assert len(start.seconds) == 2
    assert 0.5 <= start.silence < start.seconds[-1]  # the first line may be read a little late


def test_a_start_that_does_not_answer_is_an_error_with_its_words(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "print('no Redis'); raise SystemExit(1)"]
    with pytest.raises(RuntimeError, match="no Redis"), first_start.started(command, os.environ, tmp_path):
        pass


def test_a_python_that_is_not_on_this_machine_is_not_found() -> None:
    assert first_start.interpreter("2.0") is None
    running = first_start.interpreter(f"{sys.version_info.major}.{sys.version_info.minor}")
    assert running is not None

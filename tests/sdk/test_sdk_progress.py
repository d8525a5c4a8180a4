"""The progress display: moves, never goes back, can be switched off, works without tqdm."""

import io
import sys

import pytest

from grazemap.client.events import Event
from grazemap.client.progress import Listener, PlainLine


def progress(done: int, total: int = 4, eta: float | None = None) -> Event:
    return Event("", "progress", {"done": done, "total": total, "unit": "tiles", "eta_seconds": eta})


@pytest.fixture(params=["tqdm", "plain"])
def display(request, monkeypatch):
    if request.param == "plain":
        monkeypatch.setitem(sys.modules, "tqdm", None)
    return request.param


def test_the_bar_shows_title_count_and_end(display, capsys):
    with Listener("unfolding-maps") as listener:
        for event in (progress(1, eta=9.0), Event("", "tile", {"index": 0}), progress(4), Event("", "done", {})):
            listener(event)
    written = capsys.readouterr().err
    assert "unfolding-maps" in written
    assert "4/4" in written
    assert "100%" in written
    assert "about 9 s left" in written
    assert written.endswith("\n")


def test_it_knows_the_total_from_its_first_line_on(display, capsys):
    with Listener("x") as listener:
        listener(progress(0))
    written = capsys.readouterr().err
    assert "0/4" in written
    assert "?" not in written


def test_a_repeated_event_does_not_move_it_back(display, capsys):
    with Listener("x") as listener:
        for done in (3, 1, 2):
            listener(progress(done))
    assert "3/4" in capsys.readouterr().err.splitlines()[-1]


def test_switched_off_it_writes_nothing(display, capsys):
    with Listener("x", shown=False) as listener:
        listener(progress(2))
    captured = capsys.readouterr()
    assert captured.err == captured.out == ""


def test_a_terminal_gets_one_line_and_a_log_one_line_a_tenth():
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for stream, lines in ((Terminal(), 1), (io.StringIO(), 11)):
        line = PlainLine("map", stream)
        for done in range(101):
            line.show(done, 100, "tiles", None)
        line.close()
        assert stream.getvalue().count("\n") == lines

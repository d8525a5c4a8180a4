"""The progress display: never back, no leaps, only long waits in a log, can be switched off."""

import io
import sys
import time
from types import SimpleNamespace

import pytest

from grazemap.client import progress as module
from grazemap.client.events import Event
from grazemap.client.progress import Listener, NotebookBar


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def progress(done: int, total: int = 4, eta: float | None = None) -> Event:
    return Event("", "progress", {"done": done, "total": total, "unit": "tiles", "eta_seconds": eta})


@pytest.fixture(params=["tqdm", "plain"])
def terminal(request, monkeypatch):
    if request.param == "plain":
        monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setattr(module, "QUIET_SECONDS", 0.0)
    stream = Terminal()
    # not sys.stderr itself, which pytest replaces between the phases of a test
    monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream, modules=sys.modules))
    return stream


@pytest.fixture
def listener(terminal):
    with Listener("unfolding-maps") as listener:
        while listener._display is None:  # the timer opens it
            time.sleep(0.001)
        yield listener


def test_the_bar_shows_title_share_and_end(listener, terminal):
    for event in (progress(1, eta=9.0), Event("", "tile", {"index": 0}), progress(4), Event("", "done", {})):
        listener(event)
    listener.__exit__()
    written = terminal.getvalue()
    assert written.startswith("\runfolding-maps:")
    assert "25%" in written
    assert "100%" in written
    assert "about 9 s left" in written
    assert written.endswith("\n")


def test_a_repeated_event_does_not_move_it_back(listener, terminal):
    for done in (3, 1, 2):
        listener(progress(done))
    assert "75%" in terminal.getvalue().split("\r")[-1]


def test_another_unit_does_not_move_it_back(listener, terminal):
    listener(progress(3))
    listener(Event("", "progress", {"done": 1, "total": 100, "unit": "steps", "eta_seconds": None}))
    assert "75%" in terminal.getvalue().split("\r")[-1]


def test_the_time_left_does_not_leap(listener, terminal):
    listener(progress(1, eta=10.0))
    listener(progress(2, eta=110.0))
    assert "about 40 s left" in terminal.getvalue().split("\r")[-1]


def test_it_shows_what_the_job_waits_for_instead_of_the_time_left(listener, terminal):
    listener(progress(1, eta=9.0))
    listener(Event("", "waiting", {"waiting_for": "a worker"}))
    assert "25%" in terminal.getvalue().split("\r")[-1]
    assert "waiting for a worker" in terminal.getvalue().split("\r")[-1]
    assert "left" not in terminal.getvalue().split("\r")[-1]
    listener(Event("", "waiting", {"waiting_for": None}))
    assert "waiting" not in terminal.getvalue().split("\r")[-1]
    assert "about 9 s left" in terminal.getvalue().split("\r")[-1]


def test_it_speaks_before_the_first_event(terminal):
    with Listener("x"):
        time.sleep(0.2)
    assert "0%" in terminal.getvalue()


@pytest.mark.parametrize("quick", [True, False])
def test_quick_work_and_a_log_get_nothing(terminal, monkeypatch, quick):
    if quick:
        monkeypatch.setattr(module, "QUIET_SECONDS", 10.0)
    else:
        monkeypatch.setattr(terminal, "isatty", lambda: False)
    with Listener("x") as listener:
        time.sleep(0.05)
        listener(progress(2))
    assert terminal.getvalue() == ""


def waiting(text: str | None) -> Event:
    return Event("", "waiting", {"waiting_for": text})


@pytest.fixture
def log(terminal, monkeypatch):
    monkeypatch.setattr(terminal, "isatty", lambda: False)
    monkeypatch.setattr(module, "TICK_SECONDS", 0.01)
    monkeypatch.setattr(module, "LOG_SECONDS", 0.1)
    return terminal


def test_a_log_gets_one_line_for_each_reason_to_wait(log):
    with Listener("x") as listener:
        listener(waiting("kernels, compiling for 4 s"))
        time.sleep(0.05)
        listener(waiting("kernels, compiling for 5 s"))
        time.sleep(0.2)
        for text in ("a worker", None, "kernels, compiling for 9 s"):
            listener(waiting(text))
            time.sleep(0.2)
    assert log.getvalue() == (
        "grazemap: x: waiting for kernels, compiling for 5 s\ngrazemap: x: waiting for a worker\n"
    )


@pytest.mark.parametrize("shown", [True, False])
def test_a_log_gets_nothing_of_a_short_wait_or_switched_off(log, monkeypatch, shown):
    if shown:
        monkeypatch.setattr(module, "LOG_SECONDS", 10.0)
    with Listener("x", shown=shown) as listener:
        listener(waiting("kernels, compiling for 4 s"))
        time.sleep(0.2)
    assert log.getvalue() == ""


def test_a_notebook_has_no_lines_on_standard_error(log, monkeypatch):
    shown = []
    monkeypatch.setattr(module, "in_notebook", lambda: True)
    monkeypatch.setattr(
        module,
        "NotebookBar",
        lambda _title: SimpleNamespace(show=lambda *state: shown.append(state), close=lambda: None),
    )
    with Listener("x") as listener:
        listener(waiting("a worker"))
        time.sleep(0.2)
    assert log.getvalue() == ""
    assert (0.0, "a worker", "") in shown


def test_its_clock_runs_while_no_event_arrives(terminal, monkeypatch):
    monkeypatch.setattr(module, "TICK_SECONDS", 0.01)
    with Listener("x") as listener:
        listener(progress(1, eta=9.4))
        time.sleep(0.1)
        before = len(terminal.getvalue())
        time.sleep(1.0)
        written = terminal.getvalue()[before:]
    assert written.count("25%") > 5
    assert "about 8 s left" in written


def test_switched_off_it_writes_nothing(terminal):
    with Listener("x", shown=False) as listener:
        time.sleep(0.05)
        listener(progress(2))
    assert terminal.getvalue() == ""


def test_a_notebook_has_nothing_of_it_at_the_end(monkeypatch):
    shown = []

    class Handle:
        def update(self, data, raw):
            assert raw
            shown.append(data)

    def display(data, raw, display_id):
        shown.append(data)
        return Handle()

    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=display))
    bar = NotebookBar("<map>")
    bar.show(0.5, "", "a < b")
    bar.close()
    assert shown[1]["text/html"].startswith("&lt;map&gt; <progress value='0.500' max='1'>")
    assert shown[1]["text/html"].endswith("a &lt; b")
    assert shown[0] == shown[2] == {"text/html": ""}

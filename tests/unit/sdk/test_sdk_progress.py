"""The progress display: never back, no leaps, only long waits in a log, can be switched off."""

import contextlib
import io
import sys
from collections.abc import Iterator
from types import SimpleNamespace

import pytest

from grazemap.client import progress as module
from grazemap.client.events import Event
from grazemap.client.progress import NotebookBar, ProgressListener
from tests.support.watching import until


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def progress(done: int, total: int = 4, eta: float | None = None, unit: str = "tiles") -> Event:
    return Event("", "progress", {"done": done, "total": total, "unit": unit, "eta_seconds": eta})


def waiting(text: str | None) -> Event:
    return Event("", "waiting", {"waiting_for": text})


@pytest.fixture
def clock(monkeypatch):
    """Gives a clock that stands until its `now` is changed."""
    played = SimpleNamespace(now=1000.0)
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: played.now))
    return played


@pytest.fixture
def stderr(monkeypatch, clock):
    """Gives `stderr(stream)`: where progress is written, at once and refreshed often."""
    monkeypatch.setattr(module, "QUIET_SECONDS", 0.0)
    monkeypatch.setattr(module, "TICK_SECONDS", 0.01)

    def replaced(stream):
        # not sys.stderr itself, which pytest replaces between the phases of a test
        monkeypatch.setattr(module, "sys", SimpleNamespace(stderr=stream, modules=sys.modules))
        return stream

    return replaced


@pytest.fixture(params=["tqdm", "plain"])
def terminal(request, monkeypatch, stderr):
    if request.param == "plain":
        monkeypatch.setitem(sys.modules, "tqdm", None)
    return stderr(Terminal())


@contextlib.contextmanager
def opened() -> Iterator[ProgressListener]:
    """A listener whose display is open, which its thread does."""
    with ProgressListener("unfolding-maps") as listener:
        until(lambda: listener._display is not None, 20)
        yield listener


@pytest.fixture
def listener(terminal):
    with opened() as listener:
        yield listener


def shown(terminal) -> str:
    return terminal.getvalue().split("\r")[-1]


def test_the_bar_shows_title_share_and_end(listener, terminal):
    assert "0%" in terminal.getvalue()  # before the first event
    for event in (progress(1, eta=9.0), Event("", "tile", {"index": 0}), progress(4), Event("", "done", {})):
        listener(event)
    listener.__exit__()
    written = terminal.getvalue()
    assert written.startswith("\runfolding-maps:")
    assert "25%" in written
    assert "100%" in written
    assert "about 9 s left" in written
    assert written.endswith("\n")


def test_a_repeated_event_or_another_unit_does_not_move_it_back(listener, terminal):
    for event in (progress(3), progress(1), progress(2), progress(1, 100, unit="steps")):
        listener(event)
        assert "75%" in shown(terminal)


def test_the_time_left_does_not_leap(listener, terminal):
    listener(progress(1, eta=10.0))
    listener(progress(2, eta=110.0))
    assert "about 40 s left" in shown(terminal)


def test_it_shows_what_the_job_waits_for_instead_of_the_time_left(listener, terminal):
    listener(progress(1, eta=9.0))
    listener(waiting("a worker"))
    assert "25%" in shown(terminal)
    assert "waiting for a worker" in shown(terminal)
    assert "left" not in shown(terminal)
    listener(waiting(None))
    assert "waiting" not in shown(terminal)
    assert "about 9 s left" in shown(terminal)


def test_its_clock_runs_while_no_event_arrives(listener, terminal, clock):
    listener(progress(1, eta=9.4))
    before = len(terminal.getvalue())
    clock.now += 1.0
    until(lambda: terminal.getvalue()[before:].count("about 8 s left") > 3, 20)
    assert "25%" in shown(terminal)


@pytest.mark.parametrize("why", ["quick", "switched off"])
def test_quick_work_and_a_display_that_is_switched_off_write_nothing(terminal, monkeypatch, why):
    monkeypatch.setattr(module, "QUIET_SECONDS", 10.0 if why == "quick" else 0.0)
    with ProgressListener("x", shown=why == "quick") as listener:
        listener(progress(2))
    assert terminal.getvalue() == ""


def test_a_log_gets_one_line_for_each_reason_to_wait_for_long_and_no_progress(stderr, clock):
    log = stderr(io.StringIO())
    with opened() as listener:
        listener(progress(2))
        for text in ("a node", "kernels, compiling for 4 s", "kernels, compiling for 5 s"):
            listener(waiting(text))
            clock.now += module.LOG_SECONDS - 1.0
        for text in ("kernels, compiling for 9 s", "a worker", None, "kernels, compiling for 2 s"):
            listener(waiting(text))
            clock.now += module.LOG_SECONDS
            listener(waiting(text))
    lines = ("waiting for kernels, compiling for 9 s", "waiting for a worker")
    assert log.getvalue() == "".join(f"grazemap: unfolding-maps: {line}\n" for line in lines)


def test_a_display_that_nobody_reads_any_more_ends_no_work(terminal, monkeypatch):
    def broken(_: str) -> None:
        raise BrokenPipeError

    with opened() as listener:
        monkeypatch.setattr(terminal, "write", broken)
        listener(progress(1))
        listener(progress(4))


def test_a_notebook_has_no_lines_on_standard_error(stderr, clock, monkeypatch):
    log, shown = stderr(io.StringIO()), []
    bar = SimpleNamespace(show=lambda *state: shown.append(state), close=lambda: None)
    monkeypatch.setattr(module, "runs_in_notebook", lambda: True)
    monkeypatch.setattr(module, "NotebookBar", lambda _title: bar)
    with opened() as listener:
        listener(waiting("a worker"))
        clock.now += module.LOG_SECONDS
        listener(waiting("a worker"))
    assert log.getvalue() == ""
    assert (0.0, "a worker", "") in shown


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

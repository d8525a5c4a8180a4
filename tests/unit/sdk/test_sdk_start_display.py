"""What those see who wait for a stack: one line that changes, nothing where nobody looks."""

import io
import sys
from types import SimpleNamespace

import pytest

from grazemap import start_display as module
from grazemap.start_display import StartLine, StartLog, ready_line, start_display

LINES = b'{"starting": "a"}\n{"starting": "b"}\n{"url": "http://x:1", "pid": 1}\n'


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_line_with_the_address_ends_the_start():
    stream = Terminal()
    shown = StartLine(stream)
    assert ready_line(io.BytesIO(LINES), shown) == b'{"url": "http://x:1", "pid": 1}\n'
    shown.close(ready=True)
    parts = [part.strip() for part in stream.getvalue().split("\r")]
    assert parts == ["", "grazemap: a", "grazemap: b", "", ""]


def test_a_long_text_stays_on_its_line():
    stream = Terminal()
    StartLine(stream).show(70 * "a")
    assert stream.getvalue() == "\rgrazemap: " + 69 * "a"


def test_a_stack_that_ends_has_no_line():
    assert ready_line(io.BytesIO(b'{"starting": "a"}\n')) == b""
    # it says why on standard error; this line is refused by those who read the address
    assert ready_line(io.BytesIO(b"Traceback\n")) == b"Traceback\n"


def test_a_command_that_runs_a_stack_has_a_line_for_each_step_in_a_log():
    stream = io.StringIO()
    shown = StartLine(stream)
    for text in ("a", "a", "b, about 9 s", "a", "b, about 8 s"):
        shown.show(text)
    shown.close(ready=True)
    assert stream.getvalue() == "grazemap: a\ngrazemap: b, about 9 s\n"


SAID = [
    (0.0, "starting the service"),
    (2.5, "loading the kernels, about 1 s"),
    (3.5, "starting the service"),
    (4.0, "compiling kernels, step 1 of 4, about 36 s"),
    (5.0, "compiling kernels, step 1 of 4, about 35 s"),
    (30.0, "compiling kernels, step 4 of 4, about 8 s"),
]


@pytest.mark.parametrize(
    ("messages", "quiet", "ready", "lines"),
    [
        (SAID, False, True, ["compiling kernels, step 1 of 4, about 36 s", "ready after 38 s"]),
        (SAID, False, False, ["compiling kernels, step 1 of 4, about 36 s"]),
        (SAID[:2], False, True, []),
        (SAID, True, True, []),
    ],
)
def test_a_log_has_the_step_that_takes_long_and_the_end_unless_the_start_is_quick(
    monkeypatch, messages, quiet, ready, lines
):
    now = [100.0]
    monkeypatch.setattr(module.time, "monotonic", lambda: now[0])
    stream = io.StringIO()
    shown = StartLog(stream, quiet)
    for seconds, text in messages:
        now[0] = 100.0 + seconds
        shown.show(text)
    now[0] = 138.0
    shown.close(ready)
    assert stream.getvalue().splitlines() == [f"grazemap: {line}" for line in lines]


@pytest.mark.parametrize(("stream", "kind"), [(Terminal(), StartLine), (io.StringIO(), StartLog)])
def test_a_start_is_shown_where_standard_error_goes(monkeypatch, stream, kind):
    monkeypatch.setattr(sys, "stderr", stream)
    assert type(start_display()) is kind


def test_a_notebook_has_the_line_during_the_start_only(monkeypatch):
    shown = []
    handle = SimpleNamespace(update=lambda data, raw: shown.append(data["text/html"]))
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=1)))
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=lambda *_, **__: handle))
    place = start_display()
    ready_line(io.BytesIO(b'{"starting": "compiling <all>"}\n'), place)
    place.close(ready=True)
    assert shown == ["grazemap: compiling &lt;all&gt;", ""]

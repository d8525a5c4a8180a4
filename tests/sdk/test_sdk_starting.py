"""What those see who wait for a stack: one line that changes, nothing where nobody looks."""

import io

from grazemap.starting import StartLine, ready_line

LINES = b'{"starting": "a"}\n{"starting": "b"}\n{"url": "http://x:1", "pid": 1}\n'


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_the_line_with_the_address_ends_the_start():
    stream = Terminal()
    shown = StartLine(stream)
    assert ready_line(io.BytesIO(LINES), shown) == b'{"url": "http://x:1", "pid": 1}\n'
    shown.close()
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


def test_a_log_has_a_line_for_each_text_unless_it_is_quiet():
    for quiet, expected in ((False, "grazemap: a\ngrazemap: b\n"), (True, "")):
        stream = io.StringIO()
        shown = StartLine(stream, quiet)
        ready_line(io.BytesIO(LINES), shown)
        shown.close()
        assert stream.getvalue() == expected

"""The progress display of a job: in a notebook below the cell, on a terminal a line of stderr.

Elsewhere stderr gets a line for each reason for which a job waits long, and nothing else.
"""

from __future__ import annotations

import sys
import time
from html import escape
from shutil import get_terminal_size
from threading import Event as Flag
from threading import Lock, Thread
from typing import Any, Protocol

from grazemap.client.events import Event

QUIET_SECONDS = 0.5
"""Work that takes no longer shows nothing."""
TICK_SECONDS = 1.0
"""The display is refreshed so often, also while no event arrives."""
LOG_SECONDS = 5.0
"""What a job waits for no longer is not in a log."""
# Weight of a new estimate of the end against the earlier ones.
_NEW_ESTIMATE = 0.3


class Display(Protocol):
    """A place that shows the share of the work that is done, from 0 to 1, and a text beside it.

    The text is what the job waits for; if that is empty, the time that is left, which may be empty too.
    """

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Show a state."""

    def close(self) -> None:
        """Leave the place as it should remain."""


class Listener:
    """Shows progress, and what a job waits for, from its events; a context manager that closes the display.

    Parameters
    ----------
    title : str
        What is being computed.
    shown : bool
        False: nothing is written at all.
    """

    def __init__(self, title: str, shown: bool = True) -> None:
        self._title = title
        self._shown = shown
        self._display: Display | None = None
        self._share = 0.0
        self._end: float | None = None
        self._waiting_for = ""
        # The clock shows the first state, and those that follow, even if no event arrives for long.
        self._clock = Thread(target=self._tick, daemon=True)
        self._ended = Flag()
        self._lock = Lock()

    def __call__(self, event: Event) -> None:
        """Show a progress or a waiting event; others are ignored."""
        with self._lock:
            if event.name == "waiting":
                self._waiting_for = event.data.get("waiting_for") or ""
                self._refresh()
            if event.name != "progress":
                return
            # A resumed stream may repeat events; a bar never goes back.
            share = int(event.data.get("done", 0)) / max(1, int(event.data.get("total", 1)))
            self._share = min(1.0, max(self._share, share))
            self._estimate(event.data.get("eta_seconds"))
            self._refresh()

    def __enter__(self) -> Listener:
        if self._shown:
            self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        with self._lock:
            self._shown = False
            if self._display is not None:
                self._display.close()
                self._display = None

    def _tick(self) -> None:
        """Open the display, unless the work is done before, and refresh it until it is."""
        if self._ended.wait(QUIET_SECONDS):
            return
        with self._lock:
            if self._shown:
                self._display = _display(self._title)
                self._refresh()
        while not self._ended.wait(TICK_SECONDS):
            with self._lock:
                self._refresh()

    def _estimate(self, left: float | None) -> None:
        """Update the estimate of the end, gradually, so that it does not leap."""
        if left is not None:
            end = time.monotonic() + left
            self._end = end if self._end is None else self._end + _NEW_ESTIMATE * (end - self._end)

    def _refresh(self) -> None:
        if self._display is not None:
            left = None if self._end is None or self._share == 1.0 else max(0.0, self._end - time.monotonic())
            self._display.show(self._share, self._waiting_for, _left(left))


def _display(title: str) -> Display:
    """Return the display for where this runs."""
    if in_notebook():
        return NotebookBar(title)
    if not sys.stderr.isatty():
        return WaitingLog(title)
    try:
        from tqdm import tqdm
    except ImportError:
        return PlainLine(title)
    return TqdmBar(tqdm(desc=title, total=1.0, file=sys.stderr, dynamic_ncols=True, bar_format=_FORMAT))


# Without tqdm's estimate of the time left: the service's uses the times of tiles and the number of workers.
_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| [{elapsed}{postfix}]"


def in_notebook() -> bool:
    """Return whether this runs in a notebook's kernel."""
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    return getattr(shell, "kernel", None) is not None


def _left(seconds: float | None) -> str:
    return "" if seconds is None else f"about {seconds:.0f} s left"


def _text(waiting_for: str, left: str) -> str:
    return f"waiting for {waiting_for}" if waiting_for else left


class NotebookDisplay:
    """A place below a notebook's cell. It is emptied at the end, so that nothing of it is in the saved notebook.

    A widget of `tqdm.auto` would remain there as the text of its first state.
    """

    def __init__(self) -> None:
        from IPython.display import display

        self._handle: Any = display({"text/html": ""}, raw=True, display_id=True)

    def update(self, html: str) -> None:
        """Show HTML in place of what was shown before."""
        self._handle.update({"text/html": html}, raw=True)


class NotebookBar(NotebookDisplay):
    """A bar below a notebook's cell."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self._title = escape(title)

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """As `Display.show`."""
        text = escape(_text(waiting_for, left))
        self.update(f"{self._title} <progress value='{share:.3f}' max='1'></progress> {share:.0%} {text}")

    def close(self) -> None:
        """As `Display.close`."""
        self.update("")


class TqdmBar:
    """A bar of tqdm on a terminal."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """As `Display.show`."""
        self._bar.set_postfix_str(_text(waiting_for, left), refresh=False)
        self._bar.update(share - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        """As `Display.close`."""
        self._bar.set_postfix_str("", refresh=False)
        self._bar.close()


class PlainLine:
    """One line of a terminal that is overwritten."""

    def __init__(self, title: str) -> None:
        self._title = title

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """As `Display.show`."""
        # a text over the width of the terminal would leave lines behind
        width = get_terminal_size().columns - 1
        line = f"{self._title}: {share:4.0%} {_text(waiting_for, left)}"
        sys.stderr.write(f"\r{line[:width]:<{width}}")
        sys.stderr.flush()

    def close(self) -> None:
        """As `Display.close`."""
        sys.stderr.write("\n")
        sys.stderr.flush()


class WaitingLog:
    """A line for each reason for which a job waits longer than `LOG_SECONDS`, without progress."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._reason, self._since = "", 0.0
        self._said: set[str] = set()

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """As `Display.show`; the same reason may say other numbers after a comma, such as seconds."""
        reason = waiting_for.partition(",")[0]
        now = time.monotonic()
        if reason != self._reason:
            self._reason, self._since = reason, now
        if reason and reason not in self._said and now - self._since >= LOG_SECONDS:
            self._said.add(reason)
            sys.stderr.write(f"grazemap: {self._title}: waiting for {waiting_for}\n")
            sys.stderr.flush()

    def close(self) -> None:
        """As `Display.close`: the lines remain."""

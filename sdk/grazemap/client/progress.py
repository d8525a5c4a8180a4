"""The progress display of a job: below the cell of a notebook, or a line of stderr on a terminal.

Elsewhere only long waits are reported, with a line on stderr for each reason to wait.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from html import escape
from shutil import get_terminal_size
from threading import Event as ThreadEvent
from threading import Lock, Thread
from typing import Any, Protocol

from grazemap.client.events import Event
from grazemap.notebook import NotebookDisplay, runs_in_notebook

QUIET_SECONDS = 0.5
"""Work that takes no longer has no display."""
TICK_SECONDS = 1.0
"""Interval at which the display is refreshed, also while no event arrives."""
LOG_SECONDS = 5.0
"""Waits that take no longer are not logged."""
# Weight of a new estimate of the end against the earlier ones.
_NEW_ESTIMATE = 0.3


class Display(Protocol):
    """Shows the share of the work that is done, from 0 to 1, with a text.

    The text says what the job waits for or, if it does not wait, how much time is left, if that is known.
    """

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Show a state."""

    def close(self) -> None:
        """End the display."""


class ProgressListener:
    """Shows progress, and what a job waits for, from its events; a context manager that closes the display.

    Parameters
    ----------
    title : str
        The name of the computation.
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
        # The clock opens and refreshes the display, even if no event arrives for a long time.
        self._clock = Thread(target=self._tick, daemon=True)
        self._ended = ThreadEvent()
        self._lock = Lock()

    def __call__(self, event: Event) -> None:
        """Show a progress or a waiting event; other events are ignored."""
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

    def __enter__(self) -> ProgressListener:
        if self._shown:
            self._clock.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        with self._lock:
            self._shown = False
            if self._display is not None:
                with suppress(OSError):
                    self._display.close()
                self._display = None

    def _tick(self) -> None:
        """Open the display, unless the work ends very soon, and refresh it until the work ends."""
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
        """Update the estimate of the end by a weighted mean, so that it does not jump."""
        if left is not None:
            end = time.monotonic() + left
            self._end = end if self._end is None else self._end + _NEW_ESTIMATE * (end - self._end)

    def _refresh(self) -> None:
        if self._display is not None:
            left = ""
            if self._end is not None and self._share < 1.0:
                left = f"about {max(0.0, self._end - time.monotonic()):.0f} s left"
            try:
                self._display.show(self._share, self._waiting_for, left)
            except OSError:  # nobody reads it any more, which is no reason to end the work
                self._display = None


def _display(title: str) -> Display:
    """Return the display for a notebook, a log, or a terminal with or without tqdm."""
    if runs_in_notebook():
        return NotebookBar(title)
    if not sys.stderr.isatty():
        return WaitingLog(title)
    try:
        from tqdm import tqdm
    except ImportError:
        return PlainLine(title)
    return TqdmBar(tqdm(desc=title, total=1.0, file=sys.stderr, dynamic_ncols=True, bar_format=_FORMAT))


# tqdm's own estimate of the time left is not shown: the service's estimate knows the tiles and the number of workers.
_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| [{elapsed}{postfix}]"


def _text(waiting_for: str, left: str) -> str:
    return f"waiting for {waiting_for}" if waiting_for else left


class NotebookBar(NotebookDisplay):
    """A bar below a notebook's cell."""

    def __init__(self, title: str) -> None:
        super().__init__()
        self._title = escape(title)

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Show the bar and the text."""
        text = escape(_text(waiting_for, left))
        self.update(f"{self._title} <progress value='{share:.3f}' max='1'></progress> {share:.0%} {text}")

    def close(self) -> None:
        """Remove the bar."""
        self.update("")


class TqdmBar:
    """A bar of tqdm on a terminal."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Show the bar and the text."""
        self._bar.set_postfix_str(_text(waiting_for, left), refresh=False)
        self._bar.update(share - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        """Leave the bar without its text."""
        self._bar.set_postfix_str("", refresh=False)
        self._bar.close()


class PlainLine:
    """One line of a terminal that is overwritten."""

    def __init__(self, title: str) -> None:
        self._title = title

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Write the share and the text over the previous ones."""
        # a text wider than the terminal would leave lines behind
        width = get_terminal_size().columns - 1
        line = f"{self._title}: {share:4.0%} {_text(waiting_for, left)}"
        sys.stderr.write(f"\r{line[:width]:<{width}}")
        sys.stderr.flush()

    def close(self) -> None:
        """Leave the line on the terminal."""
        sys.stderr.write("\n")
        sys.stderr.flush()


class WaitingLog:
    """A line for each reason for which a job waits longer than `LOG_SECONDS`, without progress."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._reason, self._since = "", 0.0
        self._reported: set[str] = set()

    def show(self, share: float, waiting_for: str, left: str) -> None:
        """Write what the job waits for, once for each reason: the text before the first comma, without details."""
        reason = waiting_for.partition(",")[0]
        now = time.monotonic()
        if reason != self._reason:
            self._reason, self._since = reason, now
        if reason and reason not in self._reported and now - self._since >= LOG_SECONDS:
            self._reported.add(reason)
            sys.stderr.write(f"grazemap: {self._title}: waiting for {waiting_for}\n")
            sys.stderr.flush()

    def close(self) -> None:
        """Do nothing: the lines remain."""

"""The progress display of a job: in a notebook below the cell, on a terminal a line of stderr, elsewhere nothing."""

from __future__ import annotations

import sys
import time
from html import escape
from shutil import get_terminal_size
from threading import Lock, Timer
from typing import Any, Protocol

from grazemap.client.events import Event

QUIET_SECONDS = 0.5
"""Work that takes no longer shows nothing."""
# Weight of a new estimate of the end against the earlier ones.
_NEW_ESTIMATE = 0.3


class Display(Protocol):
    """A place that shows the share of the work that is done, from 0 to 1, and a text beside it, which may be empty."""

    def show(self, share: float, text: str) -> None:
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
        # The timer shows the first state even if no event follows for long.
        self._timer = Timer(QUIET_SECONDS, self._begin)
        self._timer.daemon = True
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
            self._timer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.cancel()
        with self._lock:
            self._shown = False
            if self._display is not None:
                self._display.close()
                self._display = None

    def _begin(self) -> None:
        with self._lock:
            if self._shown:
                self._display = _display(self._title)
                self._refresh()

    def _estimate(self, left: float | None) -> None:
        """Update the estimate of the end, gradually, so that it does not leap."""
        if left is not None:
            end = time.monotonic() + left
            self._end = end if self._end is None else self._end + _NEW_ESTIMATE * (end - self._end)

    def _refresh(self) -> None:
        if self._display is not None:
            left = None if self._end is None or self._share == 1.0 else max(0.0, self._end - time.monotonic())
            self._display.show(self._share, f"waiting for {self._waiting_for}" if self._waiting_for else _left(left))


def _display(title: str) -> Display | None:
    """Return the display for where this runs; None: standard error is no terminal."""
    if in_notebook():
        return NotebookBar(title)
    if not sys.stderr.isatty():
        return None
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

    def show(self, share: float, text: str) -> None:
        """As `Display.show`."""
        self.update(f"{self._title} <progress value='{share:.3f}' max='1'></progress> {share:.0%} {escape(text)}")

    def close(self) -> None:
        """As `Display.close`."""
        self.update("")


class TqdmBar:
    """A bar of tqdm on a terminal."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def show(self, share: float, text: str) -> None:
        """As `Display.show`."""
        self._bar.set_postfix_str(text, refresh=False)
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

    def show(self, share: float, text: str) -> None:
        """As `Display.show`."""
        # a text over the width of the terminal would leave lines behind
        width = get_terminal_size().columns - 1
        sys.stderr.write(f"\r{f'{self._title}: {share:4.0%} {text}'[:width]:<{width}}")
        sys.stderr.flush()

    def close(self) -> None:
        """As `Display.close`."""
        sys.stderr.write("\n")
        sys.stderr.flush()

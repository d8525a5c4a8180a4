"""The progress display of a job: a tqdm bar where tqdm is installed, else one plain line on stderr."""

from __future__ import annotations

import sys
from typing import Any, TextIO

from grazemap.client.events import Event


class Listener:
    """Shows the progress events among a job's events; a context manager that closes the display.

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
        self._bar: _TqdmBar | PlainLine | None = None
        self._furthest = 0

    def __call__(self, event: Event) -> None:
        """Show a progress event; others are ignored."""
        if not self._shown or event.name != "progress":
            return
        total, unit = max(1, int(event.data.get("total", 1))), str(event.data.get("unit", "tiles"))
        if self._bar is None:
            self._bar = _bar(self._title, total, unit)
        # A resumed stream may repeat events; a bar never goes back.
        self._furthest = min(total, max(self._furthest, int(event.data.get("done", 0))))
        self._bar.show(self._furthest, total, unit, event.data.get("eta_seconds"))

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def _bar(title: str, total: int, unit: str) -> _TqdmBar | PlainLine:
    try:
        from tqdm import tqdm
    except ImportError:
        return PlainLine(title, sys.stderr)
    bar = tqdm(desc=title, total=total, unit=f" {unit}", file=sys.stderr, dynamic_ncols=True, bar_format=_FORMAT)
    return _TqdmBar(bar)


# Without tqdm's estimate of the time left: the service's uses the times of tiles and the number of workers.
_FORMAT = "{desc}: {percentage:3.0f}%|{bar}| {n_fmt}/{total_fmt}{unit} [{elapsed}{postfix}]"


class _TqdmBar:
    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def show(self, done: int, total: int, unit: str, eta_seconds: float | None) -> None:
        self._bar.total = total
        if eta_seconds is not None:
            self._bar.set_postfix_str(f"about {eta_seconds:.0f} s left", refresh=False)
        self._bar.update(done - self._bar.n)
        self._bar.refresh()

    def close(self) -> None:
        self._bar.set_postfix_str("", refresh=False)
        self._bar.close()


class PlainLine:
    """One line that is overwritten on a terminal; elsewhere a new line for every 10 %."""

    def __init__(self, title: str, stream: TextIO) -> None:
        self._title = title
        self._stream = stream
        self._shown = -1
        self._open = False

    def show(self, done: int, total: int, unit: str, eta_seconds: float | None) -> None:
        """Show a state: `done` of `total` in some unit, and the seconds left, if they are known."""
        share = done / total
        tenth = int(10 * share)
        left = f", about {eta_seconds:.0f} s left" if eta_seconds is not None and done < total else ""
        text = f"{self._title}: {share:4.0%} ({done}/{total} {unit}{left})"
        if self._stream.isatty():
            self._stream.write(f"\r{text:<79}")
            self._open = True
        elif tenth > self._shown:
            self._stream.write(text + "\n")
        self._shown = tenth
        self._stream.flush()

    def close(self) -> None:
        """Leave the last state on the screen and end the line."""
        if self._open:
            self._stream.write("\n")
            self._stream.flush()

"""Sections of the page: text, tables, pictures, and rows of the table at its top."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from paper.paper import Printed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PICTURES = "pictures"


@dataclass(frozen=True)
class Row:
    """A line of the table at the top: where, what, printed, computed, and how they compare."""

    where: str
    what: str
    printed: str
    computed: str
    verdict: str


@dataclass
class Section:
    """A part of the page.

    Attributes
    ----------
    title : str
    blocks : list of str
        Paragraphs, tables, pictures, in Markdown.
    rows : list of Row
        For the table at the top of the page.
    pictures : dict
        From file names to functions that draw them and return the axes.
    """

    title: str
    blocks: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    pictures: dict[str, Callable[[], Axes]] = field(default_factory=dict)

    def say(self, text: str) -> None:
        """Add a paragraph."""
        self.blocks.append(wrapped(text))

    def show(self, head: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """Add a table."""
        self.blocks.append(table(head, rows))

    def draw(self, name: str, text: str, picture: Callable[[], Axes]) -> None:
        """Add a picture; `text` says what it shows."""
        self.pictures[name] = picture
        self.blocks.append(f"![{text}]({PICTURES}/{name})")

    def compare(self, printed: Printed, reading: str, computed: float, digits: int, reason: str) -> None:
        """Add a line to the table at the top of the page."""
        verdict = "agrees" if printed.agrees(computed) else f"off by {computed - printed.value:.1e}: {reason}"
        self.rows.append(
            Row(printed.where, f"{printed.what}; {reading}", printed.text, f"{computed:.{digits}f}", verdict)
        )

    def markdown(self) -> str:
        """Return the section as Markdown."""
        return "\n\n".join([f"## {self.title}", *self.blocks])


def save_pictures(section: Section, folder: Path) -> None:
    """Draw the pictures of a section into a folder."""
    from grazemap.plots import save_axes
    from grazemap.plots.axes import kept_from_pyplot

    for name, picture in section.pictures.items():
        with kept_from_pyplot():
            save_axes(picture(), folder / name)


def logarithmic(ax: Axes) -> None:
    """Make the vertical axis logarithmic, with plain numbers: a grazing curve has peaks of very different heights."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    ax.set_yscale("log")
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.yaxis.set_minor_formatter(NullFormatter())
    ax.grid(alpha=0.25, linewidth=0.5)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [list(head), ["---"] * len(head), *map(list, rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def wrapped(text: str) -> str:
    """Return a paragraph, or an item of a list, in lines of at most 120 characters."""
    indent = "  " if text.startswith("- ") else ""
    return textwrap.fill(text, 120, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def below(value: float) -> str:
    """Return what a number that is round-off, or nearly, stays below: a power of ten, 1e-14 at the least."""
    power = -14
    while 10.0**power <= abs(value):
        power += 1
    return f"1e{power:+03d}"

"""The colours, markers and names of pictures. All colours are in palette.json, which the service's page reads too."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from grazemap import colours
from grazemap.colours import PALETTE
from grazemap.results import Motion, MotionShare

INK: str = PALETTE["ink"]
PAPER: str = PALETTE["paper"]
UNEXPLAINED: str = PALETTE["unexplained"]
UNRESOLVED: str = PALETTE["kinds"]["unresolved"]
OTHER: str = colours.OTHER
NAMED: dict[str, str] = PALETTE["motions"]
"""Colour by label."""

ORDERS: tuple[str, ...] = tuple(PALETTE["orders"])
"""Colours of recurrences by order, of the returns of a mapping, and of harmonics, each by its number."""

LINE, SECOND_LINE = PALETTE["lines"]
PALE_LINE = OTHER
ANY_COLOUR = UNRESOLVED
"""Colour of entries of legends that explain the dashes of lines in any colour."""

# Marker, colour and name of bifurcations; the same in every picture.
BIFURCATIONS = {
    kind: (marker, PALETTE["bifurcations"][kind], text)
    for kind, marker, text in (
        ("SN", "^", "saddle-node (SN)"),
        ("PD", "s", "period doubling (PD)"),
        ("SB", "D", "symmetry breaking (SB)"),
        ("NS", "o", "Neimark-Sacker (NS)"),
        ("GR", "X", "graze (GR)"),
    )
}

DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 2)),
    (0, (1, 1.5)),
    (0, (6, 2, 1, 2)),
    (0, (9, 2)),
    (0, (4, 1.5, 1, 1.5, 1, 1.5)),
    (0, (2.5, 2.5)),
    (0, (9, 2, 2, 2, 2, 2)),
)


def dash(number: int) -> Any:
    """Return the line style for a number, which stands for a motion or a number of periods; all styles differ."""
    style, round = DASHES[number % len(DASHES)], number // len(DASHES)
    if not round:
        return style
    offset, strokes = (0, (12, 2)) if style == "-" else style
    return offset, (*strokes, *(1, 1.2) * round)


def order_style(order: int) -> dict[str, Any]:
    """Return marker and colour of recurrences of an order: asterisks, with more arms from the order 9 on."""
    round, place = divmod(order - 1, len(ORDERS))
    return {"marker": (6 + round, 2, 0), "color": ORDERS[place]}


_LABEL = re.compile(r"(\d+)-(\d+|∞|\(-\d+\))r-(\d+|∞|\(-\d+\))l")


def motion_colours(motions: Sequence[Motion | MotionShare], fixed: Mapping[str, str] | None = None) -> list[str]:
    """Return the colours of different motions in one picture, as `grazemap.colours.motion_colours`.

    `fixed` are the colours of some motions by label or kind. Raises ValueError for what is not a colour.
    """
    return colours.motion_colours([motion.label or motion.kind for motion in motions], hexadecimal(fixed))


def hexadecimal(named_colours: Mapping[str, str] | None) -> dict[str, str]:
    """Return colours in any form of matplotlib as #RRGGBB. Raises ValueError for a text that is not a colour."""
    if not named_colours:
        return {}
    from matplotlib.colors import to_hex

    return {name: to_hex(colour).upper() for name, colour in named_colours.items()}


def is_dark(colour: str) -> bool:
    """Return whether white text is read more easily on a colour than black text."""
    return _luminance(colour) < 0.18


def is_light(colour: str) -> bool:
    """Return whether dots of a colour are hard to see on white."""
    return _luminance(colour) > 0.6


def _luminance(colour: str) -> float:
    """Return the relative luminance, 0 to 1, of #RRGGBB (WCAG 2, with a power for its curve)."""
    red, green, blue = ((int(colour[i : i + 2], 16) / 255.0) ** 2.2 for i in (1, 3, 5))
    return float(0.2126 * red + 0.7152 * green + 0.0722 * blue)


def motion_text(motion: Motion | MotionShare) -> str:
    """Return the label of a motion with subscripts, as mathtext, or its kind where it has no label."""
    return label_text(motion.label or motion.kind)


def is_without_impacts(motion: Motion | MotionShare) -> bool:
    """Return whether a motion touches no stop."""
    return motion.impacts_right == motion.impacts_left == -1


def entry_text(motion: Motion | MotionShare) -> str:
    """Return the label of a motion for a legend, which says of a motion without impacts that it has none."""
    return f"no impacts, {motion_text(motion)}" if is_without_impacts(motion) else motion_text(motion)


def label_text(label: str) -> str:
    """Return a label n-p_r-q_l in plain text with subscripts, as mathtext; other texts as they are."""

    def subscripts(match: re.Match[str]) -> str:
        period, right, left = (count.replace("∞", r"\infty") for count in match.groups())
        return rf"{period}-${right}_\mathrm{{r}}$-${left}_\mathrm{{l}}$"

    return _LABEL.sub(subscripts, label)

"""The colours of motions: a function of the label alone, so that a motion looks the same in every picture.

The colours of `NAMED` were chosen one after the other, each the farthest in OKLab from all before it (the greys and
the background included) in the least favourable of three views: normal, protan and deutan vision. Other motions get a
colour computed from their label; they cover small regions, and the picture names the regions that are large enough.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from grazemap.wire.job import INFINITE

if TYPE_CHECKING:
    from grazemap.results import Motion, MotionShare

UNRESOLVED = "#909090"
OTHER = "#DCDCDC"
CHAOTIC = "#1A1A1A"
QUASI_PERIODIC = "#5A5A5A"
_BY_KIND = {"unresolved": UNRESOLVED, "chaotic": CHAOTIC, "quasi-periodic": QUASI_PERIODIC}

_LABEL = re.compile(r"(\d+)-(\d+|∞|\(-\d+\))r-(\d+|∞|\(-\d+\))l")

# Marker, colour and name of bifurcations; the same in every picture.
BIFURCATIONS = {
    "SN": ("^", "#C31E2D", "saddle-node (SN)"),
    "PD": ("s", "#1E1E78", "period doubling (PD)"),
    "SB": ("D", "#117733", "symmetry breaking (SB)"),
    "NS": ("o", "#B8860B", "Neimark-Sacker (NS)"),
    "GR": ("X", "#222222", "graze (GR)"),
}

# (period, impacts_right, impacts_left)
NAMED: dict[tuple[int, int, int], str] = {
    (1, -1, -1): "#FFFBEA",
    (1, 1, -1): "#E15A5A",
    (1, -1, 1): "#87003C",
    (1, 1, 1): "#88CCEE",
    (1, 2, 2): "#B496F0",
    (1, 3, 3): "#E1F069",
    (1, 4, 4): "#2D8700",
    (1, 5, 5): "#3C0096",
    (1, 6, 6): "#D2872D",
    (1, 1, 2): "#00D287",
    (1, 2, 1): "#96E178",
    (1, 2, 3): "#0F69E1",
    (1, 3, 2): "#5A87FF",
    (1, 3, 4): "#69005A",
    (1, 4, 3): "#A53CA5",
    (2, 1, 1): "#693C78",
    (2, 3, 3): "#FF9600",
    (2, 5, 5): "#B40F4B",
    (3, 1, 1): "#C369C3",
    (3, 2, 2): "#4BFFA5",
    (3, 4, 4): "#5A5A00",
    (3, 5, 5): "#FFA5C3",
    (3, 7, 7): "#FFC300",
    (3, 8, 8): "#004B00",
    (3, 10, 10): "#FF78C3",
    (3, 13, 13): "#5A2DB4",
    (5, 8, 8): "#69B496",
}

# Powers of the positive root of x^4 = x + 1: the steps whose sums fill the circle most evenly (Roberts, 2018).
_HUE_STEPS = (0.5497004779, 0.8191725134, 0.6710436067)
_CHROMA = 0.09
_LIGHTNESS = (0.72, 0.48, 0.83, 0.60)


def motion_colour(motion: Motion | MotionShare) -> str:
    """Return the colour of a motion as #RRGGBB; it depends on the label or the kind only."""
    if motion.period is None or motion.impacts_right is None or motion.impacts_left is None:
        return _BY_KIND.get(motion.kind, OTHER)
    key = (motion.period, motion.impacts_right, motion.impacts_left)
    return NAMED.get(key) or _computed(*key)


def motion_text(motion: Motion | MotionShare) -> str:
    """Return a motion's label with subscripts, n-p_r-q_l, as mathtext; its kind when it is not periodic."""
    if motion.period is None or motion.impacts_right is None or motion.impacts_left is None:
        return motion.kind
    counts = (motion.impacts_right, motion.impacts_left)
    right, left = (r"\infty" if n == INFINITE else f"({n})" if n < 0 else str(n) for n in counts)
    return f"{motion.period}-${right}_r$-${left}_l$"


def label_text(label: str) -> str:
    """Return a label n-p_r-q_l, as motions have it in plain text, with subscripts as `motion_text` has it."""

    def subscripts(found: re.Match[str]) -> str:
        period, right, left = (count.replace("∞", r"\infty") for count in found.groups())
        return f"{period}-${right}_r$-${left}_l$"

    return _LABEL.sub(subscripts, label)


def components(colour: str) -> NDArray[np.float64]:
    """Return red, green and blue of #RRGGBB, each from 0 to 255."""
    return np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], dtype=np.float64)


def hexadecimal(parts: Iterable[float]) -> str:
    """Return red, green and blue, each from 0 to 255, as #RRGGBB."""
    return "#" + "".join(f"{round(part):02X}" for part in parts)


def _computed(period: int, right: int, left: int) -> str:
    """Return a colour of medium chroma, its hue and lightness stepped by every count of the label."""
    turns = sum(step * count for step, count in zip(_HUE_STEPS, (period, right, left), strict=True))
    hue = 2 * math.pi * (turns % 1.0)
    lightness = _LIGHTNESS[(period + right + 2 * left) % len(_LIGHTNESS)]
    return _srgb(lightness, _CHROMA * math.cos(hue), _CHROMA * math.sin(hue))


def _srgb(lightness: float, a: float, b: float) -> str:
    """Return OKLab as #RRGGBB, clipped to what a screen shows (Ottosson, 2020)."""
    long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
    medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
    short = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
    linear = (
        4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short,
        -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short,
        -0.0041960863 * long - 0.7034186147 * medium + 1.7076147010 * short,
    )
    return hexadecimal([255 * _encoded(min(1.0, max(0.0, value))) for value in linear])


def _encoded(value: float) -> float:
    return 12.92 * value if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055

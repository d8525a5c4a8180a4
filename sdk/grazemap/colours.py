"""The colours of motions, from palette.json, which has those of pictures and of the service's page.

Any two colours there differ by at least 12 in CIEDE2000, and by 8 as people with deuteranopia see them, so whatever
meets in a picture can be distinguished. A motion that is named there has its colour in every picture. Any other motion
takes the colour that its label gives, or the next one that no motion of the picture has. Two pictures agree if one is
given the colours of the other.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from importlib.resources import files
from types import MappingProxyType
from typing import Any

PALETTE: dict[str, Any] = json.loads(files("grazemap").joinpath("palette.json").read_text(encoding="utf-8"))

OTHER: str = PALETTE["kinds"]["other"]
_NAMED: dict[str, str] = PALETTE["kinds"] | PALETTE["motions"]
_FREE: tuple[str, ...] = (*PALETTE["motions"].values(), *PALETTE["other motions"])
COLOURED = 20
"""Number of periodic motions of a map with a colour, unless the caller of a picture says another."""


def motion_colours(names: Sequence[str], fixed: Mapping[str, str] = MappingProxyType({})) -> list[str]:
    """Return the colours #RRGGBB of different motions in one picture; those that find no colour left have `OTHER`.

    `names` are their labels, or the kinds of those that have none. Of equal names, such as those of mirror images, the
    first has the colour of the name. `fixed` are the colours of some names; the others have none of these while there
    are others.
    """
    colours = [fixed.get(name) if name not in names[:i] else None for i, name in enumerate(names)]
    for i, name in enumerate(names):
        named = _NAMED.get(name)
        if colours[i] is None and named not in colours:
            colours[i] = named
    for i, name in enumerate(names):
        if colours[i] is None:
            first = zlib.crc32(name.encode()) % len(_FREE)
            free = [colour for colour in (*_FREE[first:], *_FREE[:first]) if colour not in colours]
            colours[i] = min(free, key=lambda colour: colour in fixed.values(), default=OTHER)
    return [colour or OTHER for colour in colours]


def colours_of_map(
    labels: Sequence[str],
    kinds: Sequence[str],
    coloured: int = COLOURED,
    fixed: Mapping[str, str] = MappingProxyType({}),
) -> list[str | None]:
    """Return the colours of the motions of a map, the largest share first; None for those that are drawn as "other".

    Of the periodic motions only the first `coloured` have a colour, the same as in the picture with the usual number,
    and none that finds no colour left. `fixed` is as of `motion_colours`.
    """
    periodic = [i for i, kind in enumerate(kinds) if kind == "periodic"]
    small, smallest = set(periodic[coloured:]), set(periodic[max(coloured, COLOURED) :])
    named = [i for i in range(len(labels)) if i not in smallest]
    colours = dict(zip(named, motion_colours([labels[i] for i in named], fixed), strict=True))
    return [None if i in small or colours[i] == OTHER else colours[i] for i in range(len(labels))]

"""The colours of motions. All colours of pictures, and of the service's page, stand in palette.json.

Any two colours of areas differ by at least 12 in CIEDE2000, and by at least 8 as seen with deuteranopia, so that
neighbouring areas of a picture can be distinguished; so do those of lines and marks, which have a rim on areas. Motions
that fill maps are quiet, rare ones are strong, and chaos is dark. A motion that palette.json names has the same colour
in every picture. For any other motion the label determines a colour; if another motion of the picture has it, the next
free colour is used. To give motions the same colours in two pictures, pass the colours of one picture to the other.
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
"""Number of periodic motions of a map with a colour, unless the caller of a picture gives another number."""


def motion_colours(names: Sequence[str], fixed: Mapping[str, str] = MappingProxyType({})) -> list[str]:
    """Return the colours #RRGGBB of different motions in one picture; `OTHER` where no free colour is left.

    `names` are the labels of the motions, or the kinds of motions without a label. Where a name occurs more than once,
    as for mirror images, only the first motion has the colour of the name. `fixed` gives the colours of some names.
    Other motions get one of these colours only when no other colour is left.
    """
    colours = [fixed.get(name) if name not in names[:i] else None for i, name in enumerate(names)]
    for i, name in enumerate(names):
        own_colour = _NAMED.get(name)
        if colours[i] is None and own_colour not in colours:
            colours[i] = own_colour
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
    """Return the colours of the motions of a map, the largest share first; None for motions that are drawn as "other".

    Only the first `coloured` periodic motions have a colour, the same one for any smaller number. A motion for which no
    free colour is left has none. `fixed` gives the colours of some labels, as in `motion_colours`.
    """
    periodic = [i for i, kind in enumerate(kinds) if kind == "periodic"]
    small, smallest = set(periodic[coloured:]), set(periodic[max(coloured, COLOURED) :])
    candidates = [i for i in range(len(labels)) if i not in smallest]
    colours = dict(zip(candidates, motion_colours([labels[i] for i in candidates], fixed), strict=True))
    return [None if i in small or colours[i] == OTHER else colours[i] for i in range(len(labels))]

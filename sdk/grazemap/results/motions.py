"""The motions of an unfolding map, from its arrays: in results and in JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.colours import colours_of_map
from grazemap.wire import motion_label

Document = dict[str, Any]


def motions_of(document: Mapping[str, Any]) -> tuple[list[Document], NDArray[np.int64]]:
    """Return the motions of a map, the largest share first, and the position of each point's motion among them.

    Parameters
    ----------
    document : mapping
        kind, period, impacts_right and impacts_left, each of shape (clearance, omega), and kinds.

    Returns
    -------
    motions : list of dict
        label, kind, period, impacts_right, impacts_left (None for a motion that is not periodic), pixels, share and
        colour (None for one of the "other motions" of the map's picture).
    motion : (clearance, omega) array
    """
    kind, kinds = document["kind"], [str(name) for name in document["kinds"]]
    labels = [kind, *(document[name] for name in ("period", "impacts_right", "impacts_left"))]
    # most neighbours are equal, so only the first label of each run is sorted
    begins = np.ones(kind.size, dtype=np.bool_)
    begins[1:] = np.any([label.ravel()[1:] != label.ravel()[:-1] for label in labels], axis=0)
    starts = np.flatnonzero(begins)
    codes = np.stack([label.ravel()[starts] for label in labels], axis=-1)
    codes[codes[:, 0] != (kinds.index("periodic") if "periodic" in kinds else -1), 1:] = 0
    # whole numbers are sorted many times faster than rows
    numbers = np.ravel_multi_index((codes - codes.min(axis=0)).T, np.ptp(codes, axis=0) + 1)
    _, first, places = np.unique(numbers, return_index=True, return_inverse=True)
    lengths = np.diff(starts, append=kind.size)
    counts = np.bincount(places, weights=lengths).astype(np.int64)
    motions = [
        _motion(kinds[code[0]], code[1:], pixels, kind.size)
        for code, pixels in zip(codes[first].tolist(), counts.tolist(), strict=True)
    ]
    order = sorted(range(len(motions)), key=lambda i: (-motions[i]["pixels"], motions[i]["label"]))
    rank = np.argsort(order)
    largest = [motions[i] for i in order]
    colours = colours_of_map([entry["label"] for entry in largest], [entry["kind"] for entry in largest])
    coloured = [{**entry, "colour": colour} for entry, colour in zip(largest, colours, strict=True)]
    return coloured, np.repeat(rank[places], lengths).reshape(kind.shape)


def _motion(kind: str, counts: list[int], pixels: int, total: int) -> Document:
    periodic = kind == "periodic"
    period, right, left = counts if periodic else (None, None, None)
    return {
        "label": motion_label(*counts) if periodic else kind,
        "kind": kind,
        "period": period,
        "impacts_right": right,
        "impacts_left": left,
        "pixels": pixels,
        "share": pixels / total,
    }

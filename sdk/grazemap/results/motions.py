"""The list of the motions of an unfolding map, from its arrays; results and their JSON have the same list."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grazemap.colours import colours_of_map
from grazemap.wire import motion_label
from grazemap.wire.job import INFINITE

Document = dict[str, Any]


def motions_of(document: Mapping[str, Any]) -> tuple[list[Document], NDArray[np.int64]]:
    """Return the motions of a map, the largest share first, and the position of each pixel's motion in this list.

    Parameters
    ----------
    document : mapping
        kind, period, impacts_right and impacts_left, each of shape (clearance, omega), and kinds.

    Returns
    -------
    motions : list of dict
        label, kind, period, impacts_right and impacts_left (all three None for a motion that is not periodic), pixels,
        share and colour (None for one of the "other motions" of the map's picture).
    motion : int array of shape (clearance, omega)
        Position of each pixel's motion in `motions`.
    """
    kind, kinds = document["kind"], [str(name) for name in document["kinds"]]
    arrays = [kind, *(document[name] for name in ("period", "impacts_right", "impacts_left"))]
    # most neighbours are equal, so only the first pixel of each run is sorted
    begins = np.ones(kind.size, dtype=np.bool_)
    begins[1:] = np.any([array.ravel()[1:] != array.ravel()[:-1] for array in arrays], axis=0)
    starts = np.flatnonzero(begins)
    codes = np.stack([array.ravel()[starts] for array in arrays], axis=-1)
    # a motion that is not periodic has only its kind
    codes[codes[:, 0] != (kinds.index("periodic") if "periodic" in kinds else -1), 1:] = 0
    # whole numbers are sorted many times faster than rows
    numbers = np.ravel_multi_index((codes - codes.min(axis=0)).T, np.ptp(codes, axis=0) + 1)
    _, first, places = np.unique(numbers, return_index=True, return_inverse=True)
    lengths = np.diff(starts, append=kind.size)
    pixel_counts = np.bincount(places, weights=lengths).astype(np.int64)
    motions = [
        _motion(kinds[code[0]], code[1:], pixels, kind.size)
        for code, pixels in zip(codes[first].tolist(), pixel_counts.tolist(), strict=True)
    ]
    order = sorted(range(len(motions)), key=lambda i: (-motions[i]["pixels"], motions[i]["label"]))
    rank = np.argsort(order)
    ordered = [motions[i] for i in order]
    colours = colours_of_map([entry["label"] for entry in ordered], [entry["kind"] for entry in ordered])
    coloured = [{**entry, "colour": colour} for entry, colour in zip(ordered, colours, strict=True)]
    return coloured, np.repeat(rank[places], lengths).reshape(kind.shape)


def more_first(right: NDArray[Any], left: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return numbers of impacts on the two stops, the larger one of each pair first; infinitely many are more."""
    of_right, of_left = (np.where(counts == INFINITE, np.inf, counts) for counts in (right, left))
    return np.where(of_left > of_right, left, right), np.where(of_left > of_right, right, left)


def _motion(kind: str, label_numbers: list[int], pixels: int, all_pixels: int) -> Document:
    periodic = kind == "periodic"
    period, right, left = label_numbers if periodic else (None, None, None)
    return {
        "label": motion_label(*label_numbers) if periodic else kind,
        "kind": kind,
        "period": period,
        "impacts_right": right,
        "impacts_left": left,
        "pixels": pixels,
        "share": pixels / all_pixels,
    }

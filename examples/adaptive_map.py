"""An adaptive unfolding map of 1024 x 1024 points, computed by a stack of its own, and which points were computed.

Writes adaptive_map.png, adaptive_map_computed.png and adaptive_map.npz into the folder named on the command line
("out" when none is). Half a minute on two cores.
"""

from __future__ import annotations

import sys
from pathlib import Path

import grazemap
from grazemap.plots import save_axes

SIDE = 1024


def main(folder: Path) -> None:
    """Compute the map and write it."""
    folder.mkdir(parents=True, exist_ok=True)
    with grazemap.local() as client:
        umap = client.unfolding_map(
            omega=(0.26, 0.32), clearance=(1.2, 2.1), shape=(SIDE, SIDE), max_periods=200, adaptive=True
        )
    print(umap)
    umap.save(folder / "adaptive_map.npz")
    save_axes(umap.plot(), folder / "adaptive_map.png")
    save_axes(umap.plot_computed(), folder / "adaptive_map_computed.png")
    print(f"written to {folder}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))

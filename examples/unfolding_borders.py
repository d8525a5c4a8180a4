"""The unfolding diagram of the paper's example, and every border of it explained, over HTTP by a stack of its own.

Two windows: that round the codimension-two point of order 2, and that of the paper's Figure 8. Writes a picture, an
.npz and a summary of each into the folder named on the command line ("out" when none is). `make borders` runs this.
"""

from __future__ import annotations

import sys
from pathlib import Path

import grazemap
from grazemap.plots import save_axes

WINDOWS = {
    "near_codimension_two_point": {
        "omega": (0.275, 0.29),
        "clearance": (1.8, 2.0),
        "shape": (256, 256),
        "max_periods": 2000,
    },
    "figure_8": {"omega": (0.26, 0.30), "clearance": (1.3, 2.05), "shape": (64, 64)},
}
LISTED = 40


def main(folder: Path) -> None:
    """Compute everything and write it."""
    folder.mkdir(parents=True, exist_ok=True)
    with grazemap.local() as client:
        for name, window in WINDOWS.items():
            diagram = client.unfolding_diagram(**window, borders=True)
            borders = "\n".join(
                f"{border.pairs:6}  {' | '.join(border.motions):<44} {border.explanation:<12} {border.curve}"
                for border in diagram.border_list()[:LISTED]
            )
            text = f"{window}\n{diagram.summary()}\n\nsteps   motions\n{borders}\n"
            print(text, flush=True)
            (folder / f"{name}.txt").write_text(text, encoding="utf-8")
            diagram.save(folder / f"{name}.npz")
            save_axes(diagram.plot(), folder / f"{name}.png")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))

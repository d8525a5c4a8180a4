"""The paper's example, computed over HTTP by a stack of its own: curve, codimension-two points, unfolding map.

`python -m paper.first [FOLDER]` (`make run`) writes grazing_curve.png and .npz, codimension_two_points.json,
unfolding_map.png and .npz into the folder, "out" if none is named, and says where. The jobs and results of the stack
stay in its folder "data". At the end it prints the paper's numbers beside the computed ones.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import grazemap
from grazemap.constants import DEFAULT_BASE_URL
from grazemap.plots import save_axes
from paper.codimension_two import nearest
from paper.paper import GRAZING_CLEARANCE, GRAZING_OMEGA, POINT_CLEARANCE, POINT_OMEGA


def main(folder: Path) -> None:
    """Compute everything and write it."""
    started = time.monotonic()
    folder.mkdir(parents=True, exist_ok=True)
    print("starting service, queue and workers (a minute the first time, as kernels are compiled) ...", flush=True)
    with grazemap.local(data=folder / "data") as client:
        print(f"... listening on {client.base_url} after {time.monotonic() - started:.0f} s", flush=True)
        print("computing the grazing curve, its codimension-two points and a map (about ten seconds) ...", flush=True)
        oscillator = grazemap.Oscillator()
        curve = client.grazing_curve(oscillator, omega=(0.05, 1.2), points=2000)
        points = client.codimension_two_points(oscillator, omega=(0.05, 2.5), max_order=8)
        umap = client.unfolding_map(oscillator, omega=(0.26, 0.30), clearance=(1.3, 2.0), shape=(128, 128))
        identity = client.submit("unfolding-maps", umap.meta["request"]).id

    written = [
        curve.save(folder / "grazing_curve.npz"),
        points.save(folder / "codimension_two_points.json"),
        umap.save(folder / "unfolding_map.npz"),
        folder / "grazing_curve.png",
        folder / "unfolding_map.png",
    ]
    save_axes(curve.plot(points=points), folder / "grazing_curve.png")
    save_axes(umap.plot(curve=curve, points=points), folder / "unfolding_map.png")

    print(f"\n{curve}\n{points}\n{umap}")
    for motion in umap.motions()[:8]:
        print(f"  {motion.label:<20} {motion.share:6.1%}")
    print("\nthe paper's numbers:")
    point = nearest(points, 2)
    for printed, computed in (
        (GRAZING_CLEARANCE, float(curve.at(GRAZING_OMEGA))),
        (POINT_OMEGA, point.omega),
        (POINT_CLEARANCE, point.clearance),
    ):
        print(f"  {printed.what}: printed {printed.text}, computed {computed:.5f} ({printed.where})")
    print("  docs/reproduction.md has all of them, and why some differ")
    print(f"\ndone in {time.monotonic() - started:.0f} s; written:")
    for path in sorted(written):
        print(f"  {path.resolve()}")
    command = Path(sys.executable).with_name("grazemap")
    print(f"\nTo drag, zoom and click in this map: {command} up --data {folder / 'data'} (make serve does so),")
    print(f"and open {DEFAULT_BASE_URL}/#map={identity}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out"))

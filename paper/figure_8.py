"""Figure 8: the unfolding map round the codimension-two point, and the curves that divide it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grazemap import BifurcationCurves, Client, PeriodicOrbit, UnfoldingMap
from paper.page import Section
from paper.paper import GAMMA, POINT_CLEARANCE, POINT_OMEGA, READINGS, REGIONS
from paper.samples import Sample
from paper.unfolding_pictures import close_up, curves_of_motions, regions

CHAIN = READINGS[GAMMA]
OMEGA, CLEARANCE = (0.26, 0.30), (1.3, 2.05)
# Every EVERY_ROW-th clearance and EVERY_COLUMN-th omega of the map is a place of the table.
ROWS, COLUMNS, EVERY_ROW, EVERY_COLUMN = 301, 257, 20, 32
NEAR_OMEGA, NEAR_CLEARANCE, NEAR = (0.276, 0.287), (1.895, 1.96), (161, 161)
# On a grid of so many frequencies the curves have those of the paper's two lines.
CURVE_POINTS = 401
MAX_ORDER, MAX_MULTIPLE = 4, 2
LISTED = 12
SLOW = 1e-3


def figure_8(client: Client, samples: Sequence[Sample]) -> Section:
    """Return the map over the paper's window with its curves, and one close to the point; `samples` of Figure 9."""
    section = Section("Figure 8: the unfolding diagram")
    umap = client.unfolding_map(CHAIN, omega=OMEGA, clearance=CLEARANCE, shape=(ROWS, COLUMNS))
    curve = client.grazing_curve(CHAIN, omega=OMEGA, points=400, progress=False)
    points = client.codimension_two_points(
        CHAIN, omega=OMEGA, max_order=MAX_ORDER, max_multiple=MAX_MULTIPLE, progress=False
    )
    closed = closed_forms(client)
    section.say(
        f"The paper draws this diagram around omega = {POINT_OMEGA.text}, b = {POINT_CLEARANCE.text}. It says that"
        ' "the dash curve represents double grazing motion" and that the plane "is divided into regions characterized'
        ' by different types of motions", and describes the regions along omega = 0.29 and omega = 0.27 (Figure 9).'
        " The text gives neither the axes nor the borders. The picture below shows the motion to which a trajectory"
        f" from rest settles, at {len(umap.vertical)} clearances from {CLEARANCE[0]:g} to {CLEARANCE[1]:g} and"
        f" {len(umap.horizontal)} frequencies from {OMEGA[0]:g} to {OMEGA[1]:g}. The letters are those of Figure 9, at"
        " the clearances of its samples."
    )
    section.draw(
        "figure_8.png", "Unfolding map over the window of Figure 8", lambda: regions(umap, curve, points, samples)
    )
    section.say(_shares(umap))
    section.say("The table has the labels at some points of the map; ~ is chaotic, ? unresolved, qp quasi-periodic:")
    section.show(
        ["b \\ omega", *(f"{omega:.3f}" for omega in umap.horizontal[::EVERY_COLUMN])],
        labels(umap, EVERY_ROW, EVERY_COLUMN),
    )
    section.say(
        "The borders are curves that are computed without the map. The table has the clearances at which curves"
        " in closed form are borders of motions on the paper's two lines. These are motions with one impact, or with"
        " one on each stop:"
    )
    section.show(["border", "of", "b at omega = 0.27", "b at omega = 0.29"], borders(closed))
    named = client.bifurcation_curves(CHAIN, omega=OMEGA, clearance=CLEARANCE, motions=_orbits(samples), progress=False)
    names = ", ".join(dict.fromkeys(motion.label or "-" for motion in named.motions))
    section.say(
        f"The curves of these motions are computed by continuation from the orbits of Figure 9: {names}. Only pieces on"
        " which the orbits are admissible are drawn. Some of them are borders of unstable motions, or of motions that"
        " trajectories from rest do not reach; these are no borders of the map."
    )
    section.draw(
        "figure_8_curves.png",
        "Bifurcation curves in the window of Figure 8",
        lambda: curves_of_motions(curve, closed, named),
    )
    near = client.unfolding_map(CHAIN, omega=NEAR_OMEGA, clearance=NEAR_CLEARANCE, shape=NEAR)
    section.say(
        "The next picture shows the map close to the point, with the curves that leave the grazing curve there (see"
        " above):"
    )
    section.draw(
        "figure_8_detail.png",
        "Unfolding map close to the codimension-two point",
        lambda: close_up(near, curve, points, closed),
    )
    return section


def closed_forms(client: Client) -> BifurcationCurves:
    """Return the curves of motions with one impact, or one on either stop, in the window."""
    return client.bifurcation_curves(
        CHAIN, omega=OMEGA, clearance=CLEARANCE, max_multiple=MAX_MULTIPLE, points=CURVE_POINTS, progress=False
    )


def labels(umap: UnfoldingMap, every_row: int = 1, every_column: int = 1) -> list[list[str]]:
    """Return the motions at some places of a map, the greatest clearance first, with the clearance in front."""
    short = {"chaotic": "~", "unresolved": "?", "quasi-periodic": "qp"}
    names = umap.labels()[::every_row, ::every_column]
    rows = zip(umap.vertical[::every_row], names, strict=True)
    return [[f"{value:.2f}", *(short.get(str(name), str(name)) for name in row)] for value, row in rows][::-1]


def borders(curves: BifurcationCurves) -> list[list[str]]:
    """Return what the closed forms have on the paper's two lines: type, motion, and clearances."""
    rows = []
    for curve in curves.curves:
        if not curve.admissible:
            continue
        cells, (omegas, clearances) = [], curve.line.T
        for omega in sorted(REGIONS):
            at = np.flatnonzero(np.abs(omegas - omega) < 1e-9)
            cells.append(f"{clearances[at[0]]:.9f}" if len(at) else "-")
        if set(cells) != {"-"}:
            rows.append([curve.type, curve.motion, *cells])
    return rows


def _shares(umap: UnfoldingMap) -> str:
    motions = umap.motions()
    periodic = [motion for motion in motions if motion.kind == "periodic"]
    shown = ", ".join(f"{motion.label} {motion.share:.1%}" for motion in periodic[:LISTED])
    other = ", ".join(f"{motion.kind} {motion.share:.1%}" for motion in motions if motion.kind != "periodic")
    text = (
        f"The map has {len(periodic)} periodic motions. Those with the largest shares are {shown}. The shares of the"
        f" other points are {other}."
    )
    slow = umap.least_impact_velocity < SLOW
    mirrored = np.isin(umap.labels(), ("3-(-1)r-3l", "3-3r-(-1)l"))
    return (
        f"{text} The motion 3-(-1)r-3l of Figure 9, or its mirror image, is found at {int(mirrored.sum()) or 'none'}"
        f" of the {umap.kind.size} points. A periodic motion with an impact slower than {SLOW:g}, which could be"
        f" mistaken for a touch, is found at {int(slow.sum()) or 'none'}."
    )


def _orbits(samples: Sequence[Sample]) -> list[PeriodicOrbit]:
    """Return one orbit of each motion with several impacts, up to eight; the closed forms have those with fewer."""
    chosen: dict[str, PeriodicOrbit] = {}
    for sample in samples:
        orbit = sample.orbit
        if orbit is not None and sample.verified and 2 < len(orbit.stops) <= 8:
            chosen.setdefault(sample.label, orbit)
    return list(chosen.values())

"""Pictures, each with the code that makes it.

Computes what they show over HTTP by a stack of its own, and writes the pictures and a page with the code, index.html,
into the folder named on the command line ("out/pictures" when none is). Colours that meet in a picture and are hard to
tell apart make it fail. `make pictures` runs this.
"""

from __future__ import annotations

import html
import inspect
import itertools
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import pyplot

import grazemap
from grazemap import Client, Oscillator, engineering_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MACHINE = Oscillator(
    units="SI", masses=[0.5, 2.0], stiffnesses=[2000.0, 8000.0], damping=[1.5, 6.0], forcing=[5.0, 0.0], restitution=0.8
)
"""Two masses in SI: 0.5 kg between the stops, on a spring of 2 N/mm."""

ALIKE, ALIKE_IF_COLOUR_BLIND = 12.0, 8.0
"""Least CIEDE2000 between two colours of a picture, as most people see them and with deuteranopia."""


def grazing_curve(client: Client) -> Figure:
    """Draw the clearance at which the steady motion touches a stop, with the points where a second condition holds."""
    curve = client.grazing_curve(omega=(0.05, 1.2), points=2000)
    return curve.plot().figure


def codimension_two_points(client: Client) -> Figure:
    """Draw resonant points and recurrences on the grazing curve."""
    points = client.codimension_two_points(omega=(0.2, 0.5), max_order=6)
    return points.plot(curve=client.grazing_curve(omega=(0.2, 0.5), points=1000)).figure


def local_unfolding(client: Client) -> Figure:
    """Draw the curves that leave the grazing curve at its resonant points, to leading order."""
    return client.codimension_two_points(omega=(0.25, 0.32), max_order=4).plot_unfolding().figure


def crowded_unfolding(client: Client) -> Figure:
    """Draw the same over a range with many points."""
    return client.codimension_two_points(omega=(0.1, 1.2), max_order=8, max_multiple=4).plot_unfolding().figure


def discontinuity_mapping(client: Client) -> Figure:
    """Draw the error of the discontinuity mapping and of the map made of it, over the overshoot."""
    return client.discontinuity_mapping(omega=0.29, overshoot=np.geomspace(1e-8, 1e-2, 25)).plot().figure


def trajectory(client: Client) -> Figure:
    """Draw a motion with two impacts on either stop, from rest."""
    return client.trajectory(omega=0.29, clearance=1.6, periods=60).plot()[0].figure


def trajectories(client: Client) -> Figure:
    """Draw motions from several initial states at one place."""
    states = [{"displacement": [0.8, 0.0, 0.0], "velocity": [v, 0.0, 0.0]} for v in (-0.6, 0.0, 0.4, 0.8)]
    return client.trajectory(omega=0.285, clearance=1.92, periods=400, initial=states).plot()[0].figure


def chattering(client: Client) -> Figure:
    """Draw complete chatter and the rest on a stop after it: one mass with soft rebounds."""
    drop = Oscillator(masses=[1.0], stiffnesses=[1.0], damping=0.05, forcing=[1.0], restitution=0.5)
    return client.trajectory(drop, omega=0.3, clearance=0.4, periods=8).plot()[0].figure


def bifurcation_diagram(client: Client) -> Figure:
    """Draw the displacement once a period, over the clearance."""
    return client.bifurcation_diagram(omega=0.29, clearance=(1.3, 2.05), points=600, policy="sweep-down").plot().figure


def impact_velocities(client: Client) -> Figure:
    """Draw velocities before impacts, over the frequency."""
    diagram = client.bifurcation_diagram(omega=(0.26, 0.30), clearance=1.6, points=600)
    return diagram.plot(quantity="impact_velocity").figure


def unfolding_map(client: Client) -> Figure:
    """Draw the motions in a window of the plane, with the grazing curve and its points."""
    umap = client.unfolding_map(omega=(0.26, 0.30), clearance=(1.3, 2.05), shape=(192, 192))
    curve = client.grazing_curve(omega=(0.26, 0.30), points=200)
    points = client.codimension_two_points(omega=(0.26, 0.30), max_order=4, max_multiple=2)
    return umap.plot(curve=curve, points=points).figure


def map_with_curves(client: Client) -> Figure:
    """Draw the same window as a preview, with the curves at which motions of one impact a period begin and end."""
    window = {"omega": (0.26, 0.30), "clearance": (1.3, 2.05)}
    umap = client.unfolding_map(**window, shape=(192, 192), preview=True)
    curve = client.grazing_curve(omega=window["omega"], points=200)
    return umap.plot(curve=curve, curves=client.bifurcation_curves(**window)).figure


def unfolding_diagram(client: Client) -> Figure:
    """Draw a map around a codimension-two point, and every border explained."""
    diagram = client.unfolding_diagram(omega=(0.275, 0.29), clearance=(1.8, 2.0), shape=(128, 128), borders=True)
    return diagram.plot().figure


def computed_points(client: Client) -> Figure:
    """Draw which points of an adaptive map were computed."""
    umap = client.unfolding_map(omega=(0.275, 0.29), clearance=(1.8, 2.0), shape=(256, 256), adaptive=True)
    return umap.plot_computed().figure


def basins(client: Client) -> Figure:
    """Draw where motions lead that start in a rectangle of initial states."""
    basin_map = client.basins(
        omega=0.285,
        clearance=1.92,
        horizontal=("displacement", 1, (-1.9, 1.9)),
        vertical=("velocity", 1, (-1.0, 1.0)),
        shape=(96, 96),
    )
    return basin_map.plot().figure


def multipliers(client: Client) -> Figure:
    """Draw the Floquet multipliers of a motion with two impacts on either stop."""
    return client.periodic_orbit(omega=0.29, clearance=1.6, motion=(1, [1, 1, -1, -1])).plot().figure


def branch(client: Client) -> Figure:
    """Draw the impact speeds of that motion over the clearance, with special points."""
    return client.orbit_branch(omega=0.29, clearance=1.6, motion=(1, [1, 1, -1, -1]), range=(1.3, 1.9)).plot().figure


def branch_multipliers(client: Client) -> Figure:
    """Draw the multipliers along the same branch."""
    along = client.orbit_branch(omega=0.29, clearance=1.6, motion=(1, [1, 1, -1, -1]), range=(1.3, 1.9))
    return along.plot_multipliers().figure


def bifurcation_curves(client: Client) -> Figure:
    """Draw borders of three motions in a window of the plane."""
    three = client.periodic_orbit(omega=0.28, clearance=1.45, motion=(1, [1, 1, 1, -1, -1, -1]))
    motions = [(1, [1, -1]), (1, [1, 1, -1, -1]), three]
    return client.bifurcation_curves(omega=(0.26, 0.30), clearance=(1.3, 2.05), motions=motions).plot().figure


def unfolded_pitchfork(client: Client) -> Figure:
    """Draw branches that meet where a motion loses its symmetry, and what a small static force makes of them."""
    figure, axes = pyplot.subplots(1, 2, figsize=(13, 5), dpi=150, sharey=True, layout="constrained")
    symmetric = {"phases": [1.57, 4.71], "velocities": [0.05, -0.05]}
    sooner = {"phases": [1.37, 4.87], "velocities": [0.15, -0.03]}
    later = {"phases": [1.73, 4.52], "velocities": [0.03, -0.15]}
    cases = (
        (0.0, {"symmetric": symmetric, "mirror images": sooner}),
        (0.0036, {"turns at a saddle-node": later, "goes on": sooner}),
    )
    for ax, (force, branches) in zip(axes, cases, strict=True):
        oscillator = Oscillator(bias=[force, 0.0, 0.0])
        for (label, motion), colour in zip(branches.items(), ("#2299BB", "#FF9966"), strict=True):
            known = {"period": 1, "stops": [1, -1], **motion}
            along = client.orbit_branch(oscillator, omega=0.27, clearance=1.835, motion=known, range=(1.80, 1.86))
            along.plot(ax, colour=colour, label=label)
        ax.set(title=f"static force {force:g} on mass 1", ylim=(-0.03, 0.2))
    return figure


def machine(client: Client) -> Figure:
    """Draw a machine in SI, its map, a branch and a motion on axes of one's own, in Hz and mm."""
    window = {"omega": (30.0, 100.0), "clearance": (0.0005, 0.006)}
    umap = client.unfolding_map(MACHINE, **window, shape=(128, 128), preview=True)
    curve = client.grazing_curve(MACHINE, omega=window["omega"], points=400)
    place = {"omega": 40.0, "clearance": 0.003}
    orbit = client.periodic_orbit(MACHINE, **place)
    along = client.orbit_branch(MACHINE, **place, motion=orbit, range=window["clearance"])
    motion = client.trajectory(MACHINE, **place, periods=200)

    figure, axes = pyplot.subplots(2, 2, figsize=(13, 9), dpi=150, layout="constrained")
    umap.plot(axes[0, 0], curve=curve, motions=6, legend="outside")
    along.plot(axes[0, 1])
    motion.plot((axes[1, 0], axes[1, 1]))
    engineering_units(axes)
    return figure


def column(client: Client) -> Figure:
    """Draw a figure for a column of a journal, in the units of its request."""
    window = {"omega": ("5 Hz", "16 Hz"), "clearance": ("0.5 mm", "6 mm")}
    umap = client.unfolding_map(MACHINE, **window, shape=(128, 128), preview=True)
    curve = client.grazing_curve(MACHINE, omega=window["omega"], points=400)
    return umap.plot(curve=curve, motions=6, style="column").figure


PICTURES: tuple[Callable[[Client], Figure], ...] = (
    grazing_curve,
    codimension_two_points,
    local_unfolding,
    crowded_unfolding,
    discontinuity_mapping,
    trajectory,
    trajectories,
    chattering,
    bifurcation_diagram,
    impact_velocities,
    unfolding_map,
    map_with_curves,
    unfolding_diagram,
    computed_points,
    basins,
    multipliers,
    branch,
    branch_multipliers,
    bifurcation_curves,
    unfolded_pitchfork,
    machine,
    column,
)


def colours_of(ax: Axes) -> set[str]:
    """Return the colours #RRGGBB of the lines, symbols and regions of axes; colours on a scale are left out."""
    from matplotlib.colors import ListedColormap, to_hex

    colours: set[str] = set()
    for line in ax.lines:
        if line.get_linestyle() not in ("None", "none"):
            colours.add(to_hex(line.get_color()))
        if line.get_marker() not in ("None", None, ""):
            colours.add(to_hex(line.get_markerfacecolor()))
    for mesh in (*ax.collections, *ax.images):
        chosen = getattr(mesh, "cmap", None)
        if isinstance(chosen, ListedColormap) and chosen.N < 64:
            colours |= {to_hex(colour) for colour in chosen(range(chosen.N))}
    return {colour.upper() for colour in colours}


def least_distances(colours: set[str]) -> tuple[float, float]:
    """Return the least CIEDE2000 between two colours, as most people see them and with deuteranopia."""
    from coloraide import Color

    seen = [Color(colour) for colour in sorted(colours)]
    blind = [colour.filter("deutan", 1.0) for colour in seen]
    normal, simulated = (
        min((colour.delta_e(other, method="2000") for colour, other in itertools.combinations(view, 2)), default=np.inf)
        for view in (seen, blind)
    )
    return normal, simulated


def main(folder: Path) -> bool:
    """Make all pictures and the page; return whether the colours of each can be told apart."""
    folder.mkdir(parents=True, exist_ok=True)
    page = ["<!doctype html><meta charset=utf-8><title>grazemap: pictures</title>", "<h1>Pictures</h1>"]
    good = True
    with grazemap.local() as client:
        for number, make in enumerate(PICTURES, 1):
            figure = make(client)
            path = folder / f"{number:02}_{make.__name__}.png"
            figure.savefig(path)
            normal, blind = (
                min(values) for values in zip(*(least_distances(colours_of(ax)) for ax in figure.axes), strict=True)
            )
            apart = normal >= ALIKE and blind >= ALIKE_IF_COLOUR_BLIND
            good &= apart
            print(f"{path.name:32} least distance of colours {normal:5.1f}, {blind:5.1f} {'' if apart else 'ALIKE'}")
            pyplot.close(figure)
            code = html.escape(textwrap.dedent(inspect.getsource(make)))
            page.append(f'<h2>{html.escape(inspect.getdoc(make) or "")}</h2><img src="{path.name}" width="900">')
            page.append(f"<pre>{code}</pre>")
    (folder / "index.html").write_text("\n".join(page), encoding="utf-8")
    print(f"Written: {folder / 'index.html'}")
    return good


if __name__ == "__main__":
    sys.exit(0 if main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/pictures")) else 1)

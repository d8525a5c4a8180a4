"""The gallery of the guide: pictures, each with the code that makes it. `make pictures` runs this.

Every function below is a picture: the first line of its docstring is the title, the rest what is to be seen, and its
body the code that the gallery shows. The script runs these codes one after another with a stack of its own, and writes
docs/gallery.md and docs/pictures/gallery/. Colours that meet in a picture and are hard to tell apart make it fail, and
so does a picture that is too large.
"""

from __future__ import annotations

import ast
import inspect
import io
import itertools
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib import pyplot

import grazemap
from grazemap import Client, Oscillator
from grazemap.plots.palette import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GALLERY = Path(__file__).parents[1] / "docs" / "gallery.md"
PICTURES = GALLERY.parent / "pictures" / "gallery"

ALIKE, ALIKE_IF_COLOUR_BLIND = 12.0, 8.0
"""Least CIEDE2000 between two colours of a picture, as most people see them and with deuteranopia."""

LARGEST = 80_000
"""Bytes of a picture."""

_IMPORTS = """\
import numpy as np
from matplotlib import pyplot

import grazemap
from grazemap import Oscillator
"""
_HEAD = f"""# Gallery

Pictures of machines that hit their stops. Each code runs after these lines:

```py
{_IMPORTS}
client = grazemap.local()
```

A machine whose code has `units="SI"` is in kg, N/m, m and s. The others have no units; without an oscillator in the
code it is the three masses of [the paper](computes.md).
"""


def clearance_of_a_hammer(client: Client) -> None:
    """How far away a hammer's stop must be.

    Above the curve the steady motion is clear of the stop, below it the hammer knocks: the closer to its resonance it
    is driven, the farther away the stop must be.
    """
    hammer = Oscillator(units="SI", masses=[0.5], stiffnesses=[2000], damping=[1.5], forcing=[5], restitution=0.7)
    curve = client.grazing_curve(hammer, omega=("5 Hz", "16 Hz"), points=800, clearance={"left": None})
    ax = curve.plot(points=False, legend="none")
    frequency, gap = ax.lines[0].get_data()  # in Hz and mm
    ax.fill_between(frequency, gap, 40, color="#F9F5E1")
    ax.fill_between(frequency, 0, gap, color="#90C4F1")
    ax.text(0.04, 0.9, "clear of the stop", transform=ax.transAxes)
    ax.text(0.45, 0.1, "knocks", transform=ax.transAxes)
    ax.margins(x=0)
    ax.set(title="One mass in front of one stop", ylim=(0, 40))


def unlike_stops(client: Client) -> None:
    """Two unlike stops, and which one is touched first.

    A static force pushes the first of two masses to the right; the curve is dashed where the steady motion would touch
    the left stop, which stays at 8 mm, first.
    """
    bumper = Oscillator(
        units="SI",
        masses=[0.5, 2],
        stiffnesses=[2000, 8000],
        damping=[1.5, 6],
        forcing=[5, 0],
        bias=[2, 0],
        restitution=0.7,
    )
    curves = client.grazing_curve(bumper, omega=(30, 100), points=800, clearance={"left": 0.008})
    ax = curves.plot(points=False, engineering_units=True)
    ax.set(title="Clearance of the right stop at which it is grazed")


def rotor_that_goes_on_hitting(client: Client) -> None:
    """Why it goes on knocking.

    The steady motion of that rotor touches the stops only between the two black squares, but the motion with an impact
    on each stop is stable (solid) far beyond, until it meets an unstable one at a saddle-node (triangle).
    """
    rotor = Oscillator(
        units="SI",
        masses=[8, 40],
        stiffnesses=[2e5, 4e6],
        damping=[60, 600],
        forcing={"amplitude": [4e-4, 0], "law": "unbalance"},
        contact=[1, 2],
        restitution=0.8,
    )
    hits = (1, [1, -1])
    branch = client.orbit_branch(rotor, omega=170, clearance=0.0005, motion=hits, vary="omega", range=(100, 250))
    ax = branch.plot()
    ax.set(title="Impact speed of an unbalanced rotor, 0.5 mm from its stops")


def points_on_the_curve(client: Client) -> None:
    """Where whole families of motions meet.

    On the grazing curve of three masses: asterisks where a later return of the Poincare map loses its square root, the
    other symbols where a curve of bifurcations of impacting motions begins.
    """
    window = {"omega": (0.2, 0.4)}
    curve = client.grazing_curve(**window, points=1000)
    points = client.codimension_two_points(**window, max_order=4, max_multiple=2)
    ax = points.plot(curve=curve)
    ax.set(title="Codimension-two points of the grazing curve")


def curves_that_begin_at_grazing(client: Client) -> None:
    """How bifurcation curves leave the grazing curve.

    To leading order: saddle-node curves touch the grazing curve at its resonant points, and an arrow shows the side on
    which the motions exist.
    """
    points = client.codimension_two_points(omega=(0.25, 0.32), max_order=4)
    ax = points.plot_unfolding()
    ax.set(title="Distance from the grazing curve")


def two_impacts_on_each_stop(client: Client) -> None:
    """From rest to two impacts on each stop.

    The first of three masses settles to a motion that hits each stop twice in every period of the force.
    """
    path = client.trajectory(omega=0.29, clearance=1.6, periods=60)
    path.plot()


def impact_damper(client: Client) -> None:
    """A block that quietens a box.

    A box of 10 kg is shaken at its resonance; a block of 1 kg that knocks against its walls takes most of the motion
    away (orange: the same box with walls that the block cannot reach).
    """
    machine = {"masses": [1, 10], "stiffnesses": [10, 4000], "damping": [0.2, 8], "forcing": [0, 10]}
    box = Oscillator(units="SI", **machine, restitution=0.6, contact=[1, 2])
    ax = pyplot.figure(figsize=(9, 4), layout="constrained").add_subplot()
    for walls, colour, label in ((0.3, "#FF9900", "without impacts"), (0.02, "#0055DD", "with impacts")):
        path = client.trajectory(box, omega=20, clearance=walls, periods=60)
        ax.plot(path.time, 1000 * path.displacement[1], color=colour, linewidth=1, label=label)
    ax.set(title="Displacement of the box", xlabel="time (s)", ylabel="displacement (mm)")
    ax.margins(x=0)
    ax.legend(loc="lower right")


def chatter(client: Client) -> None:
    """Infinitely many impacts in a finite time.

    Where an impact takes half of the speed, the impacts follow each other ever faster until the mass rests on the stop,
    which it leaves when the force turns.
    """
    dull = Oscillator(masses=[1.0], stiffnesses=[1.0], damping=0.05, forcing=[1.0], restitution=0.5)
    path = client.trajectory(dull, omega=0.3, clearance=0.4, periods=2, samples_per_period=2000)
    path.plot()


def strange_attractor(client: Client) -> None:
    """A strange attractor.

    A hammer just below its resonance, seen once a period of the force: it never comes back to the same place and speed,
    and yet stays on thin leaves.
    """
    hammer = Oscillator(units="SI", masses=[0.5], stiffnesses=[2000], damping=[1.5], forcing=[5], restitution=0.7)
    once = {"periods": 20000, "samples_per_period": 1, "transient_periods": 200}
    path = client.trajectory(hammer, omega=60, clearance={"right": 0.016}, **once)
    ax = pyplot.figure(figsize=(9, 5), layout="constrained").add_subplot()
    ax.plot(1000 * path.displacement[0], path.velocity[0], ".", markersize=1, color="#0055DD")
    ax.set(title="Hammer at phase 0 of the force", xlabel="displacement (mm)", ylabel="velocity (m/s)")


def two_motions_at_one_place(client: Client) -> None:
    """Two motions of one machine.

    The same three masses, the same force, the same stops: the start decides which of two motions follows. They
    are mirror images of each other.
    """
    states = [{"displacement": [0.8, 0.0, 0.0], "velocity": [v, 0.0, 0.0]} for v in (-0.6, 0.0, 0.4, 0.8)]
    paths = client.trajectory(omega=0.285, clearance=1.92, periods=400, initial=states)
    paths.plot()


def run_up_and_run_down(client: Client) -> None:
    """Run up, run down.

    An unbalanced rotor between stops, slowly run up and down: run up, it begins to knock in its resonance, goes on, and
    stops far above; run down, it knocks in the resonance only.
    """
    rotor = Oscillator(
        units="SI",
        masses=[8, 40],
        stiffnesses=[2e5, 4e6],
        damping=[60, 600],
        forcing={"amplitude": [4e-4, 0], "law": "unbalance"},
        contact=[1, 2],
        restitution=0.8,
    )
    ax = pyplot.figure(figsize=(9, 4), layout="constrained").add_subplot()
    for policy, colour in (("sweep-up", "#0055DD"), ("sweep-down", "#FF9900")):
        diagram = client.bifurcation_diagram(
            rotor, omega=(130, 260), clearance=0.0005, points=261, policy=policy, observables=["dissipated_power"]
        )
        ax.plot(diagram.parameter * 60 / (2 * np.pi), diagram.dissipated_power, ".", color=colour, label=policy)
    ax.set(title="Power that the impacts take", xlabel="speed (rpm)", ylabel="power (W)")
    ax.legend()


def over_the_clearance(client: Client) -> None:
    """From quiet to chaos as the stops come closer.

    Where the first mass is once a period, from a wide clearance to a narrow one: impacts begin at 1.98, and the motion
    with one impact on each stop gives way to those with two and three, and to chaos.
    """
    diagram = client.bifurcation_diagram(omega=0.29, clearance=(1.3, 2.05), points=600, policy="sweep-down")
    ax = diagram.plot()
    ax.set(title="Stops that come closer")


def over_the_frequency(client: Client) -> None:
    """How hard it hits.

    The speeds of all impacts on the right stop (above) and on the left one (below) as the frequency varies.
    """
    diagram = client.bifurcation_diagram(omega=(0.26, 0.30), clearance=1.6, points=600)
    ax = diagram.plot(quantity="impact_velocity")
    ax.set(title="Velocities before impacts")


def branch_of_a_motion(client: Client) -> None:
    """The life of a motion.

    The motion with two impacts on each stop ends at a saddle-node (triangle), where it meets its unstable counterpart,
    and on the other side at a graze (square), where a further contact appears.
    """
    branch = client.orbit_branch(omega=0.29, clearance=1.6, motion=(1, [1, 1, -1, -1]), range=(1.3, 1.9))
    ax = branch.plot()
    ax.set(title="Impact speeds of 1-2r-2l", ylim=(-0.02, 0.35))


def multipliers(client: Client) -> None:
    """How a motion loses its stability.

    The Floquet multipliers along the same branch: it is stable while all are inside of the circle.
    """
    branch = client.orbit_branch(omega=0.29, clearance=1.6, motion=(1, [1, 1, -1, -1]), range=(1.53, 1.69))
    ax = branch.plot_multipliers()
    ax.set_adjustable("box")
    ax.set(title="Multipliers of 1-2r-2l", xlim=(-1.5, 1.5), ylim=(-1.2, 1.2))


def broken_symmetry(client: Client) -> None:
    """A small force breaks a symmetry.

    Left, a symmetric motion loses its stability to two mirror images; right, a static force of 0.36 % of the driving
    force leaves one branch whole and makes a saddle-node of the other.
    """
    symmetric = {"phases": [1.57, 4.71], "velocities": [0.05, -0.05]}
    sooner = {"phases": [1.37, 4.87], "velocities": [0.15, -0.03]}
    later = {"phases": [1.73, 4.52], "velocities": [0.03, -0.15]}
    axes = pyplot.figure(figsize=(9, 4), layout="constrained").subplots(1, 2, sharey=True)
    for ax, force, first, second in ((axes[0], 0.0, symmetric, sooner), (axes[1], 0.0036, later, sooner)):
        machine = Oscillator(bias=[force, 0.0, 0.0])
        for motion, colour in ((first, "#2299BB"), (second, "#FF9966")):
            known = {"period": 1, "stops": [1, -1], **motion}
            branch = client.orbit_branch(machine, omega=0.27, clearance=1.835, motion=known, range=(1.80, 1.86))
            branch.plot(ax, colour=colour, legend="none")
        ax.set(title=f"static force {force:g}", ylim=(0, 0.16))


def three_floors(client: Client) -> None:
    """Three floors on a shaken base.

    The rhythm in which the top floor knocks against its stops. Above the curve the steady motion is clear of them; yet
    to the right of the resonance the floor that starts from rest knocks far above the curve too.
    """
    rack = Oscillator(
        units="SI",
        masses=[2, 3, 3],
        stiffnesses=[3000, 6000, 6000],
        damping=[2, 4, 4],
        base={"amplitude": 0.002, "stops_move": True},
        restitution=0.7,
    )
    window = {"omega": (18, 30), "clearance": (0.004, 0.03)}
    umap = client.unfolding_map(rack, **window, shape=(96, 96))
    curve = client.grazing_curve(rack, omega=window["omega"], points=400)
    ax = umap.plot(curve=curve, motions=6, engineering_units=True)
    ax.set(title="Motions of a rack on a shaken base")


def power_of_the_impacts(client: Client) -> None:
    """Where the impacts take the most power.

    The energy that the same rack loses in its stops per second: most not in the resonance at 3.4 Hz, but above it, just
    before the knocking dies out (grey: no motion was identified).
    """
    rack = Oscillator(
        units="SI",
        masses=[2, 3, 3],
        stiffnesses=[3000, 6000, 6000],
        damping=[2, 4, 4],
        base={"amplitude": 0.002, "stops_move": True},
        restitution=0.7,
    )
    window = {"omega": (18, 30), "clearance": (0.004, 0.03)}
    umap = client.unfolding_map(rack, **window, shape=(96, 96), observables=["dissipated_power"])
    ax = umap.plot("dissipated_power", engineering_units=True)
    ax.set(title="Power that the impacts take")


def map_of_motions(client: Client) -> None:
    """A map of all motions.

    Three masses between two stops: each colour is a rhythm of impacts, black is chaos, and the symbols on the grazing
    curve are points at which families of motions begin.
    """
    window = {"omega": (0.26, 0.30)}
    umap = client.unfolding_map(**window, clearance=(1.3, 2.05), shape=(160, 160))
    curve = client.grazing_curve(**window, points=200)
    points = client.codimension_two_points(**window, max_order=4, max_multiple=2)
    ax = umap.plot(curve=curve, points=points, motions=8)
    ax.set(title="Motions from rest")


def chaos_and_order(client: Client) -> None:
    """How fast neighbours part.

    The largest Lyapunov exponent in the lower part of that map: where it is positive (red) two trajectories that begin
    side by side part, and the motion is chaotic; the darkest blue is the most stable motion.
    """
    umap = client.unfolding_map(omega=(0.28, 0.30), clearance=(1.3, 1.55), shape=(128, 128))
    ax = pyplot.figure(figsize=(9, 5), layout="constrained").add_subplot()
    mesh = ax.pcolormesh(umap.omega, umap.clearance, umap.lyapunov, cmap="RdBu_r", vmin=-1, vmax=1)
    pyplot.colorbar(mesh, label="Lyapunov exponent per period", extend="min")
    ax.set(title="Order and chaos", xlabel="forcing frequency", ylabel="clearance")


def borders_explained(client: Client) -> None:
    """Why one motion ends and the next begins.

    Around a codimension-two point, the bifurcation curves at which the regions end: saddle-nodes, period doublings,
    grazes, broken symmetries, and the edges of basins of attraction.
    """
    diagram = client.unfolding_diagram(omega=(0.275, 0.29), clearance=(1.82, 1.99), shape=(96, 96), borders=True)
    ax = diagram.plot()
    ax.set(title="Regions and their borders")


def one_motion_and_its_borders(client: Client) -> None:
    """Where motions with one impact live.

    All curves at which motions with one impact on a stop begin or end, over the map of what a machine does from rest.
    """
    window = {"omega": (0.26, 0.30), "clearance": (1.6, 2.05)}
    umap = client.unfolding_map(**window, shape=(128, 128), preview=True)
    ax = umap.plot(curves=client.bifurcation_curves(**window), motions=6)
    ax.set(title="Bifurcation curves of motions with one impact on a stop")


def softer_stops(client: Client) -> None:
    """How lively the rebounds are.

    Three masses with a clearance of 1.8, over the coefficient of restitution: the less energy an impact takes, the more
    motions there are.
    """
    umap = client.unfolding_map(
        horizontal=("omega", 0.24, 0.36),
        vertical=("restitution", 0.3, 0.95),
        clearance=1.8,
        shape=(96, 96),
        preview=True,
    )
    ax = umap.plot(motions=8)
    ax.set(title="Motions over frequency and restitution")


def ensemble(client: Client) -> None:
    """Where the start decides.

    The rack once more, from ten random starts at each point: where the share of the most frequent motion is below 1,
    motions coexist, and no single start shows them all.
    """
    rack = Oscillator(
        units="SI",
        masses=[2, 3, 3],
        stiffnesses=[3000, 6000, 6000],
        damping=[2, 4, 4],
        base={"amplitude": 0.002, "stops_move": True},
        restitution=0.7,
    )
    window = {"omega": (18, 30), "clearance": (0.004, 0.03)}
    umap = client.unfolding_map(rack, **window, shape=(64, 64), policy="ensemble", initial_conditions=10, preview=True)
    ax = pyplot.figure(figsize=(9, 5), layout="constrained").add_subplot()
    mesh = ax.pcolormesh(umap.omega / (2 * np.pi), 1000 * umap.clearance, umap.share, cmap="viridis", vmin=0, vmax=1)
    pyplot.colorbar(mesh, label="share of the most frequent motion")
    ax.set(title="Ten random starts at each point", xlabel="forcing frequency (Hz)", ylabel="clearance (mm)")


def basins(client: Client) -> None:
    """Which start leads where.

    Each point is a place and a speed of the first mass at the start; its colour is the motion to which it
    leads.
    """
    result = client.basins(
        omega=0.285,
        clearance=1.92,
        horizontal=("displacement", 1, (-1.9, 1.9)),
        vertical=("velocity", 1, (-1.0, 1.0)),
        shape=(256, 256),
    )
    ax = result.plot()
    ax.set(title="Basins of attraction")


def shares_of_basins(client: Client) -> None:
    """How likely each motion is.

    The share of 100 random starts that leads to each motion, as the clearance varies.
    """
    fractions = client.basin_fractions(vary="clearance", range=(1.7, 2.05), points=71, omega=0.29, states=100)
    ax = fractions.plot()
    ax.set(title="Shares of random starts")


def square_root_of_a_graze(client: Client) -> None:
    """What a graze does to a trajectory.

    A trajectory that reaches beyond the stop by a little is displaced by its square root (dotted): a graze magnifies.
    The two lines are the errors of two formulas for it, of first and second order.
    """
    mapping = client.discontinuity_mapping(omega=0.29, overshoot=np.geomspace(1e-8, 1e-2, 25))
    ax = mapping.plot()
    ax.set(title="Discontinuity mapping at a graze")


def proven_motion(client: Client) -> None:
    """A motion that is proven.

    One period of a motion that exists and attracts the trajectory from rest, for certain: a proof in ball arithmetic
    encloses the time of each impact in an interval far smaller than the digits that are shown.
    """
    place = {"omega": 0.29, "clearance": 1.6}
    proof = client.prove(statement={"kind": "attraction", **place})
    orbit = client.periodic_orbit(**place)
    path = client.trajectory(**place, initial=orbit.start, periods=1, samples_per_period=1000)
    ax = pyplot.figure(figsize=(9, 4), layout="constrained").add_subplot()
    ax.plot(path.time - path.time[0], path.displacement[0], color="#0055DD")
    for number, enclosure in enumerate(proof.enclosures["times"]):
        ax.text(0.5, 0.9 - 0.08 * number, f"impact at {enclosure[1:32]}..", transform=ax.transAxes, family="monospace")
    ax.margins(x=0)
    ax.set(title=f"1-2r-2l: {proof.verdict}", xlabel="time", ylabel="displacement of mass 1")


SECTIONS: dict[str, tuple[Callable[[Client], None], ...]] = {
    "Maps": (
        three_floors,
        power_of_the_impacts,
        map_of_motions,
        chaos_and_order,
        borders_explained,
        one_motion_and_its_borders,
        softer_stops,
    ),
    "Motions": (
        two_impacts_on_each_stop,
        impact_damper,
        chatter,
        two_motions_at_one_place,
        strange_attractor,
        proven_motion,
    ),
    "When one number varies": (
        run_up_and_run_down,
        rotor_that_goes_on_hitting,
        over_the_clearance,
        over_the_frequency,
        branch_of_a_motion,
        multipliers,
        broken_symmetry,
    ),
    "Starts": (
        basins,
        shares_of_basins,
        ensemble,
    ),
    "Where contact begins": (
        clearance_of_a_hammer,
        unlike_stops,
        points_on_the_curve,
        curves_that_begin_at_grazing,
        square_root_of_a_graze,
    ),
}


class Entry(NamedTuple):
    """A picture of the gallery, as the page has it."""

    name: str
    title: str
    sentence: str
    code: str

    @property
    def markdown(self) -> str:
        """The section of the page."""
        return f"""
### {self.title}

{textwrap.fill(self.sentence, 120)}

![{self.title}](pictures/gallery/{self.name}.png)

<details>
<summary>Code</summary>

```py
{self.code}
```

</details>
"""


def entry(make: Callable[[Client], None]) -> Entry:
    """Return what the gallery has of the function of a picture."""
    source = textwrap.dedent(inspect.getsource(make))
    (function,) = ast.parse(source).body
    assert isinstance(function, ast.FunctionDef)
    lines = source.splitlines()[function.body[1].lineno - 1 :]
    title, _, sentence = (inspect.getdoc(make) or "").partition("\n\n")
    return Entry(make.__name__, title.removesuffix("."), " ".join(sentence.split()), textwrap.dedent("\n".join(lines)))


def page() -> str:
    """Return the gallery."""
    sections = (
        f"\n## {title}\n" + "".join(entry(make).markdown for make in pictures) for title, pictures in SECTIONS.items()
    )
    return _HEAD + "".join(sections)


def drawn(picture: Entry, client: Client) -> Figure:
    """Run the code of a picture as the page has it, and return its figure."""
    names: dict[str, Any] = {"client": client}
    exec(_IMPORTS + picture.code, names)
    return pyplot.gcf()


def saved(figure: Figure) -> bytes:
    """Return a figure as PNG with the few colours that it has."""
    from PIL import Image

    every, few = io.BytesIO(), io.BytesIO()
    figure.savefig(every, dpi=100)
    image = Image.open(every).convert("RGB").quantize(128, dither=Image.Dither.NONE)
    image.save(few, "png", optimize=True)
    return few.getvalue()


def colours_of(ax: Axes) -> tuple[set[str], set[str]]:
    """Return the colours #RRGGBB of the regions of axes, and those of its lines and symbols, which have a rim there.

    Colours on a scale are left out, and so are the strokes of ink that mark sensitive points. In a legend a square with
    a rim of ink stands for a region, any other square for a bifurcation.
    """
    from matplotlib.colors import ListedColormap, to_hex

    ink = INK.lower()
    regions: set[str] = set()
    lines: set[str] = set()
    for line in ax.lines:
        if line.get_linestyle() not in ("None", "none"):
            lines.add(to_hex(line.get_color()))
        if line.get_marker() not in ("None", None, ""):
            is_region = line.get_marker() == "s" and to_hex(line.get_markeredgecolor()) == ink
            (regions if is_region else lines).add(to_hex(line.get_markerfacecolor()))
    for mesh in (*ax.collections, *ax.images):
        chosen = getattr(mesh, "cmap", None)
        if isinstance(chosen, ListedColormap) and chosen.N < 64:
            regions |= {to_hex(colour) for colour in chosen(range(chosen.N))} - {ink}
    return {colour.upper() for colour in regions}, {colour.upper() for colour in lines}


def least_distances(*groups: set[str]) -> tuple[float, float]:
    """Return the least CIEDE2000 between two colours of a group, as most people see them and with deuteranopia."""
    from coloraide import Color

    normal, simulated = [], []
    for colours in groups:
        seen = [Color(colour) for colour in sorted(colours)]
        blind = [colour.filter("deutan", 1.0) for colour in seen]
        for view, least in ((seen, normal), (blind, simulated)):
            least += [colour.delta_e(other, method="2000") for colour, other in itertools.combinations(view, 2)]
    return min(normal, default=np.inf), min(simulated, default=np.inf)


def main() -> bool:
    """Make all pictures and the page; return whether each is small and its colours can be told apart."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    entries = [entry(make) for pictures in SECTIONS.values() for make in pictures]
    for path in PICTURES.glob("*.png"):
        if path.stem not in {picture.name for picture in entries}:
            path.unlink()
    good = True
    with grazemap.local() as client:
        for picture in entries:
            figure = drawn(picture, client)
            image = saved(figure)
            (PICTURES / f"{picture.name}.png").write_bytes(image)
            normal, blind = (
                min(values) for values in zip(*(least_distances(*colours_of(ax)) for ax in figure.axes), strict=True)
            )
            apart = normal >= ALIKE and blind >= ALIKE_IF_COLOUR_BLIND
            good &= apart and len(image) <= LARGEST
            remarks = "" if apart else " ALIKE", "" if len(image) <= LARGEST else " LARGE"
            print(
                f"{picture.name:32} {len(image):6} bytes, least distance of colours {normal:5.1f}, {blind:5.1f}",
                *remarks,
            )
            pyplot.close(figure)
    GALLERY.write_text(page(), encoding="utf-8")
    print(f"Written: {GALLERY}")
    return good


if __name__ == "__main__":
    sys.exit(0 if main() else 1)

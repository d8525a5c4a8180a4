"""Figures 2, 3 and 6: the grazing curve, and motions that just touch both stops."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap import Client, GrazingCurve, Trajectory
from paper.page import Section, below, logarithmic
from paper.paper import (
    GAMMA,
    GRAZING_CLEARANCE,
    GRAZING_OMEGA,
    POINT_CLEARANCE,
    POINT_OMEGA,
    READINGS,
)
from paper.states import FAR, TURN, closest, graze, initial

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVE = (0.05, 1.2)
TABLE = [0.1, 0.2, 0.28109, 0.3, 0.4, 0.6, 0.8, 1.0, 1.2]
TRANSIENT = 3000


def figure_2(client: Client) -> Section:
    """Return the grazing curve in both readings of zeta."""
    section = Section("Figure 2: the grazing curve")
    curves = {name: client.grazing_curve(chain, omega=CURVE, points=2000) for name, chain in READINGS.items()}
    section.say(
        "The figure shows the clearance at which the steady motion touches both stops, b = A(omega), equations"
        " (16)-(19). The text gives neither numbers of this figure nor the range of its axes. The paper's zeta_i ="
        " 0.05 can be read in two ways: as gamma = 0.05 of proportional damping, which fits its equations (5)-(7) and"
        " is the default of grazemap, or as one damping per link, as the matrix of (3) is printed."
    )
    section.draw("figure_2.png", "The grazing curve in both readings of zeta", lambda: _both(curves))
    values = {
        name: client.grazing_curve(chain, omega=TABLE, progress=False).clearance for name, chain in READINGS.items()
    }
    section.show(
        ["omega", *(f"A(omega), {name}" for name in READINGS)],
        [[f"{omega:g}", *(f"{values[name][k]:.12f}" for name in READINGS)] for k, omega in enumerate(TABLE)],
    )
    peaks = []
    for name, curve in curves.items():
        k = int(np.argmax(curve.clearance))
        peaks.append(f"{curve.clearance[k]:.1f} at omega = {curve.omega[k]:.3f} with {name}")
    section.say(
        f"The highest peak is {' and '.join(peaks)}. So the peak of the printed picture shows which reading was drawn."
    )
    return section


def figure_3(client: Client) -> Section:
    """Return the double grazing motion at omega = 0.1: on the computed clearance, and on the printed one."""
    section = Section(f"Figure 3: the double grazing motion at omega = {GRAZING_OMEGA:g}")
    printed = GRAZING_CLEARANCE
    rows, inside = [], {}
    for name, chain in READINGS.items():
        point = graze(client, chain, GRAZING_OMEGA)
        section.compare(printed, name, point.clearance, 12, "not on the curve, see Figure 3")
        start, clearance = initial(point.grazing.state), printed.value
        peak = client.trajectory(
            chain, omega=GRAZING_OMEGA, clearance=FAR, periods=1, transient_periods=TRANSIENT,
            times=[point.grazing.state[-1] % TURN / GRAZING_OMEGA], progress=False,
        )  # fmt: skip
        steady = client.trajectory(
            chain, omega=GRAZING_OMEGA, clearance=clearance, initial=start, periods=4, progress=False
        )
        settled = client.trajectory(
            chain, omega=GRAZING_OMEGA, clearance=clearance, periods=4, transient_periods=TRANSIENT, progress=False
        )
        inside[name] = closest(steady)
        rows.append(
            [
                name,
                f"{point.clearance:.12f}",
                below(float(peak.displacement[0, 0]) - point.clearance),
                f"{inside[name]:.3e}" + ("" if not len(steady.impacts) else " (hits)"),
                _motion(settled),
                f"{_fastest(settled):.6f}" if len(settled.impacts) else "-",
            ]
        )
    section.say(
        f"The paper simulates (3), (4) with b = {printed.text} and shows a motion that touches both stops with zero"
        f" velocity. The table has A({GRAZING_OMEGA:g}) in closed form, and the difference between it and the largest"
        f" displacement in a simulation without stops, which starts at rest {TRANSIENT} periods before. The other"
        " columns are for simulations at the printed clearance: the distance of the steady motion from the stops, the"
        f" motion to which a trajectory from rest settles within {TRANSIENT} periods, and the speed of its impacts."
    )
    section.show(
        ["damping", "closed form", "simulated, within", "steady motion stays inside by", "from rest", "impact speed"],
        rows,
    )
    hitting = [row for row in rows if row[-1] != "-"]
    for row in hitting:
        section.say(
            f"With {row[0]} and b = {printed.text} the trajectory from rest settles to a motion {row[4]} that exists"
            f" beside the steady one. It hits both stops in every period, at a speed of {row[5]}, whereas the largest"
            " velocity is of the order of omega b. In a phase portrait this motion looks like a graze too."
        )
    chain = READINGS[GAMMA]
    point = graze(client, chain, GRAZING_OMEGA)
    path = client.trajectory(
        chain, omega=GRAZING_OMEGA, clearance=point.clearance, initial=initial(point.grazing.state), periods=2,
        samples_per_period=1000, progress=False,
    )  # fmt: skip
    grazes = int(np.sum(path.impacts.kind == "graze"))
    back = float(np.max(np.abs(path.displacement[:, ::1000] - path.displacement[:, :1])))
    section.say(
        "The simulation at the computed clearance, with its certified search for contacts, starts at the graze at stop"
        f" A. It meets the stops {len(path.impacts)} times in 2 periods; {grazes} of these contacts are grazes within"
        f" round-off, at velocities below {below(_fastest(path))}. After each period the displacements return to their"
        f" first values to within {below(back)}, so this is the double grazing motion of period 1. At the printed"
        f" clearance the motion misses the stops by {inside[GAMMA]:.0e}, which cannot be seen in a picture."
    )
    section.draw(
        "figure_3.png",
        "The double grazing motion at omega = 0.1",
        lambda: _titled(path, "Figure 3: double grazing motion"),
    )
    return section


def figure_6(client: Client, computed: dict[str, tuple[float, float]]) -> Section:
    """Return the motion at the printed codimension-two point, and at the computed ones.

    Parameters
    ----------
    client : Client
    computed : dict
        From readings to omega and clearance of the computed point.
    """
    section = Section("Figure 6: the grazing trajectory at the codimension-two point")
    section.say(
        f"The paper simulates with omega = {POINT_OMEGA.text}, b = {POINT_CLEARANCE.text} and shows a motion of mass 1"
        " that grazes. The table has simulations at the printed numbers and at the computed points, in both readings of"
        " zeta. A simulation that starts on the steady motion starts at its maximum displacement at stop A. Where b - A"
        " is negative this is beyond the stop, and mass 1 starts on the stop instead. Simulations from rest are"
        f" recorded after {TRANSIENT} periods."
    )
    rows, paths = [], {}
    for name, chain in READINGS.items():
        places = [("printed", POINT_OMEGA.value, POINT_CLEARANCE.value), ("computed", *computed[name])]
        for label, omega, clearance in places:
            point = graze(client, chain, omega)
            state = point.grazing.state.copy()
            state[0] = min(state[0], clearance)
            for start in ("steady", "rest"):
                path = client.trajectory(
                    chain, omega=omega, clearance=clearance, initial=initial(state) if start == "steady" else None,
                    periods=4, transient_periods=0 if start == "steady" else TRANSIENT, samples_per_period=1000,
                    progress=False,
                )  # fmt: skip
                paths[name, label, start] = path
                inside = clearance - point.clearance
                rows.append(
                    [
                        name,
                        label,
                        f"{omega:.12g}",
                        f"{clearance:.13g}",
                        "0" if abs(inside) < 1e-15 else f"{inside:.2e}",
                        start,
                        _contacts(path),
                        _motion(path),
                    ]
                )
    section.show(
        ["damping", "point", "omega", "b", "b - A(omega)", "start", "contacts in 4 periods", "motion"],
        rows,
    )
    section.say(
        "A motion whose contacts are all grazes within round-off is left unresolved by grazemap. Trajectories from rest"
        " do not settle to such a motion: at these points the graze recurs, and they settle to motions with impacts."
    )
    section.draw(
        "figure_6.png",
        "Mass 1 at the computed point, on the grazing trajectory",
        lambda: _titled(paths[GAMMA, "computed", "steady"], "Figure 6: grazing motion at the computed point"),
    )
    section.draw(
        "figure_6_printed.png",
        "Mass 1 at the printed omega and b, from rest",
        lambda: _titled(paths[GAMMA, "printed", "rest"], "Figure 6: from rest at the printed point"),
    )
    return section


def _both(curves: dict[str, GrazingCurve]) -> Axes:
    from matplotlib.ticker import MultipleLocator

    from grazemap.plots.axes import drawing

    place = drawing(None, "inside", labels=True, width=10.0, height=4.6)
    ax = place.ax
    for (name, curve), colour, style in zip(curves.items(), ("#222222", "#D55E00"), ("-", "--"), strict=True):
        ax.plot(curve.omega, curve.clearance, style, color=colour, linewidth=1.4, label=name)
    place.describe_plane("nondimensional", "Figure 2: grazing curve $b = A(\\omega)$")
    ax.xaxis.set_major_locator(MultipleLocator(0.1))
    ax.margins(x=0.01)
    logarithmic(ax)
    ax.legend(frameon=False)
    return ax


def _titled(path: Trajectory, text: str) -> Axes:
    history, _ = path.plot()
    figure = history.get_figure(root=True)
    assert figure is not None
    request = path.meta["request"]
    where = rf"$\omega$ = {request['omega']:.6g}, $b$ = {request['clearance']:.6f}"
    figure.suptitle(f"{text}, {where}", fontsize=10)
    return history


def _motion(path: Trajectory) -> str:
    return path.motion.label or path.motion.kind


def _fastest(path: Trajectory) -> float:
    return float(np.max(np.abs(path.impacts.velocity)))


def _contacts(path: Trajectory) -> str:
    """Say how many contacts there are on each stop, and how fast they are."""
    if not len(path.impacts):
        return "none"
    right, left = int(np.sum(path.impacts.stop == 1)), int(np.sum(path.impacts.stop == -1))
    fastest = _fastest(path)
    speed = f"speed up to {fastest:.4f}" if fastest > 1e-6 else f"grazes, speed below {below(fastest)}"
    return f"{right} on A, {left} on C; {speed}"

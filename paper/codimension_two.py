"""Figures 5 and 7: the points of the grazing curve where xi_1 and xi_2 vanish."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from grazemap import Client, CodimensionTwoPoints, GrazingCurve
from grazemap.results import CodimensionTwoPoint
from paper.page import Section, logarithmic
from paper.paper import GAMMA, PER_LINK, POINT_CLEARANCE, POINT_OMEGA, READINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CURVE, ALL = (0.1, 1.2), (0.05, 100.0)
NEAR = (0.2795, 0.2835)
LISTED = 0.15


def points_of(client: Client, name: str, max_order: int = 4) -> CodimensionTwoPoints:
    """Return all points of a reading, up to frequencies above which there are none."""
    return client.codimension_two_points(READINGS[name], omega=ALL, max_order=max_order, max_multiple=1, progress=False)


def of_order(points: CodimensionTwoPoints, order: int) -> list[CodimensionTwoPoint]:
    """Return the recurrence points of an order."""
    return [point for point in points.points if point.order == order]


def nearest(points: CodimensionTwoPoints, order: int) -> CodimensionTwoPoint:
    """Return the point of an order that is nearest to the printed one in omega."""
    return min(of_order(points, order), key=lambda point: abs(point.omega - POINT_OMEGA.value))


def computed_points(client: Client) -> dict[str, tuple[float, float]]:
    """Return omega and clearance of the point with xi_1 = 0 next to the printed one, for each reading."""
    points = {name: nearest(points_of(client, name), 2) for name in READINGS}
    return {name: (point.omega, point.clearance) for name, point in points.items()}


def figure_5(client: Client) -> Section:
    """Return the points with xi_1 = 0, and the printed one beside the computed ones."""
    section = Section("Figure 5: points with xi_1 = 0")
    section.say(
        "After a graze of stop A the overshoot m half periods later is proportional to xi_m = -(1 + R) a_1* g(m T/2),"
        " where g is the displacement of mass 1 after a unit velocity of mass 1, Phi_12 of the paper. The paper takes"
        " xi_n = -(R + 1) a_1* Phi_12^n, from A back to A after n periods. So m = 2n, and for n = 1 the points of"
        " Figure 5 are at omega = 2 pi/s_k, where s_k are the zeros of g. The list is complete, because intervals are"
        " bisected until a bound decides on each of them. The points accumulate as omega decreases, which may be what"
        " the paper calls an increased tangency with the curve."
    )
    points = {name: points_of(client, name) for name in READINGS}
    curves = {name: client.grazing_curve(chain, omega=CURVE, points=4000) for name, chain in READINGS.items()}
    section.draw("figure_5.png", "Points with xi_1 = 0 on the grazing curve", lambda: _all(curves[GAMMA], points, 1))
    _list(section, points, 1)
    section.draw("figure_5_detail.png", "The printed point and the computed ones", lambda: _detail(client, points))
    section.say(
        f"The paper names one of the points: omega = {POINT_OMEGA.text}, b = {POINT_CLEARANCE.text}. The table has the"
        " computed point, the clearance that the paper's formula (19) gives at the printed omega, the omega at which"
        " the curve has the printed clearance, and xi_2 at the printed omega:"
    )
    _printed_point(client, section, points)
    return section


def figure_7(client: Client) -> Section:
    """Return the points with xi_2 = 0."""
    section = Section("Figure 7: points with xi_2 = 0")
    section.say(
        "These are the points of Figure 5 for n = 2 and m = 4, two periods after the graze, at omega = 4 pi/s_k. The"
        " text names none of them."
    )
    points = {name: points_of(client, name) for name in READINGS}
    curve = client.grazing_curve(READINGS[GAMMA], omega=CURVE, points=4000)
    section.draw("figure_7.png", "Points with xi_2 = 0 on the grazing curve", lambda: _all(curve, points, 2))
    _list(section, points, 2)
    return section


def _list(section: Section, points: dict[str, CodimensionTwoPoints], n: int) -> None:
    """List the points above LISTED, and say how the rest crowds."""
    for name in READINGS:
        chosen = of_order(points[name], 2 * n)
        shown = [point for point in chosen if point.omega >= LISTED]
        active = sum(bool(point.active) for point in chosen)
        section.say(
            f"**{name}.** There are {len(chosen)} points between omega = {ALL[0]:g} and {ALL[1]:g}. {active} of them"
            f" are active; at the others a smaller order recurs already. The table has those above {LISTED:g}, active"
            " ones in bold:"
        )
        texts = [f"{point.omega:.9f}, {point.clearance:.9f}" for point in shown]
        texts = [f"**{text}**" if point.active else text for text, point in zip(texts, shown, strict=True)]
        section.show(["omega, b", "", ""], [[*texts[k : k + 3], "", ""][:3] for k in range(0, len(texts), 3)])


def _printed_point(client: Client, section: Section, points: dict[str, CodimensionTwoPoints]) -> None:
    rows = []
    for name, chain in READINGS.items():
        point = nearest(points[name], 2)
        # a curve has at least two values of omega
        omega = (
            [POINT_OMEGA.value, point.omega] if point.omega > POINT_OMEGA.value else [point.omega, POINT_OMEGA.value]
        )
        curve = client.grazing_curve(chain, omega=omega, max_order=2, sequence=True, progress=False)
        at = omega.index(POINT_OMEGA.value)
        assert curve.xi is not None
        rows.append(
            [
                name,
                f"{point.omega:.12f}",
                f"{point.clearance:.12f}",
                f"{curve.clearance[at]:.12f}",
                f"{_omega_at(client, name, POINT_CLEARANCE.value):.9f}",
                f"{curve.xi[at, 1]:.6f}",
            ]
        )
        section.compare(POINT_OMEGA, name, point.omega, 12, "see Figure 5")
        section.compare(POINT_CLEARANCE, name, point.clearance, 12, "see Figure 5")
    section.show(
        [
            "damping",
            "omega of the point",
            "b of the point",
            f"A({POINT_OMEGA.text})",
            f"omega where A = {POINT_CLEARANCE.text}",
            f"xi_2 at {POINT_OMEGA.text}",
        ],
        rows,
    )
    ours = {name: nearest(points[name], 2) for name in READINGS}
    agreeing = [name for name in READINGS if POINT_CLEARANCE.agrees(ours[name].clearance)]
    for name in agreeing:
        other = [reading for reading in READINGS if reading != name]
        section.say(
            f"With {name} the clearance of the point agrees with the printed one, and the printed omega is off by"
            f" {POINT_OMEGA.value - ours[name].omega:.2e}. With {other[0]} neither agrees: omega is off by"
            f" {POINT_OMEGA.value - ours[other[0]].omega:.2e} and b by"
            f" {POINT_CLEARANCE.value - ours[other[0]].clearance:.2e}, although the printed pair is close to the curve."
            " No reading gives both numbers, and on neither curve is the printed pair a point with xi_1 = 0."
        )
    families = ", ".join(f"case {family.case} with n = {family.n}" for family in ours[GAMMA].families)
    others = []
    for order in (1, 3):
        point = nearest(points[GAMMA], order)
        cases = " and ".join(f"case {family.case} with n = {family.n}" for family in point.families)
        others.append(f"m = {order} ({cases}) at omega = {point.omega:.9f}, b = {point.clearance:.9f}")
    section.say(
        '**Which case.** Section 5 says that it takes "the second case". In the order of (42) the computed point is'
        f" {families}, so the formula of Section 5 is the first case. Cases 2 and 3 have odd m, and their points"
        f" nearest to the printed omega are far from it: {'; '.join(others)}."
    )


def _omega_at(client: Client, name: str, clearance: float) -> float:
    """Return the omega near the printed one at which the grazing curve has a clearance, by the secant method."""
    low, high = POINT_OMEGA.value - 1e-3, POINT_OMEGA.value + 1e-3
    for _ in range(6):
        two = client.grazing_curve(READINGS[name], omega=[low, high], progress=False)
        slope = (two.clearance[1] - two.clearance[0]) / (high - low)
        middle = low + (clearance - two.clearance[0]) / slope
        low, high = middle - 1e-7, middle + 1e-7
    return float(middle)


def _all(curve: GrazingCurve, points: dict[str, CodimensionTwoPoints], n: int) -> Axes:
    figure = 5 if n == 1 else 7
    from grazemap.plots.axes import axes_or_new

    chosen = replace(points[GAMMA], points=tuple(of_order(points[GAMMA], 2 * n)))
    ax = curve.plot(axes_or_new(None, 11.0, 5.0), points=chosen, legend="outside")
    logarithmic(ax)
    ax.set_title(rf"Figure {figure}: points with $\xi_{n}$ = 0 (n = {n}, order m = {2 * n}), {GAMMA}", fontsize=10)
    return ax


def _detail(client: Client, points: dict[str, CodimensionTwoPoints]) -> Axes:
    from grazemap.plots.axes import drawing

    place = drawing(None, "inside", labels=True, height=5.0)
    ax = place.ax
    for name, colour, style in ((GAMMA, "#222222", "-"), (PER_LINK, "#D55E00", "--")):
        curve = client.grazing_curve(READINGS[name], omega=NEAR, points=200, progress=False)
        point = nearest(points[name], 2)
        ax.plot(curve.omega, curve.clearance, style, color=colour, linewidth=1.3, label=f"grazing curve, {name}")
        ax.plot(
            point.omega, point.clearance, marker=(6, 2, 0), markersize=13, color=colour, linestyle="none",
            label=rf"$\xi_1$ = 0, {name}",
        )  # fmt: skip
    ax.plot(POINT_OMEGA.value, POINT_CLEARANCE.value, "o", color="#0072B2", markersize=6, label="printed in the paper")
    ax.axvline(POINT_OMEGA.value, color="#0072B2", linewidth=0.5)
    ax.axhline(POINT_CLEARANCE.value, color="#0072B2", linewidth=0.5)
    place.describe_plane("nondimensional", "Figure 5, near the printed point")
    ax.margins(x=0.0)
    ax.ticklabel_format(useOffset=False)
    place.show_legend(loc="best")
    return ax

"""The discontinuity mapping of Section 3 beside the motion itself, and what leaves a codimension-two point."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap import Client, CodimensionTwoPoints, DiscontinuityMapping, GrazingCurve, UnfoldingMap
from grazemap.plots.axes import drawing
from grazemap.results import CodimensionTwoPoint
from paper.codimension_two import nearest, points_of
from paper.page import Section
from paper.paper import GAMMA, READINGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

OMEGA = 0.29
OVERSHOOTS = np.logspace(-8, -1, 22)
SHOWN = (21, 18, 12, 6, 0)
NEAR = (0.2775, 0.2830)
SWEPT = (0.278, 0.279, 0.2795, 0.2798)
STEP = 2e-6


def mapping(client: Client) -> Section:
    """Return the errors of the mapping (27), of the next order, and of the Poincare map (26)."""
    section = Section("Section 3: the discontinuity mapping")
    chain = READINGS[GAMMA]
    clearance = client.discontinuity_mapping(chain, omega=OMEGA, overshoot=[1e-3], progress=False).clearance
    result = client.discontinuity_mapping(
        chain, omega=OMEGA, overshoot=OVERSHOOTS * clearance, order="leading", returns=2, progress=False
    )
    section.say(
        "The paper gives the mapping (27) to leading order and does not test it. The exact mapping follows from two"
        f" roots of known functions. Here it is computed at omega = {OMEGA:g} on the grazing curve, b ="
        f" {clearance:.12f}, with {GAMMA}. Mass 1 is displaced beyond stop A by an overshoot delta; u = sqrt(2"
        " delta/|a_1*|), and (27) is read as x + beta u, not x* + beta u (see below). Errors are maximum entries in"
        " units of b, omega b and radians. The last column is the error of the Poincare map (26) with the leading-order"
        " mapping, half a period after the steady motion has met a stop that is closer than its amplitude by delta."
    )
    section.show(
        ["delta/b", "size of DM(x) - x", "error of x + beta u", "error with gamma u^2", "error at the first return"],
        [
            [f"{OVERSHOOTS[k]:.1e}"]
            + [f"{values[k]:.4e}" for values in (result.size, result.error, result.error_of_second_order)]
            + [f"{result.returns.error[k, 1]:.4e}"]
            for k in SHOWN
        ],
    )
    section.draw("discontinuity_mapping.png", "Errors of the mapping over the overshoot", lambda: _errors(result))
    section.say(
        f"The exponents fitted to the errors are {result.fitted_order:.3f} and {result.fitted_order_of_second:.3f}:"
        " the error of the leading-order mapping is O(delta), that of the next order is O(delta^(3/2)), as their"
        f" expansions predict. The mapping exists up to delta = {result.largest_overshoot / clearance:.4f} b."
    )
    return section


def unfolding(client: Client) -> Section:
    """Return what leaves the grazing curve near the printed point, and how that compares with simulation."""
    section = Section("Curves that leave the grazing curve at the point of Figure 5")
    points = points_of(client, GAMMA)
    recurrence = nearest(points, 2)
    resonant = [
        min(
            (p for p in points.points if p.bifurcation == name and not p.symmetric and p.multiple == 1),
            key=lambda p: abs(p.omega - recurrence.omega),
        )
        for name in ("SN", "PD")
    ]
    section.say(
        "The point with xi_1 = 0 is the centre of the paper's unfolding diagram, Figure 8. For one mass, saddle-node"
        " and period-doubling curves of motions with one impact in a period leave the grazing curve at this point too."
        " For a chain there are three different points, because the responses to all earlier impacts add up. In the"
        f" table x is the distance in omega from the point of the row, and {GAMMA}:"
    )
    section.show(["point", "omega", "b", "leaves the grazing curve", "impact speed"], _leaving(recurrence, resonant))
    section.draw(
        "unfolding.png",
        "Curves that leave the grazing curve near the point of Figure 5",
        lambda: _picture(points, swept),
    )
    swept = _swept(client, resonant[0])
    section.say(
        "The picture shows the curves to leading order. There are no such motions beyond the saddle-nodes, so the line"
        " of period doublings is drawn only up to them."
    )
    section.say(
        f"The next table compares the saddle-nodes with simulations. The clearance is raised in steps of {STEP:.0e},"
        " and each trajectory starts at the final state of the one before. The trajectories have impacts up to the"
        " saddle-node and none beyond it. The leading order is a limit for small x, and the last simulated clearance"
        " is accurate to one step:"
    )
    section.show(
        ["omega", "x", "b - A, simulated", "b - A, leading order", "ratio"],
        [
            [f"{omega:.4f}", f"{x:.6f}", f"{simulated:.6f}", f"{leading:.6f}", f"{simulated / leading:.3f}"]
            for omega, x, simulated, leading in swept
        ],
    )
    return section


def _leaving(recurrence: CodimensionTwoPoint, resonant: list[CodimensionTwoPoint]) -> list[list[str]]:
    rows = [
        [
            "recurrence, xi_1 = 0",
            f"{recurrence.omega:.12f}",
            f"{recurrence.clearance:.12f}",
            "no curve of period 1",
            "-",
        ]
    ]
    for point in resonant:
        curve = point.unfolding
        assert curve is not None
        form = f"{curve.slope:+.6f} x" if curve.quadratic is None else f"{curve.quadratic:+.4f} x^2"
        side = "x > 0" if curve.curve_omega > 0 else "x < 0"
        rows.append(
            [
                f"{point.bifurcation}, one impact a period",
                f"{point.omega:.12f}",
                f"{point.clearance:.12f}",
                f"b - A = {form}, {side}, {curve.contact}" + ("" if curve.admissible else "; not admissible"),
                f"{abs(curve.velocity_slope):.5f} abs(x)",
            ]
        )
    return rows


def _swept(client: Client, point: CodimensionTwoPoint) -> list[tuple[float, float, float, float]]:
    """Return omega, x, and b - A where impacts end as the clearance is raised, and by the leading order."""
    rows = []
    assert point.unfolding is not None
    assert point.unfolding.quadratic is not None
    for omega in SWEPT:
        chain = READINGS[GAMMA]
        # curves and maps have at least two values of omega; the second is not used
        pair = [omega, omega + 1e-3]
        curve: GrazingCurve = client.grazing_curve(chain, omega=pair, progress=False)
        amplitude, x = float(curve.clearance[0]), omega - point.omega
        leading = point.unfolding.quadratic * x * x
        rows_up = int(np.ceil((1.5 * leading + 5e-4) / STEP))
        umap: UnfoldingMap = client.unfolding_map(
            chain, omega=pair, clearance=(amplitude - 5e-4 + STEP * np.arange(rows_up)).tolist(), policy="sweep-up",
            max_periods=4000, progress=False,
        )  # fmt: skip
        hits = (umap.impacts_right[:, 0] == 1) | (umap.impacts_left[:, 0] == 1)
        last = int(np.flatnonzero(hits & (umap.kind[:, 0] == umap.kinds.index("periodic")))[-1])
        simulated = float(umap.vertical[last]) - amplitude
        rows.append((omega, x, simulated, leading))
    return rows


def _picture(points: CodimensionTwoPoints, swept: list[tuple[float, float, float, float]]) -> Axes:
    place = drawing(None, None, labels=True, width=10.5, height=5.0)
    ax = points.plot_unfolding(place.ax, omega=NEAR, legend="none")
    where, distances = [row[0] for row in swept], [row[2] for row in swept]
    ax.plot(where, distances, "o", color="#222222", markerfacecolor="white", label="end of the impacts, simulated")
    place.show_legend()
    return ax


def _errors(result: DiscontinuityMapping) -> Axes:
    return result.plot()

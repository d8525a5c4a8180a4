"""Errors of a discontinuity mapping, and of the Poincare map made of it, compared with simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import Drawing, draws, place_text
from grazemap.plots.palette import INK, LINE, ORDERS, SECOND_LINE
from grazemap.plots.wordings import unit_wording
from grazemap.results import DiscontinuityMapping

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Returns of the map that are drawn.
_RETURNS = 5


@draws(DiscontinuityMapping)
def plot_mapping_error(result: DiscontinuityMapping, drawing: Drawing) -> Axes:
    """Draw the errors of the mapping, of its second order, and of the first returns, over the overshoot (log-log)."""
    stop = "right" if result.stop == 1 else "left"
    place = place_text(result.units, omega=result.omega, clearance=result.clearance)
    pen = drawing.describe(
        unit_wording("overshoot", "m", result.units),
        unit_wording(r"maximum error, in units of $A$, $\omega A$ and radians"),
        f"Discontinuity mapping at the {stop} stop, " + place,
    )
    ax = drawing.ax
    ax.set_xscale("log")
    ax.set_yscale("log")
    order = np.argsort(result.overshoot)
    overshoot = result.overshoot[order]
    pen.plot(
        overshoot, result.size[order], color=INK, linewidth=1.0, linestyle=":", label="displacement by the mapping"
    )
    text = r"error of $x + \beta u$" + _exponent(result.fitted_order)
    pen.plot(overshoot, result.error[order], color=LINE, marker="o", markersize=3.5, label=text)
    text = r"error of $x + \beta u + \gamma u^2$" + _exponent(result.fitted_order_of_second)
    pen.plot(overshoot, result.error_of_second_order[order], color=SECOND_LINE, marker="o", markersize=3.5, label=text)
    which = result.meta["request"]["order"]
    for m in range(1, min(_RETURNS, result.returns.error.shape[1] - 1) + 1):
        error = result.returns.error[order, m]
        pen.plot(
            overshoot,
            np.where(error > 0.0, error, np.nan),
            color=ORDERS[m - 1],
            linewidth=1.0,
            linestyle="--",
            marker="x",
            markersize=4.0,
            label=f"map ({which} order), return {m}" if which == "leading" else f"map (exact), return {m}",
        )
    ax.grid(alpha=0.25, linewidth=0.5)
    drawing.show_legend()
    return ax


def _exponent(value: float) -> str:
    return "" if np.isnan(value) else f", exponent {value:.3f}"

"""Errors of a discontinuity mapping, and of the Poincare map made of it, compared with simulation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grazemap.plots.axes import INK, axes_or_new, legend_outside, place_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import DiscontinuityMapping

_LEADING, _SECOND = "#0072B2", "#D55E00"
_RETURNS = ("#009E73", "#CC79A7", "#B8860B", "#56B4E9", "#7A4FBF")


def plot_mapping_error(result: DiscontinuityMapping, ax: Axes | None = None) -> Axes:
    """Draw errors over the overshoot, logarithmically: of the mapping, of the next order, and of the first returns."""
    ax = axes_or_new(ax)
    order = np.argsort(result.overshoot)
    overshoot = result.overshoot[order]
    ax.loglog(
        overshoot, result.size[order], color=INK, linewidth=1.0, linestyle=":", label="displacement by the mapping"
    )
    text = r"error of $x + \beta u$" + _exponent(result.fitted_order)
    ax.loglog(overshoot, result.error[order], color=_LEADING, marker="o", markersize=3.5, label=text)
    text = r"error of $x + \beta u + \gamma u^2$" + _exponent(result.fitted_order_of_second)
    ax.loglog(overshoot, result.error_of_second_order[order], color=_SECOND, marker="o", markersize=3.5, label=text)
    which = result.meta["request"]["order"]
    for m in range(1, min(len(_RETURNS), result.returns.error.shape[1] - 1) + 1):
        error = result.returns.error[order, m]
        ax.loglog(
            overshoot,
            np.where(error > 0.0, error, np.nan),
            color=_RETURNS[m - 1],
            linewidth=1.0,
            linestyle="--",
            marker="x",
            markersize=4.0,
            label=f"map ({which} order), return {m}" if which == "leading" else f"map (exact), return {m}",
        )
    ax.set_xlabel("overshoot (m)" if result.units == "SI" else "overshoot")
    ax.set_ylabel(r"maximum error, in units of $b$, $\omega b$ and radians")
    stop = "A" if result.stop == 1 else "C"
    where = place_text(result.units, omega=result.omega, clearance=result.clearance)
    ax.set_title(f"Discontinuity mapping at stop {stop}, {where}", fontsize=10)
    ax.grid(alpha=0.25, linewidth=0.5)
    legend_outside(ax)
    return ax


def _exponent(value: float) -> str:
    return "" if np.isnan(value) else f", exponent {value:.3f}"

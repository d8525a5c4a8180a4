"""Bifurcation curves, by themselves and over an unfolding map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from grazemap.plots.axes import axes_or_new, label_plane, legend_outside, rimmed
from grazemap.plots.palette import BIFURCATIONS, label_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grazemap.results import BifurcationCurves

_DASHES = ("-", "--", "-.", ":")


def plot_bifurcation_curves(result: BifurcationCurves, ax: Axes | None = None, admissible: bool = True) -> Axes:
    """Draw the curves; with `admissible` only those of admissible motions."""
    ax = axes_or_new(ax)
    draw_bifurcation_curves(ax, result, admissible)
    label_plane(ax, result.units)
    window = result.meta["request"]
    ax.set_xlim(window["omega"]["start"], window["omega"]["stop"])
    ax.set_ylim(window["clearance"]["start"], window["clearance"]["stop"])
    named = dict.fromkeys(
        label_text(motion.label) if motion.label else "a motion not found" for motion in result.motions
    )
    motions = ", ".join(named) or "motions with one impact, or one on either stop"
    ax.set_title(f"Bifurcation curves of {motions}", fontsize=10)
    legend_outside(ax)
    return ax


def draw_bifurcation_curves(ax: Axes, result: BifurcationCurves, admissible: bool = True, halo: bool = False) -> None:
    """Add the curves to axes: a colour for each type, a dash for each period, thin for symmetric motions.

    With `halo` they have a white rim, so that they are legible on colours.
    """
    seen: set[str] = set()
    for curve in result.curves:
        if admissible and not curve.admissible:
            continue
        label = f"{BIFURCATIONS[curve.type][2]}, {label_text(curve.motion)}"
        style = curve_style(curve.type, 1.0 if curve.symmetric else 1.6, halo) | {
            "linestyle": _DASHES[(curve.period - 1) % len(_DASHES)],
            "alpha": 1.0 if curve.admissible else 0.3,
        }
        ax.plot(curve.omega, curve.clearance, label=None if label in seen else label, zorder=3, **style)
        seen.add(label)


def curve_style(type: str, width: float, halo: bool) -> dict[str, Any]:
    """Return the style of a type of curve, as keywords of `Axes.plot`."""
    effects = rimmed(width + 1.4) if halo else None
    return {"color": BIFURCATIONS[type][1], "linewidth": width, "path_effects": effects}

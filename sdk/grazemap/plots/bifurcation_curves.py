"""Bifurcation curves, by themselves and over an unfolding map."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from grazemap.plots.axes import Drawing, draws, parameter_label, rimmed
from grazemap.plots.palette import ANY_COLOUR, BIFURCATIONS, dash, label_text
from grazemap.plots.pen import Pen
from grazemap.plots.smooth import smooth_line
from grazemap.results import BifurcationCurve, BifurcationCurves
from grazemap.results.stretches import first_again
from grazemap.wire import Oscillator

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_ENTRIES = 8
"""Most entries of a legend that each are of a type and a motion, unless types and motions apart are no fewer."""
_THIN = 0.4
"""Share of the width of a line where no motion beside it is stable."""


@draws(BifurcationCurves)
def plot_bifurcation_curves(result: BifurcationCurves, drawing: Drawing, admissible: bool) -> Axes:
    """Draw the curves; with `admissible` only those of admissible motions."""
    plane = result.plane
    names = dict.fromkeys(
        label_text(motion.label) if motion.label else "a motion not found" for motion in result.motions
    )
    alone = "motions with one impact" + (", or one on either stop" if plane.mirrors else "")
    motions = ", ".join(names) or alone
    across, up = (parameter_label(name, result.units) for name in plane.names)
    pen = drawing.describe(across, up, f"Bifurcation curves of {motions}")
    pen.set_xlim(*plane.horizontal.ends)
    pen.set_ylim(*plane.vertical.ends)
    draw_bifurcation_curves(pen, result, admissible)
    drawing.show_legend(handlelength=3.0)
    return drawing.ax


def draw_bifurcation_curves(
    pen: Pen,
    results: BifurcationCurves | Sequence[BifurcationCurves],
    admissible: bool = True,
    halo: bool = False,
) -> None:
    """Add the curves to axes: a colour for each type, a dash for each motion; curves of inadmissible motions are pale.

    A curve is thin where no motion beside it is stable: no trajectory changes there. With `halo` the curves
    have a white rim, so that they are legible on colours.
    """
    together = results if isinstance(results, Sequence) else [results]
    shown = [(curve, result) for result in together for curve in result.curves if curve.admissible or not admissible]
    dashes = {motion: number for number, motion in enumerate(dict.fromkeys(curve.motion for curve, _ in shown))}
    for curve, result in shown:
        width = 1.0 if curve.symmetric else 1.6
        line = {"linestyle": dash(dashes[curve.motion]), "alpha": 1.0 if curve.admissible else 0.35, "zorder": 3}
        path = _path(curve, result)
        stable = np.resize(curve.stable_beside, len(path))  # of a closed curve its first point again
        for shown_points, share in ((None, _THIN), (stable, 1.0)):
            across, up = smooth_line(path, path[:, :2], shown_points).T
            pen.plot(across, up, **line, **curve_style(curve.type, share * width, halo))
    _explain(pen, {(curve.type, curve.motion): None for curve, _ in shown}, dashes)
    if not all(np.all(curve.stable_beside) for curve, _ in shown):
        pen.plot([], [], color=ANY_COLOUR, linewidth=_THIN * 1.6, label="thin: unstable on both sides")


def _explain(pen: Pen, shown: Collection[tuple[str, str]], dashes: Mapping[str, int]) -> None:
    """Give the types and motions of curves entries in the legend; if there are many, types and motions apart."""
    types = [name for name in BIFURCATIONS if any(type == name for type, _ in shown)]
    if len(shown) <= max(_MOST_ENTRIES, len(types) + len(dashes)):
        for type, motion in sorted(shown, key=lambda pair: (types.index(pair[0]), dashes[pair[1]])):
            style = curve_style(type, 1.6, halo=False) | {"linestyle": dash(dashes[motion])}
            pen.plot([], [], label=f"{BIFURCATIONS[type][2]} of {label_text(motion)}", **style)
        return
    for type in types:
        pen.plot([], [], label=BIFURCATIONS[type][2], **curve_style(type, 1.6, halo=False))
    for motion, number in dashes.items():
        pen.plot([], [], label=f"of {label_text(motion)}", color=ANY_COLOUR, linestyle=dash(number), linewidth=1.6)


def _path(curve: BifurcationCurve, result: BifurcationCurves) -> NDArray[np.float64]:
    """Return the coordinates along which the length of a curve is measured, of shape (points, d).

    They begin with those that are drawn. A closed curve ends with its first point.
    """
    if curve.velocities is None or curve.phases is None:
        return curve.line
    path = np.concatenate([curve.line, curve.velocities, curve.phases], axis=1)
    if set(curve.ends) != {"closed"}:
        return path
    oscillator = Oscillator.model_validate(result.meta["request"]["oscillator"])
    return np.concatenate([path, first_again(path, curve.phases.shape[1], oscillator)])


def curve_style(type: str, width: float, halo: bool) -> dict[str, Any]:
    """Return the style of a type of curve, as keywords of `Axes.plot`."""
    effects = rimmed(width + 1.4) if halo else None
    return {"color": BIFURCATIONS[type][1], "linewidth": width, "path_effects": effects}

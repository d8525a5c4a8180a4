"""Windows of motions with one impact in n periods next to a graze of one stop: period adding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from grazemap import Client, Trajectory
from paper.asking import answers
from paper.page import Section
from paper.published.one_mass import Family, branch_over_clearance, one_mass, points_of, right

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DAMPING, RESTITUTION = 2.5, 0.8
OSCILLATOR = one_mass(DAMPING, RESTITUTION)
CASES = ((2.0, (2, 3, 4, 5)), (3.0, (3, 4, 5)))
"""omega, and periods of the motions."""
DIAGRAM_OMEGA, DIAGRAM_RANGE, DIAGRAM_POINTS = 2.0, (1e-6, 0.6), 300


class Window(NamedTuple):
    """F/F_graz - 1 where the motion of a period begins, in a period doubling, and where it ends, in a graze."""

    period: int
    doubling: float
    graze: float


def period_adding(client: Client) -> Section:
    """Return the section."""
    section = Section("Period adding next to a graze of one stop")
    section.say(
        "A. B. Nordmark, *Non-periodic motion caused by grazing incidence in an impact oscillator*, Journal of Sound"
        " and Vibration 145 (1991) 279-297, and W. Chin, E. Ott, H. E. Nusse and C. Grebogi, *Grazing bifurcations in"
        " impact oscillators*, Physical Review E 50 (1994) 4427, describe what follows a graze of a motion with real"
        " multipliers, lambda the larger one: motions with one impact in n periods, n growing toward the graze;"
        " windows of different n that overlap for lambda < 1/4 and that chaos separates for 1/4 < lambda < 2/3. Of"
        " both only abstracts could be read here, which have no numbers, so there is no printed column. The thresholds"
        " are quoted as what is generally known; that the windows follow them is computed."
    )
    section.say(
        "x'' + 2.5 x' + x = F cos(omega t), a stop at 1, R = 0.8: overdamped, so that the multipliers of the steady"
        " motion are real and positive. The windows are in F/F_graz - 1, from the period doubling of the motion to its"
        " second graze."
    )
    shown: list[Window] = []
    for omega, periods in CASES:
        largest = math.exp((-0.5 * DAMPING + math.sqrt(0.25 * DAMPING**2 - 1.0)) * 2.0 * math.pi / omega)
        windows = [window(client, omega, period) for period in periods]
        shown = shown or windows
        pairs = list(zip(windows, [*windows[1:], None], strict=True))
        section.say(f"omega = {omega:g}, lambda = {largest:.8f}, lambda^2 = {largest**2:.7f}:")
        section.show(
            ["n", "from", "to", "the next window", "its beginning over this one's"],
            [
                [
                    str(span.period),
                    f"{span.doubling:.7e}",
                    f"{span.graze:.7e}",
                    "-" if after is None else "overlaps" if after.graze > span.doubling else "is separate",
                    "-" if after is None else f"{after.doubling / span.doubling:.7f}",
                ]
                for span, after in pairs
            ],
        )
    section.say(
        "The windows overlap below 1/4 and are separate above it. The ratio of their beginnings tends to lambda^2."
    )
    section.draw(
        "published_adding.png",
        "Velocities of the impacts after the graze, at omega = 2, of trajectories from rest, and the windows",
        lambda: _picture(client, shown),
    )
    return section


def window(client: Client, omega: float, period: int) -> Window:
    """Return the window of the motion of a period."""
    family = Family.of(DAMPING, RESTITUTION, omega, period)
    # the windows are roughly a power of lambda^2 from the graze
    middle = 2.0 * _scale(omega, period)
    clearance = family.amplitude / (1.0 + middle)
    start = (clearance, family.guess(clearance, max(family.speeds(clearance)), period))
    ends = (family.amplitude / (1.0 + 40.0 * middle), family.amplitude * (1.0 - middle / 40.0))
    branch = branch_over_clearance(client, OSCILLATOR, omega, start, ends)
    doublings, grazes = (
        [family.amplitude / clearance - 1.0 for clearance, speed in points_of(branch, kind) if speed > 0.0]
        for kind in ("PD", "GR")
    )
    return Window(period, min(doublings), min(graze for graze in grazes if graze > min(doublings)))


def _scale(omega: float, period: int) -> float:
    """Return lambda^2 to the power of the period, over its value for the first one: where to look for the window."""
    square = math.exp((-DAMPING + 2.0 * math.sqrt(0.25 * DAMPING**2 - 1.0)) * 2.0 * math.pi / omega)
    first = {2.0: (2, 0.0147), 3.0: (3, 0.0334)}[omega]
    return first[1] * square ** (period - first[0])


def _picture(client: Client, windows: Sequence[Window]) -> Axes:
    import numpy as np

    from grazemap.plots.axes import axes_or_new

    family = Family.of(DAMPING, RESTITUTION, DIAGRAM_OMEGA)
    beyond = np.geomspace(*DIAGRAM_RANGE, DIAGRAM_POINTS)
    clearances = (family.amplitude / (1.0 + beyond)).tolist()
    common = {"oscillator": OSCILLATOR.model_dump(), "omega": DIAGRAM_OMEGA, "samples_per_period": 1}
    questions = [
        {**common, "clearance": right(clearance), "periods": 40, "transient_periods": 200} for clearance in clearances
    ]
    ax = axes_or_new(None, 9.0, 5.0)
    for path, clearance, force in zip(answers(client, Trajectory, questions), clearances, beyond.tolist(), strict=True):
        speeds = path.impacts.velocity / clearance
        ax.plot(np.full(len(speeds), force), speeds, "k.", markersize=1.5)
    for span in windows:
        height = 2.6 if span.period % 2 else 4.2
        ax.plot((span.doubling, span.graze), (height, height), "|-", linewidth=2.0, markersize=8)
        ax.annotate(f"n = {span.period}", (4.0 * span.doubling, 1.12 * height), fontsize=8)
    ax.set(xlabel="$F/F_{graz} - 1$", ylabel="velocity before the impact", xscale="log", yscale="log")
    ax.set(xlim=DIAGRAM_RANGE, ylim=(0.0018, 8.0))
    return ax

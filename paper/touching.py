"""Region (b) of Figure 9, multi-0r-0l: which motions there are that only touch the stops, and what moves there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grazemap import Client, Trajectories
from paper.asking import answers
from paper.motions import TRANSIENT
from paper.page import Section, below
from paper.paper import GAMMA, READINGS
from paper.starts import counted, states, swept
from paper.states import graze, initial

CHAIN = READINGS[GAMMA]
RECORDED = 64
STARTS = 24
HEAD = (
    "b",
    "motions (number of starts)",
    "slowest impact",
    "fastest impact, minimum over starts",
    "fastest impact, maximum over starts",
    "omega b",
)


def touching(client: Client, omega: float, high: float, low: float, places: int = 12) -> Section:
    """Return the section; `high` and `low` are the clearances between which the region must lie."""
    section = Section("Region (b): multi-0r-0l")
    point = graze(client, CHAIN, omega)
    path = client.trajectory(
        CHAIN, omega=omega, clearance=point.clearance, initial=initial(point.grazing.state), periods=4, progress=False
    )
    touches = int(np.sum(path.impacts.kind == "graze"))
    curve = client.grazing_curve(CHAIN, omega=[omega, omega + 1e-3], max_order=8, progress=False)
    again = int(curve.first_recurrence[0])
    section.say(
        "0_r and 0_l are grazes, touches at zero velocity, by the paper's own definition. A graze changes nothing: -R"
        " times a velocity of zero is zero. So a motion that meets the stops only in grazes is a motion of the chain"
        " without stops, and of these only the steady motion persists. It reaches each side once in a forcing period"
        f" and touches both stops at only one clearance of the line: the motion is **1-0r-0l at b = A({omega:g}) ="
        f" {point.clearance:.12f}**. On this and any other line, no motion that only touches the stops has another n."
        f" A simulation that starts on it touches the stops {touches} times in 4 periods, at velocities below"
        f" {below(float(np.max(np.abs(path.impacts.velocity))))}. "
        + (f"Nearby motions leave it: its graze recurs after {again} half period{'s' * (again > 1)}." if again else "")
    )
    section.say(
        f"The table is for {places} clearances between the neighbouring regions a and c. It has the motions to which"
        f" trajectories from rest and from {STARTS} random states settle within {TRANSIENT} periods, and the speeds at"
        f" which mass 1 meets the stops in the next {RECORDED} periods. For comparison, omega b is about the speed of"
        " mass 1 at its middle position."
    )
    clearances = np.round(np.linspace(high, low, places + 2)[1:-1], 5).tolist()
    rows = speeds(client, omega, clearances)
    section.show(HEAD, rows)
    section.say(swept(client, omega, high, low))
    slowest = min((row[3] for row in rows if row[3] != "-"), key=float, default=None)
    if slowest is not None:
        section.say(
            "None of the trajectories with impacts only touches the stops: the fastest impact of each has a speed of at"
            f" least {slowest}. Close to the grazing curve there are slow impacts, many of them in motions that close"
            " after many periods or not at all. In a phase portrait such a motion seems to touch the stops many times,"
            " which fits the printed label if 0 stands for slow impacts."
        )
    return section


def speeds(client: Client, omega: float, clearances: Sequence[float]) -> list[list[str]]:
    """Return for each clearance the line that `HEAD` describes: the motions from many starts, and their speeds."""
    questions = [
        {
            "oscillator": CHAIN.model_dump(), "omega": omega, "clearance": value, "initial": states(value, STARTS),
            "periods": RECORDED, "transient_periods": TRANSIENT, "samples_per_period": 1,
        }
        for value in clearances
    ]  # fmt: skip
    rows = []
    for value, result in zip(clearances, answers(client, Trajectories, questions), strict=True):
        hits = [np.abs(path.impacts.velocity) for path in result.trajectories if len(path.impacts)]
        fastest = [float(speed.max()) for speed in hits]
        figures = [min(float(speed.min()) for speed in hits), min(fastest), max(fastest)] if hits else []
        cells = [f"{figure:.4f}" for figure in figures] or ["-"] * 3
        rows.append([f"{value:.5f}", counted(result), *cells, f"{omega * value:.4f}"])
    return rows

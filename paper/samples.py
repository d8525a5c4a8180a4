"""One motion of each region of Figure 9: its verified orbit, multipliers, interval of stability and phase portrait."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from grazemap import Client, OrbitBranch, PeriodicOrbit, Trajectory, UnfoldingMap
from grazemap.wire import motion_label
from paper.asking import answers
from paper.motions import SAMPLES, TRANSIENT, Motion, turns_at_a
from paper.paper import GAMMA, READINGS, Region

CHAIN = READINGS[GAMMA]
# Motions that do not close are waited for longer here than along a line, and this much of them is drawn.
PATIENCE, DRAWN = 20_000, 60
# Records of more periods than these have fewer samples in each.
MANY = 32
# Periods looked for; of more impacts than these a row names the first ones only.
MAX_PERIOD, NAMED = 256, 8
# Branches are followed this far beyond the line, and not of more impacts than these.
MARGIN, FOLLOWED = 0.1, 32
TURN = 2 * np.pi


@dataclass(frozen=True)
class End:
    """Where a branch stops being a stable motion: the clearance, and what happens; "range" where it was not seen."""

    type: str
    clearance: float

    def __str__(self) -> str:
        return f"{self.clearance:.9f} ({self.type})"


@dataclass(frozen=True, eq=False)
class Sample:
    """What a trajectory from rest comes to at one clearance.

    Attributes
    ----------
    region : Region
        Which of the printed motions this stands for.
    omega, clearance : float
    kind : str
    counts : (int, int, int) or None
        n, p, q; None unless the kind is periodic.
    orbit : PeriodicOrbit or None
        None for motions that do not close, and without impacts.
    multiplier, lyapunov : float
        Largest modulus over a motion period; exponent per forcing period. NaN where there is none.
    path : Trajectory
        One period of the motion; DRAWN forcing periods where it does not close.
    turns : int or None
        At stop A, in a period of the motion.
    stable : (End, End) or None
        Where the orbit's branch is of stable motions, from the greater clearance to the smaller.
    """

    region: Region
    omega: float
    clearance: float
    kind: str
    counts: Motion | None
    orbit: PeriodicOrbit | None
    multiplier: float
    lyapunov: float
    path: Trajectory
    turns: int | None
    stable: tuple[End, End] | None

    @property
    def label(self) -> str:
        """n-p_r-q_l, or the kind."""
        return motion_label(*self.counts) if self.counts else self.kind

    @property
    def verified(self) -> bool:
        """Whether the orbit is isolated, touches the stops at its impacts only, and is stable."""
        orbit = self.orbit
        return orbit is not None and orbit.isolated and orbit.admissible and orbit.stable

    @property
    def row(self) -> list[str]:
        """Its line on the page; `HEAD` names the columns."""
        first = [self.region.letter, self.region.label, short(self.clearance), self.label]
        turns = "-" if self.turns is None else str(self.turns)
        orbit = self.orbit
        if orbit is None:
            return [*first, turns, "-", self._growth(), "b > A(omega)" if self.steady else "-"]
        ends = " to ".join(map(str, self.stable)) if self.stable else "-"
        return [*first, turns, impacts(orbit), f"{abs(orbit.multipliers[0]):.4f}: {largest(orbit)}", ends]

    @property
    def steady(self) -> bool:
        """Whether it is the motion without impacts."""
        return self.kind == "periodic" and not len(self.path.impacts)

    def _growth(self) -> str:
        if self.kind == "periodic":
            return f"{self.multiplier:.4f}"
        return f"Lyapunov exponent {self.lyapunov:.3f}" if np.isfinite(self.lyapunov) else "-"


HEAD = (
    "region",
    "printed",
    "b",
    "motion",
    "turns at A",
    "impacts: stop, t/T (speed)",
    "largest multipliers, modulus first",
    "stable for b from, to",
)


def samples_of(client: Client, omega: float, span: tuple[float, float], wanted: Mapping[Region, float]) -> list[Sample]:
    """Return a sample of each region, at the clearances that are wanted; `span` is the line, from above."""
    places = list(wanted.items())
    chain = CHAIN.model_dump()
    # a map has at least two rows and columns; the others are not used
    maps = answers(
        client,
        UnfoldingMap,
        [
            {
                "oscillator": chain, "omega": [omega, omega + 1e-3], "clearance": [value, value + 1e-3],
                "max_periods": PATIENCE, "max_period": MAX_PERIOD,
            }
            for _, value in places
        ],
    )  # fmt: skip
    hits = [
        umap.kinds[umap.kind[0, 0]] == "periodic" and umap.impacts_right[0, 0] + umap.impacts_left[0, 0] > -2
        for umap in maps
    ]
    questions = [
        {
            "oscillator": chain, "omega": omega, "clearance": value,
            "transient_periods": max(TRANSIENT, int(umap.settled_after[0, 0])), "max_period": MAX_PERIOD,
        }
        for (_, value), umap in zip(places, maps, strict=True)
    ]  # fmt: skip
    asked = [question for question, hit in zip(questions, hits, strict=True) if hit]
    orbits = iter(answers(client, PeriodicOrbit, asked))
    solved = [next(orbits) if hit else None for hit in hits]
    settled = [orbit if orbit is not None and orbit.converged else None for orbit in solved]
    short_ones = [orbit for orbit in settled if orbit is not None and len(orbit.stops) <= FOLLOWED]
    branches = dict(zip(map(id, short_ones), _branches(client, span, short_ones), strict=True))
    paths = answers(
        client,
        Trajectory,
        [_path(question, umap, orbit) for question, umap, orbit in zip(questions, maps, settled, strict=True)],
    )
    return [
        _sample(region, omega, value, umap, path, orbit, branches.get(id(orbit)))
        for (region, value), umap, path, orbit in zip(places, maps, paths, settled, strict=True)
    ]


def as_asked(orbit: PeriodicOrbit) -> dict[str, Any]:
    """Return an orbit as the motion of a question."""
    names = ("stops", "phases", "velocities")
    return {"period": orbit.period} | {name: getattr(orbit, name).tolist() for name in names}


def stretch(branch: OrbitBranch, clearance: float) -> tuple[End, End]:
    """Return the ends, greater clearance first, of the stable motions of a branch round a clearance."""
    mask = branch.stable & branch.admissible
    inside = np.flatnonzero(mask)
    middle = int(inside[np.argmin(np.abs(branch.parameter[inside] - clearance))])
    ends = []
    for step in (1, -1):
        last = middle
        while 0 <= last + step < len(mask) and mask[last + step]:
            last += step
        segment = last if step == 1 else last - 1
        special = [
            point for point in branch.special_points if point.segment == segment and point.admissible is not None
        ]
        at = float(branch.parameter[last])
        if special:
            point = min(special, key=lambda point: abs(point.parameter - at))
            ends.append(End(point.type, point.parameter))
        else:
            ends.append(End("range", at))
    high, low = sorted(ends, key=lambda end: -end.clearance)
    return high, low


def impacts(orbit: PeriodicOrbit) -> str:
    """Return the impacts in order; of a symmetric motion those of the first half period."""
    place = orbit.phases / TURN % orbit.period
    order = np.argsort(place)
    symmetric = bool(orbit.motion.symmetric)
    chosen = [k for k in order if not symmetric or place[k] < orbit.period / 2]
    texts = [f"{'A' if orbit.stops[k] > 0 else 'C'} {place[k]:.4f} ({abs(orbit.velocities[k]):.4f})" for k in chosen]
    if len(texts) > NAMED:
        texts = [*texts[:NAMED], f"... ({len(texts)} of them)"]
    return ", ".join(texts) + (", and mirrored" if symmetric else "")


def largest(orbit: PeriodicOrbit, count: int = 2) -> str:
    """Return the largest multipliers, a pair as one of them."""
    shown = [value for value in orbit.multipliers if value.imag >= 0.0][:count]
    return ", ".join(f"{value.real:.4f}" + (f" ± {value.imag:.4f}i" if value.imag else "") for value in shown)


def short(value: float) -> str:
    """Return a clearance as it was chosen: with four decimals, or six where it had to be finer."""
    return f"{value:.4f}" if round(value, 4) == value else f"{value:.6f}"


def _branches(client: Client, span: tuple[float, float], orbits: list[PeriodicOrbit]) -> list[OrbitBranch]:
    high, low = span
    questions = [
        {
            "oscillator": CHAIN.model_dump(), "omega": orbit.omega, "clearance": orbit.clearance,
            "motion": as_asked(orbit), "range": {"start": low - MARGIN, "stop": high + MARGIN},
        }
        for orbit in orbits
    ]  # fmt: skip
    return answers(client, OrbitBranch, questions)


def _path(question: dict[str, Any], umap: UnfoldingMap, orbit: PeriodicOrbit | None) -> dict[str, Any]:
    """Return the question for what is drawn."""
    if orbit is not None:
        start = orbit.start
        state = {"displacement": start.displacement.tolist(), "velocity": start.velocity.tolist(), "phase": start.phase}
        periods, how = orbit.period, {"initial": state, "transient_periods": 0}
    else:
        periods = int(umap.period[0, 0]) if umap.kinds[umap.kind[0, 0]] == "periodic" else DRAWN
        how = {}
    recorded = {"periods": periods, "samples_per_period": SAMPLES if periods <= MANY else SAMPLES // 4}
    return {name: value for name, value in question.items() if name != "max_period"} | how | recorded


def _sample(
    region: Region,
    omega: float,
    clearance: float,
    umap: UnfoldingMap,
    path: Trajectory,
    orbit: PeriodicOrbit | None,
    branch: OrbitBranch | None,
) -> Sample:
    kind = umap.kinds[umap.kind[0, 0]]
    counts = None
    if kind == "periodic":
        counts = int(umap.period[0, 0]), int(umap.impacts_right[0, 0]), int(umap.impacts_left[0, 0])
    multiplier, lyapunov = (
        np.nan if values is None else float(values[0, 0]) for values in (umap.multiplier, umap.lyapunov)
    )
    return Sample(
        region, omega, clearance, kind, counts, orbit, multiplier, lyapunov, path,
        turns_at_a(path) if counts else None,
        None if branch is None else stretch(branch, clearance),
    )  # fmt: skip

"""The first events of random systems, and rests and releases, against fifty digits."""

from __future__ import annotations

from multiprocessing import get_context

from tests.oracles.first_events import EVENTS, Outcome, outcomes, resting_outcome
from tests.support.random_systems import RESTING, random_system, resting_system

from .table import Row, part

SYSTEMS = 2000
RESTS = 30


def events_of(seed: int) -> tuple[Outcome, Outcome | None]:
    """Compare a system's first events, of a trajectory and of the lockstep kernel."""
    return outcomes(random_system(seed))


def rests_of(seed: int) -> Outcome:
    """Compare a system's rests and releases."""
    return resting_outcome(resting_system(seed))


def row(name: str, results: list[Outcome]) -> Row:
    """Return a row of the table."""
    events, error, share = (f([getattr(outcome, name) for outcome in results]) for f, name in _FIGURES)
    figure = f"{events} events, error {error:.1e} T, {share:.3f} of that allowed"
    return Row(name, len(results), sum(outcome.wrong for outcome in results), figure)


_FIGURES = ((sum, "compared"), (max, "error"), (max, "share"))


def check(share: float, processes: int) -> list[Row]:
    """Compare events and rests."""
    with get_context("spawn").Pool(processes) as pool:
        # kernels of one size at a time
        seeds = sorted(range(part(SYSTEMS, share)), key=lambda seed: (seed % 6, seed))
        both = []
        for done, pair in enumerate(pool.imap(events_of, seeds, chunksize=4), 1):
            both.append(pair)
            if any(outcome is not None and outcome.wrong for outcome in pair):
                print(f"events of seed {seeds[done - 1]} differ: {pair}", flush=True)
            if done % 200 == 0:
                print(f"{done} of {len(seeds)} systems", flush=True)
        resting = pool.map(rests_of, RESTING[: part(RESTS, share)], chunksize=1)
    rows = [
        row(f"first {EVENTS} events of a trajectory, 50 digits", [alone for alone, _ in both]),
        row(f"first {EVENTS} events in lockstep, 50 digits", [lanes for _, lanes in both if lanes is not None]),
        row("rests and releases, 50 digits", resting),
    ]
    for seed, outcome in zip(RESTING, resting, strict=False):
        if outcome.wrong:
            print(f"rests of seed {seed} differ: {outcome}", flush=True)
    return rows

"""The record of the events of a trajectory: one row for each event, with the state after it."""

from __future__ import annotations

from grazemap_core.arrays import Floats
from grazemap_core.contact.kernels import workspace
from grazemap_core.contact.kernels.workspace import Workspace
from grazemap_core.numerics.jit.compiled import inlined


@inlined
def record_event(
    work: Workspace, half: int, time: float, stop: float, velocity: float, kind: int, state: Floats
) -> None:
    """Record an event without a delay, and the state (n, 2) after it; if the record is full it is only counted."""
    row = work.cursor[workspace.ROWS]
    if row < work.events.shape[0]:
        work.events[row, workspace.HALF] = half
        work.events[row, workspace.TIME] = time
        work.events[row, workspace.STOP] = stop
        work.events[row, workspace.VELOCITY] = velocity
        work.events[row, workspace.KIND] = kind
        work.events[row, workspace.DELAY] = 0.0
        for j in range(state.shape[0]):
            work.events[row, workspace.EVENT_COLUMNS + 2 * j] = state[j, 0]
            work.events[row, workspace.EVENT_COLUMNS + 2 * j + 1] = state[j, 1]
    work.cursor[workspace.ROWS] = row + 1

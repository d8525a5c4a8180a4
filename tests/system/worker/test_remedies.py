"""Whatever is unresolved, not verified or not found says what to do about it."""

import re

import pytest

from grazemap_core.maps.borders.map_borders import BORDER_REASONS as OF_BORDERS
from grazemap_core.orbits.periodic_orbits import ORBIT_REASONS as OF_ORBITS
from grazemap_core.simulation.motion import REASONS as OF_MOTIONS
from grazemap_worker.processes import bifurcation_curves, periodic_orbits, trajectories

REASONS = [
    *OF_MOTIONS.values(),
    *OF_ORBITS.values(),
    *OF_BORDERS,
    periodic_orbits.NOTHING_FOUND,
    periodic_orbits.NOT_PERIODIC,
    bifurcation_curves.NOTHING_FOUND,
    trajectories.NOT_VERIFIED,
]


@pytest.mark.parametrize("reason", [reason for reason in REASONS if reason])
def test_a_reason_has_a_remedy(reason: str) -> None:
    assert re.fullmatch(r"[a-zN][^.]+\. Remedy: \S[^.]+\.", reason), reason

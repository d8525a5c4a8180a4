"""The request for a bifurcation diagram."""

from __future__ import annotations

from typing import Literal

from grazemap.wire.base import Count, OptionalCount
from grazemap.wire.observables import ObservedRequest
from grazemap.wire.planes import OneParameterRequest
from grazemap.wire.process import Operation
from grazemap.wire.states import MaxPeriod


class BifurcationDiagramsRequest(OneParameterRequest, ObservedRequest):
    """Settled motions along one parameter: stroboscopic points, impact velocities and the name of each motion.

    `axis` has the values of the parameter that varies; omega and clearance are given unless they vary.
    """

    operation = Operation(
        "bifurcation-diagrams",
        "submit_bifurcation_diagrams",
        "Compute stroboscopic points, impact velocities and the motion at every value of one parameter.",
        {
            "along the clearance": {
                "axis": {"vary": "clearance", "values": {"start": 1.5, "stop": 2.0, "points": 51}},
                "omega": 0.29,
            },
            "along the damping": {
                "axis": {"vary": "damping", "values": {"start": 0.5, "stop": 1.5, "points": 41}},
                "omega": 0.29,
                "clearance": 1.6,
            },
        },
    )

    policy: Literal["rest", "sweep-up", "sweep-down"] = "rest"
    """Start of trajectories: rest, or where that at the next smaller (sweep-up) or larger (sweep-down) value ended."""
    transient_periods: OptionalCount = 300
    """Forcing periods at each value that are computed first and not shown."""
    periods: Count = 64
    """Forcing periods that are shown at each value."""
    max_period: MaxPeriod = 32

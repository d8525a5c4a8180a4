"""POST to a process: one route for each, from one table."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Body, Response

from grazemap.wire import PROCESSES, Job
from grazemap_service.links import PREFIX
from grazemap_service.openapi import SUBMISSION_KINDS, problem_responses
from grazemap_service.strict_json import JsonRoute
from grazemap_service.submission import NewSubmission


@dataclass(frozen=True)
class ProcessRoute:
    """What the API's document says of a process.

    Attributes
    ----------
    process : str
        Name in `grazemap.wire.PROCESSES`.
    operation_id, summary, description : str
    examples : dict
        Requests that can be posted as they are, by their names.
    """

    process: str
    operation_id: str
    summary: str
    description: str
    examples: dict[str, dict[str, Any]]


_WINDOW = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 32},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 32},
    "max_periods": 200,
}
ROUTES = (
    ProcessRoute(
        "grazing-curves",
        "submit_grazing_curve",
        "Grazing curve",
        "Compute clearance = A(omega), with phase and first recurrence.",
        {
            "default oscillator": {"value": {"omega": {"start": 0.05, "stop": 1.2, "points": 200}}},
            "one mass in SI units": {
                "value": {
                    "oscillator": {
                        "units": "SI",
                        "masses": [2.0],
                        "stiffnesses": [800.0],
                        "damping": 0.001,
                        "forcing": [12.0],
                        "restitution": 0.7,
                    },
                    "omega": [10.0, 15.0, 22.5, 30.0],
                    "max_order": 4,
                }
            },
        },
    ),
    ProcessRoute(
        "codimension-two-points",
        "submit_codimension_two_points",
        "Codimension-two points",
        "Compute every codimension-two point of the grazing curve over an interval of omega.",
        {
            "default oscillator": {"value": {"omega": {"start": 0.25, "stop": 0.35}, "max_order": 4}},
        },
    ),
    ProcessRoute(
        "discontinuity-mappings",
        "submit_discontinuity_mappings",
        "Discontinuity mapping at a graze",
        "Compute the discontinuity mapping at a grazing point, its error, and the returns of the motion below grazing.",
        {
            "default oscillator": {"value": {"omega": 0.29, "overshoot": [1e-6, 1e-5, 1e-4, 1e-3], "returns": 4}},
        },
    ),
    ProcessRoute(
        "trajectories",
        "submit_trajectory",
        "Trajectories",
        "Compute a trajectory from each initial state: its impacts, where it ends, the motion that it settles to.",
        {
            "from rest": {"value": {"omega": 0.29, "clearance": 1.6, "periods": 20, "samples_per_period": 50}},
            "from an initial state": {
                "value": {
                    "omega": 0.29,
                    "clearance": 1.6,
                    "initial": {"displacement": [0.1, 0.0, 0.0], "velocity": [0.0, 0.2, 0.0], "phase": 0.5},
                    "periods": 10,
                    "transient_periods": 100,
                }
            },
            "at given times": {
                "value": {"omega": 0.29, "clearance": 1.6, "periods": 1, "times": [0.0, 0.5, 1.25, 20.0]}
            },
            "from many states": {
                "value": {
                    "omega": 0.29,
                    "clearance": 1.6,
                    "initial": [{}, {"phase": 1.0}, {"displacement": [1.6, 0.0, 0.0]}],
                    "periods": 10,
                }
            },
        },
    ),
    ProcessRoute(
        "bifurcation-diagrams",
        "submit_bifurcation_diagrams",
        "Bifurcation diagram",
        "Compute stroboscopic points, impact velocities and the motion at every value of one parameter.",
        {
            "along the clearance": {
                "value": {"vary": "clearance", "range": {"start": 1.5, "stop": 2.0, "points": 51}, "omega": 0.29}
            },
        },
    ),
    ProcessRoute(
        "unfolding-maps",
        "submit_unfolding_map",
        "Unfolding map",
        "Compute the motion that each point of a grid settles to; its tiles can be fetched before the map is whole.",
        {
            "coarse map of the default oscillator": {
                "value": {
                    "omega": {"start": 0.26, "stop": 0.30, "points": 16},
                    "clearance": {"start": 1.3, "stop": 2.0, "points": 16},
                    "max_periods": 200,
                }
            },
            "map computed where neighbours differ": {"value": {**_WINDOW, "adaptive": True}},
            "names of motions, soon": {"value": {**_WINDOW, "preview": True}},
        },
    ),
    ProcessRoute(
        "unfolding-diagrams",
        "submit_unfolding_diagram",
        "Unfolding diagram",
        "Compute an unfolding map, the curves and points over it, and for every border of its regions what it is.",
        {
            "coarse diagram near the paper's codimension-two point": {
                "value": {
                    "omega": {"start": 0.275, "stop": 0.29, "points": 16},
                    "clearance": {"start": 1.8, "stop": 2.0, "points": 16},
                    "max_periods": 400,
                }
            },
        },
    ),
    ProcessRoute(
        "basins",
        "submit_basins",
        "Basins of attraction",
        "Compute the motion that every initial state of a rectangle leads to, and the attractors with their shares.",
        {
            "two coexisting motions": {
                "value": {
                    "omega": 0.29,
                    "clearance": 1.9927,
                    "horizontal": {
                        "quantity": "displacement",
                        "mass": 1,
                        "values": {"start": -1.9, "stop": 1.9, "points": 50},
                    },
                    "vertical": {
                        "quantity": "velocity",
                        "mass": 1,
                        "values": {"start": -1.0, "stop": 1.0, "points": 50},
                    },
                }
            },
        },
    ),
    ProcessRoute(
        "periodic-orbits",
        "submit_periodic_orbits",
        "Periodic orbit",
        "Compute the periodic orbit near some impacts, with its multipliers, and whether it is a motion.",
        {
            "default oscillator": {
                "value": {"omega": 0.29, "clearance": 1.6, "motion": {"period": 1, "stops": [1, 1, -1, -1]}}
            },
        },
    ),
    ProcessRoute(
        "orbit-branches",
        "submit_orbit_branches",
        "Branch of a periodic orbit",
        "Follow the branch of a periodic orbit over a parameter, with its special points and what lies beyond them.",
        {
            "default oscillator": {
                "value": {
                    "omega": 0.27,
                    "clearance": 1.85,
                    "motion": {"period": 1, "stops": [1]},
                    "range": {"start": 1.8, "stop": 1.9},
                }
            },
            "over restitution": {
                "value": {
                    "omega": 0.29,
                    "clearance": 1.6,
                    "motion": {"period": 1, "stops": [1, 1, -1, -1]},
                    "vary": "restitution",
                    "range": {"start": 0.5, "stop": 1.0},
                }
            },
        },
    ),
    ProcessRoute(
        "bifurcation-curves",
        "submit_bifurcation_curves",
        "Bifurcation curves",
        "Compute the curves SN, PD, SB, NS and GR of motions in a window of omega and clearance.",
        {
            "the paper's window": {
                "value": {"omega": {"start": 0.26, "stop": 0.3}, "clearance": {"start": 1.3, "stop": 2.05}}
            },
            "of a motion": {
                "value": {
                    "omega": {"start": 0.26, "stop": 0.3},
                    "clearance": {"start": 1.3, "stop": 2.05},
                    "motions": [{"period": 1, "stops": [1, 1, -1, -1], "omega": 0.28, "clearance": 1.5}],
                }
            },
        },
    ),
)


def _endpoint(route: ProcessRoute) -> Callable[..., Coroutine[Any, Any, Response]]:
    async def submit(body: Any, submission: Any) -> Response:
        return await submission.post(route.process, body)  # type: ignore[no-any-return]

    examples: Any = route.examples
    submit.__annotations__ = {
        "body": Annotated[PROCESSES[route.process], Body(openapi_examples=examples)],
        "submission": NewSubmission,
        "return": Response,
    }
    submit.__name__, submit.__doc__ = route.operation_id, route.description
    return submit


router = APIRouter(route_class=JsonRoute, tags=["processes"])
for _route in ROUTES:
    router.add_api_route(
        f"{PREFIX}/{_route.process}",
        _endpoint(_route),
        methods=["POST"],
        operation_id=_route.operation_id,
        summary=_route.summary,
        status_code=201,
        response_description="A new job.",
        responses={
            200: {"model": Job, "description": "The job that computes, or has computed, the same request."},
            201: {"model": Job, "description": "A new job; Location says where."},
            **problem_responses(*SUBMISSION_KINDS),
        },
    )

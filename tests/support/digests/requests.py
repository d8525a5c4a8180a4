"""The requests whose results have recorded digests, by process and by a name of their own.

They have every kind of machine: chains of 1, 2, 3 and 5 masses, matrices, one and several harmonics, bases that move,
preload; both stops, alike or not, or one; and every kind of result. No label is decided by round-off: trajectories
settle, or are chaotic and far from where they would not be.

`TIERS` are in three parts. `make test` compares the bytes of those that are quick, whose kernels take little to compile
for x86-64-v3 too; of maps of the chain it compares the labels, with the kernels for this processor that it has anyway.
`make digests-all` compares the bytes of all.
"""

from __future__ import annotations

from typing import Any

Body = dict[str, Any]

ONE: Body = {"masses": [1.0], "stiffnesses": [1.0], "damping": 0.05, "forcing": [1.0], "restitution": 0.8}
TWO: Body = {
    "masses": [1.0, 2.0],
    "stiffnesses": [1.0, 2.0],
    "damping": [0.05, 0.03],
    "forcing": [1.0, 0.3],
    "restitution": 0.7,
}
FIVE: Body = {
    "masses": [1.0, 10.0, 10.0, 5.0, 5.0],
    "stiffnesses": [1.0, 5.0, 5.0, 4.0, 3.0],
    "damping": 0.05,
    "forcing": [1.0, 0.0, 0.0, 0.0, 0.0],
    "restitution": 0.8,
}
# matrices that are not symmetric, a row of contact, two harmonics, two restitutions, preload
GENERAL: Body = {
    "matrices": {
        "mass": [[0.84, 0.1323, 0.1237], [0.1323, 3.1989, 0.4166], [0.1237, 0.4166, 2.073]],
        "damping": [[0.3485, 0.3693, 0.059], [-0.3271, 0.0281, 0.382], [-0.2735, -0.4549, 0.1959]],
        "stiffness": [[1.578, -0.3065, 0.6138], [-0.3065, 1.5706, -0.4808], [0.6138, -0.4808, 2.6448]],
    },
    "contact": {"row": [1.0, -2.5, 0.3]},
    "forcing": [
        {"amplitude": [1.0, -0.4, 0.2], "phase": [0.3, 0.0, 2.0]},
        {"amplitude": [0.1, 0.2, 0.0], "phase": [0.0, 1.0, 0.0], "harmonic": 2, "law": "unbalance"},
    ],
    "restitution": {"right": 0.7, "left": 0.45},
    "bias": [0.05, -0.02, 0.1],
}
PRELOADED: Body = {
    "matrices": {"mass": [[1.0]], "damping": [[0.1]], "stiffness": [[1.0]]},
    "forcing": {"amplitude": [1.0], "phase": [1.5707963267948966]},
    "bias": [0.1],
    "restitution": {"right": 0.8, "left": 0.7},
}
ODD: Body = {
    "forcing": [
        {"amplitude": [1.0, 0.0, 0.0]},
        {"amplitude": [0.3, 0.0, 0.0], "phase": [0.3, 0.0, 0.0], "harmonic": 3},
    ]
}
SHAKEN: Body = {"base": {"amplitude": 2.0, "phase": 0.4, "stops_move": True}}
DAMPER: Body = {
    "matrices": {
        "mass": [[10.0, 0.0], [0.0, 1.0]],
        "damping": {"modal": 0.02},
        "stiffness": [[12.0, -2.0], [-2.0, 2.0]],
    },
    "contact": [2, 1],
    "base": {"amplitude": 0.1, "stops_move": False, "influence": [1.0, 1.0]},
}
BETWEEN: Body = {"contact": [1, 2], "restitution": {"right": 0.6, "left": 0.9}, "bias": [0.1, 0.0, 0.0]}

CHAOTIC: Body = {
    "masses": [1.0, 2.0, 2.0],
    "stiffnesses": [1.0, 2.0, 2.0],
    "damping": 0.02,
    "forcing": [1.0, 0.0, 0.0],
    "restitution": 0.95,
}

OMEGA: Body = {"start": 0.275, "stop": 0.285}
ONE_IMPACT: Body = {"period": 1, "stops": [1]}
TWO_A_SIDE: Body = {"period": 1, "stops": [1, 1, -1, -1]}
POINT: Body = {"omega": 0.29, "clearance": 1.6}
ORBIT: Body = {"omega": 0.27, "clearance": 1.85, "motion": ONE_IMPACT}
UNEQUAL: Body = {"right": 0.9, "left": 1.3}
ASKED: Body = {
    "observables": ["impulse", "dissipated_power", "mean_impact_speed_right", "peak_displacement_left"],
    "outputs": {"spring": {"displacement": [1, -1, 0], "unit": "N"}, "rate": {"velocity": [1, 0, 0]}},
}
MAP: Body = {
    "omega": {"start": 0.27, "stop": 0.3, "points": 4},
    "clearance": {"start": 1.55, "stop": 2.0, "points": 8},
    "max_periods": 400,
}


def _over(vary: str, start: float, stop: float, points: int | None = None) -> Body:
    """Return an axis, of a map with a number of points."""
    return {"vary": vary, "values": {"start": start, "stop": stop, **({"points": points} if points else {})}}


def _states(across: float, rate: float, points: int) -> Body:
    """Return the rectangle of a basin."""
    return {
        "horizontal": {"quantity": "displacement", "values": {"start": -across, "stop": across, "points": points}},
        "vertical": {"quantity": "velocity", "values": {"start": -rate, "stop": rate, "points": points}},
    }


_QUICK: dict[str, dict[str, Body]] = {
    "structures": {
        "chain": {"omega": {"start": 0.2, "stop": 0.4, "points": 5}, "times": [1.0, 2.0], "clearance": 1.6},
        "one mass": {"oscillator": ONE, "omega": [0.5, 1.0], "times": [1.0]},
        "two masses": {"oscillator": TWO, "omega": [0.5, 1.0], "times": [1.0]},
        "five masses": {"oscillator": FIVE, "omega": [0.2, 0.3], "times": [1.0]},
        "general": {"oscillator": GENERAL, "omega": [0.8, 0.9], "times": [0.0, 1.0], "clearance": UNEQUAL},
        "damper": {"oscillator": DAMPER, "omega": [0.9, 1.0, 1.1], "clearance": {"right": 0.5, "left": 0.3}},
    },
    "grazing-curves": {
        "chain": {"omega": {**OMEGA, "points": 11}, "max_order": 4},
        "sequence": {"omega": {**OMEGA, "points": 5}, "max_order": 3, "sequence": True},
        "one mass": {"oscillator": ONE, "omega": {"start": 0.3, "stop": 1.3, "points": 12}},
        "five masses": {"oscillator": FIVE, "omega": {"start": 0.2, "stop": 0.3, "points": 12}},
        "general": {"oscillator": GENERAL, "omega": {"start": 0.7, "stop": 1.2, "points": 24}},
        "general, one stop": {"oscillator": GENERAL, "omega": [0.8, 0.9, 1.0], "clearance": {"left": None}},
        "harmonics": {"oscillator": ODD, "omega": {"start": 0.2, "stop": 0.6, "points": 50}},
        "between two masses": {"oscillator": BETWEEN, "omega": [0.29, 0.3], "clearance": {"right": 9.0}},
        "shaken": {"oscillator": SHAKEN, "omega": {"start": 0.2, "stop": 0.4, "points": 10}},
    },
    "codimension-two-points": {
        "chain": {"omega": {"start": 0.25, "stop": 0.35}, "max_order": 4},
        "two masses": {"oscillator": TWO, "omega": {"start": 0.4, "stop": 0.9}, "max_order": 4, "max_multiple": 2},
        "general": {"oscillator": GENERAL, "omega": {"start": 0.7, "stop": 1.2}, "clearance": {"left": 1.3}},
        "harmonics": {"oscillator": ODD, "omega": {"start": 0.2, "stop": 0.6}, "clearance": {"left": 3.0}},
    },
    "discontinuity-mappings": {
        "exact": {"omega": 0.29, "overshoot": [1e-4, 1e-6, 1e-8], "stop": "C", "returns": 4},
        "leading": {"omega": 0.29, "overshoot": [1e-4, 1e-6, 1e-8], "order": "leading", "returns": 4},
        "five masses": {"oscillator": FIVE, "omega": 0.29, "overshoot": [1e-4, 1e-6], "returns": 2},
        "one stop": {
            "oscillator": BETWEEN,
            "omega": 0.29,
            "overshoot": [1e-4, 1e-6],
            "stop": "C",
            "returns": 3,
            "clearance": {"right": None},
        },
        "general": {
            "oscillator": GENERAL,
            "omega": 0.9,
            "overshoot": [1e-4, 1e-6],
            "returns": 2,
            "clearance": {"left": 5.0},
        },
    },
    "trajectories": {
        "chain": {**POINT, "periods": 6, "transient_periods": 200, "samples_per_period": 8, **ASKED},
        "states": {
            **POINT,
            "periods": 2,
            "samples_per_period": 8,
            "initial": [{}, {"phase": 1.0}, {"displacement": [1.6, 0.0, 0.0], "velocity": [0.5, 0.0, 0.0]}],
        },
        "at times": {**POINT, "periods": 2, "times": [0.0, 0.1, 30.0]},
        "resting": {"omega": 0.29, "clearance": 0.4, "periods": 3, "oscillator": {"restitution": 0.2}},
        "one mass": {"oscillator": ONE, "omega": 0.8, "clearance": 0.5, "periods": 8, "samples_per_period": 8},
        "two masses": {"oscillator": TWO, "omega": 0.7, "clearance": 0.6, "periods": 4, "samples_per_period": 8},
        "five masses": {"oscillator": FIVE, **POINT, "periods": 4, "samples_per_period": 8},
        "general": {"oscillator": GENERAL, "omega": 0.9, "clearance": UNEQUAL, "periods": 4, "samples_per_period": 8},
        "one stop": {
            "oscillator": BETWEEN,
            "omega": 0.29,
            "clearance": {"right": 0.8, "left": None},
            "periods": 4,
            "samples_per_period": 8,
        },
        "damper": {
            "oscillator": DAMPER,
            "omega": 1.0,
            "clearance": {"right": 0.5, "left": 0.3},
            "periods": 4,
            "samples_per_period": 8,
        },
        "shaken": {"oscillator": SHAKEN, "omega": 0.29, "clearance": 0.1, "periods": 4, "samples_per_period": 8},
    },
    "periodic-orbits": {
        "chain": {**POINT, "motion": TWO_A_SIDE, **ASKED},
        "one impact": ORBIT,
        "from rest": {"omega": 0.27, "clearance": 1.85},
        "resting": {"omega": 0.27, "clearance": 0.85},
        "none": {"omega": 0.27, "clearance": 1.85, "motion": {"period": 1, "stops": [1, 1, 1]}},
        "one mass": {"oscillator": PRELOADED, "omega": 0.8, "clearance": {"right": 1.2, "left": 1.3}},
        "five masses": {"oscillator": FIVE, "omega": 0.27, "clearance": 1.2, "transient_periods": 400},
        "general": {"oscillator": GENERAL, "omega": 0.9, "clearance": UNEQUAL, "transient_periods": 400},
    },
    "orbit-branches": {
        "clearance": {**ORBIT, "range": {"start": 1.83, "stop": 1.88}, "max_points": 60},
        "restitution": {
            **POINT,
            "motion": TWO_A_SIDE,
            "vary": "restitution",
            "range": {"start": 0.75, "stop": 0.85},
            "max_points": 30,
        },
        "one stop": {
            "oscillator": PRELOADED,
            "omega": 0.8,
            "clearance": {"right": 2.1, "left": None},
            "motion": ONE_IMPACT,
            "vary": "bias",
            "range": {"start": 0.5, "stop": 1.5},
            "max_points": 30,
        },
    },
    "bifurcation-curves": {
        "chain": {
            "omega": {"start": 0.26, "stop": 0.3},
            "clearance": {"start": 1.3, "stop": 2.05},
            "max_multiple": 1,
            "points": 24,
        },
        "one mass": {
            "oscillator": PRELOADED,
            "omega": {"start": 0.75, "stop": 0.85},
            "clearance": {"right": {"start": 1.0, "stop": 3.0}, "left": 2.0},
            "max_multiple": 1,
            "points": 24,
        },
        "forcing": {
            "horizontal": _over("omega", 0.265, 0.295),
            "vertical": _over("forcing", 0.8, 1.2),
            "clearance": 1.87,
            "points": 24,
            "max_multiple": 1,
        },
    },
    "proofs": {
        "codimension two": {
            "statement": {"kind": "codimension-two", "type": "g", "order": 2, "range": {"start": 0.282, "stop": 0.283}},
            "time_limit": 600,
        },
        "orbit": {"statement": {"kind": "orbit", **POINT, "motion": TWO_A_SIDE}, "time_limit": 600},
    },
}

_MAPS: dict[str, dict[str, Body]] = {
    "trajectories": {
        "other starts": {
            "oscillator": {**ONE, "damping": 0.04},
            "omega": 1.5,
            "clearance": {"right": 1.1, "left": None},
            "periods": 2,
            "transient_periods": 300,
            "samples_per_period": 8,
            "other_starts": 32,
        },
    },
    "unfolding-maps": {
        "other starts": {
            "oscillator": {**ONE, "damping": 0.04},
            "omega": {"start": 1.45, "stop": 1.55, "points": 50},
            "clearance": {"right": {"start": 1.05, "stop": 1.2, "points": 80}, "left": None},
            "max_periods": 300,
        },
        "chain": MAP,
        "sweep": {**MAP, "policy": "sweep-down", "oscillator": {"restitution": 0.6}, "max_periods": 200},
        "ensemble": {
            **MAP,
            "omega": [0.27, 0.29],
            "clearance": [1.6, 1.7, 1.9927],
            "policy": "ensemble",
            "initial_conditions": 3,
        },
        "preview": {**MAP, "preview": True},
        "one stop": {**MAP, "clearance": {"right": MAP["clearance"]}},
        "general": {
            "oscillator": GENERAL,
            "omega": {"start": 0.8, "stop": 1.0, "points": 4},
            "clearance": {"right": {"start": 0.7, "stop": 1.5, "points": 4}, "left": 1.3},
            "max_periods": 200,
        },
    },
    "bifurcation-diagrams": {
        "chain": {"vary": "clearance", "range": [1.6, 1.99, 2.1], "omega": 0.29, "periods": 8},
        "sweep": {
            "vary": "restitution",
            "range": {"start": 0.7, "stop": 0.9, "points": 4},
            **POINT,
            "periods": 8,
            "policy": "sweep-up",
        },
    },
    "basins": {
        "chain": {"omega": 0.29, "clearance": 1.9927, **_states(1.9, 1.0, 6), "max_periods": 400},
        "chaotic": {
            "oscillator": CHAOTIC,
            "omega": 1.1,
            "clearance": 0.3,
            **_states(0.15, 0.1, 2),
            "max_periods": 100,
        },
    },
    "basin-fractions": {
        "chain": {
            "vary": "clearance",
            "range": {"start": 1.99, "stop": 1.999, "points": 3},
            "omega": 0.29,
            "states": 10,
            "max_periods": 400,
        },
    },
    "unfolding-diagrams": {
        "chain": {
            "omega": {"start": 0.27, "stop": 0.272, "points": 4},
            "clearance": {"start": 1.84, "stop": 1.87, "points": 6},
            "max_multiple": 1,
        },
    },
}

_MORE: dict[str, dict[str, Body]] = {
    "codimension-two-points": {
        "one mass": {"oscillator": ONE, "omega": {"start": 0.1, "stop": 1.3}, "max_multiple": 6},
        "five masses": {"oscillator": FIVE, "omega": {"start": 0.2, "stop": 0.4}},
        "shaken": {"oscillator": SHAKEN, "omega": {"start": 0.2, "stop": 0.4}},
    },
    "periodic-orbits": {
        "not met": {"omega": 0.29, "clearance": 1.6, "motion": {"period": 2, "stops": [1, 1, -1, -1] * 2}},
        "two masses": {"oscillator": TWO, "omega": 0.7, "clearance": 0.9, "transient_periods": 400},
        "damper": {
            "oscillator": DAMPER,
            "omega": 1.0,
            "clearance": {"right": 0.5, "left": 0.3},
            "transient_periods": 400,
        },
    },
    "orbit-branches": {
        "omega": {**ORBIT, "vary": "omega", "range": {"start": 0.265, "stop": 0.275}, "max_points": 100},
        "observed": {**ORBIT, "range": {"start": 1.83, "stop": 1.88}, "max_points": 20, **ASKED},
        "damping": {**ORBIT, "vary": "damping", "range": {"start": 0.9, "stop": 1.1}, "max_points": 40},
        "mass": {**ORBIT, "vary": "masses[2]", "range": {"start": 9.5, "stop": 10.5}, "max_points": 40},
        "forcing": {**POINT, "motion": TWO_A_SIDE, "vary": "forcing", "range": {"start": 0.95, "stop": 1.05}},
        "five masses": {"oscillator": FIVE, **ORBIT, "range": {"start": 1.83, "stop": 1.88}, "max_points": 40},
        "general": {
            "oscillator": GENERAL,
            "omega": 0.9,
            "clearance": UNEQUAL,
            "vary": "omega",
            "range": {"start": 0.85, "stop": 0.95},
            "max_points": 40,
        },
    },
    "bifurcation-curves": {
        "motions": {
            "omega": {"start": 0.26, "stop": 0.3},
            "clearance": {"start": 1.3, "stop": 2.05},
            "motions": [{**TWO_A_SIDE, "omega": 0.28, "clearance": 1.5}],
        },
        "motions of one stop": {
            "oscillator": PRELOADED,
            "omega": {"start": 0.75, "stop": 0.85},
            "clearance": {"right": {"start": 1.0, "stop": 3.0}},
            "motions": [ONE_IMPACT],
        },
        "restitution": {
            "horizontal": _over("omega", 0.265, 0.295),
            "vertical": _over("restitution", 0.5, 0.9),
            "clearance": 1.87,
            "max_multiple": 1,
        },
        "two clearances": {
            "horizontal": _over("clearance_right", 1.8, 1.9),
            "vertical": _over("clearance_left", 1.8, 2.0),
            "omega": 0.27,
            "motions": [{**ONE_IMPACT, "horizontal": 1.85, "vertical": 1.9}],
        },
    },
    "proofs": {
        "unstable": {
            "statement": {"kind": "orbit", "omega": 0.27, "clearance": 1.86, "motion": ONE_IMPACT, "stable": False},
            "time_limit": 600,
        },
        "attraction": {"statement": {"kind": "attraction", **POINT, "label": "1-2r-2l"}, "time_limit": 600},
        "disproof": {"statement": {"kind": "attraction", **POINT, "label": "1-1r-1l"}, "time_limit": 600},
        "bifurcation": {
            "statement": {
                "kind": "bifurcation",
                **ORBIT,
                "type": "SN",
                "vary": "clearance",
                "range": {"start": 1.8, "stop": 1.95},
            },
            "time_limit": 600,
        },
        "one mass": {
            "oscillator": PRELOADED,
            "statement": {
                "kind": "codimension-two",
                "type": "g",
                "order": 2,
                "stop": "A",
                "range": {"start": 0.3, "stop": 0.9},
            },
            "time_limit": 600,
        },
    },
    "unfolding-maps": {
        "resolved": {"omega": [0.29, 0.3], "clearance": [1.55, 1.6], "max_periods": 400, "resolve_sensitive": True},
        "adaptive": {
            "omega": {"start": 0.272, "stop": 0.29, "points": 20},
            "clearance": {"start": 1.84, "stop": 1.99, "points": 30},
            "max_periods": 100,
            "adaptive": True,
        },
        "adaptive preview": {**MAP, "adaptive": True, "preview": True},
        "observed": {**MAP, **ASKED},
        "axes": {
            "horizontal": _over("restitution", 0.5, 0.9, 4),
            "vertical": _over("omega", 0.26, 0.3, 4),
            "clearance": {"right": 1.6},
            "max_periods": 200,
        },
        "damping": {
            "horizontal": _over("omega", 0.27, 0.29, 4),
            "vertical": _over("damping", 0.8, 1.2, 4),
            "clearance": 1.6,
            "max_periods": 200,
        },
        "one mass": {
            "oscillator": ONE,
            "omega": {"start": 0.7, "stop": 0.9, "points": 5},
            "clearance": {"start": 0.8, "stop": 2.5, "points": 5},
            "max_periods": 200,
        },
        "two masses": {
            "oscillator": TWO,
            "omega": {"start": 0.6, "stop": 0.8, "points": 5},
            "clearance": {"start": 0.9, "stop": 2.5, "points": 5},
            "max_periods": 200,
        },
        "five masses": {**MAP, "oscillator": FIVE, "max_periods": 200},
        "damper": {
            "oscillator": DAMPER,
            "omega": {"start": 0.9, "stop": 1.1, "points": 4},
            "clearance": {"left": {"start": 0.3, "stop": 0.6, "points": 4}, "right": 0.5},
            "max_periods": 200,
        },
    },
    "bifurcation-diagrams": {
        "damping": {"vary": "damping", "range": {"start": 0.9, "stop": 1.1, "points": 3}, **POINT, "periods": 8},
        "observed": {"vary": "clearance", "range": [1.6, 2.1], "omega": 0.29, "periods": 8, **ASKED},
        "one mass": {
            "oscillator": PRELOADED,
            "vary": "omega",
            "range": [0.75, 0.8],
            "clearance": {"right": 1.2, "left": 1.3},
            "periods": 8,
        },
        "general": {
            "oscillator": GENERAL,
            "vary": "clearance_right",
            "range": [0.9, 1.3],
            "clearance": {"left": 1.3},
            "omega": 0.9,
            "periods": 8,
        },
    },
    "basins": {
        "one mass": {
            "oscillator": PRELOADED,
            "omega": 0.8,
            "clearance": {"right": 1.2, "left": 1.3},
            **_states(1.1, 1.0, 6),
            "max_periods": 200,
        },
        "larger": {"omega": 0.29, "clearance": 1.9927, **_states(1.9, 1.0, 64), "max_periods": 400},
    },
    "basin-fractions": {
        "two masses": {
            "oscillator": TWO,
            "vary": "omega",
            "range": [0.65, 0.7],
            "clearance": 1.2,
            "states": 10,
            "max_periods": 200,
        },
    },
    "unfolding-diagrams": {
        "borders": {
            "omega": {"start": 0.27, "stop": 0.272, "points": 4},
            "clearance": {"start": 1.84, "stop": 1.87, "points": 6},
            "max_multiple": 1,
            "borders": True,
        },
        "one stop": {
            "omega": {"start": 0.279, "stop": 0.286, "points": 5},
            "clearance": {"right": {"start": 1.86, "stop": 1.97, "points": 5}},
            "max_periods": 300,
            "max_order": 4,
            "max_multiple": 1,
            "borders": True,
        },
        "forcing": {
            "horizontal": _over("omega", 0.27, 0.29, 5),
            "vertical": _over("forcing", 0.95, 1.05, 5),
            "clearance": 1.89,
            "max_periods": 300,
            "max_multiple": 1,
            "borders": True,
        },
        "two stops": {
            "horizontal": _over("clearance_right", 1.84, 1.9, 5),
            "vertical": _over("clearance_left", 1.84, 1.9, 5),
            "omega": 0.27,
            "max_periods": 300,
            "max_multiple": 1,
            "borders": True,
        },
    },
}

TIERS = {"quick": _QUICK, "maps": _MAPS, "more": _MORE}
"""Requests by part, process and name."""

"""For any JSON the answer is below 500 and repeats nothing, and there is a job only if the models accept it."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from grazemap.wire import PROCESSES, parse_request
from grazemap_worker.store import Store

NUMBERS = st.one_of(
    st.floats(),
    st.integers(),
    st.sampled_from([0, -0.0, 1, 5e-324, 1e308, 10**400, -(10**30), 2**63]),
)
FIELDS = sorted(
    {name for model in PROCESSES.values() for name in model.model_fields}
    | {"masses", "stiffnesses", "damping", "forcing", "restitution", "units", "start", "stop", "points", "phase"}
)
NAMES = st.one_of(st.sampled_from(FIELDS), st.text(max_size=8))
JSON = st.recursive(
    st.one_of(st.none(), st.booleans(), NUMBERS, st.text(max_size=8), st.just("SI")),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(NAMES, inner, max_size=5)),
    max_leaves=12,
)
RANGE = st.one_of(
    st.fixed_dictionaries({"start": NUMBERS, "stop": NUMBERS, "points": st.one_of(st.integers(-1, 5), NUMBERS)}),
    st.lists(NUMBERS, max_size=4),
    JSON,
)
STATE = st.fixed_dictionaries(
    {}, optional={"displacement": st.lists(NUMBERS, max_size=3), "velocity": NUMBERS, "phase": NUMBERS}
)
# Sizes that fit together, so that the matrices themselves are looked at.
SOME = st.one_of(st.floats(-3.0, 3.0), NUMBERS)
ROW = st.lists(SOME, min_size=2, max_size=2)
MATRIX = st.one_of(st.lists(ROW, min_size=2, max_size=2), st.sampled_from([[[2, 0], [0, 1]], [[1, -1], [-1, 1]]]))
HARMONIC = st.fixed_dictionaries(
    {"amplitude": ROW}, optional={"phase": ROW, "law": st.just("unbalance"), "harmonic": SOME}
)
STRUCTURE = st.fixed_dictionaries(
    {
        "matrices": st.fixed_dictionaries(
            {
                "mass": MATRIX,
                "stiffness": MATRIX,
                "damping": st.one_of(
                    MATRIX, st.fixed_dictionaries({"modal": SOME}), st.fixed_dictionaries({"rayleigh": ROW})
                ),
            }
        )
    },
    optional={
        "contact": st.one_of(SOME, ROW, st.fixed_dictionaries({"row": ROW}), st.just([1, 2])),
        "forcing": st.one_of(ROW, HARMONIC, st.lists(HARMONIC, max_size=2)),
        "base": st.fixed_dictionaries({"amplitude": SOME, "stops_move": st.booleans()}, optional={"influence": ROW}),
        "bias": ROW,
        "restitution": st.fixed_dictionaries({"right": SOME, "left": SOME}),
    },
)
# Close to a right request, so that what lies behind the models is reached too.
REQUESTS = st.fixed_dictionaries(
    {"omega": RANGE},
    optional={
        "clearance": RANGE,
        "periods": NUMBERS,
        "initial": st.one_of(STATE, st.lists(STATE, max_size=3)),
        "times": st.lists(NUMBERS, max_size=4),
        "max_order": NUMBERS,
        "oscillator": st.one_of(
            STRUCTURE,
            st.fixed_dictionaries(
                {},
                optional={
                    "masses": st.lists(NUMBERS, max_size=3),
                    "stiffnesses": st.lists(NUMBERS, max_size=3),
                    "forcing": st.lists(NUMBERS, max_size=3),
                    "damping": st.one_of(NUMBERS, st.lists(NUMBERS, max_size=3)),
                    "restitution": NUMBERS,
                },
            ),
        ),
    },
)


@pytest.mark.parametrize("examples", [30, pytest.param(400, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("process", PROCESSES)
def test_any_json_gets_an_answer_and_a_job_only_if_the_models_accept_it(
    client: TestClient, store: Store, process: str, examples: int
) -> None:
    @settings(max_examples=examples, deadline=None, suppress_health_check=list(HealthCheck))
    @given(body=st.one_of(REQUESTS, JSON))
    def answered(body: Any) -> None:
        # surrogates as escapes, NaN and Infinity as Python writes them
        answer = client.post(f"/v1/{process}", content=json.dumps(body), headers={"Content-Type": "application/json"})
        assert answer.status_code in {200, 201, 400, 422}
        json.loads(answer.content)
        if answer.status_code >= 400:
            assert answer.headers["content-type"] == "application/problem+json"
            assert answer.status_code == 400 or answer.json()["errors"]
            assert store.jobs.page() == ([], None)
        else:
            parse_request(process, body)
            store.redis.flushall()

    answered()

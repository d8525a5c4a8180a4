"""The OpenAPI document of the routes, with problems, keys, and the types of jobs and results."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from threading import Lock
from typing import Any

from anyio.to_thread import run_sync
from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.requests import Request
from starlette.responses import Response

from grazemap.wire import PROCESSES
from grazemap.wire.problems import make_problem
from grazemap_service.answer_examples import answers_to
from grazemap_service.jobs import PREFIX
from grazemap_service.middleware import GUIDE, OPEN_PATHS
from grazemap_service.problems import MEDIA_TYPE
from grazemap_service.result_schemas import (
    BATCH_ITEM,
    JOB,
    job_components,
    job_name,
    one_of,
    reference,
    result_components,
)

_JSON = "application/json"
_PROBLEM = {"$ref": "#/components/schemas/Problem"}
# Problems of every operation below /v1.
_COMMON_KINDS = ("key-required", "internal-error", "store-unavailable", "storage-full")
SUBMISSION_KINDS = (
    "malformed-json",
    "body-too-large",
    "unsupported-media-type",
    "invalid-request",
    "too-much-work",
    "queue-full",
)
# The links are relative, so that they also lead there behind a proxy that adds a prefix.
DESCRIPTION = f"""\
[Explorer](.) · [Guide]({GUIDE.removeprefix("/")}/)

Grazing bifurcations of impact oscillators: grazing curves, codimension-two points, discontinuity
mappings, trajectories, bifurcation diagrams, unfolding maps, basins of attraction,
periodic orbits and their branches, and proofs with certificates.

1. **Post** a request to a process; the answer is a job, and `Location` is its address.
2. **Wait** until its `status` is `successful`: request the job again, follow its events, or post with the header
   `Prefer: wait=30`.
3. **Open the result**, `/v1/jobs/{{job_id}}/result`, as JSON, npz, a table (`?f=csv`) or a picture (`?f=png`).

Equal requests have the same job, also of different clients. Every error is a problem after RFC 9457.

- **Oscillator**: a chain of masses, the last one joined to the ground, or `matrices`. Without a `contact` the first
  mass moves between the stops, at +clearance and -clearance, or at `{{"right": .., "left": ..}}`, of which one may be
  null. Without `"units": "SI"` all numbers are nondimensional. In SI `omega` is in rad/s, `clearance` in m, and a list
  of dampings in N s/m. A single `damping` is the factor gamma of C = 2 gamma K, in s.
- **Numbers** are 0, or between 1e-60 and 1e60 in size. An integer is written without a decimal point.
- **Motions** n-p_r-q_l repeat after n periods of the forcing, with p impacts on the right stop and q on the left
  one. -1: the stop is not touched, or absent; 0: the contact rests on it without an impact; -2: infinitely many
  impacts.
- **verified**: the periodic orbit is isolated, admissible and stable, and n is its minimum period. Where a trajectory
  is named after it, as in a map, the orbit also captures the trajectory, which is not sensitive.
- **Waiting**: `waiting_for` of an unfinished job says why it does not advance.

In Python, `grazemap.Client` has a method for each process, and every result a `plot()`; `help(grazemap.Client)` lists
them. On the command line, `grazemap PROCESS --help` lists the flags of a process. The fields of every result are under
**Schemas** at the end of this page.
"""
_JOBS = """\
1. Post a request to a process: the answer has the job's `id`.
2. Wait until its `status` is `successful`: request the job again, or follow its events.
3. Open its result.
"""
TAGS = [
    {
        "name": "processes",
        "description": "Requests for computations; each is answered with a job. Fields with a default may be left out.",
    },
    {"name": "jobs", "description": _JOBS},
    {"name": "results", "description": "Results of successful jobs, as JSON or npz; finished tiles of running maps."},
    {"name": "operations", "description": "The service's description and limits, its health, and its metrics."},
]


# Schemas in which a list has one number for each mass.
_OSCILLATOR_SCHEMAS = ("Oscillator", "Matrices", "ModalDamping", "ContactRow", "Forcing", "Base")


def problem_responses(*kinds: str) -> dict[int | str, dict[str, Any]]:
    """Return the `responses` of an operation that may answer with these kinds of problem."""
    responses: dict[int | str, dict[str, Any]] = {}
    for kind in kinds:
        problem = make_problem(kind)
        text = f"{problem.title}: {problem.detail}"
        content = responses.setdefault(
            problem.status, {"description": "", "content": {MEDIA_TYPE: {"schema": _PROBLEM, "examples": {}}}}
        )
        content["description"] = " ".join(filter(None, (content["description"], text)))
        content["content"][MEDIA_TYPE]["examples"][kind] = {"value": problem.model_dump(mode="json")}
    return responses


# The documents that this process has made, by what they depend on besides the code: keys, masses, addresses.
_MADE: dict[tuple[Any, ...], bytes] = {}
_MAKING = Lock()


def install(app: FastAPI, *, keys: bool, masses: int) -> Callable[[], bytes]:
    """Make the app answer with its OpenAPI document, and return what makes it, which later calls do not repeat.

    The arguments are those of `document`.
    """

    def made() -> bytes:
        variant = keys, masses, *(getattr(route, "path", None) for route in app.routes)
        with _MAKING:
            if variant not in _MADE:
                whole = document(app, keys=keys, masses=masses)
                _MADE[variant] = json.dumps(whole, ensure_ascii=False, separators=(",", ":")).encode()
            return _MADE[variant]

    async def answer(request: Request) -> Response:
        return Response(await run_sync(made), media_type="application/json")

    app.add_route("/openapi.json", answer, methods=["GET"], include_in_schema=False)
    return made


def document(app: FastAPI, *, keys: bool, masses: int) -> dict[str, Any]:
    """Return the OpenAPI document.

    Parameters
    ----------
    app : FastAPI
        The app with all its routes.
    keys : bool
        Whether the service requires a key.
    masses : int
        Maximum number of masses of an oscillator.
    """
    schema = get_openapi(title=app.title, version=app.version, description=DESCRIPTION, tags=TAGS, routes=app.routes)
    for path, operations in schema["paths"].items():
        for operation in operations.values():
            _correct(operation, common=path.startswith(PREFIX))
            if keys and path not in OPEN_PATHS:
                operation["security"] = [{"key": []}]
    components = schema.setdefault("components", {})
    for name in _OSCILLATOR_SCHEMAS:
        _limit_lists(components["schemas"][name], masses)
    _type_jobs_and_results(schema)
    _type_batches(schema)
    _give_answers(schema)
    for unused in ("HTTPValidationError", "ValidationError"):
        components.get("schemas", {}).pop(unused, None)
    if keys:
        components["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    _share(schema)
    return schema


def _share(schema: dict[str, Any]) -> None:
    """Move the parameters and problems of several operations into the components."""
    components = schema["components"]
    for kind, name_of in (("parameters", _parameter_name), ("responses", _problem_name)):
        uses = Counter(json.dumps(value) for _, _, value in _parts(schema, kind))
        shared: dict[str, Any] = {}
        for holder, place, value in _parts(schema, kind):
            name = name_of(value)
            if name and uses[json.dumps(value)] > 1 and shared.setdefault(name, value) == value:
                holder[place] = {"$ref": f"#/components/{kind}/{name}"}
        components[kind] = dict(sorted(shared.items()))


def _parts(schema: dict[str, Any], kind: str) -> Iterator[tuple[Any, Any, dict[str, Any]]]:
    """Yield the parameters or responses of all operations, each after what holds it, and its place there."""
    for operations in schema["paths"].values():
        for operation in operations.values():
            parts = operation.get(kind, [])
            for place, value in list(parts.items() if isinstance(parts, dict) else enumerate(parts)):
                yield parts, place, value


def _parameter_name(parameter: Mapping[str, Any]) -> str:
    name: str = parameter["name"]
    return name


def _problem_name(response: Mapping[str, Any]) -> str:
    """Return the kinds of problem as a name, for example "InvalidRequestOrTooMuchWork"; "" for another response."""
    kinds = response.get("content", {}).get(MEDIA_TYPE, {}).get("examples", ())
    return "Or".join(kind.title().replace("-", "") for kind in kinds)


def _limit_lists(schema: dict[str, Any], max_items: int) -> None:
    """Set the maximum length of every list in a schema that does not have one."""
    if schema.get("type") == "array":
        schema.setdefault("maxItems", max_items)
    inside = (*schema.get("properties", {}).values(), *schema.get("oneOf", ()), *schema.get("anyOf", ()))
    for part in (*inside, *filter(None, (schema.get("items"),))):
        _limit_lists(part, max_items)


def _type_jobs_and_results(schema: dict[str, Any]) -> None:
    """Replace the schema of all jobs by one schema for each process, and add the schemas of results."""
    schemas = schema["components"]["schemas"]
    schemas |= job_components(schemas.pop(JOB)) | result_components()
    for process in PROCESSES:
        responses = schema["paths"][f"{PREFIX}/{process}"]["post"]["responses"]
        for status in ("200", "201", "202"):
            responses[status]["content"][_JSON]["schema"] = reference(job_name(process))


def _give_answers(schema: dict[str, Any]) -> None:
    """Give examples to the answers of processes, and of one of them to those about jobs of any process."""
    paths = schema["paths"]

    def give(path: str, method: str, **examples: Any) -> None:
        for status, example in examples.items():
            paths[f"{PREFIX}{path}"][method]["responses"][status.strip("_")]["content"][_JSON]["example"] = example

    for process in PROCESSES:
        answers = answers_to(process)
        give(f"/{process}", "post", _200=answers.done, _201=answers.new, _202=answers.new)
        give(f"/{process}/estimate", "post", _200=answers.forecast)
    done = answers_to("grazing-curves").done
    give("/jobs", "get", _200={"jobs": [done], "links": [{"href": f"{PREFIX}/jobs?limit=50", "rel": "first"}]})
    for method in ("get", "delete"):
        give("/jobs/{job_id}", method, _200=done)


def _type_batches(schema: dict[str, Any]) -> None:
    """Replace the schema of a batch's items by one schema for each process, with that of its request."""
    schemas = schema["components"]["schemas"]
    item = schemas[BATCH_ITEM]
    names = {}
    for process, model in PROCESSES.items():
        names[process] = name = f"{model.__name__.removesuffix('Request')}{BATCH_ITEM}"
        own_properties = {"process": {"type": "string", "const": process}, "request": reference(model.__name__)}
        schemas[name] = {**item, "title": name, "properties": item["properties"] | own_properties}
    schemas[BATCH_ITEM] = one_of(names)


def _correct(operation: dict[str, Any], *, common: bool) -> None:
    """Remove the framework's 422 and its schema of events; with `common`, add the problems of all operations."""
    responses = operation["responses"]
    for response in responses.values():
        for media_type, content in response.get("content", {}).items():
            if media_type == "text/event-stream":  # OpenAPI 3.1 cannot say what an event is
                content["schema"] = {"description": "Server-sent events."}
    if _is_framework(responses.get("422", {})):
        del responses["422"]
    for parameter in operation.get("parameters", ()):
        _drop_null(parameter["schema"])
        parameter["schema"].pop("description", None)  # the parameter has the same
        if parameter["in"] in ("header", "query"):
            responses.setdefault("422", problem_responses("invalid-request")[422])
    if common:
        for status, response in problem_responses(*_COMMON_KINDS).items():
            responses.setdefault(str(status), response)


def _drop_null(schema: dict[str, Any]) -> None:
    """Remove null from the schema of a parameter: it may be left out, but it is never null."""
    options = [option for option in schema.get("anyOf", ()) if option != {"type": "null"}]
    if len(options) == 1:
        del schema["anyOf"]
        schema |= options[0]


def _is_framework(response: Mapping[str, Any]) -> bool:
    schema = response.get("content", {}).get("application/json", {}).get("schema", {})
    return str(schema.get("$ref", "")).endswith("/HTTPValidationError")

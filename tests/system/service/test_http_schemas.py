"""Results and jobs in the API's document: valid OpenAPI 3.1, typed throughout, and in agreement with the answers."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from openapi_spec_validator import OpenAPIV31SpecValidator
from starlette.testclient import TestClient

from grazemap.codec import decode_npz, encode_npz
from grazemap.results import SCHEMAS, VERSION, MotionShare, UnfoldingMap, schema_of
from grazemap.results.base import decode_result
from grazemap.wire import PROCESSES
from grazemap_service.representations import render
from grazemap_service.result_schemas import NUMERICS
from tests.support.sdk_documents import REQUESTS, document, npz


def in_json(process: str) -> dict[str, Any]:
    """A result as the service answers it."""
    whole, meta = decode_npz(npz(process))
    numerics = dict.fromkeys(NUMERICS, "x")
    answer: dict[str, Any] = json.loads(render(encode_npz(whole, {**meta, "numerics": numerics}), "json"))
    return answer


def validator(described: dict[str, Any], name: str) -> Draft202012Validator:
    return Draft202012Validator({"$ref": f"#/components/schemas/{name}", "components": described["components"]})


def test_the_document_is_valid(described: dict[str, Any]) -> None:
    assert list(OpenAPIV31SpecValidator(described).iter_errors()) == []
    events = described["paths"]["/v1/jobs/{job_id}/events"]["get"]["responses"]["200"]
    broken = copy.deepcopy({"openapi": described["openapi"], "info": described["info"], "paths": {"/events": {"get": {
        "responses": {"200": events}}}}})  # fmt: skip
    assert list(OpenAPIV31SpecValidator(broken).iter_errors()) == []
    broken["paths"]["/events"]["get"]["responses"]["200"]["content"]["text/event-stream"]["itemSchema"] = {}
    assert list(OpenAPIV31SpecValidator(broken).iter_errors()) != []


def test_no_object_is_without_fields(described: dict[str, Any]) -> None:
    def bare(value: Any, path: str) -> Iterator[str]:
        if isinstance(value, dict):
            if value.get("type") == "object" and not ({"properties", "additionalProperties"} & set(value)):
                yield path
            for key, item in value.items():
                yield from bare(item, f"{path}/{key}")
        elif isinstance(value, list):
            for number, item in enumerate(value):
                yield from bare(item, f"{path}/{number}")

    assert list(bare(described, "")) == []
    assert list(bare({"a": [{"type": "object"}]}, "")) == ["/a/0"]


@pytest.mark.parametrize("process", list(REQUESTS))
def test_every_result_is_as_described_and_identified_by_its_process(described: dict[str, Any], process: str) -> None:
    answer = in_json(process)
    assert (answer["process"], answer["schema"], answer["meta"]["schema"]) == (process.split()[0], VERSION, VERSION)
    result = validator(described, "Result")
    assert list(result.iter_errors(answer)) == []
    assert not result.is_valid({**answer, "process": "something-else"})
    needed = next(field.name for field in schema_of(process.split()[0], document(process)) if not field.optional)
    assert not result.is_valid({name: value for name, value in answer.items() if name != needed})


@pytest.mark.parametrize("process", ["unfolding-maps", "unfolding-diagrams", "unfolding-maps of computed points"])
def test_the_json_of_a_map_names_the_motion_of_every_point(process: str) -> None:
    answer = in_json(process)
    shown = answer.get("unfolding_map", answer)
    named = [[shown["motions"][place]["label"] for place in row] for row in shown["motion"]]
    umap = decode_result(npz(process))
    umap = getattr(umap, "unfolding_map", umap)
    assert isinstance(umap, UnfoldingMap)
    assert named == umap.labels().tolist()
    shares = [MotionShare(**share) for share in shown["motions"]]
    assert shares == umap.motions()


def test_results_and_jobs_have_the_process_as_a_constant(described: dict[str, Any]) -> None:
    schemas = described["components"]["schemas"]
    for union in ("Result", "Job"):
        mapping = schemas[union]["discriminator"]["mapping"]
        assert set(mapping) == set(PROCESSES)
        for process, target in mapping.items():
            member = schemas[target.rpartition("/")[2]]
            forms = [schemas[form["$ref"].rpartition("/")[2]] for form in member.get("oneOf", [])] or [member]
            assert {form["properties"]["process"]["const"] for form in forms} == {process}
    for schema in SCHEMAS:
        shown = schemas[f"{schema.name}Result"]["properties"]
        assert {field.name for field in schema} <= set(shown)
        assert all(shown[field.name]["description"] for field in schema)


def test_jobs_have_typed_requests(client: TestClient, described: dict[str, Any]) -> None:
    body = {"omega": [0.2, 0.3]}
    answer = client.post("/v1/grazing-curves", json=body).json()
    assert list(validator(described, "Job").iter_errors(answer)) == []
    assert list(validator(described, "GrazingCurvesJob").iter_errors(answer)) == []
    assert not validator(described, "Job").is_valid({**answer, "request": {**answer["request"], "axis": "x"}})
    posted = described["paths"]["/v1/grazing-curves"]["post"]["responses"]["201"]
    assert posted["content"]["application/json"]["schema"] == {"$ref": "#/components/schemas/GrazingCurvesJob"}


def test_a_generated_client_submits_a_map_and_reads_it(
    described: dict[str, Any], live_url: str, worker: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "openapi.json").write_text(json.dumps(described))
    folder = tmp_path / "grazemap_generated"
    made = subprocess.run(
        [sys.executable, "-m", "openapi_python_client", "generate", "--path", str(tmp_path / "openapi.json"),
         "--output-path", str(folder), "--meta", "none"],
        capture_output=True, text=True, timeout=200, check=True, env={"PATH": str(Path(sys.executable).parent)},
    )  # fmt: skip
    assert "arning" not in made.stdout + made.stderr
    monkeypatch.syspath_prepend(tmp_path)
    name = "grazemap_generated"
    models = import_module(f"{name}.models")
    body = models.UnfoldingMapsRequest.from_dict(PROCESSES["unfolding-maps"].long_form(REQUESTS["unfolding-maps"])[0])
    whole, meta = decode_npz(npz("unfolding-maps"))
    with import_module(f"{name}.client").Client(base_url=live_url) as client:
        job = import_module(f"{name}.api.processes.submit_unfolding_map").sync(client=client, body=body)
        assert isinstance(job, models.UnfoldingMapsJob)
        assert isinstance(job.request, models.UnfoldingMapsRequest)
        worker.finish(job.id, whole, meta)
        result = import_module(f"{name}.api.results.get_result").sync(job.id, client=client)
    assert isinstance(result, models.UnfoldingMapResult)
    assert result.verified == whole["verified"].tolist()
    assert result.least_impact_velocity == [[0.1, 0.2, 0.3], [0.4, None, None]]
    np.testing.assert_array_equal(result.omega, whole["omega"])
    assert result.meta.request.max_periods == 1000
    # every other result is read as the class of its process
    for process in REQUESTS:
        answer = in_json(process)
        classes = [getattr(models, f"{schema.name}Result") for schema in SCHEMAS if schema.process == answer["process"]]
        read = [model for model in classes if _reads(model, answer)]
        assert len(read) == 1
        assert read[0].from_dict(answer).to_dict() == answer


def _reads(kind: Any, answer: dict[str, Any]) -> bool:
    try:
        kind.from_dict(answer)
    except (KeyError, TypeError, ValueError, AttributeError):
        return False
    return True

"""Clients that are generated from the API's document, and the examples in other languages, against a whole stack.

What a machine does not have is skipped; `make languages` installs what Debian and npm offer.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

import httpx2
import pytest

from grazemap.local_client import LocalClient

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples" / "languages"
# where make languages installs the packages of the TypeScript example
TYPESCRIPT = ROOT / ".cache" / "typescript"
OMEGA = {"start": 0.26, "stop": 0.30, "points": 24}
CLEARANCE = {"start": 1.3, "stop": 2.1, "points": 16}


def run(command: list[str], folder: Path, **environment: str) -> str:
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{done.stdout[-2000:]}\n{done.stderr[-2000:]}"
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def expected(stack: LocalClient) -> tuple[int, float]:
    """The number of motions of the examples' map, and the clearance at the end of their curve."""
    umap = stack.submit("unfolding-maps", {"omega": OMEGA, "clearance": CLEARANCE}).wait().result()
    curve = stack.submit("grazing-curves", {"omega": OMEGA}).wait().result()
    return len(umap.motions()), curve.clearance[-1]


def assert_said(output: str, expected: tuple[int, float]) -> None:
    (line,) = re.findall(r"(\d+) motions; .* clearance +([\d.]+)", output)
    assert int(line[0]) == expected[0]
    assert float(line[1]) == pytest.approx(expected[1], rel=1e-12)


@pytest.mark.parametrize(
    ("program", "arguments"),
    [
        ("Rscript", ["unfolding_map.R", "{url}", "{picture}"]),
        ("octave", ["--no-gui", "--quiet", "--eval", "unfolding_map('{url}', '{picture}')"]),
        ("matlab", ["-batch", "unfolding_map('{url}', '{picture}')"]),
        ("julia", ["unfolding_map.jl", "{url}", "{picture}"]),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_example_computes_and_draws_the_map(
    stack: LocalClient, expected: tuple[int, float], tmp_path: Path, program: str, arguments: list[str]
) -> None:
    if shutil.which(program) is None:
        pytest.skip(f"no {program}")
    picture = tmp_path / "map.png"
    words = [word.format(url=stack.base_url, picture=picture) for word in arguments]
    assert_said(run([program, *words], EXAMPLES), expected)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_client_generated_for_typescript(stack: LocalClient, expected: tuple[int, float]) -> None:
    packages = TYPESCRIPT / "node_modules"
    if shutil.which("npm") is None or not packages.is_dir():
        pytest.skip("no npm, or no packages for it: make languages installs them")
    for source in (EXAMPLES / "typescript").iterdir():
        shutil.copy(source, TYPESCRIPT)
    written = run(["npm", "run", "types"], TYPESCRIPT, GRAZEMAP_URL=stack.base_url)
    assert "warn" not in written.lower(), written
    # strict, as tsconfig.json says
    run(["npm", "run", "check"], TYPESCRIPT)
    assert_said(run(["npm", "run", "start"], TYPESCRIPT, GRAZEMAP_URL=stack.base_url), expected)
    # the types are those of the service: a field that it does not have is refused
    wrong = (TYPESCRIPT / "unfolding_map.ts").read_text("utf-8").replace("curve.clearance.at", "curve.clearances.at")
    (TYPESCRIPT / "unfolding_map.ts").write_text(wrong, "utf-8")
    with pytest.raises(AssertionError, match="clearances"):
        run(["npm", "run", "check"], TYPESCRIPT)


def test_a_client_generated_for_python(
    stack: LocalClient, expected: tuple[int, float], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = tmp_path / "openapi.json"
    document.write_text(json.dumps(httpx2.get(f"{stack.base_url}/openapi.json").json()), "utf-8")
    name = "grazemap_generated_for_stack"
    options = ["--path", str(document), "--output-path", str(tmp_path / name), "--meta", "none"]
    # without ruff on its path it has nothing to say
    written = run([sys.executable, "-m", "openapi_python_client", "generate", *options], tmp_path,
        PATH=str(Path(sys.executable).parent))  # fmt: skip
    assert "arning" not in written
    monkeypatch.syspath_prepend(tmp_path)
    models = import_module(f"{name}.models")
    follow = import_module(f"{name}.api.jobs.get_job")
    results = import_module(f"{name}.api.results.get_result")

    def compute(client: Any, process: str, body: Any) -> Any:
        job = import_module(f"{name}.api.processes.submit_{process}").sync(client=client, body=body)
        while str(job.status) in ("accepted", "running"):
            time.sleep(0.2)
            job = follow.sync(job.id, client=client)
        assert str(job.status) == "successful", job.problem
        return results.sync(job.id, client=client)

    with import_module(f"{name}.client").Client(base_url=stack.base_url) as client:
        omega = {"vary": "omega", "values": OMEGA}
        curve = compute(client, "grazing_curve", models.GrazingCurvesRequest.from_dict({"axis": omega}))
        clearance = {"vary": "clearance", "values": CLEARANCE}
        window = models.UnfoldingMapsRequest.from_dict({"horizontal": omega, "vertical": clearance})
        umap = compute(client, "unfolding_map", window)
    assert isinstance(curve, models.GrazingCurveResult)
    assert isinstance(umap, models.UnfoldingMapResult)
    assert (len(umap.motions), curve.clearance[-1]) == expected

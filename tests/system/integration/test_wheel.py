"""The wheel without extras, in an empty environment: a light client that computes a curve against a running service."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from grazemap.local_client import LocalClient

ROOT = Path(__file__).parents[3]
HEAVY = {"numba", "llvmlite", "scipy", "redis", "rq", "fastapi", "uvicorn", "matplotlib", "xarray", "tqdm"}

USE = """
import importlib.util, json, sys
import grazemap
loaded = sorted(set(sys.modules) & set({heavy!r}))
with grazemap.Client({url!r}) as client:
    curve = client.grazing_curve(omega=[0.1, 0.28109, 0.3], progress=True)
try:
    grazemap.local()
except grazemap.errors.MissingExtra as error:
    refusal = str(error)
print(json.dumps({{
    "file": grazemap.__file__,
    "loaded": loaded,
    "installed": [name for name in {heavy!r} if importlib.util.find_spec(name)],
    "clearance": curve.clearance[:2].tolist(),
    "refusal": refusal,
}}))
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (built,) = folder.glob("*.whl")
    return built


def constraints() -> str:
    """Return the tested versions without their hashes, which pip would demand of the wheel as well."""
    lines = (ROOT / "requirements.lock").read_text().splitlines()
    pins = [line.removesuffix("\\").strip() for line in lines if re.match(r"[A-Za-z0-9]", line)]
    assert len(pins) > 20
    return "\n".join(pins)


def test_in_an_empty_environment_the_light_client_works(wheel: Path, stack: LocalClient, tmp_path: Path) -> None:
    environment, pins = tmp_path / "venv", tmp_path / "constraints.txt"
    pins.write_text(constraints())
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(environment)], check=True)
    python = environment / "bin" / "python"
    install = ["install", "--quiet", "--disable-pip-version-check", "--no-compile", "--constraint", str(pins), wheel]
    subprocess.run([sys.executable, "-m", "pip", "--python", python, *install], check=True, timeout=300)

    code = USE.format(heavy=sorted(HEAVY), url=stack.base_url)
    done = subprocess.run(
        [python, "-E", "-W", "error", "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert Path(told["file"]).is_relative_to(environment)
    assert told["loaded"] == told["installed"] == []
    assert told["clearance"] == pytest.approx([1.4415071166664197, 1.9203051890379243], abs=1e-13)
    assert done.stderr == ""  # no terminal, so no progress
    assert 'pip install "grazemap[server]"' in told["refusal"]

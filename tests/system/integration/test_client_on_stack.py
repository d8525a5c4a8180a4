"""The client against the real stack: numbers, refusals, progress, cancelling, and a clean end."""

from __future__ import annotations

import asyncio
import base64
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx2
import numpy as np
import psutil
import pytest

import grazemap
from grazemap import cli
from grazemap.checker import check
from grazemap.errors import JobDismissed, JobFailed, ParameterError
from grazemap.local_client import LocalClient
from grazemap.wire import PROCESSES
from grazemap_worker.numerics import numerics
from tests.support.digests.documents import Results, fields, here, named
from tests.support.digests.record import digests

MAP = {
    "omega": {"start": 0.26, "stop": 0.30, "points": 512},
    "clearance": {"start": 1.3, "stop": 2.0, "points": 512},
}

SMALL_MAP = {"omega": [0.27, 0.275, 0.28], "clearance": [1.7, 1.9, 2.1]}


@pytest.mark.thorough
def test_every_process_answers(stack: LocalClient, tmp_path) -> None:
    curve = stack.grazing_curve(omega=[0.1, 0.28109, 0.3], progress=False)
    assert curve.clearance[:2] == pytest.approx([1.4415071166664197, 1.9203051890379243], abs=1e-13)
    points = stack.codimension_two_points(omega=(0.28, 0.283), max_order=2, max_multiple=1, progress=False)
    frequencies = {(point.kind, point.bifurcation): point.omega for point in points.points}
    assert frequencies["recurrence", None] == pytest.approx(0.282469586635, abs=1e-12)
    assert frequencies["resonant", "SN"] == pytest.approx(0.281762924, abs=1e-9)
    assert frequencies["resonant", "PD"] == pytest.approx(0.280008248, abs=1e-9)
    assert next(point for point in points.points if point.bifurcation == "PD").unfolding.curve_clearance == 1
    mapping = stack.discontinuity_mapping(omega=0.29, overshoot=[1e-3, 1e-6], stop="C", progress=False)
    assert mapping.returns.error[:, 1].max() < 1e-12
    path = stack.trajectory(omega=0.29, clearance=1.6, periods=200, samples_per_period=10, progress=False)
    assert len(path.impacts) == 798
    assert path.motion.label == "1-2r-2l"
    states = [{}, {"phase": 1.0}, path.final]
    many = stack.trajectory(omega=0.29, clearance=1.6, periods=3, initial=states, times=[0.0, 9.5], progress=False)
    assert [trajectory.displacement.shape for trajectory in many.trajectories] == [(3, 2)] * 3
    assert many.trajectories[2].displacement[:, 0] == pytest.approx(path.displacement[:, -1], abs=1e-13)
    umap = stack.unfolding_map(omega=(0.27, 0.28), clearance=(1.7, 2.1), shape=(4, 3), progress=False)
    assert umap.labels()[-1].tolist() == ["1-(-1)r-(-1)l"] * 3
    window = {"omega": (0.27, 0.272), "clearance": (1.84, 1.87)}
    whole = stack.unfolding_diagram(**window, shape=(4, 3), borders=True, progress=False)
    assert whole.borders is not None
    assert len(whole.borders) > 0
    assert whole.borders.count("unexplained") == 0
    diagram = stack.bifurcation_diagram(omega=0.29, clearance=(1.6, 2.1), points=3, progress=False)
    assert diagram.labels()[0] == "1-2r-2l"
    sides = {"horizontal": ("displacement", 1, (-1.9, 1.9)), "vertical": ("velocity", 1, (-1.0, 1.0))}
    basins = stack.basins(omega=0.29, clearance=1.9927, **sides, shape=(20, 30), progress=False)
    assert {attractor.label for attractor in basins.attractors} == {"1-(-1)r-(-1)l", "3-1r-1l"}
    for result in (curve, points, mapping, path, many, diagram, umap, whole, basins):
        assert result.meta["numerics"] == numerics().as_meta()
        again = grazemap.load(result.save(tmp_path / f"{result.process}.npz"))
        assert repr(again) == repr(result)


def test_a_mass_is_thrown_at_a_stop_at_its_equilibrium_without_forces(stack: LocalClient) -> None:
    one_mass = {"masses": [100.0], "stiffnesses": [1e4], "damping": [0.0], "forcing": [0.0]}
    thrown = grazemap.Oscillator(units="SI", restitution=0.5, **one_mass)
    first, second = ({"velocity": [speed]} for speed in (1.0, -2.0))
    plan = {"omega": 7.0, "clearance": {"left": 0.0}, "periods": 2, "observables": ["impulse"], "progress": False}
    single = stack.trajectory(thrown, initial=first, **plan)
    number = np.arange(len(single.impacts.time))
    assert len(number) == 5
    assert single.impacts.time == pytest.approx(0.1 * np.pi * (1 + number), rel=1e-13)
    assert single.impacts.velocity == pytest.approx(-(0.5**number), rel=1e-12)
    assert single.impulse == pytest.approx(75.0 * np.sum(0.5**number), rel=1e-13)
    many = stack.trajectory(thrown, initial=[first, second], **plan).trajectories
    assert many[0].impacts.velocity.tolist() == single.impacts.velocity.tolist()
    assert many[1].impacts.time[:2] == pytest.approx([0.0, 0.1 * np.pi], rel=1e-13)
    with pytest.raises(JobFailed, match="clearance"):
        stack.trajectory(thrown, **plan)


def test_an_orbit_is_proven_and_a_false_statement_is_answered_with_its_disproof(stack: LocalClient, tmp_path) -> None:
    place = {"omega": 0.29, "clearance": 1.6}
    solved = stack.periodic_orbit(**place, motion=(1, [1, 1, -1, -1]), progress=False)
    proof = stack.prove(solved, progress=False)
    assert proof.verdict == "proven", proof.reason
    assert cli.main(["check", str(proof.save(tmp_path / "certificate.json"))]) == 0
    other = stack.prove(statement={"kind": "attraction", **place, "label": "1-1r-1l"}, progress=False)
    assert other.verdict == "disproven", other.reason
    assert other.enclosures["label"] == "1-2r-2l"
    assert check(other.document).accepted


def test_explaining_borders_reports_its_progress_and_stops_when_it_is_cancelled(stack: LocalClient) -> None:
    """All over Figure 8 that takes many seconds."""
    window = {
        "omega": {"start": 0.26, "stop": 0.3, "points": 12},
        "clearance": {"start": 1.3, "stop": 2.05, "points": 12},
    }
    job = stack.submit("unfolding-diagrams", {**window, "borders": True})
    told: list[tuple[int, int, str]] = []
    for event in job.events(timeout=120):
        if event.name == "progress":
            told.append((event.data["done"], event.data["total"], event.data["unit"]))
            if event.data["done"] > 10:
                break
    done = [step for step, _, _ in told]
    assert done == sorted(done)
    assert len(set(done)) > 8
    assert all(total > 100 and unit == "steps" for _, total, unit in told)
    assert 10 < job.refresh().progress.done < job.progress.total
    assert job.status == "running"
    assert job.cancel().status == "dismissed"
    stack.submit("unfolding-maps", SMALL_MAP).wait(timeout=60)  # by the same worker


def test_an_adaptive_map_is_the_full_one_where_it_was_computed(stack: LocalClient) -> None:
    window = {"omega": (0.27, 0.28), "clearance": (1.7, 2.1), "shape": (24, 72), "max_periods": 100, "progress": False}
    full, adaptive = stack.unfolding_map(**window), stack.unfolding_map(**window, adaptive=True)
    assert stack.jobs(limit=1)[0].progress.total == 2  # strips
    computed = adaptive.computed
    assert 0.02 < computed.mean() < 0.9
    assert (adaptive.labels() == full.labels())[computed].all()
    np.testing.assert_array_equal(adaptive.multiplier[computed], full.multiplier[computed])
    assert np.isnan(adaptive.multiplier[~computed]).all()


def test_an_overshoot_beyond_the_domain_is_a_problem_of_that_field(stack: LocalClient) -> None:
    with pytest.raises(JobFailed) as caught:
        stack.discontinuity_mapping(omega=0.29, overshoot=5.0, progress=False)
    (error,) = caught.value.problem.errors
    assert error.pointer == "/overshoot"
    assert "at most 1.777" in error.detail


def test_the_asynchronous_client_gets_the_same_bytes(stack: LocalClient, tmp_path) -> None:
    async def ask() -> grazemap.GrazingCurve:
        async with grazemap.AsyncClient(stack.base_url) as client:
            return await client.grazing_curve(omega=(0.1, 0.3), points=50, progress=False)

    awaited = asyncio.run(ask()).save(tmp_path / "awaited.npz")
    plain = stack.grazing_curve(omega=(0.1, 0.3), points=50, progress=False).save(tmp_path / "plain.npz")
    assert awaited.read_bytes() == plain.read_bytes()


@pytest.mark.parametrize(
    ("process", "body"),
    [
        ("trajectories", {"omega": 0, "clearance": 1, "periods": 1}),
        ("trajectories", {"omega": "0.3", "clearance": True, "periods": 1.5}),
        ("trajectories", {"omega": 0.3, "clearance": 1.0, "periods": 1, "initial": {"displacement": [0, 0]}}),
        ("trajectories", {"omega": 0.3, "clearance": 1.0, "periods": 1, "initial": [{}, {"displacement": [2, 0, 0]}]}),
        ("trajectories", {"omega": 0.3, "clearance": 1.0, "periods": 1, "initial": []}),
        ("trajectories", {"omega": 0.3, "clearance": 1.0, "periods": 1, "times": [1.0, 50.0]}),
        ("grazing-curves", {"omega": {"start": 2, "stop": 1, "points": 2}}),
        ("grazing-curves", {"omega": [0.3, 0.2], "oscillator": {"masses": [1, -1], "restitution": 1.1}}),
        ("grazing-curves", {"omega": 3}),
        ("unfolding-maps", {**MAP, "policy": "sideways", "oscillator": {"damping": [0.1, -0.1, 0.1]}}),
        ("codimension-two-points", {}),
    ],
)
def test_the_client_refuses_with_the_same_problem_as_the_service(stack: LocalClient, process, body) -> None:
    assert process in PROCESSES
    answer = httpx2.post(f"{stack.base_url}/v1/{process}", json=body, trust_env=False)
    assert answer.status_code == 422
    with pytest.raises(ParameterError) as caught:
        stack.submit(process, body)
    problem = caught.value.problem.model_dump()
    assert problem == {name: answer.json()[name] for name in problem}


def test_only_the_client_repeats_the_name_of_an_unknown_field(stack: LocalClient) -> None:
    body = {"omega": 0.3, "clearance": 1.0, "periods": 1, "wobble": 1}
    (error,) = httpx2.post(f"{stack.base_url}/v1/trajectories", json=body, trust_env=False).json()["errors"]
    with pytest.raises(ParameterError) as caught:
        stack.submit("trajectories", body)
    (client_error,) = caught.value.problem.model_dump()["errors"]
    assert "wobble" in client_error["detail"]
    assert "wobble" not in str(error)
    assert {**client_error, "detail": ""} == {**error, "detail": ""}


def test_a_running_map_reports_progress_and_is_stopped(stack: LocalClient) -> None:
    handle = stack.submit("unfolding-maps", MAP)
    done = []
    for event in handle.events():
        if event.name == "progress":
            done.append(event.data["done"])
        if len(done) >= 3 and done[-1] >= 2:
            break
    assert done == sorted(done)
    assert handle.cancel().status == "dismissed"
    with pytest.raises(JobDismissed):
        handle.wait(timeout=60)
    # the worker is free again, of a map of minutes
    stack.submit("unfolding-maps", {**SMALL_MAP, "max_periods": 500}).wait(timeout=60)


def test_the_stack_and_its_folders_end_with_a_killed_parent(tmp_path) -> None:
    code = (
        "import grazemap, json, psutil, time; client = grazemap.local(workers=1);"
        "print(json.dumps([p.pid for p in psutil.Process().children(recursive=True)]), flush=True); time.sleep(300)"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=environment) as parent:
        assert parent.stdout is not None
        below = [psutil.Process(pid) for pid in json.loads(parent.stdout.readline())]
        assert len(below) >= 4
        parent.send_signal(signal.SIGKILL)
    _, left = psutil.wait_procs(below, timeout=60)
    assert left == []
    assert list(tmp_path.iterdir()) == []


def _answers(url: str) -> bool:
    try:
        httpx2.get(f"{url}/healthz")
    except httpx2.TransportError:
        return False
    return True


def test_processes_share_a_stack_that_lives_as_long_as_one_of_them_uses_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("GRAZEMAP_LOCAL")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("GRAZEMAP_WORKERS", "1")
    code = (
        "import grazemap; client = grazemap.local(); print(client.base_url, flush=True); input();"
        "client.close(); print('closed', flush=True); input()"
    )
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", code], **pipes) as first:
        url = first.stdout.readline().strip()
        with grazemap.local() as joined:
            assert joined.base_url == url
            assert f"using the stack at {url}" in capsys.readouterr().err
            first.stdin.write("\n")
            first.stdin.flush()
            assert first.stdout.readline() == "closed\n"
            assert joined.grazing_curve(omega=(0.27, 0.29), points=3, progress=False).omega.size == 3
        deadline = time.monotonic() + 30
        while _answers(url) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not _answers(url)
        first.stdin.write("\n")
        first.stdin.close()
    assert list(tmp_path.glob("*/*")) == []


@pytest.mark.thorough
def test_results_of_a_batch_of_every_process_have_the_bytes_of_each_alone(stack: LocalClient) -> None:
    """Those whose digests are recorded (`tests.support.digests`) and take little time."""
    tiers = ("quick", "maps")
    asked = [*named(*tiers)]
    assert {process for process, _, _ in asked} == PROCESSES.keys()
    requests = [{"process": process, "request": body} for process, _, body in asked]
    answer = httpx2.post(f"{stack.base_url}/v1/batches", params={"f": "npz"}, json={"requests": requests}, timeout=300)
    lines = [json.loads(line) for line in answer.text.splitlines() if line]
    assert [line for line in lines if "npz" not in line] == []
    assert sorted(line["index"] for line in lines) == [*range(len(asked))]
    results: Results = {}
    for line in lines:
        process, name, _ = asked[line["index"]]
        results.setdefault(process, {})[name] = fields(base64.b64decode(line["npz"]))
    assert digests(results) == digests(here(*tiers))

"""Computation without a service: the bytes of the workers, whatever happens to processes, and tiles that are kept."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.thread import ThreadPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import psutil
import pytest

import grazemap
from grazemap import cli
from grazemap.errors import CheckpointError, ComputationError, JobFailed, ParameterError
from grazemap.results import load
from grazemap.wire import Problem, parse_request
from grazemap_worker.computation import Computation
from grazemap_worker.direct import Direct, assembled, planned

# three tiles of a second
MAP: dict[str, Any] = {
    "omega": {"start": 0.27, "stop": 0.28, "points": 15},
    "clearance": {"start": 1.6, "stop": 1.9, "points": 4},
    "policy": "ensemble",
    "initial_conditions": 160,
    "max_periods": 300,
}
CURVE = {"omega": {"start": 0.27, "stop": 0.29, "points": 9}}
REFUSED = {"omega": 1e-6, "clearance": 1.85, "periods": 1}


@pytest.fixture(scope="module")
def expected() -> bytes:
    """The result of the map, tile by tile in this process, as workers compute it."""
    computation = Computation.of(parse_request("unfolding-maps", MAP))
    assert computation.plan.tile_count > 2
    tiles = [computation.tile(index).data for index in range(computation.plan.tile_count)]
    return computation.result(tiles, lambda *_: None).data


def _nobody(*_: object) -> None:
    pass


def _of_map() -> Any:
    return parse_request("unfolding-maps", MAP)


def _at_first_tile(action: Callable[[], object]) -> Callable[[str, dict[str, Any]], None]:
    """Return a listener that does something once, when the first tile is finished."""
    done = []

    def listen(name: str, _: dict[str, Any]) -> None:
        if name == "progress" and not done:
            done.append(True)
            action()

    return listen


def test_a_pool_of_this_machine_gives_the_bytes_of_workers_even_if_its_processes_are_killed(expected: bytes) -> None:
    with Direct() as direct:
        assert direct.compute(_of_map(), _nobody) == expected

        def kill() -> None:
            assert direct._pool is not None
            for pid in direct._pool.pids:
                os.kill(pid, signal.SIGKILL)

        assert direct.compute(_of_map(), _at_first_tile(kill)) == expected


def test_an_executor_that_is_given_gives_the_same_bytes_and_is_not_ended(expected: bytes) -> None:
    with ThreadPoolExecutor(2) as threads, Direct(threads) as direct:
        assert direct.compute(_of_map(), _nobody) == expected
        direct.close()
        assert threads.submit(abs, -1).result() == 1


def test_a_broken_executor_is_an_error_that_says_where_finished_tiles_are(tmp_path: Path) -> None:
    with ProcessPoolExecutor(1, get_context("spawn")) as executor, Direct(executor) as direct:
        executor.submit(os.getpid).result()
        for process in executor._processes.values():
            process.kill()
        with pytest.raises(ComputationError, match=str(tmp_path)):
            direct.compute(_of_map(), _nobody, tmp_path)


def test_an_interrupted_computation_goes_on_with_the_tiles_that_are_kept(expected: bytes, tmp_path: Path) -> None:
    def interrupt() -> None:
        raise KeyboardInterrupt

    with Direct() as direct, pytest.raises(KeyboardInterrupt):
        direct.compute(_of_map(), _at_first_tile(interrupt), tmp_path)
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "tiles").iterdir()}
    assert kept
    with Direct() as direct:
        assert direct.compute(_of_map(), _nobody, tmp_path) == expected
    assert {path: path.stat().st_mtime_ns for path in kept} == kept
    assert len(list((tmp_path / "tiles").iterdir())) > len(kept)
    with Direct() as direct, pytest.raises(CheckpointError, match="another computation: its request"):
        direct.compute(parse_request("unfolding-maps", {**MAP, "initial_conditions": 101}), _nobody, tmp_path)


def test_tiles_of_other_numerics_are_never_joined(tmp_path: Path) -> None:
    computation = planned(_of_map(), tmp_path)
    for index in range(computation.plan.tile_count):
        (tmp_path / "tiles" / f"{index}.feedfeedfeedfeed.npz").touch()
    with pytest.raises(CheckpointError, match="feedfeedfeedfeed"):
        assembled(tmp_path, _nobody)


def test_a_refused_request_has_the_problem_of_a_job() -> None:
    with grazemap.direct() as client, pytest.raises(JobFailed) as failed:
        client.compute("trajectories", REFUSED, progress=False)
    assert isinstance(failed.value.problem, Problem)
    assert failed.value.problem.type.endswith("computation-refused")


def test_a_request_that_is_not_valid_raises_before_anything_is_computed() -> None:
    with pytest.raises(ParameterError, match="omega"):
        grazemap.compute("grazing-curves", {"omega": 3.0})


def test_many_requests_are_computed_in_their_order() -> None:
    bodies = [{"omega": {"start": 0.27, "stop": 0.28, "points": count}} for count in (2, 3, 4)]
    with grazemap.direct() as client:
        curves = list(client.map("grazing-curves", bodies))
        assert [len(curve.omega) for curve in curves] == [2, 3, 4]
        mixed = [("grazing-curves", CURVE), ("trajectories", REFUSED), ("grazing-curves", CURVE)]
        first, refused, last = client.map(mixed, return_exceptions=True)
    assert isinstance(refused, JobFailed)
    assert first.clearance.tolist() == last.clearance.tolist()


def test_many_requests_are_computed_whatever_comes_between_them_and_whatever_is_killed(expected: bytes) -> None:
    curves = [parse_request("grazing-curves", {"omega": {**CURVE["omega"], "points": count}}) for count in range(2, 8)]
    with Direct() as direct:
        alone = [direct.compute(curve, _nobody) for curve in curves]
        outcomes = direct.each([*curves[:3], _of_map(), *curves[3:]])
        received = [next(outcomes)]
        assert direct._pool is not None
        for pid in direct._pool.pids:
            os.kill(pid, signal.SIGKILL)
        received += outcomes
    assert received == [*alone[:3], expected, *alone[3:]]


def test_the_methods_of_a_client_compute_directly() -> None:
    with grazemap.direct() as client:
        curve = client.grazing_curve(omega=(0.27, 0.29), points=9, progress=False)
        estimate = client.estimate("unfolding-maps", MAP)
    assert curve.omega.size == 9
    assert estimate.tiles > 2
    assert grazemap.compute("grazing-curves", CURVE, progress=False).clearance.tolist() == curve.clearance.tolist()


def test_a_plan_its_tiles_and_their_assembly_are_three_commands(
    expected: bytes, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    body, folder, result = tmp_path / "map.json", tmp_path / "sweep", tmp_path / "map.npz"
    body.write_text(_of_map().model_dump_json())
    assert cli.main(["plan", "unfolding-maps", "--json", str(body), "-o", str(folder)]) == 0
    assert cli.main(["assemble", str(folder), "-o", str(result)]) == 1
    assert "are missing: 0, 1" in capsys.readouterr().err
    assert cli.main(["tile", str(folder), "1"]) == 0
    assert cli.main(["tile", str(folder)]) == 2
    assert cli.main(["tile", str(folder), "1000"]) == 1
    for task in ("5", "6"):  # an array of Slurm of two tasks, as --array=5-6 makes it
        for name, value in {"ID": task, "MIN": "5", "MAX": "6", "COUNT": "2", "STEP": "1"}.items():
            monkeypatch.setenv(f"SLURM_ARRAY_TASK_{name}", value)
        assert cli.main(["tile", str(folder)]) == 0
    assert "tile 1: there already" in capsys.readouterr().out
    assert cli.main(["assemble", str(folder), "-o", str(result)]) == 0
    assert result.read_bytes() == expected
    assert load(result).process == "unfolding-maps"
    assert cli.main(["tile", str(tmp_path), "0"]) == 1
    assert "not the folder of a computation" in capsys.readouterr().err


def test_the_processes_of_a_pool_end_with_a_killed_parent() -> None:
    code = (
        "import json, sys, time; from grazemap_worker.direct import Direct, kind_of; direct = Direct(); kind_of();"
        "direct._have(2); direct._submit(abs, -1).result(); print(json.dumps(direct._pool.pids), flush=True);"
        "time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as parent:
        assert parent.stdout is not None
        below = [psutil.Process(pid) for pid in json.loads(parent.stdout.readline())]
        assert below
        parent.kill()
    _, left = psutil.wait_procs(below, timeout=30)
    assert left == []

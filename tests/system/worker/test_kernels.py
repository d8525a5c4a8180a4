"""Steps of kernels: compiled in processes of their own, loaded when they are cached, and said meanwhile."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from grazemap.wire import parse_request
from grazemap_core import kernel_folder, warmup
from grazemap_worker import liveness
from grazemap_worker.planning.kernel_steps import COMPONENT_SECONDS, FIRST_STEPS, components_of, is_step
from grazemap_worker.processes import kernels_of
from grazemap_worker.supervision import kernels as kernels_module
from grazemap_worker.supervision.kernels import Kernels
from tests.support.kernels_used import APART, MORE
from tests.support.sdk_documents import REQUESTS
from tests.support.watching import until

ROOT = Path(__file__).parents[3]
USED = "tests.support.kernels_used"


@pytest.fixture
def loaded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was loaded here, a text for each step; nothing is compiled, and processes that should compile sleep."""
    steps: list[str] = []
    sleeps = [sys.executable, "-c", "import time; time.sleep(60)"]
    popen = subprocess.Popen
    monkeypatch.setattr(kernel_folder, "folder", lambda: tmp_path)
    monkeypatch.setattr(kernel_folder, "_used", set())
    monkeypatch.setattr(warmup, "load", lambda components: steps.append("+".join(components)))
    monkeypatch.setattr(kernels_module.subprocess, "Popen", lambda _, **options: popen(sleeps, **options))
    monkeypatch.setattr(kernels_module, "available_cores", lambda: 2)
    return steps


def kill(kernels: Kernels, component: str) -> None:
    """Kill the process that compiles a component, and tell of it as a supervisor does."""
    (pid,) = (pid for pid, compiler in kernels._compilers.items() if component in compiler.components)
    os.kill(pid, signal.SIGKILL)
    kernels.ended(pid, os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))


def end(kernels: Kernels) -> None:
    kernels.stop()
    kernels.look()


def test_only_steps_are_compiled(loaded: list[str]) -> None:
    kernels = Kernels(())
    kernels.want(["core", "maps-3", "another", ""])
    assert not kernels.advance()
    assert kernels.status_texts(kernels.waits()) == {}


def test_what_two_steps_have_in_common_is_compiled_once(loaded: list[str]) -> None:
    for component in components_of("maps"):
        kernel_folder.record(component)
    kernels = Kernels(["maps", "diagrams", "apart_maps"])
    assert kernels.advance()
    (others, of_lanes) = (compiler.components for compiler in kernels._compilers.values())
    assert (others, of_lanes) == (["curves", "trajectories", "orbits"], ["apart"])
    kernel_folder.record("apart")
    assert kernels.advance()
    assert kernels.ready == {"maps", "apart_maps"}
    end(kernels)


def test_what_is_cached_is_loaded_at_once_and_no_process_is_started(loaded: list[str]) -> None:
    for component in {component for step in FIRST_STEPS for component in components_of(step)}:
        kernel_folder.record(component)
    kernels = Kernels()
    assert kernels.advance()
    assert kernels.ready == set(FIRST_STEPS[:1])  # workers are forked with these
    assert kernels.advance()
    assert loaded == ["+".join(components_of(step)) for step in FIRST_STEPS]
    assert kernels.ready == set(FIRST_STEPS)
    assert kernels._compilers == {}
    assert not kernels.advance()


def test_steps_are_ready_one_after_another_while_two_processes_compile(
    loaded: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(kernels_module.time, "monotonic", lambda: now[0])
    seconds = COMPONENT_SECONDS
    kernels = Kernels()
    assert not kernels.advance()
    components = [compiler.components for compiler in kernels._compilers.values()]
    assert components == [["curves", "trajectories", "classification", "orbits"], ["lockstep"]]
    waits = kernels.waits()
    assert waits["curves"] == seconds["curves"]
    assert waits["trajectories"] == seconds["curves"] + seconds["trajectories"]
    names = waits["trajectories"] + seconds["classification"]
    assert waits["maps"] == max(names, seconds["lockstep"])
    assert waits["orbits"] == names + seconds["orbits"]
    assert waits["apart_maps"] == seconds["lockstep"] + seconds["apart"]  # nobody waits for it yet
    assert kernels.status_texts(kernels.waits())["maps"] == f"kernels for maps, ready in about {waits['maps']:.0f} s"
    now[0] += 1.5 * seconds["curves"]
    kernel_folder.record("curves")  # as the process does
    assert kernels.advance()
    assert kernels.ready == {"curves"} == set(loaded)
    assert kernels.waits()["trajectories"] == 1.5 * seconds["trajectories"]  # this machine is slow
    kernels.want(["apart_maps", "observables"])
    assert not kernels.advance()
    assert [compiler.components for compiler in kernels._compilers.values()] == [
        ["trajectories", "classification", "orbits", "observables"],
        ["lockstep", "apart"],
    ]
    assert not kernels.advance()
    kernel_folder.record("lockstep")
    assert not kernels.advance()  # a map also needs what names its motions
    for component in ("trajectories", "classification"):
        kernel_folder.record(component)
    assert kernels.advance()
    assert kernels.ready == {"curves", "trajectories", "maps"}
    end(kernels)


def test_a_process_that_is_killed_compiles_again_and_keeps_what_it_had(loaded: list[str]) -> None:
    kernels = Kernels()
    kernels.advance()
    kernel_folder.record("curves")
    kernels.advance()
    for _ in range(2):
        kill(kernels, "trajectories")
        assert not kernels.advance()
        assert kernel_folder.holds("curves")
    assert kernels.ready == {"curves"}
    kill(kernels, "trajectories")
    assert kernels.advance()  # left to the tiles
    assert kernels.ready == {"curves", "trajectories"}
    assert loaded == ["curves"]  # this process does not compile what was killed again and again
    end(kernels)


def test_what_failed_without_being_killed_is_left_to_loading(loaded: list[str]) -> None:
    kernels = Kernels(["curves"])
    kernels.advance()
    (pid,) = kernels._compilers
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    kernels.ended(pid, 1)  # as if it had failed
    assert kernels.advance()
    assert loaded == ["curves"]


def test_the_wait_for_a_step_gets_shorter_with_each_component(
    loaded: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [100.0]
    monkeypatch.setattr(kernels_module.time, "monotonic", lambda: now[0])
    kernels = Kernels(["maps"])
    monkeypatch.setattr(kernels_module, "available_cores", lambda: 1)
    kernels.advance()
    kernel_folder.record("classification")  # by another stack: it says nothing of this machine's pace
    kernels.advance()
    now[0] += 5.0
    assert kernels.waits()["maps"] == COMPONENT_SECONDS["lockstep"] - 5.0
    now[0] += 100.0
    assert kernels.waits()["maps"] == 0.25 * 105.0  # what takes longer than usual takes longer still
    end(kernels)


def test_a_process_that_is_stopped_while_it_compiles_is_begun_again(
    loaded: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(liveness, "HUNG_SECONDS", 0.5)
    kernels = Kernels(["curves"])
    assert not kernels.advance()
    (stopped,) = kernels._compilers
    os.kill(stopped, signal.SIGSTOP)

    def ended() -> bool:
        kernels.advance()
        pid, status = os.waitpid(stopped, os.WNOHANG)
        if pid:
            kernels.ended(pid, os.waitstatus_to_exitcode(status))
        return bool(pid)

    until(ended)
    kernels.advance()
    (again,) = kernels._compilers.values()
    assert again.components == ["curves"]
    end(kernels)


def test_kernels_that_cannot_be_loaded_leave_it_to_the_tile_to_say_why(
    loaded: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(step: str) -> None:
        raise ArithmeticError

    for component in components_of("maps"):
        kernel_folder.record(component)
    monkeypatch.setattr(warmup, "load", broken)
    kernels = Kernels(["maps"])
    assert kernels.advance()
    assert "maps" in kernels.ready


def test_a_process_that_compiles_ends_with_its_supervisor(tmp_path: Path) -> None:
    script = (
        "from grazemap_worker.supervision.kernels import Kernels\n"
        "kernels = Kernels(['curves'])\nkernels.advance()\nprint(*kernels._compilers, flush=True)\n"
        "import time; time.sleep(60)"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, env=environment) as supervisor:
        assert supervisor.stdout is not None
        pid = int(supervisor.stdout.readline())
        assert Path(f"/proc/{pid}").exists()
        supervisor.kill()
    until(lambda: not running(pid))


def running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_every_process_names_a_step() -> None:
    for name, body in REQUESTS.items():
        process = name.partition(" ")[0]
        step = kernels_of(process, parse_request(process, body))
        assert step in FIRST_STEPS


@pytest.mark.parametrize(
    ("process", "more", "expected"),
    [
        ("unfolding-maps", {}, "apart_maps"),
        ("unfolding-diagrams", {}, "apart_diagrams"),
        ("unfolding-maps", {"observables": ["rms_displacement"]}, "apart_map_observables"),
        ("unfolding-maps", {"policy": "ensemble"}, "maps"),
        ("unfolding-maps", {"policy": "sweep-up"}, "maps"),
    ],
)
def test_points_that_share_no_tables_need_a_step_of_their_own(
    process: str, more: dict[str, object], expected: str
) -> None:
    step = kernels_of(process, parse_request(process, APART | more))
    assert step == expected
    assert is_step(step)
    assert ("apart" in components_of(step)) is expected.startswith("apart")


@pytest.mark.timeout(600)  # the kernels may have to be compiled
@pytest.mark.thorough
def test_a_step_has_all_that_its_processes_need() -> None:
    began = time.monotonic()
    run = subprocess.run([sys.executable, "-m", USED], capture_output=True, text=True, check=False, cwd=ROOT)
    assert run.returncode == 0, run.stderr
    lines = [json.loads(line) for line in run.stdout.splitlines()]
    assert len(lines) == len(REQUESTS) + len(MORE), time.monotonic() - began
    assert [line for line in lines if line[2]] == []

"""Other machines: kernels compiled for processors without this one's extensions, or not compiled at all.

Another processor may round differently where its instructions fuse a product with a sum, and nowhere else. So all of
them must be as good, by the same multi-precision simulations and to the same bounds, and give the same labels.
"""

from __future__ import annotations

import math
import os
import platform
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from llvmlite import binding

from benchmarks.ensemble import Ensemble
from grazemap_core.compiled_ahead import PROCESSOR
from grazemap_core.contact.kernels.runs import CHATTER, IMPACT, RELEASE
from grazemap_core.model.oscillator import Oscillator
from tests.oracles.general_oracle import GeneralOracle
from tests.oracles.impact_accuracy import compare_lockstep, lockstep_amplification
from tests.support.hardware_run import (
    CLEARANCES,
    DEFAULT,
    OMEGA,
    SLOW,
    SLOW_CLEARANCES,
    SLOW_OMEGA,
    TANGENT_PERIODS,
    compute,
)

Arrays = dict[str, np.ndarray]

RUN = Path(__file__).parents[2] / "support" / "hardware_run.py"
X86 = platform.machine() == "x86_64"
PLAIN = {"NUMBA_CPU_NAME": "generic"}
INTERPRETED = {"NUMBA_DISABLE_JIT": "1"}
COMPILED = {
    "generic": PLAIN,
    "avx2": PROCESSOR,
    "no-avx": {"NUMBA_ENABLE_AVX": "0"},
}
DETERMINED = ("half", "stop", "kind")


def elsewhere(folder: Path, settings: dict[str, str], size: str, *options: str) -> Arrays:
    """What a process with these settings computes, with a cache of kernels of its own."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    subprocess.run(
        [sys.executable, str(RUN), str(folder / "out.npz"), size, *options],
        env={**environment, "NUMBA_CACHE_DIR": str(folder / "kernels"), **settings},
        timeout=1500,
        check=True,
    )
    with np.load(folder / "out.npz") as arrays:
        return dict(arrays)


def events(arrays: Arrays, name: str) -> Ensemble:
    return Ensemble(*(arrays[f"{name}.{part}"] for part in Ensemble._fields))


@cache
def exact_chatter(clearance: float) -> GeneralOracle:
    """A period of the slow mass, in which it comes to rest twice."""
    exact = GeneralOracle.between(Oscillator.create(*SLOW), SLOW_OMEGA, clearance)
    exact.run(until=2 * math.pi / SLOW_OMEGA, releases=2)
    return exact


def assert_exact(arrays: Arrays) -> None:
    """Assert what multi-precision arithmetic and closed forms say of it."""
    default = Oscillator.create(*DEFAULT)
    amplification = lockstep_amplification(default, OMEGA, CLEARANCES)
    for point in compare_lockstep(default, OMEGA, CLEARANCES, amplification, events(arrays, "first")):
        assert point.complete
        assert point.worst < 1e-15

    half_period = math.pi / SLOW_OMEGA
    chatter = events(arrays, "chatter")
    for lane, clearance in enumerate(SLOW_CLEARANCES.tolist()):
        exact = exact_chatter(clearance)
        last = int(np.argmax(chatter.kind[lane] == CHATTER))
        assert last > 10
        assert set(chatter.kind[lane, :last]) == {IMPACT}
        assert chatter.kind[lane, last + 1] == RELEASE
        time = chatter.half[lane] * half_period + chatter.time[lane]
        expected = [float(t) for t in [*exact.times[: last + 1], exact.releases[0]]]
        np.testing.assert_allclose(time[: last + 2], expected, rtol=0, atol=1e-12)
        if lane == 0:
            np.testing.assert_array_equal(arrays["sticking.stop"], exact.held_on)
            for name, times in (("start", exact.rests), ("stop_time", exact.releases)):
                np.testing.assert_allclose(arrays[f"sticking.{name}"], [float(t) for t in times], rtol=0, atol=1e-12)

    reference = GeneralOracle.between(default, OMEGA, 1.6)
    reference.run(len(arrays["reference.time"]))
    assert len(reference.times) >= 6
    np.testing.assert_allclose(
        arrays["reference.time"], [float(t) for t in reference.times], rtol=0, atol=1e-13 * 2 * math.pi / OMEGA
    )
    # every impact takes R^2 off the volume, the damping e^(-trace(M^-1 C)) in a unit of time
    end = TANGENT_PERIODS * 2 * math.pi / OMEGA
    impacts = sum(float(t) < end for t in reference.times)
    trace = np.trace(default.damping_matrix / default.masses[:, None])
    sign, logarithm = np.linalg.slogdet(arrays["monodromy"])
    assert sign == 1.0
    assert logarithm == pytest.approx(
        2.0 * impacts * math.log(default.restitution) - end * trace,
        abs=1e-15 * np.linalg.cond(arrays["monodromy"]) + 1e-12,
    )


def assert_same(arrays: Arrays, here: Arrays) -> None:
    """Assert that it says the same as this machine's kernels, numbers to their round-off."""
    assert arrays.keys() == here.keys()
    for name in DETERMINED:
        np.testing.assert_array_equal(arrays[f"first.{name}"], here[f"first.{name}"])
    for name in ("kind", "reason", "period", "impacts_right", "impacts_left", "symmetric", "sticking"):
        np.testing.assert_array_equal(arrays[f"map.{name}"], here[f"map.{name}"], err_msg=name)
    assert np.count_nonzero(here["map.kind"]) >= 3
    # motions are named within 1e-8 of their limit (LIMIT_DISTANCE)
    name = "map.least_impact_velocity"
    np.testing.assert_allclose(arrays[name], here[name], rtol=0, atol=1e-8)
    np.testing.assert_allclose(arrays["reference.displacement"], here["reference.displacement"], rtol=0, atol=1e-12)
    scale = np.abs(here["monodromy"]).max()
    np.testing.assert_allclose(arrays["monodromy"], here["monodromy"], rtol=0, atol=1e-12 * scale)


@pytest.mark.hardware
def test_without_instruction_set_extensions_or_a_compiler_results_are_as_accurate(tmp_path: Path) -> None:
    here = compute("small")
    (tmp_path / "vector").mkdir()
    vector = elsewhere(tmp_path / "vector", PLAIN, "small", "--vector-only")
    interpreted = elsewhere(tmp_path, INTERPRETED, "small")
    for arrays in (vector, interpreted):
        assert_exact(arrays)
        assert_same(arrays, here)
    if X86:
        # without fused instructions the compiler has no freedom left
        for name, value in interpreted.items():
            np.testing.assert_array_equal(vector[name], value, err_msg=name)


@pytest.mark.hardware
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("machine", COMPILED)
def test_every_kernel_compiled_for_another_machine_is_as_accurate(machine: str, tmp_path: Path) -> None:
    if machine != "generic" and not (X86 and binding.get_host_cpu_features().get("avx2")):
        pytest.skip("for processors with AVX2")
    arrays = elsewhere(tmp_path, COMPILED[machine], "full")
    assert_exact(arrays)
    assert_same(arrays, compute("full"))

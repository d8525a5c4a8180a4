"""The description of the machine in a result distinguishes machines with different instructions."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest
from llvmlite import binding

from grazemap_service.result_schemas import NUMERICS
from grazemap_worker.numerics import numerics
from tests.support.narrow import SETTINGS as NARROW

# read by numba, and by numpy and its linear algebra, when they are imported
SETTINGS = (*NARROW, "NUMBA_ENABLE_AVX", "NUMBA_DISABLE_JIT")


def meta(**settings: str) -> dict[str, str]:
    """What a process with these settings and no others says."""
    return meta_of({name: value for name, value in os.environ.items() if name not in SETTINGS} | settings)


def meta_of(environment: dict[str, str]) -> dict[str, str]:
    code = "import json; from grazemap_worker.numerics import numerics; print(json.dumps(numerics().as_meta()))"
    answer = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, timeout=300, check=True)
    document: dict[str, str] = json.loads(answer.stdout)
    return document


@pytest.fixture(scope="module")
def here() -> dict[str, str]:
    return meta()


def test_the_processor_and_its_features_are_those_of_this_machine(here: dict[str, str]) -> None:
    assert here["cpu"] == binding.get_host_cpu_name()
    there = {name for name, present in binding.get_host_cpu_features().items() if present}
    assert set(here["cpu_features"].split(", ")) == there


@pytest.mark.thorough
def test_another_process_says_the_same() -> None:
    assert numerics().as_meta() == meta_of({**os.environ})


def test_the_document_of_the_api_has_their_fields(here: dict[str, str]) -> None:
    assert tuple(here) == NUMERICS


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("settings", "cpu"), [({"NUMBA_CPU_NAME": "generic"}, "generic"), ({"NUMBA_DISABLE_JIT": "1"}, "interpreted")]
)
def test_a_processor_without_extensions_names_none_nor_do_uncompiled_kernels(
    here: dict[str, str], settings: dict[str, str], cpu: str
) -> None:
    plain = meta(**settings)
    assert (plain["cpu"], plain["cpu_features"]) == (cpu, "")
    assert plain["fingerprint"] != here["fingerprint"]


def test_extensions_that_are_switched_off_are_not_named_and_another_fingerprint(here: dict[str, str]) -> None:
    if "avx" not in here["cpu_features"]:
        pytest.skip("this processor has no AVX to switch off")
    without = meta(NUMBA_ENABLE_AVX="0")
    assert without["cpu"] == here["cpu"]
    assert not [name for name in without["cpu_features"].split(", ") if name.startswith("avx")]
    assert without["fingerprint"] != here["fingerprint"]


def test_another_kernel_of_the_linear_algebra_is_another_fingerprint(here: dict[str, str]) -> None:
    other = meta(OPENBLAS_CORETYPE="Prescott")
    assert {**other, "fingerprint": ""} == {**here, "fingerprint": ""}
    assert other["fingerprint"] != here["fingerprint"]

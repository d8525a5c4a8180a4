"""How kernels are compiled: without numba's runtime, as parts of one another, with their tuples by reference."""

import ast
import inspect
import os
import pkgutil
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np
import pytest
from numba import float64, int64, njit
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher
from numba.core.errors import TypingError

import grazemap_core
from grazemap_core.numerics.jit import compiled
from grazemap_core.numerics.jit.compiled import Kernel, PointerKernel
from grazemap_core.numerics.jit.record_references import reference

MODULES = [
    import_module(info.name)
    for info in pkgutil.walk_packages(grazemap_core.__path__, "grazemap_core.")
    if ".kernels." in info.name and hasattr(import_module(info.name), "kernel")
]
# Python calls them, and they allocate what they return or the arrays that their kernels write to
ALLOCATES = {
    "run_recorded",
    "response_sum",
    "lane_tables",
    "_steady_tables",
    "_block_response",
    "_change_series",
    "steady_amplitudes",
    "isolate",
    "states_before_impulse",
}


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_no_kernel_counts_references(module: object) -> None:
    kinds = Dispatcher | Kernel | PointerKernel
    kernels = {name: value for name, value in vars(module).items() if isinstance(value, kinds)}
    for name, dispatcher in kernels.items():
        inlined_before = dispatcher.targetoptions.get("inline") == "always"  # it has its callers' options
        assert dispatcher.targetoptions.get("_nrt") is False or inlined_before or name in ALLOCATES, name


def test_a_kernel_that_allocates_does_not_compile() -> None:
    @compiled.inlined
    def allocates(count: int) -> float:
        return float(np.zeros(count)[0])

    with pytest.raises(TypingError, match="Only accept returning of array passed into the function"):
        allocates(3)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_no_index_of_a_kernel_counts_from_the_end(module: ModuleType) -> None:
    """Numba's test for it is left out, so it would be an access before the array."""
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.Subscript):
            indices = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
            signed = [isinstance(index, ast.UnaryOp) and isinstance(index.op, ast.USub) for index in indices]
            assert not any(signed), f"line {node.lineno}"


def test_an_index_has_no_test_for_the_end_of_the_array() -> None:
    @compiled.kernel
    def entry(array: np.ndarray, i: int) -> float:
        return array[i]

    entry.part.compile((float64[::1], int64))
    (part,) = entry.part.overloads.values()
    assert "select" not in part.library.get_llvm_str()
    assert entry(np.array([1.0, 2.0]), 1) == 2.0


def test_copies_are_copies() -> None:
    target, source = np.zeros((3, 2)), np.arange(6.0).reshape(3, 2)
    compiled.copy_matrix(target, source)
    np.testing.assert_array_equal(target, source)
    part = np.zeros(2)
    compiled.copy_vector(part, source[:, 1])
    np.testing.assert_array_equal(part, [1.0, 3.0])


class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray


class Nested(NamedTuple):
    pair: Pair
    number: float


@compiled.kernel
def _add(pair: Pair) -> float:
    return pair.first[0] + pair.second[0]


@compiled.kernel
def _add_nested(nested: Nested) -> float:
    refers = reference(reference(nested))
    refers.pair.first[0] += refers.number
    return _add(refers.pair)


def test_a_kernel_called_only_by_kernels_has_no_machine_code_of_its_own() -> None:
    """Numba would make it of every function that a compiled one calls, which is most of the time of compiling."""
    nested = Nested(Pair(np.array([1.0]), np.array([2.0])), 0.5)
    assert _add_nested(nested) == 3.5
    assert nested.pair.first[0] == 1.5
    assert not _add.whole.overloads
    assert _add(nested.pair) == 3.5  # now Python calls it
    assert len(_add.whole.overloads) == 1

    @compiled.kernel
    def halve(number: float) -> float:
        return 0.5 * number

    halve.part.compile((float64,))
    (part,) = halve.part.overloads.values()
    with global_compiler_lock:
        assert part.library.get_pointer_to_function(part.fndesc.llvm_func_name) == 0


def test_a_plain_function_may_call_kernels() -> None:
    @njit
    def twice(pair: Pair) -> float:
        return 2.0 * _add(pair)

    assert twice(Pair(np.array([1.0]), np.array([2.0]))) == 6.0


def test_outside_kernels_a_reference_is_the_tuple_itself() -> None:
    pair = Pair(np.array([1.0]), np.array([2.0]))
    assert reference(pair) is pair


def test_a_kernel_that_is_called_by_its_address_is_compiled_when_its_caller_runs() -> None:
    @compiled.pointer_kernel
    def enters(nested: Nested, index: int, number: int) -> int:
        nested.pair.first[index] = number
        return number + 1

    @compiled.kernel
    def calls(nested: Nested, enters: Callable[..., int]) -> int:
        return enters(reference(nested), 1, 5)

    nested = Nested(Pair(np.zeros(2), np.zeros(2)), 0.5)
    assert (calls(nested, enters.address(nested)), nested.pair.first.tolist()) == (6, [0.0, 5.0])
    assert enters.targetoptions["_nrt"] is False
    (signature,) = enters._dispatcher.signatures
    assert calls(nested, enters.address(nested)) == 6
    assert enters._dispatcher.signatures == [signature]


ASSEMBLY = """
import sys
from grazemap_core.model.impulse_response import evaluate, impulse_response
from grazemap_core.model.kernels.response_sums import response_sum
from grazemap_core.model.modal import modal_model
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.numerics.jit.quick_compiler import hurry
if sys.argv[1] == "quick":
    hurry()
response = impulse_response(modal_model(Oscillator.create([1.0, 10.0], [1.0, 5.0], 0.05, [1.0, 0.0], 0.8)))
evaluate(response, [1.0])
(text,) = response_sum.inspect_asm().values()
print(text)
"""


@pytest.mark.thorough
def test_a_process_in_a_hurry_compiles_the_same_machine_code(tmp_path: Path) -> None:
    def assembly(how: str) -> str:
        environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / how)}
        command = [sys.executable, "-c", ASSEMBLY, how]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout

    quick = assembly("quick")
    assert quick.count("\n") > 1000
    assert quick == assembly("unhurried")


@pytest.mark.parametrize(("features", "lanes"), [("+avx512f", "8"), ("", "4")])
def test_blocks_of_lanes_are_of_the_processor_that_code_is_generated_for(features: str, lanes: str) -> None:
    """Whatever this one is: kernels for x86-64-v3 that are compiled on a processor with AVX-512 are those of others."""
    code = "from grazemap_core.maps.kernels.first_pass import VECTOR; print(VECTOR)"
    environment = os.environ | {"NUMBA_CPU_NAME": "x86-64-v3", "NUMBA_CPU_FEATURES": features}
    completed = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, check=True, timeout=120
    )
    assert completed.stdout.decode().strip() == lanes

"""Kernels do without numba's runtime: a quarter of a map's time would go into counting references."""

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from numba.core.errors import TypingError

from grazemap_core.kernels import (
    bernstein,
    block_flow,
    bounces,
    cells,
    closing,
    column,
    compiled,
    contact,
    eigenvalues,
    events,
    held,
    judging,
    lane_tangents,
    lanes,
    lockstep,
    lyapunov,
    newton,
    simulate,
    sticking,
    tangent,
    walk,
    workspace,
)

MODULES = (bernstein, block_flow, bounces, cells, closing, column, contact, eigenvalues, events, held, judging,
           lane_tangents, lanes, lockstep, lyapunov, newton, simulate, sticking, tangent, walk, workspace)  # fmt: skip
ALLOCATES = {"run_recorded"}  # called from Python, for one trajectory


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__.rpartition(".")[2])
def test_no_kernel_counts_references(module: object) -> None:
    kernels = {name: value for name, value in vars(module).items() if isinstance(value, Dispatcher)}
    for name, dispatcher in kernels.items():
        inlined_before = dispatcher.targetoptions.get("inline") == "always"  # it has its callers' options
        assert dispatcher.targetoptions.get("_nrt") is False or inlined_before or name in ALLOCATES, name


def test_a_kernel_that_allocates_does_not_compile() -> None:
    @compiled.inlined
    def allocates(count: int) -> float:
        return float(np.zeros(count)[0])

    with pytest.raises(TypingError, match="Only accept returning of array passed into the function"):
        allocates(3)


def test_copies_are_copies() -> None:
    target, source = np.zeros((3, 2)), np.arange(6.0).reshape(3, 2)
    compiled.copy_matrix(target, source)
    np.testing.assert_array_equal(target, source)
    part = np.zeros(2)
    compiled.copy_vector(part, source[:, 1])
    np.testing.assert_array_equal(part, [1.0, 3.0])

"""Kernels where numba's private interface is not the known one: compiled by `njit` alone, with one warning."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
from tests.support.thorough import KERNELS_FIRST

OMEGA = np.linspace(0.2, 0.4, 20)
REMOVED = "import numba.core.codegen; del numba.core.codegen.JITCodeLibrary"
METHOD = "import numba.core.codegen; del numba.core.codegen.CPUCodeLibrary._finalize_dynamic_globals"
OPTION = "import numba.core.cpu; del numba.core.cpu._options_mixin._nrt"
LATER = "import numba; numba.__version__ = '0.999.0'"

WARNED = """
import warnings
{change}
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from grazemap_core.numerics.jit import compiled
assert compiled.PART_COMPILER is None
(warning,) = [warning for warning in caught if warning.category is compiled.InliningWarning]
print(warning.message)
"""

# An array whose references were counted wrongly is freed too early, or never.
COUNTED = """
import sys
from typing import NamedTuple
import numpy as np
from numba.core.dispatcher import Dispatcher
from grazemap_core.numerics.jit.record_references import reference

class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray

class Nested(NamedTuple):
    pair: Pair
    number: float

def add(pair):
    first = pair.first
    return first[0] + pair.second[0]
add = compiled.kernel(add)
assert isinstance(add, Dispatcher)

def add_nested(nested):
    refers = reference(reference(nested))
    total = 0.0
    for _ in range(100):
        total += add(refers.pair) + refers.number
    return total
add_nested = compiled.kernel(add_nested)

@compiled.pointer_kernel
def last(nested, place):
    nested.pair.first[place] += nested.pair.second[place]
    return place + 1

def call_last(nested, last):
    return last(reference(nested), 0)
call_last = compiled.kernel(call_last)

nested = Nested(Pair(np.array([1.0]), np.array([2.0])), 0.5)
assert add_nested(nested) == 350.0
before = sys.getrefcount(nested.pair.first), sys.getrefcount(nested.pair.second)
for _ in range(100):
    add_nested(nested)
    assert call_last(nested, last.address(nested)) == 1
assert nested.pair.first[0] == 201.0
assert (sys.getrefcount(nested.pair.first), sys.getrefcount(nested.pair.second)) == before
"""

COMPUTED = """
import numpy as np
from grazemap_core.grazing.grazing_curve import grazing_curve
from grazemap_core.model.oscillator import Oscillator
oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
curve = grazing_curve(oscillator, np.linspace(0.2, 0.4, 20), max_order=2)
np.savez({path!r}, **{{name: value for name, value in vars(curve).items() if isinstance(value, np.ndarray)}})
"""


def run(code: str, folder: Path) -> str:
    """Run a script that begins with a change of numba; its kernels go into a cache of their own."""
    folder.mkdir(exist_ok=True)
    script = folder / "script.py"
    script.write_text(code)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "kernels")}
    done = subprocess.run(
        [sys.executable, script], env=environment, capture_output=True, text=True, timeout=200, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (REMOVED, "cannot import name 'JITCodeLibrary'"),
        (METHOD, "_finalize_dynamic_globals"),
        (OPTION, "_nrt"),
        (LATER, "numba 0.999.0 is not a tested version"),
    ],
    ids=["class", "method", "option", "version"],
)
def test_one_warning_gives_the_reason_and_the_cost(change: str, reason: str, tmp_path: Path) -> None:
    warned = run(WARNED.format(change=change), tmp_path)
    assert reason in warned
    assert "without parts" in warned


@KERNELS_FIRST
def test_a_curve_has_the_same_bytes_and_references_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "curve.npz"
    run(WARNED.format(change=REMOVED) + COUNTED + COMPUTED.format(path=str(path)), tmp_path)
    oscillator = Oscillator.create([1.0, 10.0, 10.0], [1.0, 5.0, 5.0], 0.05, [1.0, 0.0, 0.0], 0.8)
    here = vars(grazing_curve(oscillator, OMEGA, max_order=2))
    with np.load(path) as there:
        assert len(there.files) >= 5
        for name in there.files:
            assert there[name].tobytes() == here[name].tobytes(), name

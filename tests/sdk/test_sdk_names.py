"""The public names of the package, and modules that importing it must not load."""

import inspect
import subprocess
import sys

import pytest

import grazemap

HEAVY = ["numba", "redis", "fastapi", "rq", "scipy", "matplotlib", "xarray", "tqdm", "pandas", "starlette"]


def test_public_names_are_these():
    assert set(grazemap.__all__) == {
        "AsyncClient",
        "AsyncJobHandle",
        "Basins",
        "BifurcationCurves",
        "BifurcationDiagram",
        "Client",
        "CodimensionTwoPoints",
        "DiscontinuityMapping",
        "Event",
        "GrazingCurve",
        "InitialState",
        "JobHandle",
        "OrbitBranch",
        "Oscillator",
        "PeriodicOrbit",
        "Trajectories",
        "Trajectory",
        "UnfoldingDiagram",
        "UnfoldingMap",
        "__version__",
        "engineering_units",
        "errors",
        "load",
        "local",
        "wire",
    }
    assert all(getattr(grazemap, name) is not None for name in grazemap.__all__)
    assert dir(grazemap) == grazemap.__all__


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = grazemap.nonsense


@pytest.mark.parametrize(
    "statement",
    [
        "import grazemap",
        "from grazemap import Client, AsyncClient, Oscillator, local, load, errors; Client().close()",
        "import grazemap.cli",
    ],
)
def test_importing_loads_nothing_heavy(statement: str):
    code = f"import sys\n{statement}\nprint([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_models_alone_load_no_http_client():
    code = "import sys, grazemap.wire, grazemap.codec; print('httpx2' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    ("blocking", "awaited"),
    [(grazemap.Client, grazemap.AsyncClient), (grazemap.JobHandle, grazemap.AsyncJobHandle)],
)
def test_both_clients_have_the_same_methods_and_parameters(blocking: type, awaited: type):
    def signatures(cls: type) -> dict[str, list[str]]:
        methods = inspect.getmembers(cls, inspect.isfunction)
        return {
            name: [str(p) for p in inspect.signature(f).parameters.values()] for name, f in methods if name[0] != "_"
        }

    assert signatures(blocking) == signatures(awaited)


def test_the_former_name_of_the_wire_models_warns():
    with pytest.warns(DeprecationWarning, match="grazemap.wire"):
        from grazemap.models import Oscillator

    assert Oscillator is grazemap.Oscillator

"""The public names of the package, and modules that importing it must not load."""

import inspect
import pydoc
import subprocess
import sys

import pytest

import grazemap
from grazemap.client.process_methods import METHODS

HEAVY = ["numba", "redis", "fastapi", "rq", "scipy", "matplotlib", "xarray", "tqdm", "pandas", "starlette"]


def test_public_names_are_these():
    assert set(grazemap.__all__) == {
        "AsyncClient",
        "AsyncJobHandle",
        "BasinFractions",
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
        "Proof",
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
        "import grazemap.results",
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


def test_help_of_a_method_describes_every_argument():
    for name in METHODS:
        documented = getattr(grazemap.Client, name).__doc__
        section = documented.partition("\nParameters\n")[2].partition("\nReturns\n")[0]
        entries = [line.partition(" : ")[0] for line in section.splitlines() if line and line[0] not in " -"]
        arguments = [one for one in inspect.signature(getattr(grazemap.Client, name)).parameters if one != "self"]
        assert [one for entry in entries for one in entry.split(", ")] == arguments, name
    assert 'policy : {"rest", "sweep-up", "sweep-down", "ensemble"}' in grazemap.Client.unfolding_map.__doc__


@pytest.mark.parametrize("name", ["UnfoldingMap", "GrazingCurve", "BifurcationDiagram", "OrbitBranch", "PeriodicOrbit"])
def test_help_of_a_result_says_what_it_is_its_arrays_and_its_methods_without_arguments(name: str):
    kind = getattr(grazemap, name)
    lines = pydoc.plain(pydoc.render_doc(kind)).splitlines()
    shown = [line.removeprefix(" |").strip() for line in lines]
    assert "_document" not in "\n".join(lines[:10])
    assert shown.index("Attributes") < shown.index("Methods") < shown.index("Method resolution order:")
    section = shown[shown.index("Methods") : shown.index("Method resolution order:")]
    public = {n for n in dir(kind) if not n.startswith(("_", "derived")) and inspect.isfunction(getattr(kind, n))}
    assert {line.removesuffix("()") for line in section if line.endswith("()")} == public
    assert "units" in shown[: shown.index("Methods")]
    assert not any("forcing periods in SI" in line or "rad in SI" in line for line in shown)


def test_help_names_the_dimensions_of_a_map_as_its_methods_do():
    assert "kind : ndarray of int, shape (clearance, omega)" in grazemap.UnfoldingMap.__doc__


def test_help_of_the_oscillator_begins_with_its_fields_and_their_defaults():
    assert str(inspect.signature(grazemap.Oscillator)) == (
        "(*, units='nondimensional', masses=[1.0, 10.0, 10.0], stiffnesses=[1.0, 5.0, 5.0], damping=0.05, "
        "matrices=None, contact=1, forcing=[1.0, 0.0, 0.0], restitution=0.8, base=None, bias=None)"
    )


def test_a_method_says_what_it_returns():
    for client in (grazemap.Client, grazemap.AsyncClient):
        assert "Returns\n-------\nUnfoldingMap\n    The motion that each point" in inspect.getdoc(client.unfolding_map)

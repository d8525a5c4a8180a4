"""The public names of the package, and modules that importing it must not load."""

import inspect
import pydoc
import subprocess
import sys

import pytest

import grazemap
from grazemap.client.process_methods import METHODS
from tests.support.sdk_documents import npz

HEAVY = ["numba", "redis", "fastapi", "rq", "scipy", "matplotlib", "xarray", "tqdm", "pandas", "starlette", "shtab"]
LOADED = f"""
import sys, grazemap.cli
grazemap.cli.commands.parsed(["up"])
print([name for name in ("pydantic", "httpx2", "numpy") if name in sys.modules])
import grazemap.wire, grazemap.codec
print("httpx2" in sys.modules)
import grazemap.results
print("grazemap.plots" in sys.modules)
from grazemap import Client, AsyncClient, Oscillator, local, load, errors
Client().close()
try:
    grazemap.cli.main(["--version"])
except SystemExit:
    print([name for name in {HEAVY} if name in sys.modules])
sys.modules["matplotlib"] = None
import grazemap.cli.result_commands
from grazemap import *
try:
    load(sys.argv[1]).plot()
except errors.MissingExtra as error:
    print(error.extra)
"""


def test_public_names_are_these():
    assert set(grazemap.__all__) == {
        "DirectClient",
        "compute",
        "direct",
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
        "StopGrazingCurves",
        "Structure",
        "Trajectories",
        "Trajectory",
        "UnfoldingDiagram",
        "UnfoldingMap",
        "__version__",
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


def test_importing_loads_nothing_heavy_and_the_models_no_http_client(tmp_path):
    curve = tmp_path / "curve.npz"
    curve.write_bytes(npz("grazing-curves"))
    done = subprocess.run([sys.executable, "-c", LOADED, curve], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[]", "False", "False", f"grazemap {grazemap.__version__}", "[]", "plot"]


def test_help_of_a_method_describes_every_argument():
    for name in METHODS:
        documented = getattr(grazemap.Client, name).__doc__
        section = documented.partition("\nParameters\n")[2].partition("\nReturns\n")[0]
        entries = [line.partition(" : ")[0] for line in section.splitlines() if line and line[0] not in " -"]
        arguments = [
            argument for argument in inspect.signature(getattr(grazemap.Client, name)).parameters if argument != "self"
        ]
        assert [argument for entry in entries for argument in entry.split(", ")] == arguments, name
    assert 'policy : {"rest", "sweep-up", "sweep-down", "ensemble"}' in grazemap.Client.unfolding_map.__doc__


@pytest.mark.parametrize("name", ["StopGrazingCurves", "DiscontinuityMapping"])
def test_the_docstring_of_a_result_with_a_long_description_ends_with_its_methods(name: str):
    lines = getattr(grazemap.results, name).__doc__.partition("\nMethods\n-------\n")[2].splitlines()
    assert all(line.endswith("()") for line in lines[::2])
    assert all(line.startswith("    ") for line in lines[1::2])


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


def test_help_of_the_oscillator_has_its_fields_and_their_defaults():
    shown = inspect.signature(grazemap.Oscillator).parameters
    fields = grazemap.Oscillator.model_fields.items()
    assert {name: parameter.default for name, parameter in shown.items()} == {
        name: field.get_default(call_default_factory=True) for name, field in fields
    }

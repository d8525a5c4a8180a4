"""Files that earlier versions have written: each is read, becomes a Dataset, and is drawn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from thorough import every_fourth

import grazemap
from grazemap.codec import decode_npz
from grazemap.plots import save_picture
from grazemap.results import RESULTS

FILES = sorted((Path(__file__).parents[1] / "data").glob("results-*/*"))


# the results of 0.1.0, which no later version may drop
OF_THE_FIRST_VERSION = {
    "GrazingCurve",
    "CodimensionTwoPoints",
    "DiscontinuityMapping",
    "Trajectories",
    "Trajectory",
    "UnfoldingMap",
    "UnfoldingDiagram",
    "BifurcationDiagram",
    "PeriodicOrbit",
    "OrbitBranch",
    "BifurcationCurves",
    "Basins",
}


def test_there_is_a_file_of_every_result_of_the_first_version() -> None:
    assert {type(grazemap.load(path)).__name__ for path in FILES} == OF_THE_FIRST_VERSION
    assert set(RESULTS) >= OF_THE_FIRST_VERSION
    assert all(path.stat().st_size < 100_000 for path in FILES)


@pytest.mark.parametrize("path", every_fourth(FILES), ids=lambda path: path.name)
def test_a_file_of_an_earlier_version_is_read_converted_and_drawn(path: Path, tmp_path: Path) -> None:
    result = grazemap.load(path)
    assert "schema" not in result.meta  # written before results said so
    made = result.to_xarray()
    assert made.attrs["process"] == result.process
    assert len(made.variables) > 2
    picture = tmp_path / "picture.png"
    save_picture(result, picture)
    assert picture.stat().st_size > 5000
    if path.suffix == ".npz":
        assert result.save(tmp_path / "again.npz").read_bytes() == path.read_bytes()


def test_what_was_certified_is_verified_or_isolated() -> None:
    folder = FILES[0].parent
    umap = grazemap.load(folder / "map_rest.npz")
    document, _ = decode_npz((folder / "map_rest.npz").read_bytes())
    assert "verified" not in document
    np.testing.assert_array_equal(umap.verified, document["certified"])
    assert umap.verified.any()
    adaptive = grazemap.load(folder / "map_adaptive.npz")
    assert adaptive.verified.any()
    assert not adaptive.verified[~adaptive.computed].any()
    orbit = grazemap.load(folder / "orbit.json")
    assert json.loads((folder / "orbit.json").read_text())["certified"] is True
    assert orbit.isolated is True
    assert orbit.verified is (orbit.admissible and orbit.stable and orbit.motion.period == orbit.period)
    assert orbit.motion.verified is orbit.verified
    branch = grazemap.load(folder / "branch.npz")
    assert not branch.isolated.any()  # it was not kept
    diagram = grazemap.load(folder / "diagram.json")
    assert {(section.sensitive, section.transient_growth) for section in diagram.sections} == {(None, None)}
    assert all(type(attractor.verified) is bool for attractor in grazemap.load(folder / "basins.npz").attractors)

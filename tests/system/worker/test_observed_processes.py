"""Observables and outputs of every process that has them: documents, results, Datasets, pictures, estimates."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

from grazemap import cli
from grazemap.codec import Document, encode_json
from grazemap.errors import ParameterError
from grazemap.results import (
    BifurcationDiagram,
    OrbitBranch,
    PeriodicOrbit,
    Result,
    Trajectories,
    Trajectory,
    UnfoldingMap,
)
from grazemap.results import observables as schema
from grazemap.results.base import _decode_json
from grazemap.results.observables import variables_of
from grazemap.validation import validated
from grazemap.wire import ProcessRequest, canonical_id, parse_request
from grazemap.wire.observables import OBSERVABLES
from grazemap_core.errors import LinearisationError
from grazemap_core.orbits import simulated_orbits
from grazemap_core.simulation import observables as core
from grazemap_worker.planning.kernel_steps import is_step
from grazemap_worker.processes import IMPLEMENTATIONS, kernels_of
from tests.support.computed import result_of, tiled, whole

ASKED: dict[str, Any] = {
    "observables": ["impulse", "dissipated_power", "mean_impact_speed_right", "peak_displacement_left"],
    "outputs": {"spring": {"displacement": [1, -1, 0], "unit": "N"}, "rate": {"velocity": [1, 0, 0]}},
}
POINT = {"omega": 0.29, "clearance": 1.6}
REQUESTS: dict[str, dict[str, Any]] = {
    "trajectories": {**POINT, "periods": 2, "transient_periods": 400, "samples_per_period": 1},
    "periodic-orbits": {**POINT, "motion": {"period": 1, "stops": [1, 1, -1, -1]}},
    "orbit-branches": {
        "omega": 0.27,
        "clearance": 1.85,
        "motion": {"period": 1, "stops": [1]},
        "range": {"start": 1.8, "stop": 1.9},
    },
    "bifurcation-diagrams": {"vary": "clearance", "range": [1.6, 2.4], "omega": 0.29, "periods": 4},
    "unfolding-maps": {"omega": [0.28, 0.29], "clearance": [1.6, 1.9, 2.4], "max_periods": 200},
}


def computed(process: str, body: dict[str, Any]) -> tuple[Document, Result]:
    """Return the document of a request, a map in two tiles, and its result."""
    document = tiled(process, body, 3, 1) if process == "unfolding-maps" else whole(process, body)
    result = result_of(process, body, document)
    again = _decode_json(encode_json(document, result.meta))
    others = {variable.name: values for variable, values in variables_of(again)}
    for variable, values in variables_of(result):  # in JSON a number that is not known is missing
        pair = (np.asarray(part, dtype=np.float64) for part in (values, others.get(variable.name, np.nan)))
        np.testing.assert_array_equal(*pair, err_msg=variable.name)
    return document, result


def test_wire_core_and_schema_have_the_same_names() -> None:
    assert OBSERVABLES == core.OBSERVABLES == schema.OBSERVABLES
    assert tuple(mean.name for mean in schema.MEANS) == core.MEANS


@pytest.mark.parametrize("process", ["trajectories", "periodic-orbits"])
def test_a_motion_has_numbers(process: str) -> None:
    _, motion = computed(process, {**REQUESTS[process], **ASKED})
    assert isinstance(motion, Trajectory | PeriodicOrbit)
    assert motion.impulse == pytest.approx(1.1893227616745, rel=1e-11)
    assert motion.dissipated_power == pytest.approx(9.0981990279e-4, rel=1e-9)
    assert motion.peak_displacement_left == pytest.approx(1.6, abs=1e-12)
    assert motion.impact_rate is None
    assert motion.output("spring").unit == "N"
    assert motion.output("rate").rms == pytest.approx(0.3946305785571, rel=1e-11)
    with pytest.raises(ValueError, match="rate, spring"):
        motion.output("damper")
    data = motion.to_xarray()
    assert float(data["spring_peak"]) == motion.output("spring").peak
    table = motion.to_dataframe("outputs")
    assert table["name"].tolist() == ["rate", "spring"]
    assert table["peak"].tolist() == [output.peak for output in motion.outputs]


def test_many_trajectories_have_columns() -> None:
    states = [{}, {"phase": 1.0}]
    _, motions = computed("trajectories", {**REQUESTS["trajectories"], "initial": states, **ASKED})
    assert isinstance(motions, Trajectories)
    assert [motion.output("rate").name for motion in motions.trajectories] == ["rate"] * 2
    assert motions.to_xarray()["impulse"].shape == (2,)


def test_a_branch_has_values_where_its_orbits_are_admissible() -> None:
    _, branch = computed("orbit-branches", {**REQUESTS["orbit-branches"], **ASKED})
    assert isinstance(branch, OrbitBranch)
    assert branch.impulse.shape == branch.parameter.shape
    assert np.array_equal(np.isnan(branch.impulse), ~branch.admissible)
    speeds = np.sum(np.abs(branch.velocities), axis=1)[branch.admissible]
    np.testing.assert_allclose(branch.impulse[branch.admissible], 1.8 * speeds, rtol=1e-12)
    assert branch.to_dataframe()["spring_rms"].tolist()[6] == branch.output("spring").rms[6]
    axes = branch.plot("dissipated_power")
    assert axes.get_ylabel() == "dissipated power"
    assert branch.plot("spring_rms", labels=False).lines
    with pytest.raises(ValueError, match="no peak_force"):
        branch.plot("peak_force")
    plt.close("all")


def test_a_diagram_has_values_over_its_parameter() -> None:
    _, diagram = computed("bifurcation-diagrams", {**REQUESTS["bifurcation-diagrams"], **ASKED})
    assert isinstance(diagram, BifurcationDiagram)
    assert diagram.impulse[0] == pytest.approx(1.1893227616745, rel=1e-11)
    assert diagram.impulse[1] == 0.0  # no impacts
    assert np.isnan(diagram.mean_impact_speed_right[1])
    assert diagram.to_xarray()["rate_mean"].dims == ("parameter",)
    assert diagram.plot(quantity="impulse").get_ylabel() == "impulse"
    with pytest.raises(ValueError, match="one of"):
        diagram.plot(quantity="peak_force")
    plt.close("all")


def test_a_map_has_arrays_of_the_plane(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    body = REQUESTS["unfolding-maps"]
    plain, _ = computed("unfolding-maps", body)
    document, umap = computed("unfolding-maps", {**body, **ASKED})
    assert isinstance(umap, UnfoldingMap)
    for name, value in plain.items():
        if isinstance(value, np.ndarray):
            assert np.array_equal(value, document[name], equal_nan=value.dtype.kind == "f"), name
    assert set(document) - set(plain) == {*ASKED["observables"], "outputs"}
    assert umap.impulse.shape == umap.kind.shape
    assert umap.impulse[0, 1] == pytest.approx(1.1893227616745, rel=1e-11)
    assert np.all(umap.impulse[2] == 0.0)
    assert umap.to_xarray()["spring_rms"].dims == umap.to_xarray()["kind"].dims
    assert "dissipated power" in umap.plot("dissipated_power").get_title()
    assert umap.plot("spring_peak", legend="none").collections
    assert umap.plot(plt.figure().add_subplot()).get_legend() is not None
    with pytest.raises(ValueError, match="no impact_rate"):
        umap.plot("impact_rate")
    plt.close("all")
    saved, picture = umap.save(tmp_path / "map.npz"), tmp_path / "map.png"
    assert cli.main(["plot", str(saved), "--quantity", "spring_rms", "-o", str(picture)]) == 0
    assert picture.exists()
    assert cli.main(["plot", str(saved), "--quantity", "impact_rate"]) != 0
    assert "dissipated_power" in capsys.readouterr().err


def test_an_orbit_that_rests_and_one_that_is_not_found(monkeypatch: pytest.MonkeyPatch) -> None:
    resting = {"oscillator": {"restitution": 0.2}, "omega": 0.12, "clearance": 0.5, **ASKED}
    _, orbit = computed("periodic-orbits", resting)
    assert isinstance(orbit, PeriodicOrbit)
    assert orbit.found_by == "simulation"
    assert orbit.impulse > 0.0
    lost = {**POINT, "motion": {"period": 1, "stops": [1] * 40}, **ASKED}

    def not_closed(*arguments: object) -> None:
        raise LinearisationError("it did not close")

    monkeypatch.setattr(simulated_orbits, "simulated_orbit", not_closed)
    for request in (lost, resting):
        _, none = computed("periodic-orbits", request)
        assert isinstance(none, PeriodicOrbit)
        assert np.isnan([none.impulse, none.output("rate").peak]).all()


def identity(process: str, request: ProcessRequest) -> str:
    return canonical_id(process, request.canonical(), "0")


@pytest.mark.parametrize("process", REQUESTS)
def test_what_is_not_asked_for_changes_neither_id_nor_kernels(process: str) -> None:
    body = REQUESTS[process]
    plain, empty = (parse_request(process, variant) for variant in (body, {**body, "observables": [], "outputs": {}}))
    assert "observables" not in plain.canonical()
    assert identity(process, plain) == identity(process, empty)
    asked = parse_request(process, {**body, **ASKED})
    turned = {**ASKED, "observables": ASKED["observables"][::-1]}
    turned["outputs"] = {name: {"velocity": [0, 0, 0], **ASKED["outputs"][name]} for name in ("rate", "spring")}
    turned["outputs"]["rate"] = {"displacement": [0.0] * 3, "velocity": [1.0, 0.0, 0.0]}
    assert identity(process, asked) == identity(process, parse_request(process, {**body, **turned}))
    assert identity(process, asked) != identity(process, plain)
    step = kernels_of(process, asked)
    assert is_step(step)
    assert step != kernels_of(process, plain)
    estimates = [IMPLEMENTATIONS[process].plan(request).estimate.seconds for request in (plain, asked)]
    assert estimates[1] > estimates[0]


@pytest.mark.parametrize(
    ("asked", "pointer", "allowed"),
    [
        ({"observables": ["peak_force"]}, "/observables/0", "impulse"),
        ({"observables": ["impulse", "impulse"]}, "/observables/1", "different"),
        ({"observables": "impulse"}, "/observables", "a list"),
        ({"outputs": {"1st": {"displacement": [1, 0, 0]}}}, "/outputs", "letters"),
        ({"outputs": {"class": {"displacement": [1, 0, 0]}}}, "/outputs", "letters"),
        ({"outputs": {"x": {"displacement": [1, 0]}}}, "/outputs/x/displacement", "3 numbers"),
        ({"outputs": {"x": {"velocity": [1, 0, 0, 0]}}}, "/outputs/x/velocity", "3 numbers"),
        ({"outputs": {"x": {"displacement": [0, 0, 0]}}}, "/outputs/x", "velocity"),
        ({"outputs": {"x": {}}}, "/outputs/x", "velocity"),
        ({"outputs": {f"x{i}": {"displacement": [1, 0, 0]} for i in range(17)}}, "/outputs", ""),
        ({"outputs": [[1, 0, 0]]}, "/outputs", "object"),
        ({"observables": ["impulse"], "adaptive": True}, "/adaptive", "false"),
        ({"outputs": {"x": {"velocity": [1, 0, 0]}}, "resolve_sensitive": True}, "/resolve_sensitive", "false"),
    ],
)
def test_what_cannot_be_read_off_is_refused(asked: dict[str, Any], pointer: str, allowed: str) -> None:
    with pytest.raises(ParameterError) as refused:
        validated("unfolding-maps", {**REQUESTS["unfolding-maps"], **asked})
    (error,) = refused.value.problem.errors
    assert error.pointer == pointer
    assert allowed in (error.allowed or "")

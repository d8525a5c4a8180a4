"""What a notebook shows: pictures, small tables, and dataframes."""

import re

import numpy as np
import pytest

from grazemap import load
from grazemap.errors import MissingExtra
from grazemap.results import tables
from grazemap.results.explorer import ExplorerPage
from grazemap.results.html import thinned
from tests.support.sdk_documents import REQUESTS, document, result_of


@pytest.mark.parametrize("process", ["proofs", "trajectories", "unfolding-maps", "bifurcation-curves"])
def test_a_result_has_a_picture_and_a_table(process):
    html = result_of(process)._repr_html_()
    assert "<th style='text-align:left'>result</th>" in html
    assert ("src='data:image/png;base64,iVBOR" in html) is (process != "proofs")
    assert "nondimensional" in html


def test_without_matplotlib_there_is_the_table(monkeypatch):
    def missing(*_):
        raise MissingExtra("a picture", "plot")

    monkeypatch.setattr("grazemap.plots.axes.new_figure", missing)
    html = result_of("grazing-curves")._repr_html_()
    assert "img" not in html
    assert "0.2 to 0.3, 3 points" in html


def test_what_comes_from_outside_is_escaped():
    result = result_of("grazing-curves")
    result.meta["core_version"] = "<script>"
    assert "<script>" not in result._repr_html_()


def test_a_job_and_a_client_have_a_table_without_another_request(client, service):
    job = client.submit("grazing-curves", REQUESTS["grazing-curves"])
    sent = len(service.requests)
    job, client = (getattr(handle, "_target", handle) for handle in (job, client))
    html = job._repr_html_()
    assert "grazing-curves" in html
    assert "0 of 2 tiles" in html
    assert "http://fake:1" in client._repr_html_()
    assert "http://fake:1" in repr(client)
    assert len(service.requests) == sent


MAP = {"omega": (0.2, 0.3), "clearance": (1.5, 1.6), "shape": (2, 3), "progress": False}


def test_a_map_of_a_service_has_its_page(make_client, service):
    client = make_client()
    job = client.submit("unfolding-maps", REQUESTS["unfolding-maps"]).wait()
    page = job.result().explore(height=400)
    assert page.url == f"http://fake:1/#map={job.id}" == str(page)
    assert page.url in repr(page)
    html = page._repr_html_()
    assert f"<iframe src='{page.url}'" in html
    assert "height:400px" in html
    assert f"href='{page.url}'" in html  # where the frame may not be shown
    umap = client.unfolding_map(**MAP)
    sent = len(service.requests)
    assert umap.explore().url.startswith("http://fake:1/#map=")
    assert len(service.requests) == sent
    [batched] = client.map("unfolding-maps", [REQUESTS["unfolding-maps"]])
    assert batched.explore(height=400) == page


def test_in_other_units_a_map_has_the_same_page(make_client):
    machine = {"units": "SI", "masses": [1], "stiffnesses": [1], "damping": [0.1], "forcing": [5], "restitution": 0.5}
    window = {"omega": (0.9, 1.1), "clearance": (2.0, 3.0)}
    umap = make_client().unfolding_map(machine, **MAP | window)
    assert umap.in_units("Hz").explore() == umap.explore()


def test_the_address_of_a_page_is_escaped():
    assert "<script>" not in ExplorerPage("http://a.example/'><script>", 1)._repr_html_()


def test_a_map_of_no_service_has_no_page(make_client, tmp_path):
    umap = make_client().unfolding_map(**MAP)
    for other in (result_of("unfolding-maps"), load(umap.save(tmp_path / "map.npz"))):
        with pytest.raises(ValueError, match="service"):
            other.explore()


def test_points_are_rows_with_nothing_apart_from_zero():
    result = result_of("codimension-two-points")
    table = result.to_dataframe()
    assert len(table) == len(result.points)
    assert table["omega"].tolist() == [point.omega for point in result.points]
    orders = [point.order for point in result.points]
    assert None in orders
    assert table["order"].isna().tolist() == [order is None for order in orders]
    assert {"unfolding_slope", "unfolding_contact"} <= set(table.columns)


def test_impacts_are_rows():
    result = result_of("trajectories")
    table = result.to_dataframe("impacts")
    np.testing.assert_array_equal(table["velocity"], result.impacts.velocity)
    assert tables.tables(result) == ["time", "impacts", "sticking"]


def test_units_are_said_in_si():
    result = result_of("trajectories")
    result.meta["request"]["oscillator"]["units"] = "SI"
    assert result.to_dataframe("impacts").attrs["units"]["velocity"] == "m/s"


def test_a_table_in_si_has_hertz_and_millimetres_where_they_are_wanted():
    result = result_of("grazing-curves")
    with pytest.raises(ValueError, match="nondimensional"):
        result.to_dataframe(engineering_units=True)
    result.meta["request"]["oscillator"]["units"] = "SI"
    table = result.to_dataframe(engineering_units=True)
    np.testing.assert_allclose(table["omega"], result.omega / (2.0 * np.pi))
    np.testing.assert_allclose(table["clearance"], 1000.0 * result.clearance)
    np.testing.assert_array_equal(table["phase"], result.phase)
    assert (table.attrs["units"]["omega"], table.attrs["units"]["clearance"]) == ("Hz", "mm")


@pytest.mark.parametrize("process", list(REQUESTS))
def test_every_table_of_every_result_has_rows_for_its_records(process):
    result = result_of(process)
    for name in tables.tables(result):
        if name == "points" and not hasattr(result, name):  # of curves, or of a plane
            curves = getattr(result, "curves", None)
            points = len(result.vertical) * len(result.horizontal) if curves is None else sum(map(points_of, curves))
            assert len(result.to_dataframe(name)) == points
            continue
        own = {"point": "omega", "impact": "stops"}.get(name, name)
        records = result.derived_tables().get(name) or getattr(result, own)
        rows = len(records.order) if name == "next_contact" else len(records)
        assert len(result.to_dataframe(name)) == rows, name


def points_of(curve) -> int:
    return len(curve.line)


def test_another_table_is_refused_with_the_names_of_those_there_are():
    with pytest.raises(ValueError, match=re.escape("a Trajectory has the tables: time, impacts, sticking")):
        result_of("trajectories").to_dataframe("points")
    with pytest.raises(ValueError, match=re.escape("a BifurcationCurves has the tables: curves, motions")):
        result_of("bifurcation-curves").to_dataframe()


def test_the_arrays_of_a_result_are_its_table():
    curve = result_of("grazing-curves").to_dataframe()
    assert list(curve) == ["omega", "clearance", "phase", "first_recurrence", "recurrence_stop"]
    path = result_of("trajectories")
    samples = path.to_dataframe()
    assert list(samples) == ["time", *(f"{name}_{mass}" for name in ("displacement", "velocity") for mass in (1, 2, 3))]
    np.testing.assert_array_equal(samples["velocity_2"], path.velocity[1])
    branch = result_of("orbit-branches")
    orbits = branch.to_dataframe()
    np.testing.assert_array_equal(orbits[["velocities_1", "velocities_2"]], branch.velocities)
    assert {"parameter", "stable", "phases_2"} < set(orbits)
    sections = result_of("bifurcation-diagrams")
    np.testing.assert_array_equal(sections.to_dataframe()["parameter"], sections.parameter)


def test_special_points_have_the_velocities_of_their_impacts():
    branch = result_of("orbit-branches")
    table = branch.to_dataframe("special_points")
    for row, point in zip(table.itertuples(), branch.special_points, strict=True):
        known = point.velocities[: len(branch.stops)]
        assert [row.velocities_1, row.velocities_2][: len(known)] == known.tolist()


def test_a_thumbnail_of_a_large_map_is_thinned_and_a_failing_one_leaves_the_table(monkeypatch):
    umap = result_of("unfolding-maps")
    side = 750
    large = {
        name: np.resize(array, (side, side))
        for name, array in document("unfolding-maps").items() if np.ndim(array) == 2
    }  # fmt: skip
    axes = {"omega": np.linspace(0.2, 0.3, side), "clearance": np.linspace(1.0, 2.0, side)}
    whole = result_of("unfolding-maps", large | axes)
    small = thinned(whole)
    assert small.kind.shape == (375, 375)
    assert len(small.omega) == 375
    assert thinned(umap) is umap
    assert "<img" in whole._repr_html_()
    assert "750 x 750 points" in whole._repr_html_()

    def broken(*args, **kwargs):
        raise IndexError

    monkeypatch.setattr(type(umap), "plot", broken)
    assert "<img" not in umap._repr_html_()
    assert "<table" in umap._repr_html_()

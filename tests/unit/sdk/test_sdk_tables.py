"""Results as tables in files: what is read back is what `to_dataframe` has, with the units in the heads."""

import csv
import re

import numpy as np
import pandas as pd
import pytest

from grazemap import errors
from grazemap.cli import main
from grazemap.results import tables
from tests.support.sdk_documents import CURVES_OF_AXES, CURVES_OF_ONE, MOTIONS, REQUESTS, in_si, result_of

READERS = {".csv": pd.read_csv, ".xlsx": pd.read_excel, ".parquet": pd.read_parquet}


def plain(table):
    """The cells of a table as text, numbers to round-off; what is missing is empty."""
    return [list(map(written, row)) for row in table.itertuples(index=False)]


def written(cell):
    if pd.isna(cell):
        return ""
    # beside cells that are missing, pandas reads truth values as texts or numbers
    return {"True": "1", "False": "0"}.get(str(cell), str(cell) if isinstance(cell, str) else f"{float(cell):.12g}")


@pytest.mark.parametrize("process", list(REQUESTS))
@pytest.mark.parametrize("ending", list(READERS))
def test_every_table_of_every_result_is_read_back(process, ending, tmp_path):
    result = result_of(process)
    for name in tables.tables(result):
        path = result.save(tmp_path / f"x{ending}", name)
        table = result.to_dataframe(name)
        read = READERS[ending](path)
        assert [head.partition(" (")[0] for head in read.columns] == list(table.columns)
        assert plain(read) == plain(table)


def test_without_a_name_it_is_the_points_of_a_plane_or_the_arrays_and_a_workbook_has_all(tmp_path):
    umap, curve = result_of("unfolding-maps"), result_of("grazing-curves")
    assert len(pd.read_csv(umap.save(tmp_path / "map.csv"))) == umap.period.size
    assert list(pd.read_csv(curve.save(tmp_path / "curve.csv")).columns)[:2] == ["omega", "clearance"]
    assert list(pd.read_excel(umap.save(tmp_path / "map.xlsx"), sheet_name=None)) == ["points", "motions"]


def test_the_points_of_a_map_are_those_of_its_arrays():
    umap = result_of("unfolding-maps")
    points = umap.to_dataframe("points")
    rows, columns = umap.period.shape
    for row in range(rows):
        for column in range(columns):
            point = points.iloc[row * columns + column]
            assert (point["omega"], point["clearance"]) == (umap.omega[column], umap.clearance[row])
            assert point["label"] == umap.at(umap.omega[column], umap.clearance[row]).label
            assert point["kind"] == umap.kinds[umap.kind[row, column]]


@pytest.mark.parametrize(
    ("process", "table", "column"),
    [
        ("basins", "attractors", "label"),
        ("basin-fractions", "attractors", "label"),
        ("bifurcation-diagrams", "sections", "motion_label"),
    ],
)
def test_a_motion_that_is_not_periodic_has_its_kind_for_a_label_as_in_the_legend(process, table, column, tmp_path):
    result = result_of(process)
    shown = result.to_dataframe(table)
    kinds = shown[column.replace("label", "kind")]
    others = kinds != "periodic"
    assert others.any()
    assert shown[column][others].tolist() == kinds[others].tolist()
    assert pd.read_csv(result.save(tmp_path / "motions.csv", table))[column].tolist() == shown[column].tolist()


def test_heads_have_units_and_floats_all_digits(tmp_path):
    curve = result_of("grazing-curves of one stop")
    with curve.save(tmp_path / "curve.csv").open(newline="") as file:
        heads, first, *_ = list(csv.reader(file))
    assert heads[0] == "omega"  # nondimensional
    assert float(first[0]) == curve.omega[0]
    si = result_of("grazing-curves")
    si.meta["request"]["oscillator"]["units"] = "SI"
    heads = pd.read_csv(si.save(tmp_path / "si.csv", engineering_units=True)).columns
    assert {"omega (Hz)", "clearance (mm)"} <= set(heads)


@pytest.mark.parametrize("sample", ["bifurcation-curves", MOTIONS, CURVES_OF_ONE, CURVES_OF_AXES])
def test_bifurcation_curves_have_a_row_for_each_point(sample, tmp_path):
    result = result_of(sample)
    table = result.to_dataframe("points")
    across, up = result.parameters
    names = [{"clearance_right": "clearance"}.get(name, name) for name in (across, up)]
    assert len(table) == sum(len(curve.line) for curve in result.curves)
    for number, curve in enumerate(result.curves):
        rows = table[table["curve"] == number]
        np.testing.assert_array_equal(rows[names].to_numpy(), curve.line)
        assert set(rows["type"]) == {curve.type}
        assert set(rows["motion"]) == {curve.motion}
        np.testing.assert_array_equal(rows["impact_velocity"], curve.impact_velocity)
    written = pd.read_csv(result.save(tmp_path / "curves.csv"))
    assert [head.partition(" (")[0] for head in written.columns] == list(table.columns)
    assert len(written) == len(table)
    assert len(pd.read_csv(result.save(tmp_path / "list.csv", "curves"))) == len(result.curves)


def test_points_of_curves_have_units_and_there_may_be_none():
    units = in_si("bifurcation-curves").in_units("Hz", "mm").to_dataframe("points").attrs["units"]
    assert (units["omega"], units["clearance"], units["impact_velocity"]) == ("Hz", "mm", "m/s")
    assert not len(result_of("bifurcation-curves", {"curves": []}).to_dataframe("points"))


def test_initial_coordinates_and_what_varies_along_axes_have_their_units(tmp_path):
    basins = in_si("basins").in_units("mm")
    assert [basins.meta["request"][axis]["vary"] for axis in ("horizontal", "vertical")] == [
        "displacement[1]",
        "velocity[2]",
    ]
    table = basins.to_dataframe("points")
    assert (table.attrs["units"]["horizontal"], table.attrs["units"]["vertical"]) == ("mm", "m/s")
    assert table["horizontal"].tolist() == pytest.approx(np.tile(1000.0 * basins.horizontal, len(basins.vertical)))
    columns = tables.columns(in_si(CURVES_OF_AXES), "motions")
    assert (columns["horizontal"].unit, columns["vertical"].unit) == ("", "rad/s")  # a restitution has none
    assert tables.columns(result_of("basins"), "points")["horizontal"].unit == ""


def test_a_table_with_more_rows_than_a_sheet_is_refused_and_a_sheet_may_be_full(tmp_path, monkeypatch):
    curve, path = result_of("grazing-curves"), tmp_path / "curve.xlsx"
    monkeypatch.setattr(tables, "_SHEET_ROWS", len(curve.omega) + 1)
    curve.save(path, "omega")
    assert len(pd.read_excel(path)) == len(curve.omega)
    monkeypatch.setattr(tables, "_SHEET_ROWS", len(curve.omega))
    with pytest.raises(ValueError, match=r"\.csv, \.parquet"):
        curve.save(path, "omega")
    assert len(pd.read_excel(path)) == len(curve.omega)


def test_a_map_with_more_points_than_a_sheet_is_refused_before_it_is_computed(tmp_path, capsys):
    window = ["--omega", "0.26:0.30:1024", "--clearance", "1.3:2:1024"]
    nowhere = ["--url", "http://127.0.0.1:9"]
    assert main(["unfolding-maps", *window, *nowhere, "-o", str(tmp_path / "map.xlsx")]) == 2
    assert "1,048,576 rows" in capsys.readouterr().err


def test_what_cannot_be_written_is_named(tmp_path, monkeypatch):
    with pytest.raises(ValueError, match=re.escape("ends in one of .npz, .json, .csv, .xlsx, .parquet")):
        result_of("grazing-curves").save(tmp_path / "x.txt")
    with pytest.raises(ValueError, match="has the tables: omega, points"):
        result_of("grazing-curves").save(tmp_path / "x.csv", "samples")
    with pytest.raises(ValueError, match="has the tables: none"):
        result_of("proofs").save(tmp_path / "x.csv")
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    monkeypatch.setitem(__import__("sys").modules, "fastparquet", None)
    with pytest.raises(errors.MissingExtra, match="tables"):
        result_of("grazing-curves").save(tmp_path / "x.parquet")


def test_show_writes_a_table_of_a_saved_result(tmp_path, capsys):
    path = result_of("unfolding-maps").save(tmp_path / "map.npz")
    assert main(["show", str(path), "-o", str(tmp_path / "map.csv")]) == 0
    assert str(tmp_path / "map.csv") in capsys.readouterr().out
    assert len(pd.read_csv(tmp_path / "map.csv")) == result_of("unfolding-maps").period.size


def test_tables_that_are_not_in_the_schema_have_units_too():
    shown = in_si("structures").in_units("Hz").to_dataframe("modes")
    assert shown.attrs["units"]["natural_frequency"] == "Hz"
    branch = in_si("orbit-branches")
    assert branch.meta["request"]["axis"]["vary"] == "clearance"
    columns = tables.columns(branch, "stretches")
    assert {columns[name].unit for name in ("begins", "ends")} == {"m"}


def test_what_writes_a_table_is_asked_for_before_anything_is_computed(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("grazemap.results.tables.find_spec", lambda package: None if package == "openpyxl" else package)
    monkeypatch.setitem(tables._WRITERS, ".xlsx", ("openpyxl",))
    assert main(["run", "grazing-curves", "--url", "http://localhost:1", "-o", str(tmp_path / "x.xlsx")]) != 0
    assert "grazemap[tables]" in capsys.readouterr().err


def test_a_result_without_a_table_is_refused_without_a_traceback(tmp_path, capsys):
    proof, target = tmp_path / "proof.npz", tmp_path / "proof.csv"
    result_of("proofs").save(proof)
    assert main(["show", str(proof), "-o", str(target)]) == 2
    assert "tables: none" in capsys.readouterr().err

"""Results as tables and pictures over HTTP, as curl, a spreadsheet or a page asks for them."""

from __future__ import annotations

import io
from typing import Any

import httpx2
import pandas as pd
import pytest

from grazemap.local_client import LocalClient

WINDOW = {"omega": {"start": 0.26, "stop": 0.3, "points": 6}, "clearance": {"start": 1.3, "stop": 2.0, "points": 5}}


@pytest.fixture(scope="module")
def umap(stack: LocalClient) -> Any:
    window = {name: (grid["start"], grid["stop"]) for name, grid in WINDOW.items()}
    return stack.unfolding_map(**window, shape=(5, 6), max_periods=100, progress=False)


@pytest.fixture(scope="module")
def path(stack: LocalClient, umap: Any) -> str:
    """The address of the map's result."""
    return f"{stack.base_url}/v1/jobs/{stack.submit('unfolding-maps', {**WINDOW, 'max_periods': 100}).id}/result"


@pytest.mark.parametrize(
    ("form", "read"), [("csv", pd.read_csv), ("parquet", pd.read_parquet), ("xlsx", pd.read_excel)]
)
def test_a_table_is_that_of_the_client(umap: Any, path: str, form: str, read: Any) -> None:
    answer = httpx2.get(f"{path}?f={form}", timeout=60.0)
    assert answer.status_code == 200
    points = read(io.BytesIO(answer.content))
    expected = umap.to_dataframe("points")
    assert points["label"].tolist() == expected["label"].tolist()
    assert points["clearance"].tolist() == expected["clearance"].tolist()
    assert answer.headers["content-disposition"].endswith(f'.{form}"')
    motions = read(io.BytesIO(httpx2.get(f"{path}?f={form}&table=motions", timeout=60.0).content))
    assert motions["label"].tolist() == umap.to_dataframe("motions")["label"].tolist()


PICTURES = {"png": ("image/png", b"\x89PNG"), "svg": ("image/svg+xml", b"<?xml"), "pdf": ("application/pdf", b"%PDF")}


@pytest.mark.parametrize(("form", "media", "begins"), [(form, *kind) for form, kind in PICTURES.items()])
def test_a_picture_is_drawn(path: str, form: str, media: str, begins: bytes) -> None:
    answer = httpx2.get(path, headers={"Accept": media}, timeout=60.0)
    assert answer.status_code == 200
    assert answer.content.startswith(begins)
    again = httpx2.get(f"{path}?f={form}", headers={"If-None-Match": answer.headers["etag"]})
    assert again.status_code == 304


def test_a_table_that_there_is_not_is_named(path: str) -> None:
    answer = httpx2.get(f"{path}?f=csv&table=samples", timeout=60.0)
    assert answer.status_code == 406
    assert "has the tables: motions, points" in answer.json()["detail"]
    assert httpx2.get(f"{path}?f=csv&table=../etc").status_code == 422


def test_a_picture_for_a_column_is_another_representation(path: str) -> None:
    wide, column = (httpx2.get(f"{path}?f=svg{style}", timeout=60.0) for style in ("", "&style=column"))
    assert wide.headers["etag"] != column.headers["etag"]
    # 3.4 inches of 72 points
    assert b'width="244.8pt"' in column.content
    assert b'width="244.8pt"' not in wide.content
    assert httpx2.get(f"{path}?f=svg&style=poster").status_code == 422

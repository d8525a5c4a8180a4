"""docs/machines.md: blocks print what stands after them, curl asks what Python asks, and the drawings are current."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx2
import numpy as np
import pytest

import grazemap
from grazemap import Oscillator
from grazemap.local_client import LocalClient
from tools.guide import drawings, pages

PAGE = (pages.DOCS / "machines.md").read_text("utf-8")


def test_the_blocks_print_what_the_page_shows(
    stack: LocalClient, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(grazemap, "local", lambda: stack)
    monkeypatch.chdir(tmp_path)
    asked: list[int] = []

    def ask(process: str, request: dict[str, Any]) -> dict[str, Any]:
        posted = httpx2.post(f"{stack.base_url}/v1/{process}", json=request)
        asked.append(posted.status_code)
        answer: dict[str, Any] = httpx2.get(f"{stack.base_url}/v1/jobs/{posted.json()['id']}/result?f=json").json()
        return answer

    blocks = list(pages.run(PAGE, ask))
    assert asked == [200] * 6  # the job of the Python code before it; a new one would be 201
    for block in blocks:
        assert not block.differs
    assert (tmp_path / "rack.png").read_bytes().startswith(b"\x89PNG")


def test_a_changed_number_is_noticed() -> None:
    def differs(shown: str, printed: str) -> bool:
        return pages.Block("sh", printed, shown).differs

    assert not differs('{"a":[1.0,2.0]}', '{"a":[1.0,2.0000000000001]}')
    assert differs('{"a":[1.0,2.0]}', '{"a":[1.0,2.001]}')
    assert differs('{"a":1.0}', '{"b":1.0}')
    assert differs('{"a":1.0}', '{"a":1.0}\n{"a":1.0}')
    assert differs("0.5", "0.6")


def test_what_a_block_prints_is_written_after_it() -> None:
    page = "```python\nprint(3)\n```\n\n```text\n4\n```\n\n```python\nx = 1\n```\n"
    assert pages.written(page, lambda *_: {}) == page.replace("4", "3")


def test_the_drawings_are_those_of_the_script() -> None:
    for name, (title, parts) in drawings.DRAWINGS.items():
        path = drawings.FOLDER / f"machine_{name}.svg"
        assert path.read_text("utf-8") == drawings.drawing(title, parts), "python docs/drawings.py"
        assert f"![{title}](pictures/machine_{name}.svg)" in PAGE


def test_all_modes_are_the_structure_itself(stack: LocalClient) -> None:
    """The recipe for finite-element modes: a base, a static load, and a contact between two points."""
    random = np.random.default_rng(3)
    root = random.normal(size=(4, 4))
    mass, links = root @ root.T + np.eye(4), np.array([3.0, 2.0, 5.0, 4.0])
    stiffness = np.diag(links + np.roll(links, 1) * [0, 1, 1, 1]) - np.diag(links[:3], 1) - np.diag(links[:3], -1)
    row, force, load, ratio = np.array([1.0, -1.0, 0.0, 0.0]), random.normal(size=4), random.normal(size=4), 0.03
    # of unit modal mass: M = L L^T, and L^-1 K L^-T has orthogonal modes
    lower = np.linalg.cholesky(mass)
    squares, vectors = np.linalg.eigh(np.linalg.solve(lower, np.linalg.solve(lower, stiffness).T))
    shapes = np.linalg.solve(lower.T, vectors)
    damping = mass @ shapes @ np.diag(2 * ratio * np.sqrt(squares)) @ shapes.T @ mass
    influence = np.ones(4)

    def base(of: np.ndarray) -> dict[str, Any]:
        return {"amplitude": 0.2, "stops_move": False, "influence": of}

    whole = Oscillator.from_matrices(
        mass=mass,
        damping=damping,
        stiffness=stiffness,
        contact={"row": row},
        forcing=force,
        bias=load,
        base=base(influence),
    )
    modes = Oscillator.from_matrices(
        mass=np.eye(4),
        damping={"modal": ratio},
        stiffness=np.diag(squares),
        contact={"row": shapes.T @ row},
        forcing=shapes.T @ force,
        bias=shapes.T @ load,
        base=base(shapes.T @ mass @ influence),
    )
    expected, other = (stack.structure(of, omega=[0.3, 0.7, 1.1], times=[0.5, 2.0]) for of in (whole, modes))
    for name in ("amplitude", "phase", "amplitude_slope", "impulse_response", "natural_frequencies", "contact_weights"):
        np.testing.assert_allclose(getattr(other, name), getattr(expected, name), rtol=1e-10, atol=1e-12, err_msg=name)
    assert other.effective_mass == pytest.approx(expected.effective_mass, rel=1e-12)
    assert other.contact_equilibrium == pytest.approx(expected.contact_equilibrium, rel=1e-11)

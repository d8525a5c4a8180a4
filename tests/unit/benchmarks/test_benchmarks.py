"""The document of a benchmark run, its page, and the parts of the benchmarks whose errors would not be obvious."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from benchmarks.law import fit
from benchmarks.near_grazing import OVERSHOOTS, count
from benchmarks.operation_count import Scheme
from benchmarks.report import draw, page
from benchmarks.result import Bench, Spread
from benchmarks.stages import stages
from benchmarks.tables import tables
from benchmarks.work import CLEARANCE, Start, Work, reference_work, start_on_steady_motion
from grazemap_core.model.oscillator import Oscillator
from tests.support.thorough import KERNELS_FIRST

DOCUMENT = (Path(__file__).parent / "bench.json").read_text("utf-8")
"""Written by a quick run."""


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench.model_validate_json(DOCUMENT)


def test_page_shows_every_tool_and_every_table(bench: Bench) -> None:
    text = page(bench, "pictures/cost.svg")
    assert text.count("\n## ") == 9
    for entry in bench.throughput:
        assert entry.tool in text
    assert "](pictures/cost.svg)" in text
    assert not re.search(r"\b(nan|inf|None)\b", text)
    for line in text.splitlines():
        assert len(line) <= 120 or line.startswith("|"), line


def test_the_stored_page_is_generated_from_the_stored_document() -> None:
    docs = Path(__file__).parents[3] / "docs"
    kept = Bench.model_validate_json((docs / "performance.json").read_text("utf-8"))
    assert not kept.quick
    assert (docs / "performance.md").read_text("utf-8") == page(kept, "pictures/cost_against_size.svg")


@KERNELS_FIRST
def test_the_parts_of_the_time_add_up_to_the_whole() -> None:
    parts = stages(lane_count=128, periods=4, impacts=3.98, rounds=3, progress=lambda _: None)
    assert [part.name.split(",")[0] for part in parts] == ["26 cells", "impacts", "lanes put side by side and back"]
    for values in zip(*(part.share.values for part in parts), strict=True):
        assert sum(values) == pytest.approx(1.0)
    assert all(0.0 < part.share.median < 1.0 and part.nanoseconds.median > 1.0 for part in parts)


def test_figures_of_the_page_are_those_of_the_document(bench: Bench) -> None:
    rate = Spread.of([1.2345e6, 2.3456e6, 3.4567e6])
    slow = bench.grazing[-1].model_copy(update={"cases": 300, "found": 123})
    first = bench.throughput[0].model_copy(update={"rate": rate, "largest_error": 4.56e-7})
    changed = bench.model_copy(
        update={"throughput": [first, *bench.throughput[1:]], "grazing": [*bench.grazing[:-1], slow]}
    )
    before, after = tables(bench), tables(changed)
    for figure in ("2.35e+06 (1.79e+06 .. 2.9e+06)", "4.6e-07", "123 (41%)"):
        assert figure not in before
        assert figure in after


def test_ratios_are_taken_round_by_round(bench: Bench) -> None:
    for advantage in bench.advantages:
        ours, other = (
            next(e for e in bench.throughput if e.tool == tool and e.alike == advantage.alike)
            for tool in (bench.core, advantage.tool)
        )
        expected = [
            (ours.lanes * ours.periods / a) / (other.lanes * other.periods / b)
            for a, b in zip(ours.cpu_seconds, other.cpu_seconds, strict=True)
        ]
        assert advantage.ratio.values == pytest.approx(expected, rel=1e-12)
        assert advantage.ratio.median == pytest.approx(np.median(expected), rel=1e-12)


@pytest.mark.parametrize("change", [('"quick"', '"quickly"'), ('"lanes": 256', '"lanes": "many"')])
def test_a_document_of_another_shape_is_refused(change: tuple[str, str]) -> None:
    assert change[0] in DOCUMENT
    with pytest.raises(ValidationError):
        Bench.model_validate_json(DOCUMENT.replace(*change))


@pytest.mark.thorough
def test_picture_is_the_same_every_time(bench: Bench, tmp_path: Path) -> None:
    for name in ("one.svg", "two.svg"):
        draw(bench, tmp_path / name)
    assert (tmp_path / "one.svg").read_bytes() == (tmp_path / "two.svg").read_bytes()
    assert len(re.findall(r'id="axes_\d"', (tmp_path / "one.svg").read_text("utf-8"))) == 3


def test_fit_recovers_planted_laws() -> None:
    size = [1.0, 2.0, 3.0, 5.0, 8.0]
    line = fit(size, [3.0 + 2.0 * n for n in size])
    assert (line.constant, line.slope) == pytest.approx((3.0, 2.0), rel=1e-12)
    assert line.largest_deviation < 1e-12
    assert fit(size, [7.0 * n**1.7 for n in size]).exponent == pytest.approx(1.7, rel=1e-12)
    assert fit(size, [3.0, 5.0, 7.0, 11.0, 38.0]).largest_deviation > 0.1


class _Number:
    """A number that counts what is done to it."""

    done = 0

    def __init__(self, value: float) -> None:
        self.value = value

    def _did(self, value: float) -> _Number:
        _Number.done += 1
        return _Number(value)

    def __mul__(self, other: _Number) -> _Number:
        return self._did(self.value * other.value)

    def __add__(self, other: _Number) -> _Number:
        return self._did(self.value + other.value)

    def fused(self, factor: _Number, term: _Number) -> _Number:
        return self._did(self.value * factor.value + term.value)

    def negative(self) -> _Number:
        return _Number(-self.value)  # a change of sign goes into the operation that takes the number

    def max(self, other: _Number) -> _Number:
        return self._did(max(self.value, other.value))


@pytest.mark.parametrize("masses", [1, 3, 8])
def test_operations_per_cell_are_those_of_the_scheme_carried_out(masses: int) -> None:
    rng = np.random.default_rng(masses)
    state, flow, readout = rng.normal(size=(masses, 2)), rng.normal(size=(masses, 4)), rng.normal(size=(masses, 4))
    _Number.done = 0
    x, v = _Number(0.3), _Number(0.1)  # the steady motion
    for u, e, r in zip(state, flow, readout, strict=True):
        first, second = _Number(u[0]), _Number(u[1])
        a = first.fused(_Number(e[0]), second * _Number(e[1]))
        b = first.fused(_Number(e[2]), second * _Number(e[3]))
        x = b.fused(_Number(r[1]), a.fused(_Number(r[0]), x))
        v = b.fused(_Number(r[3]), a.fused(_Number(r[2]), v))
    behind = np.stack([np.sum(flow[:, :2] * state, 1), np.sum(flow[:, 2:] * state, 1)], 1)
    assert x.value == pytest.approx(0.3 + np.sum(readout[:, :2] * behind))
    assert v.value == pytest.approx(0.1 + np.sum(readout[:, 2:] * behind))
    third, x_before, v_before = _Number(0.1), _Number(0.2), _Number(0.4)
    largest = x_before.max(v_before.fused(third, x_before)).max(v.fused(_Number(-0.1), x)).max(x)
    _Number.done += 1  # the comparison with the limit
    assert largest.value >= x_before.value
    assert Scheme(masses, 16, 31).per_cell == _Number.done


def test_operations_of_a_period_add_up() -> None:
    scheme = Scheme(3, 16, 31)
    assert scheme.per_period(0.0) == 31 * scheme.per_cell
    assert scheme.per_period(4.0) - scheme.per_period(3.0) == scheme.per_impact


class _Knowing:
    """A tool with the exact first contacts, blind below an overshoot, and with a false contact where requested."""

    name = "knowing"

    def __init__(self, blind_below: float, invents: bool) -> None:
        self.blind_below, self.invents = blind_below, invents

    def prepare(self, work: Work) -> Callable[[], object]:
        raise NotImplementedError

    def impacts(self, work: Work) -> NDArray[np.int64]:
        raise NotImplementedError

    def impact_times(self, work: Work, count: int) -> NDArray[np.float64]:
        raise NotImplementedError

    def first_contacts(
        self, oscillator: Oscillator, start: Start, clearances: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        relative = clearances / start.amplitude
        seen = relative < 1.0 - self.blind_below
        times = np.where(seen, np.arcsin(np.minimum(relative, 1.0)) / start.omega, np.nan)
        return np.where(relative > 1.005, 1.0, times) if self.invents else times


def test_near_grazing_contacts_found_and_false_contacts_are_counted() -> None:
    told: list[str] = []
    rows = count([(_Knowing(0.0, False), 7), (_Knowing(1e-5, True), 5)], told.append)
    everything, half = rows[: len(OVERSHOOTS)], rows[len(OVERSHOOTS) :]
    assert all(row.found == row.cases == 7 and row.invented == 0 for row in everything)
    assert [row.found for row in half] == [5, 5, 5, 0, 0, 0]
    assert [row.invented for row in half] == [5, 0, 0, 0, 0, 0]
    assert len(told) == 2


def test_start_lies_on_the_steady_motion() -> None:
    """There the acceleration is -omega^2 x of every mass, by the equation of motion itself."""
    oscillator = reference_work(1).oscillator
    start = start_on_steady_motion(oscillator, 0.7)
    assert start.displacement[0] == pytest.approx(0.0, abs=1e-14)
    assert start.velocity[0] == pytest.approx(0.7 * start.amplitude, rel=1e-13)
    force = oscillator.forcing * math.sin(start.phase)
    pull = oscillator.stiffness_matrix @ start.displacement + oscillator.damping_matrix @ start.velocity
    acceleration = (force - pull) / oscillator.masses
    np.testing.assert_allclose(acceleration, -(0.7**2) * start.displacement, atol=1e-13)


def test_lane_0_of_the_reference_work_is_the_reference_trajectory() -> None:
    assert reference_work(300).clearances[0] == CLEARANCE
    assert reference_work(300).clearances[128] == CLEARANCE
    assert len(set(reference_work(128).clearances)) == 128
    assert set(reference_work(8, alike=True).clearances) == {CLEARANCE}

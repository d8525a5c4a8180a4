"""The printed figures of general structures, and the simulations that have them: decimal numbers, not doubles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from flint import arb

from tests.oracles.fifty_digits import digits
from tests.oracles.general_oracle import GeneralOracle

FIGURES: dict[str, Any] = {
    entry["id"]: entry["value"]
    for entry in json.loads((Path(__file__).parents[1] / "data" / "general_figures.json").read_text("utf-8"))["figures"]
}
PRINTED = 1e-23
"""Relative error of numbers of which 25 digits are printed."""

K = [[1, -1, 0], [-1, 6, -5], [0, -5, 10]]
M = [[1, 0, 0], [0, 10, 0], [0, 0, 10]]


def number(text: str | int) -> arb:
    """Return a decimal number as the figures mean it, not as a double."""
    with digits(60):
        return arb(str(text)).mid()


def decimal_chain(gaps: tuple[str | None, str | None], omega: str, restitution: str, **other: Any) -> GeneralOracle:
    """Return the chain of the figures, with C = K/10."""
    with digits(60):
        damping = [[(number("0.1") * k).mid() for k in row] for row in K]
    numbers = {"contact": [1, 0, 0], "harmonics": [(1, [1, 0, 0])]} | other
    return GeneralOracle(
        mass=M,
        damping=damping,
        stiffness=K,
        restitution=(number(restitution),) * 2,
        gaps=tuple(None if gap is None else number(gap) for gap in gaps),  # type: ignore[arg-type]
        omega=number(omega),
        **numbers,
    )


def decimal_mass(gap: str, omega: str, restitution: str, **start: Any) -> GeneralOracle:
    """Return the one mass of the figures under cos(omega t)."""
    return GeneralOracle(
        [[1]],
        [[number("0.1")]],
        [[1]],
        [1],
        [(1, [1j])],
        (number(restitution),) * 2,
        (number(gap), None),
        number(omega),
        **start,
    )


def after_periods(count: int, omega: str) -> arb:
    with digits(60):
        return (2 * count * arb.pi() / number(omega)).mid()


def assert_printed(values: list[arb], printed: list[str], relative: float = PRINTED) -> None:
    assert len(values) == len(printed)
    with digits(60):
        for value, text in zip(values, printed, strict=True):
            assert abs(value - number(text)) <= relative * abs(number(text))


def assert_equal_to(values: list[arb], expected: list[arb], error: float) -> None:
    assert len(values) == len(expected)
    with digits(60):
        assert all(abs(a - b) <= error for a, b in zip(values, expected, strict=True))

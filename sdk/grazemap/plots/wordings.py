"""The texts of pictures, in the units of a result or in those in which it is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from grazemap.units import shown_in

_OMEGA, _FREQUENCY = r"$\omega$", r"$\omega/2\pi$"


@dataclass(frozen=True)
class Amount:
    """A quantity in a text: its name with its unit, or with its value and unit."""

    symbol: str
    """The name or the symbol."""
    unit: str
    """The unit in SI."""
    value: float | None = None
    """The value in SI; None for the name of an axis."""

    def text(self, shown: Sequence[str]) -> str:
        """Return the text with one of the units that are shown, if it has one."""
        unit, factor = shown_in(self.unit, shown)
        symbol = self.symbol.replace(_OMEGA, _FREQUENCY) if unit != self.unit else self.symbol
        return f"{symbol} ({unit})" if self.value is None else f"{symbol} = {self.value * factor:.5g} {unit}"


@dataclass(frozen=True)
class Wording:
    """A text of a picture, in any units."""

    parts: tuple[str | Amount, ...]
    """The parts of the text in order."""
    unit: str = ""
    """The unit in SI of the numbers along an axis with this text; empty if they have none."""

    def text(self, shown: Sequence[str] = ()) -> str:
        """Return the text, with the units that are shown in place of those of SI."""
        return "".join(part if isinstance(part, str) else part.text(shown) for part in self.parts)

    def __add__(self, suffix: str | Wording) -> Wording:
        return replace(self, parts=(*self.parts, *_parts_of(suffix)))

    def __radd__(self, prefix: str) -> Wording:
        return replace(self, parts=(prefix, *self.parts))


def _parts_of(text: str | Wording) -> tuple[str | Amount, ...]:
    return (text,) if isinstance(text, str) else text.parts


def unit_wording(text: str, unit: str = "", units: str = "SI") -> Wording:
    """Return the text of an axis, with its unit if there is one; nondimensional quantities have none."""
    return Wording((Amount(text, unit),), unit) if unit and units == "SI" else Wording((text,))


def value_wording(symbol: str, value: float, unit: str, units: str) -> Wording:
    """Return the text "symbol = value unit"; nondimensional quantities have no unit."""
    return Wording((Amount(symbol, unit, value) if units == "SI" else f"{symbol} = {value:.5g}",))

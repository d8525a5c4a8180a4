"""Ticks of an axis that shows its data in another unit, multiplied by a factor. Needs matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.ticker import Locator, LogFormatterSciNotation, ScalarFormatter

# Values between these are legible as numbers.
_MIN_PLAIN, _MAX_PLAIN = 1e-2, 1e4


class ScaledLocator(Locator):
    """Places ticks so that another locator would place them at the scaled data."""

    def __init__(self, locator: Locator, factor: float) -> None:
        self._locator, self._factor = locator, factor

    @classmethod
    def of(cls, locator: Locator, factor: float) -> ScaledLocator:
        """Return the locator for a factor, of the other locator or of one that is scaled already."""
        return cls(locator._locator if isinstance(locator, ScaledLocator) else locator, factor)

    def __call__(self) -> list[float]:
        """Return the places of the ticks in the view, in the unit of the data."""
        assert self.axis is not None
        return self.tick_values(*self.axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the places of the ticks, in the unit of the data."""
        return [place / self._factor for place in self._locator.tick_values(vmin * self._factor, vmax * self._factor)]

    def nonsingular(self, v0: float, v1: float) -> tuple[float, float]:
        """Return the limits of a view by the other locator: they differ, and are positive on a logarithmic axis."""
        low, high = self._locator.nonsingular(v0, v1)
        return low, high

    def set_params(self, **settings: Any) -> None:
        """Set the parameters of the other locator."""
        self._locator.set_params(**settings)


class ScaledFormatter(ScalarFormatter):
    """Writes the data times a factor, in the shown unit, with as many digits as the ticks of the view need."""

    def __init__(self, factor: float, shown_unit: str) -> None:
        super().__init__()
        self._factor, self.shown_unit = factor, shown_unit

    def set_axis(self, axis: Any) -> None:
        """Take the view of an axis, in the unit that is shown."""
        self._data_axis = axis
        self.create_dummy_axis()
        self._shown: Any = self.axis

    def set_locs(self, locs: Sequence[float]) -> None:
        """Choose the digits for ticks at places in the unit of the data."""
        self._shown.set_view_interval(*(end * self._factor for end in self._data_axis.get_view_interval()))
        super().set_locs([place * self._factor for place in locs])

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick."""
        return super().__call__(x * self._factor, pos)

    def format_data_short(self, value: Any) -> str:
        """Return the text of a value under the pointer."""
        return super().format_data_short(value * self._factor)


class ScaledLogFormatter(LogFormatterSciNotation):
    """Writes the data times a factor, on a logarithmic axis: numbers, and powers of ten over a wide range."""

    def __init__(self, factor: float, shown_unit: str) -> None:
        super().__init__()
        self._factor, self.shown_unit = factor, shown_unit

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick."""
        assert self.axis is not None
        text = super().__call__(x * self._factor, pos)
        low, high = sorted(abs(end) * self._factor for end in self.axis.get_view_interval())
        return f"{x * self._factor:.10g}" if text and low >= _MIN_PLAIN and high <= _MAX_PLAIN else text

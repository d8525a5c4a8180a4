"""Ticks of an axis that shows its data in another unit. Needs matplotlib."""

from __future__ import annotations

from typing import Any

from matplotlib.ticker import Formatter, Locator, LogFormatterSciNotation, MaxNLocator

# Values between these are legible as numbers.
_SMALLEST, _LARGEST = 1e-2, 1e4


class ScaledLocator(Locator):
    """Places ticks where the data times a factor have the ticks of another locator."""

    def __init__(self, of: MaxNLocator, factor: float) -> None:
        self._of, self._factor = of, factor

    def __call__(self) -> list[float]:
        """Return the places of the ticks in the view, in the unit of the data."""
        assert self.axis is not None
        return self.tick_values(*self.axis.get_view_interval())

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the places of the ticks, in the unit of the data."""
        return [place / self._factor for place in self._of.tick_values(vmin * self._factor, vmax * self._factor)]

    def set_params(self, **settings: Any) -> None:
        """As of the other locator."""
        self._of.set_params(**settings)


class ScaledFormatter(Formatter):
    """Writes the data times a factor."""

    def __init__(self, factor: float, digits: int) -> None:
        self._factor, self._digits = factor, digits

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick."""
        return self.fix_minus(f"{x * self._factor:.{self._digits}g}")


class ScaledLogFormatter(LogFormatterSciNotation):
    """Writes the data times a power of ten, on a logarithmic axis: numbers, and powers of ten over a wide range."""

    def __init__(self, factor: float) -> None:
        super().__init__()
        self._factor = factor

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick."""
        assert self.axis is not None
        text = super().__call__(x * self._factor, pos)
        low, high = sorted(abs(end) * self._factor for end in self.axis.get_view_interval())
        return f"{x * self._factor:.10g}" if text and low >= _SMALLEST and high <= _LARGEST else text

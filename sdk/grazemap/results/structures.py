"""The linear properties of a structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.results.base import Result, counted
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.records import FloatArray, described
from grazemap.schema.structures import GAPS, HARMONIC

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@described(GAPS, comparable=True)
class Gaps:
    """The distances of the stops from the static equilibrium; None: there is no such stop."""

    right: float | None
    left: float | None


@described(HARMONIC)
class HarmonicResponse:
    """The steady motion of the contact coordinate in one harmonic of the forces."""

    harmonic: int
    amplitude: FloatArray
    phase: FloatArray
    amplitude_slope: FloatArray


@dataclass(frozen=True)
class Mode:
    """One mode of a structure; the contact weight is None where the stiffness matrix is not symmetric.

    The damping ratio is that of the damped mode with this place in the order of frequencies.
    """

    natural_frequency: float
    damping_ratio: float
    contact_weight: float | None


class Structure(Result):
    """The linear properties of an oscillator: the structure without contact, as the contact coordinate sees it."""

    effective_mass: float
    kappa: float
    equilibrium: FloatArray
    contact_equilibrium: float
    gaps: Gaps | None
    natural_frequencies: FloatArray
    damping_ratios: FloatArray
    contact_weights: FloatArray | None
    omega: FloatArray
    amplitude: FloatArray | None
    phase: FloatArray | None
    amplitude_slope: FloatArray | None
    harmonics: tuple[HarmonicResponse, ...]
    time: FloatArray
    impulse_response: FloatArray

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes by increasing frequency."""
        weights = [None] * len(self.natural_frequencies) if self.contact_weights is None else self.contact_weights
        each = zip(self.natural_frequencies.tolist(), self.damping_ratios.tolist(), weights, strict=True)
        return tuple(Mode(omega, ratio, None if w is None else float(w)) for omega, ratio, w in each)

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """As `Result.derived_tables`."""
        return {"modes": self.modes}

    @picture
    def plot(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the amplitude over omega with the natural frequencies; without omega the impulse response over time."""
        return draw(self, ax, options)

    def _summary(self) -> str:
        return f"{counted(self.natural_frequencies, 'mode')}, effective mass {self.effective_mass:.6g}"

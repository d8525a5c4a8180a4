"""The linear properties of a structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Unpack

from grazemap.described import described
from grazemap.results.base import Result, counted
from grazemap.results.common_records import Common
from grazemap.results.pictures import PictureOptions, draw, picture
from grazemap.results.record import FloatArray, Record, field
from grazemap.wire.planes import unit_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_WITH_ONE_HARMONIC = "if the forces have one harmonic"


class Gaps(Record):
    """The distances of the stops from the static equilibrium. A preloaded stop has a negative one."""

    right: float = field("Distance of the right stop, null if there is none.", unit="m", null=True)
    left: float = field("Distance of the left stop, null if there is none.", unit="m", null=True)


class HarmonicResponse(Record):
    """The steady motion of the contact coordinate in one harmonic of the forces.

    Amplitude, phase and slope are null at a resonance without damping.
    """

    harmonic: int = field("The multiple of omega.")
    amplitude: FloatArray = field("Amplitude of the contact coordinate.", "omega", "m", null=True)
    phase: FloatArray = field(
        "Its phase: the contact coordinate is amplitude sin(harmonic omega t + phase) about the equilibrium.",
        "omega",
        "rad",
        null=True,
    )
    amplitude_slope: FloatArray = field("d amplitude/d omega.", "omega", "m s/rad", null=True)


@described
@dataclass(frozen=True)
class Mode:
    """One mode of a structure."""

    natural_frequency: float
    """Angular frequency without damping."""
    damping_ratio: float
    """Damping ratio of the damped mode with the same place in the order of frequencies; NaN where
    `Structure.damping_ratios` is null."""
    contact_weight: float | None
    """Weight of the mode in the contact coordinate; None where the stiffness matrix is not symmetric."""


class Structure(Result, process="structures", rows="omega"):
    """Linear properties of an oscillator: the structure without contact, as the contact coordinate q = h x sees it."""

    effective_mass: float = field("1/(h M^-1 h): the mass m_c of the contact coordinate under an impulse.", unit="kg")
    kappa: float = field(
        "m_c h M^-1 C M^-1 h: the relative rate at which damping alone slows the contact just after an impulse.",
        unit="1/s",
    )
    equilibrium: FloatArray = field("Displacements under the bias.", "mass", "m")
    contact_equilibrium: float = field("The contact coordinate in the equilibrium.", unit="m")
    gaps: Gaps | None = field("The distances of the stops from the equilibrium.", when="with clearance", prefix="gap_")
    natural_frequencies: FloatArray = field(
        "Angular frequencies of the structure without damping, increasing; 0 of a free mode; null where follower "
        "forces make it flutter.",
        "mode",
        "rad/s",
        null=True,
    )
    damping_ratios: FloatArray = field(
        "Damping ratios of the damped modes, by increasing frequency; null for a free mode. If the damping is not "
        "diagonal in the modes, and several modes do not oscillate, null for these too.",
        "mode",
        null=True,
    )
    contact_weights: FloatArray | None = field(
        "|h phi_j| of undamped modes phi_j of unit modal mass; 0: the mode is neither seen nor excited at the contact.",
        "mode",
        "1/sqrt(kg)",
        when="where the stiffness matrix is symmetric",
    )
    omega: FloatArray = field(Common, "omega")
    amplitude: FloatArray | None = field(HarmonicResponse, when=_WITH_ONE_HARMONIC)
    phase: FloatArray | None = field(HarmonicResponse, when=_WITH_ONE_HARMONIC)
    amplitude_slope: FloatArray | None = field(HarmonicResponse, when=_WITH_ONE_HARMONIC)
    harmonics: tuple[HarmonicResponse, ...] = field("The steady motion in every harmonic.", "harmonic", variable=None)
    time: FloatArray = field("Times after the impulse.", "time", "s")
    impulse_response: FloatArray = field(
        "g: the contact coordinate after an impulse that changes its velocity by 1.", "time", "s"
    )

    @property
    def modes(self) -> tuple[Mode, ...]:
        """The modes by increasing frequency."""
        weights = [None] * len(self.natural_frequencies) if self.contact_weights is None else self.contact_weights
        each = zip(self.natural_frequencies.tolist(), self.damping_ratios.tolist(), weights, strict=True)
        return tuple(Mode(omega, ratio, None if w is None else float(w)) for omega, ratio, w in each)

    def derived_tables(self) -> dict[str, Sequence[Any]]:
        """Return the table "modes"."""
        return {"modes": self.modes}

    def derived_units(self) -> dict[str, str]:
        """Return the unit of natural frequencies."""
        return {"natural_frequency": unit_of("omega")}

    @picture
    def plot(self, ax: Axes | None = None, **options: Unpack[PictureOptions]) -> Axes:
        """Draw the amplitude over omega, with the natural frequencies; if omega was left out, the impulse response."""
        return draw(self, ax, options)

    def _summary(self) -> str:
        return f"{counted(self.natural_frequencies, 'mode')}, effective mass {self.effective_mass:.6g}"

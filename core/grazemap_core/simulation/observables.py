"""Quantities that are read off a motion: impact rates and speeds, impulse, dissipated power, and outputs.

All are of a part of a motion of one or several forcing periods. Speeds, impulses and energies are those of the impact
law, ``p = (1 + R) m_c |q'|`` and ``m_c (1 - R^2) q'^2/2`` (theory, "Any linear structure"). The force at an impact on a
rigid stop is infinite, so there is no peak force.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from grazemap_core.arrays import Complexes, Floats
from grazemap_core.contact.kernels.cells import Forced, HeldProblem
from grazemap_core.contact.trajectory_models import TrajectoryModels
from grazemap_core.errors import ParameterError
from grazemap_core.model.equilibrium import equilibrium
from grazemap_core.model.harmonic_response import harmonic_amplitudes
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass
from grazemap_core.simulation.kernels.observed_motion import (
    TOP_SPEED,
    ObservedOutputs,
    Totals,
    clear_totals,
    observe_rows,
)
from grazemap_core.simulation.kernels.output_rows import (
    HIGHEST,
    INTEGRAL,
    LOWEST,
    SQUARE_INTEGRAL,
    OutputRows,
    OutputScratch,
)
from grazemap_core.simulation.record import Record
from grazemap_core.simulation.tolerances import PANEL_DEGREE, PANEL_REACH, PEAK_DEPTH

_BY_STOP: Final = ("impact_rate", "peak_impact_speed", "mean_impact_speed", "impulse", "dissipated_power")
_SIDES: Final = (("", slice(0, 2)), ("_right", slice(0, 1)), ("_left", slice(1, 2)))
_OF_DISPLACEMENT: Final = (
    "rms_displacement",
    "peak_displacement",
    "peak_displacement_right",
    "peak_displacement_left",
)
OBSERVABLES: Final = (*(name + side for name in _BY_STOP for side, _ in _SIDES), *_OF_DISPLACEMENT)
"""Names of quantities; those that end in _right and _left are of one stop, or toward it.

impact_rate: impacts per forcing period; NaN in complete chatter, which has infinitely many. peak_impact_speed,
mean_impact_speed: of the contact before impacts; NaN without impacts; of complete chatter the mean is 0. impulse: of
the contact force per forcing period, in impacts and while the contact rests, both stops added. dissipated_power: energy
lost in impacts per unit of time. rms_displacement, peak_displacement: of the contact about its static equilibrium; the
peak is the largest modulus, or the largest displacement toward one stop."""
MEANS: Final = ("rms", "mean", "peak")
"""What is computed of every output; the peak is the largest modulus, with the limits on both sides of an impact."""


@dataclass(frozen=True, eq=False)
class Output:
    """A quantity ``displacement x + velocity x'``; displacements as in trajectories."""

    name: str
    """Name of the output."""
    displacement: Floats
    """(N,) As above."""
    velocity: Floats
    """(N,) As above."""


@dataclass(frozen=True, eq=False)
class Observables:
    """What is read off motions.

    Raises
    ------
    ParameterError
        There is no such observable.
    """

    names: tuple[str, ...] = ()
    """Names out of OBSERVABLES."""
    outputs: tuple[Output, ...] = ()
    """Further quantities, whose extremes are read off."""

    def __post_init__(self) -> None:
        if not set(self.names) <= set(OBSERVABLES):
            raise ParameterError("observables", f"must be among {', '.join(OBSERVABLES)}")

    @property
    def count(self) -> int:
        """Number of figures of a motion: one for each observable, and MEANS of every output."""
        return len(self.names) + len(MEANS) * len(self.outputs)

    @property
    def nothing(self) -> Floats:
        """The figures (count,) of a motion that is not known."""
        return np.full(self.count, np.nan)

    @property
    def of_contact(self) -> bool:
        """Whether the displacement of the contact is an output, the first one."""
        return any(name in _OF_DISPLACEMENT for name in self.names)

    def scratch(self, size: int) -> OutputScratch:
        """Return scratch for an oscillator of N = `size`."""
        return OutputScratch(
            state=np.zeros((size, 2)),
            series=np.zeros((self._rows, PANEL_DEGREE + 1)),
            forcing=np.zeros((2, PANEL_DEGREE + 1)),
            last=np.zeros(self._rows),
            stack=np.zeros((PEAK_DEPTH, 6)),
        )

    def totals(self) -> Totals:
        """Return totals of nothing."""
        totals = Totals(np.zeros((5, 2)), np.zeros((self._rows, 4)))
        clear_totals(totals)
        return totals

    @property
    def _rows(self) -> int:
        return 1 + self.of_contact + len(self.outputs)

    def figures(self, contacts: Floats, outputs: Floats, omega: float, periods: ArrayLike) -> Floats:
        """Return the figures (..., count) of motions: those of `names`, then those of the outputs.

        Parameters
        ----------
        contacts, outputs : (..., 5, 2) and (..., R, 4)
            Their totals.
        periods : (...)
            Forcing periods that the totals are of; where they are 0, nothing is known and the figures are NaN.
        """
        number = np.asarray(periods, dtype=np.float64)
        duration = number * (2.0 * math.pi / omega)
        sums = outputs[..., 1:, :]
        with np.errstate(invalid="ignore", divide="ignore"):
            values = _of_contacts(contacts, duration, number)
            rms = np.sqrt(sums[..., SQUARE_INTEGRAL] / duration[..., None])
            mean = sums[..., INTEGRAL] / duration[..., None]
            peak = np.maximum(sums[..., HIGHEST], sums[..., LOWEST])
            if self.of_contact:
                of_displacement = (rms[..., 0], peak[..., 0], sums[..., 0, HIGHEST], sums[..., 0, LOWEST])
                values |= dict(zip(_OF_DISPLACEMENT, of_displacement, strict=True))
        means = np.stack([rms, mean, peak], axis=-1)[..., int(self.of_contact) :, :]
        columns = [values[name] for name in self.names]
        figures = np.stack([*columns, *np.moveaxis(means.reshape(*number.shape, -1), -1, 0)], axis=-1)
        return np.where(number[..., None] > 0.0, figures, np.nan)


def _of_contacts(contacts: Floats, duration: Floats, periods: Floats) -> dict[str, Floats]:
    """Return the quantities of both stops and of each, by name, (...) each."""
    values: dict[str, Floats] = {}
    for side, columns in _SIDES:
        impacts, speeds, _, impulse, loss = np.moveaxis(np.sum(contacts[..., columns], axis=-1), -1, 0)
        top = np.max(contacts[..., TOP_SPEED, columns], axis=-1)
        values[f"impact_rate{side}"] = np.where(np.isinf(impacts), np.nan, impacts / periods)
        values[f"peak_impact_speed{side}"] = np.where(impacts > 0.0, top, np.nan)
        values[f"mean_impact_speed{side}"] = np.where(impacts > 0.0, speeds / impacts, np.nan)
        values[f"impulse{side}"] = impulse / periods
        values[f"dissipated_power{side}"] = loss / duration
    return values


def observed_outputs(
    wanted: Observables, models: TrajectoryModels, forced: Forced, steady: Complexes, whole: bool = False
) -> ObservedOutputs:
    """Return the outputs of an oscillator at one forcing frequency, for the kernels.

    Parameters
    ----------
    steady : complex (H, 2, N)
        Amplitudes of the motion that states lack, with the phase of the forcing at t = 0: those of the displacements,
        and of the velocities divided by i order omega.
    whole : bool
        Whether that motion is the whole steady motion. Otherwise it is the reference motion, without resonant modes.
    """
    problem, held, oscillator = forced.free, forced.held, models.oscillator
    rates = 1j * problem.omega * problem.orders[:, None]
    displacement, velocity, constant = _rows(wanted, oscillator)

    def output_rows(
        blocks: ModalModel | HeldProblem, columns: Floats, amplitudes: Complexes, of_rates: Complexes
    ) -> OutputRows:
        """Return outputs of blocks; columns (2 N, 2 n) are the displacements and velocities of these."""
        places, speeds = columns[: oscillator.size], columns[oscillator.size :]
        root = np.sqrt(np.maximum(-blocks.discriminant, 0.0))
        exponents = np.where(blocks.discriminant < 0.0, blocks.decay + root, np.sqrt(blocks.frequency_squared))
        fastest = float(np.max(np.concatenate([exponents, problem.omega * problem.orders])))
        harmonics = amplitudes @ displacement.T + (rates * of_rates) @ velocity.T
        return OutputRows(
            decay=np.ascontiguousarray(blocks.decay),
            discriminant=np.ascontiguousarray(blocks.discriminant),
            frequency_squared=np.ascontiguousarray(blocks.frequency_squared),
            values=np.ascontiguousarray(displacement @ places + velocity @ speeds),
            harmonics=np.ascontiguousarray(harmonics.T),
            constants=np.stack([constant, np.zeros_like(constant)], axis=1),
            panel=PANEL_REACH / fastest,
            resonant=False,
        )

    free = output_rows(models.free, models.free.from_modal, steady[:, 0], steady[:, 1])
    turned = held.phase_factors[:, 0, 0] + 1j * held.phase_factors[:, 0, 1]
    held_steady = (held.steady[..., 0] + 1j * held.steady[..., 1]) * turned[:, None]
    at_rest = output_rows(held, held.from_blocks, held_steady, held_steady)
    # at rest the output 0 is the acceleration of q that the stop takes
    at_rest.values[0] = held.output_row[:, :2].ravel()
    at_rest.harmonics[0] = held.steady_table[:, 0, 0] + 1j * held.steady_table[:, 0, 1]
    at_rest.constants[0, 1], at_rest.constants[1:, 1] = -held.static_acceleration, (displacement @ held.profile)[1:]
    return ObservedOutputs(
        free=free._replace(resonant=problem.resonant_forcing.shape[1] > 0 and not whole),
        held=at_rest,
        jumps=velocity @ oscillator.jump,
        effective_mass=oscillator.effective_mass,
    )


def whole_steady(oscillator: Oscillator, omega: float) -> Complexes:
    """Return the amplitudes of the steady motion, with all modes, as `observed_outputs` takes them, (H, 2, N)."""
    parts = [harmonic_amplitudes(oscillator, np.array([omega]), harmonic)[0, :-1] for harmonic in oscillator.forces]
    return np.stack([parts, parts], axis=1)


def _rows(wanted: Observables, oscillator: Oscillator) -> tuple[Floats, Floats, Floats]:
    """Return R outputs: their rows (R, N) on displacements from the equilibrium and on velocities, and constants (R,).

    The first output is 0, the second one the contact coordinate if it is wanted.
    """
    nothing, here = np.zeros(oscillator.size), equilibrium(oscillator)
    rows = [(nothing, nothing)] + ([(oscillator.contact, nothing)] if wanted.of_contact else [])
    constant = [0.0] * len(rows) + [math.fsum(output.displacement * here) for output in wanted.outputs]
    rows += [(output.displacement, output.velocity) for output in wanted.outputs]
    displacement, velocity = (np.array(part) for part in zip(*rows, strict=True))
    return displacement, velocity, np.array(constant)


def of_record(record: Record, models: TrajectoryModels, wanted: Observables, periods: int) -> Floats:
    """Return the figures (count,) of a record that has all of its forcing periods; `wanted.nothing` of others."""
    if not record.end >= (periods - 0.5) * record.period:
        return wanted.nothing
    outputs = observed_outputs(wanted, models, record.forced, record.steady[:, :, :-1])
    totals, scratch = wanted.totals(), wanted.scratch(len(record.equilibrium))
    end = (float(record.first_half + 2 * periods), 0.0)
    observe_rows(record.forced.free, outputs, record.stops, record.rows, end, totals, scratch)
    return wanted.figures(totals.contacts, totals.outputs, record.forced.free.omega, periods)

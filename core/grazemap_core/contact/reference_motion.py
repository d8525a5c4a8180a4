"""The motion that states are relative to: the steady motion, or, of resonant modes, the response of half a period."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.contact.held_problem import half_period_phases, real_and_imaginary, whole_period
from grazemap_core.model.kernels.forced_flow import forced_block
from grazemap_core.model.modal import ModalModel
from grazemap_core.model.oscillator import Oscillator
from grazemap_core.model.resonant_modes import modal_forcing, modal_steady, resonant_modes
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE

_TERMS = TAYLOR_DEGREE + 1


class ReferenceMotion(NamedTuple):
    """The fields of `CellProblem` that depend on the phase of the forcing."""

    steady_table: Floats
    steady_bound: float
    steady_fourth: float
    reference_series: Floats
    reference_rest: float
    resonant_forcing: Complexes
    half_jump: Floats
    resonant_steady: Floats
    lasting_steady: complex
    lasting_bound: float


@dataclass(frozen=True, eq=False)
class _Grid:
    """The cells of half a forcing period; phases are exp(i omega t) at their boundaries, (cells/2 + 1,)."""

    omega: float
    step: float
    phases: Complexes

    def series(self, value: Complexes) -> Complexes:
        """Return the series of exp(i omega t) times values at the cells' starts, shape (cells/2, terms)."""
        terms = np.empty((len(value), _TERMS), dtype=np.complex128)
        for k in range(_TERMS):
            terms[:, k] = value
            value = value * (1j * self.omega * self.step / (k + 1))
        return terms


@dataclass(frozen=True, eq=False)
class _ResonantMode:
    """A resonant mode, at rest at the start of the half period, at phase 0; y is its part of the motion of mass 1.

    ``y'' + 2 decay y' + frequency_squared y = force exp(i omega t)``, y(0) = 0, y'(0) = rate.

    Attributes
    ----------
    decay, frequency_squared : float
    force, rate : complex
    states : complex (cells/2 + 1, 2)
        u and u' at the cell boundaries.
    place, slope : complex (cells/2 + 1,)
        y and its derivative there.
    """

    decay: float
    frequency_squared: float
    force: complex
    rate: complex
    states: Complexes
    place: Complexes
    slope: Complexes

    @classmethod
    def of(cls, model: ModalModel, j: int, forcing: Floats, row: Floats, grid: _Grid) -> _ResonantMode:
        """Return mode j of a model, with its forcing (2,) and its row of `CellProblem.output_row` (4,)."""
        decay, square = float(model.decay[j]), float(model.frequency_squared[j])
        first, second = complex(forcing[0]), complex(forcing[1])
        times = (k * grid.step for k in range(len(grid.phases)))
        states = np.array(
            [forced_block(decay, float(model.discriminant[j]), square, first, second, grid.omega, t) for t in times],
            dtype=np.complex128,
        )
        rate = complex(row[:2] @ forcing)
        force = complex(row[2:] @ forcing) + (2.0 * decay + 1j * grid.omega) * rate
        place = np.asarray(states @ row[:2])
        slope = np.asarray(states @ row[2:] + rate * grid.phases)
        return cls(decay, square, force, rate, states, place, slope)

    def bound(self, order: int, omega: float) -> float:
        """Return a bound of the derivative of y of this order within half a forcing period.

        The norm sqrt(w^2 y^2 + y'^2) of any derivative increases at most at the rate of its forcing.
        """
        first, second = 0j, self.rate
        for k in range(order):
            change = self.force * (1j * omega) ** k
            first, second = second, change - 2.0 * self.decay * second - self.frequency_squared * first
        frequency = math.sqrt(self.frequency_squared)
        initial = math.hypot(frequency * abs(first), abs(second))
        return (initial + abs(self.force) * omega**order * math.pi / omega) / frequency

    def series(self, grid: _Grid) -> Complexes:
        """Return the series of y over every cell, scaled to t in [0, 1], shape (cells/2, terms)."""
        step = grid.step
        forced = grid.series(self.force * step * step * grid.phases[:-1])
        terms = np.empty_like(forced)
        terms[:, 0], terms[:, 1] = self.place[:-1], self.slope[:-1] * step
        for k in range(_TERMS - 2):
            free = 2.0 * self.decay * step * (k + 1) * terms[:, k + 1] + self.frequency_squared * step**2 * terms[:, k]
            terms[:, k + 2] = (forced[:, k] - free) / ((k + 1) * (k + 2))
        return terms


def reference_motion(
    oscillator: Oscillator,
    model: ModalModel,
    steady: Complexes,
    omega: float,
    step: float,
    cells: int,
    phase: float,
    output_row: Floats,
) -> ReferenceMotion:
    """Return the reference motion as the kernels take it.

    Parameters
    ----------
    model : ModalModel
        That of the oscillator.
    steady : complex (2, N) or (N,)
        As in `cell_problem`.
    step : float
        Length of a cell.
    cells : int
        Per forcing period.
    phase : float
        Forcing phase at t = 0.
    output_row : (N, 4)
        As in `CellProblem`.
    """
    resonant = resonant_modes(model, omega) & bool(steady.ndim == 2 and np.any(oscillator.forcing))
    first = complex(steady.ravel()[0])
    bound, turn, phases = abs(first), np.exp(1j * phase), half_period_phases(cells)
    if not np.any(resonant):
        square, none = omega * omega, np.zeros((0, 2))
        table = real_and_imaginary(whole_period(first * turn * phases))
        return ReferenceMotion(
            steady_table=table,
            steady_bound=bound,
            steady_fourth=bound * square * square,
            reference_series=np.zeros((0, _TERMS)),
            reference_rest=0.0,
            resonant_forcing=none.astype(np.complex128),
            half_jump=none,
            resonant_steady=none,
            lasting_steady=complex(table[0, 0], table[0, 1]),
            lasting_bound=bound,
        )
    grid = _Grid(omega, step, np.append(phases, -1.0))
    forcing = np.where(resonant[:, None], modal_forcing(oscillator, model), 0.0)
    modes = {j: _ResonantMode.of(model, j, forcing[j], output_row[j], grid) for j in np.flatnonzero(resonant).tolist()}
    bounds = [bound * omega**k + sum(mode.bound(k, omega) for mode in modes.values()) for k in (0, 4, _TERMS)]
    series = grid.series(first * phases) + sum(mode.series(grid) for mode in modes.values())
    jump = np.zeros(forcing.shape, dtype=np.complex128)
    for j, mode in modes.items():
        jump[j] = mode.states[-1]
    resonant_steady, lasting = _lasting(oscillator, model, first, omega, resonant, output_row)
    series = (series * turn).imag
    return ReferenceMotion(
        steady_table=_boundaries(modes, first, grid, turn),
        steady_bound=bounds[0],
        steady_fourth=bounds[1],
        reference_series=np.concatenate([series, -series]),
        reference_rest=bounds[2] * step**_TERMS / math.factorial(_TERMS),
        resonant_forcing=forcing * turn,
        half_jump=np.ascontiguousarray((jump * turn).imag),
        resonant_steady=np.ascontiguousarray((resonant_steady * turn).imag),
        lasting_steady=complex(lasting * turn) if math.isfinite(abs(lasting)) else lasting,
        lasting_bound=abs(lasting),
    )


def _boundaries(modes: dict[int, _ResonantMode], steady: complex, grid: _Grid, turn: complex) -> Floats:
    """Return `CellProblem.steady_table` with resonant modes; the second half period mirrors the first."""
    place, velocity = steady * grid.phases, 1j * grid.omega * steady * grid.phases
    for mode in modes.values():
        place, velocity = place + mode.place, velocity + mode.slope
    half = np.stack([(velocity * turn).imag / grid.omega, (place * turn).imag], axis=1)
    return np.concatenate([half, -half[1:]])


def _lasting(
    oscillator: Oscillator,
    model: ModalModel,
    steady: complex,
    omega: float,
    resonant: Booleans,
    output_row: Floats,
) -> tuple[Complexes, complex]:
    """Return the steady amplitudes of the resonant modes at phase 0, and the amplitude of mass 1 with all modes."""
    if np.any(model.undamped):
        return np.zeros((0, 2), dtype=np.complex128), complex(math.inf)
    amplitudes = np.where(resonant[:, None], modal_steady(oscillator, model, omega), 0.0)
    return amplitudes, complex(steady + np.sum(amplitudes * output_row[:, :2]))

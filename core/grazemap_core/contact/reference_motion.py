"""The motion that states are relative to: the steady motion, or, of resonant modes, the response of half a period."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from grazemap_core.arrays import Booleans, Complexes, Floats
from grazemap_core.contact.tolerances import CLEARED, HIGHEST_ERROR
from grazemap_core.contact.trajectory_models import TrajectoryModels
from grazemap_core.model.drive import Harmonic
from grazemap_core.model.harmonic_response import modal_forcing, modal_steady, resonant_modes
from grazemap_core.model.kernels.block_flow import forced_block
from grazemap_core.model.modal import ModalModel
from grazemap_core.numerics.tolerances import TAYLOR_DEGREE
from grazemap_core.numerics.trig_maxima import highest_points, roundoff
from grazemap_core.records import dataclass

_TERMS = TAYLOR_DEGREE + 1


@dataclass(frozen=True, eq=False)
class _CellGrid:
    """The cells of half a forcing period."""

    omega: float
    """Forcing frequency."""
    s: float
    """Frequency of a harmonic."""
    step: float
    """Length of a cell."""
    phases: Complexes
    """(cells/2 + 1,) exp(i s t) at the boundaries of the cells."""

    @classmethod
    def of(cls, harmonic: Harmonic, omega: float, step: float, cells: int) -> _CellGrid:
        """Return the grid of a harmonic, with so many cells of a length in a forcing period."""
        half, order = half_period_phases(cells, harmonic.order), harmonic.order
        return cls(omega, order * omega, step, np.append(half, -1.0 if order % 2 == 1 else 1.0))

    def series(self, value: Complexes) -> Complexes:
        """Return the series of exp(i s t) times values at the cells' starts, shape (cells/2, terms)."""
        terms = np.empty((len(value), _TERMS), dtype=np.complex128)
        for k in range(_TERMS):
            terms[:, k] = value
            value = value * (1j * self.s * self.step / (k + 1))
        return terms


@dataclass(frozen=True, eq=False)
class _ResonantMode:
    """A resonant mode, at rest at the start of the half period, at phase 0; y is its part of the motion of q.

    ``y'' + 2 decay y' + frequency_squared y = force exp(i s t)``, y(0) = 0, y'(0) = rate.
    """

    decay: float
    """Decay of the block."""
    frequency_squared: float
    """Square of the frequency of the block."""
    force: complex
    """Amplitude of the harmonic's forcing of the mode."""
    rate: complex
    """y' at the start."""
    states: Complexes
    """(cells/2 + 1, 2) u and u' at the cell boundaries."""
    place: Complexes
    """(cells/2 + 1,) y at the cell boundaries."""
    slope: Complexes
    """(cells/2 + 1,) y' at the cell boundaries."""

    @classmethod
    def of(cls, model: ModalModel, j: int, forcing: Complexes, row: Floats, grid: _CellGrid) -> _ResonantMode:
        """Return mode j of a model, with its forcing (2,) and its row of `CellProblem.output_row` (4,)."""
        decay, square = float(model.decay[j]), float(model.frequency_squared[j])
        first, second = complex(forcing[0]), complex(forcing[1])
        times = (k * grid.step for k in range(len(grid.phases)))
        states = np.array(
            [forced_block(decay, float(model.discriminant[j]), square, first, second, grid.s, t) for t in times],
            dtype=np.complex128,
        )
        rate = complex(row[:2] @ forcing)
        force = complex(row[2:] @ forcing) + (2.0 * decay + 1j * grid.s) * rate
        place = np.asarray(states @ row[:2])
        slope = np.asarray(states @ row[2:] + rate * grid.phases)
        return cls(decay, square, force, rate, states, place, slope)

    def bound(self, order: int, grid: _CellGrid) -> float:
        """Return a bound of the derivative of y of this order within half a forcing period.

        The norm sqrt(w^2 y^2 + y'^2) of any derivative increases at most at the rate of its forcing.
        """
        first, second = 0j, self.rate
        for k in range(order):
            change = self.force * (1j * grid.s) ** k
            first, second = second, change - 2.0 * self.decay * second - self.frequency_squared * first
        frequency = math.sqrt(self.frequency_squared)
        initial = math.hypot(frequency * abs(first), abs(second))
        return (initial + abs(self.force) * grid.s**order * math.pi / grid.omega) / frequency

    def series(self, grid: _CellGrid) -> Complexes:
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
    models: TrajectoryModels,
    steady: Complexes,
    omega: float,
    step: float,
    cells: int,
    phase: float,
    output_row: Floats,
) -> dict[str, Any]:
    """Return the reference motion as the kernels take it: the fields of `CellProblem` that depend on the phase.

    Parameters
    ----------
    steady : complex (H, 2, N + 1)
        From `reference_response`.
    step : float
        Length of a cell.
    cells : int
        Per forcing period.
    phase : float
        Forcing phase at t = 0.
    output_row : (N, 4)
        As in `CellProblem`.
    """
    oscillator, model, orders, at = models.oscillator, models.free, models.orders, np.array([omega])
    resonant = [resonant_modes(model, at, harmonic.order)[0] & bool(oscillator.drive) for harmonic in oscillator.forces]
    states = model.size if np.any(resonant) else 0
    if len(orders) == 1 and orders[0] == 1.0 and states == 0:
        amplitude, turn = complex(steady[0, 0, model.size]), complex(np.exp(1j * phase))
        bound, square = abs(amplitude), omega * omega
        table = real_and_imaginary(whole_period(amplitude * turn * half_period_phases(cells)))
        return {
            "steady_table": table,
            "half_start": np.stack([table[0], -table[0]]),
            "steady_bound": bound,
            "steady_fourth": bound * square * square,
            "reference_series": np.zeros((0, _TERMS)),
            "reference_rest": 0.0,
            "orders": orders,
            "resonant_forcing": np.zeros((1, 0, 2), dtype=np.complex128),
            "half_jump": np.zeros((2, 0, 2)),
            "resonant_steady": np.zeros((2, 0, 2)),
            "lasting_steady": table[:1].copy(),
            "lasting_bound": bound,
            "unreached": np.zeros(2),
        }
    parts = [
        _HarmonicPart.of(
            models,
            harmonic,
            steady[h],
            _CellGrid.of(harmonic, omega, step, cells),
            phase,
            output_row,
            resonant[h],
        )
        for h, harmonic in enumerate(oscillator.forces)
    ]
    boundaries = _totals(parts, [part.boundaries for part in parts])
    return {
        "steady_table": np.concatenate([boundaries[0], boundaries[1][1:]]),
        "half_start": np.stack([boundaries[0][0], boundaries[1][0]]),
        "steady_bound": sum(part.bound(0) for part in parts),
        "steady_fourth": sum(part.bound(4) for part in parts),
        "reference_series": np.concatenate(_totals(parts, [part.series for part in parts])),
        "reference_rest": sum(part.bound(_TERMS) for part in parts) * step**_TERMS / math.factorial(_TERMS),
        "orders": orders,
        "resonant_forcing": np.stack([part.forcing[:states] for part in parts]),
        "half_jump": np.stack(_totals(parts, [part.jump for part in parts]))[:, :states],
        "resonant_steady": np.stack(_totals(parts, [part.resonant_steady for part in parts]))[:, :states],
        "lasting_steady": np.array([[part.lasting.real, part.lasting.imag] for part in parts]),
        "lasting_bound": sum(abs(part.lasting) for part in parts),
        "unreached": _unreached(orders, np.array([part.lasting for part in parts])),
    }


def _unreached(orders: Floats, amplitudes: Complexes) -> Floats:
    """Return `CellProblem.unreached` for a steady motion of q with amplitudes (H,)."""
    bound = float(np.sum(np.abs(amplitudes)))
    if len(orders) == 1 or not 0.0 < bound < math.inf:
        return np.zeros(2)
    relative = amplitudes / bound
    toward = np.stack([relative, -relative])
    highest = highest_points(orders, toward).height + roundoff(orders, toward) + HIGHEST_ERROR
    return np.asarray(bound * np.maximum(CLEARED - highest, 0.0))


def _totals(parts: Sequence[_HarmonicPart], values: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the sums of values of all harmonics, in the first half period and in the second.

    Harmonics of odd order change their sign after half a period.
    """
    pairs = zip(parts, values, strict=True)
    mirrored = [-value if part.harmonic.order % 2 == 1 else value for part, value in pairs]
    return np.asarray(sum(values)), np.asarray(sum(mirrored))


@dataclass(frozen=True, eq=False)
class _HarmonicPart:
    """What one harmonic contributes to the reference motion, in the first half period."""

    harmonic: Harmonic
    """The harmonic of the forces."""
    amplitude: complex
    """Amplitude of q in the steady motion of the modes that are not resonant, at phase 0."""
    turn: complex
    """exp(i order phase)."""
    grid: _CellGrid
    """The cells of the half period."""
    modes: list[_ResonantMode]
    """The resonant modes."""
    forcing: Complexes
    """(N, 2) Forcing of the resonant modes, the phase included; 0 for others."""
    jump: Floats
    """(N, 2) As `CellProblem.half_jump`."""
    resonant_steady: Floats
    """(N, 2) As `CellProblem.resonant_steady`."""
    lasting: complex
    """Amplitude of q with all modes, at t = 0; infinite if a mode is resonant and undamped."""

    @classmethod
    def of(
        cls,
        models: TrajectoryModels,
        harmonic: Harmonic,
        steady: Complexes,
        grid: _CellGrid,
        phase: float,
        output_row: Floats,
        resonant: Booleans,
    ) -> _HarmonicPart:
        """Return the part of a harmonic; `steady` (2, N + 1) is its part of `reference_response`."""
        oscillator, model, order, omega = models.oscillator, models.free, harmonic.order, grid.omega
        turn = complex(np.exp(1j * (order * phase)))
        amplitude = complex(steady[0, -1])
        nothing = np.zeros((model.size, 2), dtype=np.complex128)
        forcing, jump, states = nothing, nothing.copy(), nothing
        modes, lasting = [], amplitude
        if np.any(resonant):
            forcing = np.where(resonant[:, None], modal_forcing(oscillator, model, omega, harmonic), 0.0)
            for j in np.flatnonzero(resonant).tolist():
                modes.append(_ResonantMode.of(model, j, forcing[j], output_row[j], grid))
                jump[j] = modes[-1].states[-1]
            if np.any(model.undamped):
                lasting = complex(math.inf)
            else:
                states = np.where(resonant[:, None], modal_steady(oscillator, model, omega, harmonic), 0.0)
                lasting = complex(amplitude + np.sum(states * output_row[:, :2]))
        return cls(
            harmonic=harmonic,
            amplitude=amplitude,
            turn=turn,
            grid=grid,
            modes=modes,
            forcing=forcing * turn,
            jump=np.asarray((jump * turn).imag),
            resonant_steady=np.asarray((states * turn).imag),
            lasting=complex(lasting * turn) if math.isfinite(abs(lasting)) else lasting,
        )

    def bound(self, derivative: int) -> float:
        """Return a bound of a derivative of the part of q."""
        s, amplitude = self.grid.s, abs(self.amplitude)
        return amplitude * s**derivative + sum(mode.bound(derivative, self.grid) for mode in self.modes)

    @property
    def boundaries(self) -> Floats:
        """Velocity/omega and displacement of q at the cell boundaries of the first half period, (cells/2 + 1, 2)."""
        place, velocity = self.amplitude * self.grid.phases, 1j * self.grid.s * self.amplitude * self.grid.phases
        for mode in self.modes:
            place, velocity = place + mode.place, velocity + mode.slope
        return np.stack([(velocity * self.turn).imag / self.grid.omega, (place * self.turn).imag], axis=1)

    @property
    def series(self) -> Floats:
        """Series of q over the cells of the first half period, (cells/2, TAYLOR_DEGREE + 1)."""
        terms = self.grid.series(self.amplitude * self.grid.phases[:-1])
        for mode in self.modes:
            terms = terms + mode.series(self.grid)
        return np.asarray((terms * self.turn).imag)


def whole_period(half: Complexes, order: int = 1) -> Complexes:
    """Return a table of a harmonic over the cells of a period from that over half of it, shape (cells + 1,).

    The second half mirrors or repeats the first exactly, so that symmetric motions are symmetric to the last bit.
    """
    return np.concatenate([half, -half if order % 2 == 1 else half, half[:1]])


@lru_cache(maxsize=16)
def half_period_phases(cells: int, order: int = 1) -> Complexes:
    """Return exp(2 pi i order k / cells) for 0 <= k < cells/2, with an error of one or two roundings; read-only.

    Sines and cosines are computed at angles of at most pi/4.
    """
    k = order * np.arange(cells // 2) % cells
    below = 2 * k >= cells  # the lower half of the circle
    k = np.where(below, k - cells // 2, k)
    back = 4 * k > cells
    k = np.where(back, cells // 2 - k, k)
    steep = 8 * k > cells
    angle = np.where(steep, cells - 4 * k, 4 * k) * (math.pi / (2 * cells))
    c, s = np.cos(angle), np.sin(angle)
    first = np.where(back, -1.0, 1.0) * np.where(steep, s, c) + 1j * np.where(steep, c, s)
    factors = np.where(below, -first, first)
    factors.setflags(write=False)
    return factors


def real_and_imaginary(values: Complexes) -> Floats:
    """Return complex numbers (...) as an array of (real, imaginary), shape (..., 2)."""
    return np.ascontiguousarray(values).view(np.float64).reshape(*values.shape, 2)

"""The oscillator between its stops as the client computes it, against the core."""

from __future__ import annotations

import numpy as np
import pytest

from grazemap.wire import Oscillator as Request
from grazemap.wire.linear import steady_amplitude
from grazemap_core.grazing.grazing_curve import VariedStop, stop_grazes
from grazemap_core.model.oscillator import Oscillator
from grazemap_worker.processes.conversion import core_oscillator
from tests.oracles.steady_displacements import forced_response


@pytest.mark.parametrize("seed", range(6))
def test_the_grazing_curve_is_that_of_the_core(seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = int(rng.integers(1, 7))
    masses, stiffnesses = rng.uniform(0.5, 10.0, (2, size)).tolist()
    forcing = rng.uniform(-1.0, 1.0, size).tolist()
    damping = rng.uniform(0.01, 0.2, size).tolist() if seed % 2 else 0.05
    omega = rng.uniform(0.05, 3.0, 20)
    request = Request(masses=masses, stiffnesses=stiffnesses, damping=damping, forcing=forcing)
    core = Oscillator.create(masses, stiffnesses, damping, forcing, 0.8)
    expected = np.abs(forced_response(core, omega)[:, 0])
    np.testing.assert_allclose(steady_amplitude(request, omega), expected, rtol=1e-11)


@pytest.mark.parametrize("orders", [(1, 2), (1, 3), (2, 5), (4,), (1, 2, 3, 30)])
@pytest.mark.parametrize("moved", [False, True])
def test_the_largest_displacement_in_several_harmonics_is_that_of_the_core(
    orders: tuple[int, ...], moved: bool
) -> None:
    rng = np.random.default_rng(sum(orders))
    forcing = [
        {"amplitude": rng.normal(size=3), "phase": rng.normal(size=3), "harmonic": order, "law": law}
        for order, law in zip(orders, ("constant", "unbalance", "constant", "constant"), strict=False)
    ]
    base = {"amplitude": 0.3, "phase": 0.4, "stops_move": False} if moved else None
    request, omega = Request(forcing=forcing, base=base), np.linspace(0.1, 1.5, 200)
    assert request.orders == sorted({*orders, 1} if moved else orders)
    expected = stop_grazes(core_oscillator(request), omega, VariedStop(1)).clearance
    np.testing.assert_allclose(steady_amplitude(request, omega), expected, rtol=1e-11)


@pytest.mark.parametrize(
    ("orders", "symmetric"),
    [((), True), ((4,), True), ((1, 3), True), ((2, 6), True), ((1, 2), False), ((2, 4), False)],
)
def test_harmonics_with_one_power_of_two_graze_both_stops_at_once(orders: tuple[int, ...], symmetric: bool) -> None:
    forcing = [{"amplitude": [1.0, 0.0, 0.0], "harmonic": order} for order in orders]
    nothing = {"amplitude": [0.0, 0.0, 0.0], "harmonic": 8}
    assert Request(forcing=[*forcing, nothing]).is_symmetric is symmetric
    assert not Request(forcing=[*forcing, nothing], bias=[1.0, 0.0, 0.0]).is_symmetric

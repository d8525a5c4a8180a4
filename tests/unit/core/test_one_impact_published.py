"""One mass: motions with one impact against what is published about them.

What is compared, precisely:

- the closed form of motions with one impact in n periods of an undamped oscillator, as in S. W. Shaw and P. J. Holmes,
  Journal of Sound and Vibration 90 (1983) 129-155, and C. J. Budd and F. J. Dux, Phil. Trans. R. Soc. A 347 (1994)
  365-389: an ellipse in clearance and impact velocity. Damping is 1e-13 here, since without any the steady motion is
  not unique. The formula was checked with F. Dux's own published program, not with the print;
- the trace and determinant of the impact map's Jacobian, from which both articles read off saddle-nodes and period
  doubling, with damping as in A. B. Nordmark, Journal of Sound and Vibration 145 (1991) 279-297. The formulas are
  written down from their derivation, not copied from print;
- the impacting motion with which example 15.2 of H. Dankowicz and F. Schilder, Recipes for Continuation (2013), as
  distributed with COCO, begins: three digits of velocity and phase behind the impact, two of a state on the way.

D. J. W. Simpson and I. Ghosh, arXiv:2602.22797 (2026) prove that for one mass both curves at a resonant point are
quadratically tangent to the grazing curve. test_resonant_unfolding.py finds that, and takes the coefficients from exact
orbits; those that they print were not at hand to compare.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from grazemap_core.model.oscillator import Oscillator
from grazemap_core.orbits.periodic_orbits import periodic_orbit
from tests.support.orbits import one_impact_motions, special_motion


def phases_of(motions, count):
    """Phases of impacts, spread over those with a gap above 0: from the zero of the gap to that of the speed."""
    (start,), (end,), _ = motions.phases_of_impacts
    zeros, _ = motions.orbits.gaps.zeros()
    (low,) = (start + turn for zero in zeros if (turn := (zero - start) % math.tau) < math.pi)
    return np.linspace(low + 0.01, end - 0.01, count).tolist()


@pytest.mark.parametrize("omega", [0.37, 0.61, 1.7, 2.3, 2.8])
@pytest.mark.parametrize("multiple", [1, 2, 3])
@pytest.mark.parametrize("restitution", [0.3, 0.8])
def test_undamped_motions_lie_on_the_published_ellipse(omega, multiple, restitution):
    # x'' + x = cos(omega t), x' -> -r x' at x = sigma; V = speed before the impact
    motions = one_impact_motions(Oscillator.create([1.0], [1.0], 1e-13, [1.0], restitution), omega, multiple)
    turn = 2.0 * math.pi * multiple / omega
    gain = 1.0 / (1.0 - omega**2)
    shift = (1.0 + restitution) * math.sin(turn) / (1.0 - math.cos(turn))
    loss = (1.0 - restitution) / omega
    assert abs(motions.orbits.toward.amplitudes[0, 0]) == pytest.approx(abs(gain), rel=1e-9)
    for phase in phases_of(motions, 7):
        sigma, speed = motions.orbits.gap(phase), motions.orbits.speed(phase)
        # the quadratic for V at a given sigma
        left = (shift**2 + loss**2) * speed**2 + 4.0 * shift * sigma * speed + 4.0 * sigma**2
        assert left == pytest.approx(4.0 * gain**2, rel=1e-8)
    # its largest clearance is the saddle-node
    turning = special_motion(motions, "SN")
    assert (turning is not None) == (shift < 0.0)
    if turning is not None:
        assert turning.gap == pytest.approx(abs(gain) * math.sqrt(1.0 + (shift / loss) ** 2), rel=1e-8)


@pytest.mark.parametrize("alpha", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("multiple", [1, 2, 4])
def test_stability_is_that_of_the_published_trace_and_determinant(alpha, multiple):
    # x'' + 2 alpha x' + x = cos(omega t)
    types = set()
    for omega in np.linspace(0.45, 2.95, 21):
        for restitution in (0.2, 0.8):
            # C = 2 gamma K with gamma = alpha
            oscillator = Oscillator.create([1.0], [1.0], alpha, [1.0], restitution)
            motions = one_impact_motions(oscillator, float(omega), multiple)
            time, damped = 2.0 * math.pi * multiple / omega, math.sqrt(1.0 - alpha**2)
            lost = math.exp(-alpha * time)
            determinant = (restitution * lost) ** 2

            def trace(phase, gap, speed, time=time, damped=damped, lost=lost, restitution=restitution):
                push = math.sin(phase) - gap
                before, behind = push - 2.0 * alpha * speed, push + 2.0 * alpha * restitution * speed
                return lost * (
                    -2.0 * restitution * math.cos(damped * time)
                    + math.sin(damped * time) / damped * (behind + restitution * before) / speed
                )

            for phase in phases_of(motions, 3):
                gap = motions.orbits.gap(phase)
                orbit = periodic_orbit(oscillator, float(omega), (gap, None), motions.orbits.impacts(phase))
                expected = trace(orbit.impacts.phases[0], gap, orbit.impacts.velocities[0])
                assert np.sum(orbit.multipliers).real == pytest.approx(expected, rel=1e-11, abs=1e-11)
                assert np.prod(orbit.multipliers).real == pytest.approx(determinant, rel=1e-9, abs=1e-14)
            for kind, sign in (("SN", -1.0), ("PD", 1.0)):
                point = special_motion(motions, kind)
                if point is not None and point.speed > 1e-6:
                    total = trace(point.phase, point.gap, point.speed)
                    amplitude = abs(motions.orbits.speeds.amplitudes[0, 0]) * omega
                    size = 1.0 + abs(total) * amplitude / point.speed
                    assert abs(1.0 + sign * total + determinant) < 1e-12 * size
                    types.add(kind)
    assert types == {"SN", "PD"}


def test_the_impacting_motion_of_recipes_for_continuation():
    # k = 1, c = 0.1, A = 1, w = 1, d = 1, e = 0.8; one stop there, so what the other one would do is no matter
    oscillator = Oscillator.create([1.0], [1.0], [0.05], [1.0], 0.8)
    motions = one_impact_motions(oscillator, 1.0)
    (phase,), _ = motions.orbits.phases(1.0)
    speed = motions.orbits.speed(phase)
    assert -0.8 * speed == pytest.approx(-1.36, abs=0.005)
    # forced by a cosine there
    assert phase - 0.5 * math.pi == pytest.approx(0.076, abs=0.0005)
    # half a turn of the forcing later, at phase pi: x = -0.98, x' = -0.29
    time = math.pi - (phase - 0.5 * math.pi)
    forced = motions.orbits.toward.amplitudes[0, 0] * np.exp(1j * phase)
    x, v = 1.0 - forced.imag, -0.8 * speed - forced.real
    eta, damped = 0.05, math.sqrt(1.0 - 0.05**2)
    sine, cosine = math.sin(damped * time) / damped, math.cos(damped * time)
    x, v = (
        math.exp(-eta * time) * ((cosine + eta * sine) * x + sine * v),
        math.exp(-eta * time) * (-sine * x + (cosine - eta * sine) * v),
    )
    forced = forced * np.exp(1j * time)
    assert x + forced.imag == pytest.approx(-0.98, abs=0.01)
    assert v + forced.real == pytest.approx(-0.29, abs=0.01)

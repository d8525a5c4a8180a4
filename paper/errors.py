"""Errors in the paper, each with a computation that decides."""

from __future__ import annotations

import numpy as np

from grazemap import Client
from paper.page import Section, below
from paper.paper import (
    GAMMA,
    GRAZING_OMEGA,
    MASSES,
    POINT_CLEARANCE,
    POINT_OMEGA,
    READINGS,
    RESTITUTION,
    STIFFNESSES,
    ZETA,
)
from paper.states import FAR, TURN, Floats, at, distance, graze, turn

CHAIN = READINGS[GAMMA]
OMEGA = 0.29
IMPACT_CLEARANCE = 1.6
SPEEDS = (1e-1, 1e-2, 1e-3, 1e-4)
ASIDE = 1e-2
ORDERS = 6


def errors(client: Client, point: tuple[float, float]) -> Section:
    """Return the list; `point` is omega and clearance of the computed point with xi_1 = 0."""
    section = Section("Errors in the paper")
    section.say(
        "For each error, a computation by the service with gamma = 0.05 shows which form is correct. The arguments are"
        " in [theory.md](theory.md)."
    )
    _impact_law(client, section)
    _steady_motion(client, section)
    _mapped_state(client, section)
    _cases(client, section, point[0])
    section.say(
        f"**The point omega = {POINT_OMEGA.text}, b = {POINT_CLEARANCE.text}** is on neither grazing curve, and xi_1"
        ' does not vanish at its omega in either reading of zeta. What Section 5 calls "the second case" is the first'
        " case of (42). See Figure 5 above."
    )
    section.say("**n in the labels n-p_r-q_l** is not the period in forcing periods. See Figure 9 below.")
    return section


def _impact_law(client: Client, section: Section) -> None:
    """Compare the printed law, on mass 2, with the one on mass 1."""
    path = client.trajectory(CHAIN, omega=OMEGA, clearance=IMPACT_CLEARANCE, periods=20, progress=False)
    time, speed = float(path.impacts.time[0]), float(path.impacts.velocity[0])
    rest = np.zeros(2 * len(MASSES) + 1)
    before = at(client, CHAIN, OMEGA, FAR, rest, np.array([time]))[0]
    printed = before.copy()
    printed[3] *= -RESTITUTION
    side = float(np.sign(before[0]))
    _, beyond = turn(client, CHAIN, OMEGA, printed if side > 0 else _mirrored(printed))
    after = at(client, CHAIN, OMEGA, IMPACT_CLEARANCE, rest, np.array([time]))[0]
    section.say(
        "**(2), (4): the impact law has index 2.** Only mass 1 meets the stops, and the jump map (23) reverses v_1."
        f" From rest at omega = {OMEGA:g}, b = {IMPACT_CLEARANCE:g} mass 1 first reaches a stop at t = {time:.6f}, with"
        f" a speed of {abs(speed):.6f}. With the law as printed, v_2 becomes -R v_2, v_1 does not change, and"
        f" mass 1 moves through the stop to abs(x_1) = {beyond[0]:.6f}. With index 1 mass 1 rebounds at a speed of"
        f" {abs(after[1]):.6f}."
    )


def _steady_motion(client: Client, section: Section) -> None:
    """Put the printed and the corrected phase of the graze into a simulated steady motion."""
    omega = GRAZING_OMEGA
    scale = 1.0 / np.sqrt(MASSES)
    k1, k2, k3 = STIFFNESSES
    stiffness = np.array([[k1, -k1, 0.0], [-k1, k1 + k2, -k2], [0.0, -k2, k2 + k3]])
    squares, shapes = np.linalg.eigh(scale[:, None] * stiffness * scale)
    modes = scale[:, None] * shapes  # the canonical modal matrix: modes^T M modes = 1
    force = modes[0]  # f = (1, 0, 0)
    divisor = (squares - omega**2) ** 2 + (2 * ZETA * squares * omega) ** 2
    d1 = float(np.sum(modes[0] * (squares - omega**2) / divisor * force))
    d2 = float(np.sum(modes[0] * 2 * ZETA * squares * omega / divisor * force))
    rows = []
    for text, tau in (
        ("(7) and (18) as printed", np.arctan(d1 / d2)),
        ("sign of B_j corrected, arctan as printed", np.arctan(d1 / -d2)),
        ("sign of B_j corrected, quadrant of d_1, d_2", np.arctan2(d1, -d2)),
        ("the service", float(graze(client, CHAIN, omega).grazing.state[-1])),
    ):
        # from rest at forcing phase 0, after whole periods, the phase tau is reached at the time tau/omega
        path = client.trajectory(
            CHAIN, omega=omega, clearance=FAR, periods=1, transient_periods=1000, times=[tau % TURN / omega],
            progress=False,
        )  # fmt: skip
        rows.append([text, f"{tau:.9f}", f"{path.displacement[0, 0]:.9f}", _plain(float(path.velocity[0, 0]))])
    section.say(
        "**(7): the sign of B_j, and (18): the quadrant of tau.** If A_j sin + B_j cos is inserted into the equation"
        " of a mode, the result is B_j = -2 zeta omega_j^2 omega fbar_j/(...). The clearance of (18) does not depend"
        f" on the sign, b = {np.hypot(d1, d2):.12f} at omega = {omega:g}, but the phase does. Moreover arctan(d_1/d_2)"
        " does not determine which stop is touched. At the forcing phase tau mass 1 should be on stop A with zero"
        " velocity. The table has its displacement and velocity at that phase in a simulated steady motion:"
    )
    section.show(["tau from", "tau", "x_1 at that phase", "v_1 at that phase"], rows)


def _mapped_state(client: Client, section: Section) -> None:
    """Let motions off the graze's path touch a stop, and compare them with the mapping with and without x."""
    point = graze(client, CHAIN, OMEGA)
    star, beta, clearance = point.grazing.state, point.grazing.beta, point.clearance
    aside = np.zeros_like(star)
    aside[2], aside[5] = ASIDE * clearance, -ASIDE * OMEGA * clearance
    time = 0.25 * TURN / OMEGA
    rows = []
    for speed in SPEEDS:
        start = star + aside
        start[1] = speed * OMEGA * clearance
        truth = at(client, CHAIN, OMEGA, clearance, start, np.array([time]))[0]
        _, turned = turn(client, CHAIN, OMEGA, start)
        overshoot = turned[0] - clearance
        kick = beta * np.sqrt(2 * overshoot / abs(point.grazing.acceleration))
        row = [f"{speed:.0e}", f"{overshoot / clearance:.1e}"]
        for base in (turned, np.concatenate([star[:-1], turned[-1:]])):
            mapped = base + kick
            left = time - (mapped[-1] - star[-1]) / OMEGA
            there = at(client, CHAIN, OMEGA, FAR, mapped, np.array([left]))[0]
            row.append(f"{distance(there, truth, clearance, OMEGA):.2e}")
        rows.append(row)
    section.say(
        "**(27): the mapped state is left out.** The lower branch of the printed mapping is x* + beta u, with the graze"
        " x* in place of the state x that is mapped. On the stop it should agree with the upper branch, which is x. In"
        f" the table mass 1 reaches stop A at omega = {OMEGA:g}, b = A(omega), at decreasing speeds, while x_2 and v_3"
        f" differ from the graze by {ASIDE:g} b and {-ASIDE:g} omega b. A quarter of a period later the motion is"
        " compared with two motions without stops. They start from x + beta u and from x* + beta u, the latter at the"
        " time of x, so that only the state of the masses is left out. The error is the maximum entry, in units of b"
        " and omega b:"
    )
    section.show(["impact speed/(omega b)", "overshoot/b", "x + beta u", "x* + beta u, as printed"], rows)
    section.say(
        "With x the error decreases with the overshoot. Without x the error has the size of x - x*, which was left out."
        " The error carries over to (31) and (32), but not to the criteria (33)-(58), because beta u dominates x - x*"
        " there."
    )


def _cases(client: Client, section: Section, omega: float) -> None:
    """Multiply out (42) and compare with (45), (57), (58)."""
    right, left = (
        client.discontinuity_mapping(CHAIN, omega=omega, overshoot=[1e-3], stop=stop, returns=ORDERS, progress=False)
        for stop in ("right", "left")
    )
    p1, p2 = right.jacobian, right.jacobian_opposite
    power = np.linalg.matrix_power
    rows, off = [], 0.0
    for n in range(3):
        there, back = power(p2 @ p1, n), power(p1 @ p2, n)
        products = (
            there @ right.grazing.beta,
            p2 @ back @ left.grazing.beta,
            p1 @ there @ right.grazing.beta,
            back @ p1 @ p2 @ left.grazing.beta,
        )
        values = [-float(product[0]) for product in products]  # h_x^D = (-1, 0, ..., 0)
        orders = (2 * n, 2 * n + 1, 2 * n + 1, 2 * n + 2)
        for value, order, source in zip(values, orders, (right, left, right, left), strict=True):
            off = max(off, abs(value - (source.xi[order - 1] if order else 0.0)))
        rows.append([str(n), *(f"{_plain(value)} (m = {order})" for value, order in zip(values, orders, strict=True))])
    section.say(
        "**(42), (45), (57), (58): cases and powers.** The table has the four cases, as products of the Jacobians (46)"
        f" and beta, at the computed point, omega = {omega:.12f}. They agree with xi_m = -(1 + R) a_1* g(m T/2), which"
        f" the service computes independently, to within {below(off)}. For n = 0 case 1 is zero for every system,"
        " because h_D beta = 0, so its n begins at 1. Phi_12 with the superscript n + 1 has two meanings in (57),"
        " (58): the flow over (n + 1/2) T in cases 2 and 3, and the flow over (n + 1) T in case 4."
    )
    section.show(["n", "case 1", "case 2", "case 3", "case 4"], rows)


def _mirrored(state: Floats) -> Floats:
    """Return the mirror image of a state: the motion from it does the same on the other side."""
    return np.concatenate([-state[:-1], state[-1:] + 0.5 * TURN])


def _plain(value: float) -> str:
    """Return nine digits after the point, and no sign of a zero."""
    return f"{round(value, 9) + 0.0:.9f}"

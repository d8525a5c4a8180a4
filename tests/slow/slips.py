"""Slips of units in requests: are they warned of, and right requests not? `python -m tests.slow.slips [SEED]`.

Right requests about seven kinds of machines (`drawn_machines`) are drawn, and of others one quantity is written in
another unit, wherever it stands: one slip each. What a client sees is judged: the details of the notes of a request, as
it is written (`unstated`) and with its defaults (`notes_on`). A slip counts as warned of where a note names the
quantity and the remedy, which is a factor (or its inverse; 2 pi may be written in any way) or a field. A right request
counts as warned of where a note names any of these remedies or another unit. Notes that only inform are not counted.

What the numbers carry, by which a reader without the drawing can tell a slip:

- The frequency asked for, over the natural frequencies that the contact sees. A slip of omega, of the masses or of the
  stiffnesses moves it by 6.28, 9.55 or 31.6. Right ones lie from a third of the resonance that is asked about to three
  times the highest, or contain a resonance. An impact damper has a second one far below, a chain of ten masses has
  them over a factor of twelve, and sweeps are wide: there the slip may hide.
- The clearance over the amplitude, over the range of frequencies: 0.003 to 5 in right requests, mostly 0.1 to 1.3. A
  slip of clearance, unbalance or base moves it by 1000, one of masses or stiffnesses by what the frequency makes of it.
- Both after the slip is undone: a remedy after which everything is usual is a better one than another that is as near.
- Damping ratios: 0.001 to 0.2 in the lowest mode, at most 0.5 in others, or 0. In N s/mm they are a thousandth; a ratio
  in place of a coefficient divides them by 2 sqrt(k m), which is near 1 for small soft machines, and in place of a time
  multiplies them by omega_1.
- Sizes: of a clearance or a base against the machine (a cube of its mass with the density of light structures), the
  eccentricity m_e e / m_1 and its speed (balance qualities are 0.4 to 40 mm/s), the acceleration of a base (below 2 g
  or so), the static deflection m g / k, the force over the weight.
- Without units: masses, stiffnesses and forces far from 1, and from one another.

What they do not carry: masses in g together with forces in mN and stiffnesses in N/m of 1000 times less (the equations
are the same), t, N and mm (they are consistent), a static load in kg (its factor is 9.81). A slip that changes a
quantity by less than LEAST is not drawn, and no request that the slip turns into an invalid one.

`--slips` and `--right` take more than 40 and 200, `--all` names all failures and not only the first, `--bodies` prints
their requests. A failure names its number, with which `python -m tests.slow.slips SEED --only slip:NUMBER` (or extra:,
right:) prints the request and its notes. The exit status is 1 below 36 of 40, or above 2 of 200. Kinds of slips that
are marked as extra, and right requests in numbers without units, are counted apart and decide nothing.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import secrets
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydantic import ValidationError

from grazemap.wire import Note, Oscillator, notes_on, unstated
from tests.support.drawn_machines import GRAVITY, MACHINES, Body, Case, Draw, is_modal, right_request, rounded

SLIPS, RIGHT = 40, 200
LEAST_WARNED, MOST_WRONG = 0.9, 0.01  # 36 of 40, 2 of 200
LEAST = 4.0  # factor by which a slip of damping changes it
NEAR = 3e-3  # relative, of a factor as it is written: 6.28, 0.105, 9.55
SHOWN = 12
RAD_S_OF_HZ, RAD_S_OF_RPM = 2.0 * math.pi, math.pi / 30.0

Slip = Callable[[Body], Body | None]


def scaled(body: Body, **factors: float) -> Body:
    """Return a request with the numbers of some quantities multiplied, wherever they stand.

    Quantities are mass, stiffness, damping (coefficients), time (of a proportional damping), ratio (modal), force,
    unbalance, load, base, omega, length (clearances and displacements) and velocity.
    """

    def times(value: Any, quantity: str) -> Any:
        if isinstance(value, dict):
            return {name: item if name == "points" else times(item, quantity) for name, item in value.items()}
        if isinstance(value, list):
            return [times(item, quantity) for item in value]
        return value if value is None else value * factors.get(quantity, 1.0)

    changed = {**body, "oscillator": _structure(body["oscillator"], times)}
    for name, quantity in (("omega", "omega"), ("clearance", "length")):
        if name in body:
            changed[name] = times(body[name], quantity)
    if "range" in body:
        varied = {"omega": "omega", "clearance": "length"}.get(body["vary"].partition("_")[0], "")
        changed["range"] = times(body["range"], varied)
    for name in ("horizontal", "vertical"):
        if name in body:
            varied = {"displacement": "length"}.get(body[name]["quantity"], "velocity")
            changed[name] = {**body[name], "values": times(body[name]["values"], varied)}
    if "initial" in body:
        changed["initial"] = times(body["initial"], "velocity")
    written: Body = rounded(changed)
    return written


def _structure(oscillator: Body, times: Callable[[Any, str], Any]) -> Body:
    changed = dict(oscillator)
    for name, quantity in (("masses", "mass"), ("stiffnesses", "stiffness"), ("bias", "load")):
        if name in oscillator:
            changed[name] = times(oscillator[name], quantity)
    if "damping" in oscillator:
        damping = oscillator["damping"]
        changed["damping"] = times(damping, "damping" if isinstance(damping, list) else "time")
    if "matrices" in oscillator:
        given = oscillator["matrices"]
        damping = given["damping"]
        kind = "damping" if isinstance(damping, list) else "ratio" if "modal" in damping else ""
        changed["matrices"] = {
            "mass": times(given["mass"], "mass"),
            "damping": times(damping, kind),
            "stiffness": times(given["stiffness"], "stiffness"),
        }
    if "forcing" in oscillator:
        forces = oscillator["forcing"]
        several = [forces] if isinstance(forces, dict) else forces
        if isinstance(several[0], dict):
            each = [force | {"amplitude": times(force["amplitude"], force.get("law", "force"))} for force in several]
            changed["forcing"] = each[0] if isinstance(forces, dict) else each
        else:
            changed["forcing"] = times(forces, "force")
    if "base" in oscillator:
        base = oscillator["base"]
        changed["base"] = {**base, "amplitude": times(base["amplitude"], "base")}
    return changed


def in_unit(*needs: str, **factors: float) -> Slip:
    """Return the slip that multiplies quantities; of requests whose numbers it changes, not of modal coordinates."""

    def slip(body: Body) -> Body | None:
        oscillator = body["oscillator"]
        if is_modal(oscillator) and not {"omega", "length", "ratio", "base"} & factors.keys():
            return None
        if not all(need in oscillator for need in needs):
            return None
        changed = scaled(body, **factors)
        return None if changed == rounded(body) else changed

    return slip


def without_units(body: Body) -> Body | None:
    """Leave out the units."""
    oscillator = {name: value for name, value in body["oscillator"].items() if name != "units"}
    return {**body, "oscillator": oscillator}


def ratio_as_damping(body: Body) -> Body | None:
    """Write the damping ratio of the lowest mode, for each link, or for all where the damping is proportional."""
    oscillator = body["oscillator"]
    damping = oscillator.get("damping")
    if not damping or not np.any(damping):
        return None
    ratio = float(Oscillator(**oscillator).damping_ratios[0])
    written: Any = [ratio] * len(damping) if isinstance(damping, list) else ratio
    factor = float(np.median(np.divide(written, damping)))
    if not np.isfinite(factor) or abs(math.log(factor)) < math.log(LEAST):
        return None
    return {**body, "oscillator": {**oscillator, "damping": rounded(written)}}


# What a note says of a quantity. A word for it and the factor stand in one note.
WORDS = {
    "clearance": r"clearance|\bgaps?\b",
    "stiffness": r"stiffness",
    "omega": r"omega|ω|frequenc",
    "mass": r"\bmass(es)?\b",
    "unbalance": r"unbalance|forcing|m_e e",
    "units": r"\bunits?\b.*\bSI\b",
    "damping": r"damping|dampers?\b",
    "base": r"\bbase\b",
    "force": r"forcing|\bforces?\b",
    "load": r"\bbias\b|\bload",
}
# How a ratio becomes a coefficient of a link, or the time of a proportional damping.
OF_RATIO = r"(\bratios?\b|zeta|ζ)(.|\n)*(sqrt|√|\broot\b|coefficient|omega_?1|ω_?1|/ ?\(?(omega|ω)|N s/m\b|modal)"
OTHER_UNITS = r"(?<![\w/])(Hz|rpm|mm|N/mm|kN|N s/mm|grams?|g|kg mm|g mm)(?![\w/])"


@dataclass(frozen=True)
class Kind:
    """A kind of slip and its remedy."""

    slip: Slip
    quantity: str
    factor: float | None = None
    """What the number is multiplied with, or divided by, to be right; None: the words say it."""
    extra: bool = False
    """Whether it is counted apart."""
    machines: tuple[str, ...] = tuple(MACHINES)
    """Those whose requests can have it."""

    def named_by(self, note: Note) -> bool:
        """Whether a note names the quantity and the remedy."""
        if re.search(WORDS[self.quantity], note.detail, re.IGNORECASE | re.DOTALL) is None:
            return False
        if self.factor is None:
            return self.quantity == "units" or re.search(OF_RATIO, note.detail, re.IGNORECASE) is not None
        remedies = (self.factor, 1.0 / self.factor)
        return any(abs(value / remedy - 1.0) < NEAR for value in numbers(note.detail) for remedy in remedies)


ROTOR, DENSE = ("unbalanced rotor",), ("dense model",)
SHAKEN = ("impact damper", "shaken base", *DENSE)
CHAINS = tuple(name for name in MACHINES if name not in DENSE)
FORCED = ("one stop", "two unlike stops", "impact damper", "plain chain", *DENSE)

KINDS = {
    "clearance in mm": Kind(in_unit(length=1e3, velocity=1e3), "clearance", 1e3),
    "stiffness in N/mm": Kind(in_unit(stiffness=1e-3), "stiffness", 1e3),
    "omega in Hz": Kind(in_unit(omega=1.0 / RAD_S_OF_HZ), "omega", RAD_S_OF_HZ),
    "omega in rpm": Kind(in_unit(omega=1.0 / RAD_S_OF_RPM), "omega", RAD_S_OF_RPM),
    "masses in g": Kind(in_unit(mass=1e3), "mass", 1e3),
    "unbalance in kg mm": Kind(in_unit(unbalance=1e3), "unbalance", 1e3, machines=ROTOR),
    "units forgotten": Kind(without_units, "units"),
    "damping in N s/mm": Kind(in_unit(damping=1e-3), "damping", 1e3),
    "ratio as damping": Kind(ratio_as_damping, "damping", machines=CHAINS),
    "base in mm": Kind(in_unit("base", base=1e3), "base", 1e3, machines=SHAKEN),
    "force in kN": Kind(in_unit("forcing", force=1e-3), "force", 1e3, True, FORCED),
    "unbalance in g mm": Kind(in_unit(unbalance=1e6), "unbalance", 1e6, True, ROTOR),
    "load in kg": Kind(in_unit("bias", load=1.0 / GRAVITY), "load", GRAVITY, True, ("two unlike stops",)),
    "modal ratio in %": Kind(in_unit("matrices", ratio=100.0), "damping", 100.0, True, DENSE),
}
PLANNED = [name for name, kind in KINDS.items() if not kind.extra]
_PLAIN = r"\d[\d,]*\.?\d*(?:e[-+]?\d+)?"
_PRODUCT = rf"(?:({_PLAIN})\s*[*·×]?\s*)?(pi\b|π)?"
_NUMBER = re.compile(rf"(?=[\dpπ]){_PRODUCT}(?:\s*/\s*\(?\s*(?=[\dpπ]){_PRODUCT})?", re.IGNORECASE)
_POWER = re.compile(r"\b10(?:\^|\*\*)\(?(-?\d+)\)?")


def numbers(text: str) -> Iterator[float]:
    """Yield the numbers of a text: 1,000, 1e3, 10^3, 2 pi, pi/30, 60/(2 pi); of a fraction its parts, too."""
    text = _POWER.sub(lambda match: f"1e{match[1]}", text)
    for match in _NUMBER.finditer(text):
        above, below = _product(match[1], match[2]), _product(match[3], match[4])
        if above is None:
            continue
        yield above
        if below:
            yield below
            yield above / below


def _product(number: str | None, pi: str | None) -> float | None:
    """Return the value of a number, pi or a multiple of it; None of nothing, and of 0."""
    if number is None and pi is None:
        return None
    plain = number.replace(",", "").rstrip(".") if number else "1"
    return (float(plain) * (math.pi if pi else 1.0)) or None


def notes_of(case: Case) -> list[Note]:
    """Return all notes that a client shows."""
    request = case.request()
    return [*notes_on(request), *unstated(request)]


def remedies(notes: Sequence[Note]) -> set[str]:
    """Return the kinds of slips whose remedies notes name."""
    return {name for name, kind in KINDS.items() if any(kind.named_by(note) for note in notes)}


def is_of_units(note: Note) -> bool:
    """Whether a note proposes that a number was meant in another unit."""
    return bool(remedies([note])) or re.search(OTHER_UNITS, note.detail) is not None


def source(seed: int, group: str, number: int) -> Draw:
    """Return the source of a case."""
    return Draw(np.random.default_rng([seed, sum(map(ord, group)), number]))


def slipped(draw: Draw, name: str, machine: str) -> Case:
    """Return a request with a slip of this kind."""
    while True:
        case = right_request(draw, machine)
        body = KINDS[name].slip(case.body)
        if body is None:
            continue
        case.body = body
        try:
            case.request()
        except ValidationError:
            continue
        return case


def planned_slip(seed: int, names: Sequence[str], number: int) -> tuple[str, Case]:
    """Return a slip by its number: they are even over the kinds, and over the machines that can have each."""
    turn, place = divmod(number, len(names))
    name = names[place]
    machines = KINDS[name].machines
    order = source(seed, name, 0).random.permutation(len(machines))
    machine = machines[order[turn % len(machines)]]
    return name, slipped(source(seed, "slip " + name, number), name, machine)


def reported(failures: Sequence[str], every: bool) -> None:
    """Print failures, the first ones or all."""
    for line in failures if every else failures[:SHOWN]:
        print(f"  {line}")
    if len(failures) > SHOWN and not every:
        print(f"  and {len(failures) - SHOWN} more: --all")


def of_slips(seed: int, names: Sequence[str], count: int, options: argparse.Namespace, what: str) -> bool:
    """Print how many slips are warned of, by kinds and machines; return whether enough are."""
    drawn, warned, proposed = Counter[tuple[str, str]](), Counter[tuple[str, str]](), list[int]()
    failures = []
    for number in range(count):
        name, case = planned_slip(seed, names, number)
        notes = notes_of(case)
        cell = (name, case.machine)
        drawn[cell] += 1
        if any(KINDS[name].named_by(note) for note in notes):
            warned[cell] += 1
            proposed.append(len(remedies(notes)))
            continue
        codes = ", ".join(note.code for note in notes) or "no note"
        failures.append(f"slip {number}: {name}; {case}; {codes}")
        if options.bodies:
            failures[-1] += f"\n    {json.dumps(case.body)}"
    widths = [max(len(machine), 7) for machine in MACHINES]
    heads = [machine.rjust(width) for machine, width in zip(MACHINES, widths, strict=True)]
    print("\n" + " " * 20 + "  ".join([*heads, "    all"]))
    for name in names:
        cells = [(name, machine) for machine in MACHINES]
        parts = [f"{warned[cell]}/{drawn[cell]}" if drawn[cell] else "-" for cell in cells]
        whole = f"{sum(warned[cell] for cell in cells)}/{sum(drawn[cell] for cell in cells)}"
        padded = [part.rjust(width) for part, width in zip(parts, widths, strict=True)]
        print(name.ljust(20) + "  ".join([*padded, whole.rjust(7)]))
    print(f"{warned.total()} of {drawn.total()} {what} warned with the remedy", end="")
    print(f", beside {np.mean(proposed) - 1.0:.1f} others on average" if proposed else "")
    reported(failures, options.all)
    return warned.total() >= LEAST_WARNED * drawn.total()


def of_right(seed: int, count: int, options: argparse.Namespace) -> bool:
    """Print how many right requests are warned of; return whether so few are."""
    failures = []
    for number in range(count):
        case = right_case(seed, number)
        wrong = [note for note in notes_of(case) if is_of_units(note)]
        if wrong:
            failures.append(f"right {number}: {case}; {'; '.join(f'{note.code}: {note.detail}' for note in wrong)}")
            if options.bodies:
                failures[-1] += f"\n    {json.dumps(case.body)}"
    print(f"\n{len(failures)} of {count} right requests warned")
    reported(failures, options.all)
    return len(failures) <= MOST_WRONG * count


def right_case(seed: int, number: int) -> Case:
    """Return a right request."""
    return right_request(source(seed, "right", number), list(MACHINES)[number % len(MACHINES)])


def of_numbers(seed: int, count: int, options: argparse.Namespace) -> None:
    """Print how many right requests in numbers without units are warned of: masses, frequencies, clearances near 1."""
    failures = []
    for number in range(count):
        draw = source(seed, "numbers", number)
        case = right_request(draw, list(MACHINES)[number % len(MACHINES)])
        body = without_dimensions(case)
        case.body = body
        try:
            wrong = [note for note in notes_of(case) if is_of_units(note)]
        except ValidationError:
            continue
        if wrong:
            failures.append(f"numbers {number}: {case}; {'; '.join(f'{note.code}: {note.detail}' for note in wrong)}")
            if options.bodies:
                failures[-1] += f"\n    {json.dumps(body)}"
    print(f"\n{len(failures)} of {count} right requests in numbers without units warned (extra)")
    reported(failures, options.all)


def without_dimensions(case: Case) -> Body:
    """Return a request in units of a mass, of the lowest frequency and of a length that is near the clearance."""
    oscillator = case.body["oscillator"]
    model = Oscillator(**oscillator)
    frequency = float(model.natural_frequencies[0])
    mass = 1.0 if is_modal(oscillator) else float(np.max(oscillator.get("masses") or oscillator["matrices"]["mass"]))
    lengths = [abs(value) for value in _leaves(case.body.get("clearance")) if value]
    length = max(lengths, default=1e-3)
    stiffness, force = mass * frequency**2, mass * frequency**2 * length
    body = scaled(
        case.body,
        mass=1.0 / mass,
        stiffness=1.0 / stiffness,
        damping=0.5 / (mass * frequency) if "masses" in oscillator else 1.0 / (mass * frequency),
        time=frequency,
        force=1.0 / force,
        unbalance=1.0 / (mass * length),
        load=1.0 / force,
        base=1.0 / length,
        omega=1.0 / frequency,
        length=1.0 / length,
        velocity=1.0 / (frequency * length),
    )
    matrices = body["oscillator"].get("matrices")
    if matrices and "rayleigh" in matrices["damping"]:
        alpha, beta = matrices["damping"]["rayleigh"]
        matrices["damping"] = {"rayleigh": rounded([alpha / frequency, beta * frequency])}
    return {**body, "oscillator": {name: value for name, value in body["oscillator"].items() if name != "units"}}


def _leaves(value: Any) -> Iterator[float]:
    if isinstance(value, dict):
        for name, item in value.items():
            if name != "points":
                yield from _leaves(item)
    elif value is not None:
        yield float(value)


def shown(case: Case) -> None:
    """Print a request and its notes."""
    print(case)
    print(json.dumps({"process": case.process, "request": case.body}, indent=1))
    for note in notes_of(case):
        print(f"{note.code}: {note.detail}")


def main() -> int:
    """Draw, judge, print; return 1 where too few slips or too many right requests are warned of."""
    parser = argparse.ArgumentParser(prog="python -m tests.slow.slips", description="Slips of units, and their notes.")
    parser.add_argument("seed", type=int, nargs="?", help="of all draws; left out: at random")
    parser.add_argument("--slips", type=int, default=SLIPS, help="number of slips")
    parser.add_argument("--right", type=int, default=RIGHT, help="number of right requests")
    parser.add_argument("--all", action="store_true", help="name every failure")
    parser.add_argument("--bodies", action="store_true", help="print the requests of failures")
    parser.add_argument("--only", metavar="slip:NUMBER", help="print one case: slip:, extra: or right: and its number")
    options = parser.parse_args()
    seed = secrets.randbelow(1_000_000) if options.seed is None else options.seed
    print(f"seed {seed}")
    extra = [name for name in KINDS if name not in PLANNED]
    if options.only:
        group, _, which = options.only.partition(":")
        if group == "right":
            shown(right_case(seed, int(which)))
        else:
            name, case = planned_slip(seed, PLANNED if group == "slip" else extra, int(which))
            print(name)
            shown(case)
        return 0
    enough = of_slips(seed, PLANNED, options.slips, options, "slips")
    few = of_right(seed, options.right, options)
    of_slips(seed, extra, options.slips, options, "extra slips")
    of_numbers(seed, options.right // 4, options)
    return 0 if enough and few else 1


if __name__ == "__main__":
    sys.exit(main())

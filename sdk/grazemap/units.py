"""Units in numbers, as "4.2 mm": texts in Python and on the command line. A request and its result have numbers in SI.

The units that are written in a request are those in which its result is shown.

>>> in_si({"omega": ["9 Hz", "1200 rpm"], "clearance": {"right": "0.5 mm"}}, "SI", [])
{'omega': [56.548667764616276, 125.66370614359172], 'clearance': {'right': 0.0005}}
>>> in_si({"oscillator": {"masses": ["250 g"], "damping": ["0.1 N s/mm"]}}, "SI", [])
{'oscillator': {'masses': [0.25], 'damping': [100.0]}}
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Real
from typing import Any, NamedTuple

from grazemap.constants import COORDINATE_UNITS, ENGINEERING_UNITS, UNITS


def _thousandth(value: float) -> float:
    return value / 1000.0


def _thousandfold(value: float) -> float:
    return value * 1000.0


# By unit in SI: the units in which numbers may be written, and their conversions.
_CONVERSIONS: dict[str, dict[str, Callable[[float], float]]] = {
    "rad/s": {
        "Hz": lambda value: 2.0 * math.pi * value,
        "rpm": lambda value: 2.0 * math.pi * value / 60.0,
        "rad/s": float,
    },
    "m": {"mm": _thousandth, "m": float},
    "kg": {"g": _thousandth, "kg": float, "t": _thousandfold},
    "N/m": {"N/mm": _thousandfold, "kN/m": _thousandfold, "N/m": float},
    "N s/m": {"N s/mm": _thousandfold, "kN s/m": _thousandfold, "N s/m": float},
    "N": {"N": float, "kN": _thousandfold},
    "kg m": {"g mm": lambda value: value / 1e6, "kg mm": _thousandth, "kg m": float},
    "s": {"ms": _thousandth, "s": float},
}
OSCILLATOR = "oscillator"
"""The field of a request whose fields have names that begin with its own: "oscillator.masses"."""
_DAMPING, _AMPLITUDE = f"{OSCILLATOR}.damping", f"{OSCILLATOR}.forcing.amplitude"
_DAMPINGS, _UNBALANCE = f"{_DAMPING} of each link", f"{_AMPLITUDE} of an unbalance"
_OF_OSCILLATOR = {
    f"{OSCILLATOR}.masses": UNITS["masses"],
    f"{OSCILLATOR}.matrices.mass": UNITS["masses"],
    f"{OSCILLATOR}.stiffnesses": UNITS["stiffnesses"],
    f"{OSCILLATOR}.matrices.stiffness": UNITS["stiffnesses"],
    _DAMPINGS: UNITS["dampings"],
    f"{OSCILLATOR}.matrices.damping": UNITS["dampings"],
    _DAMPING: "s",
    f"{OSCILLATOR}.forcing": "N",
    _AMPLITUDE: "N",
    _UNBALANCE: "kg m",
    f"{OSCILLATOR}.bias": "N",
    f"{OSCILLATOR}.base.amplitude": UNITS["clearance"],
}
FIELD_UNITS = UNITS | {"overshoot": "m", "displacement": COORDINATE_UNITS["displacement"]} | _OF_OSCILLATOR
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?) ?([A-Za-z/][A-Za-z/ ·*]*)?")
# Units without what stands between their factors, which is written in several ways.
_FACTORS = {re.sub(" ", "", unit): unit for units in _CONVERSIONS.values() for unit in units}
# Fields that have numbers of the quantity of the field around them, or of the one that `vary` or `quantity` names.
_OF_THE_FIELD_AROUND = ("start", "stop", "right", "left")
OF_WHAT_VARIES = ("values", "range")
_MIXED = "Only some of the numbers have a unit", "a unit with each of them, or with none"
# What is said beside the units that are allowed.
_REMARKS = {_DAMPING: "; one number is gamma of C = 2 gamma K, and a list has the coefficients of the links in N s/m"}


class Refused(NamedTuple):
    """A unit that cannot be used."""

    pointer: str
    """JSON pointer of the number."""
    detail: str
    """Why."""
    allowed: str
    """What is allowed."""


class Shown:
    """The units in which numbers of a request are written, for its result."""

    def __init__(self) -> None:
        self._by_unit: dict[str, str] = {}  # by the unit in SI

    def write(self, name: str, units: Iterable[str]) -> None:
        """Take the units, "" for none, of the numbers in a field. The first unit that is not that of SI counts.

        Those of an oscillator's fields count where the quantity is one that varies, and numbers without a unit do not.
        """
        unit = FIELD_UNITS[name]
        if unit not in UNITS.values():
            return
        for written in filter(None, units) if name in _OF_OSCILLATOR else units:
            if self._by_unit.get(unit, unit) == unit:
                self._by_unit[unit] = written or unit

    @property
    def units(self) -> tuple[str, ...]:
        """The units to show other than those of SI; with Hz or rpm, mm for lengths of which none is written."""
        shown, together = dict(self._by_unit), {si_unit(unit): unit for unit in ENGINEERING_UNITS}
        if any(shown.get(unit, unit) != unit for unit in together):
            shown = shown | {unit: written for unit, written in together.items() if unit not in shown}
        return tuple(written for unit, written in shown.items() if written != unit)


def in_si(
    value: Any, units: object, refused: list[Refused], name: str = "", pointer: str = "", shown: Shown | None = None
) -> Any:
    """Return the fields of a request with the texts of numbers with a unit, as "4.2 mm", replaced by numbers.

    Parameters
    ----------
    value : mapping, list, tuple or any other value
        Anything but texts in fields that have a unit is returned as it is.
    units : str
        "SI" or "nondimensional".
    refused : list
        Receives the units that are not those of their field, and all of them where the oscillator is nondimensional;
        and lists and ranges of which some numbers have a unit and others, but 0, have none.
    name : str
        The field that has the value.
    pointer : str
        JSON pointer of the value.
    shown : Shown, optional
        Receives the units of the numbers.
    """
    if isinstance(value, Mapping):
        varies = str(value.get("vary") or value.get("quantity") or name).partition("[")[0]
        _refuse_mixed([value.get("start"), value.get("stop")], name, units, refused, pointer)
        names: dict[Any, str] = {**dict.fromkeys(_OF_THE_FIELD_AROUND, name), **dict.fromkeys(OF_WHAT_VARIES, varies)}
        if name.partition(".")[0] == OSCILLATOR:
            names = {key: quantity_of(f"{name}.{key}", law=value.get("law")) for key in value}
        return {
            key: in_si(item, units, refused, names.get(key) or str(key), f"{pointer}/{key}", shown)
            for key, item in value.items()
        }
    if isinstance(value, list | tuple):
        name = quantity_of(name, several=True)
        _refuse_mixed(value, name, units, refused, pointer)
        converted = [in_si(item, units, refused, name, f"{pointer}/{place}", shown) for place, item in enumerate(value)]
        return tuple(converted) if isinstance(value, tuple) else converted
    if name not in FIELD_UNITS:
        return value
    if not isinstance(value, str):
        if shown is not None and isinstance(value, int | float):
            shown.write(name, [""])
        return value
    text = value.strip()
    number, unit = _parted(text)
    if shown is not None and _NUMBER.fullmatch(text):
        shown.write(name, [unit])
    if not unit:
        return value
    if reason := refusal(text, name, units):
        refused.append(Refused(pointer, reason[0], reason[1].replace("--units SI", 'units="SI"')))
        return value
    return _CONVERSIONS[FIELD_UNITS[name]][unit](float(number))


def quantity_of(name: str, *, law: object = None, several: bool = False) -> str:
    """Return the name under which a field of an oscillator has its unit.

    The damping of each link has another unit than that of all, and an unbalance another one than a force.
    """
    if name == _DAMPING and several:
        return _DAMPINGS
    return _UNBALANCE if name == _AMPLITUDE and law == "unbalance" else name


def _refuse_mixed(numbers: Sequence[Any], name: str, units: object, refused: list[Refused], pointer: str) -> None:
    """Refuse numbers of which some have a unit and others, but 0, have none."""
    if units != "SI" or name not in FIELD_UNITS:
        return
    with_units = any(isinstance(number, str) and _parted(number.strip())[1] for number in numbers)
    if with_units and any(isinstance(number, Real) and number != 0 for number in numbers):
        refused.append(Refused(pointer, *_MIXED))


def units_of(name: str) -> list[str]:
    """Return the units in which the numbers of a field may be written, one of `FIELD_UNITS`."""
    return list(_CONVERSIONS[FIELD_UNITS[name]])


def example(name: str) -> str:
    """Return an example of a number with a unit, for the help of a field; of a list of them too where it has others."""
    names = dict.fromkeys((name, quantity_of(name, several=True)))
    return " or ".join(f"5{units_of(each)[0]}" for each in names)


def refusal(text: str, name: str, units: object) -> tuple[str, str] | None:
    """Return why units in the text of a flag are refused, and what is allowed; None if they are accepted.

    Parameters
    ----------
    text : str
        A number, a range or a list.
    name : str
        The field that has the quantity of the numbers.
    units : str
        "SI" or "nondimensional".
    """
    number_units = units_in(text)
    allowed = units_of(name)
    if not any(number_units):
        return None
    unknown = next((unit for unit in number_units if unit and unit not in allowed), "")
    if unknown:
        *others, last = allowed
        listed = f"{', '.join(others)} or {last} in SI{_REMARKS.get(name, '')}"
        return f"{unknown} is no unit of {name.rpartition('.')[2]}", listed
    if units != "SI":
        return f"{next(filter(None, number_units))} is a unit of SI, and this oscillator is nondimensional", (
            "numbers without units, or --units SI"
        )
    if not all(unit or _is_zero(number) for number, unit in map(_parted, _numbers(text))):
        return _MIXED
    return None


def si_unit(unit: str) -> str:
    """Return the unit in SI of a unit in which numbers may be written. Raises ValueError for any other unit."""
    for si, conversions in _CONVERSIONS.items():
        if unit in conversions:
            return si
    allowed = ", ".join(unit for conversions in _CONVERSIONS.values() for unit in conversions)
    raise ValueError(f"{unit!r} is no unit in which a result can be shown (allowed: {allowed})")


def shown_in(unit: str, shown: Iterable[str]) -> tuple[str, float]:
    """Return the unit in place of one in SI, of those that are shown, and the factor of its numbers."""
    conversions = _CONVERSIONS.get(unit, {})
    chosen = next((name for name in shown if name in conversions), unit)
    return chosen, 1.0 / conversions[chosen](1.0) if chosen in conversions else 1.0


def text_with_unit(text: str, unit: str) -> str:
    """Return the text of a flag, whose numbers have no units, with a unit after each number."""
    return _replaced(text, lambda number, _: number + unit)


def si_text(text: str, name: str) -> str:
    """Return the text of a flag with all numbers in rad/s or m, and without their units."""
    units = _CONVERSIONS[FIELD_UNITS[name]]
    return _replaced(text, lambda number, unit: repr(units[unit](float(number))) if unit else number)


def text_without_units(text: str) -> str:
    """Return the text of a flag without units; the numbers are not converted."""
    return _replaced(text, lambda number, _: number)


def _replaced(text: str, replacement: Callable[[str, str], str]) -> str:
    """Return a text with all numbers and their units ("": none) replaced, but not the number of points of a range."""
    parts = re.split(r"([:,])", text)
    last = 4 if ":" in text else len(parts)
    return "".join(
        replacement(*_parted(part)) if place < last and _NUMBER.fullmatch(part) else part
        for place, part in enumerate(parts)
    )


def units_in(text: str) -> list[str]:
    """Return the unit of each number of a text ("": none), but not of the number of points of a range."""
    return [_parted(number)[1] for number in _numbers(text)]


def _numbers(text: str) -> list[str]:
    return text.split(":")[:2] if ":" in text else [number for number in text.split(",") if number]


def _parted(text: str) -> tuple[str, str]:
    """Return the number in a text and its unit, "" for none; a text that is no number stays whole."""
    match = _NUMBER.fullmatch(text)
    if match is None:
        return text, ""
    unit = (match[2] or "").strip()
    return match[1], _FACTORS.get(re.sub("[ ·*]", "", unit), unit)


def _is_zero(number: str) -> bool:
    return _NUMBER.fullmatch(number) is not None and float(number) == 0.0

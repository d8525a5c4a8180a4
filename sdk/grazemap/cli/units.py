"""Units in the values of flags: frequencies in Hz or rad/s, lengths in mm or m. A request has rad/s and m."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from grazemap.constants import ENGINEERING_UNITS, UNITS

# Of each unit in SI those in which numbers may be written, with their conversions.
_WRITTEN: dict[str, dict[str, Callable[[float], float]]] = {
    "rad/s": {"Hz": lambda value: 2.0 * math.pi * value, "rad/s": float},
    "m": {"mm": lambda value: value / 1000.0, "m": float},
}
_SI = UNITS | {"overshoot": "m", "displacement": "m"}
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)([A-Za-z/]+)")


def has_units(name: str) -> bool:
    """Return whether the numbers of a field may have units."""
    return name in _SI


def example(name: str) -> str:
    """Return a number of a field with a unit, as its help shows it."""
    return f"5{next(iter(_WRITTEN[_SI[name]]))}"


def refusal(text: str, name: str, units: object) -> tuple[str, str] | None:
    """Return why units in the text of a flag are refused, and what is allowed; None if they are not.

    Parameters
    ----------
    text : str
        A number, a range or a list.
    name : str
        The field that has the quantity of the numbers.
    units : str
        "SI" or "nondimensional".
    """
    given = [match[2] if (match := _NUMBER.fullmatch(number)) else "" for number in _numbers(text)]
    allowed = _WRITTEN[_SI[name]]
    if not any(given):
        return None
    unknown = next((unit for unit in given if unit and unit not in allowed), "")
    if unknown:
        return f"{unknown} is no unit of {name}", f"{' or '.join(allowed)} in SI"
    if units != "SI":
        return f"{next(filter(None, given))} is a unit of SI, and this oscillator is nondimensional", (
            "numbers without units, or --units SI"
        )
    if not all(given):
        return "Only some of the numbers have a unit", "a unit with each of them, or with none"
    return None


def engineering(text: str) -> bool:
    """Return whether the text of a flag has numbers in Hz or mm."""
    units = {match[2] for number in _numbers(text) if (match := _NUMBER.fullmatch(number))}
    return not units.isdisjoint(unit for unit, _ in ENGINEERING_UNITS.values())


def with_unit(text: str, unit: str) -> str:
    """Return the text of a flag whose numbers have no units with a unit at each of them."""
    parts = re.split(r"([:,])", text)
    last = 3 if ":" in text else len(parts)
    return "".join(
        part + unit if part and place < last and place % 2 == 0 else part for place, part in enumerate(parts)
    )


def in_si(text: str, name: str) -> str:
    """Return the text of a flag with all numbers in rad/s or m, and without their units."""
    units = _WRITTEN[_SI[name]]
    return _replaced(text, lambda number, unit: repr(units[unit](float(number))))


def bare(text: str) -> str:
    """Return the text of a flag without units, its numbers as they are."""
    return _replaced(text, lambda number, _: number)


def _replaced(text: str, by: Callable[[str, str], str]) -> str:
    """Return a text with each number that has a unit replaced, but for the number of points of a range."""
    parts = re.split(r"([:,])", text)
    last = 4 if ":" in text else len(parts)
    found = [_NUMBER.fullmatch(part) if place < last else None for place, part in enumerate(parts)]
    return "".join(by(match[1], match[2]) if match else part for match, part in zip(found, parts, strict=True))


def _numbers(text: str) -> list[str]:
    """Return the numbers of a text, without the number of points of a range."""
    return text.split(":")[:2] if ":" in text else [number for number in text.split(",") if number]

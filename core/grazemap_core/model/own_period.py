"""The one meaning of a period: T = 2 pi/(p omega), with the greatest common divisor p of the orders of the forces.

Forces of the orders 2 and 4 at omega are forces of the orders 1 and 2 at 2 omega: p omega is the *own* frequency of the
forces (theory, "Several harmonics"). Everything is computed at the own frequency. Arguments and results are at the
declared omega: frequencies, and phases omega t, are multiplied by p on the way in and divided by p on the way out.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, fields, is_dataclass, replace
from functools import wraps
from typing import Any, Final, ParamSpec, TypeVar

import numpy as np

from grazemap_core.model.oscillator import Oscillator
from grazemap_core.records import dataclass

_PHASES: Final = frozenset({"phase", "phases", "excess_phase"})
_DIVISOR: Final = "divisor"
"""The attribute with p of a record of phases, which repeat after 2 pi/p."""
_LEFT_ALONE: Final = "record"
"""The attribute of a motion with what the kernels recorded, which stays at the own frequency."""

Given = ParamSpec("Given")
Result = TypeVar("Result")


def in_own_period(function: Callable[Given, Result]) -> Callable[Given, Result]:
    """Return a function that calls `function` at the own frequency of the oscillator among its arguments.

    Frequencies and phases are known by the names of arguments and of attributes of dataclasses and named tuples. The
    values of a parameter that varies are frequencies if its name, in `parameter`, `name`, `plane` or `ranges`, is
    omega. No dictionary but `ranges` is looked into. All oscillators among the arguments must have the same p.
    """
    signature = inspect.signature(function)

    @wraps(function)
    def rescaling(*args: Given.args, **kwargs: Given.kwargs) -> Result:
        p = max((divisor_of(value) for value in (*args, *kwargs.values())), default=1)
        if p == 1:
            return function(*args, **kwargs)
        bound = signature.bind(*args, **kwargs)
        bound.apply_defaults()
        inward = _Rescaling(p)
        bound.arguments.update(
            {name: inward.part(bound.arguments, name, value) for name, value in bound.arguments.items()}
        )
        result: Result = replace(inward, outward=True).rescaled(function(*bound.args, **bound.kwargs))
        return result

    return rescaling


def at_own_period(value: Result) -> Result:
    """Return a record with an oscillator, such as a plane, at the own frequency."""
    return _Rescaling(divisor_of(value)).rescaled(value)  # type: ignore[no-any-return]


def divisor_of(value: Any) -> int:
    """Return p of an oscillator, of a record with one or with a `divisor`, or of a list's first item; otherwise 1."""
    if isinstance(value, Oscillator):
        return value.at_own_period[1]
    if isinstance(value, list) or type(value) is tuple:
        return divisor_of(value[0]) if value else 1
    oscillator = getattr(value, "oscillator", None)
    return divisor_of(oscillator) if isinstance(oscillator, Oscillator) else int(getattr(value, _DIVISOR, 1))


@dataclass(frozen=True)
class _Rescaling:
    """Gives records other frequencies and phases: from the declared frequency to the own one, or back."""

    p: int
    """The own frequency over omega."""
    outward: bool = False
    """Whether values are at the own frequency, and become those at the declared one."""
    declared: dict[float, float] = field(default_factory=dict)
    """The declared frequencies that were given, by the own ones; they are returned with the same digits."""

    def frequency(self, value: Any) -> Any:
        """Return a frequency, a tuple of frequencies, or an array or a list of them as an array."""
        if self.outward:
            outer = [self.declared.get(own, own / self.p) for own in np.ravel(value).tolist()]
            return np.reshape(outer, value.shape) if isinstance(value, np.ndarray) else outer[0]
        if isinstance(value, tuple):
            return tuple(map(self.frequency, value))
        frequency = self.p * np.asarray(value, dtype=np.float64)
        self.declared.update(zip(np.ravel(frequency).tolist(), np.ravel(value).tolist(), strict=True))
        return frequency if isinstance(value, np.ndarray | list) else float(frequency)

    def rescaled(self, value: Any) -> Any:
        """Return a value with other frequencies and phases, or the same object where nothing in it changes."""
        if isinstance(value, Oscillator):
            return value if self.outward else value.at_own_period[0]
        if isinstance(value, Iterator):
            return map(self.rescaled, value)
        if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
            items = [self.rescaled(item) for item in value]
            same = all(new is old for new, old in zip(items, value, strict=True))
            return value if same else type(value)(items)
        if is_dataclass(value) and not isinstance(value, type):
            parts = {attribute.name: getattr(value, attribute.name) for attribute in fields(value)}
            changes = self._changes(parts)
            return replace(value, **changes) if changes else value
        if isinstance(value, tuple):
            named: Any = value
            changes = self._changes(named._asdict())
            return named._replace(**changes) if changes else value
        return value

    def _changes(self, parts: Mapping[str, Any]) -> dict[str, Any]:
        changes = {name: self.part(parts, name, value) for name, value in parts.items()}
        return {name: value for name, value in changes.items() if value is not parts[name]}

    def part(self, parts: Mapping[str, Any], name: str, value: Any) -> Any:
        """Return one of the attributes of a record, or one of the arguments of a function."""
        if value is None or name == _LEFT_ALONE:
            return value
        if name == _DIVISOR:
            return self.p if self.outward else 1
        if name in _PHASES:
            return value / self.p if self.outward else self.p * value
        if name == "ranges":
            return {
                parameter: self.frequency(ends) if parameter == "omega" else ends for parameter, ends in value.items()
            }
        if name == "omega" or _varies(parts, name) == "omega":
            return self.frequency(value)
        return self.rescaled(value)


def _varies(parts: Mapping[str, Any], name: str) -> str | None:
    """Return the name of the parameter whose values an attribute has, None if it has no such values.

    `parts` are the attributes by name, `name` is that of the attribute.
    """
    plane = parts.get("plane")
    if name in ("horizontal", "vertical") and isinstance(plane, tuple):
        return str(plane[0 if name == "horizontal" else 1])
    if name in ("values", "start", "stop"):
        varied = parts.get("parameter", parts.get("name"))
        return varied if isinstance(varied, str) else None
    return None

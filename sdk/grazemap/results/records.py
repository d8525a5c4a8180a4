"""The records that several results contain, and the table of all records' classes."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from grazemap.results.docstrings import with_attributes
from grazemap.schema import Record
from grazemap.schema.common import IMPACTS, MOTION, RESTS, STATE

R = TypeVar("R")
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]

RECORDS: dict[str, type[Any]] = {}
"""The classes of records by the names of their schemas."""


class described:
    """Register a class as that of a record's schema, and describe its attributes from there."""

    def __init__(self, record: Record) -> None:
        self._record = record

    def __call__(self, cls: type[R]) -> type[R]:
        """Return the class."""
        cls.__doc__ = with_attributes(cls.__doc__ or "", self._record)
        RECORDS[self._record.name] = cls
        return cls


class Verifiable:
    """Base of what has the attribute `verified`, with its deprecated name."""

    __slots__ = ()

    @property
    def certified(self) -> Any:
        """Deprecated: another name of `verified`."""
        warnings.warn("certified is deprecated: it is called verified", DeprecationWarning, stacklevel=2)
        return self.verified  # type: ignore[attr-defined]


@described(MOTION)
@dataclass(frozen=True, slots=True)
class Motion(Verifiable):
    """The motion n-p_r-q_l that a trajectory settles to."""

    kind: str
    period: int | None = None
    impacts_right: int | None = None
    impacts_left: int | None = None
    symmetric: bool | None = None
    sticking: bool | None = None
    label: str | None = None
    verified: bool = False
    reason: str | None = None


@described(IMPACTS)
@dataclass(frozen=True, eq=False)
class Impacts:
    """Every contact of a trajectory with a stop, in order."""

    time: FloatArray
    period: IntArray
    phase_time: FloatArray
    stop: IntArray
    velocity: FloatArray
    kind: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.time)


@described(RESTS)
@dataclass(frozen=True, eq=False)
class Sticking:
    """The intervals during which mass 1 rests on a stop."""

    start: FloatArray
    stop_time: FloatArray
    stop: IntArray

    def __len__(self) -> int:
        return len(self.start)


@described(STATE)
@dataclass(frozen=True, eq=False)
class State:
    """A moment of a motion; as the `initial` of another trajectory it is where that one starts."""

    displacement: FloatArray
    velocity: FloatArray
    phase: float


@dataclass(frozen=True, slots=True)
class MotionShare:
    """One motion of an unfolding map and how much of the map it covers.

    Attributes
    ----------
    label : str
        n-p_r-q_l as plain text, or the name of the kind for a motion that is not periodic.
    kind : str
    period, impacts_right, impacts_left : int or None
        None for a motion that is not periodic.
    pixels : int
    share : float
        pixels over all pixels of the map, from 0 to 1.
    """

    label: str
    kind: str
    period: int | None
    impacts_right: int | None
    impacts_left: int | None
    pixels: int
    share: float

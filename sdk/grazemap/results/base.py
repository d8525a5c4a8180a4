"""What all results share: their document, their meta, saving and converting."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from grazemap.codec import Document, encode_json, encode_npz
from grazemap.results.records import FloatArray, IntArray

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """What all results share.

    Attributes
    ----------
    meta : dict
        process, request (canonical: every default filled in), core_version, numerics and units.
    """

    process: ClassVar[str]

    meta: dict[str, Any]
    _document: Document = field(repr=False)

    @classmethod
    def from_document(cls, document: Document, meta: dict[str, Any]) -> Self:
        """Return the result that a document of the codec describes. Raises KeyError where a field is missing."""
        return cls(meta=meta, _document=document, **cls._fields(document))

    @classmethod
    def _fields(cls, document: Document) -> dict[str, Any]:
        raise NotImplementedError

    @property
    def units(self) -> str:
        """Either "nondimensional" or "SI"."""
        return str(self.meta["request"]["oscillator"]["units"])

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the result to a file ending in .npz or .json, and return its path. `grazemap.load` reads both."""
        target = Path(path)
        encoders = {".npz": encode_npz, ".json": encode_json}
        if target.suffix not in encoders:
            raise ValueError("a result is saved as .npz or .json")
        target.write_bytes(encoders[target.suffix](self._document, self.meta))
        return target

    def to_xarray(self) -> xarray.Dataset:
        """Return the result as an xarray Dataset, with units and labels (needs the extra "xarray")."""
        from grazemap.datasets import dataset

        return dataset(self)

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _summary(self) -> str:
        raise NotImplementedError


def floats(value: Any) -> FloatArray:
    """Return an array of binary64; None is NaN."""
    return np.asarray(value, dtype=np.float64)


def integers(value: Any) -> IntArray:
    """Return an array of int64."""
    return np.asarray(value, dtype=np.int64)

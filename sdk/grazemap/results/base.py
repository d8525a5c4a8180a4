"""What all results share: their document, their meta, saving and converting."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

from grazemap.codec import Document, encode_json, encode_npz
from grazemap.results.decoding import decoded
from grazemap.results.docstrings import with_attributes
from grazemap.schema import SCHEMAS, ResultSchema
from grazemap.schema.documents import upgraded

if TYPE_CHECKING:
    import xarray
    from numpy.typing import NDArray

RESULTS: dict[str, type[Result]] = {}
"""The classes of results by the names of their schemas."""
_SCHEMAS = {schema.name: schema for schema in SCHEMAS}


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """What all results share; a class with the name of a schema is the result of its process.

    Attributes
    ----------
    meta : dict
        process, schema (version of the layout), request (canonical: every default filled in), core_version, numerics
        and units.
    """

    schema: ClassVar[ResultSchema]
    process: ClassVar[str]

    meta: dict[str, Any]
    _document: Document = field(repr=False)

    def __init_subclass__(cls) -> None:
        cls.schema = _SCHEMAS[cls.__name__]
        cls.process = cls.schema.process
        cls.__doc__ = with_attributes(cls.__doc__ or "", cls.schema)
        RESULTS[cls.__name__] = cls

    @classmethod
    def from_document(cls, document: Document, meta: dict[str, Any]) -> Self:
        """Return the result that a document of the codec describes. Raises KeyError where a field is missing."""
        return cls(meta=meta, _document=document, **cls._attributes(upgraded(cls.schema, document, version_of(meta))))

    @classmethod
    def _attributes(cls, document: Document) -> dict[str, Any]:
        return decoded(cls.schema, document)

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
        """Return the result as an xarray Dataset, with dimensions, units and labels (needs the extra "xarray").

        Its attributes hold the process, the version, the request as JSON and the motion, if there is one. Records are
        columns; arrays of different lengths in them are joined, and a variable says to which record an entry belongs.
        """
        from grazemap.results.dataset import dataset

        return dataset(self)

    def derived(self) -> dict[str, NDArray[Any]]:
        """Return what a Dataset has besides the fields, by the names in the schema."""
        return {}

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._summary()}>"

    def _summary(self) -> str:
        raise NotImplementedError


def version_of(meta: dict[str, Any]) -> int:
    """Return the version of the layout of a result's document."""
    return int(meta.get("schema", 1))

"""The representations of a result: negotiation, ETags, and a cache of recently used ones.

The store holds npz; JSON is made from it by the codec. A representation's ETag is the stored bytes' own, with the
form added: strong, since the same npz always gives the same JSON.

JSON is many times as large as its npz. So only a few renderings run at a time, equal requests share one, and a large
one is streamed, so that it is never complete in memory.
"""

from __future__ import annotations

import re
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from weakref import WeakValueDictionary

import anyio
import anyio.to_thread

from grazemap.codec import decode_npz, iter_json
from grazemap.schema import schema_of
from grazemap.schema.motions import for_json
from grazemap_service.problems import ProblemException

NPZ_TYPE = "application/x-npz"
# In the server's order of preference.
MEDIA_TYPES = {"json": "application/json", "npz": NPZ_TYPE}
_ALIASES = {"application/zip": "npz", "application/octet-stream": "npz"}
_CACHE_CONTROL = "private, max-age=31536000, immutable"
# Maximum share of the cache's budget for one result.
_LARGEST_SHARE = 4
# JSON of a larger npz is streamed.
STREAMED_BYTES = 1 << 20
_PIECE_BYTES = 1 << 18
_AT_A_TIME = 2


def negotiate(accept: str, form: str | None) -> str:
    """Return the name of the representation to give.

    Parameters
    ----------
    accept : str
        The Accept header (RFC 9110 12.5.1), empty when there is none; of equal weights the more specific range wins,
        then JSON.
    form : str or None
        The query parameter f; overrides Accept.

    Raises
    ------
    ProblemException
        "not-acceptable".
    """
    available = "Available are " + ", ".join(f"{media} (?f={name})" for name, media in MEDIA_TYPES.items()) + "."
    if form is not None:
        if form not in MEDIA_TYPES:
            raise ProblemException("not-acceptable", available)
        return form
    ranges = _ranges(accept or "*/*")
    weights = {name: _weight(media, name, ranges) for name, media in MEDIA_TYPES.items()}
    best = max(weights, key=lambda name: weights[name])  # max keeps the first of equals
    if weights[best][0] <= 0:
        raise ProblemException("not-acceptable", available)
    return best


def _ranges(accept: str) -> list[tuple[str, float]]:
    ranges = []
    for item in accept.split(","):
        media, *parameters = (part.strip().lower() for part in item.split(";"))
        weight = 1.0
        for parameter in parameters:
            match = re.fullmatch(r"q\s*=\s*([01](?:\.\d{0,3})?)", parameter)
            if match:
                weight = min(1.0, float(match[1]))
        if media:
            ranges.append((media, weight))
    return ranges


def _weight(media: str, name: str, ranges: list[tuple[str, float]]) -> tuple[float, int]:
    """Return the weight of a media type, and how specific the range is that gives it."""
    best = (0.0, -1)
    for pattern, weight in ranges:
        if pattern == media or _ALIASES.get(pattern) == name:
            specific = 2
        elif pattern == media.partition("/")[0] + "/*":
            specific = 1
        elif pattern == "*/*":
            specific = 0
        else:
            continue
        if specific > best[1]:
            best = (weight, specific)
    return best


def is_fresh(if_none_match: str, etag: str) -> bool:
    """Return whether the header If-None-Match, which may be empty, has an ETag (RFC 9110 13.1.2)."""
    if if_none_match.strip() == "*":
        return True
    return etag in re.findall(r'"[^"]*"', if_none_match)


def cache_headers(stored: str, name: str) -> dict[str, str]:
    """Return the headers of a representation of a result, from the entity tag of the stored npz; it never changes."""
    return {"ETag": f'"{stored}-{name}"', "Vary": "Accept", "Cache-Control": _CACHE_CONTROL}


def render(npz: bytes, name: str) -> bytes:
    """Return a stored result in the requested form; the time grows with its size."""
    return npz if name == "npz" else b"".join(_json(npz))


class HotResults:
    """The most recently used representations, under a byte budget, in this process's memory."""

    def __init__(self, budget: int) -> None:
        self.budget = budget
        self._size = 0
        self._entries: OrderedDict[str, bytes] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, etag: str) -> bytes | None:
        """Return a representation, if it is in memory."""
        with self._lock:
            data = self._entries.get(etag)
            if data is not None:
                self._entries.move_to_end(etag)
            return data

    def put(self, etag: str, data: bytes) -> None:
        """Keep a representation, unless it is too large for the budget."""
        if len(data) > self.budget // _LARGEST_SHARE:
            return
        with self._lock:
            self._size += len(data) - len(self._entries.pop(etag, b""))
            self._entries[etag] = data
            while self._size > self.budget:
                self._size -= len(self._entries.popitem(last=False)[1])


class Renderings:
    """Gives representations, from memory or made from the stored npz."""

    def __init__(self, hot: HotResults) -> None:
        self._hot = hot
        self._limiter = anyio.CapacityLimiter(_AT_A_TIME)
        # a lock exists as long as a request waits for it or holds it
        self._locks: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()

    async def give(
        self, etag: str, name: str, size: int, load: Callable[[], bytes | None]
    ) -> bytes | Iterator[bytes] | None:
        """Return a representation, in pieces when it is large JSON; None when it is no longer stored.

        Parameters
        ----------
        etag : str
            Of the representation.
        name : str
            A key of `MEDIA_TYPES`.
        size : int
            Bytes of the stored npz.
        load : callable
            Returns the stored npz, or None; may block.
        """
        if name == "json" and size > STREAMED_BYTES:
            return await anyio.to_thread.run_sync(lambda: _pieces(load()), limiter=self._limiter)
        lock = self._locks.setdefault(etag, anyio.Lock())
        async with lock:
            return await anyio.to_thread.run_sync(lambda: self._whole(etag, name, load), limiter=self._limiter)

    def _whole(self, etag: str, name: str, load: Callable[[], bytes | None]) -> bytes | None:
        data = self._hot.get(etag)
        if data is None:
            npz = load()
            if npz is None:
                return None
            data = render(npz, name)
            self._hot.put(etag, data)
        return data


def _pieces(npz: bytes | None) -> Iterator[bytes] | None:
    """Return the JSON of an npz in pieces of about `_PIECE_BYTES`, or None when there is none."""
    return _joined(_json(npz)) if npz is not None else None


def _json(npz: bytes) -> Iterator[bytes]:
    """Return the JSON of an npz in short pieces; that of a tile has no more fields than the npz."""
    document, meta = decode_npz(npz)
    if "tile" not in meta:
        document = for_json(schema_of(meta["process"], document), document)
    return iter_json(document, meta)


def _joined(pieces: Iterator[bytes]) -> Iterator[bytes]:
    waiting: list[bytes] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += len(piece)
        if size >= _PIECE_BYTES:
            yield b"".join(waiting)
            waiting, size = [], 0
    yield b"".join(waiting)

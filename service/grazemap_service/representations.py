"""The representations of a result: content negotiation, ETags, and a cache of recently used representations.

The store holds npz; the codec makes JSON from it. The ETag of a representation is the entity tag of the npz with
the name of the form. It is a strong ETag, because the same npz always gives the same JSON.

JSON is many times as large as its npz. Therefore only a few renderings run at a time, equal requests share a rendering,
and large JSON is made while it is sent, so that it is never complete in memory.
"""

from __future__ import annotations

import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from typing import Any
from weakref import WeakValueDictionary

import anyio
from anyio.to_thread import run_sync
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from grazemap.codec import Document, decode_npz, iter_json
from grazemap.npz import unpacked_size
from grazemap.results import class_of
from grazemap_service.problems import ProblemException

NPZ_TYPE = "application/x-npz"
# Names and media types, in the order of the server's preference.
MEDIA_TYPES = {"json": "application/json", "npz": NPZ_TYPE}
_ALIASES = {"application/zip": "npz", "application/octet-stream": "npz"}
# clients must revalidate: a result that was evicted and computed again with other numerics has another ETag
_CACHE_CONTROL = "private, no-cache"
# Minimum number of results that the budget of the cache has room for: a larger result is not kept.
_MIN_RESULTS_IN_CACHE = 4
# JSON of more bytes of arrays is made while it is sent. A larger npz waits while much is being sent.
LARGE_BYTES = 1 << 20
# Minimum bytes of a chunk of JSON.
_CHUNK_BYTES = 1 << 16
# Maximum number of renderings that run at a time.
_AT_A_TIME = 2


def negotiate(accept: str, form: str | None) -> str:
    """Return the name of the representation to send.

    Parameters
    ----------
    accept : str
        The Accept header (RFC 9110 12.5.1), empty if there is none. If weights are equal, the more specific range
        wins, then JSON.
    form : str or None
        The query parameter f, which overrides the Accept header.

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
    """Return the weight of a media type, and the specificity of the range that determines it (0, 1 or 2; -1: none)."""
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
    """Return whether the header If-None-Match, which may be empty, contains an ETag (RFC 9110 13.1.2)."""
    if if_none_match.strip() == "*":
        return True
    return etag in re.findall(r'"[^"]*"', if_none_match)


def cache_headers(stored: str, name: str) -> dict[str, str]:
    """Return the headers of a representation of a result, from the entity tag of the stored npz."""
    return {"ETag": f'"{stored}-{name}"', "Vary": "Accept", "Cache-Control": _CACHE_CONTROL}


def render(npz: bytes, name: str) -> bytes:
    """Return a stored result in the requested form; this takes time for a large result."""
    return npz if name == "npz" else b"".join(iter_json(*_for_json(npz)))


class Rendering:
    """A representation in memory, which any number of responses may send at the same time.

    Attributes
    ----------
    size : int
        Bytes of memory: those of the representation or, if JSON is made while it is sent, those of the arrays.
    length : int or None
        Bytes of the representation; None if JSON is made while it is sent.
    """

    def __init__(self, content: bytes | tuple[Document, dict[str, Any]], size: int) -> None:
        self._content = content
        self.size = size
        self.length = len(content) if isinstance(content, bytes) else None
        self.users = 0

    def chunks(self) -> Iterator[bytes]:
        """Yield the representation in chunks."""
        return iter((self._content,)) if isinstance(self._content, bytes) else _joined(iter_json(*self._content))


class Renderings:
    """A cache of representations, which are made from the stored npz and shared by all responses that send them.

    Parameters
    ----------
    hot_bytes : int
        Budget of the most recently used representations that are kept although no response sends them.
    sent_bytes : int
        When the representations that are being sent take more bytes, the next large one waits.
    """

    def __init__(self, hot_bytes: int, sent_bytes: int) -> None:
        self._hot_bytes, self._sent_bytes = hot_bytes, sent_bytes
        self._limiter = anyio.CapacityLimiter(_AT_A_TIME)
        # a lock exists as long as a request holds it or waits for it
        self._locks: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()
        self._turn = anyio.Lock()
        self._done = anyio.Event()
        self._entries: OrderedDict[str, Rendering] = OrderedDict()

    @property
    def sent(self) -> int:
        """Bytes of memory of the representations that are being sent."""
        return sum(entry.size for entry in self._entries.values() if entry.users)

    async def give(self, etag: str, name: str, size: int, load: Callable[[], bytes | None]) -> Rendering | None:
        """Return a representation; the caller must call `release` with it. None: the result is no longer stored.

        Parameters
        ----------
        etag : str
            ETag of the representation.
        name : str
            A key of `MEDIA_TYPES`.
        size : int
            Bytes of the stored npz.
        load : callable
            Returns the stored npz, or None if it is no longer stored; may block.
        """
        lock = self._locks.setdefault(etag, anyio.Lock())
        async with lock:
            entry = self._entries.get(etag)
            if entry is not None:
                entry.users += 1
                self._entries.move_to_end(etag)
                return entry
            if size > LARGE_BYTES:
                return await self._in_turn(etag, name, load)
            npz = await run_sync(load, limiter=self._limiter)
            if npz is None:
                return None
            if name == "json" and unpacked_size(npz) > LARGE_BYTES:
                return await self._in_turn(etag, name, lambda: npz)
            return self._added(etag, await run_sync(_whole, npz, name, limiter=self._limiter))

    async def _in_turn(self, etag: str, name: str, load: Callable[[], bytes | None]) -> Rendering | None:
        """Return a large representation, after waiting until other representations have been sent."""
        async with self._turn:
            while self.sent > self._sent_bytes:
                self._done = anyio.Event()
                await self._done.wait()
            npz = await run_sync(load, limiter=self._limiter)
            if npz is None:
                return None
            return self._added(etag, await run_sync(_large, npz, name, limiter=self._limiter))

    def _added(self, etag: str, entry: Rendering) -> Rendering:
        entry.users = 1
        self._entries[etag] = entry
        return entry

    def release(self, entry: Rendering) -> None:
        """Record that a response was sent or has failed; drop representations that do not fit into the budget."""
        entry.users -= 1
        kept = 0
        for etag, cached in reversed(list(self._entries.items())):
            if cached.users:
                continue
            if cached.size > self._hot_bytes // _MIN_RESULTS_IN_CACHE or kept + cached.size > self._hot_bytes:
                del self._entries[etag]
            else:
                kept += cached.size
        self._done.set()


class ResultResponse(StreamingResponse):
    """A response that sends a representation, and releases it at the end."""

    def __init__(self, rendering: Rendering, renderings: Renderings, name: str, headers: Mapping[str, str]) -> None:
        length = {} if rendering.length is None else {"Content-Length": str(rendering.length)}
        super().__init__(rendering.chunks(), headers={**headers, **length}, media_type=MEDIA_TYPES[name])
        self._rendering, self._renderings = rendering, renderings

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the representation."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._renderings.release(self._rendering)


def _whole(npz: bytes, name: str) -> Rendering:
    content = render(npz, name)
    return Rendering(content, len(content))


def _large(npz: bytes, name: str) -> Rendering:
    return Rendering(npz, len(npz)) if name == "npz" else Rendering(_for_json(npz), unpacked_size(npz))


def _for_json(npz: bytes) -> tuple[Document, dict[str, Any]]:
    """Return document and metadata for the JSON. Unlike a result, a tile has the same fields as in its npz."""
    document, meta = decode_npz(npz)
    if "tile" not in meta:
        document = class_of(meta["process"], document).json_document(document)
    return document, meta


def _joined(pieces: Iterator[bytes]) -> Iterator[bytes]:
    """Yield chunks that are joined from small pieces."""
    waiting: list[bytes] = []
    size = 0
    for piece in pieces:
        waiting.append(piece)
        size += len(piece)
        if size >= _CHUNK_BYTES:
            yield b"".join(waiting)
            waiting, size = [], 0
    yield b"".join(waiting)

"""The representations of a result: content negotiation, ETags, and a cache of recently used representations.

The store holds npz; the codec makes JSON from it. The ETag of a representation is the SHA-256 digest of the npz and
the name of the form, for example "3f...-json". It is a strong ETag, as the service always makes the same JSON of the
same npz.

JSON is many times as large as its npz. Therefore only a few representations are loaded at a time, equal requests share
one, and large JSON is made while it is sent, so that it is never complete in memory.
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
# A representation is kept only if the cache has room for at least this many of its size.
_MIN_RESULTS_IN_CACHE = 4
# A representation of more bytes is large; for JSON, the bytes of the unpacked arrays count. Large JSON is made while it
# is sent, and a large representation is loaded only when not too many bytes are being sent.
LARGE_BYTES = 1 << 20
# Minimum bytes of a chunk of JSON.
_CHUNK_BYTES = 1 << 16
# Maximum number of representations that are loaded at a time.
_AT_A_TIME = 2


def negotiate(accept: str, requested_form: str | None) -> str:
    """Return the form of the representation to send: a key of `MEDIA_TYPES`.

    Parameters
    ----------
    accept : str
        The Accept header (RFC 9110 12.5.1), empty if there is none. The most specific range that matches a form gives
        the form its weight; of equally specific ranges, the one with the greatest weight. The form with the greatest
        weight is sent; if weights are equal, the one with the more specific range, then JSON.
    requested_form : str or None
        The query parameter f, which overrides the Accept header.

    Raises
    ------
    ProblemException
        "not-acceptable".
    """
    available = "Available are " + ", ".join(f"{media} (?f={name})" for name, media in MEDIA_TYPES.items()) + "."
    if requested_form is not None:
        if requested_form not in MEDIA_TYPES:
            raise ProblemException("not-acceptable", available)
        return requested_form
    ranges = _ranges(accept or "*/*")
    weights = {form: _weight(media, form, ranges) for form, media in MEDIA_TYPES.items()}
    best = max(weights, key=lambda form: weights[form])  # max keeps the first of equals
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


def _weight(media: str, form: str, ranges: list[tuple[str, float]]) -> tuple[float, int]:
    """Return the weight of a media type, and the specificity of the range that determines it (0, 1 or 2; -1: none)."""
    best = (0.0, -1)
    for pattern, weight in ranges:
        if pattern == media or _ALIASES.get(pattern) == form:
            specific = 2
        elif pattern == media.partition("/")[0] + "/*":
            specific = 1
        elif pattern == "*/*":
            specific = 0
        else:
            continue
        if (specific, weight) > (best[1], best[0]):
            best = (weight, specific)
    return best


def is_fresh(if_none_match: str, etag: str) -> bool:
    """Return whether the header If-None-Match, which may be empty, contains an ETag (RFC 9110 13.1.2)."""
    if if_none_match.strip() == "*":
        return True
    return etag in re.findall(r'"[^"]*"', if_none_match)


def cache_headers(digest: str, form: str) -> dict[str, str]:
    """Return the headers of a representation of a result, from the digest of the stored npz."""
    return {"ETag": f'"{digest}-{form}"', "Vary": "Accept", "Cache-Control": _CACHE_CONTROL}


def render(npz: bytes, form: str) -> bytes:
    """Return a stored result in the requested form; this takes time for a large result."""
    return npz if form == "npz" else b"".join(iter_json(*_for_json(npz)))


class CachedRepresentation:
    """A representation in memory, which any number of responses may send at the same time.

    Attributes
    ----------
    size : int
        Bytes of memory: the size of the representation, or the size of the arrays if JSON is made while it is sent.
    length : int or None
        Bytes of the representation; None if JSON is made while it is sent.
    users : int
        Number of responses that send the representation, or are about to.
    """

    def __init__(self, content: bytes | tuple[Document, dict[str, Any]], size: int) -> None:
        self._content = content
        self.size = size
        self.length = len(content) if isinstance(content, bytes) else None
        self.users = 0

    def chunks(self) -> Iterator[bytes]:
        """Yield the representation in chunks."""
        return iter((self._content,)) if isinstance(self._content, bytes) else _joined(iter_json(*self._content))


class RepresentationCache:
    """A cache of representations, which are made from the stored npz and shared by all responses that send them.

    Parameters
    ----------
    cache_bytes : int
        Maximum bytes of the most recently used representations that are kept while no response sends them.
    sent_bytes : int
        When the representations that are being sent take more bytes, the next large one waits.
    """

    def __init__(self, cache_bytes: int, sent_bytes: int) -> None:
        self._cache_bytes, self._sent_bytes = cache_bytes, sent_bytes
        self._limiter = anyio.CapacityLimiter(_AT_A_TIME)
        # a lock exists as long as a request holds it or waits for it
        self._locks: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()
        self._turn = anyio.Lock()
        self._done = anyio.Event()
        self._entries: OrderedDict[str, CachedRepresentation] = OrderedDict()

    @property
    def bytes_in_use(self) -> int:
        """Bytes of memory of the representations that are being sent, or are about to be."""
        return sum(entry.size for entry in self._entries.values() if entry.users)

    async def acquire(
        self, etag: str, form: str, size: int, load: Callable[[], bytes | None]
    ) -> CachedRepresentation | None:
        """Return a representation; the caller must call `release` with it. None: the result is no longer stored.

        Parameters
        ----------
        etag : str
            ETag of the representation.
        form : str
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
                return await self._in_turn(etag, form, load)
            npz = await run_sync(load, limiter=self._limiter)
            if npz is None:
                return None
            if form == "json" and unpacked_size(npz) > LARGE_BYTES:
                return await self._in_turn(etag, form, lambda: npz)
            return self._add(etag, await run_sync(_whole, npz, form, limiter=self._limiter))

    async def _in_turn(self, etag: str, form: str, load: Callable[[], bytes | None]) -> CachedRepresentation | None:
        """Return a large representation, as soon as those that are being sent take at most `sent_bytes`."""
        async with self._turn:
            while self.bytes_in_use > self._sent_bytes:
                self._done = anyio.Event()
                await self._done.wait()
            npz = await run_sync(load, limiter=self._limiter)
            if npz is None:
                return None
            return self._add(etag, await run_sync(_large, npz, form, limiter=self._limiter))

    def _add(self, etag: str, entry: CachedRepresentation) -> CachedRepresentation:
        entry.users = 1
        self._entries[etag] = entry
        return entry

    def release(self, entry: CachedRepresentation) -> None:
        """Record that a response was sent or has failed; drop representations that do not fit into the budget."""
        entry.users -= 1
        kept = 0
        for etag, cached in reversed(list(self._entries.items())):
            if cached.users:
                continue
            if cached.size > self._cache_bytes // _MIN_RESULTS_IN_CACHE or kept + cached.size > self._cache_bytes:
                del self._entries[etag]
            else:
                kept += cached.size
        self._done.set()


class ResultResponse(StreamingResponse):
    """A response that sends a representation, and releases it at the end."""

    def __init__(
        self,
        representation: CachedRepresentation,
        cache: RepresentationCache,
        form: str,
        headers: Mapping[str, str],
    ) -> None:
        length = {} if representation.length is None else {"Content-Length": str(representation.length)}
        super().__init__(representation.chunks(), headers={**headers, **length}, media_type=MEDIA_TYPES[form])
        self._representation, self._cache = representation, cache

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the representation."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            self._cache.release(self._representation)


def _whole(npz: bytes, form: str) -> CachedRepresentation:
    content = render(npz, form)
    return CachedRepresentation(content, len(content))


def _large(npz: bytes, form: str) -> CachedRepresentation:
    if form == "npz":
        return CachedRepresentation(npz, len(npz))
    return CachedRepresentation(_for_json(npz), unpacked_size(npz))


def _for_json(npz: bytes) -> tuple[Document, dict[str, Any]]:
    """Return document and metadata for the JSON. A tile has the same fields in JSON and in npz, a result has not."""
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

"""The representations of a result: content negotiation, ETags, and a cache of recently used representations.

The store holds npz; the codec makes JSON from it. The ETag of a representation is the SHA-256 digest of the npz and
the name of the form, for example "3f...-json". It is a strong ETag, because the same npz always gives the same JSON.

JSON is many times as large as its npz. Therefore only a few representations are loaded at a time, requests for the same
representation share one copy, and large JSON is made while it is sent, so that it is never complete in memory.
"""

from __future__ import annotations

import asyncio
import re
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from typing import Any
from weakref import WeakValueDictionary, finalize

import anyio
from anyio.to_thread import run_sync
from starlette.responses import StreamingResponse
from starlette.types import Receive, Scope, Send

from grazemap.codec import Document, decode_npz, iter_json
from grazemap.npz import unpacked_size
from grazemap.results import class_of
from grazemap_service.problems import ProblemException
from grazemap_service.rendered import RENDERED_TYPES, rendered

NPZ_TYPE = "application/x-npz"
LINES_TYPE, TEXT_TYPE = "application/x-ndjson", "text/plain"
"""Of the lines of a batch; the second for clients, such as generated ones, that do not know the first."""
# Names and media types, in the order of the server's preference.
MEDIA_TYPES = {"json": "application/json", "npz": NPZ_TYPE}
RESULT_TYPES = {**MEDIA_TYPES, **RENDERED_TYPES}
"""The same of whole results, which are also sent as tables and pictures."""
_ALIASES = {"application/zip": "npz", "application/octet-stream": "npz"}
# clients must revalidate: a result that was evicted and computed again with other numerics has another ETag
_CACHE_CONTROL = "private, no-cache"
# A representation is kept only if the cache has room for at least this many of its size; so one that is larger than a
# quarter of the cache is not kept.
_MIN_RESULTS_IN_CACHE = 4
# An npz of more bytes is large, and so is JSON if its npz or its unpacked arrays have more bytes. Large JSON is made
# while it is sent. A large representation waits until the representations being sent take at most `sent_bytes`.
LARGE_BYTES = 1 << 20
# Minimum bytes of a chunk of JSON.
_CHUNK_BYTES = 1 << 16
# Maximum number of representations that are loaded at a time.
_AT_A_TIME = 2
# Maximum number of tables and pictures that are made at a time, by processes of their own; other forms do not wait.
_DRAWN_AT_A_TIME = 1


def negotiate(accept: str, requested_form: str | None, forms: Mapping[str, str] = MEDIA_TYPES) -> str:
    """Return the form of the representation to send: a key of `forms`.

    Parameters
    ----------
    accept : str
        The Accept header (RFC 9110 12.5.1), empty if there is none. Each form gets the weight (q) of the most specific
        range that matches it: application/json comes before application/*, and application/* before */*. Of equally
        specific ranges, the greatest weight counts. The form with the greatest weight is sent. If weights are equal,
        the form with the more specific range is sent, then JSON. A weight over 1 counts as 1. An item whose weight is
        no number is ignored.
    requested_form : str or None
        The query parameter f, which overrides the Accept header.
    forms : mapping
        Names and media types that can be sent, in the order of preference.

    Raises
    ------
    ProblemException
        "not-acceptable".
    """
    available = "Available are " + ", ".join(f"{media} (?f={name})" for name, media in forms.items()) + "."
    if requested_form is not None:
        if requested_form not in forms:
            raise ProblemException("not-acceptable", available)
        return requested_form
    ranges = _ranges(accept or "*/*")
    weights = {form: _weight(media, form, ranges) for form, media in forms.items()}
    best = max(weights, key=lambda form: weights[form])  # max keeps the first of equals
    if weights[best][0] <= 0:
        raise ProblemException("not-acceptable", available)
    return best


def _ranges(accept: str) -> list[tuple[str, float]]:
    """Return the media ranges of an Accept header with their weights, without items whose weight is no number."""
    ranges = []
    for item in accept.split(","):
        media, *parameters = (part.strip().lower() for part in item.split(";"))
        parts = [part.partition("=") for part in parameters]
        weight = next((value.strip() for name, _, value in parts if name.strip() == "q"), "1")
        if media and re.fullmatch(r"\d+(?:\.\d*)?|\.\d+", weight):
            ranges.append((media, min(1.0, float(weight))))
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


def cache_headers(digest: str, form: str, variant: str = "") -> dict[str, str]:
    """Return the headers of a representation of a result, or of a variant of it, from the digest of the stored npz."""
    name = f"{form}-{variant}" if variant else form
    return {"ETag": f'"{digest}-{name}"', "Vary": "Accept", "Cache-Control": _CACHE_CONTROL}


def render(npz: bytes, form: str, variant: str = "") -> bytes:
    """Return a stored result in the requested form, a `variant` of it; this takes time for a large result."""
    if form in RENDERED_TYPES:
        return rendered(npz, form, variant)
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
        Maximum bytes of the representations that are kept while no response sends them; the least recently used are
        dropped first.
    sent_bytes : int
        While the representations that are being sent take more bytes, the next large representation waits.
    """

    def __init__(self, cache_bytes: int, sent_bytes: int) -> None:
        self._cache_bytes, self._sent_bytes = cache_bytes, sent_bytes
        self._limiter = anyio.CapacityLimiter(_AT_A_TIME)
        self._drawing = anyio.CapacityLimiter(_DRAWN_AT_A_TIME)
        # a lock exists as long as a request holds it or waits for it
        self._locks: WeakValueDictionary[str, anyio.Lock] = WeakValueDictionary()
        self._large_lock = anyio.Lock()
        self._released = anyio.Event()
        self._entries: OrderedDict[str, CachedRepresentation] = OrderedDict()

    @property
    def bytes_in_use(self) -> int:
        """Bytes of memory of the representations that are being sent, or are about to be."""
        return sum(entry.size for entry in self._entries.values() if entry.users)

    async def acquire(
        self, etag: str, form: str, size: int, load: Callable[[], bytes | None], variant: str = ""
    ) -> CachedRepresentation | None:
        """Return a representation, or None if the result is no longer stored.

        The caller must call `release` with the representation, or give it to a `ResultResponse`.

        Parameters
        ----------
        etag : str
            ETag of the representation.
        form : str
            A key of `MEDIA_TYPES` or `RENDERED_TYPES`.
        size : int
            Bytes of the stored npz.
        load : callable
            Returns the stored npz, or None if it is no longer stored; may block.
        variant : str
            The name of a table, in a form that is one, or the style of a picture.
        """
        lock = self._locks.setdefault(etag, anyio.Lock())
        async with lock:
            entry = self._entries.get(etag)
            if entry is not None:
                entry.users += 1
                self._entries.move_to_end(etag)
                return entry
            if (
                form in RENDERED_TYPES
            ):  # by a process of its own, which takes seconds; those that wait have loaded nothing
                made = await run_sync(_made, load, form, variant, limiter=self._drawing)
                return None if made is None else self._add(etag, made)
            if size > LARGE_BYTES:
                return await self._in_turn(etag, form, load)
            npz = await run_sync(load, limiter=self._limiter)
            if npz is None:
                return None
            if form == "json" and unpacked_size(npz) > LARGE_BYTES:
                return await self._in_turn(etag, form, lambda: npz)
            return self._add(etag, await run_sync(_whole, npz, form, variant, limiter=self._limiter))

    async def _in_turn(self, etag: str, form: str, load: Callable[[], bytes | None]) -> CachedRepresentation | None:
        """Return a large representation, as soon as the representations being sent take at most `sent_bytes`."""
        async with self._large_lock:
            while self.bytes_in_use > self._sent_bytes:
                self._released = anyio.Event()
                await self._released.wait()
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
        self._released.set()


class ResultResponse(StreamingResponse):
    """A response that sends a representation, and releases it at the end, or when the response is dropped unsent."""

    def __init__(
        self,
        representation: CachedRepresentation,
        cache: RepresentationCache,
        form: str,
        headers: Mapping[str, str],
    ) -> None:
        length = {} if representation.length is None else {"Content-Length": str(representation.length)}
        super().__init__(representation.chunks(), headers={**headers, **length}, media_type=RESULT_TYPES[form])
        self._representation, self._cache = representation, cache
        self._dropped = finalize(self, _release_in, asyncio.get_running_loop(), cache, representation)
        self._dropped.atexit = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the representation."""
        try:
            await super().__call__(scope, receive, send)
        finally:
            if self._dropped.detach():  # it was not sent before
                self._cache.release(self._representation)


def _release_in(
    loop: asyncio.AbstractEventLoop, cache: RepresentationCache, representation: CachedRepresentation
) -> None:
    """Release a representation in the event loop; the garbage collector may run in any thread."""
    with suppress(RuntimeError):  # the loop has ended
        loop.call_soon_threadsafe(cache.release, representation)


def _made(load: Callable[[], bytes | None], form: str, variant: str) -> CachedRepresentation | None:
    npz = load()
    return None if npz is None else _whole(npz, form, variant)


def _whole(npz: bytes, form: str, variant: str) -> CachedRepresentation:
    content = render(npz, form, variant)
    return CachedRepresentation(content, len(content))


def _large(npz: bytes, form: str) -> CachedRepresentation:
    if form == "npz":
        return CachedRepresentation(npz, len(npz))
    return CachedRepresentation(_for_json(npz), unpacked_size(npz))


def _for_json(npz: bytes) -> tuple[Document, dict[str, Any]]:
    """Return document and metadata for the JSON.

    A tile has the same fields in JSON and in npz. A result has additional or other fields in JSON.
    """
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

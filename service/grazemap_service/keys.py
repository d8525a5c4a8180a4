"""Keys of clients: from the setting GRAZEMAP_API_KEYS, and from a file that is read again when it changes.

A key is a bearer token after RFC 6750. A key is accepted if a random one like it has 128 bits: see `is_strong`. Logs
and metrics contain the name of a key, never the key. The keys of a file are kept as digests only. The weight and the
quota of a key are those of the requester that has its name.
"""

from __future__ import annotations

import hashlib
import hmac
import math
import re
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import structlog
from pydantic import SecretStr

BITS = 128
MIN_DIFFERENT = 8
RULE = (
    "a key has 22 or more of the characters A-Z a-z 0-9 - . _ ~ + / (25 or more if they are digits and letters of one "
    "case, 32 if hexadecimal digits, 39 if decimal digits; = may follow), 8 of them different; "
    'python -c "import secrets; print(secrets.token_urlsafe(24))" makes one'
)
# Patterns of alphabets, and their numbers of characters. The first pattern that a key matches counts.
_ALPHABETS = ((r"[0-9]*", 10), (r"[0-9a-f]*|[0-9A-F]*", 16), (r"[0-9a-z]*|[0-9A-Z]*", 36), (r"[A-Za-z0-9._~+/-]*", 64))
_NAME = re.compile(r"[A-Za-z0-9._-]{1,32}")
# Seconds between two looks at the file.
_LOOK_SECONDS = 1.0
_MAX_FILE_BYTES = 1 << 20
_MAX_WEIGHT = 1000.0


@dataclass(frozen=True)
class Key:
    """What a key grants."""

    name: str
    """Name of the key."""
    weight: float = 1.0
    """Share of the workers."""
    quota: int | None = None
    """Maximum number of unfinished tiles of its jobs; None: no limit."""


# Keys by their digests.
Keyring = dict[bytes, Key]


def is_strong(text: str) -> bool:
    """Return whether a random key of this length from the smallest alphabet that has its characters has 128 bits.

    The key must also have `MIN_DIFFERENT` different characters.
    """
    body = text.rstrip("=")
    size = next((size for pattern, size in _ALPHABETS if re.fullmatch(pattern, body)), 1)
    return len(body) * math.log2(size) >= BITS and len(set(body)) >= MIN_DIFFERENT


def setting_keys(keys: Sequence[SecretStr]) -> Keyring:
    """Return the keys of GRAZEMAP_API_KEYS, each ``key`` or ``name=key``.

    Raises ValueError if one is not valid; the message does not contain the key.
    """
    entries = []
    for place, key in enumerate(keys, 1):
        name, _, text = key.get_secret_value().partition("=")
        if not text.strip("="):  # in a key without a name, = stands only at the end
            name, text = f"key-{place}", key.get_secret_value()
        entries.append((f"key {place}", text, Key(name)))
    return _make_keyring(entries)


def file_keys(path: Path) -> Keyring:
    """Return the keys of a file with lines ``name key [weight] [quota]``; # begins a comment.

    Raises
    ------
    ValueError
        The file cannot be read, or a line is wrong. The message contains the number of the line and no key.
    """
    try:
        with path.open("rb") as stream:
            text = stream.read(_MAX_FILE_BYTES + 1)
        if len(text) > _MAX_FILE_BYTES:
            raise ValueError("the file has more than 1 MiB")
        lines = text.decode("utf-8").splitlines()
    except OSError as error:
        raise ValueError(f"the file cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError("the file is not UTF-8") from None
    entries = []
    for number, line in enumerate(lines, 1):
        words = line.partition("#")[0].split()
        if words:
            entries.append((f"line {number}", *_parse_line(f"line {number}", words)))
    if not entries:
        raise ValueError("the file has no key")
    return _make_keyring(entries)


def _parse_line(place: str, words: list[str]) -> tuple[str, Key]:
    if not 2 <= len(words) <= 4:
        raise ValueError(f"{place} is not: name key [weight] [quota]")
    try:
        weight = float(words[2]) if len(words) > 2 else 1.0
        quota = int(words[3]) if len(words) > 3 else None
    except ValueError:
        weight, quota = math.nan, None
    if not 0.0 < weight <= _MAX_WEIGHT or (quota is not None and quota < 1):
        raise ValueError(f"{place}: weight must be a number > 0, at most {_MAX_WEIGHT:g}, and quota an integer > 0")
    return words[1], Key(words[0], weight, quota)


def _make_keyring(entries: Iterable[tuple[str, str, Key]]) -> Keyring:
    keyring: Keyring = {}
    for place, text, key in entries:
        if not _NAME.fullmatch(key.name):
            raise ValueError(f"the name of {place} must have 1 to 32 of the characters A-Z a-z 0-9 . _ -")
        if not is_strong(text):
            raise ValueError(f"{place} is too weak: {RULE}")
        digest = digest_of(text.encode())
        if digest in keyring:
            raise ValueError(f"{place} repeats an earlier key")
        if any(earlier.name == key.name and earlier != key for earlier in keyring.values()):
            raise ValueError(f"{place}: another key of this name has another weight or quota")
        keyring[digest] = key
    return keyring


def digest_of(key: bytes) -> bytes:
    """Return the digest of a key, which is kept in place of the key."""
    return hashlib.sha256(key).digest()


class Keys:
    """The keys that are accepted now. A key that is in the setting and in the file has what the file grants.

    Parameters
    ----------
    setting : sequence of SecretStr
        The keys of GRAZEMAP_API_KEYS.
    file : Path, optional
        A file of keys, which is looked at once a second at most and read again when it has changed. While the file
        cannot be used, the keys of the last valid file stay.

    Raises
    ------
    ValueError
        A key is weak, or the file cannot be used.
    """

    def __init__(self, setting: Sequence[SecretStr], file: Path | None = None) -> None:
        self.required = bool(setting) or file is not None
        self._setting_keys, self._file = setting_keys(setting), file
        self._state = _state(file)
        self._file_keys = file_keys(file) if file is not None else {}
        self._next_look = time.monotonic() + _LOOK_SECONDS

    def find(self, text: bytes) -> Key | None:
        """Return what a key grants; None if it is unknown. It is compared with every key in constant time."""
        self._look()
        sought = digest_of(text)
        keyring = {**self._setting_keys, **self._file_keys}
        matches = [key for digest, key in keyring.items() if hmac.compare_digest(sought, digest)]
        return matches[0] if matches else None

    def _look(self) -> None:
        if self._file is None or time.monotonic() < self._next_look:
            return
        self._next_look = time.monotonic() + _LOOK_SECONDS
        state = _state(self._file)  # before the file is read, so that a later change differs from it
        if state == self._state:
            return
        self._state = state
        log = structlog.get_logger("grazemap_service")
        try:
            self._file_keys = file_keys(self._file)
        except ValueError as error:
            log.error("GRAZEMAP_API_KEYS_FILE cannot be used, the earlier keys stay", reason=str(error))
        else:
            log.info("keys read again", keys=len(self._file_keys))


def _state(file: Path | None) -> tuple[int, int, int, int] | None:
    """Return times, size and inode of a file, which differ after a change, also of permissions; None: no file."""
    try:
        status = file.stat() if file is not None else None
    except OSError:
        return None
    return (status.st_mtime_ns, status.st_ctime_ns, status.st_size, status.st_ino) if status is not None else None

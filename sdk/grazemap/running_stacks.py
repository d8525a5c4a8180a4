"""How the stacks that run on this machine are found by other processes of their user, and how long they live.

A stack that is ready announces itself in a folder of its own, with a file that it keeps locked. A process that joins it
keeps a file in this folder locked, too. A lock ends with its process, even if that is killed. So nothing is believed of
a stack that has ended, and a stack knows whether anyone uses it.

    announced/8f3a/stack.json     address, version, installation and settings of the stack
    announced/8f3a/user-0c51      a process that has joined it
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO, Any
from uuid import uuid4

from grazemap.version import __version__

_STACK, _WITHDRAWN, _USER = "stack.json", "withdrawn.json", "user-"
# Settings of a public service that do not fit a private stack: API keys (its client has none), allowed hosts and
# origins, and the address or the socket to listen on.
OF_SERVICE = frozenset(
    f"GRAZEMAP_{name}" for name in ("API_KEYS", "API_KEYS_FILE", "ALLOWED_HOSTS", "CORS_ORIGINS", "HOST", "PORT", "FD")
)
OF_CLIENTS = frozenset(f"GRAZEMAP_{name}" for name in ("URL", "API_KEY", "LOCAL"))
"""Variables of clients, which do not change a stack."""
_KEYS = ("GRAZEMAP_API_KEYS", "GRAZEMAP_API_KEYS_FILE")
# Variables on which the bytes of results depend, by their beginnings.
_OF_NUMERICS = ("NUMBA_", "NPY_", "OPENBLAS_CORETYPE")
# A younger folder without an announcement is not removed, because its stack may be about to announce itself.
_YOUNG_SECONDS = 60.0


class Announcement:
    """The announcement of a stack, made by the stack itself."""

    def __init__(self, folder: Path, url: str) -> None:
        """Announce the stack that has this address. Raises OSError."""
        self.path = folder / uuid4().hex[:12]
        self.path.mkdir()
        unlocked = self.path / "unlocked.json"
        self._lock = unlocked.open("w", encoding="utf-8")
        json.dump({"url": url, **_kind(os.environ)}, self._lock)
        self._lock.flush()
        _locked(self._lock)
        os.replace(unlocked, self.path / _STACK)

    def close(self) -> None:
        """Take the announcement back, and remove its folder."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._lock.close()


def announce(url: str) -> Announcement | None:
    """Announce a stack, unless GRAZEMAP_LOCAL=own, its clients need keys, or there is no private folder for that."""
    folder = _folder()
    if folder is None or os.environ.get("GRAZEMAP_LOCAL") == "own" or any(name.upper() in _KEYS for name in os.environ):
        return None
    with suppress(OSError):
        return Announcement(folder, url)
    return None


class Membership:
    """The right to use the stack of another process; it lives until this is closed.

    Attributes
    ----------
    url : str
        The address of its service.
    """

    def __init__(self, url: str, mark: IO[bytes]) -> None:
        self.url, self._mark = url, mark

    def close(self) -> None:
        """Leave the stack."""
        with suppress(OSError):
            os.unlink(self._mark.name)
        self._mark.close()


def memberships() -> Iterator[Membership]:
    """Join the announced stacks of this version, installation and settings, one after another."""
    folder = _folder()
    for path in [] if folder is None else sorted(folder.iterdir()):
        mark = None
        _remove_if_ended(path)
        try:
            announced = json.loads((path / _STACK).read_bytes())
            if {name: announced.get(name) for name in _kind({})} != _kind(os.environ):
                continue
            mark = (path / f"{_USER}{uuid4().hex[:12]}").open("wb")
            _locked(mark, waits=True)  # a stack that looks for users locks it for a moment
            # a stack that is about to end withdraws its announcement before it looks for users
            if (path / _STACK).exists():
                yield Membership(str(announced["url"]), mark)
                continue
        except (OSError, ValueError, LookupError):
            pass
        if mark is not None:
            mark.close()


def withdraw(path: Path) -> bool:
    """Have no other process join the stack of a folder, unless one uses it; return whether nobody does."""
    if is_used(path):
        return False
    with suppress(OSError):
        os.replace(path / _STACK, path / _WITHDRAWN)
    if not is_used(path):
        return True
    with suppress(OSError):
        os.replace(path / _WITHDRAWN, path / _STACK)
    return False


def is_used(path: Path) -> bool:
    """Return whether a process has joined the stack of a folder, and has not left it."""
    for user in path.glob(f"{_USER}*"):
        with suppress(OSError), user.open("rb") as file:
            if not _locked(file):
                return True
    return False


def _remove_if_ended(path: Path) -> None:
    """Remove the folder of a stack that has ended, or that was killed before it had announced itself."""
    ended = False
    for name in (_STACK, _WITHDRAWN):
        with suppress(OSError), (path / name).open("rb") as file:
            if not _locked(file):
                return
            ended = True
    with suppress(OSError):
        # a stack may announce itself at this moment, so its file is not looked at again
        if ended or time.time() - path.stat().st_mtime > _YOUNG_SECONDS:
            shutil.rmtree(path, ignore_errors=True)


def _kind(environment: Mapping[str, str]) -> dict[str, Any]:
    """Return what the stacks that a process may join have in common with one of its own."""
    settings = {
        name.upper(): value
        for name, value in environment.items()
        if name.startswith(_OF_NUMERICS)
        or (name.upper().startswith("GRAZEMAP_") and name.upper() not in OF_SERVICE | OF_CLIENTS)
    }
    digest = hashlib.sha256(json.dumps(sorted(settings.items())).encode()).hexdigest()[:16]
    return {"version": __version__, "installation": str(Path(__file__).parent), "settings": digest}


def _folder() -> Path | None:
    """Return the private folder of announcements of this user; None if there is none."""
    if not hasattr(os, "getuid"):
        return None
    user = os.getuid()
    folder = Path(os.environ.get("XDG_RUNTIME_DIR") or tempfile.gettempdir()) / f"grazemap-stacks-{user}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return None
    private = stat.S_ISDIR(status.st_mode) and status.st_uid == user and not status.st_mode & 0o077
    return folder if private else None


def _locked(file: IO[Any], waits: bool = False) -> bool:
    """Lock a file; return whether that succeeded."""
    import fcntl  # not on every system that has the client

    try:
        fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    return True

"""A cache of results on the client's disk, by job id; a result is used only if the service confirms its ETag.

A file is one line of JSON {etag, sha256} and then the npz bytes. It is written under another name and renamed, so that
a reader sees a complete file or none; a damaged file counts as absent. If the folder cannot be read or written, results
are fetched from the service, and a warning is logged. Nothing is ever removed from the folder.
"""

from __future__ import annotations

import hashlib
import json
import logging
import os
from pathlib import Path

from grazemap.whole_files import unfinished

_log = logging.getLogger(__name__)


class ResultCache:
    """A folder of results, created when the first result is written."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder).expanduser()

    def read(self, job_id: str) -> tuple[str, bytes] | None:
        """Return the ETag and the npz bytes of a job's cached result, or None."""
        try:
            header, _, data = self._path(job_id).read_bytes().partition(b"\n")
        except FileNotFoundError:
            return None
        except OSError as error:
            _log.warning("the cached result is not used: %s", error)
            return None
        try:
            described = json.loads(header)
            etag, digest = str(described["etag"]), described["sha256"]
        except (ValueError, TypeError, KeyError):
            return None
        return (etag, data) if hashlib.sha256(data).hexdigest() == digest else None

    def write(self, job_id: str, etag: str, data: bytes) -> None:
        """Write a result; a failure is logged."""
        try:
            self._write(job_id, etag, data)
        except OSError as error:
            _log.warning("the result is not kept on disk: %s", error)

    def _write(self, job_id: str, etag: str, data: bytes) -> None:
        self.folder.mkdir(parents=True, exist_ok=True)
        header = json.dumps({"etag": etag, "sha256": hashlib.sha256(data).hexdigest()}).encode()
        with unfinished(self._path(job_id)) as path:
            path.touch(0o600)
            path.write_bytes(header + b"\n" + data)
            os.replace(path, self._path(job_id))

    def _path(self, job_id: str) -> Path:
        return self.folder / f"{job_id}.result"

"""The processes: what each of them computes, one module per process, named after it.

In: a validated request. Out: a document (see `grazemap.codec`) with the fields of the process's schema (see
`grazemap.schema`). The core is imported when a process is first used, so that this table can be read without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import wraps
from importlib import import_module
from typing import ParamSpec

from grazemap.codec import Document
from grazemap.schema import schema_of
from grazemap.schema.documents import with_deprecated
from grazemap.wire import PROCESSES as REQUESTS
from grazemap_worker.processes.process import Process

P = ParamSpec("P")


def _process(name: str) -> Process:
    """Return the process of a name, the documents of whose results have the deprecated names of their fields too."""
    found: Process = import_module(f"{__name__}.{name.replace('-', '_')}").PROCESS
    if found.whole is not None:
        return replace(found, whole=_with_deprecated(name, found.whole))
    assert found.assembled is not None  # tiles are put together
    return replace(found, assembled=_with_deprecated(name, found.assembled))


def _with_deprecated(name: str, compute: Callable[P, Document]) -> Callable[P, Document]:
    @wraps(compute)
    def full(*args: P.args, **kwargs: P.kwargs) -> Document:
        document = compute(*args, **kwargs)
        return with_deprecated(schema_of(name, document), document)

    return full


PROCESSES: Mapping[str, Process] = {name: _process(name) for name in REQUESTS}

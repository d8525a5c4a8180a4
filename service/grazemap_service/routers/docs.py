"""The HTML pages / and /docs, the guide, and their static files, all from this host, with a Content-Security-Policy.

The docs page is Swagger UI from the files of the package fastapi-offline. Its start-up script and its style are files
of grazemap, so that neither inline scripts nor inline styles are needed. The guide is what Sphinx made of docs/, which
has both.
"""

from __future__ import annotations

import gzip
import os
import re
from collections.abc import Awaitable, Callable, Sequence
from functools import lru_cache
from hashlib import sha256
from importlib.util import find_spec
from mimetypes import guess_type
from pathlib import Path

from fastapi import FastAPI
from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Receive, Scope, Send

import grazemap
from grazemap.results import UnfoldingMap
from grazemap.wire.observables import OBSERVABLES
from grazemap_service import middleware
from grazemap_service.problems import ProblemException

_OWN = Path(__file__).parent.parent / "static"
_PALETTE = Path(grazemap.__file__).parent / "palette.json"
_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors "
)
# browsers ask again for each file, so that they do not mix modules of two versions after an update
_REVALIDATED = {"Cache-Control": "no-cache"}
_COMMENT = re.compile(rb"^[ \t]*(?://.*|/\*\*.*\*/)$", re.MULTILINE)
# its pages set the theme before they are drawn, and its search is a form
_GUIDE_POLICY = (
    "default-src 'none'; script-src 'self' 'unsafe-inline'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "font-src 'self'; connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)


class _WholeFile(FileResponse):
    """A response with a whole file.

    It ignores a Range header, as a server may (RFC 9110 14.2): Starlette would answer a wrong one in plain text.
    """

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send the file."""
        self.headers["Accept-Ranges"] = "none"
        headers = [(name, value) for name, value in scope["headers"] if name != b"range"]
        await super().__call__({**scope, "headers": headers}, receive, send)


class _WholeFiles(StaticFiles):
    """A folder of static files that are sent as whole files."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """Return the response with a file, or the response that it has not changed."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        if not isinstance(response, FileResponse):
            return response
        return _WholeFile(full_path, status_code, _REVALIDATED, stat_result=stat_result)


class _OwnFiles(StaticFiles):
    """The files of the pages, as `_own` answers with them."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """Return the response with a file, or the response that it has not changed."""
        return _own(Path(full_path), Headers(scope=scope))


def _own(path: Path, asked: Headers, **headers: str) -> Response:
    """Return the response with a file of the pages, compressed where a browser takes that, or that it is unchanged."""
    content, packed, tag = _sent(path, path.stat().st_mtime_ns)
    is_packed = "gzip" in asked.get("accept-encoding", "")
    headers |= {
        "ETag": f'"{tag}{"-gzip" * is_packed}"',
        "Vary": "Accept-Encoding",
        "Accept-Ranges": "none",
        **_REVALIDATED,
    }
    if headers["ETag"] in asked.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    if is_packed:
        headers["Content-Encoding"] = "gzip"
    return Response(packed if is_packed else content, headers=headers, media_type=guess_type(path.name)[0])


@lru_cache(maxsize=256)
def _sent(path: Path, changed: int) -> tuple[bytes, bytes, str]:
    """Return what is sent of a file that was last changed then, the same compressed, and a hash of it.

    Lines of a module that are comments alone stay here, as empty lines: they are a seventh of what would travel.
    """
    content = path.read_bytes()
    if path.suffix == ".js":
        content = _COMMENT.sub(b"", content)
    return content, gzip.compress(content, mtime=0), sha256(content).hexdigest()[:32]


class _Guide(_WholeFiles):
    """The pages of the guide; where it was not built, an answer that says so."""

    def file_response(
        self, full_path: str | os.PathLike[str], stat_result: os.stat_result, scope: Scope, status_code: int = 200
    ) -> Response:
        """Return the response with a page that may run its own scripts."""
        response = super().file_response(full_path, stat_result, scope, status_code)
        response.headers["Content-Security-Policy"] = _GUIDE_POLICY
        return response

    @property
    def is_built(self) -> bool:
        """Whether this installation has the guide."""
        return Path(self.directory or "").is_dir()

    async def check_config(self) -> None:
        """Accept a missing folder, which is answered for."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the response with a page or a file of the guide."""
        if not self.is_built:
            raise ProblemException("not-found", "This installation has no guide: `make guide` builds it.")
        return await super().get_response(path, scope)


GUIDE = _Guide(directory=Path(__file__).parent.parent / "guide", html=True, check_dir=False)


def install(app: FastAPI, frame_origins: Sequence[str]) -> None:
    """Add the pages and their files to the app; pages of `frame_origins` may show the explorer in a frame."""
    explorer = _page("index.html", " ".join(("'self'", *frame_origins)))
    app.add_route("/", explorer, methods=["GET"], include_in_schema=False)
    app.add_route("/docs", _page("docs.html", "'none'"), methods=["GET"], include_in_schema=False)
    app.add_route("/static/palette.json", _palette, methods=["GET"], include_in_schema=False)
    app.add_route("/static/observables.json", _observables, methods=["GET"], include_in_schema=False)
    app.mount(middleware.GUIDE, GUIDE, name="guide")
    app.mount("/static/swagger", _WholeFiles(directory=_swagger_files()), name="swagger")
    app.mount("/static", _OwnFiles(directory=_OWN), name="static")


def _page(name: str, frame_ancestors: str) -> Callable[[Request], Awaitable[Response]]:
    headers = {"Content-Security-Policy": f"{_POLICY}{frame_ancestors}"}

    async def page(request: Request) -> Response:
        return _own(_OWN / name, request.headers, **headers)

    return page


async def _palette(request: Request) -> Response:
    """Answer with the colours of the SDK's pictures."""
    return _own(_PALETTE, request.headers)


async def _observables(request: Request) -> Response:
    """Answer with the observables of maps: their names, units in SI and descriptions."""
    quantities = [
        {"name": quantity.name, "unit": quantity.unit, "description": quantity.description}
        for quantity in UnfoldingMap.schema
        if quantity.name in OBSERVABLES
    ]
    return JSONResponse(quantities, headers=_REVALIDATED)


def _swagger_files() -> Path:
    """Return the folder with the files of Swagger UI, without importing the package."""
    spec = find_spec("fastapi_offline")
    if spec is None or spec.origin is None:
        raise ModuleNotFoundError('the docs page needs fastapi-offline: pip install "grazemap[server]"')
    return Path(spec.origin).parent / "static"

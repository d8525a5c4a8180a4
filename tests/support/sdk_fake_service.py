"""A service in a few lines: jobs that finish after some looks at them, results made by hand, problems on demand."""

from __future__ import annotations

import base64
import contextlib
import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import httpx2

from grazemap.wire import canonical_id, notes_on, parse_request
from tests.support.sdk_documents import ADAPTIVE, MANY, npz


def problem(status: int, kind: str = "some-problem", **headers: str) -> httpx2.Response:
    body = {"type": f"urn:grazemap:problem:{kind}", "title": kind, "status": status, "detail": "because"}
    return httpx2.Response(status, json=body, headers={"content-type": "application/problem+json", **headers})


class FakeService:
    """Call it with a request; it is the handler of an `httpx2.MockTransport`."""

    def __init__(self) -> None:
        self.jobs: dict[str, dict[str, Any]] = {}
        self.computed = 0
        self.requests: list[httpx2.Request] = []
        self.results: dict[str, bytes] = {}
        self.ending = "successful"
        self.most_lines = 1000
        self.ready = True
        self.shared = False
        self.upcoming: list[httpx2.Response | Exception] = []

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        self.requests.append(request)
        if self.upcoming:
            answer = self.upcoming.pop(0)
            if isinstance(answer, Exception):
                raise answer
            return answer
        parts = request.url.path.strip("/").split("/")
        if parts[2:] == ["estimate"]:
            asked = parse_request(parts[1], json.loads(request.content))
            notes = [note.model_dump() for note in notes_on(asked)]
            return httpx2.Response(200, json={"periods": 9.0, "tiles": 2, "seconds": 3.0, "notes": notes})
        if parts == ["v1", "batches"]:
            return self._batch(json.loads(request.content)["requests"])
        if request.method == "POST":
            return self._submit(parts[1], json.loads(request.content))
        if parts == ["v1"]:
            return httpx2.Response(200, json={"version": "fake", "processes": []})
        if parts == ["v1", "status"]:
            return httpx2.Response(200, json=self._status())
        if parts == ["v1", "jobs"]:
            return self._list(request)
        if parts[2] not in self.jobs:
            return problem(404, "unknown-job")
        job = self.jobs[parts[2]]
        if request.method == "DELETE":
            if self.shared:
                return httpx2.Response(200, json=job | {"notes": [{"code": "goes-on", "detail": "it goes on"}]})
            if job["status"] in ("accepted", "running"):
                job["status"] = "dismissed"
            return httpx2.Response(200, json=job)
        if parts[3:] == ["events"]:
            return self._events(job)
        if parts[3:] == ["result"]:
            return self._result(request, job)
        return httpx2.Response(200, json=job)

    def _status(self) -> dict[str, Any]:
        statuses = [job["status"] for job in self.jobs.values()]
        computes = {"job": "a" * 64, "process": "unfolding-maps", "tile": 3, "seconds": 150.0}
        return {
            "version": "fake",
            "ready": self.ready,
            "detail": "" if self.ready else "The disk is full.",
            "workers": [{"small": False, "computes": computes}, {"small": True}],
            "jobs": {status: statuses.count(status) for status in statuses},
            "pending_tiles": 812,
            "waiting": {"small": {"jobs": 0, "seconds": 0.0}, "long": {"jobs": 2, "seconds": 90.0}},
            "claimed_seconds": 7200.0,
            "stored_bytes": {"requests": 2100, "tiles": 3_000_000, "results:large": 1_000_000},
            "budget_bytes": 2_000_000_000,
            "events": {"failures:lost": 3, "failures:hung": 0},
        }

    def _submit(self, process: str, body: dict[str, Any]) -> httpx2.Response:
        request = parse_request(process, body)
        name = canonical_id(process, request.canonical(), "1")
        there = name in self.jobs and self.jobs[name]["status"] not in ("failed", "dismissed")
        if not there:
            self.computed += 1
            self.jobs[name] = {
                "id": name,
                "process": process,
                "request": body,
                "status": "running",
                "progress": {"done": 0, "total": 2, "unit": "tiles"},
                "notes": [note.model_dump() for note in notes_on(request)],
            }
        return httpx2.Response(200 if there else 201, json=self.jobs[name])

    def _batch(self, asked: list[dict[str, Any]]) -> httpx2.Response:
        """Answer the last request first, as far as `most_lines` goes."""
        lines: list[dict[str, Any]] = []
        for index, entry in reversed([*enumerate(asked)]):
            job = self._submit(entry["process"], entry["request"]).json()
            self.finish(self.jobs[job["id"]])
            line = {"index": index, "id": job["id"], "status": self.ending}
            if self.ending == "successful":
                line["npz"] = base64.b64encode(self.results[job["id"]]).decode()
            lines.append(line)
        text = "\n".join(["", *map(json.dumps, lines[: self.most_lines]), ""])
        return httpx2.Response(200, content=text.encode(), headers={"content-type": "application/x-ndjson"})

    def _list(self, request: httpx2.Request) -> httpx2.Response:
        jobs = list(self.jobs.values())
        start, limit = int(request.url.params.get("cursor", 0)), int(request.url.params["limit"])
        page = jobs[start : start + min(limit, 2)]
        links = (
            [{"href": f"https://elsewhere/v1/jobs?cursor={start + 2}", "rel": "next"}] if start + 2 < len(jobs) else []
        )
        return httpx2.Response(200, json={"jobs": page, "links": links})

    def finish(self, job: dict[str, Any]) -> None:
        job["status"] = self.ending
        job["progress"] = {"done": 2, "total": 2, "unit": "tiles"}
        if self.ending == "failed":
            job["problem"] = {"type": "urn:x", "title": "Tile failed", "status": 500, "detail": "tile 3"}
        if self.ending == "successful":
            several, adaptive = isinstance(job["request"].get("initial"), list), job["request"].get("adaptive")
            sample = MANY if several else ADAPTIVE if adaptive else job["process"]
            self.results[job["id"]] = npz(
                sample, units=job["request"].get("oscillator", {}).get("units", "nondimensional")
            )

    def _events(self, job: dict[str, Any]) -> httpx2.Response:
        self.finish(job)
        events = [
            ("1-0", "progress", {"done": 0, "total": 2, "unit": "tiles", "eta_seconds": None}),
            ("2-0", "tile", {"index": 0, "rows": [0, 1]}),
            ("3-0", "progress", {"done": 2, "total": 2, "unit": "tiles", "eta_seconds": 0.0}),
            ("4-0", "done", {"status": job["status"]}),
        ]
        text = ": hello\n\n" + "".join(
            f"id: {number}\nevent: {name}\ndata: {json.dumps(data)}\n\n" for number, name, data in events
        )
        return httpx2.Response(200, content=text.encode(), headers={"content-type": "text/event-stream; charset=utf-8"})

    def _result(self, request: httpx2.Request, job: dict[str, Any]) -> httpx2.Response:
        if job["status"] in ("failed", "dismissed"):
            return problem(500 if job["status"] == "failed" else 409)
        if job["status"] != "successful":
            return problem(409, "unfinished-job")
        if job["id"] not in self.results:
            self.computed += 1
            job["status"] = "running"
            return httpx2.Response(202, json=job)
        etag = f'"{job["id"][:8]}-npz"'
        if request.headers.get("if-none-match") == etag:
            return httpx2.Response(304, headers={"etag": etag})
        return httpx2.Response(200, content=self.results[job["id"]], headers={"etag": etag})


@contextlib.contextmanager
def served(service: FakeService) -> Iterator[str]:
    """Serve it on a real socket; gives the address."""

    class Handler(BaseHTTPRequestHandler):
        def _answer(self) -> None:
            body = self.rfile.read(int(self.headers.get("content-length") or 0))
            url = f"http://{self.headers['host']}{self.path}"
            response = service(httpx2.Request(self.command, url, headers=dict(self.headers), content=body))
            self.send_response(response.status_code)
            for name, value in response.headers.items():
                if name.lower() not in ("content-length", "transfer-encoding"):
                    self.send_header(name, value)
            self.send_header("content-length", str(len(response.content)))
            self.end_headers()
            self.wfile.write(response.content)

        do_GET = do_POST = do_DELETE = _answer

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        thread.join()
        server.server_close()

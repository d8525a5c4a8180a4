"""One request: which failures are retried, for how long, and which exception is raised."""

import gzip
import json
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime

import httpx2
import pytest
from httpx2 import ConnectError, UnsupportedProtocol

from grazemap import constants, errors
from grazemap.client.http import pause
from tests.support.sdk_played import Lines, Played


def reply(status: int, kind: str = "urn:x", **headers: str) -> httpx2.Response:
    body = json.dumps({"type": kind, "title": "T", "status": status}).encode()
    return httpx2.Response(
        status, headers={name.replace("_", "-"): value for name, value in headers.items()}, content=body
    )


@pytest.fixture(params=["blocking", "async"])
def play(request):
    """Gives `play(*outcomes)`, one for each request."""

    def played(*outcomes) -> Played:
        left = list(outcomes)
        return Played(request.param, lambda _: left.pop(0))

    return played


def test_broken_connections_and_busy_answers_are_retried(play):
    run = play(ConnectError("refused"), reply(503), reply(429), reply(200))
    assert run.send(5).status_code == 200
    assert len(run.requests) == 4


def test_pauses_grow_and_are_jittered(play):
    seen = []
    for _ in range(100):
        run = play(*[ConnectError("refused")] * 6)
        with pytest.raises(errors.ConnectionFailed):
            run.send(5)
        seen.append(run.slept)
    for attempt in range(5):
        most = constants.BACKOFF_START * 2**attempt
        pauses = [slept[attempt] for slept in seen]
        assert max(pauses) <= most
        assert max(pauses) > 0.8 * most
        assert min(pauses) < 0.2 * most


def test_a_pause_after_any_number_of_attempts_is_finite():
    assert 0.0 <= pause(5000) <= constants.MAX_BACKOFF


def test_retry_after_is_honoured_in_seconds_and_as_a_date(play):
    run = play(reply(429, retry_after="7"), reply(200))
    run.send(1)
    assert 7 <= run.slept[0] <= 7 + constants.BACKOFF_START
    moment = datetime.now(UTC) + timedelta(seconds=20)
    run = play(reply(503, retry_after=format_datetime(moment, usegmt=True)), reply(200))
    run.send(1)
    assert 17 <= run.slept[0] <= 21


def test_a_very_long_retry_after_is_raised_instead_of_waited_for(play):
    run = play(reply(429, retry_after="3600"))
    with pytest.raises(errors.QueueFull) as caught:
        run.send(5)
    assert caught.value.retry_after == 3600
    assert run.slept == []


def test_errors_that_a_retry_cannot_resolve_are_not_retried(play):
    for outcome in (reply(422), reply(500), UnsupportedProtocol("no such scheme")):
        run = play(outcome)
        with pytest.raises(errors.GrazemapError):
            run.send(5)
        assert run.slept == []


@pytest.mark.parametrize("status", [301, 302, 307, 308])
def test_a_redirect_is_reported_with_its_status_and_its_place(play, status):
    with pytest.raises(errors.ProtocolError, match=f"{status}.*https://elsewhere"):
        play(reply(status, location="https://elsewhere/v1")).send(0)


def test_no_attempt_starts_after_the_deadline(play):
    run = play(*[reply(503, retry_after="5")] * 99)
    with pytest.raises(errors.ServiceUnavailable):
        run.send(100, deadline=1012.0)
    assert run.now < 1012.0


@pytest.mark.parametrize(
    ("status", "expected"),
    [
        (400, errors.ParameterError),
        (401, errors.AuthenticationError),
        (403, errors.AuthenticationError),
        (404, errors.NotFound),
        (406, errors.ServiceProblem),
        (409, errors.ServiceProblem),
        (413, errors.ParameterError),
        (422, errors.ParameterError),
        (429, errors.QueueFull),
        (500, errors.ServerError),
        (503, errors.ServiceUnavailable),
    ],
)
def test_each_problem_has_its_exception(play, status, expected):
    with pytest.raises(errors.ServiceProblem) as caught:
        play(reply(status, x_request_id="abc")).send(0)
    assert type(caught.value) is expected
    assert (caught.value.status, caught.value.request_id) == (status, "abc")


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        ("unfinished-job", errors.ResultNotReady),
        ("dismissed-job", errors.ServiceProblem),
        ("outdated-job", errors.ServiceProblem),
    ],
)
def test_only_an_unfinished_job_is_to_be_waited_for(play, kind, expected):
    with pytest.raises(errors.ServiceProblem) as caught:
        play(reply(409, f"urn:grazemap:problem:{kind}")).send(0)
    assert type(caught.value) is expected


@pytest.mark.parametrize("content", [b"<html>Bad gateway</html>", b"", b'{"error": 1}', b"\xff\xfe"])
def test_an_error_answer_of_another_server_is_an_exception_of_its_status(play, content):
    with pytest.raises(errors.ServiceUnavailable, match="502"):
        play(httpx2.Response(502, content=content)).send(0)


def test_the_status_line_decides_not_the_body(play):
    body = json.dumps({"type": "urn:x", "title": "T", "status": 200}).encode()
    with pytest.raises(errors.NotFound):
        play(httpx2.Response(404, content=body)).send(0)


def endless():
    """The lines of an endless body, 10 kB each."""
    for k in range(1000):
        assert k < 250, "it reads on"
        yield "x" * 9999


@pytest.mark.parametrize("status", [200, 404, 503])
def test_an_endless_answer_is_not_read_to_its_end(play, monkeypatch, status):
    monkeypatch.setattr(constants, "MAX_ANSWER_BYTES", 1 << 20)
    with pytest.raises(errors.ProtocolError, match="longer than 1048576 bytes"):
        play(httpx2.Response(status, stream=Lines(endless(), lambda: None))).send(5)


class Once(httpx2.SyncByteStream, httpx2.AsyncByteStream):
    """A body in one piece, which is not read before it is asked for."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def __iter__(self):
        yield self._content

    async def __aiter__(self):
        yield self._content


def test_a_compressed_answer_is_measured_by_what_it_holds(play, monkeypatch):
    monkeypatch.setattr(constants, "MAX_ANSWER_BYTES", 1 << 20)
    headers = {"content-encoding": "gzip", "content-type": "application/json"}
    for size, fits in ((1 << 19, True), (1 << 21, False)):
        run = play(httpx2.Response(200, headers=headers, stream=Once(gzip.compress(bytes(size)))))
        if fits:
            assert run.send(0).content == bytes(size)
        else:
            with pytest.raises(errors.ProtocolError):
                run.send(0)

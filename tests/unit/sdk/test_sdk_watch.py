"""Following a job until it is finished, with a clock and a network of the test."""

import json

import httpx2
import pytest
from httpx2 import ReadError

from grazemap import constants, errors
from grazemap.client.blocking import iterate
from grazemap.client.connection import lines_of
from grazemap.client.events import EventDecoder
from grazemap.wire import Job
from tests.support.sdk_played import Lines, Played

STREAM = {"content-type": "text/event-stream"}


class Service:
    """Streams are lists of lines; an exception in them breaks the connection, a number lets that many seconds pass."""

    def __init__(self, kind: str, *streams: list, finished_after: float = float("inf"), status: str = "successful"):
        self.streams = list(streams)
        self.finished_after = finished_after
        self.status = status
        self.opened: list[httpx2.Request] = []
        self.done = False
        self.waiting_for: str | None = None
        self.closed = 0
        self.script = Played(kind, self)

    def __call__(self, request):
        if not request.url.path.endswith("/events"):
            finished = self.done or self.script.now >= 1000 + self.finished_after
            job = {"id": "j", "process": "p", "request": {}, "status": self.status if finished else "running"}
            job["waiting_for"] = self.waiting_for if self.script.now < 1010 else None
            return httpx2.Response(200, json=job)
        self.opened.append(request)
        if not self.streams:
            return httpx2.Response(404)
        return httpx2.Response(200, headers=STREAM, stream=Lines(self.lines(self.streams.pop(0)), self.close))

    def lines(self, stream):
        for line in stream:
            if isinstance(line, Exception):
                raise line
            if isinstance(line, float):
                self.script.now += line
                continue
            if "successful" in line:
                self.done = True
            yield line

    def close(self):
        self.closed += 1

    def follow(self, timeout=None, **keywords):
        return self.script.follow("/v1/jobs/j", timeout, **keywords)

    @property
    def names(self):
        return [event.name for event in self.script.events]


@pytest.fixture(params=["blocking", "async"])
def play(request):
    """Gives `play(*streams, ...)`: a service that is followed by one of the clients."""
    return lambda *streams, **keywords: Service(request.param, *streams, **keywords)


def event(number: int, name: str = "progress", **data) -> list[str]:
    return [f"id: {number}-0", f"event: {name}", f"data: {json.dumps(data or {'done': number, 'total': 9})}", ""]


END = event(9, "done", status="successful")


def test_events_are_yielded_until_done(play):
    service = play([": ping", "", *event(1), *event(2, "tile", index=0), *END])
    assert service.follow().status == "successful"
    assert service.names == ["progress", "tile", "done"]
    assert service.script.events[1].data == {"index": 0}


def test_a_finished_job_repeats_its_events_on_request(play):
    service = play([*event(1), ReadError("reset")], [*event(2, "tile", index=0), *END], finished_after=0)
    assert service.follow(replay=True).status == "successful"
    assert service.names == ["progress", "tile", "done"]
    assert [opened.headers.get("last-event-id") for opened in service.opened] == [None, "1-0"]


@pytest.mark.parametrize("status", ["successful", "failed"])
def test_waiting_for_a_finished_job_opens_no_stream(play, status):
    service = play([*event(1), *END], finished_after=0, status=status)
    assert service.follow().status == status
    assert service.opened == []
    assert service.script.events[-1].data == {"status": status}


@pytest.mark.parametrize("streams", [[], [[]] * 9, [event(1)] + [[]] * 9])
def test_a_finished_job_whose_stream_is_gone_still_ends_with_done(play, streams):
    service = play(*streams, finished_after=0)
    service.follow(replay=True)
    assert service.names[-2:] == ["progress", "done"]
    assert service.names.count("done") == 1
    assert len(service.opened) <= 1 + constants.STREAM_ATTEMPTS


def test_every_stream_is_closed_even_if_the_caller_raises(play):
    service = play([*event(1), ReadError("reset")], event(2), [*event(3), *END])
    service.follow()
    assert service.closed == 3
    stopped = play([*event(1), *event(2), *END])
    stopped.script.listen = lambda event: 1 / 0
    with pytest.raises(ZeroDivisionError):
        stopped.follow()
    assert stopped.closed == 1


def test_a_broken_stream_is_resumed_where_it_ended(play):
    service = play([*event(1), *event(2)[:2], ReadError("reset")], [*event(2), *END])
    service.follow()
    assert [opened.headers.get("last-event-id") for opened in service.opened] == [None, "1-0"]
    assert [event.id for event in service.script.events] == ["1-0", "2-0", "9-0"]


def test_an_event_that_is_not_json_breaks_only_the_stream(play):
    service = play(["event: progress", "data: " + "[" * 100_000, ""], [*event(2), *END])
    assert service.follow().status == "successful"
    assert service.names == ["progress", "done"]


def repeated(text: str):
    """An endless stream, which fails when much of it is read."""
    for k in range(1000):
        assert k < 30, "it reads on"
        yield text


def test_an_endless_event_breaks_only_the_stream(play):
    run = play(repeated("data: " + "x" * 100_000), finished_after=5)
    run.follow()
    assert run.names[-1] == "done"


def test_an_endless_line_is_not_read_to_its_end():
    async def parts():
        for part in repeated("x" * 100_000):
            yield part.encode()

    with pytest.raises(errors.ProtocolError, match="a line is longer"):
        list(iterate(lines_of(httpx2.Response(200, content=parts()))))


def test_a_stream_that_ends_early_is_opened_again(play):
    service = play(event(1), event(2), event(3), event(4), [*event(5), *END])
    service.follow()
    assert len(service.opened) == 5
    assert service.names == ["progress"] * 5 + ["done"]


@pytest.mark.parametrize("streams", [(), ([],) * 9, ([ReadError("reset")],) * 9, (["data: {not json", ""],) * 9])
def test_without_a_working_stream_it_polls(play, streams):
    service = play(*streams, finished_after=30.0)
    assert service.follow().status == "successful"
    assert len(service.opened) == constants.STREAM_ATTEMPTS
    assert service.names[-1] == "done"
    assert max(service.script.slept) <= constants.MAX_POLL_INTERVAL
    assert service.script.now <= 1030 + constants.MAX_POLL_INTERVAL


def test_polling_yields_what_the_job_waits_for(play):
    service = play(finished_after=30.0)
    service.waiting_for = "a worker"
    service.follow()
    waiting = [event.data for event in service.script.events if event.name == "waiting"]
    assert waiting == [{"waiting_for": "a worker"}, {"waiting_for": None}]


def waiting(text: str | None) -> list[str]:
    return ["event: waiting", f"data: {json.dumps({'waiting_for': text})}", ""]


@pytest.mark.parametrize("later", [([*event(2), *END],), ([],) * 9], ids=["streams", "polling"])
def test_a_wait_that_ends_while_no_stream_is_open_is_said_to_end(play, later):
    # a stream says nothing of a job that is computed
    service = play([*event(1), *waiting("a worker"), ReadError("reset")], *later, finished_after=30.0)
    service.follow()
    reasons = [event.data["waiting_for"] for event in service.script.events if event.name == "waiting"]
    assert reasons == ["a worker", None]
    assert service.names[-1] == "done"


@pytest.mark.parametrize("timeout", [0.0, 0.5, 20.0, 100.0])
def test_the_timeout_holds_even_if_the_service_sends_only_keep_alive_comments(play, timeout):
    # the stream's comments would keep a plain read waiting for ever
    service = play(*[[15.0, ": ping"] * 100] * 9)
    with pytest.raises(errors.WaitTimeout) as caught:
        service.follow(timeout)
    assert caught.value.job.status == "running"
    assert isinstance(caught.value, TimeoutError)
    assert service.script.now == pytest.approx(1000 + timeout)


def test_a_wait_for_a_service_that_hangs_ends_at_its_timeout(play):
    """Its answers come late or never, so that each attempt lasts as long as the client waits for one."""
    service = play()
    job = Job(id="j", process="p", request={}, status="running")

    def hangs(request):
        service.script.now += request.extensions["timeout"]["read"]
        return httpx2.ReadTimeout("nothing", request=request)

    service.script._answer = hangs
    with pytest.raises(errors.WaitTimeout) as caught:
        service.follow(3.0, job=job, stale=True)
    assert caught.value.job == job
    assert service.script.now == pytest.approx(1003.0)
    # without a state of the job it is not known whether there is one
    with pytest.raises(errors.ConnectionFailed):
        service.follow(3.0)


def test_with_a_long_timeout_the_stream_is_followed_and_not_polled(play):
    service = play([*event(1), *([15.0, ": ping"] * 30), *END])
    service.follow(3600.0)
    assert len(service.opened) == 1
    assert service.script.slept == []


def test_the_end_of_an_earlier_computation_is_not_the_end_of_this_one(play):
    failed_before = event(1, "done", status="failed")
    service = play(failed_before, [*event(2), *END])
    assert service.follow().status == "successful"
    assert service.opened[1].headers["last-event-id"] == "1-0"


def decode(text: str) -> list:
    decoder = EventDecoder()
    return [message for line in text.split("\n") if (message := decoder.feed(line)) is not None]


def test_the_decoder_follows_the_standard():
    text = 'id: 1\nevent: a\ndata: {"x":\ndata:1}\nretry: 5\nnonsense\n\n'
    text += ": comment\n\nevent: empty\n\ndata: {}\n\nid:\ndata: {}\n\n"
    first, second, third = decode(text)
    assert (first.id, first.name, first.data) == ("1", "a", {"x": 1})
    assert (second.id, second.name) == ("1", "message")
    assert third.id == ""


@pytest.mark.parametrize("data", ["{", "3", "[]", "null"])
def test_data_that_are_no_object_are_refused(data):
    with pytest.raises(errors.ProtocolError):
        decode(f"data: {data}\n\n")

"""Following a job, on a clock and a network that are played."""

import json

import pytest
from sdk_script import Script

from grazemap import constants, errors
from grazemap.client.event_stream import EventDecoder
from grazemap.client.io_effects import LinkBroken, NextLine, OpenStream, Reply, Send
from grazemap.client.watch import follow

STREAM = {"content-type": "text/event-stream"}


class Service:
    """Streams are lists of lines; an exception in them breaks the connection, a number lets that many seconds pass."""

    def __init__(self, *streams: list, finished_after: float = float("inf"), status: str = "successful"):
        self.streams = list(streams)
        self.finished_after = finished_after
        self.status = status
        self.opened: list[OpenStream] = []
        self.lines: list = []
        self.done = False
        self.script = Script(self)

    def __call__(self, effect):
        match effect:
            case Send():
                finished = self.done or self.script.now >= 1000 + self.finished_after
                job = {"id": "j", "process": "p", "request": {}, "status": self.status if finished else "running"}
                return Reply(200, {}, json.dumps(job).encode())
            case OpenStream():
                self.opened.append(effect)
                if not self.streams:
                    return Reply(404, {}, b"")
                self.lines = list(self.streams.pop(0))
                return Reply(200, STREAM)
            case NextLine():
                line = self.lines.pop(0) if self.lines else None
                while isinstance(line, float):
                    self.script.now += line
                    line = self.lines.pop(0)
                if isinstance(line, str) and "successful" in line:
                    self.done = True
                return line

    def follow(self, timeout=None, **keywords):
        return self.script.run(follow("/v1/jobs/j", 5, timeout, **keywords))

    @property
    def names(self):
        return [event.name for event in self.script.events]


def event(number: int, name: str = "progress", **data) -> list[str]:
    return [f"id: {number}-0", f"event: {name}", f"data: {json.dumps(data or {'done': number, 'total': 9})}", ""]


END = event(9, "done", status="successful")


def test_events_are_handed_on_until_done():
    service = Service([": ping", "", *event(1), *event(2, "tile", index=0), *END])
    assert service.follow().status == "successful"
    assert service.names == ["progress", "tile", "done"]
    assert service.script.events[1].data == {"index": 0}


def test_a_finished_job_tells_its_events_again_when_asked_to():
    service = Service([*event(1), LinkBroken("reset")], [*event(2, "tile", index=0), *END], finished_after=0)
    assert service.follow(replay=True).status == "successful"
    assert service.names == ["progress", "tile", "done"]
    assert [opened.headers.get("last-event-id") for opened in service.opened] == [None, "1-0"]


def test_waiting_for_a_finished_job_opens_no_stream():
    service = Service([*event(1), *END], finished_after=0)
    assert service.follow().status == "successful"
    assert service.opened == []


@pytest.mark.parametrize("streams", [[], [[]] * 9, [event(1)] + [[]] * 9])
def test_a_finished_job_whose_stream_is_gone_still_ends_with_done(streams):
    service = Service(*streams, finished_after=0)
    service.follow(replay=True)
    assert service.names[-2:] == ["progress", "done"]
    assert service.names.count("done") == 1
    assert len(service.opened) <= 1 + constants.STREAM_ATTEMPTS


def test_a_broken_stream_is_taken_up_where_it_ended():
    service = Service([*event(1), *event(2)[:2], LinkBroken("reset")], [*event(2), *END])
    service.follow()
    assert [opened.headers.get("last-event-id") for opened in service.opened] == [None, "1-0"]
    assert [event.id for event in service.script.events] == ["1-0", "2-0", "9-0"]


def test_an_event_that_is_no_json_breaks_the_stream_only():
    service = Service(["event: progress", "data: " + "[" * 100_000, ""], [*event(2), *END])
    assert service.follow().status == "successful"
    assert service.names == ["progress", "done"]


def test_a_stream_that_ends_early_is_opened_again():
    service = Service(event(1), event(2), event(3), event(4), [*event(5), *END])
    service.follow()
    assert len(service.opened) == 5
    assert service.names == ["progress"] * 5 + ["done"]


@pytest.mark.parametrize("streams", [(), ([],) * 9, ([LinkBroken("reset")],) * 9, (["data: {not json", ""],) * 9])
def test_without_a_working_stream_it_polls(streams):
    service = Service(*streams, finished_after=30.0)
    assert service.follow().status == "successful"
    assert len(service.opened) == constants.STREAM_ATTEMPTS
    assert service.names[-1] == "done"
    assert max(service.script.slept) <= constants.POLL_LIMIT
    assert service.script.now <= 1030 + constants.POLL_LIMIT


def test_an_already_finished_job_opens_no_stream():
    service = Service(finished_after=0.0, status="failed")
    assert service.follow().status == "failed"
    assert service.opened == []
    assert service.script.events[-1].data == {"status": "failed"}


@pytest.mark.parametrize("timeout", [0.0, 0.5, 20.0, 100.0])
def test_the_time_to_wait_is_kept_although_the_service_only_says_it_is_alive(timeout):
    # the stream's comments would keep a plain read waiting for ever
    service = Service(*[[15.0, ": ping"] * 100] * 9)
    with pytest.raises(errors.WaitTimeout) as caught:
        service.follow(timeout)
    assert caught.value.job.status == "running"
    assert isinstance(caught.value, TimeoutError)
    assert service.script.now == pytest.approx(1000 + timeout)


def test_plenty_of_time_is_spent_on_the_stream_not_on_polling():
    service = Service([*event(1), *([15.0, ": ping"] * 30), *END])
    service.follow(3600.0)
    assert len(service.opened) == 1
    assert service.script.slept == []


def test_the_end_of_an_earlier_computation_is_not_the_end_of_this_one():
    failed_before = event(1, "done", status="failed")
    service = Service(failed_before, [*event(2), *END])
    assert service.follow().status == "successful"
    assert service.opened[1].headers["last-event-id"] == "1-0"


def decode(text: str) -> list:
    decoder = EventDecoder()
    return [found for line in text.split("\n") if (found := decoder.feed(line)) is not None]


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

"""`client.map`: many requests in one, results in the order of the requests, whatever happens on the way."""

from __future__ import annotations

import asyncio
import contextlib
import json

import httpx2
import pytest

import grazemap
from grazemap import constants, errors
from grazemap.client import messages
from grazemap.wire import TrajectoriesRequest
from tests.support.sdk_documents import npz
from tests.support.sdk_fake_service import problem

CURVES = [{"omega": {"start": 0.2, "stop": 0.3, "points": 3 + k}} for k in range(5)]
TRAJECTORY = TrajectoriesRequest(omega=0.29, clearance=1.6, periods=2, samples_per_period=2)


def asked_in(request):
    return [entry["request"]["axis"]["values"]["points"] for entry in json.loads(request.content)["requests"]]


def test_results_have_the_order_of_the_requests(client, service):
    results = list(client.map([("grazing-curves", CURVES[0]), TRAJECTORY, ("grazing-curves", CURVES[1])]))
    assert [result.process for result in results] == ["grazing-curves", "trajectories", "grazing-curves"]
    assert [request.url.path for request in service.requests] == ["/v1/batches"]
    assert len(list(client.map("grazing-curves", CURVES))) == 5
    assert len(service.requests) == 2
    assert list(client.map([])) == []
    assert len(service.requests) == 2


def test_many_requests_are_several_batches(client, service, monkeypatch):
    monkeypatch.setattr(messages, "MAX_BATCH_REQUESTS", 2)
    assert len(list(client.map("grazing-curves", CURVES))) == 5
    assert [asked_in(request) for request in service.requests] == [[3, 4], [5, 6], [7]]


def test_after_a_broken_answer_only_the_rest_is_asked_for(client, service):
    service.most_lines = 2
    assert len(list(client.map("grazing-curves", CURVES))) == 5
    assert [asked_in(request) for request in service.requests] == [[3, 4, 5, 6, 7], [3, 4, 5], [3]]
    assert service.computed == 5


@pytest.mark.parametrize("trouble", [lambda: problem(503), lambda: httpx2.ConnectError("no")])
def test_a_service_that_is_away_for_a_moment_is_asked_again(client, service, trouble):
    service.upcoming = [trouble(), trouble()]
    assert len(list(client.map("grazing-curves", CURVES))) == 5
    service.upcoming = [trouble() for _ in range(constants.DEFAULT_RETRIES + 1)]
    with pytest.raises((errors.ServiceUnavailable, errors.ConnectionFailed)):
        list(client.map("grazing-curves", CURVES))
    assert not service.upcoming


def test_what_the_queue_does_not_take_at_once_is_asked_for_again(client, service):
    full = {"type": "urn:grazemap:problem:queue-full", "title": "Queue full", "status": 429, "detail": "wait"}
    service.upcoming = [httpx2.Response(200, content=json.dumps({"index": 0, "problem": full}) + "\n")]
    assert len(list(client.map("grazing-curves", CURVES[:1]))) == 1
    assert len(service.requests) == 2


def test_failures_are_raised_or_given_in_place_of_results(client, service):
    service.ending = "failed"
    with pytest.raises(errors.JobFailed, match="tile 3"):
        list(client.map("grazing-curves", CURVES))
    outcomes = list(client.map("grazing-curves", CURVES, return_exceptions=True))
    assert [type(outcome) for outcome in outcomes] == [errors.JobFailed] * 5
    service.ending = "dismissed"
    with pytest.raises(errors.JobDismissed):
        list(client.map("grazing-curves", CURVES))


def test_invalid_requests_are_found_before_anything_is_sent(client, service):
    with pytest.raises(errors.ParameterError, match="/requests/1/request/omega"):
        list(client.map("grazing-curves", [CURVES[0], {"omega": [-1.0]}]))
    with pytest.raises(errors.ParameterError, match="/requests/1/request: this is no request"):
        list(client.map([("grazing-curves", CURVES[0]), CURVES[1]]))
    assert service.requests == []


def test_invalid_requests_are_found_at_the_call_with_and_without_a_service(client):
    with grazemap.direct() as direct:
        for computes in (client, direct):
            with pytest.raises(errors.ParameterError, match="/requests/1/request"):
                computes.map("grazing-curves", [CURVES[0], {"omega": [2, 1]}])


def test_an_error_that_the_service_finds_has_the_place_among_all_requests(client, service, monkeypatch):
    monkeypatch.setattr(messages, "MAX_BATCH_REQUESTS", 2)
    refused = {"pointer": "/requests/1/request/omega/points", "detail": "too many", "allowed": "fewer"}
    body = {"type": "about:blank", "title": "t", "status": 422, "detail": "d", "errors": [refused]}
    service.upcoming = [
        service._batch([{"process": "grazing-curves", "request": request} for request in CURVES[:2]]),
        httpx2.Response(422, json=body, headers={"content-type": "application/problem+json"}),
    ]
    with pytest.raises(errors.ParameterError, match="/requests/3/request/omega/points"):
        list(client.map("grazing-curves", CURVES))


def test_a_note_on_many_requests_is_one_warning(client, service):
    with pytest.warns(errors.RequestWarning, match="5 requests have this note") as warned:
        list(client.map("grazing-curves", [{"omega": [0.2, 0.3 + 0.01 * k]} for k in range(5)]))
    assert len(warned) == 1


def test_notes_are_made_for_a_batch_at_a_time_and_not_by_the_event_loop(client, service, monkeypatch):
    monkeypatch.setattr(messages, "MAX_BATCH_REQUESTS", 2)
    made: list[int] = []
    threads: set[bool] = set()
    notes_on = messages.notes_on

    def watched(request):
        made.append(len(service.requests))
        with contextlib.suppress(RuntimeError):
            threads.add(asyncio.get_running_loop() is not None)
        return notes_on(request)

    monkeypatch.setattr(messages, "notes_on", watched)
    list(client.map("grazing-curves", CURVES))
    assert made == [0, 0, 1, 1, 2]
    assert not threads


def test_a_large_result_is_fetched(client, service):
    handle = client.submit("grazing-curves", CURVES[0]).wait()
    line = {"index": 0, "id": handle.id, "status": "successful", "href": f"/v1/jobs/{handle.id}/result"}
    service.upcoming = [httpx2.Response(200, content=json.dumps(line) + "\n")]
    (result,) = client.map("grazing-curves", CURVES[:1])
    assert result.clearance[0] == 1.5
    assert service.requests[-1].url.path.endswith("/result")


@pytest.mark.parametrize(
    "line",
    [
        {"index": 1, "id": "a" * 64, "status": "successful"},
        {"index": "0", "id": "a" * 64},
        {"id": "a" * 64},
        {"index": 0},
        {"index": 0, "problem": 7},
        {"index": 0, "id": "a" * 64, "status": "successful", "npz": "!"},
        {"index": 0, "id": "a" * 64, "status": "successful", "npz": "UEsDBA=="},
        [],
    ],
)
def test_a_line_that_makes_no_sense_is_reported(client, service, line):
    service.upcoming = [httpx2.Response(200, content=json.dumps(line) + "\n")]
    with pytest.raises(errors.ProtocolError):
        list(client.map("grazing-curves", CURVES[:1]))


def test_an_endless_line_is_not_read_to_its_end(client, service):
    service.upcoming = [httpx2.Response(200, content=b"1" * (2 * constants.MAX_LINE_BYTES))]
    with pytest.raises(errors.ProtocolError, match="too long"):
        list(client.map("grazing-curves", CURVES[:1]))


def test_the_result_may_come_as_the_answer_to_the_question(client, service):
    headers = {"content-type": "application/x-npz"}
    service.upcoming = [httpx2.Response(200, content=npz("grazing-curves"), headers=headers)]
    assert client.grazing_curve(omega=(0.2, 0.3), points=3, progress=False).clearance[0] == 1.5
    (request,) = service.requests
    assert request.headers["prefer"] == "wait=1, return=representation"


def test_an_impatient_client_does_not_ask_the_service_to_wait(make_client, service):
    service.upcoming = [
        httpx2.Response(200, content=npz("grazing-curves"), headers={"content-type": "application/x-npz"})
    ]
    make_client(timeout=0.5).grazing_curve(omega=(0.2, 0.3), points=3, progress=False)
    assert service.requests[0].headers["prefer"].startswith("wait=0,")

"""The blocking and the asynchronous client with a service."""

import json
import math

import httpx2
import numpy as np
import pytest

from grazemap import Client, errors
from grazemap.client.process_methods import METHODS
from grazemap.results import State
from grazemap.wire import PROCESSES, InitialState, parse_request
from tests.support.sdk_documents import REQUESTS, npz
from tests.support.sdk_fake_service import problem

CURVE = REQUESTS["grazing-curves"]


def test_each_process_has_its_method(client, service):
    for name, method in METHODS.items():
        shape = {"shape": None} if name == "unfolding_diagram" else {}  # the ranges have their points
        result = getattr(client, name)(**REQUESTS[method.process], **shape, progress=False)
        assert result.process == method.process
    asked = {job["process"]: parse_request(job["process"], job["request"]).canonical() for job in service.jobs.values()}
    assert asked == {process: parse_request(process, REQUESTS[process]).canonical() for process in PROCESSES}


@pytest.mark.parametrize("choice", ["adaptive", "preview"])
def test_an_adaptive_map_or_a_preview_is_another_request(client, service, choice):
    for keywords in ({}, {choice: True}):
        client.unfolding_map(**REQUESTS["unfolding-maps"], **keywords, progress=False)
    assert [job["request"].get(choice) for job in service.jobs.values()] == [None, True]


def test_a_list_of_states_gives_a_list_of_trajectories(client, service):
    states = [{}, InitialState(phase=1.0), State(np.zeros(3), np.array([0.0, 0.0, 0.5]), 0.0)]
    keywords = {"omega": 0.29, "clearance": 1.6, "periods": 2, "times": np.array([0.0, 10.0]), "progress": False}
    result = client.trajectory(initial=states, **keywords)
    assert [path.final is None for path in result.trajectories] == [False, False, True]
    asked = json.loads(next(r for r in service.requests if r.method == "POST").content)
    assert [state["phase"] for state in asked["initial"]] == [0.0, 1.0, 0.0]
    assert asked["initial"][2]["velocity"] == [0.0, 0.0, 0.5]
    assert asked["times"] == [0.0, 10.0]
    assert "samples_per_period" not in asked
    # the end of one is the start of the next
    continued = client.trajectory(initial=result.trajectories[0].final, **keywords)
    assert continued.motion.label == "1-1r-1l"
    assert service.computed == 2


def test_fields_of_ensembles_are_accepted_and_ignored_with_other_policies(client, service):
    for keywords in ({}, {"initial_conditions": 4, "seed": 3}):
        client.unfolding_map(omega=(0.2, 0.3), clearance=(1.5, 1.6), shape=(2, 3), progress=False, **keywords)
    assert service.computed == 1
    with pytest.raises(errors.ParameterError, match="/seed"):
        client.unfolding_map(omega=(0.2, 0.3), clearance=(1.5, 1.6), shape=(2, 3), seed=-1)


def test_making_a_client_sends_nothing(client, service):
    assert service.requests == []
    assert client.base_url == "http://fake:1"


def test_the_same_request_is_the_same_job(client, service):
    first = client.submit("grazing-curves", CURVE)
    second = client.submit("grazing-curves", {"max_order": 8, **CURVE, "oscillator": {}})
    assert first.id == second.id
    assert service.computed == 1


def test_a_job_has_its_status_waits_and_returns_its_result(client, service):
    handle = client.submit("grazing-curves", CURVE)
    assert (handle.status, handle.process, handle.progress.total) == ("running", "grazing-curves", 2)
    with pytest.raises(errors.ResultNotReady):
        handle.result()
    assert handle.wait(timeout=60).status == "successful"
    assert handle.result().clearance[0] == 1.5
    assert client.job(handle.id).status == "successful"


def test_events_come_as_they_are_and_end_with_done(client):
    handle = client.submit("unfolding-maps", REQUESTS["unfolding-maps"])
    events = list(handle.events())
    assert [event.name for event in events] == ["progress", "tile", "progress", "done"]
    assert events[1].data == {"index": 0, "rows": [0, 1]}
    assert handle.status == "successful"
    # and a finished job tells them again
    assert list(client.job(handle.id).events()) == events


def test_a_cancelled_job_is_dismissed_and_waiting_for_it_raises_job_dismissed(client):
    handle = client.submit("grazing-curves", CURVE).cancel()
    assert handle.status == "dismissed"
    for call in (handle.wait, handle.result):
        with pytest.raises(errors.JobDismissed) as caught:
            call()
        assert caught.value.job.id == handle.id


def test_a_job_that_others_asked_for_too_is_said_to_go_on(client, service):
    handle = client.submit("grazing-curves", CURVE)
    service.shared = True
    with pytest.warns(errors.RequestWarning, match="goes on"):
        handle.cancel()
    assert handle.status == "running"


@pytest.mark.parametrize("ending", ["failed", "dismissed"])
def test_a_handle_has_the_state_with_which_waiting_or_fetching_failed(client, service, ending):
    waiting, fetching = (client.submit("grazing-curves", CURVE | {"omega": [0.1, 0.2, k]}) for k in (0.3, 0.4))
    service.ending = ending
    with pytest.raises(errors.JobError):
        waiting.wait()
    service.finish(service.jobs[fetching.id])
    with pytest.raises(errors.JobError):
        fetching.result()
    assert [waiting.status, fetching.status] == [ending, ending]


def test_a_handle_has_the_last_state_after_a_wait_that_ended_early_and_after_its_events(client, service, monkeypatch):
    handle = client.submit("grazing-curves", CURVE)
    service.jobs[handle.id]["progress"]["done"] = 1
    with pytest.raises(errors.WaitTimeout):
        handle.wait(timeout=0.0)
    assert handle.progress.done == 1

    def interrupted(job):
        raise RuntimeError

    other = client.submit("grazing-curves", CURVE | {"omega": [0.1, 0.2, 0.3]})
    service.jobs[other.id]["progress"]["done"] = 1
    monkeypatch.setattr(service, "_events", interrupted)
    for call in (other.wait, lambda: list(other.events())):
        service.jobs[other.id]["progress"]["done"] += 1
        with pytest.raises(RuntimeError):
            call()
        assert other.progress.done == service.jobs[other.id]["progress"]["done"]


def test_a_failed_job_raises_with_its_problem(client, service):
    service.ending = "failed"
    with pytest.raises(errors.JobFailed, match="tile 3") as caught:
        client.grazing_curve(omega=(0.2, 0.3), points=3, progress=False)
    assert caught.value.problem.title == "Tile failed"
    with pytest.raises(errors.JobFailed):
        client.job(caught.value.job.id).result()


def test_jobs_are_listed_over_pages_from_the_address_given(client, service):
    for points in range(2, 9):
        client.submit("grazing-curves", {"omega": {"start": 0.1, "stop": 0.2, "points": points}})
    assert len(client.jobs()) == 7
    assert len(client.jobs(limit=3)) == 3
    assert {request.url.host for request in service.requests} == {"fake"}


def test_an_unknown_job_is_not_found(client):
    with pytest.raises(errors.NotFound):
        client.job("0" * 64)


@pytest.mark.parametrize("name", ["../../../etc/passwd", "a/b", "x/../y", "", "a" * 200, None, 5])
def test_an_impossible_job_id_is_neither_sent_nor_written(client, service, name):
    with pytest.raises(errors.NotFound) as caught:
        client.job(name)
    assert caught.value.status == 404
    assert service.requests == []


def test_an_answer_with_an_impossible_job_id_is_reported(client, service):
    job = {"id": "../x", "process": "grazing-curves", "request": {}, "status": "running"}
    service.upcoming = [httpx2.Response(201, json=job)]
    with pytest.raises(errors.ProtocolError):
        client.submit("grazing-curves", CURVE)


def test_after_connection_errors_nothing_is_computed_twice(client, service):
    service.upcoming = [httpx2.ConnectError("refused"), httpx2.ReadTimeout("slow"), problem(503), problem(429)]
    client.grazing_curve(omega=(0.2, 0.3), points=3, progress=False)
    assert service.computed == 1


def test_no_service_is_a_connection_error(make_client, service):
    service.upcoming = [httpx2.ConnectError("refused")] * 3
    with pytest.raises(errors.ConnectionFailed, match="refused"):
        make_client(retries=2).jobs()
    assert service.upcoming == []


def test_invalid_requests_are_not_sent(client, service):
    with pytest.raises(errors.ParameterError):
        client.trajectory(omega=0.3, clearance=-1.0, periods=2)
    assert service.requests == []


def test_the_key_is_sent_and_a_wrong_one_is_reported(make_client, service):
    service.upcoming = [problem(401, "key-required")]
    with pytest.raises(errors.AuthenticationError):
        make_client(api_key="secret").describe()
    assert service.requests[0].headers["authorization"] == "Bearer secret"


def test_an_evicted_result_is_computed_again_and_waited_for(client, service):
    handle = client.submit("grazing-curves", CURVE).wait()
    service.results.clear()
    assert handle.result().clearance[0] == 1.5
    assert service.computed == 2


def test_a_cached_result_is_used_when_its_tag_is_confirmed(make_client, service, tmp_path):
    client = make_client(cache_dir=tmp_path / "cache")
    handle = client.submit("grazing-curves", CURVE).wait()
    first = handle.result()
    again = make_client(cache_dir=tmp_path / "cache").job(handle.id).result()
    np.testing.assert_array_equal(first.clearance, again.clearance)
    assert service.requests[-1].headers["if-none-match"] == f'"{handle.id[:8]}-npz"'
    # a damaged file counts as absent
    (path,) = (tmp_path / "cache").iterdir()
    path.write_bytes(path.read_bytes()[:-1] + b"\1")
    assert client.job(handle.id).result().clearance[0] == 1.5
    assert "if-none-match" not in service.requests[-1].headers


def test_a_method_uses_the_cache_where_its_job_is_finished(make_client, service, tmp_path):
    for _ in range(2):
        client = make_client(cache_dir=tmp_path / "cache")
        assert client.grazing_curve(omega=(0.2, 0.3), points=3, progress=False).clearance[0] == 1.5
    *_, asked, fetched = service.requests
    assert asked.method == "POST"
    assert "representation" not in asked.headers["prefer"]
    assert "if-none-match" in fetched.headers
    assert service.computed == 1


def test_a_cache_that_cannot_be_used_costs_no_result(make_client, service, tmp_path, caplog):
    (tmp_path / "file").write_text("in the way")
    client = make_client(cache_dir=tmp_path / "file" / "cache")
    assert client.grazing_curve(omega=(0.2, 0.3), points=3, progress=False).clearance[0] == 1.5
    assert "is not kept" in caplog.text
    folder = tmp_path / "cache"
    handle = client.submit("grazing-curves", CURVE)
    (folder / f"{handle.id}.result").mkdir(parents=True)
    assert make_client(cache_dir=folder).job(handle.id).result().clearance[0] == 1.5


def test_a_result_of_another_tag_replaces_the_cached_one(make_client, service, tmp_path):
    client = make_client(cache_dir=tmp_path)
    handle = client.submit("grazing-curves", CURVE).wait()
    handle.result()
    changed = npz("grazing-curves", {"clearance": np.array([7.0, 8.0, 9.0])})
    for _ in range(2):
        service.upcoming = [httpx2.Response(200, content=changed, headers={"etag": '"new"'})]
        assert handle.result().clearance[0] == 7.0
    assert service.requests[-1].headers["if-none-match"] == '"new"'
    assert len(list(tmp_path.iterdir())) == 1


@pytest.mark.parametrize(
    "answer",
    [
        {"content": b"[" * 100_000},
        {"text": "<html>of another server</html>"},
        {"stream": httpx2.ByteStream(b"not gzip"), "headers": {"content-encoding": "gzip"}},
    ],
)
def test_an_answer_that_makes_no_sense_is_reported(client, service, answer):
    service.upcoming = [httpx2.Response(200, **answer)]
    with pytest.raises(errors.ProtocolError):
        client.jobs()


def test_without_a_decodable_event_stream_the_job_is_polled(client, service):
    handle = client.submit("grazing-curves", CURVE)
    follow = service.__class__._events
    broken = {"content-encoding": "gzip", "content-type": "text/event-stream"}

    def undecodable(job):
        follow(service, job)
        return httpx2.Response(200, stream=httpx2.ByteStream(b"not gzip"), headers=broken)

    service._events = undecodable
    assert handle.wait().status == "successful"


@pytest.mark.parametrize("content", [b"", b"not a result", b"PK\x03\x04"])
def test_a_broken_result_is_reported(client, service, content):
    handle = client.submit("grazing-curves", CURVE).wait()
    service.results[handle.id] = content
    with pytest.raises(errors.ResultFormatError):
        handle.result()


@pytest.mark.parametrize(
    "keywords",
    [
        {"base_url": "localhost:8000"},
        {"base_url": "ftp://x"},
        {"base_url": "http://u:p@x"},
        {"base_url": "http://127.0.0.1:abc"},
        {"base_url": "http://127.0.0.1:99999"},
        {"base_url": "http://[::1"},
        {"base_url": "http://line\nbreak"},
        {"base_url": "//x"},
        {"base_url": "http://x/?a=1"},
        {"base_url": "http://x/#a"},
        {"api_key": "k\u00e9y"},
        {"api_key": "two\nlines"},
        {"timeout": 0},
        {"timeout": math.nan},
        {"retries": -1},
    ],
)
def test_impossible_settings_are_refused_at_once(keywords):
    with pytest.raises(ValueError, match="must") as caught:
        Client(**keywords)
    assert type(caught.value) is ValueError
    assert keywords.get("api_key", "secret") not in str(caught.value)

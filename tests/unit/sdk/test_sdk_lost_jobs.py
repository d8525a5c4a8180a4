"""A service whose store was emptied: the client, which has the request, submits it once more."""

import threading

import httpx2
import pytest

from grazemap import errors
from grazemap.client.cache import ResultCache
from tests.support.sdk_documents import REQUESTS
from tests.support.sdk_fake_service import FakeService, problem

CURVE = {"omega": (0.2, 0.3), "points": 3, "progress": False}


class ForgetfulService(FakeService):
    """Forgets its jobs before it answers a request whose address ends in `before`, so often."""

    def __init__(self) -> None:
        super().__init__()
        self.before, self.times = "", 0

    def forget(self, before: str, times: int = 1) -> None:
        self.before, self.times = before, times

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        job = request.url.path.split("/")[3:4]
        if self.times and job and job[0] in self.jobs and request.url.path.endswith(self.before or job[0]):
            self.times -= 1
            self.jobs.clear()
            self.results.clear()
        return super().__call__(request)

    def _batch(self, asked):
        answer = super()._batch(asked)
        if not self.times:
            return answer
        lines = [{"index": index, "id": "a" * 64, "status": "dismissed"} for index in range(len(asked))]
        self.forget("", 0)
        self.jobs.clear()
        return httpx2.Response(200, content="\n".join(map(str, lines)).replace("'", '"').encode() + b"\n")

    @property
    def posted(self) -> int:
        return sum(request.method == "POST" for request in self.requests)


@pytest.fixture
def service():
    return ForgetfulService()


@pytest.mark.parametrize("before", ["", "/events", "/result"])
def test_a_request_is_submitted_again(client, service, before):
    service.forget(before)
    assert client.grazing_curve(**CURVE).process == "grazing-curves"
    assert service.posted == 2


def test_it_is_submitted_again_once(client, service):
    service.forget("", 9)
    with pytest.raises(errors.NotFound):
        client.grazing_curve(**CURVE)
    assert service.posted == 2


def test_each_of_many_requests_is_submitted_again(client, service):
    service.forget("", 1)
    asked = [REQUESTS["grazing-curves"], REQUESTS["grazing-curves"] | {"max_order": 3}]
    results = list(client.map("grazing-curves", asked))
    assert [result.process for result in results] == ["grazing-curves"] * 2
    assert service.posted == 3


def test_a_handle_of_a_submitted_job_has_its_request(client, service):
    handle = client.submit("grazing-curves", REQUESTS["grazing-curves"])
    service.jobs.clear()
    assert handle.wait(timeout=60).status == "successful"
    service.jobs.clear()
    assert handle.result().process == "grazing-curves"
    assert service.posted == 3


def test_a_handle_of_another_job_has_none(client, service):
    handle = client.job(client.submit("grazing-curves", REQUESTS["grazing-curves"]).id)
    service.jobs.clear()
    for call in (handle.wait, handle.result):
        with pytest.raises(errors.NotFound):
            call()
    assert service.posted == 1


def test_a_page_that_is_not_found_is_another_matter(client, service):
    handle = client.submit("grazing-curves", REQUESTS["grazing-curves"]).wait()
    service.upcoming = [problem(404, "something-else")] * 2
    with pytest.raises(errors.NotFound):
        handle.result()
    assert service.posted == 1


def test_results_are_decoded_and_kept_beside_the_event_loop(make_client, service, tmp_path, monkeypatch):
    """An event loop goes on meanwhile: the result of a large map takes seconds."""
    from grazemap.client import jobs

    where: list[threading.Thread] = []

    def noted(function):
        def call(*arguments):
            where.append(threading.current_thread())
            return function(*arguments)

        return call

    monkeypatch.setattr(jobs, "decode_result", noted(jobs.decode_result))
    monkeypatch.setattr(ResultCache, "read", noted(ResultCache.read))
    monkeypatch.setattr(ResultCache, "write", noted(ResultCache.write))
    client = make_client(cache_dir=tmp_path)
    client.grazing_curve(**CURVE)
    handle = client.submit("grazing-curves", REQUESTS["grazing-curves"])
    handle.wait()
    handle.result()
    handle.result()
    list(client.map("grazing-curves", [REQUESTS["grazing-curves"]]))
    if "Async" in type(handle).__name__ or type(handle).__name__ == "Awaited":
        assert len(where) > 6
        assert threading.main_thread() not in where
    else:
        assert set(where) == {threading.main_thread()}

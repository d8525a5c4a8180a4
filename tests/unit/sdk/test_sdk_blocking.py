"""The blocking client is the asynchronous one without an event loop: in a thread of its own or not, and interrupted."""

from __future__ import annotations

import asyncio
import os
import pickle
import signal
import socket
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import httpx2
import pytest

from grazemap import Client
from grazemap.client.blocking import iterate, run
from tests.support.sdk_documents import REQUESTS
from tests.support.sdk_fake_service import FakeService
from tests.support.sdk_played import Lines

CURVE = {"omega": (0.2, 0.3), "points": 3, "progress": False}


def test_it_works_where_an_event_loop_runs(url: str) -> None:
    """As in a cell of a notebook."""

    async def cell() -> list[float]:
        with Client(url) as client:
            first = next(client.map("grazing-curves", [REQUESTS["grazing-curves"]] * 2))
            handle = client.submit("grazing-curves", REQUESTS["grazing-curves"])
            assert [event.name for event in handle.events()][-1] == "done"
            return [first.clearance[0], client.grazing_curve(**CURVE).clearance[0]]

    assert asyncio.run(cell()) == [1.5, 1.5]


def test_no_thread_remains(url: str) -> None:
    before = threading.active_count()
    with Client(url) as client:
        client.grazing_curve(**CURVE)
        # those of the service answer the connections that are open
        assert {thread.name.partition("-")[0] for thread in threading.enumerate()[before:]} <= {"Thread"}
        assert "asyncio" not in {thread.name.partition("_")[0] for thread in threading.enumerate()}


def test_threads_share_a_client(url: str) -> None:
    with Client(url) as client, ThreadPoolExecutor(4) as threads:
        clearances = list(threads.map(lambda _: client.grazing_curve(**CURVE).clearance[0], range(12)))
    assert clearances == [1.5] * 12


@pytest.fixture
def interruptible() -> Iterator[None]:
    """Ctrl-C is heard, also where a shell started this process in the background."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_ends_the_wait_at_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        client = Client(f"http://127.0.0.1:{silent.getsockname()[1]}", timeout=60.0)
        interrupted = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        interrupted.start()
        began = time.monotonic()
        with pytest.raises(KeyboardInterrupt), client:
            client.grazing_curve(**CURVE)
        assert time.monotonic() - began < 30.0  # not the whole timeout


@pytest.mark.parametrize("method", ["grazing_curve", "wait", "map"])
def test_an_interrupt_says_that_the_job_goes_on_and_shows_no_internals(service: FakeService, method: str) -> None:
    def answer(request: httpx2.Request) -> httpx2.Response:
        if request.url.path.endswith(("/events", "/batches")):
            raise KeyboardInterrupt
        return service(request)

    with Client("http://fake:1", transport=httpx2.MockTransport(answer)) as client:
        process, body = "grazing-curves", REQUESTS["grazing-curves"]
        calls = {
            "grazing_curve": lambda: client.grazing_curve(**CURVE),
            "wait": lambda: client.submit(process, body).wait(),
            "map": lambda: next(client.map(process, [body])),
        }
        with pytest.raises(KeyboardInterrupt) as caught:
            calls[method]()
        (note,) = caught.value.__notes__
        assert all(f'client.job("{name}")' in note for name in service.jobs)
        assert method != "map" or "client.jobs()" in note
        assert len(caught.traceback) <= 5
        assert caught.value.__suppress_context__


def test_a_child_process_has_its_own_connections(url: str) -> None:
    client = Client(url)
    assert client.grazing_curve(**CURVE).clearance[0] == 1.5
    child = os.fork()
    if child == 0:
        with Client(url) as own:
            os._exit(0 if own.grazing_curve(**CURVE).clearance[0] == 1.5 else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert client.grazing_curve(**CURVE).clearance[0] == 1.5
    client.close()


def test_results_that_are_not_read_close_the_answer(service: FakeService) -> None:
    closed = []
    whole = service._batch([{"process": "grazing-curves", "request": REQUESTS["grazing-curves"]}]).content.decode()

    def lines() -> Iterator[str]:
        yield from whole.split("\n")
        pytest.fail("it reads on")

    answer = httpx2.Response(200, stream=Lines(lines(), lambda: closed.append(True)))
    with Client("http://fake:1", transport=httpx2.MockTransport(lambda _: answer)) as client:
        results = client.map("grazing-curves", [REQUESTS["grazing-curves"], REQUESTS["grazing-curves"]])
        assert next(results).clearance[0] == 1.5
        assert not closed
        results.close()
        assert closed


def test_a_coroutine_that_waits_for_a_loop_is_an_error() -> None:
    async def waits() -> None:
        await asyncio.sleep(0)

    with pytest.raises(RuntimeError):
        run(waits())

    async def yields():
        yield 1
        await asyncio.sleep(0)

    items = iterate(yields())
    assert next(items) == 1
    with pytest.raises(RuntimeError):
        next(items)


def test_an_exception_shows_where_it_comes_from(service: FakeService) -> None:
    service.upcoming = [httpx2.ConnectError("refused")]
    with Client("http://fake:1", transport=httpx2.MockTransport(service), retries=0) as client:
        with pytest.raises(Exception, match="refused") as caught:
            client.grazing_curve(**CURVE)
        names = [entry.name for entry in caught.traceback]
        assert names[0] == "test_an_exception_shows_where_it_comes_from"
        assert names[-1] == "send"
        with pytest.raises((TypeError, AttributeError)):
            pickle.dumps(client)  # connections belong to a process


def test_a_subclass_closes_in_its_own_way() -> None:
    closed = []

    class Own(Client):
        def close(self) -> None:
            closed.append(self.base_url)
            super().close()

    with Own("http://fake:1") as client:
        assert repr(client) == "<Own of http://fake:1>"
    assert closed == ["http://fake:1"]

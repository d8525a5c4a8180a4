"""Results: formats by Accept, caching, conditions, tiles, and the answers without a result."""

from __future__ import annotations

import gc
import io
from typing import Any

import anyio
import numpy as np
import pytest
from starlette.testclient import TestClient

from grazemap.codec import decode_npz, encode_npz
from grazemap.wire import Problem, parse_request
from grazemap_service.representations import RepresentationCache, ResultResponse
from grazemap_worker.planning import Plan
from grazemap_worker.store import Store, core_version
from tests.support import submitting
from tests.support.service_running import CURVE, MAP, problem_of

JSON, NPZ = "application/json", "application/x-npz"


@pytest.fixture
def finished(client: TestClient, worker: Any) -> tuple[str, bytes]:
    """The path of a result, and its npz bytes."""
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    return f"/v1/jobs/{job['id']}/result", worker.finish(job["id"])


def evict(store: Store) -> None:
    """Delete all results, as happens to the oldest ones."""
    store.redis.delete(*store.redis.keys("grazemap:4:result:*"))


def test_npz_is_what_the_worker_stored(client: TestClient, finished: tuple[str, bytes]) -> None:
    path, data = finished
    answer = client.get(path, headers={"Accept": NPZ})
    assert answer.status_code == 200
    assert answer.headers["content-type"] == NPZ
    assert answer.content == data
    with np.load(io.BytesIO(answer.content), allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["omega"], [0.1, 0.2, 0.3])
    assert answer.headers["content-disposition"].endswith('.npz"')


def test_json_is_the_same_result(client: TestClient, finished: tuple[str, bytes]) -> None:
    answer = client.get(finished[0])
    assert answer.headers["content-type"] == JSON
    assert answer.json()["omega"] == [0.1, 0.2, 0.3]
    assert answer.json()["clearance"] == [1.0, None, 3.0]  # NaN is null
    assert answer.json()["points"] == [{"kind": "resonant", "order": 2, "families": [{"case": 1, "n": 3}]}]
    assert answer.json()["meta"]["process"] == "grazing-curves"
    assert client.get(finished[0]).content == answer.content  # now from memory


@pytest.mark.parametrize(
    ("accept", "form", "expected"),
    [
        (None, None, JSON),
        ("*/*", None, JSON),
        ("application/*", None, JSON),
        (NPZ, None, NPZ),
        ("application/zip", None, NPZ),
        (f"{JSON};q=0.5, {NPZ}", None, NPZ),
        (f"{JSON};q=0.5, {NPZ};q=0.4", None, JSON),
        (f"*/*;q=0.9, {JSON};q=0.1", None, NPZ),
        (f"{JSON};q=0, */*", None, NPZ),
        ("text/html, image/gif, *; q=.2, */*; q=.2", None, JSON),
        (f"{NPZ}, */*", None, NPZ),
        (f"application/octet-stream;q=0.1, {NPZ}, {JSON};q=0.5", None, NPZ),
        ("APPLICATION/JSON", None, JSON),
        (f"{JSON};q=0.0001, {NPZ};q=0.9", None, NPZ),
        (f"{JSON};q=-1, {NPZ};q=0.1", None, NPZ),
        (f"{NPZ};q=0.9, {JSON}; q = 2", None, JSON),
        (f"{JSON};q=much", None, None),
        (JSON, "npz", NPZ),
        ("image/png", "json", JSON),
        (f"{JSON};q=0", None, None),
        ("text/html", None, None),
        (None, "pickle", None),
    ],
)
def test_the_format_follows_accept_and_f(
    client: TestClient, finished: tuple[str, bytes], accept: str | None, form: str | None, expected: str | None
) -> None:
    query = f"?f={form}" if form else ""
    answer = client.get(finished[0] + query, headers={"Accept": accept} if accept else {})
    if expected is None:
        problem_of(answer, 406, "not-acceptable")
        assert "json" in answer.json()["detail"]
    else:
        assert answer.status_code == 200
        assert answer.headers["content-type"] == expected


@pytest.mark.parametrize("form", ["json", "npz"])
def test_a_cached_result_is_used_when_its_tag_is_confirmed(
    client: TestClient, finished: tuple[str, bytes], form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = f"{finished[0]}?f={form}"
    whole = client.get(path, headers={"Accept-Encoding": "identity"})
    etag = whole.headers["etag"]
    assert etag.startswith('"')
    assert whole.headers["vary"].split(", ")[0] == "Accept"
    assert whole.headers["cache-control"] == "private, no-cache"

    def unexpected(job_id: str) -> bytes:
        raise AssertionError("a condition that holds must not load the result")

    monkeypatch.setattr(client.app.state.context.store.results, "data", unexpected)  # type: ignore[attr-defined]
    for condition in (etag, f'"other", {etag}', f"W/{etag}", "*"):
        answer = client.get(path, headers={"If-None-Match": condition})
        assert (answer.status_code, answer.content) == (304, b"")
        assert answer.headers["etag"] == etag
        assert answer.headers["vary"].split(", ")[0] == "Accept"
    head = client.head(path)
    assert (head.status_code, head.content) == (200, b"")
    for name in ("etag", "content-type", "cache-control", "content-disposition"):
        assert head.headers[name] == whole.headers[name]
    assert head.headers.get("content-length", whole.headers["content-length"]) == whole.headers["content-length"]


def test_if_none_match_and_accept_may_be_repeated_headers(client: TestClient, finished: tuple[str, bytes]) -> None:
    path, _ = finished
    etag = client.get(path).headers["etag"]
    assert client.get(path, headers=[("If-None-Match", '"other"'), ("If-None-Match", etag)]).status_code == 304
    answer = client.get(path, headers=[("Accept", "text/html"), ("Accept", NPZ)])
    assert (answer.status_code, answer.headers["content-type"]) == (200, NPZ)


def test_each_format_has_its_own_etag(client: TestClient, finished: tuple[str, bytes]) -> None:
    json_tag, npz_tag = (client.get(f"{finished[0]}?f={form}").headers["etag"] for form in ("json", "npz"))
    for tag, status in ((json_tag, 304), (npz_tag, 200)):
        assert client.get(f"{finished[0]}?f=json", headers={"If-None-Match": tag}).status_code == status


def test_an_unfinished_job_has_no_result(client: TestClient, worker: Any) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    path = f"/v1/jobs/{job['id']}/result"
    for _ in range(2):
        problem_of(client.get(path), 409, "unfinished-job")
        worker.begin(job["id"])  # accepted, then running
    client.delete(f"/v1/jobs/{job['id']}")
    problem_of(client.get(path), 409, "dismissed-job")


def test_the_result_of_a_failed_job_is_its_problem(client: TestClient, store: Store) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    problem = Problem(type="urn:grazemap:problem:computation-refused", title="Computation refused", status=422)
    assert store.jobs.fail(job["id"], problem)
    answer = client.get(f"/v1/jobs/{job['id']}/result")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json() == problem.model_dump()
    assert client.get(f"/v1/jobs/{job['id']}").json()["problem"] == problem.model_dump()


def test_an_evicted_result_is_computed_again_but_not_for_a_matching_etag_or_a_head(serve: Any, worker: Any) -> None:
    client = serve(hot_bytes=0)
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    path = f"/v1/jobs/{job['id']}/result"
    data = worker.finish(job["id"])
    etag = client.get(path).headers["etag"]
    evict(worker.store)

    def confirmed() -> bool:
        answer = client.get(path, headers={"If-None-Match": etag})
        return (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", etag)

    assert confirmed()
    head = client.head(path)
    assert (head.status_code, head.content) == (202, b"")
    assert worker.store.jobs.status(job["id"]) == "successful"
    answer = client.get(path, headers={"If-None-Match": '"other"'})
    assert answer.status_code == 202
    assert (answer.json()["id"], answer.json()["status"]) == (job["id"], "accepted")
    assert answer.headers["location"] == f"/v1/jobs/{job['id']}"
    assert client.get(path).status_code == 409  # on its way
    assert client.get(path, headers={"If-None-Match": '"other"'}).status_code == 409
    assert confirmed()
    worker.begin(job["id"])
    assert confirmed()
    client.delete(f"/v1/jobs/{job['id']}")
    assert confirmed()
    client.post("/v1/grazing-curves", json=CURVE)
    assert worker.finish(job["id"]) == data
    assert client.get(path, headers={"Accept": NPZ}).content == data


def test_other_numerics_have_another_etag(client: TestClient, worker: Any) -> None:
    etags = set()
    for numerics in ("one", "other"):
        job = client.post("/v1/grazing-curves", json=CURVE).json()
        data = encode_npz({"omega": np.zeros(2)}, {"process": "grazing-curves", "numerics": {"fingerprint": numerics}})
        worker.commit(job["id"], data, 0, whole=True)
        etags.add(client.get(f"/v1/jobs/{job['id']}/result").headers["etag"])
        evict(worker.store)
    assert len(etags) == 2


def test_tiles_can_be_fetched_before_the_map_is_whole(client: TestClient, store: Store, worker: Any) -> None:
    job = client.post("/v1/unfolding-maps", json=MAP).json()
    path = f"/v1/jobs/{job['id']}/result/tiles"
    total = job["estimate"]["tiles"]
    empty = client.get(path).json()
    assert (empty["total"], empty["tiles"]) == (total, [])
    data = encode_npz({"kind": np.zeros((2, 2), np.int8)}, {"process": "unfolding-maps", "tile": {"index": 1}})
    worker.commit(job["id"], data, 1)
    (tile,) = client.get(path).json()["tiles"]
    row_start, row_stop, column_start, column_stop = store.jobs.plan_of(job["id"]).tile(1)  # type: ignore[union-attr]
    assert (tile["index"], tile["rows"], tile["columns"]) == (1, [row_start, row_stop], [column_start, column_stop])
    assert client.get(tile["href"], headers={"Accept": NPZ}).content == data
    assert client.get(tile["href"]).json()["kind"] == [[0, 0], [0, 0]]
    assert decode_npz(data)[0]["kind"].shape == (2, 2)
    for other in ("0", "-1", "x", "9" * 30, str(total)):
        problem_of(client.get(f"{path}/{other}"), 404, "unfinished-tile")


def test_hot_results_stay_under_their_budget() -> None:
    made = []

    async def ask(cache: RepresentationCache, names: str, size: int = 25) -> None:
        for name in names:
            entry = await cache.acquire(name, "npz", size, lambda name=name: made.append(name) or bytes(size))
            assert entry is not None
            cache.release(entry)

    async def use() -> None:
        hot = RepresentationCache(cache_bytes=100, sent_bytes=0)
        await ask(hot, "abcdef")
        await ask(hot, "cdef")  # a and b are the oldest
        assert made == list("abcdef")
        await ask(hot, "c")
        await ask(hot, "g")
        await ask(hot, "c")
        assert made == list("abcdefg")
        await ask(hot, "d")
        assert made == list("abcdefgd")
        await ask(hot, "ll", size=26)
        assert made == list("abcdefgdll")

    anyio.run(use)


def test_a_response_that_is_dropped_before_it_is_sent_does_not_count_as_sent() -> None:
    async def use() -> None:
        cache = RepresentationCache(cache_bytes=100, sent_bytes=0)
        entry = await cache.acquire("a", "npz", 25, lambda: bytes(25))
        assert entry is not None
        response = ResultResponse(entry, cache, "npz", {})
        assert cache.bytes_in_use == 25
        del response
        gc.collect()
        await anyio.sleep(0)
        assert (cache.bytes_in_use, entry.users) == (0, 0)

    anyio.run(use)


def test_a_result_of_another_version_is_computed_anew(client: TestClient, worker: Any) -> None:
    request = parse_request("grazing-curves", CURVE)
    job, _ = submitting.submit(worker.store, "grazing-curves", request, "0.1.0", Plan(), 100)
    data = worker.finish(job.id)
    assert worker.store.results.data(job.id) == data
    path = f"/v1/jobs/{job.id}/result"
    assert client.head(path).status_code == 202
    for _ in range(2):
        answer = client.get(path, headers={"If-None-Match": "*"})
        assert answer.status_code == 202
        assert answer.json()["core_version"] == core_version()
        assert answer.json()["id"] != job.id
    assert client.get(f"{path}/tiles/0").json()["type"] == "urn:grazemap:problem:outdated-job"


def test_large_json_is_compressed_for_who_takes_it(client: TestClient, worker: Any) -> None:
    job = client.post("/v1/grazing-curves", json=CURVE).json()
    path = f"/v1/jobs/{job['id']}/result"
    worker.finish(job["id"], {"omega": np.zeros(40_000)})
    plain = client.get(path, headers={"Accept-Encoding": "identity"})
    assert "content-encoding" not in plain.headers
    answer = client.get(path, headers={"Accept-Encoding": "gzip"})
    assert answer.headers["content-encoding"] == "gzip"
    assert "Accept-Encoding" in answer.headers["vary"]
    assert answer.content == plain.content  # the client has unpacked it
    npz = client.get(path, headers={"Accept-Encoding": "gzip", "Accept": NPZ})
    assert "content-encoding" not in npz.headers

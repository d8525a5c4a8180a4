"""Metrics for Prometheus: requests and latency by route, and the present state of jobs, tiles and workers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import redis.exceptions
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.registry import Collector

from grazemap_worker.store import EVENT_KINDS, Store

# Bounds of the histogram in seconds. Answers from the store take milliseconds; a POST that waits for its job, or an
# event stream, takes much longer.
BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class Metrics:
    """The metrics of an app, in a separate registry."""

    def __init__(self, store: Store) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "grazemap_http_requests", "Requests answered.", ["method", "route", "status"], registry=self.registry
        )
        self.key_requests = Counter(
            "grazemap_http_key_requests", "Requests answered, by the name of the key.", ["key"], registry=self.registry
        )
        self.latency = Histogram(
            "grazemap_http_request_seconds",
            "Time from the request to the end of its answer.",
            ["method", "route"],
            buckets=BUCKETS,
            registry=self.registry,
        )
        self.registry.register(StoreCollector(store))

    def render(self) -> bytes:
        """Return the metrics in Prometheus' text format."""
        return generate_latest(self.registry)


class StoreCollector(Collector):
    """Gauges of what the store holds and what happens in it; without Redis only ``grazemap_store_up 0``."""

    def __init__(self, store: Store) -> None:
        self.store = store

    def describe(self) -> Iterator[Any]:
        """Return nothing: names are fixed, and registering must not contact Redis."""
        return iter(())

    def collect(self) -> Iterator[GaugeMetricFamily | CounterMetricFamily]:
        """Read the gauges from the store and from the state of Redis."""
        try:
            counts, persistence = self.store.counts(), self.store.persistence()
        except redis.exceptions.RedisError:
            yield _gauge("store_up", "Whether Redis answers.", 0)
            return
        yield _gauge("store_up", "Whether Redis answers.", 1)
        yield _gauge("workers", "Live workers.", sum(not worker.small for worker in counts.workers))
        yield _gauge("pending_tiles", "Tiles that are not finished.", counts.pending_tiles)
        yield _gauge("results", "Results that are stored.", counts.results)
        yield _gauges("stored_bytes", "Bytes that are stored.", "kind", counts.bytes)
        if counts.budget is not None:
            yield _gauge("result_budget_bytes", "Bytes that results and tiles may take.", counts.budget)
        yield _gauges("jobs", "Jobs by status.", "status", counts.jobs)
        jobs = {lane: waiting.jobs for lane, waiting in counts.waiting.items()}
        yield _gauges("waiting_jobs", "Jobs that have tiles to compute.", "lane", jobs)
        seconds = {lane: waiting.seconds for lane, waiting in counts.waiting.items()}
        text = "Longest time for which a job has had tiles to compute and none was taken."
        yield _gauges("waiting_seconds", text, "lane", seconds)
        text = "Longest time for which a tile has been held by a worker."
        yield _gauge("claimed_seconds", text, counts.claimed_seconds)
        happened = CounterMetricFamily("grazemap_events", "What failed, by kind.", labels=["kind"])
        for kind, number in with_zeros(counts.events).items():
            happened.add_metric([kind], number)
        yield happened
        if persistence is not None:
            text = "Whether the last write of Redis to its disk succeeded."
            yield _gauges("store_writes_ok", text, "kind", persistence.writes_ok)
            yield _gauge("store_memory_bytes", "Memory of Redis.", persistence.memory_bytes)
            yield _gauge("store_memory_limit_bytes", "Its limit; 0: none.", persistence.memory_limit_bytes)


def with_zeros(events: Mapping[str, int]) -> dict[str, int]:
    """Return the numbers of events by kind, with 0 for kinds that have not happened."""
    return dict.fromkeys(EVENT_KINDS, 0) | dict(events)


def _gauge(name: str, text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"grazemap_{name}", text, value=value)


def _gauges(name: str, text: str, label: str, values: Mapping[str, float]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(f"grazemap_{name}", text, labels=[label])
    for key, value in values.items():
        family.add_metric([key], value)
    return family

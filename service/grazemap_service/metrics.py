"""Metrics for Prometheus: requests and latency by route, and jobs, tiles and workers as they are when scraped."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import redis.exceptions
from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.registry import Collector

from grazemap_worker.store import Store

# Seconds. Answers from the store take milliseconds; a waited-for POST or an event stream takes its time.
BUCKETS = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)


class Metrics:
    """The metrics of one app, in a registry of its own."""

    def __init__(self, store: Store) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter(
            "grazemap_http_requests", "Requests answered.", ["method", "route", "status"], registry=self.registry
        )
        self.of_keys = Counter(
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
    """Gauges of what the store holds; without Redis only ``grazemap_store_up 0``."""

    def __init__(self, store: Store) -> None:
        self.store = store

    def describe(self) -> Iterator[Any]:
        """Return nothing: names are fixed, and registering must not contact Redis."""
        return iter(())

    def collect(self) -> Iterator[GaugeMetricFamily | CounterMetricFamily]:
        """Read the gauges."""
        try:
            counts = self.store.counts()
        except redis.exceptions.RedisError:
            yield GaugeMetricFamily("grazemap_store_up", "Whether Redis answers.", value=0)
            return
        yield GaugeMetricFamily("grazemap_store_up", "Whether Redis answers.", value=1)
        yield GaugeMetricFamily("grazemap_workers", "Live workers.", value=counts.workers)
        yield GaugeMetricFamily("grazemap_pending_tiles", "Tiles that are not finished.", value=counts.pending_tiles)
        yield GaugeMetricFamily("grazemap_results", "Results that are stored.", value=counts.results)
        stored = GaugeMetricFamily("grazemap_stored_bytes", "Bytes that are stored.", labels=["kind"])
        for kind, size in counts.bytes.items():
            stored.add_metric([kind], size)
        yield stored
        happened = CounterMetricFamily("grazemap_events", "What failed, by kind.", labels=["kind"])
        for kind, number in counts.events.items():
            happened.add_metric([kind], number)
        yield happened
        jobs = GaugeMetricFamily("grazemap_jobs", "Jobs by status.", labels=["status"])
        for status, number in counts.jobs.items():
            jobs.add_metric([status], number)
        yield jobs

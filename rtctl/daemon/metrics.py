"""Prometheus metrics of a machine: optional, on loopback only; a thread reads the counts from shared memory.

Source: prometheus_client's custom collectors; the names follow Prometheus' rules (base units, `_total`).
"""

import platform
import threading
from collections.abc import Callable, Iterator, Mapping
from socketserver import ThreadingMixIn
from typing import TYPE_CHECKING, Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer

from prometheus_client import CollectorRegistry, make_wsgi_app
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, Metric
from prometheus_client.registry import Collector

from rtctl import __version__
from rtctl.config.errors import UserError
from rtctl.loop.histogram import octaves, total
from rtctl.loop.records import STAGES
from rtctl.tick import safety

if TYPE_CHECKING:
    from rtctl.daemon.supervisor import Supervisor

ADDRESS = "127.0.0.1"
BUILD = ["machine", "mode", "version", "python"]  # labels of rtctl_build_info
PLACES = 8  # connections at the same time; Prometheus needs one
PATIENCE = 5.0  # s to wait for a request on an open connection
COUNTS = {  # field of the status record -> name and help text of its counter
    "tick": ("ticks", "ticks of the loop"),
    "missed": ("missed_ticks", "periods that went by without a tick"),
    "late": ("late_ticks", "ticks that woke late"),
    "overruns": ("overruns", "ticks that were not done when the next was due"),
    "link_frames": ("link_frames", "frames from plant or board"),
    "link_dropped": ("link_frames_not_sent", "frames that could not be sent"),
    "lost_counts": ("lost_counts", "counts lost by the quadrature converters"),
}


class MachineCollector(Collector):
    """Metrics of one machine, read from its status record at each scrape."""

    def __init__(
        self,
        name: str,
        status: Any,
        rows: Callable[[], Mapping[str, Any]],
        told: Callable[[], Mapping[str, Any] | None] = lambda: None,
        mode: str = "",
    ):
        self._name, self._status, self._rows, self._told, self._mode = name, status, rows, told, mode

    def collect(self) -> Iterator[Metric]:
        """Metric families of the machine."""
        s = self._status
        for field, (name, words) in COUNTS.items():
            yield self._count(name, words, int(s[field]))
        for name, value in self._rows().items():
            if isinstance(value, int):
                yield self._count(f"rows_{name}", f"rows of the trace: {name.replace('_', ' ')}", value)
        state = GaugeMetricFamily("rtctl_state", "1 for the state that the machine is in", labels=["machine", "state"])
        for number, name in enumerate(safety.STATES):
            state.add_metric([self._name, name], float(int(s["state"]) == number))
        yield state
        trip = GaugeMetricFamily("rtctl_trip", "1 for the trip that is latched", labels=["machine", "trip"])
        for number, (name, _) in safety.TRIPS.items():
            if number != safety.NONE:
                trip.add_metric([self._name, name], float(int(s["trip"]) == number))
        yield trip
        stages = HistogramMetricFamily(
            "rtctl_stage_seconds", "time that each stage of a tick took", labels=["machine", "stage"]
        )
        for stage, field in STAGES.items():
            stages.add_metric([self._name, stage], *_buckets(s[field]))
        yield stages
        age = HistogramMetricFamily(
            "rtctl_sample_age_seconds", "age of the sample that a tick reads", labels=["machine"]
        )
        age.add_metric([self._name], *_buckets(s["age"]))
        yield age
        yield from self._model()
        build = GaugeMetricFamily("rtctl_build_info", "1, with the version of the program", labels=BUILD)
        build.add_metric([self._name, self._mode, __version__, platform.python_version()], 1.0)
        yield build

    def _model(self) -> Iterator[Metric]:
        """Metric families of `rtctl watch`; none while no watch reports."""
        told = self._told()
        if told is None or told["silent"]:
            return
        residual = GaugeMetricFamily(
            "rtctl_residual_sigma", "residual of each sensor, in standard deviations of the healthy machine",
            labels=["machine", "sensor"],
        )  # fmt: skip
        for sensor, value in told["residual"].items():
            residual.add_metric([self._name, sensor], value)
        yield residual
        alarm = GaugeMetricFamily("rtctl_model_alarm", "1 while the machine departs from its model", labels=["machine"])
        alarm.add_metric([self._name], float(told.get("alarm") is not None))
        yield alarm
        learned = GaugeMetricFamily(
            "rtctl_model_learned_ratio", "share of the motion that the model has learned from", labels=["machine"]
        )
        learned.add_metric([self._name], told.get("learned", 1.0))
        yield learned

    def _count(self, name: str, words: str, value: int) -> Metric:
        family = CounterMetricFamily(f"rtctl_{name}", words, labels=["machine"])
        family.add_metric([self._name], value)
        return family


def _buckets(histogram: Any) -> tuple[list[tuple[str, float]], float]:
    """Cumulative counts by upper bound in s, a power of two in ns, and the sum in s."""
    pairs = [(repr(ns * 1e-9), float(count)) for ns, count in octaves(histogram)]
    return [*pairs, ("+Inf", float(histogram["count"]))], total(histogram) * 1e-9


class _Request(WSGIRequestHandler):
    timeout = PATIENCE

    def log_message(self, *_: Any) -> None:
        """No log entry for a scrape."""


class _Server(ThreadingMixIn, WSGIServer):
    """HTTP server with a thread for each connection, at most PLACES: idle connections do not load the daemon."""

    daemon_threads = True

    def __init__(self, *arguments: Any):
        self._places = threading.BoundedSemaphore(PLACES)
        super().__init__(*arguments)

    def verify_request(self, *_: Any) -> bool:
        return self._places.acquire(blocking=False)

    def process_request_thread(self, *arguments: Any) -> None:
        try:
            super().process_request_thread(*arguments)
        finally:
            self._places.release()


def serve(supervisor: "Supervisor", port: int) -> Callable[[], None]:
    """Answer GET /metrics on loopback; returns a function that ends the server. Raises UserError for a port in use."""
    registry = CollectorRegistry()
    told = (supervisor.status, supervisor.rows_counted, lambda: supervisor.watched.told)
    registry.register(MachineCollector(supervisor.config.name, *told, supervisor.config.loop.mode))
    try:
        server = _Server((ADDRESS, port), _Request)
    except OSError as error:
        raise UserError(f"metrics.port {port}: {error.strerror}; choose a free one") from error
    server.set_app(make_wsgi_app(registry))
    thread = threading.Thread(target=server.serve_forever, args=(0.1,), name="metrics", daemon=True)
    thread.start()

    def close() -> None:
        server.shutdown()
        server.server_close()
        thread.join()

    return close

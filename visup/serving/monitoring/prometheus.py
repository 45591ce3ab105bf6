"""The metrics of a site in the Prometheus exposition format; needs `visup[serve]` (prometheus-client)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from visup.agent.model.errors import ExtraMissingError
from visup.serving.monitoring.camera_figures import PHASE
from visup.serving.monitoring.status import READY_STATES, CameraStatus, SiteStatus
from visup.version import __version__

if TYPE_CHECKING:
    from prometheus_client.core import Metric

Value = Callable[[CameraStatus], float | None]

_COUNTERS: tuple[tuple[str, str, Value], ...] = (
    ("visup_frames_seen", "Frames that were processed.", lambda c: c.totals.get("frames")),
    (
        "visup_frames_dropped",
        "Frames that were dropped to keep pace.",
        lambda c: c.totals.get("dropped"),
    ),
    ("visup_cpu_seconds", "Processor time of its processes.", lambda c: c.totals.get("cpu_s")),
    ("visup_restarts", "Restarts of the process of a camera.", lambda c: c.restarts),
)
_GAUGES: tuple[tuple[str, str, Value], ...] = (
    (
        "visup_camera_ready",
        "1 while a camera is being watched, or its source has ended.",
        lambda c: float(c.state in READY_STATES),
    ),
    (
        "visup_lag_seconds",
        "Age of the frame being processed.",
        lambda c: c.latest.get("lag_s"),
    ),
    ("visup_step_age_seconds", "Time since the last step was reported.", lambda c: c.step_age_s),
    (
        "visup_objects",
        "Objects believed to be in view.",
        lambda c: c.latest.get("objects"),
    ),
    ("visup_alerts_open", "Open alerts.", lambda c: c.latest.get("alerts_open")),
    (
        "visup_memory_bytes",
        "Memory used by the process of a camera.",
        lambda c: None if c.memory_mb is None else c.memory_mb * 2**20,
    ),
)
_SEVERITIES = ("info", "warning", "critical")


def metrics_page(status: SiteStatus, accept: str) -> tuple[bytes, str]:
    """All metrics as one page.

    Args:
        status: The state of the site.
        accept: The `Accept` header of the request.

    Returns:
        The page and its content type.

    Raises:
        ExtraMissingError: prometheus-client is not installed.
    """
    try:
        from prometheus_client import CollectorRegistry
        from prometheus_client.exposition import choose_encoder
    except ModuleNotFoundError as missing:
        raise ExtraMissingError("a page of metrics", "serve") from missing
    registry = CollectorRegistry(auto_describe=False)
    registry.register(_Collector(status))
    encode, kind = choose_encoder(accept)
    return bytes(encode(registry)), kind


class _Collector:
    """A prometheus-client collector.

    Args:
        status: The state of the site.
    """

    def __init__(self, status: SiteStatus) -> None:
        self._status = status

    def collect(self) -> Iterator[Metric]:
        """Every metric of every camera, and those of the store."""
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

        for name, help_text, value in _COUNTERS:
            yield self._family(CounterMetricFamily(name, help_text, labels=["camera"]), value)
        for name, help_text, value in _GAUGES:
            yield self._family(GaugeMetricFamily(name, help_text, labels=["camera"]), value)
        yield from self._labelled_metrics()
        yield from self._store_metrics()
        yield _build_info()

    def _family(self, family: Any, value: Value) -> Metric:
        for camera in self._status.cameras:
            figure = value(camera)
            if figure is not None:
                family.add_metric([camera.name], figure)
        return family

    def _labelled_metrics(self) -> Iterator[Metric]:
        """Metrics of a camera with a second label."""
        from prometheus_client.core import CounterMetricFamily

        phases = CounterMetricFamily(
            "visup_phase_seconds", "What each phase of all steps took.", labels=["camera", "phase"]
        )
        alerts = CounterMetricFamily(
            "visup_alerts", "Alerts that were opened.", labels=["camera", "severity"]
        )
        for camera in self._status.cameras:
            for name, value in camera.totals.items():
                if name.startswith(PHASE):
                    phases.add_metric([camera.name, name.removeprefix(PHASE)], value / 1000.0)
            for severity in _SEVERITIES:
                alerts.add_metric(
                    [camera.name, severity], camera.totals.get(f"alerts_{severity}", 0.0)
                )
        yield phases
        yield alerts

    def _store_metrics(self) -> Iterator[Metric]:
        from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily

        room = GaugeMetricFamily("visup_store_bytes", "Room of the store.", labels=["kind"])
        for kind, size in self._status.disk_usage.items():
            room.add_metric([kind], size)
        deleted = CounterMetricFamily(
            "visup_store_deleted", "What was deleted to make room.", labels=["kind"]
        )
        for kind, count in self._status.deleted.items():
            deleted.add_metric([kind], count)
        yield room
        yield deleted


def _build_info() -> Metric:
    from prometheus_client.core import InfoMetricFamily

    return InfoMetricFamily("visup_build", "What runs here.", value={"version": __version__})

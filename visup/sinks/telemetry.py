"""Traces and metrics for OpenTelemetry; needs `visup[otel]`.

A step is a span with a child for each behaviour that ran, with their durations; counters count steps, events,
alerts and failures. The exporter is configured by the environment (such as `OTEL_EXPORTER_OTLP_ENDPOINT`), or
is standard error with `otel:console`.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from visup.agent import ReportState
from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.agent.model.step import Step
from visup.version import __version__

NAME = "visup"


class Telemetry:
    """A sink for whole steps.

    Args:
        place: 'console', or 'otlp' for the exporter of the environment.
        providers: Tracer and meter providers to use instead, for programs with their own.

    Raises:
        SettingsError: `place` is neither.
        ExtraMissingError: OpenTelemetry is not installed.
    """

    def __init__(self, target: str, providers: tuple[Any, Any] | None = None) -> None:
        if target not in ("console", "otlp"):
            raise SettingsError(f"--sink otel:{target}", expected="otel:console or otel:otlp")
        self.name = f"otel:{target}"
        self._traces, self._metrics = providers or _providers(target)
        self._tracer = self._traces.get_tracer(NAME)
        meter = self._metrics.get_meter(NAME)
        self._steps = meter.create_counter("visup.steps", description="frames supervised")
        self._events = meter.create_counter("visup.events", description="events by kind")
        self._alerts = meter.create_counter("visup.alerts", description="alerts opened by kind")
        self._failures = meter.create_counter("visup.behaviour.failures")
        self._duration = meter.create_histogram("visup.behaviour.duration", unit="ms")
        self._objects = meter.create_histogram("visup.objects", description="objects in view")

    def deliver(self, record: Step) -> None:
        """Export one step."""
        self._count(record)
        self._trace(record)

    def close(self) -> None:
        """Flush."""
        for provider in (self._traces, self._metrics):
            provider.shutdown()

    def _count(self, step: Step) -> None:
        self._steps.add(1)
        self._objects.record(len(step.mind.present()))
        for event in step.events:
            self._events.add(1, {"kind": event.kind, "severity": event.severity.name.lower()})
        for alert in step.alerts:
            if alert.closed is None:
                self._alerts.add(1, {"kind": alert.kind})
        for report in step.reports:
            attributes = {"behaviour": report.behaviour}
            if report.state is ReportState.RAN:
                self._duration.record(report.elapsed_ms, attributes)
            self._failures.add(int(report.state is ReportState.FAILED), attributes)

    def _trace(self, step: Step) -> None:
        from opentelemetry import trace

        end = time.time_ns()
        duration_ns = sum(int(r.elapsed_ms * 1e6) for r in step.reports)
        facts: Mapping[str, Any] = {"frame_index": step.frame_index, "time": step.time}
        step_span = self._tracer.start_span("step", start_time=end - duration_ns, attributes=facts)
        for event in step.events:
            step_span.add_event(event.kind, {"text": event.text}, timestamp=end)
        context = trace.set_span_in_context(step_span)
        start = end - duration_ns
        for report in step.reports:
            if report.state is ReportState.RESTED:
                continue
            span = self._tracer.start_span(
                report.behaviour,
                context,
                start_time=start,
                attributes={"state": report.state.value, "percepts": len(report.percepts)},
            )
            start += int(report.elapsed_ms * 1e6)
            span.end(start)
        step_span.end(end)


def _providers(target: str) -> tuple[Any, Any]:
    try:
        from opentelemetry.sdk.metrics import MeterProvider
        from opentelemetry.sdk.metrics.export import PeriodicExportingMetricReader
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor

        spans, metrics = _exporters(target)
    except ModuleNotFoundError as missing:
        raise ExtraMissingError("a sink for OpenTelemetry", "otel") from missing
    resource = service_resource()
    traces = TracerProvider(resource=resource)
    traces.add_span_processor(BatchSpanProcessor(spans))
    return traces, MeterProvider([PeriodicExportingMetricReader(metrics)], resource=resource)


def service_resource() -> Any:
    """The resource: service `visup` with its version, unless the environment overrides it.

    `OTEL_SERVICE_NAME` and `OTEL_RESOURCE_ATTRIBUTES` take precedence, as usual.
    """
    from opentelemetry.sdk.resources import OTELResourceDetector, Resource

    own = Resource.create({"service.name": NAME, "service.version": __version__})
    return own.merge(OTELResourceDetector().detect())


def _exporters(target: str) -> tuple[Any, Any]:
    if target == "console":
        import sys

        from opentelemetry.sdk.metrics.export import ConsoleMetricExporter
        from opentelemetry.sdk.trace.export import ConsoleSpanExporter

        return ConsoleSpanExporter(out=sys.stderr), ConsoleMetricExporter(out=sys.stderr)
    from opentelemetry.exporter.otlp.proto.http.metric_exporter import OTLPMetricExporter
    from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter

    return OTLPSpanExporter(), OTLPMetricExporter()

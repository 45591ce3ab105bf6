"""The service: all cameras of a site with monitoring, console, retention and the spare process."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace

from visup.agent.model.errors import OutputError
from visup.runs.inputs.stop_signals import StopRequest
from visup.runs.result import ExitCode
from visup.serving.console_process import ConsoleProcess
from visup.serving.monitoring.endpoint import MonitoringServer
from visup.serving.retention.housekeeper import Housekeeper
from visup.serving.site.records import Site
from visup.serving.site_log import SITE, LogEvent, SiteEvent
from visup.serving.site_supervisor import SiteSupervisor, serve_site
from visup.serving.spare_process import SpareProcess

UPDATE_S = 1.0
"""Seconds between updates of the monitoring status."""


def serve(site: Site, log_event: LogEvent, stop: StopRequest) -> ExitCode:
    """Watch a site until a stop is requested or every source has ended; see `serve_site`.

    Args:
        site: The site.
        log_event: Receives the events.
        stop: Stop and reload requests by signals.

    Raises:
        OutputError: The store cannot be written, or another service uses it.
    """
    with ExitStack() as stack:
        spare = SpareProcess()
        stack.callback(spare.close)
        monitor = MonitoringFeed(site, log_event)
        stack.callback(monitor.close)
        console = ConsoleProcess(site.store, log_event)
        stack.callback(console.close)
        housekeeper = Housekeeper(site.store, site.retention, log_event)

        def apply_retention(supervisor: SiteSupervisor, now: float) -> None:
            housekeeper.limits = supervisor.limits
            housekeeper.tick(now, supervisor.active_runs)

        def update_monitoring(supervisor: SiteSupervisor, now: float) -> None:
            monitor.tick(supervisor, now, housekeeper)

        background = (
            apply_retention,
            update_monitoring,
            console.tick,
            *((spare.tick,) if site.spare else ()),
        )
        return serve_site(site, log_event, stop, spare.start, background_tasks=background)


class MonitoringFeed:
    """Keeps the monitoring server up to date; a server that cannot listen is reported and left out.

    Args:
        site: Says where to listen.
        tell: Receives the address or the fault.
    """

    def __init__(self, site: Site, log_event: LogEvent) -> None:
        self._server: MonitoringServer | None = None
        self._updated_at = -UPDATE_S
        if site.listen is None:
            return
        try:
            self._server = MonitoringServer(*site.listen)
        except OutputError as fault:
            log_event(SITE, str(fault), SiteEvent.NOT_MONITORED)
            return
        url = f"http://{self._server.address}/metrics"
        log_event(SITE, f"health and metrics are at {url}", SiteEvent.MONITORED, address=url)

    def tick(self, supervisor: SiteSupervisor, now: float, housekeeper: Housekeeper) -> None:
        """Update the status at intervals."""
        if self._server and now - self._updated_at >= UPDATE_S:
            self._updated_at = now
            status = supervisor.status(now)
            self._server.status = replace(
                status, disk_usage=housekeeper.disk_usage, deleted=dict(housekeeper.deleted)
            )

    def close(self) -> None:
        """Stop listening."""
        if self._server:
            self._server.close()

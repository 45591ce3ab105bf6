"""The service: all cameras of a site, and what stands beside them, put together."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace

from visup.agent.model.errors import OutputError
from visup.runs.inputs.stop_signals import StopRequest
from visup.runs.result import ExitCode
from visup.serving.console_process import ConsoleProcess
from visup.serving.monitoring.endpoint import MonitoringServer
from visup.serving.room.housekeeper import Housekeeper
from visup.serving.site.records import Site
from visup.serving.site_log import SITE, SiteEvent, Tell
from visup.serving.site_supervisor import SiteSupervisor, serve_site
from visup.serving.spare_process import SpareProcess

LOOK_S = 1.0
"""Seconds between two looks at how the service does."""


def serve(site: Site, tell: Tell, stop: StopRequest) -> ExitCode:
    """Watch a site until a stop is asked for, or every source was seen to its end; see `serve_site`.

    Args:
        site: What is watched.
        tell: Told what happens.
        stop: What signals ask for.

    Raises:
        OutputError: The store cannot be written, or another service uses it.
    """
    with ExitStack() as stack:
        spare = SpareProcess()
        stack.callback(spare.close)
        monitor = MonitoringFeed(site, tell)
        stack.callback(monitor.close)
        console = ConsoleProcess(site.store, tell)
        stack.callback(console.close)
        keeper = Housekeeper(site.store, site.retention, tell)

        def keep_house(supervisor: SiteSupervisor, now: float) -> None:
            keeper.limits = supervisor.limits
            keeper.turn(now, supervisor.going_on)

        def look(supervisor: SiteSupervisor, now: float) -> None:
            monitor.turn(supervisor, now, keeper)

        beside = (keep_house, look, console.turn, *((spare.turn,) if site.spare else ()))
        return serve_site(site, tell, stop, spare.start, beside=beside)


class MonitoringFeed:
    """Tells those who ask how the service does; one that cannot listen stops nothing.

    Args:
        site: Which says where to listen.
        tell: Told where that is.
    """

    def __init__(self, site: Site, tell: Tell) -> None:
        self._server: MonitoringServer | None = None
        self._looked = -LOOK_S
        if site.listen is None:
            return
        try:
            self._server = MonitoringServer(*site.listen)
        except OutputError as fault:
            tell(SITE, str(fault), SiteEvent.NOT_MONITORED)
            return
        at = f"http://{self._server.address}/metrics"
        tell(SITE, f"health and metrics are at {at}", SiteEvent.MONITORED, address=at)

    def turn(self, supervisor: SiteSupervisor, now: float, keeper: Housekeeper) -> None:
        """Look at how the service does, once in a while."""
        if self._server and now - self._looked >= LOOK_S:
            self._looked = now
            status = supervisor.status(now)
            self._server.status = replace(status, room=keeper.room, deleted=dict(keeper.deleted))

    def close(self) -> None:
        """Listen no more."""
        if self._server:
            self._server.close()

"""The page of a camera says when things were by the clock of the wall; that of a file does not."""

from __future__ import annotations

from dataclasses import replace

from visup.agent import Alert, Event, Severity
from visup.agent.storage.wall_clock import WallClock
from visup.report.page import sections
from visup.report.page.summary import summary
from visup.report.records import RunData

RUN = RunData(
    "rtsp://cell/1",
    frame_size=(8, 8),
    frames=9,
    duration=90.0,
    events=(Event("alert", 61.0, 5, "Something."),),
    alerts=(Alert(1, "seen", Severity.WARNING, 61.0, 61.0, (), "Seen."),),
)
CAMERA = replace(RUN, clock=WallClock(((0.0, 1795455235.0),)))


def test_times_of_a_camera_include_wall_clock_time() -> None:
    assert "It began on 2026-11-23 at 17:33:55 UTC." in summary(CAMERA)
    for part in (sections.narrative(CAMERA), sections.alerts(CAMERA)):
        assert 'datetime="2026-11-23T17:34:56.000Z"' in part
        assert ">17:34:56<" in part
        assert "61.0 s" in part


def test_times_of_a_file_are_seconds_only() -> None:
    assert "It began" not in summary(RUN)
    assert "<time>61.0 s</time>" in sections.narrative(RUN)
    assert "<time>from 61.0 s</time>" in sections.alerts(RUN)

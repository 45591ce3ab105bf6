"""The summary at the top of the page."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.report.page.test_html import data
from visup.agent import Alert, Severity, Verdict
from visup.report.page.summary import summary, title_of, verdict_words
from visup.report.records import RunData
from visup.terminal.narrator import verdict_line


def test_a_run_without_a_verdict_claims_none() -> None:
    judged = replace(data(), verdict=Verdict.SUCCEEDED)
    assert verdict_words(judged)[0] == "Succeeded"
    assert verdict_words(replace(judged, verdict=None))[0] == "No verdict"
    quiet = replace(judged, verdict=None, tasks=(), alerts=())
    assert verdict_words(quiet)[0].lower() in verdict_line(None)  # as the terminal has it


def test_without_a_task_system_alerts_do_not_count_as_unsafe() -> None:
    alert = Alert(1, "sink_failed", Severity.WARNING, 1.0, 1.0, (), "The sink fails.")
    run = replace(data(), tasks=(), alerts=(alert,), verdict=None)
    assert verdict_words(run)[0] == "Nothing unsafe was seen"
    seen = verdict_words(replace(run, verdict=Verdict.INTERRUPTED))[0]
    assert seen.lower() in verdict_line(Verdict.INTERRUPTED, has_task=False)
    unsure = verdict_words(replace(run, verdict=Verdict.UNKNOWN))
    assert "task could not" not in unsure[1]
    assert unsure[0].lower() in verdict_line(Verdict.UNKNOWN, has_task=False)


def test_the_summary_consists_of_sentences() -> None:
    tasks = tuple(replace(t, evidence="they were apart ") for t in data().tasks)
    assert " They were apart. One alert was raised, at 7.0 s: " in summary(
        replace(data(), tasks=tasks)
    )


def test_the_summary_gives_a_reason_once() -> None:
    (alert,) = data().alerts
    tasks = tuple(replace(t, evidence="they were apart") for t in data().tasks)
    alert = replace(alert, cause="The stage 'captured' is failing: they were apart.")
    told = summary(replace(data(), tasks=tasks, alerts=(alert,)))
    assert told.endswith("They were apart. One alert was raised, at 7.0 s.")


@pytest.mark.parametrize(
    ("source", "title"),
    [
        ("video.mp4", "video.mp4"),
        ("/data/missions/capture_fails/video.mp4", "capture_fails/video.mp4"),
        ("rtsp://10.0.0.1/live/1/2", "rtsp://10.0.0.1/live/1/2"),
        ("camera 0", "camera 0"),
    ],
)
def test_titles_are_short(source: str, title: str) -> None:
    assert title_of(RunData(source)) == title

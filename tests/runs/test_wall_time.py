"""Of a camera every record says when it was, and on which camera; a file's records stay as they are."""

from __future__ import annotations

import json
import time
from datetime import datetime
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from visup.agent import Alert, Frame
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, supervise
from visup.runs.settings import RunOptions, WatchSettings

RULE = 'rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n'


@pytest.fixture
def settings(tmp_path: Path) -> WatchSettings:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(20), fps=20.0)
    (tmp_path / "own.rules").write_text(RULE)
    return WatchSettings(source=str(clip), rules=(tmp_path / "own.rules",))


def lines(path: Path) -> list[dict[str, object]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def when(record: dict[str, object]) -> float:
    return datetime.fromisoformat(str(record["at"]).replace("Z", "+00:00")).timestamp()


def stop_after_an_alert(most_s: float = 20.0) -> Audience:
    """The step that comes after it ends the run."""

    def stop(step: Step, frame: Frame) -> None:
        if alerted or time.monotonic() - begun > most_s:
            raise KeyboardInterrupt
        alerted.extend(step.alerts)

    alerted: list[Alert] = []
    begun = time.monotonic()
    return Audience((stop,))


def test_records_of_a_camera_have_time_and_place(settings: WatchSettings, tmp_path: Path) -> None:
    live = WatchSettings(source=f"loop:{settings.source}", rules=settings.rules)
    alerts, run = tmp_path / "alerts.jsonl", tmp_path / "run"
    run.mkdir()
    options = RunOptions(False, False, (f"file:{alerts}",), camera="cell", state_every_s=0.2)
    begun = time.time()
    supervise(live, run, audience=stop_after_an_alert(), options=options)
    first = lines(run / "events.jsonl")
    past = interrupted_run(run)
    supervise(past.settings, run, audience=stop_after_an_alert(), options=options, past=past)
    ended = time.time()
    told, events = lines(alerts), lines(run / "events.jsonl")
    assert {t["record"] for t in told} >= {"alert", "verdict"}
    for record in (*told, *events):
        assert record["camera"] == "cell"
        assert record["host"]
        assert begun - 0.01 <= when(record) <= ended + 0.01
    times = [when(e) for e in events]
    assert times == sorted(times)
    assert events[: len(first)] == first  # a further anchor leaves what was told as it was
    facts = Recording.open(run).facts()
    assert facts["camera"] == "cell"
    assert not any("at" in e for e in Recording.open(run).events())


def test_records_of_a_file_are_reproducible(settings: WatchSettings, tmp_path: Path) -> None:
    texts = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        sink = (f"file:{tmp_path / name / 'alerts.jsonl'}",)
        supervise(settings, tmp_path / name, options=RunOptions(False, False, sink))
        told = lines(tmp_path / name / "alerts.jsonl")
        assert {t["record"] for t in told} == {"alert", "verdict"}
        assert not any({"at", "camera", "host"} & set(t) for t in told)
        texts.append((tmp_path / name / "events.jsonl").read_bytes())
    assert texts[0] == texts[1]
    assert b'"at"' not in texts[0]

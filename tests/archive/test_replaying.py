"""Other rules on the past: what changes is what replays of the runs themselves say."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.cli import Call, caller
from visup.agent.storage.journal_reader import Recording
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.archive.replaying import ChangeSummary, changes
from visup.runs.replay import recorded_transcript, replay, settings_for, transcript_diff
from visup.runs.settings import WatchSettings

pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})
NEAR = (
    'rule near(a, b): warning when converging(a, b) for 0.3 s hold 0.5 s say "{a} {is} near {b}."'
)


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs, by themselves and in a lake, and other rules."""
    place = tmp_path_factory.mktemp("replaying")
    lake = Lake.create(place / "lake")
    for number, count in enumerate((40, 12)):
        record(place / f"run-{number}", meeting(count, 20), DOCK)
        add_run(lake, place / f"run-{number}")
    (place / "near.rules").write_text(NEAR)
    return place


def test_nothing_changes_with_what_there_was(place: Path) -> None:
    lake, summary = Lake.open(place / "lake"), ChangeSummary()
    for found in changes(lake, lake.runs()):
        summary.take(found)
        assert not found.diff
    assert (summary.runs, summary.changed) == (2, 0)


def test_what_changes_is_what_replays_say(place: Path) -> None:
    lake, summary = Lake.open(place / "lake"), ChangeSummary()
    rules = (place / "near.rules",)
    for found in changes(lake, lake.runs(), rules=rules):
        summary.take(found)
    wanted: Counter[str] = Counter()
    for number in (0, 1):
        recording = Recording.open(place / f"run-{number}")
        told = replay(recording, settings_for(recording, rules=rules))
        diff = transcript_diff(recorded_transcript(recording), told)
        gone, new = (
            Counter(
                (e["data"]["alert_kind"], e["time"], e["text"]) for e in es if e["kind"] == "alert"
            )
            for es in (diff.gone, diff.new)
        )
        wanted.update(kind for kind, *_ in (new - gone).elements())
    assert summary.gained == wanted
    assert wanted["near"] >= 1
    assert f"  alerts near: 0 lost, {wanted['near']} gained" in list(summary.lines())


def test_a_task_changes_verdicts(place: Path) -> None:
    lake, summary = Lake.open(place / "lake"), ChangeSummary()
    for found in changes(lake, lake.runs(), tasks=("undock",)):
        summary.take(found)
    assert summary.changed == 2


def test_the_command(
    place: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    same = visup("archive", "replay", place / "lake")
    assert (same.code, same.out) == (0, "Runs: 2, of which 0 change.\n")
    told = visup("archive", "replay", place / "lake", "--rules", place / "near.rules")
    assert told.code == 1
    assert "clip.mp4: " in told.out
    assert "alerts near: 0 lost, " in told.out
    assert visup("archive", "replay", place / "lake", "--rules", place / "none.rules").code == 2

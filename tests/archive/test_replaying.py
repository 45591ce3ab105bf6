"""Other rules on recorded runs: the changes reported are those of replays of each run."""

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
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two runs, by themselves and in a lake, and other rules."""
    folder = tmp_path_factory.mktemp("replaying")
    lake = Lake.create(folder / "lake")
    for number, count in enumerate((40, 12)):
        record(folder / f"run-{number}", meeting(count, 20), DOCK)
        add_run(lake, folder / f"run-{number}")
    (folder / "near.rules").write_text(NEAR)
    return folder


def test_the_recorded_settings_change_nothing(folder: Path) -> None:
    lake, summary = Lake.open(folder / "lake"), ChangeSummary()
    for change in changes(lake, lake.runs()):
        summary.take(change)
        assert not change.diff
    assert (summary.runs, summary.changed) == (2, 0)


def test_changes_are_those_of_replays(folder: Path) -> None:
    lake, summary = Lake.open(folder / "lake"), ChangeSummary()
    rules = (folder / "near.rules",)
    for change in changes(lake, lake.runs(), rules=rules):
        summary.take(change)
    expected: Counter[str] = Counter()
    for number in (0, 1):
        recording = Recording.open(folder / f"run-{number}")
        transcript = replay(recording, settings_for(recording, rules=rules))
        diff = transcript_diff(recorded_transcript(recording), transcript)
        gone, new = (
            Counter(
                (e["data"]["alert_kind"], e["time"], e["text"]) for e in es if e["kind"] == "alert"
            )
            for es in (diff.gone, diff.new)
        )
        expected.update(kind for kind, *_ in (new - gone).elements())
    assert summary.gained == expected
    assert expected["near"] >= 1
    assert f"  alerts near: 0 lost, {expected['near']} gained" in list(summary.lines())


def test_a_task_changes_verdicts(folder: Path) -> None:
    lake, summary = Lake.open(folder / "lake"), ChangeSummary()
    for change in changes(lake, lake.runs(), tasks=("undock",)):
        summary.take(change)
    assert summary.changed == 2


def test_the_command_prints_changes(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    same = visup("archive", "replay", folder / "lake")
    assert (same.code, same.out) == (0, "Runs: 2, of which 0 change.\n")
    result = visup("archive", "replay", folder / "lake", "--rules", folder / "near.rules")
    assert result.code == 1
    assert "clip.mp4: " in result.out
    assert "alerts near: 0 lost, " in result.out
    assert visup("archive", "replay", folder / "lake", "--rules", folder / "none.rules").code == 2

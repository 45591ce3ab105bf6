"""Evidence of alerts is found by number, and only within the run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.console.evidence_files import write_evidence
from tests.console.test_runs import SETTINGS
from visup.console.evidence import AlertEvidence, evidence_of, latest_snapshot
from visup.console.feedback import Opinion, store_feedback
from visup.console.library import RunLibrary
from visup.console.pages.wall_alerts import AlertFilter, alert_rows
from visup.console.state import ConsoleState


def test_picture_and_clip_are_found_by_the_number_of_the_alert(tmp_path: Path) -> None:
    assert not evidence_of(tmp_path, 1)
    assert latest_snapshot(tmp_path) is None
    folder = write_evidence(tmp_path, 7)
    assert evidence_of(tmp_path, 7) == AlertEvidence(
        folder / "alert-7.jpg", folder / "alert-7.webm"
    )
    assert latest_snapshot(tmp_path) == 7
    (folder / "alert-7.webm").rename(folder / "alert-7.spool")
    assert evidence_of(tmp_path, 7) == AlertEvidence(folder / "alert-7.jpg", clip_pending=True)


@pytest.mark.parametrize(
    "named",
    ["../secret.jpg", "/etc/passwd", "..", "", "secret.txt", "a\0.jpg", "x" * 5000, "link.jpg"],
)
def test_files_outside_the_folder_are_no_evidence(tmp_path: Path, named: str) -> None:
    run = tmp_path / "run"
    run.mkdir()
    folder = write_evidence(run, 1)
    (tmp_path / "secret.jpg").write_text("secret")
    (folder / "secret.txt").write_text("secret")
    (folder / "link.jpg").symlink_to(tmp_path / "secret.jpg")
    (folder / "alert-1.json").write_text(json.dumps({"snapshot": named, "clip": named}))
    assert not evidence_of(run, 1)


@pytest.mark.parametrize("text", ["", "[]", "null", '{"clip": 3}', '{"snapshot": [], "clip": {}}'])
def test_a_damaged_record_is_no_evidence(tmp_path: Path, text: str) -> None:
    folder = write_evidence(tmp_path, 1)
    (folder / "alert-1.json").write_text(text)
    assert not evidence_of(tmp_path, 1)


def test_a_linked_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    write_evidence(tmp_path / "other", 1)
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "evidence").symlink_to(tmp_path / "other" / "evidence")
    assert not evidence_of(tmp_path / "run", 1)


def test_alerts_of_all_cameras_can_be_filtered(tmp_path: Path) -> None:
    record(tmp_path / "cell", meeting(), SETTINGS)
    record(tmp_path / "yard", meeting(shift=4.0), SETTINGS)
    library = RunLibrary([tmp_path])
    state, entries = ConsoleState(library), library.scan()
    every = alert_rows(state, entries, AlertFilter("all"))
    assert {r.camera for r in every} == {"cell", "yard"}
    assert [r.alert.severity for r in every] == sorted(
        (r.alert.severity for r in every), reverse=True
    )
    opened = alert_rows(state, entries, AlertFilter())
    assert {id(r.alert) for r in opened} == {id(r.alert) for r in every if r.alert.closed is None}
    one = every[0]
    store_feedback(one.run.folder, one.alert, Opinion.SEEN)
    left = alert_rows(state, entries, AlertFilter("unseen"))
    assert len(left) == len(every) - 1
    words = alert_rows(state, entries, AlertFilter("all", "YARD collision course"))
    assert words
    wanted = [r for r in every if r.camera == "yard" and r.alert.kind == "collision_course"]
    assert [(r.key, r.alert) for r in words] == [(r.key, r.alert) for r in wanted]
    assert not alert_rows(state, entries, AlertFilter("all", "nowhere to be found"))


def test_an_ended_run_is_not_read_again(tmp_path: Path) -> None:
    record(tmp_path / "over", meeting(10), SETTINGS)
    record(tmp_path / "going", meeting(10), SETTINGS, ended=None)
    library = RunLibrary([tmp_path])
    first = {e.name: e for e in library.scan()}
    again = {e.name: e for e in library.scan()}
    assert again == first
    assert again["over"] is first["over"]
    assert again["going"] is not first["going"]

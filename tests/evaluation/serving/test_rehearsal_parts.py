"""The parts of a rehearsal: streams can be watched, sinks go down, nothing escapes the account."""

from __future__ import annotations

import json
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import Any

import pytest

from visup.agent import Alert, Mind, Observation, Severity
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal
from visup.evaluation.serving.alert_audit import AlertAuditor
from visup.evaluation.serving.fault_injection import Kill, ProcessKiller, Timetable
from visup.evaluation.serving.receiver import AlertReceiver
from visup.evaluation.serving.rehearsal import evaluate_serving, failed, prepare_store
from visup.evaluation.serving.scene import CROSSING, SIZE, jpegs, scene
from visup.evaluation.serving.streams import FaultyStream
from visup.percepts.video import open_source


def test_a_stream_is_opened_as_a_live_camera() -> None:
    frames = scene(1)
    assert (frames[CROSSING // 2] != frames[-1]).any()
    assert (frames[-1] == frames[-2]).all()
    stream = FaultyStream(jpegs(frames[:20]), 1)
    try:
        with open_source(stream.url) as source:
            assert source.live
            assert next(source).size == SIZE
            assert next(source).time > 0.0
    finally:
        stream.close()


def test_a_receiver_refuses_records_while_it_is_down() -> None:
    receiver = AlertReceiver()
    try:
        sent = {"record": "alert"}
        request = urllib.request.Request(
            f"http://127.0.0.1:{receiver.port}/", json.dumps(sent).encode(), method="POST"
        )
        receiver.down = True
        with pytest.raises(urllib.error.HTTPError, match="503") as refused:
            urllib.request.urlopen(request, timeout=5)
        refused.value.close()
        receiver.down = False
        urllib.request.urlopen(request, timeout=5).close()
        assert (receiver.records, receiver.refused) == ([sent], 1)
    finally:
        receiver.close()


def record(number: int, state: str, delivery: str, camera: str = "cell") -> dict[str, Any]:
    fields = {"record": "alert", "camera": camera, "id": number, "opened": float(number)}
    return {**fields, "state": state, "delivery": delivery}


def test_lost_and_duplicate_alerts_and_missing_evidence_are_counted(tmp_path: Path) -> None:
    run = tmp_path / "cell" / "20260101T000000Z"
    (run / "evidence").mkdir(parents=True)
    (run / "evidence" / "alert-1.json").write_text('{"id": 1, "opened": 1.0}')
    journal = Journal(run / "journal.sqlite")
    alerts = [
        Alert(n, "seen", Severity.WARNING, float(n), float(n), (), "Seen.", closed=end)
        for n, end in ((1, 5.0), (2, None), (3, None))
    ]
    observation = Observation(0, 6.0, (8, 8), ())
    journal.record(Step(0, 6.0, observation, Mind(time=6.0), alerts=tuple(alerts)))
    journal.close()
    unstarted = tmp_path / "cell" / "20260101T000500Z"
    unstarted.mkdir()
    (unstarted / "journal.sqlite").touch()  # killed before its first line
    received = [
        record(1, "opened", "a"),
        record(1, "closed", "b"),
        record(2, "opened", "c"),
        record(2, "opened", "c"),
        record(2, "opened", "d"),
        record(3, "opened", "e", camera="yard"),
        record(9, "opened", "f"),  # its step was lost
    ]
    auditor = AlertAuditor(tmp_path / "cell")
    auditor.read_store()
    (run / "journal.sqlite").unlink()  # for lack of room
    auditor.read_store()
    audit = auditor.audit(received)
    assert (audit.alerts, audit.lost, audit.twice, audit.resent) == (3, 1, 2, 1)
    assert (audit.unrecorded, audit.without_evidence) == (1, 2)


def test_a_rehearsal_fails_if_alerts_are_lost_or_cameras_late() -> None:
    fine = {"lost": 0, "twice": 1, "resent": 1, "slowest_s": 9.9, "not_back": 0}
    assert not failed({"total": fine})
    for wrong in ({"lost": 1}, {"twice": 2}, {"slowest_s": 10.1}, {"not_back": 1}):
        assert failed({"total": {**fine, **wrong}})


def test_actions_are_performed_when_they_are_due() -> None:
    actions: list[tuple[str, float]] = []
    now = 0.0
    table = Timetable(
        ((10.0, lambda: actions.append(("a", now))), (25.0, lambda: actions.append(("b", now))))
    )
    for second in range(60):
        now = float(second)
        table.tick(now)
    expected = [("a", t) for t in (10.0, 20.0, 30.0, 40.0, 50.0)] + [("b", 25.0), ("b", 50.0)]
    assert sorted(actions) == expected


def test_a_killed_camera_has_recovered_with_its_next_frame(tmp_path: Path) -> None:
    killer = ProcessKiller(tmp_path, ["cell"], 0)
    killer.kill_one({"cell": 5.0})
    assert killer.kills == []  # there is no such process
    kill = Kill("cell", time.monotonic(), restarts=2.0)
    killer.kills.append(kill)
    killer.note_recoveries({"cell": 2.0}, {"cell": 90.0})  # what the one before had told last
    killer.note_recoveries({"cell": 3.0}, {"cell": 92.0})
    assert kill.back_s is None
    killer.note_recoveries({"cell": 3.0}, {"cell": 93.0})
    assert kill.back_s is not None


def test_a_store_that_is_not_empty_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("")
    with pytest.raises(SettingsError, match="not empty") as refused:
        evaluate_serving(1.0, store=tmp_path)
    assert refused.value.hint
    assert [p.name for p in tmp_path.iterdir()] == ["mine"]


@pytest.mark.parametrize("below", ["", "runs"])
def test_a_store_that_is_a_file_or_below_one_is_refused(tmp_path: Path, below: str) -> None:
    (tmp_path / "mine").write_text("")
    with pytest.raises(SettingsError, match="is a file"):
        evaluate_serving(1.0, store=tmp_path / "mine" / below)


def test_a_store_that_does_not_exist_is_created(tmp_path: Path) -> None:
    prepare_store(tmp_path / "disk" / "store")
    prepare_store(tmp_path / "disk" / "store")
    assert (tmp_path / "disk" / "store").is_dir()

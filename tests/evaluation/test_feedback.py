"""Precision of alerts over recorded runs."""

from __future__ import annotations

from pathlib import Path

from tests.archive.recordings import meeting, record
from visup.api.recorded import open_run
from visup.console.feedback import Opinion, store_feedback
from visup.evaluation.feedback import evaluate_feedback


def test_feedback_is_counted_over_all_readable_runs(tmp_path: Path) -> None:
    for name in ("one", "two"):
        record(tmp_path / name, meeting())
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "journal.sqlite").write_bytes(b"none")
    alerts = list(open_run(tmp_path / "one").alerts)
    assert alerts
    store_feedback(tmp_path / "one", alerts[0], Opinion.RIGHT)
    store_feedback(tmp_path / "two", alerts[0], Opinion.FALSE_ALARM)
    figures = evaluate_feedback(tmp_path)
    assert figures["total"]["precision"] == 0.5
    assert (figures["total"]["runs"], figures["total"]["unreadable"]) == (2, 1)
    assert figures["items"][alerts[0].kind]["alerts"] >= 2

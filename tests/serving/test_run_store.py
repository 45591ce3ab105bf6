"""Which run goes on is noted beside the runs, and outlives the service."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest

from tests.serving.fakes import begun_journal
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL
from visup.serving.run_store import CURRENT, begin_run, resumable_run

NOON = datetime(2026, 11, 23, 12, 0, 5, tzinfo=UTC)


def test_a_run_is_resumed_only_under_the_same_settings(tmp_path: Path) -> None:
    folder = tmp_path / "store" / "cell"
    assert resumable_run(folder, "a") is None
    run = begin_run(folder, "a", NOON)
    assert run == folder / "20261123T120005Z"
    assert resumable_run(folder, "a") is None  # nothing was recorded
    begun_journal(run)
    assert resumable_run(folder, "a") == run
    assert resumable_run(folder, "b") is None


def test_a_complete_run_is_not_resumed(tmp_path: Path) -> None:
    run = begin_run(tmp_path, "a", NOON)
    run.mkdir()
    journal = Journal(run / JOURNAL)
    journal.note(ended="stopped")
    assert resumable_run(tmp_path, "a") == run
    journal.note(ended="complete")
    journal.close()
    assert resumable_run(tmp_path, "a") is None


def test_names_are_in_utc_and_unique(tmp_path: Path) -> None:
    berlin = NOON.astimezone(timezone(timedelta(hours=1)))
    runs = []
    for _ in range(3):
        runs.append(begin_run(tmp_path, "a", berlin))
        runs[-1].mkdir()
    assert [r.name for r in runs] == [
        "20261123T120005Z",
        "20261123T120005Z-2",
        "20261123T120005Z-3",
    ]


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", "no", '{"run": "../elsewhere", "fingerprint": "a"}', '{"run": 3}'],
)
def test_an_invalid_note_is_ignored(tmp_path: Path, text: str) -> None:
    (tmp_path / "cell").mkdir()
    begun_journal(tmp_path / "elsewhere")
    (tmp_path / "cell" / CURRENT).write_text(text)
    assert resumable_run(tmp_path / "cell", "a") is None


def test_a_run_with_a_damaged_journal_is_not_resumed(tmp_path: Path) -> None:
    run = begin_run(tmp_path, "a", NOON)
    run.mkdir()
    (run / JOURNAL).write_bytes(b"no journal")
    assert resumable_run(tmp_path, "a") is None


def test_an_unwritable_folder_is_reported(tmp_path: Path) -> None:
    (tmp_path / "cell").write_text("a file")
    with pytest.raises(OutputError, match="folder of a camera"):
        begin_run(tmp_path / "cell", "a", NOON)

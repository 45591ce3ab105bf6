"""What was told is there after the power was lost, at whatever moment."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from tests.runs.power.cuts import RecordedRun, lost_in_cuts, missing, recorded_run
from tests.runs.power.forgetful import ForgetfulDisk
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording

POINTS = 250
"""Moments of a run at which the power is lost; `visup eval hardening` takes 1,000."""


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> RecordedRun:
    """A run, and all that it did to its files."""
    run = recorded_run(tmp_path_factory.mktemp("power"))
    if run is None:
        pytest.skip("there is no C compiler to make the forgetful disk with")
    return run


def test_everything_reported_is_in_the_journal(record: RecordedRun, tmp_path: Path) -> None:
    assert len(record.done) > 200
    assert lost_in_cuts(record, POINTS, 3, tmp_path / "again") == [[]] * POINTS


def test_a_disk_without_sync_loses_data(record: RecordedRun, tmp_path: Path) -> None:
    """The test above can fail: without syncs what was told is lost."""
    folder, told, done = record.folder, record.told, record.done
    rng, said, disk = random.Random(3), "", ForgetfulDisk()
    for operation in done:
        if operation.path == str(told):
            said += operation.data.decode() if operation.what == "write" else ""
        elif operation.what != "sync":
            disk.do(operation)
    try:
        lost = missing(disk, rng, folder, tmp_path / "again", said)
    except (OutputError, FileNotFoundError, AssertionError, ValueError):
        return
    assert lost


def test_a_run_can_be_resumed_after_a_power_failure(record: RecordedRun, tmp_path: Path) -> None:
    folder, done = record.folder, record.done
    disk, rng = ForgetfulDisk(), random.Random(5)
    for operation in done[: 2 * len(done) // 3]:
        disk.do(operation)
    for path, data in disk.lose_power(rng).items():
        if not path.endswith(("-shm", "told", ".lock")):
            (tmp_path / Path(path).relative_to(folder)).write_bytes(data)
    before = Recording.open(tmp_path).count()
    journal = Journal(tmp_path / JOURNAL, resume=True)
    assert journal.last_frame is not None
    journal.note(went_on=True)
    journal.close()
    assert Recording.open(tmp_path).count() == before

"""What was told is there after the power was lost, at whatever moment."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from pathlib import Path

import pytest

from tests.paths import ROOT
from tests.runs.power.forgetful import ForgetfulDisk, Operation, compiled_shim, operations
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording

POINTS = int(os.environ.get("VISUP_POWER_POINTS", "250"))
"""Moments of a run at which the power is lost; `make fuzz` takes 1,000."""


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, list[Operation]]:
    """A run: its folder, what it told, and all that it did to its files."""
    place = tmp_path_factory.mktemp("power").resolve()
    shim = compiled_shim(place)
    if shim is None:
        pytest.skip("there is no C compiler to make the forgetful disk with")
    folder, log = place / "run", place / "log"
    folder.mkdir()
    told = folder / "told"
    subprocess.run(
        [sys.executable, "-m", "tests.runs.power.recording_run", str(folder), str(told), "120"],
        check=True,
        env={
            **os.environ,
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "LD_PRELOAD": str(shim),
            "FORGETFUL_ROOT": str(folder),
            "FORGETFUL_LOG": str(log),
        },
    )
    return folder, told, list(operations(log))


def missing(
    disk: ForgetfulDisk, rng: random.Random, folder: Path, again: Path, said: str
) -> list[str]:
    """What had been told and is not there when the power is back."""
    again.mkdir(exist_ok=True)
    for old in again.iterdir():
        old.unlink()
    left = disk.lose_power(rng)
    for path, data in left.items():
        if not path.endswith(("-shm", "told", ".lock")):
            (again / Path(path).relative_to(folder)).write_bytes(data)
    lost = []
    events = [line for line in said.splitlines() if not line.startswith("state")]
    states = [line.split()[1] for line in said.splitlines() if line.startswith("state")]
    if events:
        there = {str(e["frame_index"]) for e in Recording.open(again).events()}
        lost += [e for e in events if e not in there]
        assert list(Recording.open(again).observations())
    if states:
        found = (again / "state.bin").read_bytes().split(b"\n")
        assert len(set(found[:-1])) == 1  # whole, never in part
        lost += [] if int(found[0]) >= int(states[-1]) else [f"state {states[-1]}"]
    return lost


def test_nothing_that_was_told_is_missing(
    record: tuple[Path, Path, list[Operation]], tmp_path: Path
) -> None:
    folder, told, done = record
    assert len(done) > 200
    rng, said, disk = random.Random(3), "", ForgetfulDisk()
    at = [rng.randrange(len(done)) for _ in range(POINTS - 1)] + [len(done) - 1]
    cuts = 0
    for number, operation in enumerate(done):
        if operation.path == str(told):
            said += operation.data.decode() if operation.what == "write" else ""
        else:
            disk.do(operation)
        for _ in range(at.count(number)):
            cuts += 1
            assert missing(disk, rng, folder, tmp_path / "again", said) == []
    assert cuts == POINTS


def test_a_disk_that_syncs_nothing_loses_something(
    record: tuple[Path, Path, list[Operation]], tmp_path: Path
) -> None:
    """The test above can fail: without syncs what was told is lost."""
    folder, told, done = record
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


def test_a_run_goes_on_after_the_power_was_lost(
    record: tuple[Path, Path, list[Operation]], tmp_path: Path
) -> None:
    folder, _, done = record
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

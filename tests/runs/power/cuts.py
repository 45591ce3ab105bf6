"""Cuts of power during a run: what was told must be there when the power is back."""

from __future__ import annotations

import os
import random
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from tests.paths import ROOT
from tests.runs.power.forgetful import ForgetfulDisk, Operation, compiled_shim, operations
from visup.agent.model.errors import VisupError
from visup.agent.storage.journal_reader import Recording


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """A run, and all that it did to its files.

    Attributes:
        folder: Where it wrote.
        told: The file that it told things to, as a terminal would have it.
        done: What it did, in order.
    """

    folder: Path
    told: Path
    done: list[Operation]


def recorded_run(place: Path) -> RecordedRun | None:
    """A run on a disk whose writes are written down; None where there is no C compiler to make one.

    Args:
        place: An empty folder.
    """
    place = place.resolve()
    shim = compiled_shim(place)
    if shim is None:
        return None
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
    return RecordedRun(folder, told, list(operations(log)))


def lost_in_cuts(run: RecordedRun, points: int, seed: int, again: Path) -> list[list[str]]:
    """What is missing after each of so many cuts, drawn by a seed; the last is at the end of the run."""
    rng, said, disk = random.Random(seed), "", ForgetfulDisk()
    at = [rng.randrange(len(run.done)) for _ in range(points - 1)] + [len(run.done) - 1]
    lost = []
    for number, operation in enumerate(run.done):
        if operation.path == str(run.told):
            said += operation.data.decode() if operation.what == "write" else ""
        else:
            disk.do(operation)
        for _ in range(at.count(number)):
            try:
                lost.append(missing(disk, rng, run.folder, again, said))
            except (VisupError, OSError) as fault:
                lost.append([str(fault)])
    return lost


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
        lost += [] if list(Recording.open(again).observations()) else ["all that was perceived"]
    if states:
        found = (again / "state.bin").read_bytes().split(b"\n")
        lost += [] if len(set(found[:-1])) == 1 else ["a part of the state"]
        lost += [] if int(found[0]) >= int(states[-1]) else [f"state {states[-1]}"]
    return lost

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
from pathlib import Path

import pytest

from tests.agent.scripted import Scripted, alert_while, counting, frames
from tests.paths import ROOT
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import Recording, export_events

CRASH = """
import os, signal, sys
from pathlib import Path
from tests.agent.scripted import counting, frames
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.storage.journal import Journal

journal = Journal(Path(sys.argv[1]))
agent = Agent([], Reasoners(update=(counting,)), observers=(journal.record,))
for frame in frames(100):
    agent.step(frame)
    print(frame.index, flush=True)
    if frame.index == 41:
        os.kill(os.getpid(), signal.SIGKILL)
"""


def run(path: Path, count: int) -> None:
    journal = Journal(path)
    worry = alert_while(lambda t: t >= 0.5)
    reasoners = Reasoners(update=(counting,), cogitate=(worry,))
    Agent([Scripted("eye", ("x",))], reasoners, observers=(journal.record,)).run(frames(count))
    journal.note(verdict="succeeded")
    journal.close()


def test_a_run_can_be_read_back(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    run(path, 12)
    events = list(Recording.open(path).events())
    assert [e["text"] for e in events if e["kind"] == "counted"] == [
        f"I counted {i}." for i in range(1, 13)
    ]
    assert [e["kind"] for e in events].count("alert") == 1
    assert [s["frame_index"] for s in Recording.open(path).summaries()] == list(range(12))
    assert Recording.open(path).facts() == {"verdict": "succeeded"}


def test_exported_events_are_one_object_a_line_and_equal_runs_give_equal_bytes(
    tmp_path: Path,
) -> None:
    for name in ("a", "b"):
        run(tmp_path / f"{name}.sqlite", 9)
        export_events(tmp_path / f"{name}.sqlite", tmp_path / f"{name}.jsonl")
    a, b = ((tmp_path / f"{n}.jsonl").read_bytes() for n in ("a", "b"))
    assert a == b
    keys = {"kind", "time", "frame_index", "text", "objects", "confidence", "severity", "data"}
    assert all(set(json.loads(line)) == keys for line in a.splitlines())


def test_a_killed_run_retains_every_recorded_step(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    root = ROOT
    done = subprocess.run(
        [sys.executable, "-c", CRASH, str(path)],
        cwd=root,
        env={**os.environ, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == -signal.SIGKILL
    printed = [int(line) for line in done.stdout.split()]
    assert [s["frame_index"] for s in Recording.open(path).summaries()] == printed


@pytest.mark.parametrize("place", ["missing/journal.sqlite", "."])
def test_an_unwritable_journal_is_an_error(tmp_path: Path, place: str) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        Journal(tmp_path / place)


def test_reading_another_file_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "x.sqlite").write_text("not a database, but long enough to look like a file")
    with pytest.raises(OutputError, match="not a journal"):
        list(Recording.open(tmp_path / "x.sqlite").events())


def test_a_failed_write_leaves_earlier_steps_intact(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    agent = Agent([], Reasoners(update=(counting,)), observers=(journal.record,))
    agent.run(frames(3))
    blocker = sqlite3.connect(path)
    blocker.execute("ALTER TABLE events RENAME TO hidden")  # as good as a disk that fills up
    blocker.commit()
    with pytest.raises(OutputError):
        agent.run(frames(1))
    blocker.execute("ALTER TABLE hidden RENAME TO events")
    blocker.execute("PRAGMA writable_schema = ON")  # it is quoted now
    blocker.execute("UPDATE sqlite_schema SET sql = replace(sql, '\"events\"', 'events')")
    blocker.commit()
    blocker.close()
    journal.close()
    assert [s["frame_index"] for s in Recording.open(path).summaries()] == [0, 1, 2]

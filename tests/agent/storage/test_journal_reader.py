"""Journals read back: over segments, of other versions, damaged, in folders that cannot be written."""

from __future__ import annotations

import os
import shutil
import sqlite3
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from tests.agent.scripted import Scripted, alert_while, counting, frames
from tests.full_disk import no_room
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import OutputError
from visup.agent.storage.codec import pack_observation
from visup.agent.storage.journal import Journal, JournalLimits, segments
from visup.agent.storage.journal_reader import Recording, export_events

SMALL = JournalLimits(segment_bytes=4000)


def agent(*observers: object) -> Agent:
    worry = alert_while(lambda t: t >= 0.5)
    reasoners = Reasoners(update=(counting,), cogitate=(worry,))
    return Agent([Scripted("eye", ("x",))], reasoners, observers=observers)  # type: ignore[arg-type]


def write(path: Path, count: int, limits: JournalLimits | None = None) -> list[bytes]:
    seen: list[bytes] = []
    journal = Journal(path, limits)
    agent(journal.record, lambda step, frame: seen.append(pack_observation(step.observation))).run(
        frames(count)
    )
    journal.note(verdict="succeeded", settings={})
    journal.close()
    return seen


def test_segments_read_as_one_journal(tmp_path: Path) -> None:
    whole, cut = tmp_path / "a" / "journal.sqlite", tmp_path / "b" / "journal.sqlite"
    for path in (whole, cut):
        path.parent.mkdir()
    seen = write(whole, 80)
    write(cut, 80, SMALL)
    assert len(segments(cut)) > 3
    one, many = Recording.open(whole.parent), Recording.open(cut)
    assert list(one.events()) == list(many.events())
    assert list(one.summaries()) == list(many.summaries())
    assert one.alerts() == many.alerts()
    assert one.facts()["verdict"] == many.facts()["verdict"] == "succeeded"
    assert [pack_observation(o) for o in many.observations()] == seen
    assert [o.frame_index for o in many.observations(after=70)] == list(range(71, 80))
    assert (many.count(), many.first_and_last()) == (80, (0, 79))


def test_segments_are_cut_by_time_too(tmp_path: Path) -> None:
    write(tmp_path / "journal.sqlite", 50, JournalLimits(segment_s=1.0))
    assert len(segments(tmp_path / "journal.sqlite")) == 5


def test_the_oldest_steps_are_dropped_beyond_keep_bytes_but_no_events(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    noise = np.random.default_rng(0)
    journal = Journal(path, JournalLimits(segment_bytes=200_000, keep_bytes=600_000))
    eye = Scripted("eye", ("x",), lambda index: noise.bytes(4000))
    Agent([eye], Reasoners(update=(counting,)), observers=(journal.record,)).run(frames(300))
    journal.close()
    recording = Recording.open(path)
    first, last = recording.first_and_last() or (0, 0)
    assert first > 100
    assert last == 299
    assert [o.frame_index for o in recording.observations()] == list(range(first, 300))
    assert sum(e["kind"] == "counted" for e in recording.events()) == 300
    assert recording.facts()["steps_dropped"] is True
    oldest, *_, last_but_one, _ = (p.stat().st_size for p in segments(path))
    assert oldest < 0.75 * last_but_one


@pytest.mark.parametrize("at", [0, 1, 17, 60])
def test_a_resumed_journal_continues_where_it_ended(tmp_path: Path, at: int) -> None:
    """Against one written in one go; ids of events and alerts too."""
    sequence = list(frames(80))
    whole, parts = tmp_path / "whole.sqlite", tmp_path / "parts.sqlite"
    one = Journal(whole, SMALL)
    agent(one.record).run(sequence)
    one.close()
    two = Journal(parts, SMALL)
    mind = agent(two.record)
    mind.run(sequence[:at])
    two.close()
    three = Journal(parts, SMALL, resume=True)
    assert three.last_frame == (at - 1 if at else None)
    mind.observers = (three.record,)
    mind.run(sequence[at:])
    three.close()
    assert list(Recording(whole).events()) == list(Recording(parts).events())
    assert Recording(whole).alerts() == Recording(parts).alerts()
    assert [p.stat().st_size for p in segments(whole)] == [
        p.stat().st_size for p in segments(parts)
    ]


def test_an_empty_segment_of_a_killed_run_is_restarted(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.sqlite"
    write(path, 30, SMALL)
    count = len(segments(path))
    (tmp_path / f"journal-{count + 1}.sqlite").touch()
    assert Recording.open(path).count() == 30
    journal = Journal(path, SMALL, resume=True)
    assert journal.last_frame == 29
    journal.close()


@pytest.mark.parametrize("version", [0, 1, 99])
def test_a_journal_of_another_version_is_refused(tmp_path: Path, version: int) -> None:
    path = tmp_path / "journal.sqlite"
    write(path, 3)
    db = sqlite3.connect(path)
    db.execute(f"PRAGMA user_version={version}")
    db.close()
    with pytest.raises(OutputError, match=f"version {version}"):
        Recording.open(path)
    with pytest.raises(OutputError, match=f"version {version}"):
        Journal(path, resume=True)


def test_another_database_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.sqlite"
    db = sqlite3.connect(path)
    db.execute("CREATE TABLE run (key, value)")
    db.close()
    with pytest.raises(OutputError, match="not a journal"):
        Recording.open(path)
    with pytest.raises(OutputError, match="no recorded run"):
        Recording.open(tmp_path)


def test_a_journal_in_a_read_only_folder_can_be_read(tmp_path: Path) -> None:
    write(tmp_path / "journal.sqlite", 5)
    tmp_path.chmod(0o500)
    try:
        assert Recording.open(tmp_path).count() == 5
    finally:
        tmp_path.chmod(0o700)


def test_a_damaged_journal_gives_one_message_and_the_steps_before(tmp_path: Path) -> None:
    """Bytes changed, runs of zeros, ends cut off: never anything but an OutputError."""
    good = tmp_path / "good.sqlite"
    seen = write(good, 60)
    sound = good.read_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for trial in range(120):
        bad = tmp_path / "bad.sqlite"
        for old in tmp_path.glob("bad.sqlite*"):
            old.unlink()
        data = bytearray(sound)
        at = int(rng.integers(len(data)))
        if trial % 3 == 0:
            data[at : at + int(rng.integers(1, 5000))] = b""
        elif trial % 3 == 1:
            data[at : at + 64] = bytes(64)
        else:
            for place in rng.integers(0, len(data), 30):
                data[place] = int(rng.integers(256))
        bad.write_bytes(data)
        read: list[bytes] = []
        try:
            recording = Recording.open(bad)
            list(recording.events())
            list(recording.summaries())
            recording.alerts()
            recording.facts()
            export_events(bad, tmp_path / "out.jsonl")
            read.extend(pack_observation(o) for o in recording.observations())
        except OutputError:
            refused += 1
        assert all(r in seen for r in read)
    assert refused > 30


def test_a_damaged_step_is_reported_with_its_frame_after_those_before_it(
    tmp_path: Path,
) -> None:
    path = tmp_path / "journal.sqlite"
    write(path, 10)
    db = sqlite3.connect(path)
    db.execute("UPDATE steps SET seen = x'00' WHERE frame_index = 6")
    db.commit()
    db.close()
    given: list[int] = []
    with pytest.raises(OutputError, match="frame 6"):
        given.extend(o.frame_index for o in Recording.open(path).observations())
    steps = Recording.open(path).observations()
    assert [next(steps).frame_index for _ in range(6)] == list(range(6))


def test_a_copy_of_a_live_journal_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "journal.sqlite"
    journal = Journal(path)
    agent(journal.record).run(frames(20))
    copy = tmp_path / "copy"
    copy.mkdir()
    for part in tmp_path.glob("journal.sqlite*"):
        shutil.copy(part, copy / part.name)
    assert Recording.open(copy).count() == 20
    journal.close()


def test_on_a_full_disk_steps_use_the_reserve_which_is_released(tmp_path: Path) -> None:
    """Also by who goes on with a run that was killed."""
    path = tmp_path / "journal.sqlite"
    reserve = JournalLimits(reserve_bytes=2**21)
    if (child := os.fork()) == 0:
        agent(Journal(path, reserve).record).run(islice(frames(150), 50))
        os._exit(9)
    os.waitpid(child, 0)
    with no_room(tmp_path):
        past = list(Recording.open(path).observations())
        journal = Journal(path, reserve, resume=True)
        told = agent(journal.record)
        for seen in past:
            told.reason(seen)
        for frame in islice(frames(150), 50, 150):
            told.step(frame)
        kept = [s["frame_index"] for s in Recording.open(path).summaries()]
    assert kept == list(range(150))
    reserved = path.stat().st_size
    journal.close()
    assert path.stat().st_size < reserved - 2**20
    plain = tmp_path / "plain" / "journal.sqlite"
    plain.parent.mkdir()
    write(plain, 150)
    assert list(Recording.open(path).events()) == list(Recording.open(plain).events())

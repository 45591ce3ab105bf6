"""What goes from a store is the oldest, no more than is needed, and never what a camera goes on from."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.serving.fakes import Bench
from visup.serving.retention.housekeeper import SCAN_S, Housekeeper
from visup.serving.retention.removals import (
    DAY_S,
    FREE_SPACE_FACTOR,
    RECENT_S,
    RemovalReason,
    removals,
)
from visup.serving.retention.stored_files import StoredEvidence, StoredFiles, StoredRun, scan_store
from visup.serving.site.records import RetentionLimits
from visup.serving.site_log import SiteEvent

NOW = 1000 * DAY_S
AGES = st.floats(0.0, 400 * DAY_S)
SIZES = st.integers(1, 1000)


@st.composite
def stored(draw: st.DrawFn) -> StoredFiles:
    runs = []
    for number in range(draw(st.integers(0, 5))):
        folder = Path(f"/store/cell/{number}")
        evidence = tuple(
            StoredEvidence((folder / "evidence" / f"alert-{i}.jpg",), draw(SIZES), NOW - draw(AGES))
            for i in range(draw(st.integers(0, 3)))
        )
        goes_on = draw(st.booleans())
        runs.append(StoredRun(folder, draw(SIZES), NOW - draw(AGES), goes_on, evidence))
    return StoredFiles(tuple(runs), draw(st.integers(0, 3000)))


LIMITS = st.builds(
    RetentionLimits,
    days=st.floats(1.0, 300.0),
    evidence_days=st.floats(1.0, 300.0),
    store_bytes=st.none() | st.floats(1.0, 5000.0),
    free_bytes=st.floats(0.0, 3000.0),
)


@given(stored(), LIMITS)
def test_only_old_or_excess_files_are_removed_and_no_active_run(
    files: StoredFiles, limits: RetentionLimits
) -> None:
    gone = removals(files, limits, NOW)
    assert len({id(one.what) for one in gone}) == len(gone)
    runs = [one.what for one in gone if isinstance(one.what, StoredRun)]
    evidence = [e for run in files.runs for e in run.evidence]
    assert not any(run.active or NOW - run.written <= RECENT_S for run in runs)
    left = files.size - sum(one.size for one in gone)
    free = files.free + sum(one.size for one in gone)
    may_go = [r for r in files.runs if not r.active and NOW - r.written > RECENT_S]
    settled = [e for e in evidence if NOW - e.written > RECENT_S]
    everything = len(gone) >= len(settled) + len(may_go)
    assert everything or free >= limits.free_bytes
    assert everything or limits.store_bytes is None or left <= limits.store_bytes
    for one in gone:
        days = limits.days if isinstance(one.what, StoredRun) else limits.evidence_days
        assert (one.reason is RemovalReason.AGE) == (NOW - one.what.written > DAY_S * days)
    last = next((o for o in reversed(gone) if o.reason is RemovalReason.DISK), None)
    if last:  # without it there would not have been enough
        assert free - last.size < FREE_SPACE_FACTOR * limits.free_bytes


@given(stored())
def test_a_large_store_loses_runs_first_and_a_full_disk_evidence(files: StoredFiles) -> None:
    forever = 1000.0
    room = removals(files, RetentionLimits(forever, forever, 1.0, 0.0), NOW)
    disk = removals(files, RetentionLimits(forever, forever, None, 1e9), NOW)
    for gone, first in ((room, StoredRun), (disk, StoredEvidence)):
        kinds = [isinstance(one.what, first) for one in gone]
        assert kinds == sorted(kinds, reverse=True)
        for kind in (True, False):
            ages = [o.what.written for o, k in zip(gone, kinds, strict=True) if k is kind]
            assert ages == sorted(ages)


def run(store: Path, name: str, days_ago: float, *alerts: int) -> Path:
    folder = store / "cell" / name
    (folder / "evidence").mkdir(parents=True)
    (folder / "journal.sqlite").write_bytes(b"x" * 100)
    for number in alerts:
        for suffix in ("jpg", "json", "webm"):
            (folder / "evidence" / f"alert-{number}.{suffix}").write_bytes(b"x" * 10)
    for path in folder.rglob("*.*"):
        os.utime(path, (NOW - days_ago * DAY_S,) * 2)
    return folder


@pytest.fixture
def bench() -> Bench:
    return Bench()


def keeper(store: Path, bench: Bench, limits: RetentionLimits) -> Housekeeper:
    return Housekeeper(store, limits, bench.tell, now=lambda: NOW)


def test_old_runs_are_removed_before_the_evidence_of_their_alerts(
    tmp_path: Path, bench: Bench
) -> None:
    oldest = run(tmp_path, "20260101T000000Z", 200, 1)
    old = run(tmp_path, "20260201T000000Z", 100, 1, 2)
    young = run(tmp_path, "20260301T000000Z", 10, 1)
    notes = tmp_path / "cell" / "notes"
    notes.mkdir()
    house = keeper(tmp_path, bench, RetentionLimits(30.0, 180.0, None, 0.0))
    house.scan([])
    assert not oldest.exists()
    assert [p.name for p in old.iterdir()] == ["evidence"]
    assert len(list((old / "evidence").iterdir())) == 6
    assert (young / "journal.sqlite").exists()
    assert notes.exists()
    assert house.deleted == {"runs": 2, "evidence": 1}
    assert bench.kinds == [SiteEvent.DELETED]
    assert "2 runs" in bench.lines[0]


def test_on_a_full_disk_the_oldest_evidence_is_removed_and_reported(
    tmp_path: Path, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = (run(tmp_path, f"2026010{n}T000000Z", 5 - n, 1, 2) for n in (1, 2))
    usage = SimpleNamespace(free=980)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    house = keeper(tmp_path, bench, RetentionLimits(30.0, 180.0, None, 1000.0))
    house.scan([first])
    assert list(first.rglob("*.webm")) == []
    assert len(list(second.rglob("*.webm"))) == 0  # a tenth more than the limit is freed
    assert (first / "journal.sqlite").exists()
    assert bench.kinds == [SiteEvent.NO_ROOM]
    assert "the disk was nearly full" in bench.lines[0]
    usage.free = 0
    house.scan([first])
    house.scan([first])
    assert not second.exists()
    assert (first / "journal.sqlite").exists()
    assert [line for line in bench.lines if "nothing more can be deleted" in line] == bench.lines[
        -1:
    ]


def test_targets_of_links_are_not_removed(tmp_path: Path, bench: Bench) -> None:
    elsewhere = run(tmp_path / "other", "20260101T000000Z", 900, 1)
    store = tmp_path / "store"
    (store / "cell").mkdir(parents=True)
    (store / "cell" / elsewhere.name).symlink_to(elsewhere)
    inside = run(store, "20260102T000000Z", 900)
    (inside / "link").symlink_to(elsewhere)
    os.utime(inside / "link", (0.0, 0.0), follow_symlinks=False)
    keeper(store, bench, RetentionLimits(1.0, 1.0, 1.0, 1e18)).scan([])
    assert not inside.exists()
    assert len(list(elsewhere.rglob("*.*"))) == 4


def test_scans_are_periodic_and_never_concurrent(tmp_path: Path, bench: Bench) -> None:
    looks: list[float] = []
    house = keeper(tmp_path, bench, RetentionLimits())
    house.scan = lambda active_runs: looks.append(1.0)  # type: ignore[method-assign]
    for second in range(25):
        house.tick(float(second), [])
        if house._thread:
            house._thread.join()
    assert len(looks) == 1 + int(24 // SCAN_S)


def test_a_store_is_scanned(tmp_path: Path) -> None:
    folder = run(tmp_path, "20260101T000000Z", 1, 1)
    (folder / "evidence" / ".alert-1.part.webm").write_bytes(b"x" * 5)
    (one,) = scan_store(tmp_path, [folder]).runs
    assert (one.size, one.active) == (100, True)
    (evidence,) = one.evidence
    assert (evidence.size, len(evidence.files)) == (35, 4)

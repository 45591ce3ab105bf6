"""States beside the journal: bounded in what they write, refused where they are damaged."""

from __future__ import annotations

import random
import zlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from tests.agent.scripted import Scripted, frames
from visup.agent.cycle.agent import Agent
from visup.agent.model.step import Step
from visup.agent.storage.checkpoint import dump_state
from visup.agent.storage.seal import KEY_FILE, own_key, seal
from visup.runs import checkpoints
from visup.runs.checkpoints import CHECKPOINT, COMPRESSED, CheckpointWriter, read_checkpoint
from visup.version import __version__


@pytest.fixture(scope="module")
def two_hours() -> list[Step]:
    """A step for each second."""
    return list(Agent([Scripted("eye", ("x",))]).steps(frames(7200, fps=1.0)))


@pytest.mark.parametrize("size", [100, 400, 3000])
def test_checkpoints_keep_to_their_write_budget(
    two_hours: list[Step], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    monkeypatch.setattr(checkpoints, "BYTES_PER_HOUR", 16_000.0)
    monkeypatch.setattr(checkpoints, "BURST_BYTES", 4_000.0)
    writer = CheckpointWriter(tmp_path, every_s=30.0)
    data = random.Random(1).randbytes(size)  # cannot be compressed
    monkeypatch.setattr(CheckpointWriter, "_serialised", lambda *_: data)
    written = []
    for step in two_hours:
        writer.offer(None, step, dict)  # type: ignore[arg-type]
        if writer._writing is not None:
            writer._writing.result()  # a disk that is quick
        written.append(writer.written)
    writer.close()
    hours = [b - a for a, b in zip(written, written[3600:], strict=False)]
    assert max(hours) <= 16_000 + 4_000 + size
    assert written[-1] >= min(240 * size, 2 * 16_000 - size)  # all that there is room for


@pytest.mark.parametrize(
    ("holder", "name", "fault"),
    [
        (CheckpointWriter, "_serialised", MemoryError()),
        (ThreadPoolExecutor, "submit", RuntimeError("can't start new thread")),
    ],
)
def test_lack_of_memory_for_a_checkpoint_stops_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, holder: type, name: str, fault: Exception
) -> None:
    faults = [fault]
    monkeypatch.setattr(CheckpointWriter, "_serialised", lambda *_: b"later")
    usual = getattr(holder, name)

    def fails_once(*words: object) -> object:
        if faults:
            raise faults.pop()
        return usual(*words)

    monkeypatch.setattr(holder, name, fails_once)
    writer = CheckpointWriter(tmp_path, every_s=1.0)
    for step in Agent([Scripted("eye", ("x",))]).steps(frames(4, fps=1.0)):
        writer.offer(None, step, dict)  # type: ignore[arg-type]
    writer.close()
    assert writer.note is None
    assert (tmp_path / CHECKPOINT).exists()


def write_state(folder: Path, packed: bytes) -> None:
    (folder / CHECKPOINT).write_bytes(seal(packed, own_key()))


SOUND = COMPRESSED + zlib.compress(
    dump_state({"visup": __version__, "frame_index": 7, "agent": {}, "kept": {}})
)


@pytest.mark.parametrize("change", [lambda data: data[40:], lambda data: data[:-1] + b"x", None])
def test_a_checkpoint_of_another_user_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Any
) -> None:
    """Its numbers would go to compiled loops unchecked."""
    data = seal(SOUND, own_key())
    (tmp_path / CHECKPOINT).write_bytes(change(data) if change else data)
    if change is None:
        assert read_checkpoint(tmp_path)[0] is not None
        monkeypatch.setenv(KEY_FILE, str(tmp_path / "other"))
        assert read_checkpoint(tmp_path) == (
            None, "this user has no key to know it by, and it is not read",
        )  # fmt: skip
        assert len(own_key()) == 32
    monkeypatch.setattr(checkpoints, "load_state", lambda _: pytest.fail("it was read"))
    found, why = read_checkpoint(tmp_path)
    assert (found, "another user" in str(why)) == (None, True)


def test_concurrent_processes_share_one_key(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(KEY_FILE, str(tmp_path / "deep" / "key"))
    with ThreadPoolExecutor(8) as pool:
        keys = set(pool.map(lambda _: own_key(), range(8)))
    assert len(keys) == 1
    assert (tmp_path / "deep" / "key").stat().st_mode & 0o777 == 0o600
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["key"]


def test_without_a_key_no_checkpoint_is_saved_and_this_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv(KEY_FILE, str(tmp_path / "file" / "key"))
    writer = CheckpointWriter(tmp_path, every_s=0.1)
    for step in Agent([Scripted("eye", ("x",))]).steps(frames(5, fps=1.0)):
        writer.offer(None, step, dict)  # type: ignore[arg-type]
    writer.close()
    assert KEY_FILE in (writer.note or "")
    assert not (tmp_path / CHECKPOINT).exists()


def test_a_checkpoint_is_compressed_and_read_back(tmp_path: Path) -> None:
    state = {"visup": __version__, "frame_index": 7, "agent": {}, "kept": {"a": [1, 2]}}
    data = dump_state(state)
    write_state(tmp_path, COMPRESSED + zlib.compress(data))
    found, why = read_checkpoint(tmp_path)
    assert why is None
    assert found is not None
    assert (found.frame_index, found.recorder) == (7, {"a": [1, 2]})


def test_a_checkpoint_of_another_version_is_refused_with_its_version(tmp_path: Path) -> None:
    state = {"visup": "0.0.9", "frame_index": 7, "agent": {}, "kept": {}}
    write_state(tmp_path, COMPRESSED + zlib.compress(dump_state(state)))
    assert read_checkpoint(tmp_path) == (None, "its checkpoint is of visup 0.0.9")


def _cut(data: bytes) -> bytes:
    return data[:-5]


def _flipped(data: bytes) -> bytes:
    return data[:40] + bytes([data[40] ^ 1]) + data[41:]


@pytest.mark.parametrize("damage", [_cut, _flipped, lambda data: COMPRESSED, lambda data: data[:3]])
def test_a_damaged_checkpoint_is_refused_with_the_reason(tmp_path: Path, damage: Any) -> None:
    data = dump_state({"visup": __version__, "frame_index": 7, "agent": {}, "kept": {}})
    write_state(tmp_path, damage(COMPRESSED + zlib.compress(data)))
    found, why = read_checkpoint(tmp_path)
    assert found is None
    assert why


def test_an_oversized_checkpoint_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoints, "MAX_STATE_BYTES", 10**6)
    write_state(tmp_path, COMPRESSED + zlib.compress(bytes(10**8)))
    assert read_checkpoint(tmp_path) == (None, "it is cut off or too large")

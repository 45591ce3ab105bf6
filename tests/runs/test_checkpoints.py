"""States beside the journal: bounded in what they write, refused where they are damaged."""

from __future__ import annotations

import random
import zlib
from pathlib import Path
from typing import Any

import pytest

from tests.agent.scripted import Scripted, frames
from visup.agent.cycle.agent import Agent
from visup.agent.storage.checkpoint import dump_state
from visup.runs import checkpoints
from visup.runs.checkpoints import CHECKPOINT, PACKED, CheckpointWriter, read_checkpoint
from visup.version import __version__


@pytest.mark.parametrize("size", [100, 400, 3000])
def test_states_write_no_more_than_they_may_in_an_hour(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    monkeypatch.setattr(checkpoints, "BYTES_AN_HOUR", 16_000.0)
    monkeypatch.setattr(checkpoints, "BYTES_AT_ONCE", 4_000.0)
    writer = CheckpointWriter(tmp_path, every_s=30.0)
    data = random.Random(1).randbytes(size)  # cannot be compressed
    monkeypatch.setattr(CheckpointWriter, "_frozen", lambda *_: data)
    written = []
    for step in Agent([Scripted("eye", ("x",))]).steps(frames(7200, fps=1.0)):
        writer.offer(None, step, dict)  # type: ignore[arg-type]
        if writer._writing is not None:
            writer._writing.result()  # a disk that is quick
        written.append(writer.written)
    writer.close()
    hours = [b - a for a, b in zip(written, written[3600:], strict=False)]
    assert max(hours) <= 16_000 + 4_000 + size
    assert written[-1] >= min(240 * size, 2 * 16_000 - size)  # all that there is room for


def test_a_state_is_compressed_and_reads_back(tmp_path: Path) -> None:
    state = {"visup": __version__, "frame_index": 7, "agent": {}, "kept": {"a": [1, 2]}}
    data = dump_state(state)
    (tmp_path / CHECKPOINT).write_bytes(PACKED + zlib.compress(data))
    found, why = read_checkpoint(tmp_path)
    assert why is None
    assert found is not None
    assert (found.frame_index, found.kept) == (7, {"a": [1, 2]})


def _cut(data: bytes) -> bytes:
    return data[:-5]


def _flipped(data: bytes) -> bytes:
    return data[:40] + bytes([data[40] ^ 1]) + data[41:]


@pytest.mark.parametrize("damage", [_cut, _flipped, lambda data: PACKED, lambda data: data[:3]])
def test_a_damaged_state_is_none_and_says_why(tmp_path: Path, damage: Any) -> None:
    data = dump_state({"visup": __version__, "frame_index": 7, "agent": {}, "kept": {}})
    (tmp_path / CHECKPOINT).write_bytes(damage(PACKED + zlib.compress(data)))
    found, why = read_checkpoint(tmp_path)
    assert found is None
    assert why


def test_a_state_that_would_fill_the_memory_is_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(checkpoints, "LARGEST_STATE_BYTES", 10**6)
    (tmp_path / CHECKPOINT).write_bytes(PACKED + zlib.compress(bytes(10**8)))
    assert read_checkpoint(tmp_path) == (None, "it is cut off or too large")

"""Files of others are read within bounds, and cost what they hold rather than what they might."""

from __future__ import annotations

import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.storage.text_file import CHUNK_BYTES, read_bounded


@given(size=st.integers(0, 3 * CHUNK_BYTES), most=st.integers(0, 3 * CHUNK_BYTES))
def test_a_file_is_read_completely_or_refused(
    tmp_path_factory: pytest.TempPathFactory, size: int, most: int
) -> None:
    path = tmp_path_factory.getbasetemp() / "some file"
    content = bytes(size)
    path.write_bytes(content)
    if size > most:
        with pytest.raises(OSError, match="larger than"):
            read_bounded(path, most)
    else:
        assert read_bounded(path, most) == content


def peak_memory(read: Callable[[], object]) -> int:
    """Bytes that reading takes at most."""
    tracemalloc.start()
    try:
        read()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_memory_is_allocated_for_the_actual_content(tmp_path: Path) -> None:
    path = tmp_path / "small"
    path.write_bytes(b"small")
    assert peak_memory(lambda: read_bounded(path, 2**32)) < 4 * CHUNK_BYTES


def test_a_too_large_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = tmp_path / "large"
    with path.open("wb") as file:
        file.truncate(2**33)  # takes no room on the disk

    def refused() -> None:
        with pytest.raises(OSError, match="larger than 1024 MB"):
            read_bounded(path, 2**30)

    assert peak_memory(refused) < 4 * CHUNK_BYTES


def test_a_pipe_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(OSError, match="not a file"):
        read_bounded(path, 10)

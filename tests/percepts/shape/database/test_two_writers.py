"""Two processes that add to one model database at once lose nothing."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from visup.agent.model.errors import OutputError
from visup.agent.storage import file_lock
from visup.agent.storage.file_lock import acquire_lock
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.taught.taught_view import taught_view

SQUARE = [[10.0, 10.0], [40.0, 10.0], [40.0, 40.0], [10.0, 40.0]]


def teach(path: Path, writer: int) -> None:
    image = np.full((60, 60, 3), 40 * writer + 30, np.uint8)
    ModelDatabase.open_or_new(path).teach([taught_view(f"thing {writer}", image, SQUARE)])


def concurrent_writes(path: Path, writers: int) -> list[int]:
    """Let processes teach a thing each, at the same moment; their exit codes."""
    ready, go = os.pipe()
    children = []
    for writer in range(writers):
        if (child := os.fork()) == 0:
            code = 1
            try:
                os.close(go)
                os.read(ready, 1)  # until the parent closes it
                teach(path, writer)
                code = 0
            finally:
                os._exit(code)
        children.append(child)
    os.close(ready)
    os.close(go)
    return [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]


@pytest.mark.parametrize("begun", [False, True])
def test_concurrent_writers_lose_no_taught_view(tmp_path: Path, begun: bool) -> None:
    for k in range(5):
        path = tmp_path / f"{k}.models"
        if begun:
            ModelDatabase.create(path)
        assert concurrent_writes(path, 3) == [0, 0, 0]
        assert sorted(ModelDatabase.open(path).names()) == [f"thing {n}" for n in range(3)]


def test_a_writer_that_waits_too_long_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.models"
    database = ModelDatabase.create(path)
    monkeypatch.setattr(file_lock, "WAIT_S", 0.05)
    lock = acquire_lock(path, "this model database")
    try:
        with pytest.raises(OutputError, match="another visup is writing this model database"):
            database.add(())
    finally:
        lock.release()
    assert database.add(()).names() == ()

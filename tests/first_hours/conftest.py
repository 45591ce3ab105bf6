"""What a newcomer types: the command in an empty folder, and a small clip."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip


@pytest.fixture
def visup(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> Call:
    monkeypatch.chdir(tmp_path)
    return caller(monkeypatch, capfd)


@pytest.fixture
def clip(tmp_path: Path) -> Path:
    return write_clip(tmp_path / "clip.avi", moving_disc())

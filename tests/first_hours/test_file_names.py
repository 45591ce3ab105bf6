"""Names on disk are bytes: whatever they are, visup reads and writes them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from tests.paths import ROOT

BOTH = """
import sys
from visup.cli import main

source, run = sys.argv[1:]
for words in (["watch", source, "--out", run], ["replay", run]):
    sys.argv[1:] = words
    try:
        main()
    except SystemExit as end:
        if end.code:
            raise
"""

BARE = {"LC_ALL": "POSIX", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.mark.parametrize(
    ("name", "surroundings"),
    [(b"caf\xe9.avi", {}), ("\u00fcn\u00ef.avi".encode(), BARE)],
    ids=["latin-1", "POSIX"],
)
def test_any_file_name_can_be_watched_recorded_and_replayed(
    tmp_path: Path, name: bytes, surroundings: dict[str, str]
) -> None:
    """In a process of its own: it was one that died."""
    source, run = os.fsencode(tmp_path) + b"/" + name, os.fsencode(tmp_path) + b"/run-" + name[:4]
    write_clip(tmp_path / "clip.avi", moving_disc(12)).rename(os.fsdecode(source))
    known = {k: v for k, v in os.environ.items() if k not in ("LANG", "LC_CTYPE")}
    env = {**known, **surroundings, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", BOTH, source, run], env=env, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert b"12 frames replayed" in done.stdout
    assert {p.name for p in Path(os.fsdecode(run)).iterdir()} >= {"annotated.webm", "report.html"}

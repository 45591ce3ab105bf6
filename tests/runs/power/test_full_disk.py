"""A disk that is full: told, with an exit code, and nothing half-written is left."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from tests.paths import ROOT

INSIDE = ("--user", "--map-root-user", "--mount")
SCRIPT = """
mount -t tmpfs -o size={size}k visup "$1" || exit 77
"{python}" -m visup.cli watch "$2" --out "$1/run" > "$3" 2>&1
code=$?
ls -a "$1" "$1/run" >> "$3" 2>/dev/null
exit $code
"""


def can_mount() -> bool:
    if shutil.which("unshare") is None:
        return False
    tried = ["unshare", *INSIDE, "sh", "-c", "mount -t tmpfs none /mnt"]
    return subprocess.run(tried, capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not can_mount(), reason="no small disk can be made here")
@pytest.mark.parametrize("size_kb", [200])
def test_a_full_disk_is_reported_and_leaves_no_temporary_files(
    tmp_path: Path, size_kb: int
) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(12, size=(320, 240)), fps=10.0)
    small, told = tmp_path / "small", tmp_path / "told"
    small.mkdir()
    script = SCRIPT.format(size=size_kb, python=sys.executable)
    done = subprocess.run(
        ["unshare", *INSIDE, "sh", "-c", script, "sh", str(small), str(clip), str(told)],
        check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONDONTWRITEBYTECODE": "1"},
    )
    said = told.read_text()
    assert "Traceback" not in said
    assert done.returncode in (1, 2, 5), said
    assert ".part" not in said

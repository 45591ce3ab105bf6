"""A user who may write nowhere but to the run folder: all works, and what is slower for it is told once."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.paths import ROOT

NOBODY = 65534


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder that others may look into; those of pytest they may not."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


@pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root can become somebody who may write nowhere",
)
def test_visup_can_be_imported_on_a_read_only_disk(place: Path) -> None:
    home, folder, code = place / "home", place / "folder", place / "code"
    for path in (home, folder):
        path.mkdir()
    home.chmod(0o555)
    os.chown(folder, NOBODY, NOBODY)
    # A copy that was never compiled: as site-packages of somebody else.
    ignored = shutil.ignore_patterns("__pycache__", ".*", "docs", "tests", "examples")
    shutil.copytree(ROOT, code, symlinks=True, ignore=ignored)
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}
    if subprocess.run(
        as_nobody(sys.executable, "-c", ""), check=False, capture_output=True
    ).returncode:
        pytest.skip("the interpreter itself cannot be read by others here")
    done = subprocess.run(
        as_nobody(sys.executable, "-c", LOADED),
        cwd=folder,
        env={
            **environment,
            "HOME": str(home),
            "PYTHONPATH": str(code),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "compiled anew" in done.stdout
    assert "NUMBA_CACHE_DIR" in done.stdout


LOADED = """
import visup.runs.runner
from visup.compiled import cache_note
print(cache_note())
"""
"""All that a run loads; `.ci/run` has such a user replay a whole run."""


def as_nobody(*command: str) -> list[str]:
    who = ["--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups"]
    return ["setpriv", *who, *command]

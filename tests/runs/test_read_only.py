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
AS_NOBODY = ("setpriv", "--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups")

pytestmark = pytest.mark.skipif(
    os.geteuid() != 0 or shutil.which("setpriv") is None,
    reason="only root can become somebody who may write nowhere",
)


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder that others may look into (those of pytest they may not), with a copy of visup's code.

    The code was never compiled, as the site-packages of somebody else.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        (folder / "home").mkdir(mode=0o555)
        ignored = shutil.ignore_patterns("__pycache__", ".*", "docs", "tests", "examples")
        shutil.copytree(ROOT, folder / "code", symlinks=True, ignore=ignored)
        yield folder


def answer(place: Path, program: str, *user: str) -> str:
    """What a program prints that is run by a user without a home of their own."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}
    done = subprocess.run(
        [*user, sys.executable, "-c", program],
        cwd=place,
        env={
            **environment,
            "HOME": str(place / "home"),
            "PYTHONPATH": str(place / "code"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(autouse=True)
def _readable_interpreter(place: Path) -> None:
    if subprocess.run(
        [*AS_NOBODY, sys.executable, "-c", ""], check=False, capture_output=True
    ).returncode:
        pytest.skip("the interpreter itself cannot be read by others here")


def test_visup_can_be_imported_on_a_read_only_disk(place: Path) -> None:
    # All that a run loads; `.ci/run` has such a user replay a whole run.
    told = answer(
        place,
        "import visup.runs.runner\nfrom visup.compiled import cache_note\nprint(cache_note())",
        *AS_NOBODY,
    )
    assert "compiled anew" in told
    assert "NUMBA_CACHE_DIR" in told


def test_loops_that_another_user_has_compiled_are_read(place: Path) -> None:
    (place / "code" / "sums.py").write_text(SUMS)
    whole = "import sums; print(sums.added(1, 2), sums.cache_note())"
    answer(place, whole)
    assert answer(place, whole, *AS_NOBODY) == "3 None\n"
    other = answer(place, whole.replace("1, 2", "0.5, 2"), *AS_NOBODY)
    assert other.startswith("2.5 Hot loops are compiled anew")


SUMS = """
from visup.compiled import cache_note, compiled

@compiled
def added(a, b):
    return a + b
"""

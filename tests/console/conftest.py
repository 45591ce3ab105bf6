"""One console for all tests that need a real one: a process of its own, over a folder of recorded runs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.console.evidence_files import keep_evidence
from tests.console.test_runs import SETTINGS, doubtful
from visup.api.recorded import open_run

OPERATOR, VIEWER = "operator-token-of-this-test", "viewer-token-of-this-test"
SECRET = "what stands outside of the folders"


@pytest.fixture(scope="package")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recorded runs, and beside their folder what nobody may read."""
    folder = tmp_path_factory.mktemp("console") / "library"
    record(folder / "evening", meeting(), SETTINGS)
    record(folder / "<b>morning", meeting(30), SETTINGS)
    record(folder / "who-is-it", doubtful(), SETTINGS)
    record(folder / "yard-run", meeting(), SETTINGS, ended=None, camera="yard")
    for name in ("evening", "yard-run"):
        for alert in open_run(folder / name).alerts:
            keep_evidence(folder / name, alert.id)
    for name in ("secret.txt", "alert-1.jpg"):
        (folder.parent / name).write_text(SECRET)
    return folder


@pytest.fixture(scope="package")
def console(folder: Path) -> Iterator[str]:
    """The address of a console, ending in a slash; whatever is asked of it, it never fails inside."""
    saved, told = folder.parent / "saved", folder.parent / "stderr"
    saved.mkdir()
    tokens = {"VISUP_CONSOLE_TOKEN": OPERATOR, "VISUP_CONSOLE_VIEWER_TOKEN": VIEWER}
    command = [sys.executable, "-m", "visup.cli", "console", str(folder), "--port", "0"]
    with (
        told.open("w") as errors,
        subprocess.Popen(
            [*command, "--save-to", str(saved)],
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env={**os.environ, **tokens},
        ) as process,
    ):
        assert process.stdout is not None
        line = process.stdout.readline()
        assert "token=" in line, told.read_text()
        yield line.split()[-1].partition("?")[0]
        process.terminate()
    assert "Traceback" not in told.read_text(), told.read_text()[-3000:]

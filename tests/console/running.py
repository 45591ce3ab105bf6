"""A console in its own process, over a folder of runs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

OPERATOR, VIEWER = "operator-token-of-this-test", "viewer-token-of-this-test"


@contextmanager
def running_console(folder: Path, saved: Path) -> Iterator[str]:
    """The address of a console, ending in a slash; fails if it prints a traceback.

    Args:
        folder: Folder of recorded runs.
        saved: Empty folder for texts saved by operators; the log of errors is written next to it.
    """
    log = saved.parent / "stderr"
    tokens = {"VISUP_CONSOLE_TOKEN": OPERATOR, "VISUP_CONSOLE_VIEWER_TOKEN": VIEWER}
    command = [sys.executable, "-m", "visup.cli", "console", str(folder), "--port", "0"]
    with (
        log.open("w") as errors,
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
        assert "token=" in line, log.read_text()
        yield line.split()[-1].partition("?")[0]
        process.terminate()
    assert "Traceback" not in log.read_text(), log.read_text()[-3000:]

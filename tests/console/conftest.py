"""One console for all tests that need a server: in its own process, over a folder of recorded runs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record
from tests.console.evidence_files import write_evidence
from tests.console.running import running_console
from tests.console.test_runs import SETTINGS, ambiguous_observations
from tests.teaching.browser import Browser, found_browser
from visup.api.recorded import open_run

SECRET = "what stands outside of the folders"


@pytest.fixture(scope="package")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Recorded runs, and next to their folder files that nobody may read."""
    folder = tmp_path_factory.mktemp("console") / "library"
    record(folder / "evening", meeting(), SETTINGS)
    record(folder / "<b>morning", meeting(30), SETTINGS)
    record(folder / "who-is-it", ambiguous_observations(), SETTINGS)
    record(folder / "yard-run", meeting(), SETTINGS, ended=None, camera="yard")
    for name in ("evening", "yard-run"):
        for alert in open_run(folder / name).alerts:
            write_evidence(folder / name, alert.id)
    for name in ("secret.txt", "alert-1.jpg"):
        (folder.parent / name).write_text(SECRET)
    return folder


@pytest.fixture(scope="package")
def console(folder: Path) -> Iterator[str]:
    """The address of a console, ending in a slash."""
    saved = folder.parent / "saved"
    saved.mkdir()
    with running_console(folder, saved) as address:
        yield address


@pytest.fixture
def address(console: str) -> str:
    found_browser()
    return console


@pytest.fixture(scope="package")
def started_browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """One process for all tests: to start one takes as long as many of them, and its cache is empty."""
    found_browser()
    with Browser(tmp_path_factory.mktemp("browser") / "profile", (1280, 860)) as browser:
        yield browser


@pytest.fixture
def browser(started_browser: Browser) -> Iterator[Browser]:
    """A browser with a new page, signed in nowhere."""
    started_browser.new_page()
    yield started_browser
    assert started_browser.value("window.troubles || []") == []

"""A run that goes on, in a real browser: its page grows, and its questions are answered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import rmtree

from tests.archive.recordings import meeting, record
from tests.console.browsing import enter, follow, open_run, press, shows, tab, violations
from tests.console.running import OPERATOR, VIEWER
from tests.console.test_runs import SETTINGS, doubtful
from tests.teaching.browser import Browser
from visup.agent import Observation
from visup.runs.inputs.answer_box import ANSWERS


def test_a_question_is_answered_to_see_what_would_have_followed(
    browser: Browser, address: str
) -> None:
    open_run(browser, address, VIEWER, "who-is-it")
    browser.press("End")
    shows(browser, "Is object 1 the satellite or the arm?")
    assert not browser.value("document.body?.innerText.includes('if answered')")
    open_run(browser, address, OPERATOR, "who-is-it")
    browser.press("End")
    shows(browser, "if answered")
    press(browser, "spartan")
    shows(browser, "as if object 1 were said to be spartan")
    assert violations(browser) == []


def test_a_page_follows_a_run_that_goes_on(browser: Browser, address: str, folder: Path) -> None:
    rows = "document.querySelector('.labels').innerText"

    def looked_at() -> Iterator[Observation]:
        for number, perceived in enumerate(meeting()):
            if number == 30:
                enter(browser, address)
                follow(browser, "live")
                browser.press("End")
                shows(browser, "frame 2")
                assert "captured" not in browser.value(rows)
                shows(browser, "running")
            yield perceived

    try:
        record(folder / "live", looked_at(), SETTINGS)
        shows(browser, "frame 59")
        browser.until("document.querySelector('header')?.innerText.includes('interrupted')")
        assert "captured" in browser.value(rows)
        tab(browser, "Events")
        shows(browser, "Task 'dock' is interrupted")
        assert violations(browser) == []
    finally:
        rmtree(folder / "live")


def test_a_run_that_goes_on_is_answered(browser: Browser, address: str, folder: Path) -> None:
    record(folder / "live", doubtful(), SETTINGS, ended=None)
    try:
        enter(browser, address)
        follow(browser, "live")
        browser.press("End")
        shows(browser, "answer:")
        press(browser, "spartan")
        shows(browser, "Sent to the run")
        assert (folder / "live" / ANSWERS).read_text() == "1=spartan\n"
    finally:
        rmtree(folder / "live")

"""A live run in a real browser: its page grows, and its questions can be answered."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import rmtree

from tests.archive.recordings import meeting, record
from tests.console.browsing import (
    accessibility_violations,
    open_from_list,
    open_run,
    open_tab,
    press_button,
    sign_in,
    wait_for_text,
)
from tests.console.running import OPERATOR, VIEWER
from tests.console.test_runs import SETTINGS, ambiguous_observations
from tests.teaching.browser import Browser
from visup.agent import Observation
from visup.runs.inputs.answer_box import ANSWERS


def test_consequences_of_an_answer_are_shown(browser: Browser, address: str) -> None:
    open_run(browser, address, VIEWER, "who-is-it")
    browser.press("End")
    wait_for_text(browser, "Is object 1 the satellite or the arm?")
    assert not browser.value("document.body?.innerText.includes('if answered')")
    open_run(browser, address, OPERATOR, "who-is-it")
    browser.press("End")
    wait_for_text(browser, "if answered")
    press_button(browser, "spartan")
    wait_for_text(browser, "as if object 1 were said to be spartan")
    assert accessibility_violations(browser) == []


def test_a_page_follows_a_live_run(browser: Browser, address: str, folder: Path) -> None:
    rows = "document.querySelector('.labels').innerText"

    def observations() -> Iterator[Observation]:
        for number, observation in enumerate(meeting()):
            if number == 30:
                sign_in(browser, address)
                open_from_list(browser, "live")
                browser.press("End")
                wait_for_text(browser, "frame 2")
                assert "captured" not in browser.value(rows)
                wait_for_text(browser, "running")
            yield observation

    try:
        record(folder / "live", observations(), SETTINGS)
        wait_for_text(browser, "frame 59")
        browser.until("document.querySelector('header')?.innerText.includes('interrupted')")
        assert "captured" in browser.value(rows)
        open_tab(browser, "Events")
        wait_for_text(browser, "Task 'dock' is interrupted")
        assert accessibility_violations(browser) == []
    finally:
        rmtree(folder / "live")


def test_an_answer_is_sent_to_a_live_run(browser: Browser, address: str, folder: Path) -> None:
    record(folder / "live", ambiguous_observations(), SETTINGS, ended=None)
    try:
        sign_in(browser, address)
        open_from_list(browser, "live")
        browser.press("End")
        wait_for_text(browser, "answer:")
        press_button(browser, "spartan")
        wait_for_text(browser, "Sent to the run")
        assert (folder / "live" / ANSWERS).read_text() == "1=spartan\n"
    finally:
        rmtree(folder / "live")

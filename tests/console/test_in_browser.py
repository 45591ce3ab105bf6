"""The console in a real browser; errors of scripts fail the tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import rmtree

import numpy as np

from tests.archive.recordings import record
from tests.clips import write_clip
from tests.console.browsing import (
    RECORD_ERRORS,
    accessibility_violations,
    open_from_list,
    open_run,
    open_tab,
    press_button,
    sign_in,
    toggle_checkbox,
    wait_for_text,
)
from tests.console.running import OPERATOR, VIEWER
from tests.console.test_runs import SETTINGS, ambiguous_observations
from tests.paths import ROOT
from tests.teaching.browser import Browser
from visup.console.feedback import read_feedback
from visup.console.workbench.object_teaching import MODELS
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.runs.inputs.zones import load_zones


def test_a_run_can_be_searched_and_opened(browser: Browser, address: str) -> None:
    sign_in(browser, address)
    browser.until("document.querySelectorAll('.runs tbody tr').length == 4")
    wait_for_text(browser, "<b>morning")
    assert "token" not in browser.value("location.href")
    browser.value("document.querySelector('input[aria-label=\"Search runs\"]').focus()")
    browser.type("dock even")
    browser.until("document.querySelectorAll('.runs tbody tr').length == 1")
    browser.value("document.querySelector('.runs a').click()")
    wait_for_text(browser, "frame 0")
    wait_for_text(browser, "approach")


def test_one_cursor_moves_picture_timeline_and_beliefs(browser: Browser, address: str) -> None:
    open_run(browser, address)
    x, y, w, _ = browser.value(
        "(() => { const r = document.querySelector('.bars').getBoundingClientRect();"
        "return [r.x, r.y, r.width, r.height]; })()"
    )
    browser.click(x + 0.5 * w, y + 8)
    browser.until("/29|30/.test(document.querySelector('img.picture').src.split('/').pop())")
    wait_for_text(browser, "frame 29")
    browser.press("ArrowRight")
    wait_for_text(browser, "frame 30")
    browser.press("End")
    wait_for_text(browser, "frame 59")
    browser.press("Home")
    wait_for_text(browser, "frame 0")
    browser.press("n")
    browser.until("document.body && !document.body.innerText.includes('frame 0')")
    browser.press("End")
    wait_for_text(browser, "frame 59")
    browser.press(*["ArrowLeft"] * 8)
    wait_for_text(browser, "frame 51")
    browser.press(" ")  # plays from here on
    wait_for_text(browser, "frame 59")


def test_relations_are_overlaid_and_a_click_shows_the_identity(
    browser: Browser, address: str
) -> None:
    open_run(browser, address)
    browser.press("End")
    wait_for_text(browser, "frame 59")
    wait_for_text(browser, "captured")
    assert browser.value("document.querySelectorAll('svg.flow .box').length") == 2
    toggle_checkbox(browser, "relations")
    toggle_checkbox(browser, "trails")
    browser.until("document.querySelectorAll('.overlay .vector').length == 1")
    assert browser.value("document.querySelector('.overlay .vector text').textContent") in (
        "diverging",
        "converging",
    )
    browser.until("!!document.querySelector('.overlay .trail')")
    knob = "document.querySelectorAll('.overlay .vector circle')[1].getBoundingClientRect()"
    x, y = browser.value(f"(() => {{ const r = {knob}; return [r.x + 2, r.y + 2]; }})()")
    browser.click(x, y)
    browser.until("document.body?.innerText.toUpperCase().includes('IDENTITY OF OBJECT 2')")
    browser.until("!!document.querySelector('.overlay .chosen')")
    wait_for_text(browser, "0.90")
    toggle_checkbox(browser, "relations")
    browser.until("document.querySelectorAll('.overlay .vector').length == 0")


def test_why_and_what_if_are_answered(browser: Browser, address: str) -> None:
    open_run(browser, address)
    browser.press("End")
    wait_for_text(browser, "frame 59")
    open_tab(browser, "Ask")
    press_button(browser, "identity 1")
    wait_for_text(browser, "[frame")
    open_tab(browser, "What if")
    browser.until("document.querySelector('input[aria-label=\"What is assumed\"]')")
    browser.value("document.querySelector('input[aria-label=\"What is assumed\"]').focus()")
    browser.type("object 99 arm")
    press_button(browser, "Try")
    wait_for_text(browser, "there is no object 99")


def test_breakpoints_and_phases_work_on_the_page(browser: Browser, address: str) -> None:
    open_run(browser, address)
    open_tab(browser, "Steps")
    press_button(browser, "Continue")
    wait_for_text(browser, "alert: ")
    browser.until("!document.body?.innerText.includes('frame 0')")
    field = "document.querySelector('input[aria-label=\"Where to stop\"]')"
    browser.value(f"{field}.focus()")
    browser.type("when gap(")
    browser.press("Enter")
    wait_for_text(browser, "when gap(")
    press_button(browser, "Continue")
    browser.until("document.querySelector('[role=status]')?.innerText.includes('ends too early')")
    for phase in ("perceive", "update", "cogitate"):
        press_button(browser, "Next phase")
        browser.until(
            f"[...document.querySelectorAll('.phase')].some(p => p.innerText == '{phase}')"
        )
    assert accessibility_violations(browser) == []


def choose_option(browser: Browser, label: str, option: str) -> None:
    x, y = browser.value(
        f"(() => {{ const r = document.querySelector('[aria-label=\"{label}\"]').closest('.q-field')"
        ".getBoundingClientRect(); return [r.x + 20, r.y + r.height / 2]; })()"
    )
    browser.click(x, y)
    item = f"[...document.querySelectorAll('.q-item')].find(i => i.innerText.trim() == '{option}')"
    browser.until(f"!!{item}")
    browser.value(f"{item}.click()")


def test_a_task_is_checked_and_tried_and_a_zone_is_drawn_and_saved(
    browser: Browser, address: str, folder: Path
) -> None:
    open_run(browser, address)
    open_tab(browser, "Write")
    browser.until("document.querySelector('.cm-content')?.getAttribute('aria-label') == 'Text'")
    browser.value("document.querySelector('.cm-content').focus()")
    browser.type("<go> ::= convrging(arm, satellite)")
    browser.until("!!document.querySelector('.cm-line.fault-line')")
    wait_for_text(browser, "converging")
    browser.value("document.activeElement.blur()")  # its cursor blinks for ever
    assert accessibility_violations(browser) == []
    browser.value("document.querySelector('.cm-content').focus()")
    browser.value("document.execCommand('selectAll')")
    browser.type("<go> ::= converging(arm, satellite)")
    wait_for_text(browser, "No mistakes.")
    press_button(browser, "Try it on this run")
    wait_for_text(browser, "verdict:")
    browser.value("document.querySelector('.cm-content').focus()")
    browser.value("document.execCommand('selectAll')")
    browser.press("Backspace")
    choose_option(browser, "What is written", "zones")
    wait_for_text(browser, "Click the corners")
    browser.value("document.querySelector('.q-toggle').click()")
    x, y, w, h = browser.settled(
        "(() => { const r = document.querySelector('svg.overlay').getBoundingClientRect();"
        "return [r.x, r.y, r.width, r.height]; })()",
    )
    for count, (u, v) in enumerate(((0.4, 0.3), (0.6, 0.3), (0.5, 0.7)), 1):
        browser.click(x + u * w, y + v * h)
        browser.until(f"document.querySelectorAll('.overlay .corner').length == {count}")
    browser.value("document.querySelector('[aria-label=\"Name of the zone\"]').focus()")
    browser.type("dock")
    press_button(browser, "Add zone")
    wait_for_text(browser, "[[zone]]")
    browser.value("document.querySelector('[aria-label=\"Name of the file\"]').focus()")
    browser.type("mine")
    press_button(browser, "Save")
    wait_for_text(browser, "saved as mine.toml")
    (zone,) = load_zones(folder.parent / "saved" / "mine.toml")
    assert (zone.name, len(zone.polygon)) == ("dock", 3)


def test_an_object_is_compared_with_views_and_taught(
    browser: Browser, address: str, folder: Path
) -> None:
    models = ROOT / "visup" / "data" / "demo.models"
    clip = write_clip(
        folder.parent / "alike.avi", [np.full((480, 640, 3), 90, np.uint8)] * 60, 10.0
    )
    record(
        folder / "alike",
        ambiguous_observations(),
        replace(SETTINGS, models=models),
        source=str(clip),
    )
    try:
        sign_in(browser, address)
        open_from_list(browser, "alike")
        browser.press("End")
        wait_for_text(browser, "frame 59")
        browser.until("!!document.querySelector('[aria-label=\"identity of object 1\"]')")
        browser.value("document.querySelector('[aria-label=\"identity of object 1\"]').click()")
        press_button(browser, "Compare views")
        browser.until("document.querySelector('.likeness img')?.naturalWidth > 1000")
        assert accessibility_violations(browser) == []
        press_button(browser, "Close")
        browser.until("!document.querySelector('.likeness')")
        browser.value("document.querySelector('[aria-label=\"Name of the model\"]').focus()")
        browser.type("box")
        press_button(browser, "Remember as a model")
        wait_for_text(browser, "is known from now on")
        known = ModelDatabase.open(folder.parent / "saved" / MODELS)
        assert [v.name for v in known.taught] == ["box"]
    finally:
        rmtree(folder / "alike")


def test_only_operators_can_give_feedback_on_alerts(
    browser: Browser, address: str, folder: Path
) -> None:
    open_run(browser, address, VIEWER)
    open_tab(browser, "Alerts")
    wait_for_text(browser, "only alerts open")
    assert not browser.value("document.body?.innerText.includes('false alarm')")
    browser.open(f"{address}?token={OPERATOR}")
    open_run(browser, address)
    open_tab(browser, "Alerts")
    press_button(browser, "false alarm")
    browser.until("!!document.querySelector('.opinion')")
    end = [f.opinion for f in read_feedback(folder / "evening").values()]
    assert end == ["false alarm"]


def test_the_wall_shows_alerts_with_pictures_and_stores_feedback(
    browser: Browser, address: str, folder: Path
) -> None:
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=RECORD_ERRORS)
    browser.open(f"{address}wall?token={VIEWER}")
    loaded = "document.querySelector('.evidence img')?.naturalWidth > 0"
    browser.until(loaded)
    assert not browser.value("document.body?.innerText.includes('false alarm')")
    browser.open(f"{address}wall?token={OPERATOR}")
    browser.until(loaded)
    assert accessibility_violations(browser) == []
    browser.value("document.querySelector('button.evidence').click()")
    browser.until("document.querySelector('.evidence-large video')?.readyState > 1")
    press_button(browser, "Close")
    browser.until("!document.querySelector('.evidence-large')")
    press_button(browser, "seen")
    browser.until("!!document.querySelector('.opinion')")
    assert [f.opinion for f in read_feedback(folder / "yard-run").values()] == ["seen"]
    browser.value("document.querySelector('input[aria-label=\"Search alerts\"]').focus()")
    browser.type("nowhere")
    wait_for_text(browser, "No such alerts.")


def test_all_panels_are_accessible(browser: Browser, address: str) -> None:
    browser.open(f"{address}?token={OPERATOR}")
    browser.until("document.querySelectorAll('.runs tbody a').length == 4")
    assert accessibility_violations(browser) == []
    open_run(browser, address)
    for name, text in (
        ("Now", "approach"),
        ("Events", "in view"),
        ("Alerts", "only alerts open"),
        ("Ask", "Why?"),
        ("What if", "from the cursor on"),
    ):
        open_tab(browser, name)
        wait_for_text(browser, text)
        assert accessibility_violations(browser) == [], name
    browser.value("document.querySelector('[aria-label=\"Dark or light\"]').click()")
    browser.until("document.body.classList.contains('body--dark')")
    assert accessibility_violations(browser) == []


def test_pages_fit_a_phone(browser: Browser, address: str) -> None:
    browser.call(
        "Emulation.setDeviceMetricsOverride",
        width=390,
        height=780,
        deviceScaleFactor=1,
        mobile=True,
    )
    open_run(browser, address)
    # An icon without its font is a long word.
    browser.until("document.fonts.status == 'loaded'")
    browser.until("document.documentElement.scrollWidth <= 390")
    browser.value("document.querySelector('a[href=\"/wall\"]').click()")
    wait_for_text(browser, "picture of alert")
    assert browser.value("document.documentElement.scrollWidth") <= 390

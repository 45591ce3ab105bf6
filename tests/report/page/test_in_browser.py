"""The page in a real browser: one cursor for video, figures and text; the filter of alerts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from tests.report.page.test_html import data
from tests.report.scene import FPS, run
from tests.teaching.browser import Browser
from visup.agent import Alert, Severity
from visup.report.page.html import write_report
from visup.report.video import AnnotatedVideo

KINDS = ("near_miss", "near_miss", "exit", "stage_failing")
ALERTS = tuple(
    Alert(n, kind, Severity.WARNING, 1.0 + n, 2.0, (), f"Sentence {n}.", closed=None if n else 3.0)
    for n, kind in enumerate(KINDS)
)


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    folder = tmp_path_factory.mktemp("report")
    with AnnotatedVideo(folder / "annotated.webm", FPS) as video:
        for step, frame in run((160, 120), "dock"):
            video.add(step, frame)
    shown = replace(data(), videos=("annotated.webm",), alerts=ALERTS)
    write_report(shown, folder / "report.html")
    with Browser(folder / "browser") as browser:
        browser.open((folder / "report.html").as_uri())
        browser.until("document.querySelector('#cursor video')?.readyState >= 1")
        yield browser


def moved_to(page: Browser, seconds: float) -> None:
    page.value(
        "(() => { const s = document.querySelector('#cursor input');"
        f" s.value = {seconds}; s.dispatchEvent(new Event('input')); }})()"
    )


def test_the_video_is_hidden_until_a_moment_is_chosen(page: Browser) -> None:
    page.open(page.value("location.href"))
    video = "document.querySelector('#cursor video')"
    page.until(f"{video}?.readyState >= 1")
    height = f"{video}.getBoundingClientRect().height"
    fold = "document.querySelector('#cursor [data-fold]')"
    assert page.value(height) == 0
    assert page.value(f"{fold}.getAttribute('aria-expanded')") == "false"
    moved_to(page, 2.0)
    assert page.value(height) > 50
    assert page.value(f"{fold}.getAttribute('aria-expanded')") == "true"
    page.value(f"{fold}.click()")
    moved_to(page, 3.0)
    assert page.value(height) == 0, "what the user has folded stays so"


def test_the_slider_moves_video_figures_and_text(page: Browser) -> None:
    video = "document.querySelector('#cursor video')"
    page.until(f"{video}.readyState >= 1")  # else it cannot be moved yet
    moved_to(page, 4.0)
    page.until(f"!{video}.seeking && {video}.currentTime > 0")
    share = page.value(f"{video}.currentTime / {video}.duration")
    assert share == pytest.approx(4.0 / data().duration, abs=0.02)
    told = page.value("Number(document.querySelector('.told[aria-current]').dataset.time)")
    assert told == max(e.time for e in data().events if e.time <= 4.0)
    lines = page.value(
        "[...document.querySelectorAll('.plot-area')].map((a) => {"
        " const x = a._fullLayout.xaxis, line = a.querySelector('.cursor-line');"
        " return x.p2l(parseFloat(line.style.left) - x._offset); })"
    )
    assert lines == pytest.approx([4.0] * len(lines), abs=0.05)
    assert len(lines) >= 4


def test_a_seek_before_the_video_has_loaded_is_applied_later(page: Browser) -> None:
    video = "document.querySelector('#cursor video')"
    moved_to(page, 4.0)
    page.value(f"{video}.currentTime = 0")
    page.until(f"!{video}.seeking && {video}.currentTime === 0")
    page.value(f"{video}.dispatchEvent(new Event('durationchange'))")
    page.until(f"!{video}.seeking && {video}.currentTime > 0")
    share = page.value(f"{video}.currentTime / {video}.duration")
    assert share == pytest.approx(4.0 / data().duration, abs=0.02)


def test_a_click_into_a_figure_moves_the_cursor(page: Browser) -> None:
    moved_to(page, 0.0)
    place = page.value(
        "(() => { const a = document.querySelector('#stages'); a.scrollIntoView({behavior: 'instant'});"
        " const b = a.getBoundingClientRect(), x = a._fullLayout.xaxis;"
        " return [b.left + x._offset + x.l2p(3), b.top + b.height / 2]; })()"
    )
    page.click(*place)
    page.until("Math.abs(Number(document.querySelector('#cursor input').value) - 3) < 0.1")


def test_the_list_of_alerts_can_be_filtered(page: Browser) -> None:
    shown = "[...document.querySelectorAll('.alert')].filter((a) => !a.hidden).length"
    assert page.value(shown) == len(ALERTS)
    change = (
        "(() => { const e = document.querySelector('%s'); %s;"
        " e.dispatchEvent(new Event('input', {bubbles: true})); })()"
    )
    page.value(change % (".alert-filter select:nth-of-type(2)", "e.value = 'near_miss'"))
    assert page.value(shown) == 2
    page.value(change % (".alert-filter input[type=checkbox]", "e.checked = true"))
    assert page.value(shown) == 1
    assert page.value("document.querySelector('.alert-filter output').textContent") == "1 of 4"


def test_the_page_fits_a_narrow_screen(page: Browser) -> None:
    page.call(
        "Emulation.setDeviceMetricsOverride",
        width=390,
        height=800,
        deviceScaleFactor=1,
        mobile=False,
    )
    page.until("document.documentElement.scrollWidth <= innerWidth")
    legends = page.value(
        "[...document.querySelectorAll('.plot-area .legend')].every((l) =>"
        " l.getBoundingClientRect().right <= innerWidth)"
    )
    assert legends

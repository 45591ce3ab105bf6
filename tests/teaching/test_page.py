"""The window: who is answered, and drawing with mouse and keys in a real browser."""

from __future__ import annotations

import http.client
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from tests.teaching.browser import Browser
from tests.teaching.clips import SIDE, TOP, corners, frame, write_clip
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.page.server import TeachingPage


@pytest.fixture
def page(tmp_path: Path) -> Iterator[TeachingPage]:
    clip = write_clip(tmp_path / "clip.avi", 20)
    with ClipFrames(str(clip)) as frames, TeachingPage(frames, tmp_path / "a.models", 2) as page:
        yield page


def ask(
    page: TeachingPage, method: str, path: str, body: Any = None, **headers: str
) -> tuple[int, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    data = body if body is None or isinstance(body, str) else json.dumps(body)
    told = {"Content-Type": "application/json"} if body is not None else {}
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, data, {**told, **named})
    answer = connection.getresponse()
    try:
        return answer.status, answer.read()
    finally:
        connection.close()


def things(name: str = "part", number: int = 3, drawn: Any = None) -> dict[str, Any]:
    return {"things": [{"name": name, "frame": number, "corners": drawn or corners(number)}]}


def test_frames_and_facts_are_served(page: TeachingPage) -> None:
    status, data = ask(page, "GET", f"{page.prefix}frame/7")
    picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert status == 200
    assert picture is not None
    assert np.abs(picture.astype(int) - frame(7)).mean() < 4
    facts = json.loads(ask(page, "GET", f"{page.prefix}clip.json")[1])
    assert (facts["count"], facts["frame"], facts["known"]) == (20, 2, {})


def test_posted_outlines_are_stored_and_reported(page: TeachingPage, tmp_path: Path) -> None:
    status, data = ask(page, "POST", f"{page.prefix}save", things())
    assert status == 200
    assert json.loads(data)["messages"][0] == f"part: {SIDE} x {SIDE} pixels at (23, {TOP})."
    ask(page, "POST", f"{page.prefix}save", things("tray", 5))
    assert page.result is not None
    assert [v.name for v in page.result.views] == ["part", "tray"]
    assert [t.partition(":")[0] for t in page.result.messages[:2]] == ["part", "tray"]
    assert ModelDatabase.open(tmp_path / "a.models").names() == ("part", "tray")


@pytest.mark.parametrize(
    ("method", "path", "body", "headers", "status"),
    [
        ("GET", "/", None, {}, 403),
        ("GET", "/guess/", None, {}, 403),
        ("POST", "/guess/save", things(), {}, 403),
        ("GET", "{prefix}", None, {"Host": "evil.example"}, 403),
        ("POST", "{prefix}save", things(), {"Origin": "http://evil.example"}, 403),
        ("POST", "{prefix}save", things(), {"Content_Type": "text/plain"}, 400),
        ("POST", "{prefix}save", "{", {}, 400),
        ("POST", "{prefix}save", "[]", {}, 400),
        ("POST", "{prefix}save", "{}", {"Content_Length": "999999999"}, 400),
        ("GET", "{prefix}../server.py", None, {}, 404),
        ("GET", "{prefix}server.py", None, {}, 404),
        ("GET", "{prefix}frame/x", None, {}, 404),
        ("POST", "{prefix}else", {}, {}, 404),
        ("GET", "{prefix}frame/99", None, {}, 422),
        ("POST", "{prefix}save", {}, {}, 422),
        ("POST", "{prefix}save", {"things": "all"}, {}, 422),
        ("POST", "{prefix}save", things(" "), {}, 422),
        ("POST", "{prefix}save", things(number=99, drawn=corners(0)), {}, 422),
        ("POST", "{prefix}save", things(drawn=[[1, 2], [3, 4]]), {}, 422),
        ("POST", "{prefix}save", things(drawn=[[1, 2], [3, 4], ["a", 5]]), {}, 422),
        ("POST", "{prefix}save", things(drawn=[[900, 2], [930, 4], [950, 50]]), {}, 422),
        ("POST", "{prefix}snap", {"frame": "0", "corners": corners(0)}, {}, 422),
    ],
)
def test_invalid_requests_are_refused(
    page: TeachingPage, method: str, path: str, body: Any, headers: dict[str, str], status: int
) -> None:
    found, data = ask(page, method, path.format(prefix=page.prefix), body, **headers)
    assert found == status
    if status == 422:
        assert json.loads(data)["error"]
    assert page.result is None


def test_each_page_has_its_own_address(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", 2)
    with ClipFrames(str(clip)) as frames:
        pages = [TeachingPage(frames, tmp_path / "a.models") for _ in range(2)]
        assert pages[0].prefix != pages[1].prefix
        for one in pages:
            with one:
                assert one.url.startswith("http://127.0.0.1:")


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def browser(page: TeachingPage, window: Browser) -> Browser:
    window.open(page.url)
    window.until(f"location.href === '{page.url}' && typeof state === 'object' && !!state.image")
    return window


def at(browser: Browser, x: float, y: float) -> tuple[float, float]:
    """Where a pixel of the frame lies in the window."""
    told = browser.value(
        "(() => { const r = canvas.getBoundingClientRect();"
        f"const p = toScreen([{x}, {y}]); return [r.x + p[0], r.y + p[1]]; }})()"
    )
    return told[0], told[1]


def taught(browser: Browser, tmp_path: Path) -> ModelDatabase:
    browser.press_button("save")
    browser.until("document.getElementById('status').className")
    assert browser.value("document.getElementById('status').textContent").startswith("Stored.")
    return ModelDatabase.open(tmp_path / "a.models")


def test_outlines_can_be_drawn_with_the_mouse(
    page: TeachingPage, browser: Browser, tmp_path: Path
) -> None:
    """Zoomed in, one corner taken back and one moved, two things in two frames."""
    browser.move(*at(browser, 40, 50))
    browser.until("document.getElementById('spot').textContent === '(40, 50)'")
    browser.wheel(*at(browser, 40, 50), -300)
    zoom = browser.until("state.zoom > 6 && state.zoom")
    assert zoom < 24
    first, second, third, fourth = corners(2)
    for corner in (first, (60, 90), second, third):
        browser.click(*at(browser, *corner))
        if corner == (60, 90):
            browser.press("Escape")
    browser.click(*at(browser, fourth[0] + 9, fourth[1]), count=2)
    browser.type("part")
    browser.press("Enter")
    browser.drag(at(browser, fourth[0] + 9, fourth[1]), at(browser, *fourth))
    browser.press("0", ".", ".")
    browser.until("state.frame === 4")
    for corner in corners(4):
        browser.click(*at(browser, *corner))
    browser.press("Enter")
    browser.type("again")
    database = taught(browser, tmp_path)
    assert [(v.name, v.bbox) for v in database.taught] == [
        ("part", (22, TOP, SIDE, SIDE)),
        ("again", (24, TOP, SIDE, SIDE)),
    ]
    browser.press_button("done")
    assert page.wait(10)


def test_outlines_can_be_drawn_with_the_keyboard(browser: Browser, tmp_path: Path) -> None:
    """The cross begins in the middle, (80, 60)."""
    browser.value("canvas.focus()")
    browser.press(" ")
    for key, times in (("ArrowRight", 2), ("ArrowDown", 2), ("ArrowLeft", 2)):
        for _ in range(times):
            browser.press(key, shift=True)
        browser.press(" ")
    browser.press("Enter")
    browser.type("tray")
    (view,) = taught(browser, tmp_path).taught
    assert (view.name, view.bbox) == ("tray", (80, 60, 21, 21))


def test_outlines_can_be_removed_and_need_a_name(page: TeachingPage, browser: Browser) -> None:
    for corner in corners(2):
        browser.click(*at(browser, *corner))
    browser.press("Enter")
    browser.press_button("save")
    browser.until("document.getElementById('status').className === 'bad'")
    assert "name" in browser.value("document.getElementById('status').textContent")
    assert page.result is None
    browser.press_button("done")
    assert "not stored" in browser.value("document.getElementById('status').textContent")
    assert not page.wait(0.05)
    browser.value("canvas.focus()")
    browser.press("Backspace")
    assert browser.value("state.things.length") == 0
    browser.press_button("done")
    assert page.wait(10)


def test_a_rough_outline_snaps_to_edges(browser: Browser, tmp_path: Path) -> None:
    for x, y in corners(2):
        browser.click(*at(browser, x + (2 if x < 40 else -2), y + (2 if y < 60 else -2)))
    browser.press("Enter")
    browser.type("part")
    before = browser.value("JSON.stringify(state.things[0].corners)")
    browser.press_button("snap")
    browser.until(f"JSON.stringify(state.things[0].corners) !== {json.dumps(before)}")
    (view,) = taught(browser, tmp_path).taught
    assert np.allclose(view.bbox, (22, TOP, SIDE, SIDE), atol=2)

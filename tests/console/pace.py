"""Response times of the console, and its cost for the agent: `python -m tests.console.pace`.

It drives a console in a real browser, over a run of two hours at ten frames a second (a scripted one of
twelve minutes, ten times over) and a run of the shipped clip. Exit code 1 if a limit is exceeded.
"""

from __future__ import annotations

import json
import sqlite3
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path
from statistics import median

import numpy as np
import pytest

from tests.archive.recordings import record
from tests.console.running import OPERATOR, running_console
from tests.console.test_runs import SETTINGS
from tests.rules.scenes import box_region, seen
from tests.teaching.browser import Browser, found_browser
from visup.agent import Observation
from visup.agent.storage.journal_reader import JOURNAL
from visup.runs.demo import demo_settings
from visup.runs.inputs.audience import Audience
from visup.runs.runner import supervise, supervised
from visup.runs.settings import RunOptions

FRAMES, TIMES, FPS = 7_200, 10, 10.0
CLICKS = 15
PASSES, BLOCKS, BLOCK, STEP_S = 4, 4, 25, 0.3
"""An agent watches the same frames in passes, one each 0.3 s, in blocks alternately without and with open
pages; every other pass begins with pages, so that each frame is measured both ways."""

LIMITS = {"first_paint_s": 1.5, "click_ms": 150.0, "open_s": 2.0, "agent_cost": 0.05}

FIGURES = ("first_paint_s", "open_s", "click_ms", "click_most_ms")

CLICK_TIMER = """
window.opened = null; window.clicked = null;
const shown = () => {
  const p = document.querySelector('img.picture');
  return p && p.complete && p.naturalWidth > 0 ? p.src + document.querySelector('.controls').innerText : null;
};
const look = () => {
  const now = shown();
  if (now && window.opened === null) window.opened = performance.now();
  const c = window.clicked;
  if (c && c.end === null && now && now !== c.before) {
    const [, src] = c.before.match(/^(.*?jpg)/) || [];
    const text = document.querySelector('.controls').innerText;
    if (!now.startsWith(src) && text !== c.text) c.end = performance.now();
  }
  requestAnimationFrame(look);
};
addEventListener('click', () => {
  const text = document.querySelector('.controls')?.innerText;
  window.clicked = {begin: performance.now(), end: null, before: shown() || '', text};
}, true);
requestAnimationFrame(look);
"""


def scripted(frames: int) -> Iterator[Observation]:
    """An arm that repeatedly approaches a satellite and retreats."""
    for i in range(frames):
        k = i % 120
        regions = [
            box_region(1, (100.0 + 6.0 * min(k, 120 - k), 200, 80, 60)),
            box_region(2, (500, 180, 90, 100)),
        ]
        names = {1: [("arm", 0.9), ("spartan", 0.3)], 2: [("spartan", 0.9), ("arm", 0.2)]}
        yield seen(i, regions, FPS, names)


def long_run(folder: Path) -> None:
    """A run of two hours: a short recording repeated in its journal."""
    record(folder, scripted(FRAMES), SETTINGS)
    with closing(sqlite3.connect(folder / JOURNAL)) as db:
        for k in range(1, TIMES):
            db.execute(
                "INSERT INTO steps SELECT frame_index + ?, time + ?, summary, seen, crc FROM steps"
                " WHERE frame_index < ?",
                (k * FRAMES, k * FRAMES / FPS, FRAMES),
            )
        db.commit()


def opening_time(browser: Browser, address: str, name: str) -> float:
    """Open a run from the list; seconds until its first picture is loaded."""
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=CLICK_TIMER)
    browser.open(f"{address}?token={OPERATOR}")
    link = f"[...document.querySelectorAll('.runs a')].find(a => a.innerText == '{name}')"
    browser.until(f"!!{link}")
    browser.open(browser.value(f"{link}.href"))
    browser.until("document.querySelectorAll('.bars').length > 0 && window.opened !== null")
    return float(browser.value("window.opened")) / 1000.0


def first_paint(browser: Browser) -> float:
    """Seconds until the first contentful paint of the open page."""
    browser.until("performance.getEntriesByName('first-contentful-paint').length > 0")
    return float(
        browser.value("performance.getEntriesByName('first-contentful-paint')[0].startTime / 1000")
    )


def click_times(browser: Browser) -> list[float]:
    """Milliseconds from clicks on the timeline until frame and beliefs are updated."""
    durations = []
    for k in range(CLICKS):
        x, y, w = browser.value(
            "(() => { const r = document.querySelector('.bars').getBoundingClientRect();"
            "return [r.x, r.y, r.width]; })()"
        )
        browser.click(x + w * (0.05 + 0.9 * ((7 * k) % CLICKS) / CLICKS), y + 8)
        browser.until("window.clicked && window.clicked.end !== null")
        durations.append(float(browser.value("window.clicked.end - window.clicked.begin")))
    return durations


def follow(browser: Browser, address: str, name: str) -> None:
    """Open a live run from the list and follow it; nothing measures inside the page."""
    browser.open(f"{address}?token={OPERATOR}")
    link = f"[...document.querySelectorAll('.runs a')].find(a => a.innerText == '{name}')"
    browser.until(f"!!{link}")
    browser.open(browser.value(f"{link}.href"))
    browser.until("document.querySelector('img.picture')?.naturalWidth > 0")
    browser.press("End")


def step_times(scratch: Path, address: str, folder: Path, first: int) -> list[float]:
    """Seconds of each step of an agent; blocks of odd number, counted from `first`, with three pages open."""
    folder.mkdir()
    run = supervised(demo_settings(), folder, Audience(), RunOptions(video=False, report=False))
    durations = []
    with ExitStack() as stack:
        stack.callback(run.close)
        next(run)
        for block in range(BLOCKS):
            with ExitStack() as open_pages:
                for k in range(3 * ((first + block) % 2)):
                    profile = scratch / f"{folder.name}-{block}-{k}"
                    follow(open_pages.enter_context(Browser(profile)), address, folder.name)
                for _ in range(BLOCK):
                    begin = time.perf_counter()
                    next(run)
                    durations.append(time.perf_counter() - begin)
                    time.sleep(max(0.0, STEP_S - durations[-1]))
    return durations


def agent_cost(scratch: Path, address: str, library: Path) -> tuple[float, float]:
    """Share that three open pages add to a step, on the same frames, and its standard error."""
    durations = np.array(
        [step_times(scratch, address, library / f"live-{p}", p % 2) for p in range(PASSES)]
    )
    logs = np.log(durations).reshape(PASSES, BLOCKS, BLOCK)
    pages = (np.arange(PASSES)[:, None] + np.arange(BLOCKS)) % 2 == 1
    added = np.array(
        [logs[pages[:, b], b].mean(0) - logs[~pages[:, b], b].mean(0) for b in range(BLOCKS)]
    )
    even, odd = (np.median(added[half::2]) for half in (0, 1))
    spread = added.std() / np.sqrt(added.size)
    return float(np.expm1((even + odd) / 2)), float(spread)


def main() -> int:
    """Measure, and print the figures as JSON; without a browser, print the reason."""
    try:
        found_browser()
    except pytest.skip.Exception as why:
        print(why)
        return 0
    with tempfile.TemporaryDirectory() as name:
        scratch = Path(name)
        library, saved = scratch / "library", scratch / "saved"
        saved.mkdir()
        long_run(library / "long")
        supervise(demo_settings(6), _new_folder(library / "short"), options=RunOptions(video=False))
        with running_console(library, saved) as address:
            with Browser(scratch / "profile", (1280, 860)) as browser:
                figures: dict[str, list[float]] = {name: [] for name in FIGURES}
                for run in ("short", "long"):
                    figures["open_s"].append(round(opening_time(browser, address, run), 2))
                    figures["first_paint_s"].append(round(first_paint(browser), 2))
                    durations = click_times(browser)
                    figures["click_ms"].append(round(median(durations)))
                    figures["click_most_ms"].append(round(max(durations)))
            cost, error = agent_cost(scratch, address, library)
            figures["agent_cost"], figures["agent_cost_error"] = [round(cost, 3)], [round(error, 3)]
    print(json.dumps(figures))
    return int(any(max(figures[name]) > limit for name, limit in LIMITS.items()))


def _new_folder(folder: Path) -> Path:
    folder.mkdir(parents=True)
    return folder


if __name__ == "__main__":
    sys.exit(main())

"""Film and picture of the README, docs/images/demo.webp and .png: `python -m tests.docs.demo_animation`.

The shipped clip, watched as `visup demo` does, with what is believed drawn over it; below the picture what
was told last. What is told stands still for a moment, so that it can be read.
"""

from __future__ import annotations

import textwrap

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.text import Text

import visup
from tests.paths import ROOT
from visup.agent import Event, Severity
from visup.narrative import Narrative
from visup.report.image_text import write
from visup.runs.demo import demo_settings
from visup.terminal.narrator import verdict_line
from visup.wording import prose

FILM, STILL = (ROOT / "docs" / "images" / name for name in ("demo.webp", "demo.png"))
STILL_S = 13.6
"""The picture shows this moment of the clip: the stage is failing."""

WIDTH, HEIGHT, PANEL = 480, 360, 118
"""Of the picture and of the strip below it, pixels."""

EVERY = 6
"""The clip has 25 frames a second, of which the demo looks at every other one; the film has four."""

READ_MS, QUALITY = 1500, 32
LETTERS, LINE, ROWS, WRAPPED = 13, 17, 6, 74
INK, GRAVE, GROUND = (224, 228, 232), (250, 170, 90), (26, 28, 32)

Rows = list[tuple[str, bool]]
"""Lines of one sentence, each with whether it is grave."""


def film() -> tuple[list[Image.Image], list[int]]:
    """Pictures, and how long each is shown, milliseconds."""
    narrative, rows = Narrative(), list[Rows]()
    pictures, shown = [], []
    run = visup.watch(demo_settings())
    for step in run:
        assert step.frame is not None
        news = narrative.lines(step, step.frame)
        for event in news:
            rows.append(_rows(event))
        if abs(step.time - STILL_S) < 0.01:
            still = Image.fromarray(np.ascontiguousarray(step.draw()[:, :, ::-1]))
            still.quantize(128).save(STILL, optimize=True)
        if news or step.frame_index % EVERY == 0:
            pictures.append(_picture(step.draw(), rows))
            shown.append(READ_MS if news else 40 * EVERY)
    rows.append([(Text.from_markup(verdict_line(run.verdict)).plain, True)])
    pictures.append(_picture(step.draw(), rows))
    shown.append(2 * READ_MS)
    return pictures, shown


def _rows(event: Event) -> Rows:
    told = f"{event.time:5.1f} s  {prose(event.text)}"
    lines = textwrap.wrap(told, WRAPPED, subsequent_indent=" " * 9)
    return [(line, event.severity > Severity.INFO) for line in lines]


def _latest(rows: list[Rows]) -> Rows:
    """What was told last, as much of it as has room, nothing of it cut."""
    shown: Rows = []
    for told in reversed(rows):
        if len(told) + len(shown) > ROWS:
            break
        shown = [*told, *shown]
    return shown


def _picture(image: NDArray[np.uint8], rows: list[Rows]) -> Image.Image:
    page = np.full((HEIGHT + PANEL, WIDTH, 3), GROUND[::-1], np.uint8)
    page[:HEIGHT] = cv2.resize(image, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    for place, (text, grave) in enumerate(_latest(rows)):
        at = (10 + LETTERS * 4 * text.startswith(" " * 9), HEIGHT + 8 + place * LINE)
        write(page, text.strip(), at, LETTERS, GRAVE if grave else INK)
    return Image.fromarray(np.ascontiguousarray(page[:, :, ::-1]))


if __name__ == "__main__":
    images, times = film()
    images[0].save(
        FILM,
        save_all=True,
        append_images=images[1:],
        duration=times,
        loop=0,
        quality=QUALITY,
        method=6,
    )
    print(
        FILM,
        f"{FILM.stat().st_size / 1e6:.2f} MB, {len(images)} pictures, {sum(times) / 1e3:.0f} s",
    )

"""The pictures of docs/your-own-cell.md: `python -m tests.docs.own_cell` makes them; it needs a browser."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import visup
from tests.paths import ROOT
from tests.teaching.browser import Browser
from visup.percepts.taught.drawing_views import taught_views_sheet
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.outlines import parse_outline
from visup.teaching.page.server import TeachingPage

CLIP = ROOT / "examples" / "data" / "bottles.mp4"
PAGE = ROOT / "docs" / "your-own-cell.md"
IMAGES = ROOT / "docs" / "images"
COLOURS = 160
"""Of a picture, so that it stays small."""


def outlines() -> dict[str, tuple[tuple[float, float], ...]]:
    """The outlines that the page types, by name."""
    lines = PAGE.read_text().splitlines()
    typed = [line.split("--outline ")[1].rstrip("\\ ") for line in lines if "--outline " in line]
    drawn = [parse_outline(text.strip('"')) for text in typed if "..." not in text]
    return {outline.name: outline.corners for outline in drawn}


def save(name: str, picture: NDArray[np.uint8], width: int) -> None:
    height = round(picture.shape[0] * width / picture.shape[1])
    small = cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA)
    image = Image.fromarray(np.ascontiguousarray(small[:, :, ::-1]))
    image.quantize(COLOURS).save(IMAGES / name, optimize=True)
    print(IMAGES / name)


def window(folder: Path) -> NDArray[np.uint8]:
    """The window with two bottles outlined and the third one begun."""
    with (
        ClipFrames(str(CLIP)) as frames,
        TeachingPage(frames, folder / "cell.models") as page,
        Browser(folder / "profile", (1100, 700)) as browser,
    ):
        browser.open(page.url)
        browser.until("typeof state === 'object' && !!state.image")
        browser.value(
            "document.getElementById('clip').textContent = 'bottles.mp4, into cell.models'"
        )
        for name, corners in outlines().items():
            wanted = corners if name != "right_bottle" else corners[:4]
            for x, y in wanted:
                spot = "const r = canvas.getBoundingClientRect(); const p = toScreen"
                browser.click(
                    *browser.value(
                        f"(() => {{ {spot}([{x}, {y}]); return [r.x + p[0], r.y + p[1]]; }})()"
                    )
                )
            if name != "right_bottle":
                browser.press("Enter")
                browser.type(name)
        time.sleep(0.2)
        browser.picture(folder / "window.png")
    shown = cv2.imread(str(folder / "window.png"))
    assert shown is not None
    return np.asarray(shown, np.uint8)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        save("teach-window.png", window(folder), 1000)
        models = visup.teach(CLIP, outlines(), models=folder / "a.models")
        save("teach-stored.png", taught_views_sheet(models.taught), 480)
        for step in visup.watch(CLIP, task=CLIP.with_suffix(".task"), models=models):
            if step.time >= 6.6:
                save("cell-watched.png", step.draw(), 640)
                break

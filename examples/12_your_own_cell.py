"""Teach three bottles, say what should happen to them, and watch (docs/your-own-cell.md)."""

from __future__ import annotations

from pathlib import Path

import cv2

import visup

CLIP = Path(__file__).parent / "data" / "bottles.mp4"

BOTTLES = {  # outlines in the first frame, as `visup teach` would draw them: corners (x, y), pixels
    "left_bottle": [
        (57, 82),
        (77, 82),
        (77, 103),
        (85, 135),
        (84, 232),
        (38, 232),
        (41, 145),
        (57, 105),
    ],
    "middle_bottle": [(232, 83), (251, 83), (261, 133), (262, 233), (220, 233), (219, 133)],
    "right_bottle": [(392, 80), (412, 80), (426, 133), (427, 236), (383, 236), (382, 140)],
}

if __name__ == "__main__":
    models = visup.teach(CLIP, BOTTLES, models="cell.models")
    run = visup.watch(CLIP, task=CLIP.with_suffix(".task"), models=models)
    for step in run:
        for event in step.events:
            print(f"{event.time:5.1f} s  {event.text}")
        if any(event.kind == "exit" for event in step.events):
            cv2.imwrite("taken.png", step.draw())
    print(f"verdict: {run.verdict}")

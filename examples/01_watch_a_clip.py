"""Watch the clip that ships with visup: print its events and verdict, and save a picture of each alert."""

from __future__ import annotations

import cv2

import visup
from visup.runs.demo import demo_settings

if __name__ == "__main__":
    run = visup.watch(demo_settings())
    for step in run:
        for event in step.events:
            print(f"{event.time:5.1f} s  {event.text}")
        for alert in step.alerts:
            cv2.imwrite(f"alert-{alert.id}.png", step.draw())
    print(f"verdict: {run.verdict}")

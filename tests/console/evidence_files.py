"""Evidence of alerts as written by `visup serve` next to a run."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

from visup.report.video import WebmWriter


def write_evidence(run: Path, alert: int) -> Path:
    """Write a picture and a clip of an alert; returns their folder."""
    folder = run / "evidence"
    folder.mkdir(exist_ok=True)
    image = np.full((96, 128, 3), 60, np.uint8)
    cv2.circle(image, (64, 48), 30, (40, 160, 230), -1)
    (folder / f"alert-{alert}.jpg").write_bytes(bytes(cv2.imencode(".jpg", image)[1]))
    with WebmWriter(folder / f"alert-{alert}.webm", 5.0) as video:
        for shift in range(5):
            video.write(np.roll(image, 4 * shift, axis=1))
    names = {"snapshot": f"alert-{alert}.jpg", "clip": f"alert-{alert}.webm"}
    (folder / f"alert-{alert}.json").write_text(json.dumps({"id": alert, **names}))
    return folder

"""Match a silhouette: print the five best views in the shipped model database."""

from __future__ import annotations

import cv2
import numpy as np

import visup
from visup.runs.demo import demo_settings

if __name__ == "__main__":
    silhouette = np.zeros((240, 320), np.uint8)
    cv2.ellipse(silhouette, (110, 120), (70, 55), 0, 0, 360, 255, -1)
    cv2.rectangle(silhouette, (100, 112), (290, 128), 255, -1)
    path = demo_settings().models
    if path is None:
        raise SystemExit("the demo has no model database")
    for match in visup.ModelDatabase.open(path).query(silhouette > 0, top=5).matches:
        print(f"{match.similarity:.3f}  {match.view.name}, view {match.view.number}")

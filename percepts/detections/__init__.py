"""Boxes that somebody else found: a detector's or a tracker's file in place of visup's own eyes.

Read `files.py` (MOT and COCO files) and `behaviour.py` (boxes as regions, their names as hypotheses).
"""

from visup.percepts.detections.behaviour import DetectionsBehaviour
from visup.percepts.detections.files import Detection, read_detections

__all__ = ["Detection", "DetectionsBehaviour", "read_detections"]

"""Boxes from an external detector or tracker, in place of motion segmentation: a file, a network, or code.

Read `boxes.py` (a box), `files.py` (MOT and COCO files), `yolo.py` and `network.py` (ONNX files of the YOLO
family), `supervision.py` (conversion from and to that library), `box_tracker.py` (tracking by detection),
`behaviour.py` (boxes as regions, their names as hypotheses) and `people.py` (OpenCV's bundled people
detector).
"""

from visup.percepts.detections.behaviour import (
    DetectionsBehaviour,
    DetectorBehaviour,
    NetworkBehaviour,
)
from visup.percepts.detections.boxes import Detection
from visup.percepts.detections.files import read_detections
from visup.percepts.detections.network import YoloNetwork
from visup.percepts.detections.people import PeopleBehaviour
from visup.percepts.detections.supervision import from_supervision, to_supervision
from visup.percepts.detections.yolo import decode_yolo, letterbox

__all__ = [
    "Detection",
    "DetectionsBehaviour",
    "DetectorBehaviour",
    "NetworkBehaviour",
    "PeopleBehaviour",
    "YoloNetwork",
    "decode_yolo",
    "from_supervision",
    "letterbox",
    "read_detections",
    "to_supervision",
]

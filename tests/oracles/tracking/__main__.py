"""`python -m tests.oracles.tracking DIR`: visup's numbers for boxes against trackers of others.

Boxes are made from the truth of MOT folders and of simulated streets with the noise of a detector, the same
for all; MOG2 with SORT sees the pictures of the folders, as `visup eval motion` does.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from tests.oracles.tracking.noisy_boxes import LEVELS, noisy_boxes
from tests.oracles.tracking.peers import PEERS, Found, Tracked, mog2_blobs
from tests.oracles.tracking.walkers import street
from visup.evaluation.motion.mot_scores import Box, mot_scores, read_truth, truth_of_images
from visup.evaluation.motion.runner import find_sequences
from visup.percepts.detections.box_tracker import MultiBoxTracker
from visup.percepts.video import open_source
from visup.percepts.video.image_folder import images_in

SEEDS = 6
STREETS = (25.0, 15.0, 10.0, 7.0)
"""Frames a second of the simulated streets."""


@dataclass(frozen=True, slots=True)
class Scene:
    """Truth to make boxes from.

    Attributes:
        name: Of what.
        truth: Frame -> id -> box.
        frames: How many.
        size: (width, height) of a frame.
        fps: Frames a second.
    """

    name: str
    truth: Mapping[int, Mapping[int, Box]]
    frames: int
    size: tuple[int, int]
    fps: float


def visup(found: Found, fps: float) -> Tracked:
    """The numbers of `percepts/detections`."""
    numbering = MultiBoxTracker()
    return {k: {d.track: d.box for d in numbering.number(k, found[k])} for k in sorted(found)}


TRACKERS: Mapping[str, Callable[[Found, float], Tracked]] = {"visup": visup, **PEERS}


def compare_on_boxes(scenes: list[Scene], seeds: range) -> Iterator[tuple[str, str, np.ndarray]]:
    """MOTA, IDF1 and id switches of each tracker at each level of noise, means over scenes and seeds."""
    for level, noise in LEVELS.items():
        boxes = [
            (s, noisy_boxes(s.truth, s.frames, s.size, noise, k)) for s in scenes for k in seeds
        ]
        for name, track in TRACKERS.items():
            scores = [mot_scores(s.truth, track(found, s.fps)) for s, found in boxes]
            keys = ("mota", "idf1", "id_switches")
            yield level, name, np.mean([[r[k] for k in keys] for r in scores], axis=0)


def mot_scenes(folder: Path) -> list[tuple[Scene, Path]]:
    """The MOT folders below a folder, each with its place."""
    out = []
    for sequence in find_sequences(folder):
        if sequence.boxes is None:
            continue
        images = images_in(sequence.source / "img1")
        truth = truth_of_images(read_truth(sequence.boxes), images)
        with open_source(str(sequence.source)) as source:
            size = next(iter(source)).size
            out.append(
                (Scene(sequence.name, truth, len(images), size, source.fps), sequence.source)
            )
    return out


def mog2_with_sort(scene: Scene, place: Path) -> dict[str, float]:
    """MOTA and IDF1 of MOG2 blobs numbered by SORT."""
    images = [np.asarray(cv2.imread(str(p)), np.uint8) for p in images_in(place / "img1")]
    return mot_scores(scene.truth, PEERS["SORT (trackers)"](mog2_blobs(images), scene.fps))


def main(folder: Path) -> None:
    """Print the comparison."""
    real = mot_scenes(folder)
    streets = [
        Scene(f"street {k}", street(100 + k, fps=fps), 150, (640, 480), fps)
        for k, fps in enumerate(STREETS)
    ]
    for what, scenes in (("MOT folders", [s for s, _ in real]), ("simulated streets", streets)):
        for level, name, (mota, idf1, switches) in compare_on_boxes(scenes, range(SEEDS)):
            print(f"{what:18} {level:7} {name:24} {mota:.3f} {idf1:.3f} {switches:.1f}")
    for scene, place in real:
        scores = mog2_with_sort(scene, place)
        print(f"{scene.name}: MOG2 with SORT {scores['mota']:.3f} {scores['idf1']:.3f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

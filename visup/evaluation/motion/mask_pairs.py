"""Matches masks to frames by name, never by order, since ground truth may be sparse."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from visup.agent.model.errors import SettingsError
from visup.percepts.video.image_folder import images_in

_NUMBER = re.compile(r"(\d+)(?!.*\d)")


def mask_pairs(source: Path, masks: Sequence[Path]) -> dict[int, Path]:
    """The masks of a sequence by frame.

    A mask belongs to the image of the same name (`00012.png` to `00012.jpg`), or else to the only image with
    the same last number (`mask_12.png` to `frame_0012.jpg`); in a video, to the frame of that number, from 0.

    Args:
        source: A folder of images, or a video file.
        masks: The mask files; frames without one have no ground truth.

    Returns:
        Index of a frame -> its mask.

    Raises:
        SettingsError: A mask belongs to no frame, or two belong to one.
    """
    frames = images_in(source) if source.is_dir() else []
    names = {f.stem: index for index, f in enumerate(frames)}
    numbers: dict[int, list[int]] = {}
    for index, frame in enumerate(frames):
        numbers.setdefault(last_number(frame), []).append(index)
    pairs: dict[int, Path] = {}
    for mask in masks:
        candidates = numbers.get(last_number(mask), []) if frames else [last_number(mask)]
        index = names.get(mask.stem, candidates[0] if len(candidates) == 1 else -1)
        if index < 0 or index in pairs:
            problem = "a second truth of a frame" if index in pairs else "the truth of no frame"
            raise SettingsError(
                f"this mask is {problem}",
                where=str(mask),
                expected=f"a mask is named as its frame in {source.name}",
            )
        pairs[index] = mask
    return pairs


def last_number(path: Path) -> int:
    """The last number in a file name; -1 without one."""
    match = _NUMBER.search(path.stem)
    return int(match[1]) if match else -1

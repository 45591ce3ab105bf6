"""Tiny videos and folders of images whose frames tell their own number."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.video.quiet_decoder import quiet

COUNT = 30


def picture(index: int, size: tuple[int, int] = (64, 48)) -> NDArray[np.uint8]:
    """A grey field with a bright disc that moves one pixel per frame."""
    image = np.full((size[1], size[0], 3), 60, np.uint8)
    cv2.circle(image, (10 + index, size[1] // 2), 6, (40, 200, 250), -1)
    return image


def disc_x(image: NDArray[np.uint8]) -> float:
    """Where the disc is: the mean x of bright pixels."""
    return float(np.nonzero(image.max(axis=2) > 150)[1].mean())


def write_video(
    path: Path,
    fourcc: str = "MJPG",
    *,
    count: int = COUNT,
    fps: float = 12.5,
    size: tuple[int, int] = (64, 48),
) -> Path:
    with quiet():
        code = cv2.VideoWriter.fourcc(*fourcc)
        writer = cv2.VideoWriter(str(path), code, fps, size)
    assert writer.isOpened()
    for index in range(count):
        writer.write(picture(index, size))
    writer.release()
    return path


def cut(path: Path, share: float) -> Path:
    """The same file without its end."""
    data = path.read_bytes()
    out = path.with_name(f"cut-{path.name}")
    out.write_bytes(data[: int(len(data) * share)])
    return out


def write_folder(folder: Path, names: list[str], size: tuple[int, int] = (64, 48)) -> Path:
    """Images whose disc tells their place in `names`."""
    folder.mkdir(parents=True)
    for index, name in enumerate(names):
        assert cv2.imwrite(str(folder / name), picture(index, size))
    return folder

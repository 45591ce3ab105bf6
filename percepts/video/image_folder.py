"""A folder of images, read in natural order."""

from __future__ import annotations

import configparser
import math
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame
from visup.agent.model.errors import SourceError
from visup.agent.storage.text_file import read_bounded, read_text_file
from visup.percepts.image_size import check_image_size
from visup.percepts.video.quiet_decoder import quiet
from visup.percepts.video.source import DEFAULT_FPS, Ending, VideoSource, to_bgr

IMAGE_SUFFIXES = frozenset(
    {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pbm", ".pnm"}
)
VIDEO_SUFFIXES = frozenset({".mp4", ".avi", ".webm", ".mkv", ".mov", ".m4v", ".mpg", ".mpeg"})
USUAL_FOLDERS = ("img1", "frames", "images")
JPEG_START, JPEG_END = b"\xff\xd8", b"\xff\xd9"
PNG_START, PNG_END = b"\x89PNG", b"IEND"


LARGEST_FILE_BYTES = 2**28


class UnreadableImageError(Exception):
    """An image file that cannot be decoded; the message says what is wrong with it."""


class ImageFolder(VideoSource):
    """Images of one folder as frames at a constant rate.

    Args:
        name: The user's name for it.
        files: The images, in order; at least one.
        every: Only every n-th image is read.
        fps: Frames per second.
        notes: Sentences about assumptions made.

    Raises:
        SourceError: The first image cannot be read.
    """

    def __init__(
        self,
        name: str,
        files: list[Path],
        *,
        every: int = 1,
        fps: float = DEFAULT_FPS,
        notes: tuple[str, ...] = (),
    ) -> None:
        try:
            first = read_image(files[0])
        except UnreadableImageError as e:
            raise SourceError(
                f"the first image {e}", where=str(files[0]), expected="an image that can be decoded"
            ) from e
        self._files = files
        self._at = 0
        self._first: NDArray[np.uint8] | None = first
        super().__init__(
            name,
            fps=fps,
            size=(first.shape[1], first.shape[0]),
            frame_count=len(files),
            every=every,
            notes=notes,
        )

    def _next(self) -> Frame | None:
        while self._at < self.span[0]:
            self._at += self.every
        index = self._at
        if index >= len(self._files):
            return None
        self._at += self.every
        try:
            image = self._image(index)
        except UnreadableImageError as e:
            self._end(
                Ending.TRUNCATED,
                f"{self._files[index].name} (frame {index} of {len(self._files)}) {e}; "
                "what came before is kept.",
            )
            return None
        return Frame(index, index / self.fps, image)

    def _image(self, index: int) -> NDArray[np.uint8]:
        """One image, checked to have the size of the first."""
        if index == 0 and self._first is not None:
            image, self._first = self._first, None
            return image
        image = read_image(self._files[index])
        height, width = image.shape[:2]
        if (width, height) != self.size:
            raise UnreadableImageError(
                f"is {width}x{height}, but the images before it are {self.size[0]}x{self.size[1]}"
            )
        return image

    def _release(self) -> None:
        self._first = None


def read_image(path: Path) -> NDArray[np.uint8]:
    """Read one image file.

    Args:
        path: The file.

    Returns:
        (H, W, 3) uint8 BGR.

    Raises:
        UnreadableImageError: It cannot be read, is not an image, or is truncated.
    """
    try:
        data = read_bounded(path, LARGEST_FILE_BYTES)
    except OSError as e:
        raise UnreadableImageError(f"cannot be read ({e.strerror or e})") from e
    return decode_image(data)


def decode_image(data: bytes) -> NDArray[np.uint8]:
    """The image of an image file, from its bytes.

    Returns:
        (H, W, 3) uint8 BGR.

    Raises:
        UnreadableImageError: It is not an image, or is truncated.
    """
    import cv2

    if not data:
        raise UnreadableImageError("is empty")
    if _ends_early(data):
        raise UnreadableImageError("is cut off")
    try:
        check_image_size(data)
    except ValueError as e:
        raise UnreadableImageError(str(e)) from e
    # JPEG has no alpha, and only the colour flag applies the EXIF orientation.
    flags = cv2.IMREAD_COLOR if data.startswith(JPEG_START) else cv2.IMREAD_UNCHANGED
    try:
        with quiet():
            image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        if image is None:
            raise UnreadableImageError("is not an image that can be decoded")
        return to_bgr(image)
    except (cv2.error, ValueError) as e:
        raise UnreadableImageError("is not an image that can be decoded") from e


def _ends_early(data: bytes) -> bool:
    """Whether an image is truncated; decoders would fill the rest with grey."""
    if data.startswith(PNG_START):
        return PNG_END not in data[-1024:]
    return data.startswith(JPEG_START) and JPEG_END not in data[-65536:]


def natural_key(name: str) -> tuple[tuple[int, int, str], ...]:
    """Sort key under which `frame2` comes before `frame10`."""
    parts = re.split(r"(\d+)", name.casefold())
    return tuple((0, int(p), p) if p.isdecimal() else (1, 0, p) for p in parts if p)


def images_in(folder: Path) -> list[Path]:
    """The image files of a folder in natural order; hidden files are skipped."""
    found = [
        p
        for p in folder.iterdir()
        if p.suffix.lower() in IMAGE_SUFFIXES and not p.name.startswith(".") and p.is_file()
    ]
    return sorted(found, key=lambda p: (natural_key(p.name), p.name))


def image_names(source: str) -> tuple[str, ...]:
    """Names of the images of a source, in order; none if it is not a folder of images."""
    if not Path(source).is_dir():
        return ()
    return tuple(p.name for p in _find_images(Path(source))[1])


def open_folder(folder: Path, *, every: int = 1, fps: float | None = None) -> ImageFolder:
    """Open a folder of images, or a sequence folder containing one (MOT, DAVIS).

    Args:
        folder: The folder; it exists.
        every: Only every n-th image is read.
        fps: Frames per second, or None for what `seqinfo.ini` says, else 25.

    Returns:
        The source, its first image decoded.

    Raises:
        SourceError: It cannot be read, or has no images.
    """
    try:
        at, files = _find_images(folder)
    except PermissionError as e:
        raise SourceError(
            "permission to read it is denied",
            where=str(folder),
            hint="check the folder's permissions",
        ) from e
    except OSError as e:
        raise SourceError(f"it cannot be read ({e.strerror or e})", where=str(folder)) from e
    rate, notes = (fps, ()) if fps is not None else _rate(at)
    return ImageFolder(str(folder), files, every=every, fps=rate, notes=notes)


def _find_images(folder: Path) -> tuple[Path, list[Path]]:
    """Find the images: in the folder, or in a usual subfolder of such sequences."""
    files = images_in(folder)
    if files:
        return folder, files
    for name in (_sequence_info(folder).get("imdir", ""), *USUAL_FOLDERS):
        if name and (folder / name).is_dir() and (files := images_in(folder / name)):
            return folder / name, files
    raise SourceError(
        "the folder has no images",
        where=str(folder),
        expected="images such as 00000.png, or a folder 'img1' or 'frames' with them",
        hint=_hint(folder),
    )


def _hint(folder: Path) -> str:
    """A hint for a folder without images."""
    inside = sorted(folder.iterdir())
    for path in inside:
        if path.suffix.lower() in VIDEO_SUFFIXES:
            return f"it contains a video; give that: {path}"
    for path in inside:
        if path.is_dir() and images_in(path):
            return f"a folder inside it contains images; give that: {path}"
    return "name a video file or a folder of images"


def _sequence_info(folder: Path) -> dict[str, str]:
    """The values of a MOT `seqinfo.ini` (keys in lower case); empty without one."""
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(read_text_file(folder / "seqinfo.ini"))
        return dict(parser["Sequence"])
    except (OSError, UnicodeDecodeError, configparser.Error, KeyError):
        return {}


def _rate(images: Path) -> tuple[float, tuple[str, ...]]:
    """Frame rate of a folder of images, and a note if assumed."""
    for folder in (images, images.parent):
        text = _sequence_info(folder).get("framerate")
        if text is None:
            continue
        try:
            rate = float(text)
        except ValueError:
            rate = math.nan
        if math.isfinite(rate) and rate > 0:
            return rate, ()
        note = f"seqinfo.ini gives no usable frame rate ({text}); {DEFAULT_FPS:g} fps is assumed."
        return DEFAULT_FPS, (note,)
    return DEFAULT_FPS, (f"Images have no frame rate; {DEFAULT_FPS:g} fps is assumed.",)

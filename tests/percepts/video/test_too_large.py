"""Pictures and videos that are too large are refused before their pixels are decoded."""

from __future__ import annotations

import struct
import time
import zlib
from pathlib import Path

import numpy as np
import pytest

from visup.agent.model.errors import DatabaseError, SourceError
from visup.percepts.image_size import image_size
from visup.percepts.shape.building.database_builder import read_silhouette
from visup.percepts.video import open_source
from visup.percepts.video.video_file import check_frame_size


def bomb(width: int, height: int) -> bytes:
    """A small PNG of many pixels."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    packer = zlib.compressobj(9)
    row = bytes(1 + width)
    rows = b"".join(packer.compress(row) for _ in range(min(height, 200))) + packer.flush()
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    parts = (chunk(b"IHDR", head), chunk(b"IDAT", rows), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


@pytest.mark.parametrize(
    ("width", "height"), [(30_000, 30_000), (2**31 - 1, 2**31 - 1), (10**8, 1)]
)
def test_a_picture_of_many_pixels_is_refused_at_once(
    tmp_path: Path, width: int, height: int
) -> None:
    for n in range(2):
        (tmp_path / f"{n}.png").write_bytes(bomb(width, height) if width <= 30_000 else bomb(9, 9)
            .replace(struct.pack(">II", 9, 9), struct.pack(">II", width, height)))  # fmt: skip
    begin = time.process_time()
    with pytest.raises(SourceError) as told, open_source(str(tmp_path)) as video:
        list(video)
    assert "million" in str(told.value) or "decoded" in str(told.value)
    assert str(2**31) not in str(told.value)  # no number that the picture does not have
    with pytest.raises(DatabaseError):
        read_silhouette(tmp_path / "0.png")
    assert time.process_time() - begin < 2.0


def test_the_size_of_a_picture_is_that_of_its_header() -> None:
    assert image_size(bomb(300, 20)) == (300, 20)
    assert image_size(b"no picture") is None


class Announces:
    """A capture that announces giant frames."""

    released = False

    def get(self, what: int) -> float:
        return 60_000.0

    def release(self) -> None:
        self.released = True


def test_a_video_that_announces_giant_frames_is_refused() -> None:
    capture = Announces()
    with pytest.raises(SourceError, match="60000x60000 pixels"):
        check_frame_size("clip.mp4", capture)  # type: ignore[arg-type]
    assert capture.released


def test_images_whose_size_changes_end_the_source_in_words(tmp_path: Path) -> None:
    import cv2

    for n, side in enumerate((40, 40, 60)):
        cv2.imwrite(str(tmp_path / f"{n}.png"), np.full((40, side, 3), 50 * n, np.uint8))
    with open_source(str(tmp_path)) as video:
        assert len(list(video)) == 2
        assert "60x40" in (video.problem or "")

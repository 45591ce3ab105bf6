"""Folders of images."""

from __future__ import annotations

import random
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.paths import SHARED
from tests.percepts.video.clips import disc_x, picture, write_folder
from visup.agent.model.errors import SourceError
from visup.percepts.video import Ending, open_source
from visup.percepts.video.image_folder import natural_key
from visup.percepts.video.source import to_bgr

VIDEO = SHARED / "video"
NAMES = [f"{i}.png" for i in range(12)]


def test_images_come_in_natural_order(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "clip", NAMES)
    with open_source(str(folder)) as source:
        frames = list(source)
    assert [round(disc_x(f.image)) for f in frames] == [10 + i for i in range(12)]
    assert [f.time for f in frames] == [i / 25 for i in range(12)]
    assert (source.ended, source.frame_count, source.size) == ("complete", 12, (64, 48))
    assert "25 fps is assumed" in source.notes[0]


@given(numbers=st.lists(st.integers(0, 10**6), unique=True), seed=st.integers(0, 99))
@settings(max_examples=50, deadline=None)
def test_natural_order_is_the_order_of_the_numbers(numbers: list[int], seed: int) -> None:
    names = [f"frame_{n}.png" for n in numbers]
    random.Random(seed).shuffle(names)
    assert sorted(names, key=natural_key) == [f"frame_{n}.png" for n in sorted(numbers)]


@pytest.mark.parametrize("suffix", ["png", "jpg", "bmp", "tif", "TIFF", "webp", "ppm"])
def test_common_kinds_of_image_are_read(tmp_path: Path, suffix: str) -> None:
    folder = write_folder(tmp_path / "clip", [f"{i}.{suffix}" for i in range(3)])
    with open_source(str(folder), every=2, fps=10) as source:
        frames = list(source)
    assert [(f.index, f.time) for f in frames] == [(0, 0.0), (2, 0.2)]
    assert [disc_x(f.image) for f in frames] == pytest.approx([10, 12], abs=0.3)
    assert source.notes == ()


@pytest.mark.parametrize(
    ("info", "fps", "note"),
    [
        ("[Sequence]\nname=x\nimDir=img1\nframeRate=7\nimExt=.png\n", 7.0, ""),
        ("[Sequence]\nframeRate=fast\n", 25.0, "no usable frame rate (fast)"),
        ("[Sequence]\nframeRate=-1\n", 25.0, "no usable frame rate (-1)"),
        ("not an ini file", 25.0, "25 fps is assumed"),
    ],
)
@pytest.mark.parametrize("name", ["mot", "mot/img1"])
def test_a_mot_sequence_tells_its_rate(
    tmp_path: Path, info: str, fps: float, note: str, name: str
) -> None:
    write_folder(tmp_path / "mot/img1", ["000001.png", "000002.png"])
    (tmp_path / "mot/seqinfo.ini").write_text(info)
    with open_source(str(tmp_path / name)) as source:
        assert source.fps == fps
        assert note in " ".join(source.notes)
        assert len(list(source)) == 2


def test_a_sequence_folder_of_its_own_name_is_found(tmp_path: Path) -> None:
    write_folder(tmp_path / "mot/pictures", ["1.png"])
    (tmp_path / "mot/seqinfo.ini").write_text("[Sequence]\nimDir=pictures\nframeRate=3\n")
    with open_source(str(tmp_path / "mot")) as source:
        assert source.fps == 3.0


def test_davis_frames_are_found_and_masks_are_not_taken(tmp_path: Path) -> None:
    write_folder(tmp_path / "seq/frames", ["00000.jpg", "00001.jpg"])
    write_folder(tmp_path / "seq/masks", ["00000.png", "00001.png", "00002.png"])
    with open_source(str(tmp_path / "seq")) as source:
        assert len(list(source)) == 2


def write_image(path: Path, image: object) -> None:
    assert cv2.imwrite(str(path), np.asarray(image))


def test_grey_16_bit_and_alpha_become_bgr_of_8_bits(tmp_path: Path) -> None:
    grey = picture(0)[:, :, 0]
    alpha = np.dstack([picture(0), np.full(grey.shape, 255, np.uint8)])
    alpha[:10, :, 3] = 0
    for name, image in {
        "0": grey,
        "1": grey.astype(np.uint16) * 257,
        "2": picture(0).astype(np.uint16) * 257,
        "3": alpha,
    }.items():
        write_image(tmp_path / f"{name}.png", image)
    with open_source(str(tmp_path)) as source:
        images = [f.image for f in source]
    assert source.ended is Ending.COMPLETE
    assert all(i.dtype == np.uint8 and i.shape == (48, 64, 3) for i in images)
    assert np.array_equal(images[0], np.dstack([grey] * 3))
    assert np.array_equal(images[1], images[0])
    assert np.array_equal(images[2], picture(0))
    assert not images[3][:10].any()
    assert np.array_equal(images[3][10:], picture(0)[10:])


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32, np.float32, np.float64])
@pytest.mark.parametrize("shape", [(4, 5), (4, 5, 1), (4, 5, 3)])
def test_full_range_of_every_kind_is_kept(dtype: type, shape: tuple[int, ...]) -> None:
    top = 1.0 if np.issubdtype(dtype, np.floating) else float(np.iinfo(dtype).max)
    out = to_bgr(np.linspace(0, top, int(np.prod(shape))).reshape(shape).astype(dtype))
    assert out.shape == (4, 5, 3)
    assert out.dtype == np.uint8
    assert (out.min(), out.max()) == (0, 255)
    assert out.flags.c_contiguous


@pytest.mark.parametrize("shape", [(5,), (4, 5, 2), (0, 5, 3), (4, 5, 3, 1)])
def test_what_is_no_image_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="shape"):
        to_bgr(np.zeros(shape, np.uint8))


def test_an_image_of_another_size_ends_the_source_and_is_named(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "clip", ["0.png", "1.png"])
    write_image(folder / "2.png", picture(2, (32, 20)))
    with open_source(str(folder)) as source:
        assert len(list(source)) == 2
    assert source.ended is Ending.TRUNCATED
    assert source.problem is not None
    assert "2.png" in source.problem
    assert "32x20" in source.problem
    assert "64x48" in source.problem


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("2.png", b"", "is empty"),
        ("2.png", b"not an image at all", "not an image"),
        ("2.jpg", None, "is cut off"),
        ("2.png", None, "is cut off"),
    ],
)
def test_a_damaged_image_ends_the_source_and_is_named(
    tmp_path: Path, name: str, content: bytes | None, said: str, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = write_folder(tmp_path / "clip", ["0.png", "1.png", name, "3.png"])
    whole = (folder / name).read_bytes()
    (folder / name).write_bytes(whole[: len(whole) // 2] if content is None else content)
    with open_source(str(folder)) as source:
        assert [f.index for f in source] == [0, 1]
    assert source.ended is Ending.TRUNCATED
    assert source.problem is not None
    assert name in source.problem
    assert said in source.problem
    assert capfd.readouterr().err == ""


def test_a_damaged_first_image_is_an_error(tmp_path: Path) -> None:
    folder = write_folder(tmp_path / "clip", ["0.png"])
    (folder / "0.png").write_bytes(b"nothing")
    with pytest.raises(SourceError, match="the first image is not an image"):
        open_source(str(folder))


def test_a_folder_without_images_is_an_error_that_helps(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(SourceError, match="no images") as caught:
        open_source(str(tmp_path))
    assert caught.value.hint == "name a video file or a folder of images"
    write_folder(tmp_path / "shots", ["0.png"])
    with pytest.raises(SourceError) as caught:
        open_source(str(tmp_path))
    assert str(tmp_path / "shots") in (caught.value.hint or "")
    (tmp_path / "film.mp4").write_bytes(b"x")
    with pytest.raises(SourceError) as caught:
        open_source(str(tmp_path))
    assert str(tmp_path / "film.mp4") in (caught.value.hint or "")


def test_a_folder_that_may_not_be_read_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refuse)
    with pytest.raises(SourceError, match="permission"):
        open_source(str(tmp_path))


@pytest.mark.parametrize(
    ("name", "fps"), [("davis/goat", 25.0), ("mot/PETS09-S2L1", 7.0), ("static/highway", 25.0)]
)
def test_shared_sequences_are_read(name: str, fps: float) -> None:
    if not (VIDEO / name).is_dir():
        pytest.skip("the shared sequences are not there")
    with open_source(str(VIDEO / name), every=20) as source:
        frames = [next(source) for _ in range(3)]
        assert source.fps == fps
    assert [f.index for f in frames] == [0, 20, 40]
    assert all(f.size == source.size for f in frames)

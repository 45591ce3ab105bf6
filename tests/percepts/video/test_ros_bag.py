"""ROS 2 bags: what was recorded is what is watched, at the times at which it was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent.model.errors import SourceError
from visup.percepts.video import Ending, open_source
from visup.percepts.video.ros_bag import PLAIN, is_bag

rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="visup[ros] is not installed")
typesys = pytest.importorskip("rosbags.typesys", reason="visup[ros] is not installed")
TYPES = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
PIXELS = st.integers(0, 2**32 - 1).map(
    lambda seed: np.random.default_rng(seed).integers(0, 256, (6, 8, 3)).astype(np.uint8)
)


def header(seconds: float) -> Any:
    stamp = TYPES.types["builtin_interfaces/msg/Time"](sec=int(seconds), nanosec=0)
    return TYPES.types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")


def image(pixels: NDArray[Any], encoding: str, *, fill: int = 0, big: bool = False) -> Any:
    """A message of pixels, each row filled up by some bytes."""
    ordered = pixels.astype(pixels.dtype.newbyteorder(">" if big else "<"))
    rows = ordered.reshape(pixels.shape[0], -1).view(np.uint8)
    padded = np.pad(rows, ((0, 0), (0, fill)))
    return TYPES.types["sensor_msgs/msg/Image"](
        header=header(0.0),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding=encoding,
        is_bigendian=int(big),
        step=padded.shape[1],
        data=padded.reshape(-1),
    )


def compressed(pixels: NDArray[np.uint8]) -> Any:
    done, data = cv2.imencode(".png", pixels)
    assert done
    made = TYPES.types["sensor_msgs/msg/CompressedImage"]
    return made(header=header(0.0), format="png", data=data.reshape(-1))


def bag(folder: Path, topics: Mapping[str, Sequence[Any]], fps: float = 10.0) -> Path:
    """A bag with messages at a constant rate, from second 5 on."""
    with rosbag2.Writer(folder, version=8) as writer:
        for topic, messages in topics.items():
            kind = messages[0].__msgtype__
            connection = writer.add_connection(topic, kind, typestore=TYPES)
            for n, message in enumerate(messages):
                stamp = round((5 + n / fps) * 1e9)
                writer.write(connection, stamp, TYPES.serialize_cdr(message, kind))
    return folder


def watched(source: str, **options: Any) -> list[Any]:
    with open_source(source, **options) as video:
        return list(video)


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(PIXELS, st.sampled_from(sorted(PLAIN)), st.integers(0, 5), st.booleans())
def test_pixels_come_back_as_they_were_whatever_their_encoding(
    tmp_path_factory: pytest.TempPathFactory,
    pixels: NDArray[np.uint8],
    encoding: str,
    fill: int,
    big: bool,
) -> None:
    kind, values = PLAIN[encoding]
    stored = pixels if values == 3 else np.dstack([pixels, np.full((6, 8), 255, np.uint8)])
    expected = pixels
    if values == 1:
        stored = pixels[:, :, 0]
        expected = np.repeat(pixels[:, :, :1], 3, axis=2)
    if kind == "u2":
        stored = stored.astype(np.uint16) * 257
    if encoding.startswith("rgb"):
        expected = pixels[:, :, ::-1]
    message = image(stored, encoding, fill=fill * stored.dtype.itemsize, big=big)
    place = bag(tmp_path_factory.mktemp("bag") / "b", {"/camera": [message]})
    (frame,) = watched(str(place))
    assert np.array_equal(frame.image, expected)


def test_times_rate_and_count_are_those_of_the_recording(tmp_path: Path) -> None:
    pictures = [compressed(np.full((4, 4, 3), 20 * n, np.uint8)) for n in range(8)]
    place = str(bag(tmp_path / "b", {"/camera/compressed": pictures}, fps=20.0))
    frames = watched(place)
    assert [f.index for f in frames] == list(range(8))
    assert [f.time for f in frames] == pytest.approx([n / 20 for n in range(8)])
    assert [int(f.image[0, 0, 0]) for f in frames] == [20 * n for n in range(8)]
    every = watched(place, every=3)
    assert [(f.index, f.time) for f in every] == [(n, pytest.approx(n / 20)) for n in (0, 3, 6)]
    with open_source(place) as video:
        assert (video.size, video.frame_count) == ((4, 4), 8)
        assert video.fps == pytest.approx(20.0)
    assert [f.time for f in watched(place, fps=5.0)] == pytest.approx([n / 5 for n in range(8)])


def test_the_storage_file_is_the_same_as_the_folder(tmp_path: Path) -> None:
    place = bag(tmp_path / "b", {"/camera": [image(np.zeros((4, 4), np.uint8), "mono8")] * 3})
    (storage,) = place.glob("*.db3")
    assert is_bag(place)
    assert is_bag(storage)
    assert not is_bag(tmp_path)
    assert len(watched(str(storage))) == len(watched(str(place))) == 3


def test_of_several_cameras_one_is_named(tmp_path: Path) -> None:
    left, right = (np.full((4, 4), n, np.uint8) for n in (10, 200))
    topics = {"/left/image": [image(left, "mono8")], "/right/image": [image(right, "mono8")]}
    place = str(bag(tmp_path / "b", topics))
    assert watched(f"{place}#/right/image")[0].image[0, 0, 0] == 200
    with pytest.raises(SourceError, match="several topics") as refused:
        watched(place)
    assert "/left/image, /right/image" in str(refused.value)
    with pytest.raises(SourceError, match="no such pictures") as slip:
        watched(f"{place}#/rigth/image")
    assert f"{place}#/right/image" in str(slip.value)


def test_what_is_no_picture_ends_in_words_and_what_came_before_is_kept(tmp_path: Path) -> None:
    good = image(np.zeros((4, 4), np.uint8), "mono8")
    bad = {
        "odd": (image(np.zeros((4, 5), np.uint8), "mono8"), "is 5x4, but those before it are 4x4"),
        "depth": (image(np.zeros((4, 4), np.float32), "32FC1"), "is encoded as '32FC1'"),
        "cut": (image(np.zeros((4, 4), np.uint8), "bgr8"), "too few for 4x4"),
    }
    for name, (message, told) in bad.items():
        with open_source(str(bag(tmp_path / name, {"/camera": [good, good, message]}))) as video:
            assert len(list(video)) == 2
            assert video.ended is Ending.TRUNCATED
            assert told in str(video.problem)
        with pytest.raises(SourceError, match="first picture"):
            watched(str(bag(tmp_path / f"{name}-first", {"/camera": [bad["depth"][0]]})))


def test_bags_without_pictures_and_damaged_ones_are_refused_in_words(tmp_path: Path) -> None:
    place = bag(tmp_path / "b", {"/odometry": [header(1.0)]})
    with pytest.raises(SourceError, match="no pictures") as refused:
        watched(str(place))
    assert "/odometry" in str(refused.value)
    (tmp_path / "damaged.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 40)
    (tmp_path / "damaged.db3").write_bytes(b"SQLite format 3\0" + b"\1" * 400)
    for name in ("damaged.mcap", "damaged.db3"):
        with pytest.raises(SourceError, match="the bag cannot be read"):
            watched(str(tmp_path / name))


@pytest.mark.parametrize("pattern", ["rggb", "bggr", "gbrg", "grbg"])
def test_a_bayer_pattern_of_one_colour_is_that_colour(tmp_path: Path, pattern: str) -> None:
    colour = {"r": 200, "g": 100, "b": 20}
    tile = np.array([colour[c] for c in pattern], np.uint8).reshape(2, 2)
    place = bag(tmp_path / "b", {"/raw": [image(np.tile(tile, (4, 4)), f"bayer_{pattern}8")]})
    assert watched(str(place))[0].image[4, 4].tolist() == [20, 100, 200]


@pytest.mark.parametrize("encoding", ["yuv422", "yuv422_yuy2"])
def test_brightness_of_yuv_is_read_from_its_own_bytes(tmp_path: Path, encoding: str) -> None:
    pixel = [128, 235] if encoding == "yuv422" else [235, 128]
    place = bag(tmp_path / "b", {"/raw": [image(np.full((4, 4, 2), pixel, np.uint8), encoding)]})
    assert watched(str(place))[0].image.min() > 250

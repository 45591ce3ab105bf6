"""Video files: frames, times, and how they end."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.paths import SHARED
from tests.percepts.video.clips import COUNT, cut, disc_x, write_video
from visup.agent.model.errors import SettingsError, SourceError
from visup.percepts.video import Ending, open_source
from visup.percepts.video.video_file import ContainerClock, falls_short

KINDS = [("a.avi", "MJPG"), ("a.avi", "FFV1"), ("a.webm", "VP80"), ("a.mp4", "mp4v")]
REAL = sorted((SHARED / "video/real").glob("*.avi"))


@pytest.mark.parametrize(("name", "fourcc"), KINDS)
def test_every_frame_comes_once_in_order_with_its_time(
    tmp_path: Path, name: str, fourcc: str
) -> None:
    path = write_video(tmp_path / name, fourcc)
    with open_source(str(path)) as source:
        frames = list(source)
    assert [f.index for f in frames] == list(range(COUNT))
    assert [f.time for f in frames] == pytest.approx([i / 12.5 for i in range(COUNT)])
    assert {f.image.shape for f in frames} == {(48, 64, 3)}
    assert {f.image.dtype for f in frames} == {np.dtype(np.uint8)}
    moved = np.diff([disc_x(f.image) for f in frames])
    assert moved == pytest.approx(np.ones(COUNT - 1), abs=0.5)
    assert (source.ended, source.problem) == (Ending.COMPLETE, None)
    assert (source.fps, source.size, source.frame_count, source.live) == (
        12.5,
        (64, 48),
        COUNT,
        False,
    )


@pytest.mark.parametrize("every", [1, 2, 7, 100])
def test_every_keeps_numbers_and_times_of_the_source(tmp_path: Path, every: int) -> None:
    path = str(write_video(tmp_path / "a.avi"))
    with open_source(path) as whole, open_source(path, every=every) as thinned:
        wanted = [f for f in whole if f.index % every == 0]
        given_frames = list(thinned)
    assert [(f.index, f.time) for f in given_frames] == [(f.index, f.time) for f in wanted]
    for a, b in zip(given_frames, wanted, strict=True):
        assert np.array_equal(a.image, b.image)
    assert thinned.ended == "complete"


def test_a_given_rate_replaces_that_of_the_file(tmp_path: Path) -> None:
    with open_source(str(write_video(tmp_path / "a.avi")), fps=50.0) as source:
        assert source.fps == 50.0
        assert [f.time for f in source] == [i / 50.0 for i in range(COUNT)]


def test_the_same_file_gives_the_same_frames(tmp_path: Path) -> None:
    path = str(write_video(tmp_path / "a.webm", "VP80"))
    with open_source(path) as first, open_source(path) as second:
        for a, b in zip(first, second, strict=True):
            assert a.time == b.time
            assert np.array_equal(a.image, b.image)


@pytest.mark.parametrize("size", [(65, 49), (16, 120), (2, 2), (641, 3)])
def test_odd_sizes_are_read(tmp_path: Path, size: tuple[int, int]) -> None:
    path = write_video(tmp_path / "a.avi", "FFV1", size=size, count=3)
    with open_source(str(path)) as source:
        frames = list(source)
    assert len(frames) == 3
    assert all(f.size == source.size for f in frames)


@pytest.mark.parametrize("share", [0.4, 0.6, 0.85])
@pytest.mark.parametrize(("name", "fourcc"), [k for k in KINDS if k[1] != "mp4v"])
def test_a_file_cut_in_the_middle_keeps_what_was_seen_and_says_so(
    tmp_path: Path, name: str, fourcc: str, share: float
) -> None:
    path = cut(write_video(tmp_path / name, fourcc), share)
    with open_source(str(path)) as source:
        frames = list(source)
    assert 0 < len(frames) < COUNT
    assert source.ended is Ending.TRUNCATED
    assert source.problem is not None
    assert f"{len(frames)} of the {COUNT} frames" in source.problem


def test_thinning_does_not_hide_that_a_file_is_cut(tmp_path: Path) -> None:
    path = cut(write_video(tmp_path / "a.avi"), 0.6)
    with open_source(str(path), every=5) as source:
        assert [f.index for f in source] == [0, 5, 10]
    assert source.ended is Ending.TRUNCATED


def test_a_source_left_early_was_stopped_and_gives_no_more(tmp_path: Path) -> None:
    with open_source(str(write_video(tmp_path / "a.avi"))) as source:
        next(source)
        assert source.ended is None
    assert str(source.ended) == "stopped"
    assert source.problem is None
    assert list(source) == []


def bad_file(tmp_path: Path, name: str, content: bytes | None) -> str:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    return str(path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("gone.mp4", None, "no such file"),
        ("empty.mp4", b"", "the file is empty"),
        ("text.mp4", b"Dear diary,\ntoday I filmed a cat.\n" * 50, "text file"),
        ("text.txt", "schön\n".encode() * 2000, "text file"),
        ("noise.mp4", bytes(np.random.default_rng(1).bytes(4000)), "not a video"),
        ("zeros.avi", bytes(5000), "not a video"),
        ("photo.jpg", b"\xff\xd8\xff\xe0" + bytes(500), "single image"),
        ("\0", None, "not a usable file name|no such file"),
    ],
)
def test_what_is_no_video_is_told_in_one_clear_message(
    tmp_path: Path,
    name: str,
    content: bytes | None,
    message: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SourceError, match=message) as caught:
        open_source(bad_file(tmp_path, name, content))
    assert caught.value.where
    assert capfd.readouterr() == ("", "")


def test_a_damaged_header_is_an_error(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = cut(write_video(tmp_path / "a.mp4", "mp4v"), 0.5)
    with pytest.raises(SourceError, match="header is damaged"):
        open_source(str(path))
    assert capfd.readouterr().err == ""


def test_a_video_without_frames_is_an_error(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.avi", count=1)
    data = path.read_bytes()
    path.write_bytes(data[: data.index(b"movi") + 4])
    with pytest.raises(SourceError, match=r"no frame that can be decoded|not a video"):
        open_source(str(path))


def test_a_near_miss_in_the_name_is_suggested(tmp_path: Path) -> None:
    write_video(tmp_path / "capture.avi", count=1)
    with pytest.raises(SourceError) as caught:
        open_source(str(tmp_path / "captur.avi"))
    assert caught.value.hint == f"did you mean {tmp_path / 'capture.avi'}?"


@pytest.mark.parametrize("there", ["short.mp4", "b.mp4", "report.mp4"])
def test_that_the_endings_are_alike_makes_no_name_near(tmp_path: Path, there: str) -> None:
    (tmp_path / there).touch()
    with pytest.raises(SourceError) as caught:
        open_source(str(tmp_path / "cart.mp4"))
    assert caught.value.hint == "check the name"


def test_a_file_that_may_not_be_read_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_video(tmp_path / "a.avi", count=1)

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(SourceError, match="permission"):
        open_source(str(path))


@pytest.mark.parametrize(("every", "fps"), [(0, None), (-3, None), (1, 0.0), (1, float("nan"))])
def test_settings_that_cannot_be_are_refused(every: int, fps: float | None) -> None:
    with pytest.raises(SettingsError):
        open_source("any.mp4", every=every, fps=fps)


@given(
    times=st.lists(st.floats(-1e3, 1e6) | st.just(float("nan")), min_size=1, max_size=60),
    fps=st.floats(0.5, 500),
)
@settings(max_examples=100, deadline=None)
def test_times_start_at_zero_and_always_grow(times: list[float], fps: float) -> None:
    clock = ContainerClock(fps)
    out = [clock.time(i, t) for i, t in enumerate(times)]
    assert out[0] == 0.0
    least = 0.1 / fps - 1e-9 * out[-1]
    assert all(b > a and b - a >= least for a, b in itertools.pairwise(out))


@given(gaps=st.lists(st.floats(0.01, 2.0), max_size=50), start=st.floats(0, 100))
@settings(max_examples=100, deadline=None)
def test_a_rate_that_varies_is_honoured(gaps: list[float], start: float) -> None:
    true = [0.0, *np.cumsum(gaps).tolist()]
    clock = ContainerClock(25.0)
    out = [clock.time(i, start + t) for i, t in enumerate(true)]
    assert out == pytest.approx(true, abs=0.0021)


def test_times_rounded_by_the_container_become_exact_again() -> None:
    clock = ContainerClock(30.0)
    assert [clock.time(i, round(i / 30, 3)) for i in range(100)] == [i / 30 for i in range(100)]


@pytest.mark.parametrize(
    ("read", "last_time", "announced", "short"),
    [
        (750, 29.96, 750, False),
        (748, 29.88, 750, False),  # containers miscount by a frame or two
        (600, 23.96, 750, True),
        (400, 29.96, 750, False),  # varying rate: fewer frames, but the whole time
        (760, 30.36, 750, False),
        (3, 0.08, None, False),
        (3, 0.08, 30, True),
        (89_990, 3599.5, 90_000, False),
        (89_000, 3559.9, 90_000, True),
    ],
)
def test_a_video_is_cut_when_count_and_time_both_fall_short(
    read: int, last_time: float, announced: int | None, short: bool
) -> None:
    assert falls_short(read, last_time, announced, 25.0) is short


@pytest.mark.skipif(not REAL, reason="the shared road clips are not there")
@pytest.mark.parametrize("path", REAL, ids=lambda p: p.name)
def test_real_clips_are_read_to_their_end(path: Path) -> None:
    with open_source(str(path), every=10) as source:
        frames = list(source)
    assert source.ended is Ending.COMPLETE
    assert len(frames) > 30
    assert all(f.size == source.size for f in frames)
    assert np.diff([f.time for f in frames]).min() > 0

"""Every alert has a picture and a clip from before to after it, whatever happens in between."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.clips import moving_disc, write_clip
from visup.agent import Alert, Frame, Mind, Observation, Severity
from visup.agent.model.step import Step
from visup.runs.evidence.clip_spool import SUFFIX, ClipSpool, at_constant_rate, spooled
from visup.runs.evidence.frame_ring import MAX_REUSE_S, EncodedFrame, FrameEncoder, FrameRing
from visup.runs.evidence.keeper import EVIDENCE, EvidenceKeeper
from visup.runs.runner import fresh_folder, supervise
from visup.runs.settings import EvidenceOptions, RunOptions, WatchSettings

TIMES = st.lists(st.floats(0.0, 50.0), max_size=40).map(sorted)


@given(TIMES, st.lists(st.integers(0, 50), min_size=40, max_size=40), st.floats(0.0, 20.0))
def test_a_ring_holds_the_last_frames_within_its_limits(
    times: list[float], sizes: list[int], span: float
) -> None:
    ring, added = FrameRing(span, 100), []
    for time, size in zip(times, sizes, strict=False):
        added.append(EncodedFrame(time, b"x" * size))
        ring.add(added[-1])
        held = list(ring)
        assert ring.size == sum(len(f.jpeg) for f in held) <= 100
        assert held == added[len(added) - len(held) :]
        assert all(time - f.time <= span for f in held)
        missed = added[: len(added) - len(held)][-1:]
        assert all(time - f.time > span or ring.size + len(f.jpeg) > 100 for f in missed)


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(0, 2**16))
def test_reused_frames_show_every_visible_change_and_are_under_a_second_old(
    moves: list[bool], seed: int
) -> None:
    """Noise of a camera is nothing to be seen; a change of ten levels on one cell is."""
    rng, encode = np.random.default_rng(seed), FrameEncoder()
    ground, shown_at = np.full((48, 64, 3), 100, np.uint8), 0.0
    kept: bytes | None = None
    for number, moved in enumerate(moves):
        time = number / 5.0
        if moved:
            ground[8:16, 8:16] = 100 + 10 * (ground[8, 8] == 100)
        noisy = np.clip(ground + rng.normal(0.0, 2.0, ground.shape), 0, 255).astype(np.uint8)
        frame = encode(noisy, time)
        assert frame.time == time
        if frame.jpeg != kept:
            kept, shown_at = frame.jpeg, time
        assert time - shown_at < MAX_REUSE_S
        assert not moved or shown_at == time


@given(TIMES, st.floats(1.0, 30.0))
def test_a_clip_is_as_long_as_its_frames(times: list[float], fps: float) -> None:
    frames = [EncodedFrame(t, b"") for t in times]
    shown = list(at_constant_rate(frames, fps))
    assert [f.time for f in shown] == sorted(f.time for f in shown)
    if frames:
        assert abs((len(shown) - 1) / fps - (times[-1] - times[0])) <= 1.0 / fps + 1e-6
        assert shown[-1] is frames[-1]


@given(st.lists(st.binary(max_size=20), max_size=6), st.integers(0, 300))
def test_a_truncated_spool_yields_its_complete_frames(
    tmp_path_factory: pytest.TempPathFactory, pictures: list[bytes], cut: int
) -> None:
    path = tmp_path_factory.mktemp("spool") / f"a{SUFFIX}"
    spool = ClipSpool(path)
    frames = [EncodedFrame(i / 5.0, jpeg) for i, jpeg in enumerate(pictures)]
    for frame in frames:
        spool.add(frame)
    spool.close()
    assert list(spooled(path)) == frames
    path.write_bytes(path.read_bytes()[:cut])
    left = list(spooled(path))
    assert left == frames[: len(left)]


def alert(number: int, opened: float, closed: float | None = None) -> Alert:
    return Alert(number, "seen", Severity.WARNING, opened, opened, (), "Seen.", closed=closed)


def step(number: int, *alerts: Alert) -> Step:
    time = number / 10.0
    observation = Observation(number, time, (128, 72), ())
    still = tuple(a for a in alerts if a.closed is None)
    mind = Mind(time=time, frame_index=number, frame_size=(128, 72), alerts=still)
    return Step(number, time, observation, mind, alerts=alerts)


FRAMES = [Frame(i, i / 10.0, image) for i, image in enumerate(moving_disc(60, (128, 72)))]
OPTIONS = EvidenceOptions(before_s=1.0, after_s=0.5)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return fresh_folder(tmp_path / "cell" / "run", "")


def watch(keeper: EvidenceKeeper, frames: Iterator[Frame], **alerts: Alert) -> None:
    for frame in frames:
        named = alerts.get(f"at_{frame.index}")
        keeper(step(frame.index, *([named] if named else [])), frame)


def frames_in(clip: Path) -> int:
    video, count = cv2.VideoCapture(str(clip)), 0
    while video.grab():
        count += 1
    return count


def test_an_alert_has_a_picture_at_once_and_later_a_clip(run: Path) -> None:
    keeper = EvidenceKeeper(run, OPTIONS, 10.0)
    first = alert(1, 3.0)
    watch(keeper, iter(FRAMES[:31]), at_30=first)
    links = keeper.links(first)
    picture = cv2.imread(links["snapshot"])
    assert picture is not None
    assert picture.shape == (72, 128, 3)
    assert not Path(links["clip"]).exists()
    watch(keeper, iter(FRAMES[31:40]))
    keeper.close()
    assert abs(frames_in(Path(links["clip"])) - 16) <= 1  # from 2.0 to 3.5 s
    told = json.loads((run / EVIDENCE / "alert-1.json").read_text())
    assert (told["id"], told["cause"], told["clip"]) == (1, "Seen.", "alert-1.webm")
    assert keeper.links(alert(1, 3.0, closed=4.0)) == links
    assert [p.suffix for p in (run / EVIDENCE).iterdir() if p.name.startswith(".")] == []


def test_concurrent_alerts_share_a_clip_and_links_follow_the_options(run: Path) -> None:
    keeper = EvidenceKeeper(run, EvidenceOptions(1.0, 0.5, link="https://cell/v/yard"), 10.0)
    one, two, three = alert(1, 1.0), alert(2, 1.3), alert(3, 4.0)
    watch(keeper, iter(FRAMES), at_10=one, at_13=two, at_40=three)
    keeper.close()
    assert keeper.links(one)["clip"] == "https://cell/v/yard/run/evidence/alert-1.webm"
    assert keeper.links(two)["clip"] == keeper.links(one)["clip"]
    assert keeper.links(three)["clip"].endswith("alert-3.webm")
    assert sorted(p.name for p in (run / EVIDENCE).glob("*.webm")) == [
        "alert-1.webm",
        "alert-3.webm",
    ]


def test_a_resumed_process_finishes_the_clip_and_has_its_links(run: Path) -> None:
    killed = EvidenceKeeper(run, OPTIONS, 10.0)
    first = alert(1, 2.0)
    watch(killed, iter(FRAMES[:23]), at_20=first)
    assert killed._clip
    killed._clip.close()  # as the system does
    again = EvidenceKeeper(run.parent / "next", OPTIONS, 10.0)
    again.close()
    assert frames_in(run / EVIDENCE / "alert-1.webm") >= 10
    assert list((run / EVIDENCE).glob(f"*{SUFFIX}")) == []
    resumed = EvidenceKeeper(run, OPTIONS, 10.0)
    assert resumed.links(first) == killed.links(first)
    assert resumed.links(alert(9, 1.0)) == {}
    resumed.close()


def test_a_full_disk_is_reported_and_stops_nothing(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    keeper = EvidenceKeeper(run, OPTIONS, 10.0)

    def no_room(spool: ClipSpool, frame: EncodedFrame) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as full:
        full.setattr(ClipSpool, "add", no_room)
        watch(keeper, iter(FRAMES[:20]), at_10=alert(1, 1.0))
    (fault,) = keeper.runtime_faults()
    assert "No space left" in fault.evidence[0]
    watch(keeper, iter(FRAMES[20:60]), at_30=alert(2, 3.0))
    assert list(keeper.runtime_faults()) == []
    keeper.close()
    assert frames_in(run / EVIDENCE / "alert-2.webm") >= 14


def test_records_for_sinks_link_to_the_evidence(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "disc.avi", moving_disc(30))
    (tmp_path / "own.rules").write_text(
        'rule seen(a): warning\n    when in_view(a) > 0.1 s\n    say "{a} {is} seen."\n'
    )
    settings = WatchSettings(str(clip), rules=(tmp_path / "own.rules",))
    told = tmp_path / "alerts.jsonl"
    options = RunOptions(video=False, report=False, sinks=(f"file:{told}",), evidence=OPTIONS)
    supervise(settings, fresh_folder(tmp_path / "run", ""), options=options)
    records = [json.loads(line) for line in told.read_text().splitlines()]
    opened = [r for r in records if r.get("state") == "opened"]
    assert opened
    for record in opened:
        assert Path(record["snapshot"]).stat().st_size > 100
        assert frames_in(Path(record["clip"])) > 3

"""Chunks of a long video, watched in parallel and stitched: the result is the run of the whole video."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.archive.recordings import meeting, record
from tests.archive.watches import clips, scripted
from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from visup.agent import Observation
from visup.agent.storage.codec import to_document
from visup.agent.storage.journal_reader import Recording
from visup.archive.chunks.extending import extend_chunk
from visup.archive.chunks.region_matching import RegionNumbers
from visup.archive.chunks.seams import find_parts
from visup.archive.chunks.spans import ChunkSpan, Cutting, chunk_spans
from visup.archive.chunks.stitching import stitched
from visup.archive.filling.attempts import Attempts
from visup.archive.filling.clips import Clip
from visup.archive.filling.filling import FillResult, clear_attempts, fill, only_filler
from visup.archive.filling.plan import Plan, make_plan
from visup.archive.filling.pool import Pool
from visup.archive.filling.watching import watch_into
from visup.archive.lake import Lake
from visup.archive.schema import TABLES
from visup.runs.settings import WatchSettings
from visup.runs.wiring import open_video, reasoning_agent

pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

WHOLE = tuple(meeting(50))
DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})


@dataclass(frozen=True, slots=True)
class ScriptedRecording(Recording):
    """A chunk whose recording is a list."""

    path: Path = Path("nowhere")
    recorded: list[Observation] = field(default_factory=list)

    def observations(self, after: int = -1) -> Iterator[Observation]:
        return (o for o in list(self.recorded) if o.frame_index > after)

    def first_and_last(self) -> tuple[int, int] | None:
        return (
            (self.recorded[0].frame_index, self.recorded[-1].frame_index) if self.recorded else None
        )


def chunk(begin: int, end: int | None, region_ids: Sequence[int] = (1, 2, 3)) -> ScriptedRecording:
    """Part of the meeting as recorded by a chunk, with region ids of its own."""
    renumbering = RegionNumbers(dict(enumerate(region_ids, 1)))
    return ScriptedRecording(recorded=[renumbering.renumbered(o) for o in WHOLE[begin:end]])


def without(observation: Observation, region: int) -> Observation:
    """An observation without one of its regions."""
    reports = tuple(
        replace(r, percepts=tuple(p for p in r.percepts if _about(p.value) != region))
        for r in observation.reports
    )
    return replace(observation, reports=reports)


def _about(value: object) -> object:
    return getattr(value, "region_id", getattr(value, "id", None))


def no_extension(chunk: Recording, end: int) -> None:
    raise AssertionError("no chunk is to be extended")


def ids(observations: Iterable[Observation]) -> list[list[int]]:
    return [[r.id for r in o.of("region")] for o in observations]


def events(observations: Sequence[Observation]) -> list[object]:
    agent = reasoning_agent(DOCK)
    return [agent.reason(o).events for o in observations]


@pytest.fixture(scope="module")
def whole_events() -> list[object]:
    """The events of the meeting, not cut into chunks."""
    return events(WHOLE)


@given(frames=st.integers(0, 5000), length=st.integers(1, 400), warm_up=st.integers(0, 60))
def test_chunks_cover_every_frame(frames: int, length: int, warm_up: int) -> None:
    spans = chunk_spans(frames, length, warm_up)
    assert (spans[0].begin, spans[-1].end) == (0, None)
    for chunk_span, next_span in pairwise(spans):
        assert chunk_span.end is not None
        assert chunk_span.begin <= next_span.begin <= chunk_span.end
        assert chunk_span.end - next_span.begin == 2 * warm_up or next_span.begin == 0
        assert chunk_span.end - warm_up - (chunk_span.begin + warm_up) <= 2 * length


@settings(deadline=None, max_examples=5)
@given(
    edges=st.tuples(st.integers(12, 20), st.integers(26, 40)),
    numbers=st.tuples(*[st.permutations([1, 2, 3, 7])] * 2),
)
def test_stitched_chunks_give_the_events_of_the_whole(
    whole_events: list[object], edges: tuple[int, int], numbers: tuple[list[int], list[int]]
) -> None:
    a, b = edges
    chunks = [chunk(0, a + 6), chunk(a - 6, b + 6, numbers[0]), chunk(b - 6, None, numbers[1])]
    observations = list(stitched(find_parts(chunks, no_extension)))
    assert [o.frame_index for o in observations] == list(range(len(WHOLE)))
    assert ids(observations) == ids(WHOLE)
    assert events(observations) == whole_events


def test_a_chunk_is_extended_until_both_observe_the_same() -> None:
    old, new = chunk(0, 20), chunk(10, None, (2, 1, 3))
    new.recorded[:15] = [without(o, 1) for o in new.recorded[:15]]  # until frame 25
    requested = list[int]()

    def extend(on: Recording, end: int) -> None:
        requested.append(end)
        old.recorded.extend(WHOLE[len(old.recorded) : end])

    parts = find_parts([old, new], extend)
    assert requested == [70]  # five seconds on
    assert parts[1].first >= 25
    assert ids(stitched(parts)) == ids(WHOLE)


def test_chunks_that_never_agree_are_merged_or_stitched_at_the_limit() -> None:
    old, end = chunk(0, 20), len(WHOLE)

    def extend(on: Recording, end: int) -> None:
        old.recorded.extend(WHOLE[len(old.recorded) : end])

    never = ScriptedRecording(recorded=[without(o, 1) for o in WHOLE[10:]])
    (only,) = find_parts([old, never], extend)
    assert (only.chunk, len(old.recorded)) == (old, end)
    stays = chunk(0, 20)
    parts = find_parts([stays, never], lambda on, end: None)
    assert 15 <= parts[1].first < 20
    observations = list(stitched(parts))
    assert [o.frame_index for o in observations] == list(range(end))
    assert ids(observations)[:15] == ids(WHOLE)[:15]


def test_a_region_of_only_the_later_chunk_gets_a_new_id() -> None:
    old = ScriptedRecording(recorded=[without(without(o, 2), 3) for o in WHOLE[:30]])
    observations = list(stitched(find_parts([old, chunk(20, None)], lambda on, end: None)))
    assert {r.id for o in observations for r in o.of("region")} == {1, 2, 3}
    assert {h.region_id for o in observations for h in o.of("hypothesis")} <= {1, 2, 3}


def test_an_empty_chunk_is_skipped() -> None:
    observations = list(
        stitched(find_parts([chunk(0, 20), chunk(14, None), ScriptedRecording()], no_extension))
    )
    assert [o.frame_index for o in observations] == list(range(len(WHOLE)))


def test_an_extended_chunk_equals_one_watched_at_once(tmp_path: Path) -> None:
    clip = WatchSettings(str(write_clip(tmp_path / "disc.avi", moving_disc(24))))
    for name, end in (("cut", 16), ("whole", 22)):
        (tmp_path / name).mkdir()
        watch_into(clip, tmp_path / name, (4, end))
    extended, complete = (Recording.open(tmp_path / name) for name in ("cut", "whole"))
    extend_chunk(clip, extended, 22)
    assert extended.first_and_last() == complete.first_and_last() == (4, 21)
    assert [to_document(o) for o in extended.observations()] == [
        to_document(o) for o in complete.observations()
    ]


def test_a_span_of_a_video_has_its_frames_and_times(tmp_path: Path) -> None:
    path = write_clip(tmp_path / "disc.avi", moving_disc(12))
    with open_video(WatchSettings(str(path))) as source:
        whole = [(f.index, f.time, f.image.tobytes()) for f in source]
    with open_video(WatchSettings(str(path)), (5, 9)) as source:
        assert [(f.index, f.time, f.image.tobytes()) for f in source] == whole[5:9]


def chunked(settings: WatchSettings, folder: Path, span: tuple[int, int | None]) -> None:
    """A chunk of the meeting that `scripted` records whole."""
    if Path(settings.source).read_text().startswith("half") and span[0]:
        raise RuntimeError("the fuse blew")
    shift = float(Path(settings.source).read_text().removeprefix("half"))
    record(folder, tuple(meeting(12, shift=shift))[slice(*span)], settings)


def fill_in_chunks(lake: Lake, chunk_clips: list[Clip], watch: object = chunked) -> FillResult:
    plan = make_plan(lake, chunk_clips, WatchSettings(""))
    spans = chunk_spans(12, 6, 3)
    jobs = tuple(replace(job, spans=spans) for job in plan.jobs)
    return fill(lake, Plan(jobs, plan.present), Pool(), lambda outcome: None, watch)  # type: ignore[arg-type]


def rows(lake: Lake) -> dict[str, list[object]]:
    return {name: list(lake.rows(name)) for name in TABLES}


def test_a_lake_filled_in_chunks_equals_one_of_whole_clips(tmp_path: Path) -> None:
    clip_list = clips(tmp_path / "clips", "1", "2")
    lake, whole = Lake.create(tmp_path / "lake"), Lake.create(tmp_path / "whole")
    assert fill_in_chunks(lake, clip_list).added == 2
    fill(
        whole,
        make_plan(whole, clip_list, WatchSettings("")),
        Pool(),
        lambda outcome: None,
        scripted,
    )
    assert rows(lake) == rows(whole)
    assert not (lake.path / "chunks").exists()


def test_finished_chunks_are_not_watched_again(tmp_path: Path) -> None:
    clip_list, lake = clips(tmp_path / "clips", "1"), Lake.create(tmp_path / "lake")
    started = list[tuple[int, int | None]]()

    class Killed(BaseException):
        """The worker dies."""

    def watch(settings: WatchSettings, folder: Path, span: tuple[int, int | None]) -> None:
        started.append(span)
        if len(started) == 2:
            raise Killed
        chunked(settings, folder, span)

    for _ in range(2):
        with only_filler(lake):
            clear_attempts(lake, retry=False)
            try:
                fill_in_chunks(lake, clip_list, watch)
            except Killed:
                assert lake.runs() == []
    assert len(lake.runs()) == 1
    assert started == [(0, 9), (3, None), (3, None)]


def test_a_failed_chunk_fails_only_its_clip(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    result = fill_in_chunks(lake, clips(tmp_path / "clips", "half1", "2"))
    assert (result.added, [f.reason for f in result.failed]) == (
        1,
        ["visup has a fault: RuntimeError: the fuse blew"],
    )


def test_a_chunk_that_kills_two_workers_sets_its_clip_aside(tmp_path: Path) -> None:
    clip_list, lake = clips(tmp_path / "clips", "1"), Lake.create(tmp_path / "lake")
    (job,) = make_plan(lake, clip_list, WatchSettings("")).jobs
    Attempts(lake.path, f"{job.run}-1").exhaust()
    result = fill_in_chunks(lake, clip_list)
    assert [f.put_aside for f in result.failed] == [True]
    assert [f.put_aside for f in make_plan(lake, clip_list, WatchSettings("")).failed] == [True]


def test_a_video_is_watched_in_chunks(tmp_path: Path) -> None:
    path = write_clip(tmp_path / "disc.avi", moving_disc(50))
    lake, cutting = Lake.create(tmp_path / "lake"), Cutting(1.0, 0.2)
    clip_list = [Clip(path, taken=0.0)]
    plan = make_plan(lake, clip_list, WatchSettings(""), cutting)
    assert plan.jobs[0].spans == (ChunkSpan(0, 30), ChunkSpan(20, None))
    assert plan.jobs[0].run != make_plan(lake, clip_list, WatchSettings("")).jobs[0].run
    result = fill(lake, plan, Pool(), lambda outcome: None, watch_into)
    assert (result.failed, result.added) == ([], 1)
    (run,) = lake.rows("runs")
    assert (run["steps"], run["ended"], run["source"]) == (50, "complete", str(path))
    recording = Recording.open(lake.folder_of(run["run"]))
    assert [first for first, _ in recording.facts()["chunks"]] == [0, 20]
    assert make_plan(lake, clip_list, WatchSettings(""), cutting).present == 1
    assert make_plan(lake, clip_list, WatchSettings(""), Cutting(60.0)).jobs[0].spans == ()


def test_chunks_no_longer_than_their_warm_up_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    write_clip(tmp_path / "disc.avi", moving_disc(20))
    arguments = ("archive", "run", tmp_path / "disc.avi", "--into", tmp_path / "lake", "--plan")
    assert visup(*arguments, "--chunk", 5).code == 2
    assert "1 to watch" in visup(*arguments, "--chunk", 60).out
